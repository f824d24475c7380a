"""The runs of a Monte Carlo: in blocks, on several processes, resumable, and the same numbers however they are done."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge import __version__
from stepgauge.errors import InputError, naming
from stepgauge.executors.processes import Processes
from stepgauge.executors.run import run
from stepgauge.files.arrays import Array
from stepgauge.files.text import write_text
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.summary import Summary, summarise

Progress = Callable[[int, int], None]
BLOCK_PROBINGS = 65_536
"""Probings computed at a time: enough to hide Python's cost, few enough for a processor's cache."""
CONTRIBUTION_RUNS = 2000
"""Runs that each input is varied alone; its contribution is then known to 1 / sqrt(2 * 2000) = 1.6 %."""
PROBINGS_PER_JOB = 10_000_000
"""Work below which a further process costs more time to start (about a second) than it saves."""


@dataclass(frozen=True)
class RunBlock:
    """Consecutive runs: ``runs`` are their numbers, ``rows`` where their values are kept, ``only`` the input varied."""

    number: int
    runs: range
    rows: slice
    only: str | None


@dataclass(frozen=True)
class Schedule:
    """All blocks: first ``runs`` with all inputs, then ``contribution_runs`` with each input alone.

    The size of a block follows from the model, never from processes or chunks, so that every block is computed alike.
    """

    blocks: tuple[RunBlock, ...]
    rows: int


def make_schedule(model: MonteCarloModel, runs: int) -> Schedule:
    """The blocks of a Monte Carlo of so many runs."""
    size = max(1, BLOCK_PROBINGS // model.n_rows)
    blocks: list[RunBlock] = []
    first_row = 0
    for only, count in [(None, runs), *((name, min(runs, CONTRIBUTION_RUNS)) for name in model.inputs.names)]:
        for first in range(0, count, size):
            numbers = range(first, min(first + size, count))
            rows = slice(first_row + first, first_row + numbers.stop)
            blocks.append(RunBlock(len(blocks), numbers, rows, only))
        first_row += count
    return Schedule(tuple(blocks), first_row)


def run_monte_carlo(
    model: MonteCarloModel,
    runs: int = 10_000,
    seed: int = 0,
    jobs: int = 1,
    chunk: int | None = None,
    checkpoint: Path | None = None,
    progress: Progress | None = None,
) -> Summary:
    """Propagate the distributions of all inputs (JCGM 101:2008) and vary each input alone (its Annex B.1).

    Parameters
    ----------
    model : from :func:`program_model` or :func:`recording_model`
    runs : number of trials M; 10 000 give a 95 % interval to about 2 % of u
    seed : 0 to 2^64 - 1; run ``r`` of a seed has the same draws in every call
    jobs : processes at most; by default all work is done in this one. More of them need a main module that can be
        imported (``if __name__ == "__main__":``), see :mod:`multiprocessing`
    chunk : runs handed to a process at a time; changes no number
    checkpoint : folder in which the values are kept meanwhile; a call with the same model, runs and seed goes on from
        there. It is removed at the end. Without it everything is in memory.
    progress : called with the runs done and the runs in all

    Raises
    ------
    InputError
        fewer than 2 runs, a seed out of range, a model without uncertain inputs
    """
    _check(model, runs, seed)
    schedule = make_schedule(model, runs)
    fingerprint = _fingerprint(model, runs, seed)
    store = open_store(checkpoint, fingerprint, schedule.rows, len(model.quantities), len(schedule.blocks))
    todo = [block for block in schedule.blocks if not store.is_done(block.number, block.rows)]
    done = schedule.rows - sum(len(block.runs) for block in todo)
    try:
        for block, values in _computed(model, seed, todo, jobs, chunk):
            store.put(block.number, block.rows, values)
            done += len(block.runs)
            if progress is not None:
                progress(done, schedule.rows)
    finally:
        store.flush()
    summary = summarise(model, store.values, runs, min(runs, CONTRIBUTION_RUNS), seed)
    store.discard()
    return summary


def _check(model: MonteCarloModel, runs: int, seed: int) -> None:
    if runs < 2:
        raise InputError(naming("runs"), "a distribution needs runs", found=runs, expected="at least 2, better 10000")
    if not 0 <= seed < 2**64:
        raise InputError(naming("seed"), "out of range", found=seed, expected="0 to 2^64 - 1")
    if not model.inputs.names:
        raise InputError(
            model.machine.path,
            "nothing carries an uncertainty",
            expected="values such as ppm = { value = 2.5, u = 0.8 }, a repeatability or an uncertain certificate",
        )


def _fingerprint(model: MonteCarloModel, runs: int, seed: int) -> str:
    """What must be the same for stored values to be those of this computation."""
    machine, gauge = model.machine, model.gauge
    words = [__version__, runs, seed, BLOCK_PROBINGS, model.origin, model.sign, model.inputs]
    words += [machine.table.model_dump(), machine.probe.model_dump(), machine.effects, model.effects]
    words += [gauge.table.model_dump(), sorted(model.setting.axis)]
    digest = hashlib.sha256(repr(words).encode())
    arrays = [gauge.position_mm, gauge.u_um, *model.setting.axis.values()]
    arrays += [] if gauge.correlation is None else [gauge.correlation]
    for part in model.parts:
        arrays += [part.readings.off_mm, part.readings.axis, *(part.columns[name] for name in sorted(part.columns))]
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _computed(
    model: MonteCarloModel, seed: int, blocks: list[RunBlock], jobs: int, chunk: int | None
) -> Iterator[tuple[RunBlock, Array]]:
    probings = model.n_rows * sum(len(block.runs) for block in blocks)
    jobs = min(jobs, len(blocks), probings // PROBINGS_PER_JOB)
    if jobs <= 1:
        yield from ((block, _values(model, seed, block)) for block in blocks)
        return
    size = 1 if chunk is None else max(1, chunk // max(1, len(blocks[0].runs)))
    groups = [blocks[first : first + size] for first in range(0, len(blocks), size)]
    tasks = ((str(number), group) for number, group in enumerate(groups))
    for group, outcome in zip(groups, run(partial(_work, model, seed), tasks, Processes(jobs)), strict=True):
        if outcome.error:
            raise InputError("runs", f"a process could not compute its share: {outcome.error}")
        yield from zip(group, outcome.value, strict=True)


def _work(model: MonteCarloModel, seed: int, blocks: list[RunBlock]) -> list[Array]:
    return [_values(model, seed, block) for block in blocks]


def _values(model: MonteCarloModel, seed: int, block: RunBlock) -> Array:
    return model.values(seed, block.runs, block.only)


_VALUES, _SUMS, _STATE = "values.f64", "blocks.sha256", "state.json"
_SIZE = hashlib.sha256().digest_size


@dataclass
class Store:
    """``values (rows, quantities)``; ``sums (blocks, 32)``: checksums of those that are done, else zeros.

    With a folder both are files mapped into memory.
    """

    values: Array
    sums: NDArray[np.uint8]
    folder: Path | None = None

    def put(self, block: int, rows: slice, values: Array) -> None:
        """Keep a block; it counts as done only after its values are in place."""
        self.values[rows] = values
        self.sums[block] = _checksum(values)

    def is_done(self, block: int, rows: slice) -> bool:
        """Whether its values are there as they were put; those that were damaged meanwhile are computed again."""
        return bool(self.sums[block].any() and (self.sums[block] == _checksum(self.values[rows])).all())

    def flush(self) -> None:
        """Write to the disk what is only in memory."""
        for array in (self.values, self.sums):
            if isinstance(array, np.memmap):
                array.flush()

    def discard(self) -> None:
        """Remove the folder: the results are elsewhere now."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


def open_store(folder: Path | None, fingerprint: str, rows: int, quantities: int, blocks: int) -> Store:
    """A store for one computation; one of the same fingerprint in the folder is continued, another one replaced."""
    if folder is None:
        return Store(np.empty((rows, quantities)), np.zeros((blocks, _SIZE), np.uint8))
    state = json.dumps({"fingerprint": fingerprint, "rows": rows, "quantities": quantities, "blocks": blocks})
    known = (folder / _STATE).is_file() and (folder / _STATE).read_text(encoding="utf-8") == state
    try:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
        mode = "r+" if known else "w+"
        values = np.memmap(folder / _VALUES, np.float64, mode, shape=(rows, quantities))  # type: ignore[call-overload]
        sums = np.memmap(folder / _SUMS, np.uint8, mode, shape=(blocks, _SIZE))  # type: ignore[call-overload]
        if not known:
            write_text(folder / _STATE, state, at_once=True)  # last: a folder without it is begun anew
    except (OSError, InputError) as error:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
        why = error.strerror or error if isinstance(error, OSError) else error.what
        raise InputError(folder, f"cannot keep the runs here: {why}") from None
    return Store(values, sums, folder)


def _checksum(values: Array) -> NDArray[np.uint8]:
    return np.frombuffer(hashlib.sha256(np.ascontiguousarray(values, float).tobytes()).digest(), np.uint8)

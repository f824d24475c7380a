"""The runs of a Monte Carlo: in blocks, on several processes, resumable, and the same numbers however they are done."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from stepgauge import __version__
from stepgauge.errors import InputError, naming
from stepgauge.executors.processes import Processes
from stepgauge.executors.run import run
from stepgauge.files.arrays import Array
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.store import open_store
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

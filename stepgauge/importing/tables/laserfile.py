"""Files of laser software in sections (``TARGETS``, ``DEVIATIONS``): targets in a list, readings by run and target.

The flags below the targets say in their second place whether the test went one way only (``0 1 2 0``); that software
then fills the runs back with zeros. Runs are there and back in turn, unless the test went one way. What the file states
of itself, targets, runs and the flag, is compared with the readings.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.numerals import Numerals
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.cells import Cell
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.source import Source

_BEGINS = re.compile(r"^[ \t]*Run Target Data\s*:", re.MULTILINE | re.IGNORECASE)
_TARGETS = re.compile(r"^[ \t]*Targets\s*:+", re.MULTILINE | re.IGNORECASE)
_TYPE = re.compile(r"^[ \t]*File\s*Type\s*:\s*(\w+)", re.MULTILINE | re.IGNORECASE)
_FLAGS = re.compile(r"^[ \t]*Flags\s*:\s*\d+\s+(\d+)", re.MULTILINE | re.IGNORECASE)
_UNITS = {"linear": ("mm", "um"), "rotary": ("deg", "arcsec")}
"""Of targets and deviations, by the type of the file; that of another one is asked for."""
LONGEST_HEAD = 200_000
"""Characters within which both sections begin."""
HEADERS = ["target", "deviation", "cycle", "direction"]


def is_laser_file(text: str) -> bool:
    """Whether a text has both sections."""
    head = text[:LONGEST_HEAD]
    return bool(_BEGINS.search(head) and _TARGETS.search(head))


def read_laser_file(source: Source, decisions: Decisions) -> Table:
    """Target, deviation, cycle and direction of every reading; of a linear axis in mm and um, as that software writes.

    :class:`InputError` for rows that are not three numbers, targets that are not in the list, and readings that are not
    those that the file says it has.
    """
    text, path = source.decoded[0], source.name
    targets_at, data_at = _TARGETS.search(text), _BEGINS.search(text)
    assert targets_at is not None
    assert data_at is not None
    mark = Numerals("," if re.search(r"\d,\d", text[data_at.end() :]) else ".")
    targets = _leading_numbers(text[targets_at.end() :], mark)
    run, target, value, line = _readings(text, data_at.end(), mark, len(targets), path)
    _check_stated(text, path, len(targets), run, target)
    one_way = (match := _FLAGS.search(text)) is not None and match[1] == "1"
    keep, words = _without_filling(path, run, value, one_way, decisions)
    run, target, value, line = run[keep], target[keep], value[keep], line[keep]
    way = _ways(run, target, one_way)
    order = np.lexsort((np.where(way > 0, target, -target), run)) if not _by_run(run) else np.arange(len(run))
    cycle = run if one_way else (run + 1) // 2
    cycle = np.unique(cycle, return_inverse=True)[1] + 1
    kind = (match := _TYPE.search(text)) and match[1].casefold()
    rows: list[list[Cell]] = [
        [targets[target[n] - 1], float(value[n]), float(cycle[n]), float(way[n])] for n in order.tolist()
    ]
    units = [find_unit(name) for name in _UNITS[kind]] if kind in _UNITS else [None, None]
    zero = np.zeros(len(rows), np.int64)
    return Table(path, list(HEADERS), [*units, None, None], rows, line[order], [""], zero, ".", left_out=words)


def _readings(
    text: str, at: int, mark: Numerals, count: int, path: str
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Run, target, deviation and line of every reading; a row that is cut, or of something else, is refused."""
    first = text.count("\n", 0, at)
    rows: list[tuple[int, int, float, int]] = []
    for line, row in enumerate(text.splitlines()[first + 1 :], first + 2):
        if not row.strip():
            continue
        if not row.strip()[0].isdigit():
            break
        values = [mark.number(cell) for cell in row.split()]
        if len(values) != 3 or not np.isfinite(values).all():
            expected = "run, target and deviation"
            raise InputError(f"{path}:{line}", "the row is cut, or no reading", found=repr(row), expected=expected)
        if not 1 <= values[1] <= count:
            expected = f"1 to {count}"
            raise InputError(f"{path}:{line}", "no such target in the list", found=f"{values[1]:g}", expected=expected)
        rows.append((int(values[0]), int(values[1]), values[2], line))
    if not rows:
        raise InputError(f"{path}:{first + 1}", "no readings follow", expected="rows of run, target and deviation")
    run, target, value, lines = map(np.array, zip(*rows, strict=True))
    return run, target, value, lines


def _check_stated(text: str, path: str, targets: int, run: NDArray[np.int64], target: NDArray[np.int64]) -> None:
    """Targets, runs, and every target in every run, as the file says."""
    found = {"Target-count": targets, "Run-count": len(np.unique(run))}
    for name, count in found.items():
        match = re.search(rf"^\s*{name}\s*:\s*(\d+)", text, re.MULTILINE | re.IGNORECASE)
        if match and int(match[1]) != count:
            what = f"the file says {name} {match[1]}, and has another number: is it cut?"
            raise InputError(path, what, found=count, expected=match[1])
    for one in np.unique(run):
        there = target[run == one]
        if len(np.unique(there)) != targets or len(there) != targets:
            found_words, expected = (
                f"{len(there)} readings of {len(np.unique(there))} targets",
                f"{targets} of {targets}",
            )
            raise InputError(path, f"run {one} is not whole: is the file cut?", found=found_words, expected=expected)


def _without_filling(
    path: str, run: NDArray[np.int64], value: NDArray[np.float64], one_way: bool, decisions: Decisions
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Which readings are some: runs of zeros alone fill the way back of a test of one way."""
    empty = [one for one in np.unique(run).tolist() if not value[run == one].any()]
    back = [one for one in np.unique(run).tolist() if one % 2 == 0]
    if not empty or len(empty) == len(np.unique(run)):
        if one_way and back and len(np.unique(run)) > 1 and not empty:
            decisions.reject("runs there and back", "the flags say that the test went one way")
        return np.ones(len(run), bool), ()
    if one_way and empty == back:
        words = f"dropped: {len(empty)} runs of zeros, which fill the way back of a test of one way (Flags)"
        return ~np.isin(run, empty), (words,)
    found = f"runs {', '.join(map(str, empty))}"
    expected = "readings, or flags that say that the test went one way (Flags: 0 1 ..)"
    raise InputError(path, "runs have nothing but zeros", found=found, expected=expected)


def _by_run(run: NDArray[np.int64]) -> bool:
    return bool((np.diff(run) >= 0).all())


def _ways(run: NDArray[np.int64], target: NDArray[np.int64], one_way: bool) -> NDArray[np.int64]:
    """The sense of travel: by the order of the targets in a run, else there and back in turn."""
    if _by_run(run) and len(np.unique(target)) > 1:
        signs = {one: int(np.sign(np.diff(target[run == one])).sum() >= 0) * 2 - 1 for one in np.unique(run).tolist()}
        return np.array([signs[one] for one in run.tolist()])
    return np.ones(len(run), np.int64) if one_way else np.where(run % 2 == 1, 1, -1)


def _leading_numbers(text: str, mark: Numerals) -> list[float]:
    """Numbers at the beginning of a text, over as many lines as they take."""
    found: list[float] = []
    for word in text.split():
        value = mark.number(word)
        if value != value:
            break
        found.append(value)
    return found

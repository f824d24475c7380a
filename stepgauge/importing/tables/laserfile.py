"""Files of laser software in sections (``TARGETS``, ``DEVIATIONS``): targets in a list, readings by run and target.

The flags below the targets say in their second place whether the test went one way only (``0 1 2 0``); that software
then fills the runs back with zeros. Runs are there and back in turn, unless the test went one way. What the file states
of itself, targets, runs and the flag, is compared with the readings.
"""

from __future__ import annotations

import re
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
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
Whole = NDArray[np.int64]
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
    words = (mark.number(word) for word in text[targets_at.end() :].split())
    targets = np.array(list(takewhile(np.isfinite, words)))
    rows, behind = _readings(text, data_at.end(), mark, len(targets), path)
    run, target, line = (rows[:, place].astype(np.int64) for place in (0, 1, 3))
    _check_stated(text, path, len(targets), run, target)
    one_way = (match := _FLAGS.search(text)) is not None and match[1] == "1"
    keep, left_out = _without_filling(path, run, rows[:, 2], one_way, decisions)
    run, target, value, line = run[keep], target[keep], rows[keep, 2], line[keep]
    in_order = bool((np.diff(run) >= 0).all())
    way = _ways(run, target, one_way, in_order)
    order = np.arange(len(run)) if in_order else np.lexsort((np.where(way > 0, target, -target), run))
    cycle = np.unique(run if one_way else (run + 1) // 2, return_inverse=True)[1] + 1
    kind = (match := _TYPE.search(text)) and match[1].casefold()
    units = [find_unit(name) for name in _UNITS[kind]] if kind in _UNITS else [None, None]
    cells: list[list[Cell]] = np.column_stack([targets[target - 1], value, cycle, way])[order].tolist()
    zero = np.zeros(len(cells), np.int64)
    return Table(
        path, list(HEADERS), [*units, None, None], cells, line[order], [""], zero, ".", left_out=(*left_out, *behind)
    )


def _readings(text: str, at: int, mark: Numerals, count: int, path: str) -> tuple[Array, tuple[str, ...]]:
    """Run, target, deviation and line of every reading, ``(n, 4)``; what is cut, or of something else, is refused.

    With words on what stands behind the readings.
    """
    behind: tuple[str, ...] = ()
    first = text.count("\n", 0, at)
    rows: list[list[float]] = []
    for line, row in enumerate(text.splitlines()[first + 1 :], first + 2):
        if not row.strip():
            continue
        if not row.strip()[0].isdigit():
            behind = (f"dropped: all behind the readings, from line {line}: {row.strip()[:60]!r}",)
            break
        values = [mark.number(cell) for cell in row.split()]
        if len(values) != 3 or not np.isfinite(values).all():
            expected = "run, target and deviation"
            raise InputError(f"{path}:{line}", "the row is cut, or no reading", found=repr(row), expected=expected)
        if not 1 <= values[1] <= count:
            expected = f"1 to {count}"
            raise InputError(f"{path}:{line}", "no such target in the list", found=f"{values[1]:g}", expected=expected)
        rows.append([*values, line])
    if not rows:
        raise InputError(f"{path}:{first + 1}", "no readings follow", expected="rows of run, target and deviation")
    return np.array(rows), behind


def _check_stated(text: str, path: str, targets: int, run: Whole, target: Whole) -> None:
    """Targets, runs, and every target in every run, as the file says."""
    for name, count in {"Target-count": targets, "Run-count": len(np.unique(run))}.items():
        match = re.search(rf"^\s*{name}\s*:\s*(\d+)", text, re.MULTILINE | re.IGNORECASE)
        if match and int(match[1]) != count:
            what = f"the file says {name} {match[1]}, and has another number: is it cut?"
            raise InputError(path, what, found=count, expected=match[1])
    for one in np.unique(run):
        there = target[run == one]
        if not len(np.unique(there)) == len(there) == targets:
            found = f"{len(there)} readings of {len(np.unique(there))} targets"
            what = f"run {one} is not whole: is the file cut?"
            raise InputError(path, what, found=found, expected=f"{targets} of {targets}")


def _without_filling(
    path: str, run: Whole, value: Array, one_way: bool, decisions: Decisions
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Which readings are some: runs of zeros alone fill the way back of a test of one way."""
    runs = np.unique(run).tolist()
    empty = [one for one in runs if not value[run == one].any()]
    back = [one for one in runs if one % 2 == 0]
    if not empty or len(empty) == len(runs):
        if one_way and back and len(runs) > 1 and not empty:
            decisions.reject("runs there and back", "the flags say that the test went one way")
        return np.ones(len(run), bool), ()
    if one_way and empty == back:
        words = f"dropped: {len(empty)} runs of zeros, which fill the way back of a test of one way (Flags)"
        return ~np.isin(run, empty), (words,)
    found = f"runs {', '.join(map(str, empty))}"
    expected = "readings, or flags that say that the test went one way (Flags: 0 1 ..)"
    raise InputError(path, "runs have nothing but zeros", found=found, expected=expected)


def _ways(run: Whole, target: Whole, one_way: bool, in_order: bool) -> Whole:
    """The sense of travel: by the order of the targets in a run, else there and back in turn."""
    if in_order and len(np.unique(target)) > 1:
        signs = {one: int(np.sign(np.diff(target[run == one])).sum() >= 0) * 2 - 1 for one in np.unique(run).tolist()}
        return np.array([signs[one] for one in run.tolist()])
    return np.ones(len(run), np.int64) if one_way else np.where(run % 2 == 1, 1, -1)

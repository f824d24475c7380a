"""Where a log differs from the points that it ought to have, in words for the person who measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NoReturn

import numpy as np

from stepgauge.correspondence.expected_points import ExpectedPoints, coordinates
from stepgauge.correspondence.probe_log import NO_CONTACT, ProbeLog
from stepgauge.correspondence.search_line import point_distances
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Rows
from stepgauge.files.units import unit_hint

FOREIGN = -1
ACCEPTABLE = ("missing", "doubled", "order", "foreign")
"""Kinds of differences that ``--accept`` knows."""
TAKEN = {"doubled": "the last touch of each"}
"""What is taken of a kind that is accepted, where that is not the log as it is."""
NEXT_TO_MM = 2.0
"""A row this far beside the line of a search is a reading of that search, from another line than the program's."""
SHOWN = 5
"""Further differences that a message names one by one."""


@dataclass(frozen=True)
class Comparison:
    """A log beside its points: ``key`` and ``row_key`` are equal where a point and a row may belong together.

    ``keyed``: by the ``number``, the ``name`` or the ``place`` of the point; ``FOREIGN``: no point at all.
    """

    log: ProbeLog
    expected: ExpectedPoints
    key: Rows
    row_key: Rows
    keyed: str

    @cached_property
    def known(self) -> frozenset[int]:
        """All keys of points, for look-up."""
        return frozenset(self.key.tolist())


@dataclass(frozen=True)
class LogDifference:
    """One point that no row is left for (``row`` None) or one row that no point is left for.

    ``kind``: ``missing``, ``doubled``, ``order`` or ``foreign``; ``point``, ``before``: the point, or the next one that
    was expected there; the row, or the next one that stands there.
    """

    kind: str
    point: int
    row: int
    is_row: bool


@dataclass(frozen=True)
class LogDifferences:
    """What an alignment leaves over; ``moved (n, 2)``: points that stand elsewhere, with their rows."""

    entries: tuple[LogDifference, ...]
    moved: Rows


def find_differences(comparison: Comparison, point: Rows, row: Rows) -> LogDifferences:
    """What is left beside pairs of ``point`` and ``row`` (both rising), in the order of the log."""
    missing = np.setdiff1d(np.arange(len(comparison.expected)), point)
    extra = np.setdiff1d(np.arange(len(comparison.log)), row)
    moved = _moved(comparison, missing, extra)
    entries = [
        LogDifference("order" if one in moved[:, 0] else "missing", int(one), _next(row, point, int(one)), False)
        for one in missing
    ]
    for one in extra:
        kind = "doubled" if int(comparison.row_key[one]) in comparison.known else "foreign"
        kind = "order" if one in moved[:, 1] else kind
        entries.append(LogDifference(kind, _next(point, row, int(one)), int(one), True))
    return LogDifferences(tuple(sorted(entries, key=lambda entry: (entry.row, entry.point))), moved)


def _next(wanted: Rows, by: Rows, at: int) -> int:
    """The entry of ``wanted`` that follows those whose ``by`` lies before ``at``."""
    before = wanted[by < at]
    return int(before.max()) + 1 if before.size else 0


def _moved(comparison: Comparison, missing: Rows, extra: Rows) -> Rows:
    waiting: dict[int, list[int]] = {}
    for row in extra:
        waiting.setdefault(int(comparison.row_key[row]), []).append(int(row))
    pairs = []
    for point in missing:
        rows = waiting.get(int(comparison.key[point]))
        if rows:
            pairs.append((int(point), rows.pop(0)))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def refuse(comparison: Comparison, differences: Sequence[LogDifference], left: int) -> NoReturn:
    """The error of the first difference, with a word on the others; ``left``: rows that are readings of their points.

    An option is offered only where it leaves something to be read.
    """
    first, log, expected = differences[0], comparison.log, comparison.expected
    more = _more(comparison, differences[1:])
    if first.kind in ACCEPTABLE and left:
        more += f" ({{}} {first.kind} takes {TAKEN.get(first.kind, 'it as it is')})"
    if first.row >= len(log):
        _refuse_end(comparison, first.point)
    if first.point >= len(expected) and comparison.keyed == "place":
        raise InputError(
            log.at(first.row),
            f"the log goes on after the last point (two runs in one file?){_failures(log)}",
            found=f"{len(log)} points",
            expected=naming("accept", words=f"{len(expected)} of {expected.source} ({{}} runs counts the cycles on)"),
        )
    if comparison.keyed == "place":
        _refuse_place(comparison, first, more)
    _refuse_named(comparison, first, more)


def refuse_all(comparison: Comparison) -> NoReturn:
    """The error of a log of which so much is off that no single difference tells anything."""
    size = min(len(comparison.log), len(comparison.expected))
    same = comparison.key[:size] == comparison.row_key[:size]
    first = size if same.all() else int(same.argmin())
    refuse(comparison, [LogDifference("other", first, first, True)], 0)


def _refuse_place(comparison: Comparison, difference: LogDifference, more: str) -> NoReturn:
    """A row known by its place stands where another point is expected."""
    log, expected, row = comparison.log, comparison.expected, difference.row
    what = {
        "missing": f"point {difference.point + 1} is missing",
        "order": "rows are out of order",
        "doubled": "a reading is repeated",
    }.get(difference.kind, "a log of another program, or rows out of order")
    if difference.kind == "other":
        what += extent(comparison)
    found, wanted = coordinates(log.position_mm[row]), expected.place(difference.point)
    if comparison.row_key[row] == FOREIGN:
        along, beside = point_distances(log.position_mm[[row]], expected, np.array([difference.point]))
        if abs(along[0]) <= expected.search_mm and beside[0] <= NEXT_TO_MM:
            what = "it is beside the line of its search (another placement, or the log of another program?)"
            more = ""
        found += f", {along[0]:+.3f} mm along the approach and {beside[0]:.3f} mm beside it"
        wanted += f", within {expected.search_mm:g} mm along and {expected.lateral_mm:g} mm beside"
    else:
        found += f", at face {expected.face[np.flatnonzero(comparison.key == comparison.row_key[row])[0]]}"
    raise InputError(
        log.at(row),
        f"this is not {expected.title(difference.point)}: {what}{_failures(log)}",
        found=found,
        expected=naming("accept", words=wanted + more),
    )


def _refuse_named(comparison: Comparison, difference: LogDifference, more: str) -> NoReturn:
    """A row that says which point it is stands where another point is expected."""
    log, expected, n = comparison.log, comparison.expected, len(comparison.expected)
    if log.number is not None:
        called, mine = f"point {log.number[difference.row]}", f"point {difference.point + 1}"
    else:
        assert log.label is not None
        called, mine = log.label[difference.row], expected.name[min(difference.point, n - 1)]
    words = {"missing": f"{mine} is missing", "doubled": f"{called} is repeated"}
    what = words.get(difference.kind, f"{mine} is out of order")
    if int(comparison.row_key[difference.row]) not in comparison.known:
        what = "the program has no such point"
    end = f"the end, after point {n} of the program"
    wanted = f"{mine}: {expected.place(difference.point)}" if difference.point < n else end
    accepted = naming("accept", words=wanted + more)
    raise InputError(log.at(difference.row), what + _failures(log), found=called, expected=accepted)


def _refuse_end(comparison: Comparison, point: int) -> NoReturn:
    log, expected = comparison.log, comparison.expected
    line = f"program line {expected.line[point]}, " if expected.line[point] else ""
    found = f"{point} points" + (f" and {log.cut}" if log.cut else "")
    if log.alarms and point < len(expected) / 2:
        at, alarm = log.alarms[-1]
        doubt = ": is the gauge turned end for end, or the placement wrong?" if NO_CONTACT in alarm else ""
        raise InputError(
            log.at(len(log) - 1),
            f"before point {point + 1} ({line}{expected.place(point)}) {alarm} in line {at} stopped the run{doubt}",
            found=found,
            expected=f"{len(expected)} of {expected.source}: home the machine, and run it again",
        )
    raise InputError(
        log.at(len(log) - 1),
        f"the log ends before point {point + 1} ({line}{expected.place(point)}): the run was stopped, or the file is"
        f" cut{_failures(log)}",
        found=found,
        expected=naming("accept", words=f"{len(expected)} of {expected.source} ({{}} missing takes it as it is)"),
    )


def _more(comparison: Comparison, others: Sequence[LogDifference]) -> str:
    if not others:
        return ""
    words = [
        f"line {comparison.log.line[one.row]} {one.kind}"
        if one.is_row
        else f"C{comparison.expected.cycle[one.point]}F{comparison.expected.face[one.point]} {one.kind}"
        for one in others[:SHOWN]
    ]
    rest = f" and {len(others) - SHOWN} more" if len(others) > SHOWN else ""
    return f"; also {', '.join(words)}{rest}"


def _failures(log: ProbeLog) -> str:
    if not log.failures:
        return ""
    return "; the log reports " + ", ".join(f"in line {line} {text}" for line, text in log.failures[:SHOWN])


def extent(comparison: Comparison) -> str:
    """Words on the extents of a log and of its points, with the unit that their ratio looks like."""
    both = (comparison.log.position_mm, comparison.expected.target_mm)
    found, wanted = (float(np.linalg.norm(np.ptp(x, axis=0))) for x in both)
    return unit_hint(found, wanted) or f" (the log extends over {found:.3f} mm, its points over {wanted:.3f} mm)"


def accepted_words(comparison: Comparison, differences: Sequence[LogDifference]) -> tuple[str, ...]:
    """Every accepted difference by its name."""
    expected, line = comparison.expected, comparison.log.line
    words = []
    for kind, title in (("missing", "missing"), ("order", "out of order")):
        points = [one.point for one in differences if one.kind == kind and not one.is_row]
        if points:
            names = " ".join(f"C{expected.cycle[p]}F{expected.face[p]}" for p in points)
            words.append(f"{title}: {len(points)} points: {names}")
    for kind, title in (("doubled", "doubled, the last of a row is kept"), ("foreign", "no points of the program")):
        rows = [one.row for one in differences if one.kind == kind and one.is_row]
        if rows:
            words.append(f"dropped as {title}: {len(rows)} rows: lines {' '.join(str(line[row]) for row in rows)}")
    return tuple(words)

"""A log against the points that it ought to have: every point there, in order, and where the tip was sent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.correspondence.differences import (
    FOREIGN,
    Comparison,
    accepted_words,
    extent,
    find_differences,
    refuse,
    refuse_all,
)
from stepgauge.correspondence.expected_points import ExpectedPoints
from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.correspondence.search_line import SEARCH_END_MM, off_search_line, point_distances
from stepgauge.correspondence.sequence_alignment import align
from stepgauge.errors import InputError
from stepgauge.files.arrays import Rows

KINDS = ("missing", "doubled", "order", "foreign", "runs", "alarm", "shift", "repeats", "placements")
"""Ways in which a log may depart from its program and still be wanted: see :func:`match`."""


@dataclass(frozen=True)
class Pairing:
    """Which row of the log each point stands in.

    ``expected``: the points (of all runs); ``point``, ``row``: pairs, in the order of the log; ``differences``: what
    was accepted although it is not as the program has it, in words.
    """

    expected: ExpectedPoints
    point: Rows
    row: Rows
    differences: tuple[str, ...] = ()


def match(log: ProbeLog, expected: ExpectedPoints, accept: Sequence[str] = ()) -> Pairing:
    """Bring a log and the points it ought to have side by side.

    Rows are known by the number or the name of their point where the log states it, else by their place. The two
    sequences are aligned with the fewest points missing and rows too much (:mod:`.sequence_alignment`).

    Parameters
    ----------
    log : rows of the log, of the same kind (tip centres or surface points) as ``expected``
    expected : the points in order
    accept : what may be, of ``KINDS``: points ``missing`` (also a log that ends early), ``doubled`` rows (the last
        touch is kept), rows out of ``order``, ``foreign`` rows that are no points of the program (left out), ``runs``:
        the program several times in one log, whose cycles count on; ``alarm``, ``shift``, ``repeats`` and
        ``placements`` are settled before (:mod:`stepgauge.correspondence.log_conventions`)

    Raises
    ------
    InputError
        names the line of the first row that differs, the point with its cycle, face and place, and what else does
    """
    _check_success(log)
    size = len(expected)
    runs = _runs(len(log) / size, accept)
    comparison = _compare(log, expected.tiled(runs) if runs > 1 else expected, size)
    pairs = align(comparison.key.tolist(), comparison.row_key.tolist())
    if pairs is None:
        refuse_all(comparison)
    point, row, put_back = _put_repeats_back(comparison, pairs[:, 0], pairs[:, 1])
    if "doubled" in accept:
        row = _last_touches(comparison.row_key, row)
    differences = find_differences(comparison, point, row)
    refused = [one for one in differences.entries if one.kind not in accept]
    if refused:
        refuse(comparison, refused, len(point) + len(differences.moved))
    point, row = np.r_[point, differences.moved[:, 0]], np.r_[row, differences.moved[:, 1]]
    rank = np.lexsort((point, row))
    _check_places(comparison, point[rank], row[rank])
    words = (*accepted_words(comparison, differences.entries), *put_back)
    return Pairing(comparison.expected, point[rank], row[rank], words)


def _last_touches(key: Rows, row: Rows) -> Rows:
    """Of rows of the same point in succession the last one: a touch that was repeated stands for the one before."""
    taken, moved = set(row.tolist()), row.copy()
    for place, at in enumerate(row.tolist()):
        while at + 1 < len(key) and key[at + 1] == key[at] and at + 1 not in taken:
            at += 1
        moved[place] = at
    return moved


def _runs(share: float, accept: Sequence[str]) -> int:
    """How often the program was run; a part of a run that is cut counts where points may be missing."""
    if "runs" not in accept:
        return 1
    whole, part = divmod(share, 1.0)
    return max(1, int(whole) + int(part > (0.05 if "missing" in accept else 0.5)))


def _check_success(log: ProbeLog) -> None:
    if log.success is not None and not log.success.all():
        row = int(np.argmin(log.success))
        raise InputError(
            log.at(row),
            "the probe did not trigger at this point",
            found="success flag 0",
            expected="1",
        )


def _compare(log: ProbeLog, expected: ExpectedPoints, size: int) -> Comparison:
    """``size``: points of a single run."""
    if log.number is not None:
        restart = np.r_[False, (log.number[1:] == 1) & (log.number[:-1] > 1)] & (len(expected) > size)
        key = log.number - 1 + np.cumsum(restart) * size
        return Comparison(log, expected, np.arange(len(expected)), key, "number")
    names = dict(zip(dict.fromkeys(expected.name), range(len(expected)), strict=False))
    if log.label is not None and len(names) == size and set(log.label) & set(names):
        named = np.array([names.get(name, FOREIGN) for name in log.label])
        return Comparison(log, expected, np.array([names[name] for name in expected.name]), named, "name")
    return Comparison(log, expected, *_place_keys(log, expected), "place")


def _place_keys(log: ProbeLog, expected: ExpectedPoints) -> tuple[Rows, Rows]:
    """Number of the distinct target of each point, and of the one that each row is nearest to, if near enough."""
    both = np.c_[expected.target_mm, expected.approach]
    targets, first, key = np.unique(both, axis=0, return_index=True, return_inverse=True)
    row_key = np.empty(len(log), dtype=np.int64)
    for start in range(0, len(log), 4096):  # a table of all rows by all targets would be large
        part = slice(start, start + 4096)
        distance = np.linalg.norm(log.position_mm[part, None] - targets[:, :3], axis=2)
        if log.approach is not None:
            distance += np.where(log.approach[part] @ targets[:, 3:].T < 0.0, np.inf, 0.0)
        row_key[part] = distance.argmin(axis=1)
    along, beside = point_distances(log.position_mm, expected, first[row_key])
    near = (np.abs(along) <= expected.reach_mm + SEARCH_END_MM) & (beside <= expected.lateral_mm)
    return key.ravel().astype(np.int64), np.where(near, row_key, FOREIGN)


def _put_repeats_back(comparison: Comparison, point: Rows, row: Rows) -> tuple[Rows, Rows, tuple[str, ...]]:
    """Readings that a log leaves out because they equal the one before.

    Where the same target is probed several times in a row, and the log has a single row there, all of them read that
    row. With more than one row but fewer than probings nothing says which one is doubled.
    """
    if not comparison.log.skips_repeats:
        return point, row, ()
    key = comparison.key
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    back: list[tuple[int, int]] = []
    for start, count in zip(first.tolist(), np.diff(np.r_[first, len(key)]).tolist(), strict=True):
        here = np.flatnonzero((point >= start) & (point < start + count))
        if 1 < len(here) < count:
            _refuse_doubtful(comparison, int(row[here[0]]), start, count, len(here))
        if len(here) == 1:
            others = set(range(start, start + count)) - {int(point[here[0]])}
            back += [(other, int(row[here[0]])) for other in sorted(others)]
    if not back:
        return point, row, ()
    point, row = (np.r_[old, new] for old, new in zip((point, row), np.array(back).T, strict=True))
    rank = np.argsort(point, kind="stable")
    words = f"put back: {len(back)} of the readings, left out by the log as identical to the one before"
    return point[rank], row[rank], (words,)


def _refuse_doubtful(comparison: Comparison, row: int, start: int, count: int, rows: int) -> None:
    raise InputError(
        comparison.log.at(row),
        f"the face of points {start + 1} to {start + count} was probed {count} times in a row, and the log"
        " leaves out identical readings: which of them cannot be told",
        found=f"{rows} rows",
        expected=f"{count}, or the numbered (LOG,..) form that the shipped template writes",
    )


def _check_places(comparison: Comparison, point: Rows, row: Rows) -> None:
    """Every point on the line of its search, between the search distance before its target and that after it."""
    log, expected = comparison.log, comparison.expected
    off = off_search_line(
        log.position_mm[row],
        expected.target_mm[point],
        expected.approach[point],
        expected.search_mm,
        expected.lateral_mm,
    )
    if off is None:
        return
    here, at = int(point[off.row]), log.at(row[off.row])
    if off.missed:
        what = f"point {here + 1} (program line {expected.line[here]}) was missed: the search went to its end"
        raise InputError(at, what, found=off.found, expected=off.expected)
    what = f"this is not {expected.title(here)}: a log of another program, or rows out of order{extent(comparison)}"
    raise InputError(at, what, found=off.found, expected=f"{expected.place(here)}, {off.expected}")

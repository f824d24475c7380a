"""A log against the program that was run: every point there, in order, and where the program sent the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.gauge import Gauge
from stepgauge.importing.faces import cycles_of, probed_faces
from stepgauge.importing.log import ProbeLog
from stepgauge.moves import Program
from stepgauge.placement import Placement
from stepgauge.recording import APPROACH, POSITION, Recording

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
LATERAL_MM = 0.1
"""A machine that searches along a straight line stays this close to it."""
SEARCH_END_MM = 1e-5
"""A search that ends this close to its programmed end has met nothing; the logs print 1e-6 mm or finer."""


@dataclass(frozen=True)
class RunLabels:
    """What no log states: the number of the placement, and the temperature of the gauge where it was measured."""

    placement: int = 1
    gauge_temperature_C: float | None = None


@dataclass(frozen=True)
class Import:
    """A recording, and in a few lines what was mapped and what was dropped."""

    recording: Recording
    report: tuple[str, ...]


def match_log(log: ProbeLog, program: Program, gauge: Gauge, placement: Placement, labels: RunLabels) -> Import:
    """The recording of a log (see :func:`stepgauge.importing.import_log`)."""
    face = probed_faces(program, gauge, placement)
    row = _rows_of_points(log, program)
    frame = _frame(log.position_mm[row], program, face, labels)
    if log.time_s is not None:
        frame["time_s"] = log.time_s[row]
    comments = {
        "program": program.name,
        "log": f"{log.path} ({log.form})",
        "gauge": f"{gauge.table.name}, serial {gauge.table.serial}",
    }
    return Import(Recording(frame, comments, log.path), _report(log, program, frame, row))


def _frame(position_mm: Array, program: Program, face: Rows, labels: RunLabels) -> pd.DataFrame:
    frame = pd.DataFrame({"placement": labels.placement, "cycle": cycles_of(face), "face": face})
    frame[POSITION] = position_mm
    frame[APPROACH] = program.approach[program.is_measure]
    frame["speed_mm_s"] = program.settings.measuring_speed_mm_s
    if labels.gauge_temperature_C is not None:
        frame["gauge_temperature_C"] = labels.gauge_temperature_C
    return frame


def _rows_of_points(log: ProbeLog, program: Program) -> Rows:
    """Row of the log that each measuring point of the program stands in, shape ``(n_points,)``."""
    _check_success(log)
    if log.number is not None:
        _check_numbers(log.number, program.n_points, log)
        row = np.arange(len(log))
    else:
        row = _rows_in_order(log, program) if log.skips_repeats else np.arange(len(log))
    points = min(len(row), program.n_points)
    _check_places(log, program, row[:points])
    _check_count(log, program, len(row))
    return row


def _check_success(log: ProbeLog) -> None:
    if log.success is not None and not log.success.all():
        row = int(np.argmin(log.success))
        raise InputError(
            log.at(row),
            "the probe did not trigger at this point",
            found="success flag 0",
            expected="1",
        )


def _check_numbers(number: Rows, n_points: int, log: ProbeLog) -> None:
    expected = np.arange(1, len(number) + 1)
    off = np.flatnonzero((number != expected) | (number > n_points))
    if off.size:
        row = int(off[0])
        raise InputError(
            log.at(row),
            _what_is_off(int(number[row]), number[:row], number[row:], row + 1, n_points),
            found=f"point {number[row]}",
            expected=f"point {row + 1}" if row < n_points else f"the end, after point {n_points} of the program",
        )


def _what_is_off(found: int, before: Rows, after: Rows, expected: int, n_points: int) -> str:
    if found > n_points:
        return "the program has no such point"
    if found in before:
        return f"point {found} is repeated"
    return f"point {expected} is out of order" if expected in after else f"point {expected} is missing"


def _rows_in_order(log: ProbeLog, program: Program) -> Rows:
    """Rows for a log that leaves out a point identical to the one before.

    Where the program probes the same target several times in a row, and the log has a single row there, all of them
    read that row. With more than one row but fewer than probings nothing says which one is doubled.
    """
    target = program.position_mm[program.is_measure]
    first = np.flatnonzero(np.r_[True, (target[1:] != target[:-1]).any(axis=1)])
    visits = np.diff(np.r_[first, len(target)])
    rows: list[int] = []
    row = 0
    for point, count in zip(first, visits, strict=True):
        here = _count_here(log.position_mm[row : row + count], program, int(point))
        if 1 < here < count:
            raise InputError(
                log.at(row),
                f"the face of points {point + 1} to {point + count} was probed {count} times in a row, and the log"
                " leaves out identical readings: which of them cannot be told",
                found=f"{here} rows",
                expected=f"{count}, or the numbered (LOG,..) form that the shipped template writes",
            )
        rows.extend([row] * count if here == 1 else range(row, row + count))
        row += here if here == 1 else count
        if row >= len(log):
            break
    return np.array([one for one in rows if one < len(log)] + list(range(row, len(log))))


def _count_here(position_mm: Array, program: Program, point: int) -> int:
    """How many of the rows, from the first on, lie on the search of a point."""
    along, lateral = _from_target(position_mm, program, np.full(len(position_mm), point))
    here = (np.abs(along) < program.settings.search_mm) & (lateral < LATERAL_MM)
    return len(here) if here.all() else int(here.argmin())


def _from_target(position_mm: Array, program: Program, point: Rows) -> tuple[Array, Array]:
    """Distance beyond the nominal tip centre along the approach, and beside that line, mm."""
    measure = program.is_measure
    off = position_mm - program.position_mm[measure][point]
    approach = program.approach[measure][point]
    along = (off * approach).sum(axis=1)
    return along, np.linalg.norm(off - along[:, None] * approach, axis=1)


def _check_places(log: ProbeLog, program: Program, row: Rows) -> None:
    """Every point on the line of its search, between the search distance before its target and that after it."""
    search = program.settings.search_mm
    along, lateral = _from_target(log.position_mm[row], program, np.arange(len(row)))
    missed = (np.abs(along - search) <= SEARCH_END_MM) & (lateral < LATERAL_MM)
    wrong = np.flatnonzero(missed | (np.abs(along) > search) | (lateral > LATERAL_MM))
    if not wrong.size:
        return
    point = int(wrong[0])
    line = program.line[program.is_measure][point]
    if missed[point]:
        raise InputError(
            log.at(row[point]),
            f"point {point + 1} (program line {line}) was missed: the search went to its end",
            found=f"{along[point]:.6f} mm beyond the nominal contact",
            expected=f"a trigger before {search:g} mm",
        )
    target = program.position_mm[program.is_measure][point]
    raise InputError(
        log.at(row[point]),
        f"this is not point {point + 1} of the program (line {line}): a log of another program, or rows out of order",
        found=f"{_place(log.position_mm[row[point]])}, {along[point]:+.3f} mm along the approach and"
        f" {lateral[point]:.3f} mm beside it",
        expected=f"{_place(target)} within {search:g} mm along and {LATERAL_MM:g} mm beside",
    )


def _check_count(log: ProbeLog, program: Program, points: int) -> None:
    if points < program.n_points:
        line = program.line[program.is_measure][points]
        raise InputError(
            log.at(len(log) - 1),
            f"the log ends before point {points + 1} (program line {line}): the run was stopped, or the file is cut",
            found=f"{points} points",
            expected=f"{program.n_points}",
        )
    if points > program.n_points:
        raise InputError(
            log.at(len(log) - (points - program.n_points)),
            "the log goes on after the last point of the program (two runs in one file?)",
            found=f"{points} points",
            expected=f"{program.n_points}",
        )


def _place(position_mm: Array) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in position_mm) + ")"


def _report(log: ProbeLog, program: Program, frame: pd.DataFrame, row: Rows) -> tuple[str, ...]:
    face, cycle = frame["face"], frame["cycle"]
    along, lateral = _from_target(frame[POSITION].to_numpy(), program, np.arange(len(frame)))
    visits = face.value_counts()
    cycles = f"{cycle.max()}" if visits.min() == visits.max() else f"{visits.min()} to {visits.max()}"
    lines = [
        f"{log.form}: {len(log)} rows, {program.n_points} points of the program",
        f"faces {face.min()} to {face.max()} ({face.nunique()} of them), cycles per face: {cycles}",
        f"triggers {along.min():+.4f} to {along.max():+.4f} mm from the nominal contact along the approach, at most"
        f" {lateral.max():.4f} mm beside it (search distance {program.settings.search_mm:g} mm)",
        f"dropped: {log.dropped} lines that are blank or comments",
    ]
    doubled = len(row) - len(np.unique(row))
    if doubled:
        lines.append(f"put back: {doubled} of the readings, left out by the log as identical to the one before")
    return tuple(lines)

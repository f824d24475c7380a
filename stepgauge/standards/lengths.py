"""Lengths between faces of a step gauge, repeat by repeat: which five are tested, and their errors.

A unidirectional length goes from front to front or from back to back and needs no tip diameter. A bidirectional one
goes from the front of a block to the back of a later one, over the outside: the effective tip diameter is subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.conditions import NOTHING, Conditions
from stepgauge.conditions.gauge import gauge_conditions
from stepgauge.conditions.outliers import ExcludedReading
from stepgauge.conditions.readings import Readings, project_readings
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.conventions import recorded_scales_C
from stepgauge.standards.rules import Rule

Kind = Literal["bidirectional", "unidirectional"]
Faces = tuple[int, int]
LENGTHS = 5
REPEATS = 3
SAME_LENGTH_MM = 1.0
"""A length that the tester asks for must be on the gauge to within this."""


@dataclass(frozen=True)
class LengthReadings:
    """Readings of one placement: ``off_mm (cycles, faces)`` is position along the axis minus certified position at the
    recorded gauge temperature, NaN where a cycle has no reading of a face. The tip is still in it.

    ``point_mm``: the mean tip centre; ``temperature_C``: mean of the gauge, None where it was not recorded;
    ``scales_C``: of the scales, likewise; ``doubtful``: readings that their repeats contradict; ``conditions``: what
    was found of the readings.
    """

    placement: int
    axis: Array
    point_mm: Array
    temperature_C: float | None
    cycles: NDArray[np.int64]
    faces: NDArray[np.int64]
    off_mm: Array
    doubtful: tuple[ExcludedReading, ...] = ()
    conditions: Conditions = NOTHING
    scales_C: float | None = None

    def face_readings(self, face: int) -> Array:
        """Readings of one face by cycle, ``(cycles,)``; NaN where it was not probed."""
        column = np.flatnonzero(self.faces == face)
        return self.off_mm[:, column[0]] if column.size else np.full(len(self.cycles), np.nan)

    def repeats(self, faces: Faces) -> NDArray[np.int64]:
        """The cycles in which both faces were probed, rising."""
        both = np.isfinite(self.face_readings(faces[0])) & np.isfinite(self.face_readings(faces[1]))
        return self.cycles[both]


def face_table(recording: Recording, gauge: Gauge, number: int, placement: Placement | None = None) -> LengthReadings:
    """The readings of one placement of a recording, checked against gauge and faces.

    :class:`InputError` for readings that are not this gauge's, and for a face that a cycle has twice.
    """
    part = recording.select_placement(number)
    frame = part.frame
    section = int(frame["face"].min() + 1) // 2, int(frame["face"].max() + 1) // 2
    readings = project_readings(part, gauge, section, None if placement is None else placement.axis, leave_out=False)
    _check_once(part, number)
    table = _pivot_readings(frame, readings)
    temperature, scales = frame.get("gauge_temperature_C"), recorded_scales_C(part)
    return LengthReadings(
        number,
        readings.axis,
        frame[POSITION].to_numpy(float).mean(axis=0),
        None if temperature is None else float(temperature.mean()),
        table.index.to_numpy(np.int64),
        table.columns.to_numpy(np.int64),
        table.to_numpy(float),
        readings.left_out,
        gauge_conditions(part, gauge, readings, readings.by_face.statistics(readings.faces)),
        None if scales is None else float(scales.mean()),
    )


def nearest_axis(direction: Array) -> tuple[int, float]:
    """Index of the machine axis that a direction is nearest to, and the angle between them in degrees."""
    nearest = int(np.abs(direction).argmax())
    return nearest, float(np.degrees(np.arccos(min(abs(direction[nearest]), 1.0))))


def doubtful_rule(tables: Sequence[LengthReadings], source: str) -> tuple[Rule, ...]:
    """A rule that is not met where a reading contradicts its repeats; none where they agree.

    A standard judges what was measured, so such a reading is used; whoever signs must know of it.
    """
    found = [f"placement {table.placement}: {one}" for table in tables for one in table.doubtful]
    if not found:
        return ()
    more = f" and {len(found) - 5} more" if len(found) > 5 else ""
    return (
        Rule(
            source, "readings without slips", "used, but far from their repeats: " + "; ".join(found[:5]) + more, False
        ),
    )


def _pivot_readings(frame: pd.DataFrame, readings: Readings) -> pd.DataFrame:
    rows = pd.DataFrame({"cycle": frame["cycle"].to_numpy(), "face": readings.face, "off": readings.off_mm})
    return rows.pivot_table(index="cycle", columns="face", values="off", aggfunc="first")


def _touched_again(frame: pd.DataFrame) -> pd.Series:
    """Rows that touch the first face of a cycle again at its end: they show a drift, and are no reading of a length."""
    first, last = (frame.groupby("cycle", sort=False)["face"].transform(which) for which in ("first", "last"))
    return ~frame.duplicated("cycle", keep="last") & frame.duplicated("cycle") & (first == last)


def _check_once(recording: Recording, number: int) -> None:
    frame = recording.frame
    twice = frame[frame.duplicated(["cycle", "face"]) & ~_touched_again(frame)]
    if len(twice):
        cycle, face = int(twice["cycle"].iloc[0]), int(twice["face"].iloc[0])
        raise InputError(
            recording.path,
            f"face {face} was probed twice in cycle {cycle} of placement {number}",
            found=f"{len(twice)} probings too many",
            expected="each face once per cycle (two recordings joined under one placement?)",
        )


def candidates(table: LengthReadings, kind: Kind, side: Literal["fronts", "backs"] = "fronts") -> list[Faces]:
    """All lengths from the first measured face to later blocks, shortest first; ``side`` is for unidirectional ones.

    Only those that have the most repeats that any has, up to the three that are asked.
    """
    fronts, backs = table.faces[table.faces % 2 == 1], table.faces[table.faces % 2 == 0]
    starts = backs if kind == "unidirectional" and side == "backs" else fronts
    ends = fronts if kind == "unidirectional" and side == "fronts" else backs
    if not starts.size:
        return []
    first = int(starts[0])
    pairs = [(first, int(end)) for end in ends if (end + 1) // 2 > (first + 1) // 2]
    most = max((len(table.repeats(pair)) for pair in pairs), default=0)
    return [pair for pair in pairs if most and len(table.repeats(pair)) >= min(most, REPEATS)]


def choose(pairs: Sequence[Faces], gauge: Gauge, wanted_mm: Sequence[float] | None = None) -> list[Faces]:
    """Five of the lengths: the shortest, the longest, and three evenly between; or those nearest to ``wanted_mm``.

    Fewer where there are no five. :class:`InputError` for a wanted length that was not measured.
    """
    sizes = np.array([nominal_length_mm(gauge, pair) for pair in pairs])
    if wanted_mm is not None:
        return list(dict.fromkeys(pairs[_nearest(sizes, length)] for length in sorted(wanted_mm)))
    left, chosen = list(range(len(pairs))), []
    for target in np.linspace(sizes[0], sizes[-1], LENGTHS)[[0, 4, 1, 2, 3]] if len(pairs) else ():
        if left:
            chosen.append(left.pop(int(np.abs(sizes[left] - target).argmin())))
    return [pairs[index] for index in sorted(chosen)]


def _nearest(sizes: Array, wanted_mm: float) -> int:
    index = int(np.abs(sizes - wanted_mm).argmin()) if sizes.size else 0
    if not sizes.size or abs(sizes[index] - wanted_mm) > SAME_LENGTH_MM:
        raise InputError(
            naming("lengths_mm"),
            f"no length of {wanted_mm:g} mm was measured",
            found=", ".join(f"{size:g}" for size in sizes[:40]) + " mm",
            expected=f"one of these to {SAME_LENGTH_MM:g} mm",
        )
    return index


def nominal_length_mm(gauge: Gauge, faces: Faces) -> float:
    """Nominal distance of two faces, mm."""
    return float(gauge.nominal_mm[faces[1] - 1] - gauge.nominal_mm[faces[0] - 1])


def length_errors_um(table: LengthReadings, faces: Faces, cycles: NDArray[np.int64], tip_diameter_mm: float) -> Array:
    """Error of the length in each of the cycles, um: indicated minus certified at the recorded gauge temperature.

    The tip diameter is subtracted from a length from a front to a back, and is of no consequence between faces of one
    side.
    """
    rows = np.isin(table.cycles, cycles)
    read = table.face_readings(faces[1])[rows] - table.face_readings(faces[0])[rows]
    tip = tip_diameter_mm if faces[0] % 2 == 1 and faces[1] % 2 == 0 else 0.0
    return (read - tip) * 1e3

"""Tables of probed points and of bench recordings: CSV with units in the column names, checked cell by cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.tables import Rows, read_rows
from stepgauge.recording.simulated import table_is_simulated

POSITION = ("x_mm", "y_mm", "z_mm")
APPROACH = ("approach_i", "approach_j", "approach_k")
SERIES = ("time_s", "rod_mm", "tip_mm", "contact", "trigger")

# Approaches are written with a few digits; a vector this far from length 1 is something else than a direction.
_UNIT_TOLERANCE = 0.01


@dataclass(frozen=True)
class ProbedPoints:
    """Recorded tip centres (n, 3) in mm and unit approaches (n, 3), with the table they came from.

    ``simulated``: the comments of the table say that no machine was measured.
    """

    rows: Rows
    position_mm: Array
    approach: Array
    simulated: bool = False


@dataclass(frozen=True)
class BenchSeries:
    """One push of a bench recording: its direction, its number and the five channels of m samples."""

    where: str
    direction_deg: float
    push: int
    channels: Mapping[str, Array]
    simulated: bool = False


def read_points(path: str | Path) -> ProbedPoints:
    """Probed points: columns ``x_mm,y_mm,z_mm,approach_i,approach_j,approach_k``, any others are kept as they are.

    Approaches are scaled to length 1; :class:`InputError` for one that is not a unit vector within 1 %.
    """
    rows = read_rows(path, (*POSITION, *APPROACH))
    approach = rows.numbers(APPROACH)
    length = np.linalg.norm(approach, axis=1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > _UNIT_TOLERANCE)
    if len(wrong):
        raise InputError(
            rows.at(wrong[0]), "the approach is not a unit vector", found=f"length {length[wrong[0]]:.4g}", expected=1
        )
    return ProbedPoints(rows, rows.numbers(POSITION), approach / length[:, None], table_is_simulated(path))


def read_bench(path: str | Path) -> list[BenchSeries]:
    """Bench recordings: columns ``time_s,rod_mm,tip_mm,contact,trigger``, ``direction_deg`` and ``push`` optional.

    Rows of one push stand together in the order of time. :class:`InputError` for times that do not grow and for
    signals other than 0 and 1.
    """
    rows = read_rows(path, SERIES)
    values = rows.numbers(SERIES)
    bad = np.argwhere((values[:, 3:] != 0.0) & (values[:, 3:] != 1.0))
    if len(bad):
        row, column = bad[0]
        found = values[row, 3 + column]
        raise InputError(rows.at(row), f"signal {SERIES[3 + column]} is wrong", found=found, expected="0 or 1")
    keys = [_optional(rows, name, default) for name, default in (("direction_deg", 0.0), ("push", 1.0))]
    simulated = table_is_simulated(path)
    starts = np.flatnonzero(np.r_[True, (np.diff(keys[0]) != 0.0) | (np.diff(keys[1]) != 0.0)])
    return [
        _one_push(rows, values, part, float(keys[0][part[0]]), int(keys[1][part[0]]), simulated)
        for part in np.split(np.arange(len(values)), starts[1:])
    ]


def _optional(rows: Rows, name: str, default: float) -> Array:
    return rows.numbers([name])[:, 0] if name in rows.header else np.full(len(rows.cells), default)


def _one_push(
    rows: Rows, values: Array, part: NDArray[np.intp], direction_deg: float, push: int, simulated: bool
) -> BenchSeries:
    backwards = np.flatnonzero(np.diff(values[part, 0]) <= 0.0)
    if len(backwards):
        row = int(part[backwards[0] + 1])
        raise InputError(rows.at(row), "time_s does not grow within a push", found=values[row, 0])
    channels = {name: values[part, i] for i, name in enumerate(SERIES)}
    return BenchSeries(rows.at(int(part[0])), direction_deg, push, channels, simulated)

"""A table as controls that take less want it: a straight line with a play, or whole pulses from point to point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stepgauge.compensation.table import CompensationTable
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array

PULSE_UM = 1.0
"""Least input increment that the pulses of a pitch error table are counted in."""
MOST_PULSES, MOST_MAGNIFICATION = 7, 100
POINTS, POINTS_OF_AXIS = 1024, 256
"""Numbers of points in a control, and of an axis: both senses of up to 128, so that no axis has those of another."""


def straight_line(table: CompensationTable) -> dict[str, float | None]:
    """The least-squares line through the mean of both senses, and what it leaves.

    ``ppm``: slope of the error (indicated minus true) in um per m; ``factor``: by which commands must be stretched,
    1 / (1 - slope); ``play_mm``: mean reversal (positive minus negative travel), None where no tip radius was stated,
    from which readings cannot tell it; ``left_um``: largest error that
    neither corrects.
    """
    x, mean = table.position_mm, table.mean_um
    slope, offset = np.polyfit(x, mean, 1)
    play_um = float(table.reversal_um.mean())
    left = [table.positive_um - play_um / 2.0, table.negative_um + play_um / 2.0]
    return {
        "ppm": float(slope * 1e3),
        "factor": float(1.0 / (1.0 - slope * 1e-3)),
        "play_mm": None if table.about.get("tip_radius_mm") is None else play_um * 1e-3,
        "left_um": float(np.abs(np.array(left) - (slope * x + offset)).max()),
    }


def pitch_pulses(table: CompensationTable, joint: int = 0) -> dict[str, Any]:
    """Increments of the error in whole pulses, from each point to the next, by sense of travel.

    ``magnification``: the smallest that keeps every pulse within +-7; ``points``: one entry a point, of which the first
    stands at the low end and is 0; ``reference``: number of the point nearest to the zero of the table. Rounding does
    not add up: the sum of pulses up to a point is the rounded error there. ``first``: number of the lowest point in the
    control, 256 times ``joint`` (the axis, from 0). :class:`InputError` for a table too steep and an axis too many.
    """
    first = POINTS_OF_AXIS * joint
    if first >= POINTS:
        most = POINTS // POINTS_OF_AXIS - 1
        raise InputError(naming("joint"), "no points left in the control", found=joint, expected=f"0 to {most}")
    reference = int(np.abs(table.position_mm - table.zero_at_mm).argmin())
    senses = {"positive": table.positive_um, "negative": table.negative_um}
    magnification, steps = _fewest_pulses(senses, reference)
    unit = PULSE_UM * magnification
    there = (table.negative_um - table.positive_um)[reference]
    return {
        "magnification": magnification,
        "unit_um": unit,
        "first": first,
        "reference": reference,
        "points": [dict(zip(senses, pair, strict=True)) for pair in zip(*steps, strict=True)],
        "at_reference": int(np.rint(there / unit)),
    }


def _fewest_pulses(senses: Mapping[str, Array], reference: int) -> tuple[int, list[list[int]]]:
    """The smallest magnification that a control can hold, and the pulses to each point by sense of travel."""
    for magnification in range(1, MOST_MAGNIFICATION + 1):
        unit = PULSE_UM * magnification
        steps = [np.diff(np.rint((values - values[reference]) / unit)).astype(int) for values in senses.values()]
        if max(np.abs(one).max() for one in steps) <= MOST_PULSES:
            return magnification, [[0, *one.tolist()] for one in steps]
    raise InputError(
        naming("step_mm"),
        "the error changes too much from point to point",
        expected=f"{MOST_PULSES * MOST_MAGNIFICATION} um",
    )

"""Squareness of two axes from a gauge that lay along both diagonals of their plane, as firmwares for skew want it.

Skew alpha: the indicated first coordinate is too large by alpha times the second, rad. Along a direction (c, s) of the
plane a length is then indicated too long by alpha c s, beside sx c^2 + sy s^2 of the two scales; the difference of two
directions with the same c^2 has alpha alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.compensation.conventions import SKEW_CONVENTIONS
from stepgauge.conditions import require_statement, stored_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.json_types import defined
from stepgauge.files.resources import folder
from stepgauge.files.templating import check_printable, fill_template

OUT_OF_PLANE_DEG, UNLIKE_DEG = 2.0, 2.0
SIDE_MM = 100.0
"""Side of the square that lengths are stated for."""


@dataclass(frozen=True)
class Skew:
    """Squareness error of a plane: ``alpha_rad`` as above with its standard uncertainty ``u_rad`` from repeatability
    (NaN where nothing was read twice), from two placements by number.
    """

    plane: str
    alpha_rad: float
    u_rad: float
    placements: tuple[int, int]


def find_skew(evaluation: Mapping[str, Any], path: str | Path, plane: str) -> Skew:
    """The skew of a plane from an ``evaluation.json``.

    :class:`InputError` where no two placements lie in the plane, mirrored at one of its axes, and where a condition of
    the readings prevents a statement.
    """
    require_statement(stored_conditions(evaluation), path)
    i, j = ("xyz".index(axis) for axis in plane)
    lying = [one for one in evaluation["placements"] if _out_of_plane_deg(one["axis"], i, j) <= OUT_OF_PLANE_DEG]
    for one in lying:
        for other in lying:
            if one["axis"][i] * one["axis"][j] > 0.0 > other["axis"][i] * other["axis"][j]:
                turned = abs(_angle_from_axis_deg(one["axis"], i, j) - _angle_from_axis_deg(other["axis"], i, j))
                if turned <= UNLIKE_DEG:
                    return Skew(plane, *_alpha(one, other, i, j), (one["placement"], other["placement"]))
    raise InputError(
        path,
        f"no two placements along the diagonals of {plane}",
        found=f"{len(lying)} placements in the plane",
        expected=f"two, mirrored at an axis to {UNLIKE_DEG:g} deg, best at 45 deg",
    )


def _out_of_plane_deg(axis: list[float], i: int, j: int) -> float:
    return math.degrees(math.asin(min(1.0, abs(axis[3 - i - j]))))


def _angle_from_axis_deg(axis: list[float], i: int, j: int) -> float:
    return math.degrees(math.atan2(abs(axis[j]), abs(axis[i])))


def _alpha(one: Mapping[str, Any], other: Mapping[str, Any], i: int, j: int) -> tuple[float, float]:
    """Skew and its standard uncertainty from repeatability (NaN where nothing was read twice), rad."""
    product = [placement["axis"][i] * placement["axis"][j] for placement in (one, other)]
    (first, u_first), (second, u_second) = _slope(one), _slope(other)
    per_um = 1e-3 / (product[0] - product[1])
    return (first - second) * per_um, math.hypot(u_first, u_second) * abs(per_um)


def _slope(placement: Mapping[str, Any]) -> tuple[float, float]:
    """Scale error along the gauge and its standard uncertainty, um per mm: fronts and backs on parallel lines.

    Not the slope of XM: the tip diameter holds the scale error of a block (Eq 1) and half of each XM is interpolated
    from the neighbours (Eqs 8 to 11), which together take from the slope what gaps are wider than blocks. Between the
    two lines lies whatever tip and reversal are.
    """
    sides = [_read_faces(placement, side) for side in ("f", "b")]
    centred = [position - position.mean() for position, _, _ in sides]
    total = sum(float(x @ x) for x in centred)
    slope = sum(float(x @ error) for x, (_, error, _) in zip(centred, sides, strict=True)) / total
    variance = sum(float(x**2 @ u**2) for x, (_, _, u) in zip(centred, sides, strict=True))
    return slope, math.sqrt(variance) / total


def _read_faces(placement: Mapping[str, Any], side: str) -> tuple[Array, Array, Array]:
    """Position in mm, error and standard uncertainty of its mean in um of the faces that were read from one side."""
    rows = [
        (one["position_mm"], one[f"x{side}_um"], one[f"s{side}_um"], one["count"])
        for one in placement["faces"]
        if one["count"] and (one["face"] % 2 == 1) == (side == "f")
    ]
    position, error, deviation, count = np.array(rows, float).reshape(-1, 4).T
    return position, error, deviation / np.sqrt(count)


def render_skew(skew: Skew, firmware: str, evaluation: Mapping[str, Any], path: str | Path) -> str:
    """The commands of a firmware that take a skew away (``SKEW_CONVENTIONS``)."""
    if firmware not in SKEW_CONVENTIONS:
        raise InputError(
            naming("to"), "no firmware that corrects a skew", found=firmware, expected=", ".join(SKEW_CONVENTIONS)
        )
    factor = -skew.alpha_rad
    sine = math.sin(math.atan(factor))
    diagonals = [SIDE_MM * math.sqrt(2.0 + 2.0 * sign * sine) for sign in (1, -1)]
    source = folder("templates") / "compensation" / "skew.j2"
    context = {
        "firmware": firmware,
        "convention": SKEW_CONVENTIONS[firmware],
        "plane": skew.plane,
        "factor": factor,
        "ppm": skew.alpha_rad * 1e6,
        "u_ppm": defined(skew.u_rad * 1e6),
        "ac_mm": diagonals[0],
        "bd_mm": diagonals[1],
        "side_mm": SIDE_MM,
        "placements": list(skew.placements),
        "evaluation": Path(path).name,
        "gauge": evaluation["gauge"]["serial"],
        "version": __version__,
    }
    text = fill_template(source, "compensation", context)
    check_printable(text, source)
    return text

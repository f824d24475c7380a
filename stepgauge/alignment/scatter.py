"""PointScatter of the 16 points from their redundancy, for the uncertainties of the placement.

The stated repeatability is used unless the points contradict it. Three properties are checked: both blocks are longer
than certified by the same tip diameter (points 1, 2, 3, 8), they are equally wide (4, 5) and equally high (6, 7). For
each of these three groups the variance is estimated from its residuals and redundancy numbers (variance components,
Foerstner 1979): s^2 = sum v^2 / sum redundancy. Where it is larger than the stated one with 99.9 % confidence, and no
larger than a hand scatters, all points get the one of all groups together; where it is larger than that, the points of
this group get theirs, with a note: a single redundancy cannot identify the erroneous point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.alignment.adjustment import ALONG, BY_HAND_MM, DETECTABLE, Adjustment, adjust
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge

GROUPS: Mapping[str, tuple[int, ...]] = {
    "long": (1, 2, 3, 8, 9, 10, 11, 16),
    "wide": (4, 5, 12, 13),
    "high": (6, 7, 14, 15),
}
"""Properties in which the two blocks agree, and the points that show it."""
ROLL = 3e-3
"""Standard deviation of the rotation about its axis of a gauge that is assumed to lie with its blocks up, rad."""
LEAST_UM = 0.05
"""Least repeatability: no probing repeats better, and points are written with this resolution."""
LEAST_REDUNDANCY = 0.1
_NORMAL = 3.09


@dataclass(frozen=True)
class PointScatter:
    """Standard deviation of each point across its face ``sigma_um (16,)``, further quantities, and notes."""

    sigma_um: Array
    redundancy: Array
    notes: tuple[str, ...]

    def to_table(self) -> dict[str, list[float]]:
        """For the placement file: per point 1 to 16 the standard deviation, redundancy, and the error that shows."""
        shows = DETECTABLE * self.sigma_um / np.sqrt(np.maximum(self.redundancy, 1e-9))
        return {
            "points_um": [round(float(value), 4) for value in self.sigma_um],
            "redundancy": [round(float(value), 4) for value in self.redundancy],
            "smallest_error_found_um": [round(float(value), 3) for value in shows],
        }


def find_scatter(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None, repeatability_um: float
) -> PointScatter:
    """The stated repeatability, increased where the points contradict it; ``points (16, 3)`` in mm."""
    stated = max(repeatability_um, LEAST_UM)
    sigma, notes = np.full(16, stated), list[str]()
    alike, by_hand = np.ones(16, bool), False
    found = adjust(points, gauge, blocks, up, sigma * 1e-3)
    for name, members in GROUPS.items():
        rows = np.array(members) - 1
        freedom = float(found.redundancy[rows].sum())
        if freedom < LEAST_REDUNDANCY:
            continue
        square = found.off_mm[rows] ** 2 * 1e6
        expected = sigma[rows] ** 2 + _roll_um(found, points, rows) ** 2
        if (square / expected).sum() <= _chi2_limit(freedom):
            continue
        enlarged = float(np.sqrt(square.sum() / freedom))
        if enlarged <= 1e3 * float(BY_HAND_MM.min()):
            by_hand = True
            continue
        sigma[rows], alike[rows] = enlarged, False
        notes.append(_note(name, members, found, enlarged, stated))
        found = adjust(points, gauge, blocks, up, sigma * 1e-3)
    freedom, shown = float(found.redundancy[alike].sum()), float((found.off_mm[alike] ** 2).sum()) * 1e6
    if freedom >= LEAST_REDUNDANCY and (by_hand or shown / stated**2 > _chi2_limit(freedom)):
        sigma[alike] = max(stated, np.sqrt(shown / freedom))  # one hand probed all of them
        found = adjust(points, gauge, blocks, up, sigma * 1e-3)
        usual = f"the 16 points scatter by {sigma[alike].max():.1f} um, as points probed by hand do"
        notes.append(f"{usual}: this counts, not {stated:g} um")
    return PointScatter(sigma, found.redundancy, tuple(notes))


def _chi2_limit(freedom: float) -> float:
    """99.9 % quantile of chi-squared (Wilson and Hilferty 1931)."""
    part = 2.0 / (9.0 * freedom)
    return float(freedom * (1.0 - part + _NORMAL * np.sqrt(part)) ** 3)


def _roll_um(found: Adjustment, points: Array, rows: NDArray[np.intp]) -> Array:
    """Influence of a rotation about the axis on points that lie differently on the two blocks, um."""
    across = {1: 2, 2: 1}
    q = (points - found.c1_mm) @ found.rotation.T
    lever = [
        abs(q[row, across[ALONG[row]]] - q[(row + 8) % 16, across[ALONG[row]]]) / 2.0 if ALONG[row] else 0.0
        for row in rows.tolist()
    ]
    return ROLL * 1e3 * np.array(lever)


def _note(name: str, members: tuple[int, ...], found: Adjustment, sigma_um: float, stated_um: float) -> str:
    listed = ", ".join(map(str, members[:-1])) + f" and {members[-1]}"
    unlike_um = _unlike_um(name, found)
    return (
        f"points {listed} contradict each other: the two blocks are not equally {name}, by {unlike_um:.1f} um."
        f" One of these points may be off (a burr, dirt, a slip); they are counted with {sigma_um:.1f} um each"
        f" instead of {stated_um:g} um"
    )


def _unlike_um(name: str, found: Adjustment) -> float:
    """Difference of the two blocks in measured length, width or height, against the certificate, um."""
    off = found.off_mm.reshape(2, 8) * 1e3
    front, sides, heights, back = off[:, :3].mean(axis=1), off[:, 3:5], off[:, 5:7] * [1.0, -1.0], off[:, 7]
    measured = {"long": front + back, "wide": sides.sum(axis=1), "high": heights.sum(axis=1)}
    return float(abs(np.diff(measured[name])[0]))

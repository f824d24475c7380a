"""The seven measuring positions of ISO 10360-2 and the lines they lie on, from the machine's travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array

POSITIONS_SOURCE = "ISO 10360-2:2009, clause 6 (measuring positions)"
LONGEST_SHARE = 0.66
"""The longest test length of a position, as a share of the travel along that line (ISO 10360-2:2009, clause 6)."""
DIAGONALS = 4
"""The first of :data:`ORIENTATIONS` are the body diagonals, which are mandatory; the others are the user's choice."""
SAME_DIRECTION_DEG = 10.0
"""A gauge turned less than this from a diagonal or an axis is taken to lie along it: it is laid by hand, and what is
tested is the line it lies on."""


@dataclass(frozen=True)
class Orientation:
    """A measuring position: its ends as shares of the travel, from (0, 0, 0) to (1, 1, 1)."""

    number: int
    name: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]

    def ends_mm(self, travel_mm: Array) -> tuple[Array, Array]:
        """Where the line starts and ends, machine coordinates; ``travel_mm (3, 2)``: lowest and highest x, y, z."""
        low, size = travel_mm[:, 0], travel_mm[:, 1] - travel_mm[:, 0]
        return low + size * np.array(self.start), low + size * np.array(self.end)

    def direction(self, travel_mm: Array) -> Array:
        """Unit vector along the line."""
        start, end = self.ends_mm(travel_mm)
        return (end - start) / np.linalg.norm(end - start)


ORIENTATIONS = (
    Orientation(1, "body diagonal (1,0,0) to (0,1,1)", (1, 0, 0), (0, 1, 1)),
    Orientation(2, "body diagonal (1,1,0) to (0,0,1)", (1, 1, 0), (0, 0, 1)),
    Orientation(3, "body diagonal (0,1,0) to (1,0,1)", (0, 1, 0), (1, 0, 1)),
    Orientation(4, "body diagonal (0,0,0) to (1,1,1)", (0, 0, 0), (1, 1, 1)),
    Orientation(5, "along x", (0, 0.5, 0.5), (1, 0.5, 0.5)),
    Orientation(6, "along y", (0.5, 0, 0.5), (0.5, 1, 0.5)),
    Orientation(7, "along z", (0.5, 0.5, 0), (0.5, 0.5, 1)),
)
"""ISO 10360-2:2009: four body diagonals, which are mandatory, and three positions of the user's choice, by default
along the axes."""


def line_length_mm(point_mm: ArrayLike, direction: ArrayLike, travel_mm: Array) -> float:
    """Travel of the machine along the line through a point: the piece of the line inside the travel, mm.

    ``travel_mm (3, 2)``. 0 where the line misses the travel.
    """
    point, along = np.asarray(point_mm, float), np.asarray(direction, float)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossing = np.sort((travel_mm - point[:, None]) / along[:, None], axis=1)
    moving = along != 0.0
    outside = (point < travel_mm[:, 0]) | (point > travel_mm[:, 1])
    if (outside & ~moving).any():
        return 0.0
    enter, leave = float(crossing[moving, 0].max()), float(crossing[moving, 1].min())
    return max(leave - enter, 0.0) * float(np.linalg.norm(along))


def orientation_of(direction: ArrayLike, travel_mm: Array) -> tuple[Orientation, float]:
    """The position that a gauge axis is nearest to, either way round, and the angle between them in degrees."""
    along = np.asarray(direction, float)
    cosines = [abs(float(along @ one.direction(travel_mm))) for one in ORIENTATIONS]
    best = int(np.argmax(cosines))
    return ORIENTATIONS[best], float(np.degrees(np.arccos(min(cosines[best], 1.0))))

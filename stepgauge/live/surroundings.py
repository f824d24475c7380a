"""What one straight move meets: the virtual CMM moves step by step, where a program is computed as a whole.

Most moves are far from everything in at least one direction of the gauge; that is found with a few comparisons. What is
not is computed exactly, as for programs (:mod:`stepgauge.motion.collision`).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepgauge.machine.stops import TOUCH_MM
from stepgauge.motion.collision import Obstacles, Tool, ToolPart, ball_contacts, clearance_mm
from stepgauge.motion.moves import Path

Array = NDArray[np.float64]
Point = tuple[float, float, float]
STEEP = 0.2
"""Rise of the stylus along the gauge's up direction from which on only the part at the height of a box is looked at."""
HALVINGS = 30


class Hit(NamedTuple):
    """What stops a move: at this share of its way, this part of the tool, this row of the obstacles."""

    share: float
    part: ToolPart
    row: int


class Surroundings:
    """The gauge around the tool, asked move by move."""

    def __init__(self, obstacles: Obstacles, tool: Tool) -> None:
        self.obstacles, self.tool = obstacles, tool
        self._rotation = obstacles.placement.rotation
        self._origin = obstacles.placement.origin_mm(obstacles.gauge)
        self._upward: Point = tuple((self._rotation @ tool.upward).tolist())
        self._low, self._high = obstacles.low_mm.tolist(), obstacles.high_mm.tolist()
        blocks = obstacles.rail_row
        self._starts = [low[0] for low in self._low[:blocks]]
        self._ends = [high[0] for high in self._high[:blocks]]

    def contact(self, start_mm: Array, end_mm: Array) -> tuple[float, int] | None:
        """Share of the way at which the tip ball first touches, and the row of what it touches; None if nothing."""
        start, end = self._to_gauge(start_mm), self._to_gauge(end_mm)
        radius = self.tool.tip_radius_mm
        found: list[tuple[float, int]] = []
        for row in self._near(start, end, radius):
            share = self._face_share(start, end, radius, row)
            if share is None:
                return self._exact_contact(start_mm, end_mm)
            if share <= 1.0:
                found.append((share, row))
        return min(found, default=None)

    def hit(self, start_mm: Array, end_mm: Array, with_tip: bool = True) -> Hit | None:
        """The first thing that a part of the tool runs into; ``with_tip``: the ball may not touch anything either."""
        start, end = self._to_gauge(start_mm), self._to_gauge(end_mm)
        parts = self.tool.parts if with_tip else self.tool.parts[1:]
        hits = [
            hit for part in parts if self._may_hit(part, start, end) and (hit := self._exact(part, start_mm, end_mm))
        ]
        return min(hits, default=None, key=lambda hit: hit.share)

    def _to_gauge(self, point_mm: Array) -> Point:
        return tuple((self._rotation @ (point_mm - self._origin)).tolist())

    def _near(self, start: Point, end: Point, reach: float) -> list[int]:
        """Rows of the boxes that a ball of this radius may come to."""
        low = [min(a, b) - reach for a, b in zip(start, end, strict=True)]
        high = [max(a, b) + reach for a, b in zip(start, end, strict=True)]
        return [row for row in self._rows(low[0], high[0]) if self._overlaps(row, low, high)]

    def _rows(self, low: float, high: float) -> list[int]:
        """Blocks between two places along the gauge, and the rail."""
        return [*range(bisect_left(self._ends, low), bisect_right(self._starts, high)), self.obstacles.rail_row]

    def _overlaps(self, row: int, low: list[float], high: list[float]) -> bool:
        pairs = zip(low, high, self._low[row], self._high[row], strict=True)
        return all(a < box_high - TOUCH_MM and b > box_low + TOUCH_MM for a, b, box_low, box_high in pairs)

    def _face_share(self, start: Point, end: Point, radius: float, row: int) -> float | None:
        """Where a ball in front of a face meets it (more than 1: not at all); None if it does not stay in front."""
        low, high = self._low[row], self._high[row]
        if not all(low[i] <= p[i] <= high[i] for p in (start, end) for i in (1, 2)):
            return None
        step = end[0] - start[0]
        wall = low[0] - radius if start[0] <= low[0] - radius else high[0] + radius
        if (wall < low[0]) != (step > 0.0) or (wall > high[0] and start[0] < wall):
            return None if step == 0.0 or low[0] - radius < start[0] < high[0] + radius else 2.0
        return (wall - start[0]) / step

    def _exact_contact(self, start_mm: Array, end_mm: Array) -> tuple[float, int] | None:
        share, row = ball_contacts(_piece(start_mm, end_mm), self.obstacles, self.tool.tip_radius_mm)
        return None if row[0] < 0 else (float(share[0]), int(row[0]))

    def _may_hit(self, part: ToolPart, start: Point, end: Point) -> bool:
        upward = self._upward
        ends = [
            tuple(p + h * u for p, u in zip(point, upward, strict=True)) for point in (start, end) for h in _ends(part)
        ]
        low = [min(column) - part.radius_mm for column in zip(*ends, strict=True)]
        high = [max(column) + part.radius_mm for column in zip(*ends, strict=True)]
        rows = [row for row in self._rows(low[0], high[0]) if self._overlaps(row, low, high)]
        return any(self._reaches(part, start, end, row) for row in rows)

    def _reaches(self, part: ToolPart, start: Point, end: Point, row: int) -> bool:
        """Whether the piece of a shank that is at the height of a box may come to it."""
        rise = self._upward[2]
        if part.far_mm <= part.near_mm or rise < STEEP:
            return True
        lowest, highest = min(start[2], end[2]), max(start[2], end[2])
        near = max(part.near_mm, (self._low[row][2] - part.radius_mm - highest) / rise)
        far = min(part.far_mm, (self._high[row][2] + part.radius_mm - lowest) / rise)
        if near > far:
            return False
        ends = [
            tuple(p + h * u for p, u in zip(q, self._upward, strict=True)) for q in (start, end) for h in (near, far)
        ]
        low = [min(column) - part.radius_mm for column in zip(*ends, strict=True)]
        high = [max(column) + part.radius_mm for column in zip(*ends, strict=True)]
        return self._overlaps(row, low, high)

    def _exact(self, part: ToolPart, start_mm: Array, end_mm: Array) -> Hit | None:
        gap = self._gaps(part, start_mm, end_mm)
        if gap.min() >= -TOUCH_MM:
            return None
        clear, struck = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = (clear + struck) / 2.0
            gap = self._gaps(part, start_mm, start_mm + middle * (end_mm - start_mm))
            clear, struck = (clear, middle) if gap.min() < -TOUCH_MM else (middle, struck)
        gap = self._gaps(part, start_mm, start_mm + struck * (end_mm - start_mm))
        return Hit(clear, part, int(gap.argmin()))

    def _gaps(self, part: ToolPart, start_mm: Array, end_mm: Array) -> Array:
        return clearance_mm(_piece(start_mm, end_mm), self.obstacles, self.tool, part, 0.0)[0]


def _ends(part: ToolPart) -> tuple[float, float]:
    return part.near_mm, part.far_mm


def _piece(start_mm: Array, end_mm: Array) -> Path:
    return Path(start_mm[None], end_mm[None], np.ones(1, bool), np.zeros(1, np.int64))

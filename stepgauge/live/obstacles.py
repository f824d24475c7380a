"""What one straight move meets: the virtual CMM moves step by step, where a program is computed as a whole.

Most moves are far from everything in at least one direction of the gauge; that is found with a few comparisons. What is
not is computed exactly, as for programs (:mod:`stepgauge.motion.collision`).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import NamedTuple

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.machine.stops import TOUCH_MM
from stepgauge.motion.collision import Obstacles, Tool, ToolPart, ball_contacts, clearance_mm
from stepgauge.motion.moves import Path

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
        self._rotation: list[Point] = [tuple(row) for row in obstacles.placement.rotation.tolist()]
        self._origin: Point = tuple(obstacles.placement.origin_mm(obstacles.gauge).tolist())
        self._upward: Point = tuple((obstacles.placement.rotation @ tool.upward).tolist())
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
        x, y, z = point_mm.tolist()
        x, y, z = x - self._origin[0], y - self._origin[1], z - self._origin[2]
        a, s, u = self._rotation
        return (
            a[0] * x + a[1] * y + a[2] * z,
            s[0] * x + s[1] * y + s[2] * z,
            u[0] * x + u[1] * y + u[2] * z,
        )

    def _near(self, start: Point, end: Point, reach: float) -> list[int]:
        """Rows of the boxes that a ball of this radius may come to."""
        low, high = self._swept(start, end, 0.0, 0.0, reach)
        return [row for row in self._rows(low[0], high[0]) if self._overlaps(row, low, high)]

    def _rows(self, low: float, high: float) -> list[int]:
        """Blocks between two places along the gauge, and the rail."""
        return [*range(bisect_left(self._ends, low), bisect_right(self._starts, high)), self.obstacles.rail_row]

    def _overlaps(self, row: int, low: Point, high: Point) -> bool:
        """Whether an axis-parallel box in gauge coordinates comes into an obstacle."""
        box_low, box_high = self._low[row], self._high[row]
        return (
            low[0] < box_high[0] - TOUCH_MM
            and high[0] > box_low[0] + TOUCH_MM
            and low[1] < box_high[1] - TOUCH_MM
            and high[1] > box_low[1] + TOUCH_MM
            and low[2] < box_high[2] - TOUCH_MM
            and high[2] > box_low[2] + TOUCH_MM
        )

    def _swept(self, start: Point, end: Point, near: float, far: float, radius: float) -> tuple[Point, Point]:
        """The axis-parallel box around a round part from ``near`` to ``far`` above the tip, along a move."""
        low, high = [0.0] * 3, [0.0] * 3
        for i in range(3):
            first, last, foot, head = start[i], end[i], near * self._upward[i], far * self._upward[i]
            low[i] = (first if first < last else last) + (foot if foot < head else head) - radius
            high[i] = (last if first < last else first) + (head if foot < head else foot) + radius
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

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
        low, high = self._swept(start, end, part.near_mm, part.far_mm, part.radius_mm)
        rows = self._rows(low[0], high[0])
        return any(self._overlaps(row, low, high) and self._reaches(part, start, end, row) for row in rows)

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
        low, high = self._swept(start, end, near, far, part.radius_mm)
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


def _piece(start_mm: Array, end_mm: Array) -> Path:
    return Path(start_mm[None], end_mm[None], np.ones(1, bool), np.zeros(1, np.int64))

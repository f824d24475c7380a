"""Safe ways between the measuring path and wherever the machine stands: back from the face, out along the stylus, over.

Only ways whose every piece keeps the tool clear of the gauge are taken; where there is none, the person has to bring
the machine to a safe place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.stops import TOUCH_MM
from stepgauge.motion.collision import clearance_mm, make_obstacles, make_tool
from stepgauge.motion.moves import Path

READING_MM = 0.05
"""How far an indicated position may be off the true one, and how deep a ball at a face may seem to be in it."""
INSIDE_MM = 1.0
"""SafePaths across stay so far inside the travel, clear of the machine's limit switches."""
HAND_MM = 1e-3
"""Positions nearer than this are the same."""


class SafePaths:
    """SafePaths around a gauge. ``margin_mm``: least gap of every part of the tool, but where it begins."""

    def __init__(self, machine: Machine, gauge: Gauge, placement: Placement, margin_mm: float = 0.5) -> None:
        self.margin_mm = margin_mm
        self.limits_mm = machine.travel_mm
        self._tool = make_tool(machine.probe)
        self._obstacles = make_obstacles(gauge, placement)

    def gap_mm(self, start_mm: Array, end_mm: Array) -> float:
        """Smallest gap between the tool and the gauge on a straight move, no more than twice the margin, mm."""
        piece = Path(start_mm[None], end_mm[None], np.zeros(1, bool), np.zeros(1, np.int64))
        reach = 2.0 * self.margin_mm + READING_MM
        gaps = [clearance_mm(piece, self._obstacles, self._tool, part, reach).min() for part in self._tool.parts]
        return float(min(*gaps, reach))

    def to_path(self, here_mm: Array, near: Sequence[Array], path: Sequence[Array]) -> tuple[list[Array], int]:
        """The way from here to the first position of a path that can be reached, and the number of that position.

        ``near``: places to back off to first, where the machine stands at a face. :class:`InputError` without a way.
        """
        for first in self._backed_off(here_mm, near):
            start = first[-1] if first else here_mm
            for number, target in enumerate(path):
                over = self._over(start, target)
                if over is not None:
                    return [*first, *over], number
        raise self._no_way(here_mm)

    def out(self, here_mm: Array, near: Sequence[Array]) -> list[Array]:
        """The way out of the gauge along the stylus, to the limit of the travel (:class:`InputError` without one)."""
        for first in self._backed_off(here_mm, near):
            start = first[-1] if first else here_mm
            end = start + self._reach_mm(start) * self._tool.upward
            if self.gap_mm(start, end) >= min(self.margin_mm, self.gap_mm(start, start)) - TOUCH_MM:
                return [*first, end]
        raise self._no_way(here_mm)

    def _no_way(self, here_mm: Array) -> InputError:
        place = ", ".join(f"{value:.3f}" for value in here_mm)
        expected = naming("resume", words="the machine brought by hand to a place above the gauge, then {}")
        return InputError("machine", "no safe way from where it stands", found=f"({place}) mm", expected=expected)

    def _backed_off(self, here_mm: Array, near: Sequence[Array]) -> Iterator[list[Array]]:
        """Nothing, where nothing is near; else the places to back off to, the nearest first."""
        here = self.gap_mm(here_mm, here_mm)
        if here >= self.margin_mm:
            yield []
        for place in sorted(near, key=lambda one: float(np.linalg.norm(one - here_mm))):
            if here >= -READING_MM and self.gap_mm(here_mm, place) >= here - TOUCH_MM:
                yield [place]

    def _over(self, start: Array, target: Array) -> list[Array] | None:
        """Out along the stylus, across, and in again; None where something is in the way."""
        upward = self._tool.upward
        level = min(float(point @ upward) + self._reach_mm(point) for point in (start, target))
        above = [point + (level - float(point @ upward)) * upward for point in (start, target)]
        way = [*above, target]
        stops = [start, *way]
        least = min(self.margin_mm, self.gap_mm(start, start), self.gap_mm(target, target))
        clear = all(self.gap_mm(a, b) >= least - TOUCH_MM for a, b in pairwise(stops))
        inside = all(self._inside(point) for point in way)
        return way if clear and inside and least > 0.0 else None

    def _inside(self, point: Array) -> bool:
        low, high = self.limits_mm[:, 0] - HAND_MM, self.limits_mm[:, 1] + HAND_MM
        return bool(((point >= low) & (point <= high)).all())

    def _reach_mm(self, point: Array) -> float:
        """How far the stylus can be drawn back along itself within the travel, mm."""
        upward = self._tool.upward
        with np.errstate(divide="ignore", invalid="ignore"):
            wall = np.where(upward > 0.0, self.limits_mm[:, 1] - INSIDE_MM, self.limits_mm[:, 0] + INSIDE_MM)
            room = np.where(np.abs(upward) > 1e-9, (wall - point) / upward, np.inf)
        return max(0.0, float(np.nanmin(room)))

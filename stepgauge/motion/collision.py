"""Obstacles around a measuring path, the parts that move along it, and their distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Path
from stepgauge.motion.sweep import first_contact, segment_distance, shank_distance
from stepgauge.probes.schema import ProbeTable

Rows = NDArray[np.intp]
RAIL_OVERHANG_MM = 15.0
"""Length of the rail beyond the first and the last face."""


@dataclass(frozen=True)
class ToolPart:
    """A round part of the probe: ``radius_mm`` about the line from ``near_mm`` to ``far_mm`` above the tip centre."""

    name: str
    radius_mm: float
    near_mm: float
    far_mm: float


@dataclass(frozen=True)
class Tool:
    """The moving parts; ``upward`` is the unit vector from the tip towards the probe body, in machine directions.

    ``body``: its diameter as the machine file has it, in words.
    """

    parts: tuple[ToolPart, ...]
    upward: Array
    body: str

    @property
    def tip_radius_mm(self) -> float:
        """Radius of the tip ball, mm."""
        return self.parts[0].radius_mm


def make_tool(probe: ProbeTable) -> Tool:
    """Tip ball, stylus shank and probe body of a probe."""
    length = probe.shank_length_mm
    parts = (
        ToolPart("tip ball", probe.tip_radius_mm, 0.0, 0.0),
        ToolPart("stylus shank", probe.shank_radius_mm, 0.0, length),
        ToolPart("probe body", probe.body_diameter_mm / 2.0, length, length + probe.body_length_mm),
    )
    default = "" if "body_diameter_mm" in probe.model_fields_set else " (not stated, the usual one)"
    body = f"body_diameter_mm = {probe.body_diameter_mm:g}{default}"
    return Tool(parts, -np.asarray(probe.stylus_direction), body)


@dataclass(frozen=True)
class Obstacles:
    """The gauge as boxes in gauge coordinates: block ``b`` is row ``b - 1``, the rail is the last row."""

    gauge: Gauge
    placement: Placement
    low_mm: Array
    high_mm: Array

    @property
    def rail_row(self) -> int:
        """Row of the rail, the last one; the blocks come before it."""
        return len(self.low_mm) - 1

    def name(self, row: int) -> str:
        """The obstacle of a row, in words."""
        return "the rail" if row == self.rail_row else f"block {row + 1}"


def make_obstacles(gauge: Gauge, placement: Placement, temperature_C: float | None = None) -> Obstacles:
    """The blocks and the rail of a placed gauge, at a gauge temperature (default: the certificate's)."""
    table = gauge.table
    face = gauge.position_at(gauge.temperature_C(temperature_C))
    half_width, half_height = table.block_width_mm / 2.0, table.block_height_mm / 2.0
    blocks = np.ones(gauge.n_blocks)
    low = np.column_stack([face[0::2], -half_width * blocks, -half_height * blocks])
    high = np.column_stack([face[1::2], half_width * blocks, half_height * blocks])
    rail = gauge.rail_width_mm / 2.0
    rail_low = [face[0] - RAIL_OVERHANG_MM, -rail, -half_height - table.rail_height_mm]
    rail_high = [face[-1] + RAIL_OVERHANG_MM, rail, -half_height]
    return Obstacles(gauge, placement, np.vstack([low, rail_low]), np.vstack([high, rail_high]))


def clearance_mm(path: Path, obstacles: Obstacles, tool: Tool, part: ToolPart, reach_mm: float) -> Array:
    """Gap between one part of the tool and every obstacle, for every piece of the path, shape ``(n_pieces, n_boxes)``.

    Negative where they overlap; infinite where the gap is certainly more than ``reach_mm``.
    """
    start = obstacles.placement.to_gauge(obstacles.gauge, path.start_mm)
    step = obstacles.placement.to_gauge(obstacles.gauge, path.end_mm) - start
    upward = obstacles.placement.rotation @ tool.upward
    foot, shank = part.near_mm * upward, (part.far_mm - part.near_mm) * upward
    gap = np.full((len(start), len(obstacles.low_mm)), np.inf)
    row, box = _near(start + foot, step, shank, part.radius_mm + reach_mm, obstacles)
    low, high = obstacles.low_mm[box], obstacles.high_mm[box]
    if part.far_mm > part.near_mm:
        gap[row, box] = shank_distance(start[row], step[row], foot, shank, low, high)
    else:
        gap[row, box] = segment_distance(start[row] + foot, step[row], low, high)
    return gap - part.radius_mm


def _near(start: Array, step: Array, shank: Array, reach: float, obstacles: Obstacles) -> tuple[Rows, Rows]:
    """Pairs of pieces and boxes whose enclosing boxes come within reach."""
    corners = np.stack([start, start + step, start + shank, start + step + shank])
    low, high = corners.min(axis=0) - reach, corners.max(axis=0) + reach
    near = (low[:, None] <= obstacles.high_mm).all(axis=-1) & (high[:, None] >= obstacles.low_mm).all(axis=-1)
    row, box = np.nonzero(near)
    return row, box


def ball_contacts(path: Path, obstacles: Obstacles, radius_mm: float) -> tuple[Array, Rows]:
    """Where a ball first touches the gauge on each piece of a path.

    Returns the parameter along the piece in [0, 1] (NaN without contact) and the row of the obstacle (-1 without).
    """
    start = obstacles.placement.to_gauge(obstacles.gauge, path.start_mm)
    step = obstacles.placement.to_gauge(obstacles.gauge, path.end_mm) - start
    row, box = _near(start, step, np.zeros(3), radius_mm, obstacles)
    t = np.full((len(start), len(obstacles.low_mm)), np.inf)
    found = first_contact(start[row], step[row], radius_mm, obstacles.low_mm[box], obstacles.high_mm[box])
    t[row, box] = np.where(np.isnan(found), np.inf, found)
    nearest = t.argmin(axis=1)
    first = t[np.arange(len(t)), nearest]
    touched = np.isfinite(first)
    return np.where(touched, first, np.nan), np.where(touched, nearest, -1)

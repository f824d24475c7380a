"""Obstacles around a measuring path, the parts that move along it, and their distances.

Distances between straight moves and boxes, exact and vectorised.

The squared distance from a point that moves along a line to a box is convex and piecewise quadratic in the position on
the line; its derivative is piecewise linear with knots where a coordinate enters or leaves its slab. Minimum and first
crossing are therefore found between two knots in closed form. All arrays have one row per pair of a move and a box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Path
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


GOLDEN_STEPS = 40
"""Golden-section steps over the move for a shank: 0.618^40 of its length, below a nanometre for any machine."""


def distance_to_box(point: Array, low: Array, high: Array) -> Array:
    """Distance from points ``(..., 3)`` to the boxes ``low``..``high`` ``(..., 3)``, 0 inside."""
    return np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0), axis=-1)


def nearest_on_line(start: Array, step: Array, low: Array, high: Array) -> Array:
    """Parameter in [0, 1] of the point of ``start + t step`` nearest to each box, shape ``(n,)``.

    Where a whole stretch is equally near (inside the box, or sliding along a face) any point of it.
    """
    knots = _knots(start, step, low, high)
    slope = _slope(start, step, low, high, knots)
    rising = slope >= 0.0
    after = np.where(rising.any(axis=1), rising.argmax(axis=1), knots.shape[1] - 1)
    before = np.maximum(after - 1, 0)
    rows = np.arange(len(start))
    t0, t1, s0, s1 = knots[rows, before], knots[rows, after], slope[rows, before], slope[rows, after]
    rise = s1 - s0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        share = np.where((rise > 0.0) & (s1 > 0.0), -s0 / rise, 1.0)
    return t0 + np.clip(share, 0.0, 1.0) * (t1 - t0)


def _knots(start: Array, step: Array, low: Array, high: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossings = np.concatenate([(low - start) / step, (high - start) / step], axis=1)
    inside = np.clip(np.nan_to_num(crossings, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    ends = np.broadcast_to([0.0, 1.0], (len(start), 2))
    return np.sort(np.concatenate([inside, ends], axis=1), axis=1)


def _slope(start: Array, step: Array, low: Array, high: Array, t: Array) -> Array:
    """Half the derivative of the squared distance at the parameters ``t (n, k)``."""
    point = start[:, None] + t[..., None] * step[:, None]
    beyond = np.maximum(point - high[:, None], 0.0) - np.maximum(low[:, None] - point, 0.0)
    return (beyond * step[:, None]).sum(axis=-1)


def segment_distance(start: Array, step: Array, low: Array, high: Array) -> Array:
    """Smallest distance between the pieces ``start``..``start + step`` ``(n, 3)`` and the boxes, shape ``(n,)``."""
    t = nearest_on_line(start, step, low, high)
    return distance_to_box(start + t[:, None] * step, low, high)


def shank_distance(start: Array, step: Array, foot: Array, shank: Array, low: Array, high: Array) -> Array:
    """Smallest distance between a moving straight shank and the boxes, shape ``(n,)``.

    The shank is the piece from ``foot`` to ``foot + shank`` (both ``(3,)``, relative to the tip) carried along
    ``start``..``start + step``: a parallelogram. For a given place of the tip the nearest point of the shank is exact;
    over the places the distance is convex and found by golden sections.
    """
    step_along_shank = np.broadcast_to(shank, start.shape)

    def at(t: Array) -> Array:
        return segment_distance(start + t[:, None] * step + foot, step_along_shank, low, high)

    return np.minimum(_golden_minimum(at, len(start)), np.minimum(at(np.zeros(len(start))), at(np.ones(len(start)))))


def _golden_minimum(function, count: int) -> Array:  # type: ignore[no-untyped-def]
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    low, high = np.zeros(count), np.ones(count)
    inner, outer = high - ratio * (high - low), low + ratio * (high - low)
    f_inner, f_outer = function(inner), function(outer)
    for _ in range(GOLDEN_STEPS):
        left = f_inner <= f_outer
        low, high = np.where(left, low, inner), np.where(left, outer, high)
        probe = np.where(left, high - ratio * (high - low), low + ratio * (high - low))
        value = function(probe)
        inner, outer = np.where(left, probe, outer), np.where(left, inner, probe)
        f_inner, f_outer = np.where(left, value, f_outer), np.where(left, f_inner, value)
    return np.minimum(f_inner, f_outer)


def first_contact(start: Array, step: Array, radius: float, low: Array, high: Array) -> Array:
    """Parameter in [0, 1] at which a ball that moves along ``start + t step`` first touches each box, NaN if never.

    A ball that touches from the beginning gives 0. Shape ``(n,)``.
    """
    nearest = nearest_on_line(start, step, low, high)
    touches = distance_to_box(start + nearest[:, None] * step, low, high) <= radius
    contact = np.full(len(start), np.nan)
    pick = np.flatnonzero(touches)
    if pick.size:
        contact[pick] = _crossing(start[pick], step[pick], radius, low[pick], high[pick], nearest[pick])
    return contact


def _crossing(start: Array, step: Array, radius: float, low: Array, high: Array, nearest: Array) -> Array:
    """First parameter with distance = radius, known to lie before ``nearest``."""
    knots = np.minimum(_knots(start, step, low, high), nearest[:, None])
    place = start[:, None] + knots[..., None] * step[:, None]
    within = distance_to_box(place, low[:, None], high[:, None]) <= radius
    within[:, -1] = True
    after = within.argmax(axis=1)
    rows = np.arange(len(start))
    t0, t1 = knots[rows, np.maximum(after - 1, 0)], knots[rows, after]
    return np.where(after == 0, 0.0, _solve_between(start, step, radius, low, high, t0, t1))


def _solve_between(start: Array, step: Array, radius: float, low: Array, high: Array, t0: Array, t1: Array) -> Array:
    """The crossing between two knots, where the same coordinates are outside their slabs throughout."""
    middle = start + ((t0 + t1) / 2.0)[:, None] * step
    wall = np.where(middle < low, low, np.where(middle > high, high, np.nan))
    active = ~np.isnan(wall)
    gap = np.where(active, start - wall, 0.0)
    rate = np.where(active, step, 0.0)
    a, b, c = (rate**2).sum(axis=1), (gap * rate).sum(axis=1), (gap**2).sum(axis=1) - radius**2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = (-b - root) / a
    return np.clip(np.where(a > 0.0, t, t0), t0, t1)

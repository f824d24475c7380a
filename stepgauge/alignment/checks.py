"""Checks of the 16 points against the certificate and against each other.

A set of points is judged by complaints: properties of the located blocks that contradict the certificate, and a test of
the points against each other (:mod:`stepgauge.alignment.adjustment`). :mod:`stepgauge.alignment.slips` searches for
the slip that explains a complaint.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np

from stepgauge.alignment.adjustment import BY_HAND_MM, adjust
from stepgauge.alignment.blocks import Blocks, solve_blocks
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import block_distance_mm, distance_tolerance_mm, scaled_tolerance_mm

SMALLEST_TRIANGLE_MM = 1.0
"""Least height of the triangle of the three front points."""
SQUARE_DEG = 0.5
"""Largest angle between the normal of a front plane and the axis."""
SIDES_DEG = 12.0
"""Largest deviation from 90 deg between the axis and the line from point 5 to point 4 (points are placed by hand)."""
WIDTH_TOLERANCE_MM = 0.5
HEIGHT_TOLERANCE_MM = 1.0
RADIUS_TOLERANCE_MM = 0.05
EDGE_MM = 0.5
"""Largest distance of a point beyond the edge of its face."""
ACROSS = {1: (1, 2), 2: (1, 2), 3: (1, 2), 8: (1, 2), 4: (0, 2), 5: (0, 2), 6: (0, 1)}
"""The two axes of the block (along, side, up) that lie in the face of a point."""
BESIDE_MM = 30.0
"""Largest distance along the gauge from a point on the rail to its block."""
CONTRADICTION = 4.1
"""Largest normalised residual of points probed by hand: 0.1 % for the largest of all."""


def check_tip(found: Blocks, tip_radius_mm: float | None, where: str | Path) -> None:
    """:class:`InputError` where the stated tip radius is not that of the points."""
    if tip_radius_mm is not None and abs(found.tip_radius_mm - tip_radius_mm) > RADIUS_TOLERANCE_MM:
        is_diameter = abs(found.tip_radius_mm - tip_radius_mm / 2.0) <= RADIUS_TOLERANCE_MM
        raise InputError(
            where,
            "the tip diameter is stated as its radius"
            if is_diameter
            else "the tip radius stated is not the one the blocks give",
            found=f"{tip_radius_mm:g} mm stated",
            expected=f"{found.tip_radius_mm:.4f} mm from front to back of the blocks",
        )


def wrong_unit(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> tuple[str, str, str] | None:
    """The contradiction, what was found and what was expected, where the points look like inches or metres."""
    middle = points.reshape(2, 8, 3).mean(axis=1)
    found, certified = float(np.linalg.norm(middle[1] - middle[0])), block_distance_mm(gauge, *blocks)
    for factor, unit in ((1 / 25.4, "inches"), (1e-3, "metres"), (25.4, "mm multiplied by 25.4")):
        if abs(found / certified / factor - 1.0) < 0.02:
            return f"the points look like {unit}", f"blocks {found:.3f} apart", f"{certified:.3f} mm"
    return None


def one_place(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> tuple[str, str, str] | None:
    """The contradiction, what was found and what was expected, where both blocks' points lie at the same place."""
    begin, end = points.reshape(2, 8, 3)
    apart = float(np.linalg.norm(end.mean(axis=0) - begin.mean(axis=0)))
    if apart > SMALLEST_TRIANGLE_MM:
        return None
    what = "points 9 to 16 lie on the block of points 1 to 8"
    if (begin == end).all():
        what = "points 9 to 16 are the same as points 1 to 8"
    if (points == points[0]).all():
        what = "all 16 points are the same"
    return what, f"blocks {apart:.3f} mm apart", f"{block_distance_mm(gauge, *blocks):.3f} mm"


def collinear(points: Array) -> str | None:
    """Front points that do not span their face, None if all do."""
    for block, first in ((0, 1), (1, 9)):
        p = points[8 * block : 8 * block + 3]
        sides = [np.linalg.norm(p[i] - p[j]) for i, j in ((0, 1), (1, 2), (2, 0))]
        area = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0]))
        height = area / max(sides) if max(sides) else 0.0
        if height < SMALLEST_TRIANGLE_MM:
            return f"points {first}, {first + 1} and {first + 2} are in line (within {height:.3f} mm)"
    return None


def complaint(points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None) -> str | None:
    """The first contradiction between points and certificate, None if there is none."""
    try:
        found = solve_blocks(points, gauge, blocks, up)
    except np.linalg.LinAlgError:
        return "the points do not make two blocks"
    far = 2.0 * block_distance_mm(gauge, *blocks)
    if not np.linalg.norm(found.centre_mm[1] - found.centre_mm[0]) < far:
        return "the points do not make two blocks"
    return next(chain(_complaints(found, gauge, blocks), _agreement(points, found, gauge, blocks, up)), None)


def undo_scale(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None, scale_error: float
) -> tuple[Array, float]:
    """The points with the blocks as far apart as certified, and by how much they were too far apart, mm.

    Scaled about the middle along the axis; unchanged, and 0, where a possible scale error does not explain them.
    """
    try:
        centre = solve_blocks(points, gauge, blocks, up).centre_mm
    except np.linalg.LinAlgError:
        return points, 0.0
    length = float(np.linalg.norm(centre[1] - centre[0]))
    certified = block_distance_mm(gauge, *blocks)
    off_mm = length - certified
    if not distance_tolerance_mm(certified) < abs(off_mm) <= scaled_tolerance_mm(gauge, blocks, scale_error):
        return points, 0.0
    axis = (centre[1] - centre[0]) / length
    scaled = points - np.outer((points - centre.mean(axis=0)) @ axis, axis) * (off_mm / length)
    return (scaled, off_mm) if complaint(scaled, gauge, blocks, up) is None else (points, 0.0)


def _complaints(found: Blocks, gauge: Gauge, blocks: tuple[int, int]) -> Iterator[str]:
    tip = np.array([_gauge_coordinates(found, gauge, b) for b in (0, 1)])
    yield from _distance(found, gauge, blocks)
    yield from _squareness(found, tip)
    yield from _radius(found)
    yield from _extent(found, gauge, blocks, tip)


def _agreement(points: Array, found: Blocks, gauge: Gauge, blocks: tuple[int, int], up: Array | None) -> Iterator[str]:
    """The points against each other: the two blocks are equally wide and high, and longer by the same tip diameter."""
    if adjust(points, gauge, blocks, up, BY_HAND_MM).worst > CONTRADICTION:
        tip = np.array([_gauge_coordinates(found, gauge, b) for b in (0, 1)])
        wide, high = tip[:, 3, 1] - tip[:, 4, 1], tip[:, 5, 2] - tip[:, 6, 2]
        yield (
            f"the two blocks differ in width by {abs(wide[1] - wide[0]):.3f} mm, in height by"
            f" {abs(high[1] - high[0]):.3f} mm, in length by {2.0 * abs(np.ptp(found.radius_mm)):.3f} mm"
        )


def _gauge_coordinates(found: Blocks, gauge: Gauge, block: int) -> Array:
    """The eight points of a block from its centre, in gauge directions (a, s, up), mm."""
    return (found.points[block] - found.centre_mm[block]) @ np.column_stack([found.axis, found.side, found.up])


def _distance(found: Blocks, gauge: Gauge, blocks: tuple[int, int]) -> Iterator[str]:
    distance, certified = (
        float(np.linalg.norm(found.centre_mm[1] - found.centre_mm[0])),
        block_distance_mm(gauge, *blocks),
    )
    if abs(distance - certified) > distance_tolerance_mm(certified):
        yield f"C1 and C2 are {distance:.3f} mm apart, blocks {blocks[0]} and {blocks[1]} {certified:.3f} mm"


def _squareness(found: Blocks, tip: Array) -> Iterator[str]:
    for block in (0, 1):
        off = np.degrees(np.arccos(np.clip(-found.normal[block] @ found.axis, -1.0, 1.0)))
        if off > SQUARE_DEG:
            yield f"the front face of points {_range(block, 1, 3)} is {off:.2f} deg off square to the axis C1-C2"
    for block in (0, 1):
        a, s, _ = tip[block, 3] - tip[block, 4]
        if abs(np.degrees(np.arctan2(a, abs(s)))) > SIDES_DEG:
            yield (
                f"the side points {8 * block + 4} and {8 * block + 5} are not square to the axis"
                f" ({abs(np.degrees(np.arctan2(a, abs(s)))):.1f} deg off, at most {SIDES_DEG:g} deg)"
            )


def _range(block: int, first: int, last: int) -> str:
    return f"{8 * block + first} to {8 * block + last}"


def _radius(found: Blocks) -> Iterator[str]:
    one, two = found.radius_mm
    if min(one, two) <= 0.0 or abs(one - two) > RADIUS_TOLERANCE_MM:
        yield (
            f"front to back, block 1-8 measures {2 * one:.3f} mm and block 9-16 {2 * two:.3f} mm more than certified;"
            " both should be one tip diameter"
        )


def _extent(found: Blocks, gauge: Gauge, blocks: tuple[int, int], tip: Array) -> Iterator[str]:
    """Every point must lie on the face it is claimed to lie on."""
    width, height = gauge.table.block_width_mm, gauge.table.block_height_mm
    for block in (0, 1):
        half = np.array([gauge.block_size_mm[blocks[block] - 1], width, height]) / 2.0 + EDGE_MM
        p, at = tip[block], 8 * block
        yield from _size(p, at, gauge, float(found.tip_radius_mm))
        yield from _beyond_edge(p, at, half)
        if abs(p[6, 0]) > half[0] + BESIDE_MM:
            yield f"point {at + 7} is not beside its block but {abs(p[6, 0]):.1f} mm along the gauge from it"
        yield from _check_rail_point(p, at, gauge, float(found.tip_radius_mm))


def _size(p: Array, at: int, gauge: Gauge, radius: float) -> Iterator[str]:
    """The block is as wide and as high as certified; ``p (8, 3)``: its points from its middle, after number ``at``."""
    width, height = gauge.table.block_width_mm, gauge.table.block_height_mm
    measured_width, measured_height = p[3, 1] - p[4, 1], p[5, 2] - p[6, 2]
    if abs(measured_width - width - 2.0 * radius) > WIDTH_TOLERANCE_MM:
        yield (
            f"side points {at + 4} and {at + 5} are {measured_width:.3f} mm apart along +s,"
            f" width and tip make {width + 2.0 * radius:.3f} mm"
        )
    if abs(measured_height - height) > HEIGHT_TOLERANCE_MM:
        yield (
            f"point {at + 6} is {measured_height:.3f} mm above point {at + 7},"
            f" the block is {height:g} mm above the rail"
        )


def _beyond_edge(p: Array, at: int, half: Array) -> Iterator[str]:
    """Points that lie in the plane of their face and not on it; ``half (3,)``: of the block, with the tolerance."""
    for point, across in ACROSS.items():
        beyond = np.abs(p[point - 1]) - half
        worst = max(across, key=lambda axis: beyond[axis])
        if beyond[worst] > 0.0:
            yield f"point {at + point} lies {beyond[worst] + EDGE_MM:.3f} mm beyond the edge of its face"


def _check_rail_point(p: Array, at: int, gauge: Gauge, radius: float) -> Iterator[str]:
    least = gauge.table.block_width_mm / 2.0 + radius - EDGE_MM
    aside, most = abs(p[6, 1]), gauge.rail_width_mm / 2.0 + EDGE_MM
    if not least <= aside <= most:
        yield (
            f"point {at + 7} is not on the rail beside its block but {aside:.1f} mm to the side of the middle"
            f" ({least:.1f} to {most:.1f} mm)"
        )

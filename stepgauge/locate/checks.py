"""Are the 16 points what they are claimed to be? If not, the single slip that explains them is named.

A set of points is judged by complaints: facts about the located blocks that contradict the certificate. Where there are
any, likely slips are undone one by one (inches, blocks swapped, two points swapped, a point on a neighbour block, other
blocks than claimed); the one that leaves no complaint is the explanation.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.gauge import Gauge
from stepgauge.locate.blocks import Blocks, fit_up, rough_axis, solve_blocks
from stepgauge.placement import block_distance_mm, distance_tolerance_mm

Array = NDArray[np.float64]
SMALLEST_TRIANGLE_MM = 1.0
"""Least height of the triangle of the three front points."""
SQUARE_DEG = 0.5
"""How far a front plane's normal may be off the axis."""
SIDES_DEG = 12.0
"""How far the line from point 5 to point 4 may be off square to the axis (the points are placed by hand)."""
WIDTH_TOLERANCE_MM = 0.5
HEIGHT_TOLERANCE_MM = 1.0
RADIUS_TOLERANCE_MM = 0.05
EDGE_MM = 0.5
"""How far a point may seem to lie beyond the edge of its face."""
BESIDE_MM = 30.0
"""How far along the gauge the rail may be touched from the block it belongs to."""


def check_points(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    up: Array | None,
    tip_radius_mm: float | None,
    where: str | Path,
) -> None:
    """Raise :class:`InputError` where the points contradict the certificate, with the slip that explains them."""
    inches = _inches(points, gauge, blocks)
    if inches:
        raise InputError(where, *inches[:1], found=inches[1], expected=inches[2])
    collinear = _collinear(points)
    if collinear:
        raise InputError(where, collinear, expected="three points that span the front face")
    complaint = _complaint(points, gauge, blocks, up)
    if complaint is None:
        _check_tip(solve_blocks(points, gauge, blocks, up), tip_radius_mm, where)
        return
    slip = next((slip for turned in (False, True) for slip in _slips(points, gauge, blocks, turned)), None)
    if slip:
        raise InputError(where, slip, found=complaint)
    raise InputError(where, complaint)


def _check_tip(found: Blocks, tip_radius_mm: float | None, where: str | Path) -> None:
    if tip_radius_mm is not None and abs(found.tip_radius_mm - tip_radius_mm) > RADIUS_TOLERANCE_MM:
        raise InputError(
            where,
            "the tip radius stated is not the one the blocks give",
            found=f"{tip_radius_mm:g} mm stated",
            expected=f"{found.tip_radius_mm:.4f} mm from front to back of the blocks",
        )


def _inches(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> tuple[str, str, str] | None:
    middle = points.reshape(2, 8, 3).mean(axis=1)
    found, certified = float(np.linalg.norm(middle[1] - middle[0])), block_distance_mm(gauge, *blocks)
    for factor, unit in ((1 / 25.4, "inches"), (1e-3, "metres"), (25.4, "mm multiplied by 25.4")):
        if abs(found / certified / factor - 1.0) < 0.02:
            return f"the points look like {unit}", f"blocks {found:.3f} apart", f"{certified:.3f} mm"
    return None


def _collinear(points: Array) -> str | None:
    for block, first in ((0, 1), (1, 9)):
        p = points[8 * block : 8 * block + 3]
        sides = [np.linalg.norm(p[i] - p[j]) for i, j in ((0, 1), (1, 2), (2, 0))]
        area = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0]))
        height = area / max(sides) if max(sides) else 0.0
        if height < SMALLEST_TRIANGLE_MM:
            return f"points {first}, {first + 1} and {first + 2} are in line (within {height:.3f} mm)"
    return None


def _complaint(points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None) -> str | None:
    """The first contradiction between points and certificate, None if there is none."""
    try:
        found = solve_blocks(points, gauge, blocks, up)
    except np.linalg.LinAlgError:
        return "the points do not make two blocks"
    if not np.isfinite(found.centre_mm).all():
        return "the points do not make two blocks"
    return next(_complaints(found, gauge, blocks), None)


def _complaints(found: Blocks, gauge: Gauge, blocks: tuple[int, int]) -> Iterator[str]:
    tip = np.array([_in_block(found, gauge, b) for b in (0, 1)])
    yield from _distance(found, gauge, blocks)
    yield from _squareness(found, tip)
    yield from _radius(found)
    yield from _extent(found, gauge, blocks, tip)


def _in_block(found: Blocks, gauge: Gauge, block: int) -> Array:
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
    width, height, radius = gauge.table.block_width_mm, gauge.table.block_height_mm, found.tip_radius_mm
    for block in (0, 1):
        p, at = tip[block], 8 * block
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
        half = np.array([gauge.block_size_mm[blocks[block] - 1], width, height]) / 2.0 + EDGE_MM
        for point, across in (
            (1, (1, 2)),
            (2, (1, 2)),
            (3, (1, 2)),
            (8, (1, 2)),
            (4, (0, 2)),
            (5, (0, 2)),
            (6, (0, 1)),
        ):
            beyond = np.abs(p[point - 1]) - half
            worst = max(across, key=lambda axis: beyond[axis])
            if beyond[worst] > 0.0:
                yield f"point {at + point} lies {beyond[worst] + EDGE_MM:.3f} mm beyond the edge of its face"
        if abs(p[6, 0]) > half[0] + BESIDE_MM:
            yield f"point {at + 7} is not beside its block but {abs(p[6, 0]):.1f} mm along the gauge from it"


def _slips(points: Array, gauge: Gauge, blocks: tuple[int, int], turned: bool) -> Iterator[str]:
    """Descriptions of the slips that, undone, leave no complaint; ``turned`` lets the gauge lie on its side."""

    def explains(mended: Array, claimed: tuple[int, int] = blocks) -> bool:
        if _collinear(mended) is not None:
            return False
        up = fit_up(mended, rough_axis(mended), gauge)[0] if turned else None
        return _complaint(mended, gauge, claimed, up) is None

    if explains(np.roll(points, 8, axis=0)):
        yield "points 1-8 and 9-16 look swapped: the beginning block is the one whose front looks away from the other"
    for one, other in combinations(range(16), 2):
        mended = points.copy()
        mended[[one, other]] = mended[[other, one]]
        if explains(mended):
            yield f"points {one + 1} and {other + 1} look swapped"
    for point, block, mended in _moved_back(points, gauge, blocks):
        if explains(mended):
            yield f"point {point} looks like one on block {block}, not on block {blocks[(point - 1) // 8]}"
    fitting = [pair for pair in combinations(range(1, gauge.n_blocks + 1), 2) if _fits(points, gauge, pair)]
    if fitting and explains(points, fitting[0]):
        others = f" (and {len(fitting) - 1} other pairs as far apart)" if len(fitting) > 1 else ""
        yield (
            f"these are not blocks {blocks[0]} and {blocks[1]}: the distance fits blocks"
            f" {fitting[0][0]} and {fitting[0][1]}{others}; state them with --blocks"
        )


def _moved_back(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> Iterator[tuple[int, int, Array]]:
    """Each point moved to its block from each of the four blocks next to it."""
    axis = rough_axis(points)
    for point in range(16):
        own = blocks[point // 8]
        for block in (own + 1, own - 1, own + 2, own - 2):
            if 1 <= block <= gauge.n_blocks:
                mended = points.copy()
                mended[point] -= axis * (gauge.block_centre_mm[block - 1] - gauge.block_centre_mm[own - 1])
                yield point + 1, block, mended


def _fits(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> bool:
    fronts = points.reshape(2, 8, 3)[:, [0, 1, 2, 7]].mean(axis=1)
    found, certified = float(np.linalg.norm(fronts[1] - fronts[0])), block_distance_mm(gauge, *blocks)
    return abs(found - certified) < 2.0 + distance_tolerance_mm(certified)

"""The slip that explains why 16 points contradict the certificate or each other.

Frequent slips are undone one by one: blocks swapped, two points swapped, a point on a neighbour block, columns
exchanged, one erroneous point (:func:`stepgauge.alignment.adjustment.suspects`), other blocks or another gauge than
claimed. The one that leaves no complaint is the explanation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, islice
from pathlib import Path

import numpy as np

from stepgauge.alignment.adjustment import BY_HAND_MM, LONGER, RADIUS, Adjustment, adjust, expected_place, suspects
from stepgauge.alignment.blocks import fit_up, rough_axis, solve_blocks
from stepgauge.alignment.checks import CONTRADICTION, check_tip, collinear, complaint, one_place, undo_scale, wrong_unit
from stepgauge.alignment.surface import check_tip_centres
from stepgauge.errors import InputError, Naming, naming
from stepgauge.files.arrays import Array
from stepgauge.files.resources import folder
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import (
    POSSIBLE_SCALE_ERROR,
    STANDING_COS,
    STATE_KIND,
    Placement,
    block_distance_mm,
    distance_tolerance_mm,
    make_placement,
)

Explains = Callable[..., bool]
ALIKE = 4.0
"""Two points explain the contradiction equally well where their sums of squares differ by less than this."""
MOST_FILES = 50
"""Largest number of files of a folder that are read for a gauge that fits better."""


def check_points(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    up: Array | None,
    tip_radius_mm: float | None,
    where: str | Path,
) -> None:
    """Raise :class:`InputError` where the points contradict the certificate, with the slip that explains them."""
    whole = wrong_unit(points, gauge, blocks) or one_place(points, gauge, blocks)
    if whole:
        raise InputError(where, whole[0], found=whole[1], expected=whole[2])
    in_line = collinear(points)
    if in_line:
        off = next(_single(points, gauge, blocks, False, _judge(gauge, blocks, False)), None)
        if off:
            raise InputError(where, off, found=in_line)
        raise InputError(where, in_line, expected="three points that span the front face")
    check_tip_centres(points, gauge, blocks, up, tip_radius_mm, where)
    wrong = complaint(points, gauge, blocks, up)
    if wrong is None:
        check_tip(solve_blocks(points, gauge, blocks, up), tip_radius_mm, where)
        return
    slip = next((slip for turned in (False, True) for slip in _slips(points, gauge, blocks, turned)), None)
    if slip:
        raise InputError(where, slip, found=wrong)
    scaled = undo_scale(points, gauge, blocks, up, POSSIBLE_SCALE_ERROR)[1] != 0.0
    raise InputError(where, wrong, expected=STATE_KIND if scaled else None)


def _judge(gauge: Gauge, blocks: tuple[int, int], turned: bool) -> Explains:
    """Whether corrected points leave no complaint, as points on these blocks or on others that are named."""

    def explains(mended: Array, claimed: tuple[int, int] = blocks, of: Gauge = gauge) -> bool:
        if collinear(mended) is not None:
            return False
        up = fit_up(mended, rough_axis(mended), of)[0] if turned else None
        return complaint(mended, of, claimed, up) is None

    return explains


def _slips(points: Array, gauge: Gauge, blocks: tuple[int, int], turned: bool) -> Iterator[str | Naming]:
    """Descriptions of the slips that, undone, leave no complaint; with ``turned`` the gauge may lie on its side."""

    explains = _judge(gauge, blocks, turned)
    if explains(np.roll(points, 8, axis=0)):
        yield "points 1-8 and 9-16 look swapped: the first block is the one whose front faces away from the other"
    for one, other in _pairs(points, explains):
        yield f"points {one + 1} and {other + 1} look swapped"
    for point, block, mended in _moved_back(points, gauge, blocks):
        if explains(mended):
            yield f"point {point} looks like one on block {block}, not on block {blocks[(point - 1) // 8]}"
    yield from _columns(points, explains)
    yield from _single(points, gauge, blocks, turned, explains)
    yield from _others(points, gauge, blocks, explains)


def _pairs(points: Array, explains: Explains) -> Iterator[tuple[int, int]]:
    for one, other in combinations(range(16), 2):
        if explains(exchanged(points, (one, other))):
            yield one, other


def exchanged(points: Array, pair: tuple[int, int]) -> Array:
    """The points with two of them in each other's place."""
    mended = points.copy()
    mended[list(pair)] = points[list(pair[::-1])]
    return mended


def swapped_points(points: Array, gauge: Gauge, blocks: tuple[int, int], turned: bool) -> tuple[int, int] | None:
    """The two points, from 0, that explain the contradiction if they are exchanged; None where no two do."""
    explains = _judge(gauge, blocks, turned)
    return next(_pairs(points, explains), None) if collinear(points) is None else None


def _columns(points: Array, explains: Explains) -> Iterator[str]:
    """Two columns exchanged, which mirrors the gauge; a result that does not stand on end is more probable."""
    ways = [order for order in ((1, 0, 2), (2, 1, 0), (0, 2, 1)) if explains(points[:, order])]
    ways.sort(key=lambda order: bool(abs(rough_axis(points[:, order])[2]) > STANDING_COS))
    for order in ways[:1]:
        moved = " and ".join(f"{'xyz'[axis]}_mm" for axis in range(3) if order[axis] != axis)
        more = "" if order[2] != 2 else " (or points 4 and 5, and 12 and 13)"
        yield f"the columns {moved} look exchanged{more}"


def _single(points: Array, gauge: Gauge, blocks: tuple[int, int], turned: bool, explains: Explains) -> Iterator[str]:
    """One erroneous point, or the few points among which the data cannot decide."""
    up = fit_up(points, rough_axis(points), gauge)[0] if turned else None
    found: list[tuple[int, Adjustment, Array]] = []
    for point, others in suspects(points, gauge, blocks, up):
        if found and others.chi2 - found[0][1].chi2 > ALIKE:
            break
        mended = points.copy()
        mended[point] = expected_place(points, point, others, gauge, blocks)
        if explains(mended):
            found.append((point, others, mended[point]))
    if found:
        point, _, place = found[0]
        off = [(p + 1, _far(points[p], there)) for p, _, there in found]
        several = ", ".join(f"point {p} by {far} mm" for p, far in off)
        one = f"point {off[0][0]} is off by {off[0][1]} mm"
        words = f"one point is off, the others cannot tell which: {several}" if found[1:] else one
        at, there = (", ".join(f"{value:.3f}" for value in one) for one in (points[point], place))
        yield f"{words}; {point + 1} is at ({at}), by the others near ({there})"


def _far(one: Array, other: Array) -> str:
    return f"{float(np.linalg.norm(one - other)):.3f}"


def _others(points: Array, gauge: Gauge, blocks: tuple[int, int], explains: Explains) -> Iterator[Naming]:
    """Other blocks of this gauge, or blocks of another available gauge."""
    ideas = list[str]()
    fitting = _fitting(points, gauge)
    if fitting and explains(points, fitting[0]):
        others = f" (and {len(fitting) - 1} other pairs as far apart)" if len(fitting) > 1 else ""
        ideas.append(f"blocks {fitting[0][0]} and {fitting[0][1]}{others}; state them with {{}}")
    whole, part = list[str](), list[str]()  # a gauge whose first and last block fit is likelier than one of many pairs
    own_fits = _fits(points, gauge, blocks)  # then the distance says nothing for another gauge
    for other in gauges_at_hand(gauge) if not own_fits else ():
        ends = (1, other.n_blocks)
        pair = ends if _fits(points, other, ends) else next(iter(_fitting(points, other)), None)
        if pair and explains(points, pair, other):
            (whole if pair == ends else part).append(
                f"blocks {pair[0]} and {pair[1]} of {other.table.name} ({other.table.serial})"
            )
    ideas += [*whole, *part]
    if ideas:
        words = f"these are not blocks {blocks[0]} and {blocks[1]}: the distance fits " + "; or ".join(ideas)
        yield naming("blocks", words=words)


def _fitting(points: Array, gauge: Gauge) -> list[tuple[int, int]]:
    return [pair for pair in combinations(range(1, gauge.n_blocks + 1), 2) if _fits(points, gauge, pair)]


def gauges_at_hand(gauge: Gauge) -> Iterator[Gauge]:
    """The gauges in files beside that of this gauge, and the shipped ones; unreadable files are left out."""
    folders = [Path(gauge.path).parent, folder("calibration_data")] if gauge.path else [folder("calibration_data")]
    paths = (path for place in folders for path in islice(sorted(place.glob("*.toml")), MOST_FILES))
    seen = {gauge.table.serial}
    for path in paths:
        try:
            other = read_gauge(path)
        except InputError:
            continue
        if other.table.serial not in seen:
            seen.add(other.table.serial)
            yield other


def _moved_back(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> Iterator[tuple[int, int, Array]]:
    """Each point moved to its block from each of the four nearest other blocks."""
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


@dataclass(frozen=True)
class Agreement:
    """Where each of the 16 points is from the face that it should be on.

    ``off_mm (16,)``: outward positive; ``normalised (16,)``: over its standard deviation, see
    :mod:`stepgauge.alignment.adjustment`; ``suspects``: the points (from 1) that explain best why they disagree: two
    that were exchanged, or one, which has no weight here; none where they agree; ``lies``: how the gauge lies then.
    """

    off_mm: Array
    normalised: Array
    suspects: tuple[int, ...]
    lies: Placement


def agreement(points: Array, gauge: Gauge, blocks: tuple[int, int], turned: bool = False) -> Agreement | None:
    """The points as one adjustment; None where they make no two blocks.

    Parameters
    ----------
    points : tip centres in mm, shape ``(16, 3)``
    gauge, blocks : the certified gauge, and the numbers of the beginning and the end block
    turned : the up direction is that of the points, for a gauge that is steep or turned about its axis
    """
    try:
        up = fit_up(points, rough_axis(points), gauge)[0] if turned else None
        found, blamed, off_mm = _explained(points, gauge, blocks, up, turned)
    except np.linalg.LinAlgError:
        return None
    if not np.isfinite(found.unknowns).all() or found.unknowns[RADIUS] <= 0.0:
        return None
    return Agreement(off_mm, found.normalised[:16], blamed, _placement(found, gauge, blocks))


def _explained(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None, turned: bool
) -> tuple[Adjustment, tuple[int, ...], Array]:
    """The adjustment, the points to blame, and how far every point is off."""
    found = adjust(points, gauge, blocks, up, BY_HAND_MM)
    if found.worst <= CONTRADICTION:
        return found, (), found.off_mm
    pair = swapped_points(points, gauge, blocks, turned)
    if pair is None:
        place, found = next(suspects(points, gauge, blocks, up))
        return found, (place + 1,), found.off_mm
    found = adjust(exchanged(points, pair), gauge, blocks, up, BY_HAND_MM)
    off_mm = found.off_mm.copy()
    off_mm[list(pair)] = np.linalg.norm(points[pair[0]] - points[pair[1]])
    return found, (pair[0] + 1, pair[1] + 1), off_mm


def _placement(found: Adjustment, gauge: Gauge, blocks: tuple[int, int]) -> Placement:
    along, _, up = found.rotation
    apart = block_distance_mm(gauge, *blocks) + float(found.unknowns[LONGER])
    radius = float(found.unknowns[RADIUS])
    return make_placement(found.c1_mm, found.c1_mm + apart * along, *blocks, up, radius, gauge.table.serial)

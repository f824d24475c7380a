"""How the 16 points agree with each other, point by point: for a person who wants to see which one disagrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepgauge.alignment.adjustment import BY_HAND_MM, LONGER, RADIUS, Adjustment, adjust, suspects
from stepgauge.alignment.blocks import fit_up, rough_axis
from stepgauge.alignment.checks import CONTRADICTION
from stepgauge.alignment.slips import exchanged, swapped_points
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, block_distance_mm, make_placement


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

"""How the 16 points agree with each other, point by point: for a person who wants to see which one disagrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.alignment.adjustment import BY_HAND_MM, LONGER, RADIUS, Adjustment, adjust, suspects
from stepgauge.alignment.blocks import fit_up, rough_axis
from stepgauge.alignment.checks import CONTRADICTION
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, block_distance_mm, make_placement

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """Where each of the 16 points is from the face that it should be on.

    ``off_mm (16,)``: outward positive; ``normalised (16,)``: over its standard deviation, see
    :mod:`stepgauge.alignment.adjustment`; ``suspect``: the point (from 1) that explains best why they disagree, and
    has no weight here, None where they agree; ``lies``: how the gauge lies by all the others.
    """

    off_mm: Array
    normalised: Array
    suspect: int | None
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
        found, suspect = adjust(points, gauge, blocks, up, BY_HAND_MM), None
        if found.worst > CONTRADICTION:
            place, found = next(suspects(points, gauge, blocks, up))
            suspect = place + 1
    except np.linalg.LinAlgError:
        return None
    if not np.isfinite(found.unknowns).all() or found.unknowns[RADIUS] <= 0.0:
        return None
    return Agreement(found.off_mm, found.normalised[:16], suspect, _placement(found, gauge, blocks))


def _placement(found: Adjustment, gauge: Gauge, blocks: tuple[int, int]) -> Placement:
    along, _, up = found.rotation
    apart = block_distance_mm(gauge, *blocks) + float(found.unknowns[LONGER])
    radius = float(found.unknowns[RADIUS])
    return make_placement(found.c1_mm, found.c1_mm + apart * along, *blocks, up, radius, gauge.table.serial)

"""Whether the points of a log are tip centres or compensated by the tip radius: as stated, and as the gauge shows."""

from __future__ import annotations

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.identity import LARGEST_RADIUS_MM, axis_from_approaches

CLEAR = 0.25
"""Points are at the surface, or a tip radius before it, if they are nearer to that than this share of the radius."""
SURFACE_MM = 0.1
"""Points nearer to their faces than the smallest tip radius are surface points."""


def unseen_question(log: ProbeLog, before_mm: float | None) -> InputError:
    """What to ask where neither a statement nor the distance from the faces says what the points are."""
    what = "whether the points are tip centres is not stated, and their distance from the faces does not show it"
    if before_mm is None:
        found = "touches in one direction, whose distance is that of the placement as well"
        return InputError(log.path, what, found=found, expected=naming("points", words="{} centres or surface"))
    found = f"{before_mm:.4f} mm before the certified faces on average"
    expected = naming("points", words="0 or the tip radius; or {} centres or surface")
    return InputError(log.path, what, found=found, expected=expected)


def width_radius_mm(log: ProbeLog, gauge: Gauge | None) -> float | None:
    """Half of how much wider than certified the blocks are read: the tip radius for tip centres; None if unknown."""
    face = log.columns["face"].astype(np.int64)
    sides = [face % 2 == side for side in (1, 0)]
    if gauge is None or log.approach is None or face.max() > gauge.n_faces or not all(side.any() for side in sides):
        return None
    placement = log.columns.get("placement", np.zeros(len(log)))
    first = placement == placement[0]  # the blocks are as wide in every placement
    axis = axis_from_approaches(list(log.approach[first].T), face[first], log.path)
    off_mm = log.position_mm @ axis - gauge.position_mm[face - 1]
    front, back = (float(np.median(off_mm[side & first])) for side in sides)
    return (back - front) / 2.0


def are_surface_points(
    log: ProbeLog, before_mm: float | None, stated: bool | None, radius: float | None
) -> bool | None:
    """Whether points are compensated by the tip radius: as stated, checked against the gauge; else as it shows.

    ``before_mm``: how far before the certified faces they stand, None if unknown; ``stated``: by hand.
    None: neither stated nor to be seen.
    """
    limit = CLEAR * radius if radius else SURFACE_MM
    stated, shows = log.surface if stated is None else stated, None
    if before_mm is not None:
        at_centre = abs(before_mm - radius) < limit if radius else limit <= before_mm < LARGEST_RADIUS_MM
        shows = True if abs(before_mm) < limit else False if at_centre else None
    if stated is None:
        return shows
    if shows is not None and radius and shows != stated:
        kinds = ("tip centres", "compensated by the tip radius")
        raise InputError(
            log.path,
            f"the points are said to be {kinds[stated]}, but they are {kinds[shows]}",
            found=f"points {before_mm:.4f} mm before the certified faces on average",
            expected=f"about {0.0 if stated else radius:g} mm with a tip radius of {radius:g} mm",
        )
    return stated

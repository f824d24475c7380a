"""``probe_map``: force, deflection and pre-travel of a probe over the directions of the surface."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepgauge.errors import InputError, naming
from stepgauge.probes import read_probe
from stepgauge.probes.angles import Angles, direction_grid
from stepgauge.probes.directions_map import DirectionMap, map_directions
from stepgauge.verbs.inputs import File


def probe_map(
    probe: File,
    *,
    polar_deg: Angles = "10:90:10",
    azimuth_deg: Angles = "0:360:10",
    stylus_direction: Sequence[float] | None = None,
) -> DirectionMap:
    """Map what a probe does over the directions in which surfaces push its tip.

    Parameters
    ----------
    probe : probe file, or the name of a shipped one
    polar_deg : angles of the surface normal from the stylus axis: 90 is a wall along the stylus, 0 a floor under it
    azimuth_deg : azimuths of the surface normal about the stylus, from the probe's x towards y
    stylus_direction : hold the probe in another direction than its file says, from body to tip in machine axes

    Returns
    -------
    Trigger force in N, deflection and pre-travel in um, shape ``(polars, azimuths)``; NaN where the model does not give
    it, infinite where the probe never triggers.
    """
    grid = direction_grid(polar_deg, azimuth_deg)
    return map_directions(read_probe(probe, _unit(stylus_direction)), *grid)


def _unit(direction: Sequence[float] | None) -> tuple[float, ...] | None:
    if direction is None:
        return None
    length = math.sqrt(sum(float(part) ** 2 for part in direction))
    if len(direction) != 3 or not 0.0 < length < math.inf:
        raise InputError(
            naming("stylus_direction"), "not a direction", found=direction, expected="three numbers, 1,0,0"
        )
    return tuple(float(part) / length for part in direction)

"""Points on the surface, as PC-DMIS and others report them: compensated by the tip radius along the faces' normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stepgauge.alignment.blocks import Blocks, fit_up, rough_axis, solve_blocks
from stepgauge.alignment.checks import RADIUS_TOLERANCE_MM
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge

LOOK_ON_SURFACE = "the points look compensated by the tip radius"
NOT_ON_SURFACE = "the points do not look compensated by the tip radius"


def tip_centres(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    tip_radius_mm: float | None,
    where: str | Path = "points",
    turned: bool = False,
) -> Array:
    """Where the tip centre was, ``(16, 3)`` mm, when it touched the surface at ``points``.

    Every point moves outward by the tip radius, perpendicular to the face it should lie on. The directions are those
    of the surface points themselves; a direction that is off by t moves a plane by r t^2 / 2 only.
    :class:`InputError` where the tip radius is not known, or the blocks are longer than certified by a tip diameter.
    """
    if tip_radius_mm is None:
        expected = naming("tip_radius_mm", "machine", words="{} or {}")
        raise InputError(where, "the tip radius is not known", expected=expected)
    try:
        up = fit_up(points, rough_axis(points), gauge)[0] if turned else None
        found = solve_blocks(points, gauge, blocks, up)
    except np.linalg.LinAlgError:
        return points  # no two blocks: the checks say what is wrong
    if (np.abs(found.radius_mm - tip_radius_mm) < RADIUS_TOLERANCE_MM).all():
        raise InputError(
            where, NOT_ON_SURFACE, found=_longer(found), expected=f"0 mm more within {RADIUS_TOLERANCE_MM:g} mm"
        )
    a, s, up = found.axis, found.side, found.up
    return points + tip_radius_mm * np.tile([-a, -a, -a, s, -s, up, up, a], (2, 1))


def check_tip_centres(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    up: Array | None,
    tip_radius_mm: float | None,
    where: str | Path,
) -> None:
    """:class:`InputError` where points that should be tip centres make blocks just as long as certified."""
    if tip_radius_mm is not None and tip_radius_mm < 2.0 * RADIUS_TOLERANCE_MM:
        return
    try:
        found = solve_blocks(points, gauge, blocks, up)
    except np.linalg.LinAlgError:
        return
    if (np.abs(found.radius_mm) < RADIUS_TOLERANCE_MM).all():
        expected = naming("surface", words="tip centres, or {} stated to locate")
        raise InputError(where, LOOK_ON_SURFACE, found=_longer(found), expected=expected)


def _longer(found: Blocks) -> str:
    one, two = 2.0 * found.radius_mm
    return f"blocks {one:.3f} and {two:.3f} mm longer than certified, front to back"

"""``locate``: 16 probed points to the placement of the gauge."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.alignment import locate as locate_points
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, format_placement, parse_placement
from stepgauge.importing.sixteen import read_sixteen
from stepgauge.machine.file import Machine
from stepgauge.planning.plan import parse_blocks
from stepgauge.public.inputs import Blocks, File, as_blocks, as_gauge, as_machine, at_least

UNKNOWN_REPEATABILITY_UM = 1.0
"""Of a probed coordinate, where neither the technician nor a machine file states it."""


def locate(
    points: File | ArrayLike,
    gauge: File | Gauge,
    *,
    machine: File | Machine | None = None,
    blocks: Blocks = None,
    tip_radius_mm: float | None = None,
    repeatability_um: float | None = None,
    turned: bool = False,
) -> Placement:
    """Find how the step gauge lies from 16 points probed by hand.

    Parameters
    ----------
    points : CSV file ``point,x_mm,y_mm,z_mm``, the log of a teach program, or tip centres in mm, shape ``(16, 3)``
    gauge : the certified gauge, its file or shipped name
    machine : gives tip radius and repeatability where they are not stated
    blocks : the two blocks that were probed, ``"1:21"`` or ``(1, 21)``; default: the first and the last
    tip_radius_mm : nominal tip radius, checked against the points; default: the machine's, if given
    repeatability_um : standard deviation of a probed coordinate, um; default: the machine's, or 1
    turned : the gauge is known to be steep or turned about its axis; without it such points are refused

    Returns
    -------
    The placement as its file holds it (coordinates to 1e-7 mm), with angles and standard uncertainties in ``details``.

    Raises
    ------
    InputError
        points that contradict the certificate or each other, with the slip that would explain them
    """
    at_least("tip_radius_mm", tip_radius_mm, 0.0, "mm", beyond=True)
    at_least("repeatability_um", repeatability_um, 0.0, "um")
    steps = as_gauge(gauge)
    cmm = None if machine is None else as_machine(machine)
    if cmm is not None:
        tip_radius_mm = cmm.probe.tip_radius_mm if tip_radius_mm is None else tip_radius_mm
        repeatability_um = cmm.table.repeatability_um if repeatability_um is None else repeatability_um
    sigma_um = UNKNOWN_REPEATABILITY_UM if repeatability_um is None else repeatability_um
    probed = as_blocks(blocks, steps) or parse_blocks(":", steps)
    where = str(points) if isinstance(points, File) else "points"
    found = locate_points(_tip_centres(points), steps, probed, sigma_um, tip_radius_mm, where, turned)
    return parse_placement(format_placement(found), where, steps)


def _tip_centres(points: File | ArrayLike) -> np.ndarray:
    if isinstance(points, File):
        return read_sixteen(points)
    given, expected = np.asarray(points, float), "finite numbers in mm, shape (16, 3)"
    if given.shape != (16, 3):
        raise InputError("points", "not 16 points", found=f"shape {given.shape}", expected=expected)
    bad = ~np.isfinite(given).all(axis=1)
    if bad.any():
        point = int(bad.argmax())
        found = ", ".join(f"{value:g}" for value in given[point])
        raise InputError("points", f"point {point + 1} is not known", found=found, expected=expected)
    return given

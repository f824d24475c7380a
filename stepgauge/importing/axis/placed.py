"""Positions of the faces along the gauge, as a report lists them -> touches of the gauge where it lay.

A report of a CMM states where along the gauge each face was found, and no x, y and z. With the placement these are
points on the line through the middles of the faces; what is across that line was not kept, and is nought here.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording
from stepgauge.axis.units import base_of
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.result import Imported
from stepgauge.machine.file import Machine
from stepgauge.probes.read import make_probe
from stepgauge.recording import APPROACH, POSITION, Recording

WORDS = "positions along the gauge: touches on the line of the placement, turned back into tip centres with the radius"

UNSEEN = "such positions do not show the tip radius: it is taken as known, and is no result"


def on_placement(
    imported: Imported,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float | None,
    number: int = 1,
    machine: Machine | None = None,
) -> Imported:
    """The recording of a gauge from readings at its faces.

    ``imported``: of one axis, its targets the certified positions of the faces. They do not show the radius, so that
    the stated one is taken, or else what ``machine`` expects in each direction: any other would be found as an error of
    the probe. :class:`InputError` where no radius is known that makes tip centres of them.
    """
    found = imported.settled()
    assert isinstance(found, AxisRecording)
    per_mm = base_of(found.units.position)
    face = 1 + np.abs(found.frame["target"].to_numpy()[:, None] * per_mm - gauge.position_mm).argmin(axis=1)
    approach = np.where(face % 2 == 1, 1.0, -1.0)
    directions = approach[:, None] * placement.axis
    radii_mm = _radii_mm(found.path, tip_radius_mm, machine, placement, directions)
    radius = float(radii_mm.mean())
    along = found.frame["reading"].to_numpy() * per_mm - approach * radii_mm
    frame = pd.DataFrame({"placement": number, "cycle": found.frame["cycle"].to_numpy(), "face": face})
    frame[POSITION] = placement.to_machine(gauge, np.column_stack([along, *np.zeros((2, len(along)))]))
    frame[APPROACH] = directions
    for name in found.covariates:
        if name.lower() not in frame.columns:
            frame[name] = found.frame[name].to_numpy()
    report = (*imported.report, f"{WORDS} {radius:.6g} mm", UNSEEN)
    said = {"gauge": gauge.table.name, "gauge_serial": gauge.table.serial, "tip_radius_mm": f"{radius:.6g}"}
    kept = {key: value for key, value in found.comments.items() if key != "artefact"}
    comments = {**said, **kept, "log": Path(found.path).name, "import": "\n".join(report)}
    return replace(imported, recording=Recording(frame, comments, found.path), report=report)


def _radii_mm(
    path: str, stated_mm: float | None, machine: Machine | None, placement: Placement, directions: Array
) -> Array:
    """Effective tip radius in each direction of approach, ``(n,)``."""
    if stated_mm is None and machine is not None:
        probe = make_probe(machine.probe, machine.probe_path or machine.path)
        return np.asarray(machine.probe.tip_radius_mm - 1e-3 * probe.pretravel_um(directions))
    radius = stated_mm or placement.tip_radius_mm
    if radius is None:
        what = "a recording has tip centres, and the radius is not known"
        raise InputError(path, what, expected=naming("tip_radius_mm"))
    return np.full(len(directions), radius)

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
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.result import Imported
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.columns import CORRECTED

WORDS = "positions along the gauge: touches on the line of the placement, turned back into tip centres with the radius"
RADIUS = (
    "{}, of which the nominal value will do, since positions along the gauge do not show it; or {} with that radius"
)
UNSEEN = "such positions do not show the tip radius: it is taken as known, and is no result"


def on_placement(
    imported: Imported, gauge: Gauge, placement: Placement, tip_radius_mm: float | None, number: int = 1
) -> Imported:
    """The recording of a gauge from readings at its faces.

    ``imported``: of one axis, its targets the certified positions of the faces. :class:`InputError` where no radius is
    known that makes tip centres of them.
    """
    found = imported.settled()
    assert isinstance(found, AxisRecording)
    radius = tip_radius_mm or placement.tip_radius_mm
    if radius is None:
        what = "a recording has tip centres, and the radius is not known"
        raise InputError(found.path, what, expected=naming("tip_radius_mm", "machine", words=RADIUS))
    per_mm = base_of(found.units.position)
    face = 1 + np.abs(found.frame["target"].to_numpy()[:, None] * per_mm - gauge.position_mm).argmin(axis=1)
    approach = np.where(face % 2 == 1, 1.0, -1.0)
    along = found.frame["reading"].to_numpy() * per_mm - approach * radius
    frame = pd.DataFrame({"placement": number, "cycle": found.frame["cycle"].to_numpy(), "face": face})
    frame[POSITION] = placement.to_machine(gauge, np.column_stack([along, *np.zeros((2, len(along)))]))
    frame[APPROACH] = approach[:, None] * placement.axis
    for name in found.covariates:
        if name.lower() not in frame.columns:
            frame[name] = found.frame[name].to_numpy()
    report = (*imported.report, f"{WORDS} {radius:g} mm", UNSEEN)
    said = {"gauge": gauge.table.name, "gauge_serial": gauge.table.serial}
    said |= {"tip_radius_mm": f"{radius:.9g}", CORRECTED: f"{radius:.9g}"}
    kept = {key: value for key, value in found.comments.items() if key != "artefact"}
    comments = {**said, **kept, "log": Path(found.path).name, "import": "\n".join(report)}
    return replace(imported, recording=Recording(frame, comments, found.path), report=report)

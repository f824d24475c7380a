"""The effective tip diameter that a bidirectional reading needs, and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.recording import Recording
from stepgauge.recording.corrected import corrected_radius_mm

OWN_BLOCK = "the gauge's own first complete block, mean over the placements"
STATED = "stated as such"
CORRECTION = "the correction of the readings by the machine"
FAR_OFF_MM = 0.05
"""A stated diameter this far from what the gauge's own blocks give is another tip, or a radius."""


@dataclass(frozen=True)
class TipDiameter:
    """Effective tip diameter 2 R_eff in mm, its standard uncertainty in um (None: not known) and its origin."""

    diameter_mm: float
    u_um: float | None
    origin: str

    @property
    def own_block(self) -> bool:
        """Whether the diameter comes from a block of the gauge itself."""
        return self.origin == OWN_BLOCK


def tip_diameter(
    recording: Recording,
    gauge: Gauge,
    placements: Sequence[Placement] = (),
    stated_mm: float | None = None,
    stated_u_um: float | None = None,
) -> TipDiameter | None:
    """One diameter for all placements: the one stated, that by which the readings had been corrected, or that of the
    gauge's own blocks; None where no block has both faces measured.

    :class:`InputError` where a stated diameter and the blocks disagree by far more than an error of size.
    """
    corrected_mm = corrected_radius_mm(recording)
    if stated_mm is None and corrected_mm is not None:
        return TipDiameter(2.0 * corrected_mm, 0.0, CORRECTION)
    own = _own_diameter(recording, gauge, placements)
    if stated_mm is None:
        return own
    if own is not None and abs(own.diameter_mm - stated_mm) > FAR_OFF_MM:
        hint = " (a radius?)" if abs(own.diameter_mm - 2.0 * stated_mm) < FAR_OFF_MM else ""
        raise InputError(
            naming("tip_diameter_mm"),
            f"the gauge was probed with another tip{hint}",
            found=f"{stated_mm:g} mm",
            expected=f"about {own.diameter_mm:.4f} mm, from the blocks of {recording.path}",
        )
    return TipDiameter(stated_mm, stated_u_um, STATED)


def _own_diameter(recording: Recording, gauge: Gauge, placements: Sequence[Placement]) -> TipDiameter | None:
    """The standard uncertainty is the placements' mean, not divided by their count: they share the certified block."""
    frame = recording.frame
    for number in recording.placements:
        faces = set(frame.loc[frame["placement"] == number, "face"])
        if not any(face % 2 and face + 1 in faces for face in faces):
            return None
    radii = [result.radius for result in evaluate(recording, gauge, None, "first", placements).results]
    diameter = 2.0 * float(np.mean([radius.r_eff_mm for radius in radii]))
    u_um = 2e3 * float(np.mean([radius.u_mm for radius in radii]))
    return TipDiameter(diameter, u_um if np.isfinite(u_um) else None, OWN_BLOCK)

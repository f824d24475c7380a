"""What came out of the controller against what was put into HAL.

With the probe looked at once a servo period ``T`` at speed ``v``, a reading lies 0 to ``v T`` beyond the contact. Every
error that ``evaluate`` states is a difference of two such readings (or a mean of such differences), whatever the
number of cycles; so it is within ``v T`` of the truth, and R_eff lies 0 to ``v T`` below the tip radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hal_gauge import true_bodies_mm
from numpy.typing import NDArray

from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.recording import Recording

Array = NDArray[np.float64]
PRINTED_UM = 2e-3
"""What printing adds: the program and PROBEOPEN state 1e-6 mm, in each of three coordinates."""


@dataclass(frozen=True)
class Comparison:
    """Recovered minus true, um.

    ``face``: the used faces; ``truth_um``: their XF or XB without latch error; ``late_um``: how far beyond the contact
    every point was read, shape ``(n_points,)``; ``off_um``: of XF at fronts and XB at backs, ``mean_off_um``: of XM,
    one entry per used face (NaN at the ends of XM); ``r_eff_off_um``: of R_eff; ``bound_um``: what the latch allows.
    """

    face: NDArray[np.int64]
    truth_um: Array
    late_um: Array
    off_um: Array
    mean_off_um: Array
    r_eff_off_um: float
    bound_um: float

    @property
    def agrees(self) -> bool:
        """Whether everything is within the bound."""
        allowed = self.bound_um + PRINTED_UM
        late = (self.late_um > -PRINTED_UM).all() and (self.late_um < allowed).all()
        errors = (np.abs(self.off_um) < allowed).all() and (np.abs(self.mean_off_um[1:-1]) < allowed).all()
        return bool(late and errors and -allowed < self.r_eff_off_um < PRINTED_UM)

    def table(self) -> list[str]:
        """One line per face, um."""
        lines = ["face  error in HAL  recovered  difference   (um; XF at fronts, XB at backs)"]
        recovered = self.truth_um + self.off_um
        for row in zip(self.face, self.truth_um, recovered, self.off_um, strict=True):
            lines.append("{:4d}  {:12.3f}  {:9.3f}  {:+10.3f}".format(*row))
        return lines


def compare(
    recording: Recording,
    evaluation: dict[str, Any],
    gauge: Gauge,
    placement: Placement,
    deviation_um: Array,
    tip_radius_mm: float,
    bound_um: float,
) -> Comparison:
    """Compare a recording and its ``evaluation.json`` with the gauge in HAL, which lay at ``placement``."""
    rows = evaluation["placements"][0]["faces"]
    face = np.array([row["face"] for row in rows])
    xf, xb, xm = (np.array([row[name] for row in rows], float) for name in ("xf_um", "xb_um", "xm_um"))
    truth = _expected_errors_um(deviation_um, face)
    first_block = deviation_um[face[:2] - 1]
    radius_um = tip_radius_mm * 1e3 + (first_block[1] - first_block[0]) / 2.0
    return Comparison(
        face,
        truth,
        _late_um(recording, gauge, placement, deviation_um, tip_radius_mm),
        np.where(face % 2 == 1, xf, xb) - truth,
        xm - _expected_mean_um(truth),
        evaluation["r_eff_mm"] * 1e3 - radius_um,
        bound_um,
    )


def _late_um(
    recording: Recording, gauge: Gauge, placement: Placement, deviation_um: Array, tip_radius_mm: float
) -> Array:
    """Travel beyond the contact of tip ball and face, along the approach."""
    low, high = true_bodies_mm(gauge, placement, deviation_um)
    face = recording.frame["face"].to_numpy()
    block, front = (face - 1) // 2, face % 2 == 1
    contact = np.where(front, low[block, 0] - tip_radius_mm, high[block, 0] + tip_radius_mm)
    read = placement.to_gauge(gauge, recording.position_mm)[:, 0]
    return (read - contact) * np.where(front, 1.0, -1.0) * 1e3


def _expected_errors_um(deviation_um: Array, face: NDArray[np.int64]) -> Array:
    """XF and XB without any latch error: the fronts against the first front, the backs against the first back.

    The backs, because R_eff takes the size of the first block as certified.
    """
    used = deviation_um[face - 1]
    return used - np.where(face % 2 == 1, used[0], used[1])


def _expected_mean_um(error_um: Array) -> Array:
    """XM: at every face the mean of its own error and of its two neighbours' mean; NaN at both ends."""
    mean = np.full_like(error_um, np.nan)
    mean[1:-1] = error_um[1:-1] / 2.0 + (error_um[:-2] + error_um[2:]) / 4.0
    return mean

"""Reduction of the error by a compensation: systematic errors of a probe before and after, for a known pre-travel.

As in Wozniak's section 5. The true pre-travel is any function of direction (the full mechanical model, or a measured
map); the compensation knows only the few points of a qualification.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.physics import wozniak
from stepgauge.physics.sphere import effective_radius
from stepgauge.physics.wozniak import LobeModel

Pretravel = Callable[[Array], Array]

# The radii do not matter, pre-travels being a ten-thousandth of them; these are common ones.
_SPHERE_MM, _TIP_MM = 12.5, 2.0
# Errors below this are rounding of the sphere fit, a thousandth of a nanometre.
_NO_ERROR_UM = 1e-6


@dataclass(frozen=True)
class Errors:
    """Errors of the corrected pre-travel, (n,) in um: corrected by its mean (before) and by the model (after)."""

    before_um: Array
    after_um: Array

    @property
    def range_ratio(self) -> float:
        """Range before over range after: by what factor the form error is reduced."""
        return _ratio(np.ptp(self.before_um), np.ptp(self.after_um))

    @property
    def rms_ratio(self) -> float:
        """Root mean square before over after."""
        return _ratio(np.sqrt(np.mean(self.before_um**2)), np.sqrt(np.mean(self.after_um**2)))

    @property
    def largest_ratio(self) -> float:
        """Largest error before over largest error after."""
        return _ratio(np.abs(self.before_um).max(), np.abs(self.after_um).max())


def errors_of_the_paper(pretravel_um: Pretravel, normals: Array, qualified: Array, model: LobeModel) -> Errors:
    """Errors by Wozniak's definition: pre-travel measured directly, about a known centre (Eqs 6 and 9).

    Parameters
    ----------
    pretravel_um : unit normals (..., 3) -> pre-travel (...) in um, the true one
    normals : (n, 3) directions to judge
    qualified : (m, 3) directions of the qualification
    model : shape of the compensation
    """
    truth = pretravel_um(normals)
    mean = float(np.mean(pretravel_um(qualified)))
    constant = wozniak.constant_from_mean_um(mean, qualified, model)
    return Errors(truth - mean, truth - model.pretravel_um(normals, constant))


def errors_on_a_machine(pretravel_um: Pretravel, normals: Array, qualified: Array, model: LobeModel) -> Errors:
    """Errors on a machine: the centre is fitted to the qualification, and contains part of the pre-travel.

    Before: R_eff and centre of a least-squares sphere. After: constant and centre of :func:`wozniak.calibrate`.
    """
    reach_mm = _SPHERE_MM + _TIP_MM
    points = qualified * (reach_mm - 1e-3 * pretravel_um(qualified))[:, None]
    plain = effective_radius(points, _SPHERE_MM)
    lobed = wozniak.calibrate(points, _SPHERE_MM, _TIP_MM, model)
    recorded = normals * (reach_mm - 1e-3 * pretravel_um(normals))[:, None]
    before = _SPHERE_MM + plain.r_eff_mm - np.linalg.norm(recorded - plain.fit.centre_mm, axis=1)
    corrected = wozniak.compensated_mm(recorded, -normals, lobed.constant_um, model, None)
    after = reach_mm - np.linalg.norm(corrected - lobed.centre_mm, axis=1)
    return Errors(1e3 * before, 1e3 * after)


def _ratio(before_um: float, after_um: float) -> float:
    """Gain of a compensation; 1 where there was no error before, infinite where no error remains."""
    if before_um <= _NO_ERROR_UM and after_um <= _NO_ERROR_UM:
        return 1.0
    return float(before_um / after_um) if after_um > _NO_ERROR_UM else float("inf")

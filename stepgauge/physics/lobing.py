"""Structure that a model of the lobes leaves in the residuals of a sphere: waves about the stylus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from stepgauge.files.arrays import Array

WAVES = range(7)
"""Waves in a turn that are looked for; 0: what depends on the angle to the stylus alone."""
RARE = 1e-3
"""Chance in scatter alone below which a structure is told: qualified daily, a probe has a false one in three years."""
LEAST_UM = 1e-3
"""No reading is better than this."""


@dataclass(frozen=True)
class Misfit:
    """``waves`` in a turn that the residuals follow, their range, and the ``chance`` of as much in scatter alone."""

    waves: int
    range_um: float
    chance: float


def misfit(residuals_um: Array, normals: Array, known: Array, noise_um: float | None = None) -> Misfit | None:
    """The least likely waves in residuals of a fit; None where scatter leaves as much more often than :data:`RARE`.

    F test of two more columns for each number of waves (chi-square where ``noise_um`` of a probing is stated), with
    the chance of the best of all of them (Bonferroni).

    Parameters
    ----------
    residuals_um : (n,) of the fit
    normals : (n, 3) in the frame of the probe, z along the stylus
    known : (n, p) derivatives of the model by what was fitted
    """
    fitted = np.linalg.qr(known)[0]
    found = [_tested(waves, residuals_um, normals, fitted, noise_um) for waves in WAVES]
    best = min((one for one in found if one is not None), key=lambda one: one.chance, default=None)
    if best is None or best.chance * len(WAVES) >= RARE:
        return None
    return Misfit(best.waves, best.range_um, best.chance * len(WAVES))


def _tested(waves: int, residuals_um: Array, normals: Array, fitted: Array, noise_um: float | None) -> Misfit | None:
    """The test of one number of waves; None where the points cannot show them beside what was fitted."""
    columns = _columns(waves, normals)
    left, size, _ = np.linalg.svd(columns - fitted @ (fitted.T @ columns), full_matrices=False)
    basis = left[:, size > 1e-6 * np.linalg.norm(columns)]
    freedom = len(residuals_um) - fitted.shape[1] - basis.shape[1]
    if not basis.shape[1] or freedom < 1:
        return None
    explained = basis @ (basis.T @ residuals_um)
    gain, rank = float(explained @ explained), basis.shape[1]
    if noise_um:
        return Misfit(waves, float(np.ptp(explained)), float(stats.chi2.sf(gain / noise_um**2, rank)))
    rest = float(residuals_um @ residuals_um) - gain + freedom * LEAST_UM**2
    return Misfit(waves, float(np.ptp(explained)), float(stats.f.sf(gain / rank / (rest / freedom), rank, freedom)))


def _columns(waves: int, normals: Array) -> Array:
    """Two columns (n, 2): waves about the stylus that vanish along it; one wave is not a shift of the sphere."""
    along, across = normals[:, 2], np.hypot(normals[:, 0], normals[:, 1])
    if waves == 0:
        return np.column_stack([along**2, along**4])
    turn = waves * np.arctan2(normals[:, 1], normals[:, 0])
    size = across * along if waves == 1 else across
    return np.column_stack([size * np.cos(turn), size * np.sin(turn)])

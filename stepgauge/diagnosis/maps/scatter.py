"""Scatter of one reading of a map without a model: between repeats, or about a smooth function."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.data import MapData
from stepgauge.files.arrays import Array
from stepgauge.physics.robust import TO_SIGMA, mad_sigma

FEWEST_DOF = 6
"""Least degrees of freedom at which the scatter between repeats is used."""
FAR = 6.0
"""Standard deviations from which a reading is left out of the scatter."""
ROUNDS, ROBUST = 20, 3


@dataclass(frozen=True)
class MapScatter:
    """Standard deviation of one reading of each quantity, at least that of rounding.

    ``repeats``: whether it is from repeats of directions, with ``dof`` degrees of freedom; ``copies``: repeats agree to
    the last bit. ``grows``: whether the scatter is stated as proportional to the value.
    """

    sigma: tuple[float, ...]
    dof: int
    repeats: bool
    copies: bool
    grows: bool = False


def estimate_scatter(data: MapData, residuals: Sequence[Array]) -> MapScatter:
    """Scatter between probings of the same direction; without repeats a first estimate from ``residuals``.

    If two probings differ much, it is not known which one is wrong: both are left out.
    """
    among = [_among_repeats(m.values, data.direction) for m in data.measured]
    dof = min(d for _, d in among)
    copies = dof > 0 and any(
        sigma == 0.0 and m.quantum == 0.0 for (sigma, _), m in zip(among, data.measured, strict=True)
    )
    repeats = dof >= FEWEST_DOF and not copies
    found = [sigma for sigma, _ in among] if repeats else [_about_a_surface(data, each) for each in residuals]
    sigma = tuple(max(s, m.rounding, 1e-12) for s, m in zip(found, data.measured, strict=True))
    return MapScatter(sigma, dof, repeats, copies)


def _among_repeats(values: Array, group: NDArray[np.intp]) -> tuple[float, int]:
    """Pooled standard deviation and its degrees of freedom, without outliers."""
    keep = np.bincount(group)[group] > 1
    scale = np.inf
    for _ in range(ROUNDS):
        count = np.bincount(group, keep)
        mean = np.bincount(group, np.where(keep, values, 0.0)) / np.maximum(count, 1.0)
        dof = int(keep.sum() - (count > 0).sum())
        if dof < 1:
            return 0.0, 0
        deviation = np.where(keep, values - mean[group], 0.0)
        standard = np.abs(deviation) / np.sqrt(1.0 - 1.0 / np.maximum(count[group], 2.0))
        scale = TO_SIGMA * float(np.median(standard[keep])) or float(np.sqrt((deviation**2).sum() / dof))
        worst = int(standard.argmax())
        if standard[worst] <= FAR * scale:
            break
        keep = keep & (np.arange(len(group)) != worst if count[group[worst]] > 2 else group != group[worst])
    return float(np.sqrt((deviation**2).sum() / dof)), dof


def _about_a_surface(data: MapData, residual: Array) -> float:
    """Robust scatter of residuals about a smooth function of the direction."""
    fitted, count = surface(data, residual)
    scale = mad_sigma(residual - fitted)
    return scale * float(np.sqrt(len(data) / max(len(data) - count, 1)))


def surface(data: MapData, values: Array) -> tuple[Array, int]:
    """A robust smooth function of the direction, ``(n,)``, and its number of coefficients.

    Harmonics of the azimuth and of the polar angle, as many as the number of rows allows.
    """
    azimuth, polar = np.radians(data.azimuth_deg), np.radians(data.polar_deg)
    waves = [np.ones(len(data)), *(f(k * azimuth) for k in range(1, 4) for f in (np.cos, np.sin))]
    columns = np.array([wave * np.cos(j * polar) for j in range(3) for wave in waves])[: max(len(data) // 4, 1)]
    weight, fitted = np.ones(len(data)), values
    for _ in range(ROBUST):
        root = np.sqrt(weight)
        fitted = np.linalg.lstsq((columns * root).T, values * root, rcond=None)[0] @ columns
        scale = mad_sigma(values - fitted)
        weight = 1.0 / (1.0 + ((values - fitted) / max(3.0 * scale, 1e-300)) ** 2)
    return fitted, len(columns)

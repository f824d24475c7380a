"""Single readings of a map that are off: neither a law nor structure, but enough to drown both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.fit import Fitted
from stepgauge.diagnose.maps.model import MapModel
from stepgauge.diagnose.maps.noise import MOST_OUTLIERS, MapNoise, robust_scale, sizes

Array = NDArray[np.float64]
NEIGHBOURS = 4
"""Directions around one; where half of them are off the same way, it is structure."""


def outliers(model: MapModel, fitted: Fitted, noise: MapNoise) -> NDArray[np.bool_]:
    """Rows (n,) that lie alone outside what the model leaves of the others.

    ``fitted`` may be of a part of the rows. Rows that differ from the other repeats of their direction are outliers
    whatever the model says; a direction that is off in all its repeats is none. More than a tenth of the rows is no
    matter of outliers.
    """
    data = model.data
    free = np.sqrt(len(fitted.whitened) / max(fitted.dof, 1))
    found = np.zeros(len(data), bool)
    for i, (measured, residual) in enumerate(zip(data.measured, model.residuals(fitted.terms), strict=True)):
        size = sizes(measured, noise.scatter)
        least = measured.rounding / float(np.median(size)) if noise.sigma is None else noise.sigma[i]
        standard = residual / size * free
        _, far = robust_scale(standard, least, len(data) - fitted.size)
        found |= far & _alone(data, np.where(far, np.sign(standard), 0.0))
    if found.sum() > MOST_OUTLIERS * len(data):
        found[:] = False
    return found | noise.outliers


def _alone(data: MapData, sign: Array) -> NDArray[np.bool_]:
    """Whether each row that is off is so against its repeats and against the directions around it, (n,)."""
    group = data.direction
    count = np.bincount(group)
    same = np.bincount(group, sign)[group] * sign
    alone = (sign != 0.0) & ((count[group] == 1) | (2.0 * same <= count[group]))
    first = np.unique(group, return_index=True)[1]
    of_rows = data.normals
    normals, off = of_rows[first], np.bincount(group, sign) / count
    for row in np.flatnonzero(alone):
        near = np.argsort(-(normals @ of_rows[row]))
        near = near[near != group[row]][:NEIGHBOURS]
        alone[row] = (off[near] * sign[row] > 0.5).sum() < NEIGHBOURS / 2
    return alone

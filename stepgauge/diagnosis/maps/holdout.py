"""Agreement of probe and map before and after, and predictions for polar rings and azimuth spokes held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.data import MapData, Measured
from stepgauge.diagnosis.maps.result import QuantityFit
from stepgauge.diagnosis.maps.signatures import MapRows
from stepgauge.diagnosis.result import rms
from stepgauge.files.arrays import Array

Stage = tuple[Array, Array]
"""Residuals ``(m,)`` of a model and the derivatives ``(k, m)`` by its fitted parameters."""
FEWEST_GROUPS = 3
MOST_FOLDS = 5


def folds(data: MapData) -> dict[str, NDArray[np.intp]]:
    """Index of the fold of each row, by whole polar rings and by whole azimuth spokes; groups are interleaved."""
    found = {}
    for by, group in (("rings", data.rings), ("spokes", data.spokes)):
        if group.max() + 1 >= FEWEST_GROUPS:
            found[by] = group % min(MOST_FOLDS, int(group.max()) + 1)
    return found


def fits_of(
    rows: MapRows, stages: Sequence[Stage], kept: NDArray[np.bool_], by_row: Sequence[Array]
) -> tuple[QuantityFit, ...]:
    """Agreement of every quantity before, with the named changes, and with the forms in addition.

    ``kept (n,)``: rows that are not outliers; ``by_row (n,)``: scatter of each row of each quantity.
    """
    residuals = [rows.parts(um) for um, _ in stages]
    held = {
        by: np.array([[rms(one[kept]) for one in rows.parts(_held_out(rows, each, kept, fold))] for each in stages]).T
        for by, fold in folds(rows.data).items()
    }
    return tuple(
        _fit(
            m, rms(by_row[i]), [stage[i] for stage in residuals], {by: list(each[i]) for by, each in held.items()}, kept
        )
        for i, m in enumerate(rows.data.measured)
    )


def _fit(
    m: Measured, noise: float, stages: Sequence[Array], held: Mapping[str, Sequence[float]], kept: NDArray[np.bool_]
) -> QuantityFit:
    before, after, described = stages
    return QuantityFit(
        m.name,
        m.unit,
        noise,
        m.quantum,
        rms(before[kept]),
        rms(after[kept]),
        rms(described[kept]),
        _worst(before[kept], m.values[kept]),
        _worst(after[kept], m.values[kept]),
        {by: (each[0], each[1]) for by, each in held.items()},
        {by: each[2] for by, each in held.items()},
        before,
        after,
        described,
    )


def _held_out(rows: MapRows, stage: Stage, kept: NDArray[np.bool_], fold: NDArray[np.intp]) -> Array:
    """Recorded minus predicted ``(m,)``, every row predicted by a fit without it, to first order."""
    um, slopes = stage
    errors, count = um.copy(), len(rows.sigma)
    if not len(slopes):
        return errors
    size = np.linalg.norm(slopes, axis=1, keepdims=True)
    slopes = slopes / np.maximum(size, 1e-300)
    for number in range(int(fold.max()) + 1):
        held, seen = np.tile(fold == number, count), np.tile((fold != number) & kept, count)
        moved = np.linalg.lstsq(slopes[:, seen].T, um[seen], rcond=1e-6)[0]
        errors[held] = um[held] - moved @ slopes[:, held]
    return errors


def _worst(residual: Array, values: Array) -> float:
    """Largest residual as a share of the measured value."""
    positive = values > 0.0
    return float(np.max(np.abs(residual[positive]) / values[positive], initial=0.0))

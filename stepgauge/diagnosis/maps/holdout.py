"""Agreement of probe and map before and after, and predictions for polar rings and azimuth spokes held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.holdout import WEAK, Folds, held_out_errors
from stepgauge.diagnosis.maps.data import MapData
from stepgauge.diagnosis.maps.result import QuantityFit
from stepgauge.diagnosis.maps.signatures import MapRows
from stepgauge.diagnosis.result import rms
from stepgauge.files.arrays import Array

Stage = tuple[Array, Array]
"""Residuals ``(m,)`` of a model and the derivatives ``(k, m)`` by its fitted parameters."""
FEWEST_GROUPS, MOST_FOLDS = 3, 5


def make_map_folds(data: MapData) -> list[Folds]:
    """Whole polar rings, and whole azimuth spokes, in interleaved sets."""
    groups = [("rings", data.rings), ("spokes", data.spokes)]
    kept = [(by, group) for by, group in groups if group.max() + 1 >= FEWEST_GROUPS]
    return [Folds(by, group % min(MOST_FOLDS, int(group.max()) + 1)) for by, group in kept]


def fits_of(
    rows: MapRows, stages: Sequence[Stage], kept: NDArray[np.bool_], by_row: Sequence[Array]
) -> tuple[QuantityFit, ...]:
    """Agreement of every quantity before, with the named changes, and with the structure in addition.

    ``kept (n,)``: rows that are not outliers; ``by_row (n,)``: scatter of each row of each quantity.
    """
    residuals = [rows.parts(um) for um, _ in stages]
    held = {
        one.by: [rows.parts(_held_out(rows, each, kept, one)) for each in stages] for one in make_map_folds(rows.data)
    }
    found = []
    for i, measured in enumerate(rows.data.measured):
        before, after, described = (stage[i] for stage in residuals)
        holdout = {by: (rms(a[i][kept]), rms(b[i][kept]), rms(c[i][kept])) for by, (a, b, c) in held.items()}
        found.append(QuantityFit(measured, rms(by_row[i]), before, after, described, kept, holdout))
    return tuple(found)


def _held_out(rows: MapRows, stage: Stage, kept: NDArray[np.bool_], folds: Folds) -> Array:
    """Recorded minus predicted ``(m,)``, every row predicted by a fit without it, to first order."""
    um, slopes = stage
    count = len(rows.sigma)
    columns = (slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300)).T
    sigma = np.where(np.tile(kept, count), 1.0, np.inf)
    return held_out_errors(um, sigma, columns, np.full(len(slopes), WEAK), Folds(folds.by, np.tile(folds.fold, count)))

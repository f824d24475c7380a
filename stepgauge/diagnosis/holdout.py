"""Held-out groups: the prediction of a model for probings that were not used in its fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import rms
from stepgauge.files.arrays import Array

WEAK = 1e-2
"""Prior weight of a coefficient, a standard deviation of ten times the one that all rows give: where the remaining rows
do not determine it, it is predicted as zero, and not as anything."""


MOST_FOLDS = 20
"""Largest number of folds: with more cycles, every twentieth is held out together."""


def make_folds(data: Residuals) -> dict[str, NDArray[np.intp]]:
    """Splits of the rows into groups, the group of each row ``(n,)`` by what it is of: cycles, or faces."""
    cycle = np.unique(data.frame["cycle"].to_numpy(), return_inverse=True)[1] % MOST_FOLDS
    faces = np.unique(data.face, return_inverse=True)[1] // 2 % 4  # in interleaved sets
    return {by: fold for by, fold in (("cycles", cycle), ("faces", faces)) if fold.max() > 0}


def holdout_rms(data: Residuals, sigma_um: Array, columns: Array, fold: NDArray[np.intp]) -> float:
    """Rms of the prediction error over all held-out rows with weight, um; NaN where too few rows are left for the fit.

    ``columns (n, d)``: displacement of the model's terms, whose coefficients are fitted anew without the rows held out,
    together with the origins of the placements and the errors of the faces against the certificate (within its
    uncertainty); ``sigma_um (n,)``: infinite for rows that are not used.
    """
    faces, index = np.unique(data.face, return_inverse=True)
    u_um = np.maximum(data.gauge.u_um[faces - 1], 1e-6)
    free = np.column_stack([data.origins.T, columns])
    design = np.column_stack([free, np.eye(len(faces))[index] * data.side[:, None] * u_um])
    prior = np.concatenate([np.full(free.shape[1], WEAK), np.ones(len(faces))])
    errors, used = np.full(len(data), np.nan), np.isfinite(sigma_um)
    for held in fold == np.arange(fold.max() + 1)[:, None]:
        train = ~held & used
        if train.sum() > free.shape[1]:
            weighted = design[train] / sigma_um[train][:, None]
            normal = weighted.T @ weighted + np.diag(prior)
            coefficients = np.linalg.solve(normal, weighted.T @ (data.um[train] / sigma_um[train]))
            errors[held] = data.um[held] - design[held] @ coefficients
    return rms(errors[np.isfinite(errors) & used])

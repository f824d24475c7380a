"""Held-out groups: the prediction of a model for probings that were not used in its fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array

WEAK = 1e-2
"""Prior weight of a coefficient, a standard deviation of ten times the one that all rows give: where the remaining rows
do not determine it, it is predicted as zero, and not as anything."""


MOST_FOLDS = 20
"""Largest number of folds: with more cycles, every twentieth is held out together."""


@dataclass(frozen=True)
class Folds:
    """A split of the rows into groups; ``by`` names them."""

    by: str
    fold: NDArray[np.intp]

    @property
    def count(self) -> int:
        return int(self.fold.max()) + 1


def make_folds(data: Residuals) -> list[Folds]:
    """Whole cycles, and whole faces in interleaved sets; only splits that leave enough rows for the fit."""
    found = []
    cycle = np.unique(data.frame["cycle"].to_numpy(), return_inverse=True)[1] % MOST_FOLDS
    if cycle.max() > 0:
        found.append(Folds("cycles", cycle))
    faces = np.unique(data.face, return_inverse=True)[1] // 2 % 4
    if faces.max() > 0:
        found.append(Folds("faces", faces))
    return found


def holdout_rms(data: Residuals, sigma_um: Array, columns: Array, folds: Folds) -> float:
    """Rms of the prediction error over all held-out rows with weight, um.

    ``columns (n, d)``: displacement of the model's terms, whose coefficients are fitted anew without the rows held out,
    together with the origins of the placements and the errors of the faces against the certificate (within its
    uncertainty).
    """
    design = np.column_stack([data.origins.T, columns])
    full, prior = _add_face_columns(data, design)
    errors = held_out_errors(data.um, sigma_um, full, prior, folds, design.shape[1])
    used = np.isfinite(errors) & np.isfinite(sigma_um)
    return float(np.sqrt((errors[used] ** 2).mean())) if used.any() else float("nan")


def held_out_errors(values: Array, sigma: Array, columns: Array, prior: Array, folds: Folds, fewest: int = 0) -> Array:
    """Values minus their prediction by a fit of the columns without them, ``(n,)``; NaN where too few rows are left.

    Parameters
    ----------
    values : residuals ``(n,)``
    sigma : their standard deviations ``(n,)``, infinite for rows that are not used
    columns, prior : of the model ``(n, d)``, and the prior weight of each coefficient ``(d,)``
    folds : which rows are held out together
    fewest : number of rows that must be left at least
    """
    errors = np.full(len(values), np.nan)
    for fold in range(folds.count):
        held = folds.fold == fold
        train = ~held & np.isfinite(sigma)
        if train.sum() > fewest:
            weighted = columns[train] / sigma[train][:, None]
            normal = weighted.T @ weighted + np.diag(prior)
            coefficients = np.linalg.solve(normal, weighted.T @ (values[train] / sigma[train]))
            errors[held] = values[held] - columns[held] @ coefficients
    return errors


def _add_face_columns(data: Residuals, design: Array) -> tuple[Array, Array]:
    """The design with a column for every face, in units of its certified uncertainty, and all prior weights."""
    faces, index = np.unique(data.face, return_inverse=True)
    u = np.maximum(data.gauge.u_um[faces - 1], 1e-6)
    face_columns = np.eye(len(faces))[index] * data.side[:, None] * u
    prior = np.concatenate([np.full(design.shape[1], WEAK), np.ones(len(faces))])
    return np.column_stack([design, face_columns]), prior

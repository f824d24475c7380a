"""What a fitted probe predicts for whole rings and whole spokes that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.fit import Fitted, Fitter

Array = NDArray[np.float64]
FEWEST_GROUPS = 3
MOST_FOLDS = 5


@dataclass(frozen=True)
class Holdout:
    """Held-out rms of each quantity without and with a term; ``score``: mean square over the scatter's variance."""

    by: str
    before: tuple[float, ...]
    after: tuple[float, ...]
    score_before: float
    score_after: float


def folds(data: MapData) -> dict[str, NDArray[np.intp]]:
    """Index of the fold of each row, by whole polar rings and by whole azimuth spokes; groups stand interleaved."""
    found = {}
    for by, group in (("rings", data.rings), ("spokes", data.spokes)):
        if group.max() + 1 >= FEWEST_GROUPS:
            found[by] = group % min(MOST_FOLDS, int(group.max()) + 1)
    return found


def held_out(fitter: Fitter, without: Fitted, fitted: Fitted) -> list[Holdout]:
    """Prediction errors of both models, each fitted anew without the rows held out."""
    found = []
    for by, fold in folds(fitter.model.data).items():
        errors = [_errors(fitter, each, fold) for each in (without, fitted)]
        scores = [
            float(np.mean([np.mean((e / s) ** 2) for e, s in zip(part, fitted.sigma, strict=True)])) for part in errors
        ]
        rms = [tuple(float(np.sqrt(np.mean(e**2))) for e in part) for part in errors]
        found.append(Holdout(by, rms[0], rms[1], scores[0], scores[1]))
    return found


def _errors(fitter: Fitter, fitted: Fitted, fold: NDArray[np.intp]) -> list[Array]:
    """Recorded minus predicted, (n,) per quantity, every row predicted by a fit that did not see it."""
    if not fitted.terms:
        return fitter.model.residuals(())
    errors = [np.zeros(len(fold)) for _ in fitted.sigma]
    for held in (fold == number for number in range(int(fold.max()) + 1)):
        terms = Fitter(fitter.model, fitter.noise, ~held).refit(fitted)
        for error, residual in zip(errors, fitter.model.residuals(terms), strict=True):
            error[held] = residual[held]
    return errors

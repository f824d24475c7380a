"""Changes of a probe fitted together by its statics: generalised least squares from the result of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from stepgauge.diagnosis.maps.model import ChangeTerm, Terms
from stepgauge.diagnosis.maps.problem import MapRows, usual_of
from stepgauge.diagnosis.priors import Priors
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric

STEP = 1e-3
"""Step of a knob for its derivative, as a share of the usual size."""
WIDEST = 100.0
"""Prior standard deviation over the usual size, for knobs that the map does not determine."""
IMPOSSIBLE = 1e6
MOST_STEPS = 30


@dataclass(frozen=True)
class FittedChanges:
    """Terms with fitted values, their covariance ``(k, k)`` and the derivatives by each knob, ``(k, m)``."""

    terms: Terms
    covariance: Array
    slopes: Array

    def covariance_of(self, place: int) -> Array:
        """Covariance of the knobs of one term."""
        first = sum(len(term.values) for term in self.terms[:place])
        own = slice(first, first + len(self.terms[place].values))
        return self.covariance[own, own]


def fit(terms: Sequence[ChangeTerm], rows: MapRows, metric: Metric, priors: Priors) -> FittedChanges:
    """Fit of all knobs of some terms together, from their values; ``metric``: of the scatter, beside forms."""
    knobs = [knob for term in terms for knob in term.candidate.knobs]
    if not knobs:
        return FittedChanges((), np.zeros((0, 0)), np.zeros((0, len(rows.um))))
    scale = np.array([usual_of(term.candidate, priors)[1] for term in terms for _ in term.candidate.knobs])
    none, low, high = (np.array([getattr(k, name) for k in knobs]) / scale for name in ("none", "low", "high"))
    start = np.array([value for term in terms for value in term.values]) / scale

    def left(x: Array) -> Array:
        moved = rows.moved(_with(terms, x * scale))
        white = metric(rows.um - np.where(np.isfinite(moved), moved, IMPOSSIBLE))
        return np.concatenate([white, (x - none) / WIDEST])

    def slopes(x: Array) -> Array:
        return np.vstack([-metric(_slopes(terms, x, scale, high, rows)).T, np.eye(len(x)) / WIDEST])

    inside = np.clip(start, low + 1e-9, high - 1e-9)
    found = least_squares(left, inside, slopes, bounds=(low, high), max_nfev=MOST_STEPS, ftol=1e-9, xtol=1e-9)
    inverse = np.linalg.pinv(found.jac.T @ found.jac) * np.outer(scale, scale)
    terms = _with(terms, found.x * scale)
    return FittedChanges(terms, inverse, _slopes(terms, found.x, scale, high, rows) / scale[:, None])


def _slopes(terms: Sequence[ChangeTerm], x: Array, scale: Array, high: Array, rows: MapRows) -> Array:
    """Derivatives ``(k, m)`` in units of the usual size, by one-sided differences away from the bound."""
    here, columns = rows.moved(_with(terms, x * scale)), []
    for place in range(len(x)):
        step = STEP if x[place] + STEP < high[place] else -STEP
        moved = x.copy()
        moved[place] += step
        columns.append((rows.moved(_with(terms, moved * scale)) - here) / step)
    return np.nan_to_num(np.array(columns))


def _with(terms: Sequence[ChangeTerm], values: Array) -> Terms:
    cuts = np.cumsum([len(term.values) for term in terms])[:-1]
    parts = np.split(np.asarray(values, float), cuts)
    return tuple(ChangeTerm(t.candidate, tuple(map(float, p))) for t, p in zip(terms, parts, strict=True))

"""Which random functions a recording is held against: of every covariate, on every side, along every axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.forms import SIDES, WANDERING, WAY, Covariate, covariates, goes_both_ways, make_form, mask
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.smooth import Smooth, matern_roots, smooth

Array = NDArray[np.float64]
FEWEST_LEVELS = 6
TIME_KNOTS, KNOTS, LOOP_KNOTS = 48, 20, 12
TIME_LENGTHS = (1.0, 0.3, 0.1)
ROUGH_TIME_LENGTHS = (1.0, 0.15, 0.03)
LENGTHS = (0.5, 0.15)
ROUGH_LENGTHS = (0.5,)
"""Correlation lengths over the covariate's span."""


def smooth_forms(data: Residuals) -> Iterator[Smooth]:
    """Wandering in time, free shapes over all other covariates, loops, and scales that change with time."""
    for covariate in covariates(data):
        if covariate.steps < FEWEST_LEVELS:
            continue
        wanders = covariate.name in WANDERING
        columns, roots = _functions(covariate, TIME_KNOTS if wanders else KNOTS)
        form = "wander" if wanders else "free shape"
        for side in SIDES if wanders or covariate.name == "position" else SIDES[:2]:
            yield smooth(make_form(form, covariate.name, side, columns[None] * mask(data, side), data), roots)
    yield from _loops(data)


def _functions(covariate: Covariate, most: int) -> tuple[Array, Array]:
    """Columns ``(m, n)`` of functions by their values at knots, less their means, and roots of their covariances."""
    x = covariate.values
    levels = np.unique(x)
    knots = np.unique(np.quantile(levels, np.linspace(0.0, 1.0, min(most, len(levels)))))
    columns = np.array([np.interp(x, knots, one) for one in np.eye(len(knots))])
    at = (knots - knots[0]) / (knots[-1] - knots[0])
    wanders = covariate.name in WANDERING
    lengths, rough = (TIME_LENGTHS, ROUGH_TIME_LENGTHS) if wanders else (LENGTHS, ROUGH_LENGTHS)
    roots = np.concatenate([matern_roots(at, lengths), matern_roots(at, rough, rough=True)])
    return columns - columns.mean(axis=1, keepdims=True), roots


def _loops(data: Residuals) -> Iterator[Smooth]:
    """One shape along the gauge on the way there and another on the way back."""
    if not goes_both_ways(data):
        return
    way = data.probings.way()
    columns, roots = _functions(Covariate("position", "mm", data.probings.certified_mm()), LOOP_KNOTS)
    for side in SIDES[:2]:
        both = way * np.vstack([columns, np.ones(len(data))]) * mask(data, side)
        wider = np.zeros((len(roots), len(both), len(both)))
        wider[:, :-1, :-1], wider[:, -1, -1] = roots, 1.0
        yield smooth(make_form("loop", WAY, side, both[None], data), wider)

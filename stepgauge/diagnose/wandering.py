"""Which random functions a recording is held against: of every covariate, on every side, along every axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.forms import (
    SIDES,
    WANDERING,
    WAY,
    Covariate,
    axes_shown,
    covariates,
    goes_both_ways,
    length_mm,
    lives_on,
    make_form,
    mask,
)
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
    """Wandering in time, free shapes over all other covariates, loops, and lengths that change with time."""
    for covariate in covariates(data):
        if covariate.steps < FEWEST_LEVELS:
            continue
        wanders = covariate.name in WANDERING
        columns, roots = _functions(covariate, TIME_KNOTS if wanders else KNOTS)
        form = "wander" if wanders else "free shape"
        every = wanders or covariate.name == "position"
        for side in (*(SIDES if every else SIDES[:2]), *axes_shown(data)):
            if lives_on(covariate, side):
                yield smooth(make_form(form, covariate.name, side, columns[None] * mask(data, side), data), roots)
    yield from _loops(data)
    if data.has_time:
        yield from _changing_scales(data)


def _functions(covariate: Covariate, most: int) -> tuple[Array, Array]:
    """Columns ``(m, n)`` of functions by their values at knots, less their means, and roots of their covariances."""
    x = covariate.values
    knots = _knots(covariate, most)
    columns = np.array([np.interp(x, knots, one) for one in np.eye(len(knots))])
    at = (knots - knots[0]) / (knots[-1] - knots[0])
    wanders = covariate.name in WANDERING
    lengths, rough = (TIME_LENGTHS, ROUGH_TIME_LENGTHS) if wanders else (LENGTHS, ROUGH_LENGTHS)
    roots = np.concatenate([matern_roots(at, lengths), matern_roots(at, rough, rough=True)])
    return columns - columns.mean(axis=1, keepdims=True), roots


def _knots(covariate: Covariate, most: int) -> Array:
    """Values that occur, with as many others between each two; of a machine coordinate as many probings.

    A placement across an axis has many values there, all but the same.
    """
    levels = np.unique(covariate.values)
    shares = np.linspace(0.0, 1.0, min(most, len(levels)))
    if covariate.name.startswith("machine "):
        return np.unique(np.quantile(covariate.values, shares, method="nearest"))
    return np.unique(np.quantile(levels, shares))


def _changing_scales(data: Residuals) -> Iterator[Smooth]:
    """Lengths along the gauge, or along machine axes, that grow and shrink with time."""
    columns, roots = _functions(Covariate("time", "s", data.probings.time_s), KNOTS)
    for side in ("gauge", *axes_shown(data)):
        length = length_mm(side, data)
        growing = columns * (length / np.ptp(length) * 2.0) * mask(data, side)
        yield smooth(make_form("changing scale", "time", side, growing[None], data), roots)


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

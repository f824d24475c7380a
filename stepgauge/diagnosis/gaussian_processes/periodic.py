"""Periodic functions of any shape, sawteeth, and waves along the gauge that change with time.

A grid of periods is too coarse for overtones and for the jumps of a sawtooth at the ends of a long record. So the shape
is searched between the points of the grid where a hypothesis is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import Covariate, axes_shown
from stepgauge.diagnosis.gaussian_processes.random_function import BEAT, SAWTOOTH, WAVE, RandomFunction
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.chunks import chunks

Single = NDArray[np.float32]
OVERTONES = 5
"""Of a wave that is no sine; the k-th has the k-th part of the first's standard deviation."""
PERIODS_PER_SPAN, MOST_PERIODS = 4.0, 40.0
TEETH_PER_SPAN, MOST_TEETH, PHASES = 8.0, 30.0, 16
"""Of a sawtooth, whose phase counts in the middle of the record; its phases are no sums of two."""
THROWN_BACK = 1.0 / PHASES
"""Part of the period in which a sawtooth of the grid falls: the jump itself lies between two of its phases."""
FINER = 17
"""Number of periods, and of phases, that are tried about those of the grid."""


def waves(one: Covariate, data: Residuals, priors: Priors) -> RandomFunction:
    """Periodic functions of any shape: a fundamental and its harmonics."""
    span, turns, passed = one.span, _turns(one, MOST_PERIODS, PERIODS_PER_SPAN), _passed(one)

    def near(period: float) -> list[float]:
        return (span / (span / period + np.linspace(-1.0, 1.0, FINER) / PERIODS_PER_SPAN)).tolist()

    def of(periods: Sequence[float]) -> Array:
        return _harmonics(passed, span / np.array(periods))

    features = _grid(lambda some: _harmonics(passed, some), turns, (2 * OVERTONES, len(passed)))
    periods, share = tuple((span / turns).tolist()), priors.forms.wave
    return RandomFunction(
        one.name, one.unit, WAVE, features, periods, wave_sides(one, data), share, of=of, near=(near,)
    )


def _grid(signatures: Callable[[Any], Array], shapes: Sequence[Any] | Array, of_one: tuple[int, int]) -> Single:
    """Signatures ``(k, d, n)`` of all shapes of a grid, each ``of_one (d, n)``; a grid needs no double precision."""
    found = np.empty((len(shapes), *of_one), np.float32)
    for some in chunks(len(shapes), of_one[0] * of_one[1]):
        found[some] = signatures(shapes[some])
    return found


def _harmonics(passed: Array, turns: Array) -> Array:
    """Sines and cosines of a fundamental and its overtones, ``(f, 2 overtones, n)``."""
    first = np.exp(2j * np.pi * turns[:, None] * passed)
    overtones = [first]
    while len(overtones) < OVERTONES:  # a product is ten times as fast as another sine and cosine
        overtones.append(overtones[-1] * first)
    shrunk = np.stack(overtones, axis=1) / np.arange(1, OVERTONES + 1)[:, None]
    return np.concatenate([shrunk.imag, shrunk.real], axis=1)


def sawteeth(one: Covariate, data: Residuals, priors: Priors) -> RandomFunction:
    """What creeps and is thrown back, over and over: a control with hysteresis, a table that is applied in steps."""
    span, turns, passed = one.span, _turns(one, MOST_TEETH, TEETH_PER_SPAN), _passed(one)
    grid = [(f, phase) for f in turns.tolist() for phase in (np.arange(PHASES) / PHASES).tolist()]

    def near(shape: tuple[float, float]) -> list[tuple[float, float]]:
        finer = np.linspace(-1.0, 1.0, FINER).tolist()
        return [(span / (span / shape[0] + a / TEETH_PER_SPAN), shape[1] + b / PHASES) for a in finer for b in finer]

    def of(shapes: Sequence[tuple[float, float]]) -> Array:
        return _teeth(passed, [(span / period, phase) for period, phase in shapes])

    shapes = tuple((span / f, phase) for f, phase in grid)
    sides = tuple(side for side in wave_sides(one, data) if side != "approach")  # no probe does that
    features = _grid(lambda some: _teeth(passed, some, THROWN_BACK), grid, (1, len(passed)))
    share = priors.forms.wave
    return RandomFunction(one.name, one.unit, SAWTOOTH, features, shapes, sides, share, of=of, near=(near,))


def _teeth(passed: Array, shapes: Sequence[tuple[float, float]], fall: float = 0.0) -> Array:
    """Sawteeth ``(f, 1, n)`` of some turns and phases, of unit variance, that fall in the part ``fall`` of a period."""
    f, phase = np.reshape(shapes, (-1, 2)).T[:, :, None]
    up = f * passed + (phase + 0.5 * fall)
    up -= np.floor(up)  # a tenth of the time of a remainder
    saw = np.minimum(up / (1.0 - fall), (1.0 - up) / fall) if fall else up
    saw -= 0.5
    saw *= np.sqrt(12.0)
    return np.asarray(saw)[:, None]


def _passed(one: Covariate) -> Array:
    """How far a covariate has come, from -1/2 to 1/2 where it is measured."""
    return np.asarray((one.values - one.measured.min()) / one.span - 0.5)


def _turns(one: Covariate, most: float, per_span: float) -> Array:
    """Numbers of periods over a covariate that are tried, ``(f,)``, so many to one period over its span."""
    return np.arange(2.0, min(len(np.unique(one.measured)) / 4.0, most), 1.0 / per_span)


def wave_sides(one: Covariate, data: Residuals) -> tuple[str, ...]:
    """A periodic function of a machine axis acts along this axis; one of time on all sides."""
    if one.name.startswith("machine "):
        own = one.name[-1]
        return (own,) if own in axes_shown(data) else ()
    return ("gauge",) if one.name == "position" else ("approach", "gauge", *axes_shown(data))


def beats(position: Covariate, slow: Covariate, data: Residuals, priors: Priors) -> RandomFunction:
    """Periodic errors along the gauge whose size and place change periodically with time or order, or once in it."""
    of_x, of_y = np.arange(1.0, 6.1, 0.5), np.array([0.25, *np.arange(0.5, 8.1, 0.5)])
    shapes = tuple((position.span / f, slow.span / g) for f in of_x.tolist() for g in of_y.tolist())

    def of(shapes: Sequence[tuple[float, float]]) -> Array:
        periods = np.array(shapes).T
        first, second = (_oscillations(c, c.span / one) for c, one in zip((position, slow), periods, strict=True))
        return (first[:, :, None] * second[:, None]).reshape(len(shapes), 4, -1)

    def near(shape: tuple[float, float]) -> list[tuple[float, float]]:
        finer = np.linspace(-1.0, 1.0, FINER).tolist()
        f = position.span / shape[0]
        return [(position.span / (f + 0.5 * a), shape[1] * 2.0**-b) for a in finer for b in finer]

    both, share = ("approach", "gauge"), priors.forms.product
    return RandomFunction(slow.name, slow.unit, BEAT, of(shapes), shapes, both, share, "position", of=of, near=(near,))


def _oscillations(one: Covariate, turns: Array) -> Array:
    """Sines and cosines with so many turns over the span, ``(f, 2, n)``."""
    angle = 2.0 * np.pi * turns[:, None] * _passed(one)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)

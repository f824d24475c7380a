"""Least sums of squares of models that are not linear in their parameters, within bounds.

By damped steps (Levenberg 1944, Marquardt 1963; damping by Nielsen, IMM-REP-1999-05), of which what leads out of the
bounds is left out. A search fits hundreds of shapes of one to six parameters: the general routine of scipy takes
several times as long for each of them as the model itself, and a third of a second to be imported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Response = Callable[[Array], Array]
"""From parameters ``(k,)`` to what they add to the readings ``(n,)``; not finite where the model is impossible."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e12
"""Share of the squared slopes that is added to them: at first, and where no step helps any more."""
LEAST_SIZE = 1e-300
STEP = 1e-3
"""Step of a parameter for its derivative, in units of its scale."""
WIDEST = 100.0
"""Prior standard deviation about ``none`` in units of the scale, for parameters that the readings do not determine."""
IMPOSSIBLE = 1e6
SAME_COST = 1e-9


@dataclass(frozen=True)
class Parameters:
    """What is known of ``k`` parameters: ``none`` (no effect), bounds, ``scale`` (the usual size); ``(k,)`` each."""

    none: Array
    low: Array
    high: Array
    scale: Array


@dataclass(frozen=True)
class NonlinearFit:
    """Values ``(k,)`` and their covariance ``(k, k)``."""

    values: Array
    covariance: Array


def least_squares(
    residual: Callable[[Array], Array],
    slopes: Callable[[Array], Array],
    start: Array,
    tolerance: float,
    most: int,
    bounds: tuple[Array | float, Array | float] = (-np.inf, np.inf),
) -> Array:
    """Parameters of the least sum of squares near a start, ``(p,)``.

    Parameters
    ----------
    residual, slopes : of parameters ``(p,)``, shapes ``(n,)`` and ``(n, p)``
    start : parameters to begin with
    tolerance : relative decrease of the sum of squares, expected and found, from which no further step is taken
    most : number of residuals that are computed at most
    bounds : least and largest values of the parameters

    Raises
    ------
    ValueError
        residuals that are no numbers at the start
    """
    x, size = np.clip(start, *bounds), np.full(len(start), LEAST_SIZE)
    left, slope = residual(x), slopes(x)
    cost, damping, growth = float(left @ left), FIRST_DAMPING, 2.0
    if not (np.isfinite(cost) and np.isfinite(slope).all()):
        raise ValueError("residuals are no numbers at the start")
    for _ in range(most):
        gram, dot = slope.T @ slope, slope.T @ left
        size = np.maximum(size, gram.diagonal())
        free = ~((x <= bounds[0]) & (dot > 0.0) | (x >= bounds[1]) & (dot < 0.0))
        step = np.zeros(len(x))
        step[free] = -np.linalg.solve((gram + np.diag(damping * size))[np.ix_(free, free)], dot[free])
        step = np.clip(x + step, *bounds) - x
        expected = float(damping * size @ step**2 - step @ dot)
        there = residual(x + step)
        after = float(there @ there)
        settled = max(expected, abs(cost - after)) <= tolerance * cost
        if after < cost:
            gain = min((cost - after) / max(expected, LEAST_SIZE), 1.0)
            damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
            x, left, cost = x + step, there, after
            slope = slope if settled else slopes(x)
        else:
            damping, growth = damping * growth, 2.0 * growth
        if settled or damping > MOST_DAMPING:
            break
    return x


def fit_nonlinear(
    model: Response, residual: Array, start: Array, known: Parameters, metric: Response, steps: int = 30
) -> NonlinearFit:
    """Parameters for which the model explains residuals best, within their bounds.

    Parameters
    ----------
    model : see :data:`Response`
    residual : ``(n,)``
    start : parameters to begin with ``(k,)``
    known : of the parameters
    metric : linear map of columns ``(..., n)`` to independent variables of variance one
    steps : most steps
    """
    none, low, high = (each / known.scale for each in (known.none, known.low, known.high))

    def moved(x: Array) -> Array:
        found = model(x * known.scale)
        return np.where(np.isfinite(found), found, IMPOSSIBLE)

    def left(x: Array) -> Array:
        return np.concatenate([metric(residual - moved(x)), (x - none) / WIDEST])

    def slopes(x: Array) -> Array:
        return np.vstack([-metric(_slopes(moved, x, high)).T, np.eye(len(x)) / WIDEST])

    found = least_squares(left, slopes, start / known.scale, SAME_COST, steps, (low, high))
    slope = slopes(found)
    covariance = np.linalg.pinv(slope.T @ slope) * np.outer(known.scale, known.scale)
    return NonlinearFit(found * known.scale, covariance)


def _slopes(moved: Response, x: Array, high: Array) -> Array:
    """Derivatives ``(k, n)`` in units of the scale, by one-sided differences away from the bound."""
    here, steps = moved(x), np.where(x + STEP < high, STEP, -STEP)
    return np.array([(moved(x + own) - here) / own.sum() for own in np.diag(steps)])

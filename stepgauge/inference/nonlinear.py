"""Bounded generalised least squares of a model that is not linear in its parameters.

For signatures that depend on the size of what they are of, and for several causes that do not add up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]
Response = Callable[[Array], Array]
"""From parameters ``(k,)`` to what they add to the readings ``(n,)``; not finite where the model is impossible."""
STEP = 1e-3
"""Step of a parameter for its derivative, in units of its scale."""
WIDEST = 100.0
"""Prior standard deviation about ``none`` in units of the scale, for parameters that the readings do not determine."""
IMPOSSIBLE = 1e6
INSIDE = 1e-9


@dataclass(frozen=True)
class Parameters:
    """What is known of ``k`` parameters: ``none`` (no effect), bounds, ``scale`` (the usual size); ``(k,)`` each."""

    none: Array
    low: Array
    high: Array
    scale: Array

    def scaled(self) -> tuple[Array, Array, Array]:
        """``none``, ``low`` and ``high`` in units of the scale."""
        return self.none / self.scale, self.low / self.scale, self.high / self.scale


@dataclass(frozen=True)
class NonlinearFit:
    """Values ``(k,)``, their covariance ``(k, k)``, and the derivatives of the model by each ``(k, n)``."""

    values: Array
    covariance: Array
    slopes: Array


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
    none, low, high = known.scaled()

    def moved(x: Array) -> Array:
        found = model(x * known.scale)
        return np.where(np.isfinite(found), found, IMPOSSIBLE)

    def left(x: Array) -> Array:
        return np.concatenate([metric(residual - moved(x)), (x - none) / WIDEST])

    def slopes(x: Array) -> Array:
        return np.vstack([-metric(_slopes(moved, x, high)).T, np.eye(len(x)) / WIDEST])

    first = np.clip(start / known.scale, low + INSIDE, high - INSIDE)
    found = least_squares(left, first, slopes, bounds=(low, high), max_nfev=steps, ftol=1e-9, xtol=1e-9)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * np.outer(known.scale, known.scale)
    return NonlinearFit(found.x * known.scale, covariance, _slopes(moved, found.x, high) / known.scale[:, None])


def _slopes(moved: Response, x: Array, high: Array) -> Array:
    """Derivatives ``(k, n)`` in units of the scale, by one-sided differences away from the bound."""
    here, columns = moved(x), []
    for place in range(len(x)):
        step = STEP if x[place] + STEP < high[place] else -STEP
        beside = x.copy()
        beside[place] += step
        columns.append((moved(beside) - here) / step)
    return np.array(columns)

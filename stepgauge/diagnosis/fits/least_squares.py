"""Least sum of squares of a few parameters (Levenberg 1944, Marquardt 1963; damping by Nielsen, IMM-REP-1999-05).

A search fits hundreds of shapes of one to six parameters. The general routine of scipy takes several times as long for
each of them as the law itself, and a third of a second to be imported.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stepgauge.files.arrays import Array

FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e12
"""Share of the squared slopes that is added to them: at first, and where no step helps any more."""
LEAST_SIZE = 1e-300


def least_squares(
    residual: Callable[[Array], Array], slopes: Callable[[Array], Array], start: Array, tolerance: float, most: int
) -> Array:
    """Parameters of the least sum of squares near a start, ``(p,)``.

    Parameters
    ----------
    residual, slopes : of parameters ``(p,)``, shapes ``(n,)`` and ``(n, p)``
    start : parameters to begin with
    tolerance : relative decrease of the sum of squares, expected and found, from which no further step is taken
    most : number of residuals that are computed at most

    Raises
    ------
    ValueError
        residuals that are no numbers at the start
    """
    x, left, size = start, residual(start), np.full(len(start), LEAST_SIZE)
    cost, damping, growth, slope = float(left @ left), FIRST_DAMPING, 2.0, slopes(start)
    if not (np.isfinite(cost) and np.isfinite(slope).all()):
        raise ValueError("residuals are no numbers at the start")
    for _ in range(most):
        gram, dot = slope.T @ slope, slope.T @ left
        size = np.maximum(size, gram.diagonal())
        step = -np.linalg.solve(gram + np.diag(damping * size), dot)
        expected = float(damping * size @ step**2 - step @ dot)
        there = residual(x + step)
        after = float(there @ there)
        settled = max(expected, abs(cost - after)) <= tolerance * cost
        if after < cost:
            gain = (cost - after) / max(expected, LEAST_SIZE)
            damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
            x, left, cost = x + step, there, after
            slope = slope if settled else slopes(x)
        else:
            damping, growth = damping * growth, 2.0 * growth
        if settled or damping > MOST_DAMPING:
            break
    return x

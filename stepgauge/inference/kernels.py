"""Kernels of Gaussian processes as features: columns whose sum with independent amplitudes has the covariance.

C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, section 4.2.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KNOTS, ROUGH_KNOTS = 40, 120


def matern(x: Array, length: float, rough: bool = False) -> Array:
    """Features ``(m, n)`` of a random function of ``x (n,)`` with a correlation length over the span of ``x``.

    Twice differentiable (Matern 5/2), or rough as the path of a random walk (Ornstein and Uhlenbeck).
    """
    u = (x - x.min()) / np.ptp(x)
    levels, most = np.unique(u), ROUGH_KNOTS if rough else KNOTS
    knots = levels if len(levels) <= most else np.linspace(0.0, 1.0, most)
    return np.asarray((_between(u, knots) @ _root(knots.tobytes(), length, rough)).T[::-1])


@lru_cache(maxsize=64)
def _root(knots: bytes, length: float, rough: bool) -> Array:
    """Root of the covariance at knots, which recur from covariate to covariate; do not write to the array."""
    at = np.frombuffer(knots)
    r = np.abs(at[:, None] - at) / length
    root5 = np.sqrt(5.0)
    covariance = np.exp(-r) if rough else (1.0 + root5 * r + 5.0 * r**2 / 3.0) * np.exp(-root5 * r)
    value, vector = np.linalg.eigh(covariance)
    seen = value > 1e-9 * value[-1]
    found = vector[:, seen] * np.sqrt(value[seen])
    found.flags.writeable = False
    return found


def _between(u: Array, knots: Array) -> Array:
    """Matrix ``(n, m)`` that interpolates values at knots."""
    i = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(knots) - 2)
    share = (u - knots[i]) / (knots[i + 1] - knots[i])
    weight = np.zeros((len(u), len(knots)))
    weight[np.arange(len(u)), i] = 1.0 - share
    weight[np.arange(len(u)), i + 1] += share
    return weight

"""Chances of gains in chi-square, all looks counted."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import special

FAR_OUT = 1e-280
"""Tails smaller than this are computed by their series."""


@lru_cache(maxsize=100_000)
def log_p_value(gain: float, dimension: int, dof: int, looks: float) -> float:
    """Logarithm of the chance that noise gains as much anywhere in a family of so many independent signatures."""
    if gain <= 0.0:
        return 0.0
    single = _log_f_tail(gain / dimension, dimension, max(dof - dimension, 1))
    return min(single + float(np.log(looks)), 0.0)


def _log_f_tail(f: float, d: int, dof: int) -> float:
    """Logarithm of the upper tail of an F distribution.

    Far out, where it underflows, the first term of the series is all there is: with x = dof / (dof + d f) the tail
    is the incomplete beta I_x(dof / 2, d / 2), about x^a (1 - x)^(b - 1) / (a B(a, b)).
    """
    tail = float(special.fdtrc(d, dof, f))
    if tail > FAR_OUT:
        return float(np.log(tail))
    a, b, x = dof / 2.0, d / 2.0, dof / (dof + d * f)
    return float(a * np.log(x) + (b - 1.0) * np.log1p(-x) - np.log(a) - special.betaln(a, b))

"""Robust scale: the standard deviation of normal values from their median deviation (Huber, Robust Statistics, 5.1)."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

TO_SIGMA: Final = 1.4826
"""Standard deviation of normal values over the median of their absolute deviations."""


def mad_sigma(off: ArrayLike) -> float:
    """Standard deviation of values ``(n,)`` that are deviations from their middle, whatever a minority of them is."""
    return TO_SIGMA * float(np.median(np.abs(np.asarray(off, float))))

"""Robust scale: the standard deviation of normal values from their median deviation (Huber, Robust Statistics, 5.1)."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.files.arrays import Array

TO_SIGMA: Final = 1.4826
"""Standard deviation of normal values over the median of their absolute deviations."""


def mad_sigma(off: ArrayLike) -> float:
    """Standard deviation of values ``(n,)`` that are deviations from their middle, whatever a minority of them is."""
    return TO_SIGMA * float(np.median(np.abs(np.asarray(off, float))))


def group_medians(values: Array, group: NDArray[np.int64]) -> Array:
    """For every value the median of its group, ``(n,)``; ``group``: numbers from 0, ``(n,)``."""
    if group.max(initial=0) > len(group):  # numbers far apart
        group = np.unique(group, return_inverse=True)[1].ravel()
    by_value = np.argsort(values, kind="stable")
    few = group.max(initial=0) < 2**16  # such numbers are sorted in linear time
    own = group.astype(np.uint16) if few else group
    order = by_value[np.argsort(own[by_value], kind="stable")]
    count = np.bincount(group)
    first = np.cumsum(count) - count
    last = len(values) - 1
    low, high = (order[np.minimum(first + middle, last)] for middle in (np.maximum(count - 1, 0) // 2, count // 2))
    return np.asarray(((values[low] + values[high]) / 2.0)[group])

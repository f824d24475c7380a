"""Direction of travel and cycle of every reading, where the table states neither: from the order of the targets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.recording import places_of

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


def ways_of_order(target: Array) -> Whole:
    """+1 or -1, the sense in which the axis came to each target, ``(n,)``.

    A target comes from the side of the one before it. Where the axis jumps over others to begin anew, or repeats a
    target to turn round there, it is the sense in which it goes on.
    """
    place = places_of(target)
    steps = np.diff(place)
    if not steps.any():
        return np.ones(len(target), np.int64)
    came, goes = np.sign(np.r_[0, steps]), np.sign(np.r_[steps, 0])
    jumped = np.abs(np.r_[0, steps]) > 1
    way = np.asarray(np.where((came == 0) | (jumped & (goes != 0)), goes, came))
    return _filled(way)


def _filled(way: NDArray[Any]) -> Whole:
    """Standstill counts as what follows, at the end as what went before."""
    found = pd.Series(np.where(way == 0, np.nan, way)).bfill().ffill()
    return found.fillna(1).to_numpy().astype(np.int64)


def cycles_of_repeats(*keys: NDArray[Any]) -> Whole:
    """How often each reading's keys (target, direction, placement) have been there before, counted from 1."""
    frame = pd.DataFrame({str(n): key for n, key in enumerate(keys)})
    return frame.groupby(list(frame), sort=False).cumcount().to_numpy().astype(np.int64) + 1

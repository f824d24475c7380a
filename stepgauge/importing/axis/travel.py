"""Direction of travel and cycle of every reading, where the table states neither: from the order of the targets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Whole = NDArray[np.int64]


def ways_of_order(place: NDArray[np.intp]) -> Whole:
    """+1 or -1, the sense in which the axis came to each place (counted along the axis), ``(n,)``.

    A target comes from the side of the one before it. Where the axis jumps over others to begin anew, or repeats a
    target to turn round there, it is the sense in which it goes on.
    """
    steps = np.diff(place)
    if not steps.any():
        return np.ones(len(place), np.int64)
    sense = np.sign(steps)
    came, goes = np.r_[0, sense], np.r_[sense, 0]
    jumped = np.abs(np.r_[0, steps]) > 1
    way = np.asarray(np.where((came == 0) | (jumped & (goes != 0)), goes, came))
    return _filled(way)


def _filled(way: NDArray[Any]) -> Whole:
    """Standstill counts as what follows, at the end as what went before."""
    if way.all():
        return way.astype(np.int64)
    found = pd.Series(np.where(way == 0, np.nan, way)).bfill().ffill()
    return found.fillna(1).to_numpy().astype(np.int64)


def cycles_of_repeats(*keys: NDArray[np.integer[Any]]) -> Whole:
    """How often each reading's keys (target, direction, placement) have been there before, counted from 1."""
    same = np.zeros(len(keys[0]), np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        least = key.min()
        same = same * int(key.max() - least + 1) + (key - least)
    return pd.Series(same).groupby(same, sort=False).cumcount().to_numpy().astype(np.int64) + 1

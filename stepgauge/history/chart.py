"""Control charts for individual values: each value is held against limits that follow from all the others.

For values of one distribution the limits are a prediction interval, Student's t (Hahn and Meeker, Statistical
Intervals, 1991, 4.8), at a probability that counts how many values are looked at. Where the repeatability is known, a
value outside must be beyond that, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array

FEWEST_FOR_CONTROL = 5
LEAST = 1e-12


def control_limits(score: Array, u: Array, false_share: float, per_day: Array) -> tuple[Array, Array]:
    """Lower and upper limit of every value, in its score; NaN with fewer than five values.

    Parameters
    ----------
    score, u : normal scores of the values and their standard uncertainties (NaN: none), ``(n,)``
    false_share : probability that noise brings one value outside
    per_day : what a drift that was found makes of every value, ``(n,)``; the chart follows it

    Notes
    -----
    The value farthest beyond the limits of the others is taken out, and so on: what it is beside does not widen the
    limits of the others.
    """
    inside = np.isfinite(score)
    level = score - per_day
    low, high = np.full(len(score), np.nan), np.full(len(score), np.nan)
    while inside.sum() >= FEWEST_FOR_CONTROL:
        low, high = _limits(level, u, inside, false_share, bool(per_day.any()))
        excess = np.where(inside, np.abs(level - (low + high) / 2.0) / ((high - low) / 2.0), 0.0)
        if excess.max() <= 1.0:
            break
        inside[int(np.argmax(excess))] = False
    return low + per_day, high + per_day


def _limits(
    level: Array, u: Array, inside: NDArray[np.bool_], false_share: float, with_slope: bool
) -> tuple[Array, Array]:
    """Of every value, from the other values that are inside."""
    from scipy.stats import norm, t

    centre, reach = np.full(len(level), np.nan), np.full(len(level), np.nan)
    for row in np.flatnonzero(np.isfinite(level)):
        others = inside.copy()
        others[row] = False
        count, kept = int(others.sum()), level[others]
        dof = count - 1 - with_slope
        if dof < 1:
            continue
        sigma = float(np.sqrt(((kept - kept.mean()) ** 2).sum() / dof))
        wide = float(t.isf(false_share / 2.0, dof)) * sigma * np.sqrt(1.0 + 1.0 / count)
        known = np.sqrt(u[row] ** 2 + (u[others] ** 2).sum() / count**2)
        least = float(norm.isf(false_share / 2.0)) * known if np.isfinite(known) else 0.0
        centre[row], reach[row] = kept.mean(), max(wide, least, LEAST)
    return centre - reach, centre + reach

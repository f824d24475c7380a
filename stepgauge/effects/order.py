"""Quantities from the order of the probings: rests, reversals, and columns after a first-order lag."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.files.arrays import Array, Rows

if TYPE_CHECKING:
    from stepgauge.effects.probings import Probings

Order = Rows | slice
"""Rows in an order: all of them where they are in it already."""
SHORT = 1e-3
"""Time over lag below which (1 - exp(-h)) / h is a series: 1 - exp(-h) would lose its digits."""


def followed(time_s: Array, values: Array, lags_s: Sequence[float] | Array) -> Array:
    """Values ``(n,)`` after first-order lags of several time constants, ``(lags, n)``.

    Between rows a column goes straight from one value to the next; before the first row it had that value for ever. So
    d = output - value satisfies d_i = exp(-h) d_(i-1) - (v_i - v_(i-1)) (1 - exp(-h)) / h, h: time between over lag.
    """
    in_time = bool((time_s[1:] >= time_s[:-1]).all())
    order: Order = slice(None) if in_time else np.argsort(time_s, kind="stable")
    steps = np.diff(time_s[order], prepend=time_s[order][:1])
    changes = np.diff(values[order], prepend=values[order][:1])
    late = np.empty((len(lags_s), len(values)))
    for lag, one in zip(lags_s, late, strict=True):
        h = steps / lag
        part = np.exp(-h)
        one[order] = values[order] + kept(part, -changes * _mean_share(h, part))
    return late


def _mean_share(h: Array, part: Array) -> Array:
    """(1 - exp(-h)) / h from ``part``, which is exp(-h)."""
    long = h > SHORT
    share = np.divide(1.0 - part, h, where=long, out=np.empty(len(h)))
    few = h[~long]
    share[~long] = 1.0 - few * (0.5 - few * (1.0 / 6.0 - few / 24.0))
    return share


def kept(part: Array, added: Array) -> Array:
    """State after each of ``n`` steps, state[i] = part[i] state[i - 1] + added[i]: a triangular system of two bands."""
    from scipy.linalg.blas import dtbsv  # few recordings are simulated with a memory

    bands = np.ones((2, len(part)), order="F")
    np.negative(part[1:], out=bands[1, :-1])
    return np.asarray(dtbsv(1, bands, added, lower=1, diag=1))


def sort_probings(probings: Probings) -> tuple[Order, Array]:
    """Rows by placement and then by time (as recorded if there are no times), and the placements in that order.

    Every placement may have a clock of its own.
    """
    count = len(probings)
    placement = probings.column("placement") if "placement" in probings.columns else np.ones(count, int)
    time_s = probings.time_s if "time_s" in probings.columns else np.arange(count)
    later, same = time_s[1:] >= time_s[:-1], placement[1:] == placement[:-1]
    if (same & later | (placement[1:] > placement[:-1])).all():  # as most programs run
        return slice(None), placement.astype(float)
    order = np.lexsort((time_s, placement))
    return order.astype(np.int64, copy=False), placement[order].astype(float)


def rest_s(probings: Probings) -> Array:
    """Time since the previous probing, s, ``(n,)``; the longest of these where there was none."""
    order, placement = sort_probings(probings)
    gap = np.diff(probings.time_s[order], prepend=-np.inf)
    gap[np.diff(placement, prepend=placement[0]) != 0] = np.inf
    known = np.isfinite(gap)
    gap[~known] = gap[known].max(initial=0.0)
    return restore_order(gap, order)


def since_placed_s(probings: Probings) -> Array:
    """Time since the first probing of the same placement, s, ``(n,)``."""
    order, placement = sort_probings(probings)
    time_s = probings.time_s[order]
    first = np.diff(placement, prepend=np.nan) != 0
    return restore_order(time_s - time_s[first][np.cumsum(first) - 1], order)


def rested(probings: Probings, touches: float) -> Array:
    """Exponentially weighted sum of the square roots of the rests, s^0.5, ``(n,)``."""
    order, _ = sort_probings(probings)
    rest = np.diff(probings.time_s[order], prepend=probings.time_s[order][0])
    rest[rest < 0.0] = rest.max()
    return restore_order(kept(np.full(len(rest), np.exp(-1.0 / touches)), np.sqrt(rest)), order)


def way(probings: Probings) -> Array:
    """Direction of the path along the gauge to each probing, ``(n,)``."""
    order, steps = along_gauge_mm(probings)
    return restore_order(np.where(steps < 0.0, -1.0, 1.0), order)


def since_turning_mm(probings: Probings) -> Array:
    """Path along the gauge since its last reversal, mm, ``(n,)``."""
    order, steps = along_gauge_mm(probings)
    way = np.sign(steps)
    turned = np.concatenate([[True], (way[1:] != way[:-1]) | (steps[1:] == 0.0)])
    gone = np.cumsum(np.abs(steps))
    start = np.maximum.accumulate(np.where(turned, gone - np.abs(steps), 0.0))
    return restore_order(gone - start, order)


def along_gauge_mm(probings: Probings) -> tuple[Order, Array]:
    """Rows in order, and the path along the gauge from the previous probing, 0 for the first of a placement."""
    order, placement = sort_probings(probings)
    position = probings.certified_mm()[order]
    steps = np.diff(position, prepend=position[0])
    return order, np.where(np.diff(placement, prepend=placement[0]) == 0, steps, 0.0)


def run_mm(probings: Probings, axis: str) -> Array:
    """Path of an axis to each probing, if in the direction of its approach, mm, ``(..., n)``; else, and at first, 0."""
    order, placement = sort_probings(probings)
    place = probings.coordinate_mm(axis)[..., order]
    steps = np.diff(place, axis=-1, prepend=place[..., :1]) * np.sign(probings.approach(axis)[order])
    run = np.where(np.diff(placement, prepend=placement[0]) == 0, np.maximum(steps, 0.0), 0.0)
    return restore_order(run, order)


def held_mm(probings: Probings, column: str, way_mm: float) -> Array:
    """A spring with a slider that is drawn along: its stretch, mm, at most ``way_mm`` to either side, ``(..., n)``.

    It is stretched by the way of a coordinate since that last turned (stop operator: Visintin, Differential Models of
    Hysteresis, 1994). At the first probing of a placement it is slack: nobody knows the way before.
    """
    order, placement = sort_probings(probings)
    path = probings.certified_mm() if column == "position_mm" else probings.coordinate_mm(column[0])
    steps = np.diff(path[..., order], axis=-1, prepend=path[..., order][..., :1])
    parts = np.split(np.arange(len(placement)), np.flatnonzero(np.diff(placement)) + 1)
    stretched = [np.apply_along_axis(_stretched, -1, steps[..., part], way_mm) for part in parts]
    return restore_order(np.concatenate(stretched, axis=-1), order)


def _stretched(steps: Array, most: float) -> Array:
    """The stretch after each of some steps ``(n,)``, of which the first leads from nowhere."""
    after = accumulate(steps[1:].tolist(), lambda s, step: min(max(s + step, -most), most), initial=0.0)
    return np.fromiter(after, float, len(steps))


def touches_since(probings: Probings, pause_s: float) -> Array:
    """Number of probings since a pause or a new placement, ``(n,)``."""
    order, placement = sort_probings(probings)
    apart = (np.diff(probings.time_s[order]) > pause_s) | (np.diff(placement) != 0)
    count = np.arange(len(placement), dtype=float)
    count -= np.maximum.accumulate(np.where(np.concatenate([[True], apart]), count, 0.0))
    return restore_order(count, order)


def restore_order(values: Array, order: Order) -> Array:
    """Values in order, ``(..., n)``, as values by row."""
    found = np.empty(values.shape)
    found[..., order] = values
    return found

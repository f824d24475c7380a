"""How close a swept ball or stylus comes to boxes, by brute force: a grid over the sweep, refined where it is least.

The distance of a point to a convex box is convex over a segment or a parallelogram, so that the refinement cannot run
into a wrong valley. What is found is never less than the true distance: a collision that is reported is one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRID = 9
ROUNDS = 9
"""Every round narrows the grid by 3; 3^-9 of the longest move is some micrometres."""


def least_distance(start: Array, step: Array, foot: Array, shank: Array, low: Array, high: Array) -> Array:
    """Smallest distance between the parallelograms ``start + foot + t step + h shank`` and boxes, each ``(n, 3)``.

    t and h run from 0 to 1; a ball has no shank. Returns shape ``(n,)``.
    """
    offsets = np.linspace(-1.0, 1.0, GRID)
    has_shank = bool(np.any(shank))
    across = offsets if has_shank else np.zeros(1)
    dt, dh = (one.ravel() for one in np.meshgrid(offsets, across, indexing="ij"))
    t = np.full(len(start), 0.5)
    h = np.full(len(start), 0.5 if has_shank else 0.0)
    half, best = 0.5, np.full(len(start), np.inf)
    for _ in range(ROUNDS):
        at_t, at_h = np.clip(t[:, None] + half * dt, 0.0, 1.0), np.clip(h[:, None] + half * dh, 0.0, 1.0)
        place = (start + foot)[:, None] + at_t[..., None] * step[:, None] + at_h[..., None] * shank[:, None]
        gap = place - np.minimum(np.maximum(place, low[:, None]), high[:, None])
        distance = np.sqrt((gap**2).sum(axis=-1))
        least = distance.argmin(axis=1)
        rows = np.arange(len(start))
        t, h, best = at_t[rows, least], at_h[rows, least], np.minimum(best, distance[rows, least])
        half /= 3.0
    return best

"""What a recorded input did while nobody read it.

A lag remembers: what the air did in a pause, or before the first reading, acts on the readings after it. What follows
a column is computed with straight lines through the pauses, and rest before the first reading. What it would have been
had it gone on smoothly, with the rates of change on either side, is as possible: the difference is a standard
uncertainty of the input, pause by pause. Of what is ten times as large as the scatter it shows: without it a step after
a pause would be told.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_PAUSES = 20
"""The longest pauses; in shorter ones a curve and its chord differ with the square of the time."""
MOST_AMPLITUDES, NEGLIGIBLE = 4, 1e-4
"""Most courses that are told apart, and the share of the largest one's variance below which another does not matter."""
FEWEST = 3
"""Readings from which a rate of change is taken."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


def shifts(time_s: Array, values: Array, lag_s: float, known: int | None = None) -> Array:
    """By how much lagged values of an input would be other ones: before the record, and for each pause, ``(m, n)``.

    ``known``: the number of rows that are readings, if other times follow at which it acts.
    """
    order = np.argsort(time_s[:known], kind="stable")
    return np.array(list(unread_shifts(time_s[order], values[order].astype(float), lag_s, time_s)))


def principal(columns: Array, known: int | None = None) -> Array:
    """The fewest columns ``(p, n)`` with nearly the same sum of squared products as others ``(m, n)``.

    ``known``: the number of rows over which that is so.
    """
    some = columns[:, :known]
    value, vector = np.linalg.eigh(some @ some.T)
    keep = value > NEGLIGIBLE * max(float(value[-1]), 1e-300)
    return np.asarray(vector[:, keep].T[-MOST_AMPLITUDES:] @ columns)


def unread_shifts(time_s: Array, values: Array, lag_s: float, at_s: Array) -> Iterator[Array]:
    """Shifts ``(n,)`` at some times of what lags behind ``values`` of rising ``time_s``, where there is no reading.

    A curve with the rates of change at both ends of a pause (a cubic) in place of the chord, and a rate before the
    record in place of rest.
    """
    yield -_bend(time_s, values, 0, lag_s, 1, 0.0) * lag_s * np.exp(-(at_s - time_s[0]) / lag_s)
    steps = np.diff(time_s)
    for row in np.argsort(-steps)[:MOST_PAUSES]:
        long_s = float(steps[row])
        chord = (values[row + 1] - values[row]) / max(long_s, 1e-9)
        before, behind = (_bend(time_s, values, row + i, long_s, way, chord) for i, way in ((0, -1), (1, 1)))
        u = (NODES + 1.0) / 2.0
        off = long_s * (before * u * (1.0 - u) ** 2 - behind * u**2 * (1.0 - u))
        acted = float(WEIGHTS @ (off * np.exp(-long_s * (1.0 - u) / lag_s))) * long_s / (2.0 * lag_s)
        after = np.maximum(at_s - time_s[row + 1], 0.0)
        yield np.where(at_s >= time_s[row + 1], acted * np.exp(-after / lag_s), 0.0)


def _bend(time_s: Array, values: Array, row: int, within_s: float, way: int, expected: float) -> float:
    """Rate of change minus the expected one, from a row on (way 1) or up to it (-1); 0 where there are few readings.

    The rate is that of the readings within some time.
    """
    near = (way * (time_s - time_s[row]) >= 0.0) & (np.abs(time_s - time_s[row]) <= within_s)
    if near.sum() < FEWEST or np.ptp(time_s[near]) == 0.0:
        return 0.0
    own = time_s[near] - time_s[near].mean()
    return float(own @ values[near] / (own @ own)) - expected

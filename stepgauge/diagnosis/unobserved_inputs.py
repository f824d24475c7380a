"""What a recorded input did while nobody read it.

A lag remembers: what the air did in a pause, or before the first reading, acts on the readings after it. What follows
a column is computed with straight lines through the pauses, and rest before the first reading. Two other courses are as
possible, and what the lag makes of the difference is a standard uncertainty of the input, pause by pause: it may have
gone on smoothly, with the rates of change on either side; or it may have departed from the straight line as it did
elsewhere, over as long a time, where it was read (somebody opened a door). Where an effect is ten times as large as the
scatter this shows: without it a step after a pause would be told.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.result import rms
from stepgauge.effects.order import followed
from stepgauge.files.arrays import Array

MOST_PAUSES = 20
"""The longest pauses; in shorter ones a curve and its chord differ with the square of the time."""
MOST_AMPLITUDES, NEGLIGIBLE = 4, 1e-4
"""Most courses that are told apart, and the share of the largest one's variance below which another does not matter."""
FEWEST, FEWEST_STRETCHES = 3, 8
"""Readings from which a rate of change is taken; stretches over which the usual departure is."""
READ = 4.0
"""A stretch counts as read where no two readings in it are farther apart than this part of it."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


def shifts(time_s: Array, values: Array, lag_s: float, known: int | None = None) -> Array:
    """By how much lagged values of an input would be other ones: before the record, and for each pause, ``(m, n)``.

    ``known``: the number of rows that are readings, if other times follow at which it acts.
    """
    order = np.argsort(time_s[:known], kind="stable")
    read_s, read = time_s[order], values[order].astype(float)
    return np.array([*unread_shifts(read_s, read, lag_s, time_s), *departures(read_s, read, lag_s, time_s)])


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
    for row, long_s in _pauses(time_s):
        chord = (values[row + 1] - values[row]) / max(long_s, 1e-9)
        before, behind = (_bend(time_s, values, row + i, long_s, way, chord) for i, way in ((0, -1), (1, 1)))
        u = (NODES + 1.0) / 2.0
        off = long_s * (before * u * (1.0 - u) ** 2 - behind * u**2 * (1.0 - u))
        acted = float(WEIGHTS @ (off * np.exp(-long_s * (1.0 - u) / lag_s))) * long_s / (2.0 * lag_s)
        yield acted * _fading(at_s - time_s[row + 1], lag_s)


def departures(time_s: Array, values: Array, lag_s: float, at_s: Array) -> Iterator[Array]:
    """The same shifts, for an input that departs from the chord of a pause as it does where it is read, one sigma."""
    steps = np.diff(time_s)
    shortest_s = READ * float(np.median(steps)) if len(steps) else 0.0
    for row, long_s in _pauses(time_s):
        if long_s <= shortest_s:  # and all that follow
            return
        if usual := _departure(time_s, values, lag_s, long_s, shortest_s):
            yield usual * _fading(at_s - time_s[row + 1], lag_s)


def _departure(time_s: Array, values: Array, lag_s: float, long_s: float, shortest_s: float) -> float:
    """How far the lagged values are, after a stretch of a record, from those of its chord: root mean square.

    Over all stretches of some duration that are read; if there are too few, over shorter ones down to ``shortest_s``,
    which has hardly a reading inside, else 0.
    """
    steps = np.diff(time_s)
    while long_s > shortest_s:
        unread_s = np.concatenate([[0.0], np.cumsum(np.where(steps > long_s / READ, steps, 0.0))])
        whole = time_s + long_s <= time_s[-1]
        whole &= np.interp(time_s + long_s, time_s, unread_s) == unread_s
        if whole.sum() >= FEWEST_STRETCHES:
            return rms(_beyond_chord(time_s, values, lag_s, np.flatnonzero(whole), long_s))
        long_s /= 2.0
    return 0.0


def _beyond_chord(time_s: Array, values: Array, lag_s: float, rows: NDArray[np.intp], long_s: float) -> Array:
    """Lagged values after stretches that begin at some rows, minus those after their chords, ``(len(rows),)``."""
    end_s = time_s[rows] + long_s
    first, last = values[rows], np.interp(end_s, time_s, values)
    late = followed(np.append(time_s, end_s), np.append(values, last), [lag_s])[0]
    kept, slope = np.exp(-long_s / lag_s), (last - first) / long_s
    of_chord = last - slope * lag_s + (late[rows] - first + slope * lag_s) * kept
    return np.asarray(late[len(time_s) :] - of_chord)


def _pauses(time_s: Array) -> Iterator[tuple[int, float]]:
    """The longest pauses: the row before each, and how long it is."""
    steps = np.diff(time_s)
    yield from ((int(row), float(steps[row])) for row in np.argsort(-steps)[:MOST_PAUSES])


def _fading(since_s: Array, lag_s: float) -> Array:
    """What is left of a state some time after it; 0 before."""
    return np.where(since_s >= 0.0, np.exp(-np.maximum(since_s, 0.0) / lag_s), 0.0)


def _bend(time_s: Array, values: Array, row: int, within_s: float, way: int, expected: float) -> float:
    """Rate of change minus the expected one, from a row on (way 1) or up to it (-1); 0 where there are few readings.

    The rate is that of the readings within some time.
    """
    near = (way * (time_s - time_s[row]) >= 0.0) & (np.abs(time_s - time_s[row]) <= within_s)
    if near.sum() < FEWEST or np.ptp(time_s[near]) == 0.0:
        return 0.0
    own = time_s[near] - time_s[near].mean()
    return float(own @ values[near] / (own @ own)) - expected

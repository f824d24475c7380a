"""Distances between stations whose places are not known: what an adjustment may move, as nuisance columns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from stepgauge.axis.recording import STATIONS, AxisRecording
from stepgauge.files.arrays import Array

IN_LINE = 1e-2
"""Share of a distance by which the stations of a line may contradict one another: slopes and offsets, no corners."""


def fitted_distances(recording: AxisRecording) -> Array:
    """What every distance would be between first guesses of the stations' places, in units of position, ``(n,)``."""
    known = mean_distances(recording.frame)
    places = line_places(known)
    ends = zip(*(recording.frame[name].astype(str) for name in STATIONS), strict=True)
    if places is None:
        return np.array([known[min(pair), max(pair)] for pair in ends])
    return np.array([abs(places[far] - places[near]) for near, far in ends])


def station_columns(recording: AxisRecording) -> Array:
    """Columns ``(p, n)``: of what every distance changes with the place of each station but one.

    Where the stations do not lie in a line, or only the pairs' distances are there, every pair has a distance of its
    own: only what changes between its repeats can be told.
    """
    frame = recording.frame
    ends = [frame[name].to_numpy(str) for name in STATIONS]
    places = line_places(mean_distances(frame))
    if places is None:
        pair = np.unique(np.sort(np.stack(ends), axis=0), axis=1, return_inverse=True)[1].ravel()
        return (pair == np.arange(pair.max() + 1)[:, None]).astype(float)
    names = sorted(places)
    sign = np.sign([places[far] - places[near] for near, far in zip(*ends, strict=True)])
    columns = [sign * ((ends[1] == name).astype(float) - (ends[0] == name)) for name in names[1:]]
    return np.array(columns)


def mean_distances(frame: pd.DataFrame) -> dict[tuple[str, str], float]:
    """Mean reading of every pair, by the names of its stations in order."""
    found: dict[tuple[str, str], list[float]] = {}
    for one, other, reading in zip(*(frame[name].astype(str) for name in STATIONS), frame["reading"], strict=True):
        found.setdefault((min(one, other), max(one, other)), []).append(float(reading))
    return {pair: float(np.mean(readings)) for pair, readings in found.items()}


def line_places(distance: Mapping[tuple[str, str], float]) -> dict[str, float] | None:
    """Places of the stations along a line from one end of the longest distance; None where they lie in no line."""
    (start, end), longest = max(distance.items(), key=lambda one: one[1])
    places = {start: 0.0, end: longest}
    left = sorted({name for pair in distance for name in pair} - set(places))
    while left:
        name = max(left, key=lambda one: len(_seen_from(one, places, distance)))
        seen = _seen_from(name, places, distance)
        if not seen:
            return None
        tries = [places[other] + sign * d for other, d in seen.items() for sign in (1.0, -1.0)]
        off, best = min((max(abs(abs(at - places[o]) / d - 1.0) for o, d in seen.items()), at) for at in tries)
        if off > IN_LINE:
            return None
        places[name] = best
        left.remove(name)
    return places


def _seen_from(name: str, places: Mapping[str, float], distance: Mapping[tuple[str, str], float]) -> dict[str, float]:
    """Distances from a station to those that are placed."""
    pairs = {other: (min(name, other), max(name, other)) for other in places}
    return {other: distance[pair] for other, pair in pairs.items() if pair in distance}

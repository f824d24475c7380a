"""Drift with time: what all faces move alike from one cycle to the next, and what that does within a cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.recording import Recording
from stepgauge.recording.face_readings import FaceStatistics

SURE = 5.0
"""A rate beyond so many of its standard uncertainties is no chance."""


def clock(recording: Recording) -> tuple[Array, str]:
    """When every reading was taken, ``(n,)``, and its unit: ``time_s``, or else the order of the rows."""
    if "time_s" in recording.columns:
        return recording.columns["time_s"].astype(float), "s"
    return np.arange(len(recording), dtype=float), "reading"


def drift_rate(off_mm: Array, face: NDArray[np.int64], time: Array) -> tuple[float, float]:
    """Common rate of all faces in mm per unit of ``time``, with its standard uncertainty; NaN without repeats.

    Every face has a level of its own, so that nothing of the errors along the gauge is in the rate.
    """
    count = np.bincount(face)
    mean = [np.bincount(face, values)[face] / count[face] for values in (off_mm, time)]
    rest, since = off_mm - mean[0], time - mean[1]
    spread, freedom = float(since @ since), len(face) - int((count > 0).sum()) - 1
    if spread <= 0.0 or freedom < 3:
        return float("nan"), float("nan")
    rate = float(since @ rest) / spread
    return rate, float(np.sqrt(((rest - rate * since) ** 2).sum() / freedom / spread))


def drift_um(rate_mm: float, seen: FaceStatistics, face: NDArray[np.int64], time: Array) -> float:
    """Largest error that a rate makes between two faces, by the mean times at which they were read, um."""
    count = np.bincount(face, minlength=int(seen.faces[-1]) + 1)
    when = (np.bincount(face, time, len(count)) / np.maximum(count, 1))[seen.faces[seen.count > 0]]
    return abs(rate_mm) * float(np.ptp(when)) * 1e3

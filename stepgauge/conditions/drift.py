"""Drift with time: what all faces move alike from one cycle to the next, and what that does within a cycle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.condition import Condition
from stepgauge.conditions.readings import Readings
from stepgauge.files.notation import rounded
from stepgauge.recording import Recording
from stepgauge.recording.by_face import FaceStatistics

Array = NDArray[np.float64]
SURE = 5.0
"""A rate beyond so many of its standard uncertainties is no chance."""
NOTABLE_UM = 0.1
"""Size at the face that it moves most, from which it is remarked."""


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


def drift_conditions(recording: Recording, readings: Readings, seen: FaceStatistics) -> Iterator[Condition]:
    """A drift that the repeats show, with what it does to the errors along the gauge."""
    time, unit = clock(recording)
    time = time if readings.kept is None else time[readings.kept]
    rate, u = drift_rate(readings.off_mm, readings.face, time)
    if not np.isfinite(rate):
        return
    size = drift_um(rate, seen, readings.face, time)
    found = f"{rounded(rate * 1e6, 3, plus=True)} nm/{unit}"
    if readings.drift_corrected:
        yield Condition("drift", "corrected", readings.drift_corrected)
    elif abs(rate) <= SURE * u or size < NOTABLE_UM:
        yield Condition("drift", "met", "no drift with time shows in the repeats", found, "", size)
    else:
        words = (
            f"the readings drift by {found} (u = {rounded(u * 1e6, 2)}), {rounded(size, 3)} um from the first to the"
            " last face of a cycle: it is in the errors along the gauge, unless it is corrected"
        )
        yield Condition("drift", "contribution", words, found, "no drift, or --correct-drift", size)

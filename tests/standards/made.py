"""Recordings made from given errors of every face, independently of the code that finds them again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from stepgauge.gauge.certified import Gauge
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings

Errors = Callable[[int, int], float]
"""Error in um of the indicated position of a face in a cycle, along the gauge."""
TIP_MM = 3.994
START_MM = np.array([120.0, 340.0, 250.0])


def no_error(cycle: int, face: int) -> float:
    return 0.0


def made(
    gauge: Gauge,
    error_um: Errors = no_error,
    axis: Sequence[float] = (1.0, 0.0, 0.0),
    cycles: int = 3,
    faces: Sequence[int] | None = None,
    temperature_C: float | None = 20.0,
    start_mm: np.ndarray = START_MM,
) -> Recording:
    """One placement: face 1 at ``start_mm``, the gauge along ``axis``, read with an effective tip of ``TIP_MM``."""
    along = np.asarray(axis) / np.linalg.norm(axis)
    rows = []
    beside = np.zeros(3)
    for cycle in range(1, cycles + 1):
        beside[2] += 1e-9  # no two cycles are the same to the last digit, as copies are
        for face in faces or range(1, gauge.n_faces + 1):
            way = 1.0 if face % 2 else -1.0
            certified = gauge.position_mm[face - 1]
            if temperature_C is not None:
                certified *= 1.0 + gauge.table.expansion_per_K * (temperature_C - 20.0)
            indicated = certified + error_um(cycle, face) * 1e-3 - way * TIP_MM / 2.0
            rows.append([1, cycle, face, *(start_mm + beside + along * indicated), *(way * along)])
    frame = pd.DataFrame(rows, columns=["placement", "cycle", "face", *POSITION, *APPROACH])
    if temperature_C is not None:
        frame["gauge_temperature_C"] = temperature_C
    return Recording(frame, {}, "made.csv")


def joined(*recordings: Recording) -> Recording:
    """Placements 1, 2, ... of one recording."""
    return join_recordings(recordings)

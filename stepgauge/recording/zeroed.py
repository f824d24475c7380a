"""Cycles that were each set to zero at their first face: its scatter is in every other reading of the cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array

SAME_MM = 1e-7
"""Readings that differ by less are the same to the last digit."""
LEAST_FACES = 4
BY_CHANCE = 0.05
"""Share of other faces that may read the same in every cycle by their rounding."""


def zeroed_face(along_mm: Array, face: NDArray[np.int64], cycle: NDArray[np.int64]) -> int | None:
    """The first face, where every cycle of one placement was set to zero; None where it was not.

    ``along_mm (n,)``: readings along the gauge. It reads the same in every cycle, to the last digit, and hardly
    any other face does.
    """
    faces, number = np.unique(face, return_inverse=True)
    cycles = np.unique(cycle)
    if len(cycles) < 2 or len(faces) < LEAST_FACES:
        return None
    low, high = np.full(len(faces), np.inf), np.full(len(faces), -np.inf)
    np.minimum.at(low, number, along_mm)
    np.maximum.at(high, number, along_mm)
    same = high - low < SAME_MM
    in_all = np.isin(cycles, cycle[face == faces[0]]).all()
    return int(faces[0]) if same[0] and in_all and same[1:].mean() <= BY_CHANCE else None

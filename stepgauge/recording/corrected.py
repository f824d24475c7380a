"""Readings that the machine had corrected for its tip: surface points, turned back into tip centres with a radius.

The surface points are what was indicated. The radius is a way to write them down, and any other would do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.recording.columns import APPROACH, CORRECTED, POSITION

if TYPE_CHECKING:
    from stepgauge.recording.table import Recording


def corrected_radius_mm(recording: Recording) -> float | None:
    """Tip radius by which readings had been corrected, mm; None for tip centres as they were read.

    :class:`InputError` where it is no number.
    """
    stated = recording.comments.get(CORRECTED)
    if stated is None:
        return None
    radius = number(stated)
    if not np.isfinite(radius):
        what, expected = "readings were corrected for several tip radii", "one: import them with the same tip radius"
        raise InputError(recording.path, what, found=stated, expected=expected)
    return float(radius)


def share_radius(recordings: Sequence[Recording]) -> Sequence[Recording]:
    """The recordings with the radius of the first, so that they can be one: their surface points stay where they are.

    :class:`InputError` where some had been corrected for the tip, and others had not.
    """
    radii = [corrected_radius_mm(one) for one in recordings]
    without = [one.path for one, radius in zip(recordings, radii, strict=True) if radius is None]
    if len(without) == len(radii):
        return recordings
    if without:
        what = "tip centres, while other recordings had been corrected for the tip"
        raise InputError(", ".join(without), what, expected="all of them of one kind")
    (first, *_), found = radii, zip(recordings, radii, strict=True)
    return [_turned(one, radius or 0.0, first or 0.0) for one, radius in found]


def _turned(recording: Recording, before_mm: float, after_mm: float) -> Recording:
    """A recording of surface points, with tip centres of another radius."""
    if before_mm == after_mm:
        return recording
    shift_mm = before_mm - after_mm
    moved = {
        at: recording.columns[at] + shift_mm * recording.columns[along]
        for at, along in zip(POSITION, APPROACH, strict=True)
    }
    return recording.assign_columns(**moved).assign_comments(**{CORRECTED: f"{after_mm:.9g}"})


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

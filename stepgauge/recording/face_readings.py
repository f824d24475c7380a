"""Readings along the gauge by face: count, mean, standard deviation, for one recording or many at once.

All take leading dimensions: readings ``(..., n)`` give ``(..., k)`` by face, so that a Monte Carlo evaluates thousands
of recordings of one program with the code that evaluates one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array

Counts = NDArray[np.int64]
PIECE = 65_536
"""Readings that are worked on at a time."""


@dataclass(frozen=True)
class FaceStatistics:
    """By face of the used section: ``count (k,)``, ``mean_mm`` and ``deviation_mm (..., k)``; NaN where undefined."""

    faces: Counts
    count: Counts
    mean_mm: Array
    deviation_mm: Array

    @property
    def front(self) -> NDArray[np.bool_]:
        """Which faces are fronts, (faces,): those with odd numbers."""
        return self.faces % 2 == 1

    @property
    def pooled_mm(self) -> Array:
        """Standard deviation of a reading, pooled over all faces (GUM 4.2.4), ``(...)``; NaN without repeats."""
        freedom = np.maximum(self.count - 1, 0)
        square = np.where(freedom > 0, freedom * self.deviation_mm**2, 0.0).sum(axis=-1)
        return np.sqrt(square / (freedom.sum() or np.nan))


@dataclass(frozen=True)
class FaceReadings:
    """Readings along the gauge with count and mean by number of the face, worked out once for all that needs them.

    ``off_mm (..., n)``: position along the gauge minus certified position; ``face (n,)``; ``count (s,)`` and ``mean_mm
    (..., s)`` by number of the face from 0 (NaN where there is none).
    """

    off_mm: Array
    face: Counts
    count: Counts
    mean_mm: Array

    @classmethod
    def of(cls, off_mm: Array, face: Counts, slots: int = 0) -> FaceReadings:
        """From readings by row; ``slots``: at least so many numbers of faces."""
        slots = max(int(face.max()) + 1, slots)
        count = np.bincount(face, minlength=slots)
        with np.errstate(divide="ignore", invalid="ignore"):
            return cls(off_mm, face, count, _sums(off_mm, face, slots) / count)

    @cached_property
    def deviation_from_mean_mm(self) -> Array:
        """Every reading minus the mean of its face, ``(..., n)``."""
        from_mean = np.empty_like(self.off_mm)
        rows = max(1, PIECE // max(1, from_mean.size // max(1, len(self.face))))
        for first in range(0, len(self.face), rows):  # in pieces that stay in the cache: memory is the cost
            part = slice(first, first + rows)
            level = self.mean_mm.take(self.face[part], axis=-1)
            np.subtract(self.off_mm[..., part], level, out=from_mean[..., part])
        return from_mean

    def statistics(self, faces: Counts) -> FaceStatistics:
        """Count, mean and standard deviation (n - 1, Eqs 5 and 7) of the used faces ``(k,)``, rising."""
        count = self.count[faces]
        square = _sums(np.square(self.deviation_from_mean_mm), self.face, len(self.count))[..., faces]
        with np.errstate(divide="ignore", invalid="ignore"):
            deviation = np.sqrt(np.where(count > 1, square / (count - 1), np.nan))
        return FaceStatistics(faces, count, self.mean_mm[..., faces], deviation)


def _sums(values: Array, face: Counts, slots: int) -> Array:
    """Sums by number of the face, ``(..., slots)``, of ``values (..., n)``."""
    if values.ndim == 1:
        return np.asarray(np.bincount(face, values, slots), dtype=float)
    flat = values.reshape(-1, values.shape[-1])
    index = face + slots * np.arange(len(flat))[:, None]
    sums = np.bincount(index.ravel(), flat.ravel(), len(flat) * slots)
    return np.asarray(sums, dtype=float).reshape(*values.shape[:-1], slots)


def face_statistics(off_mm: Array, face: Counts, faces: Counts) -> FaceStatistics:
    """Statistics of readings ``off_mm (..., n)`` with their ``face (n,)``, for the used faces ``(k,)``, rising."""
    return FaceReadings.of(off_mm, face, int(faces.max()) + 1).statistics(faces)

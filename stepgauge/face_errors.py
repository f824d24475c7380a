"""Pahk & Kim, equations 1 to 13, on arrays: readings by row to errors by face, for one recording or many at once.

All functions take leading dimensions: ``(..., n)`` readings give ``(..., k)`` errors, so that a Monte Carlo evaluates
thousands of recordings of one program with the code that evaluates one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
REffOrigin = Literal["first", "all"]
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
        return self.faces % 2 == 1


@dataclass(frozen=True)
class FaceErrors:
    """Errors by face, um, shape ``(..., k)``; the effective radius and its standard uncertainty, mm, ``(...)``."""

    xf_um: Array
    sf_um: Array
    xb_um: Array
    sb_um: Array
    r_eff_mm: Array
    u_r_eff_mm: Array

    @property
    def xm_um(self) -> Array:
        """Mean of forward and backward error, Eq 12."""
        return (self.xf_um + self.xb_um) / 2.0

    @property
    def xr_um(self) -> Array:
        """Reversal, Eq 13."""
        return self.xb_um - self.xf_um


@dataclass(frozen=True)
class ByFace:
    """Readings along the gauge with count and mean by number of the face, worked out once for all that needs them.

    ``off_mm (..., n)``: position along the gauge minus certified position; ``face (n,)``; ``count (s,)`` and ``mean_mm
    (..., s)`` by number of the face from 0 (NaN where there is none).
    """

    off_mm: Array
    face: Counts
    count: Counts
    mean_mm: Array

    @classmethod
    def of(cls, off_mm: Array, face: Counts, slots: int = 0) -> ByFace:
        """From readings by row; ``slots``: at least so many numbers of faces."""
        slots = max(int(face.max()) + 1, slots)
        count = np.bincount(face, minlength=slots)
        with np.errstate(divide="ignore", invalid="ignore"):
            return cls(off_mm, face, count, _sums(off_mm, face, slots) / count)

    @cached_property
    def from_mean_mm(self) -> Array:
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
        square = _sums(np.square(self.from_mean_mm), self.face, len(self.count))[..., faces]
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
    return ByFace.of(off_mm, face, int(faces.max()) + 1).statistics(faces)


def reference_face(seen: FaceStatistics) -> int | None:
    """Index of the first front face that was measured: M_ref and S_ref belong to it. None where no front was."""
    fronts = np.flatnonzero(seen.front & (seen.count > 0))
    return int(fronts[0]) if fronts.size else None


def radius_blocks(seen: FaceStatistics, origin: REffOrigin) -> NDArray[np.intp]:
    """Indices of the blocks that the effective radius comes from: the first complete one, or all complete ones."""
    complete = np.flatnonzero((seen.count[0::2] > 0) & (seen.count[1::2] > 0))
    return complete[:1] if origin == "first" else complete


def face_errors(seen: FaceStatistics, u_um: Array, origin: REffOrigin) -> FaceErrors:
    """Errors against the certificate (Eqs 1 to 11); ``u_um (k,)`` is its standard uncertainty at the faces.

    The section must have a measured front (:func:`reference_face`) and a complete block (:func:`radius_blocks`).
    """
    reference = reference_face(seen)
    assert reference is not None
    radius_mm, u_mm = _effective_radius(seen, u_um, radius_blocks(seen, origin))
    tip_mm = np.where(seen.front, 0.0, 2.0 * radius_mm[..., None])
    error_um = (seen.mean_mm - seen.mean_mm[..., reference : reference + 1] - tip_mm) * 1e3
    xf, xb = _forward_backward(error_um, seen.front)
    sf, sb = _forward_backward(seen.deviation_mm * 1e3, seen.front)
    return FaceErrors(xf, sf, xb, sb, radius_mm, u_mm)


def _effective_radius(seen: FaceStatistics, u_um: Array, blocks: NDArray[np.intp]) -> tuple[Array, Array]:
    """Half of measured minus certified block size (Eq 1), with its standard uncertainty."""
    front, back = 2 * blocks, 2 * blocks + 1
    radius = (seen.mean_mm[..., back] - seen.mean_mm[..., front]) / 2.0
    scatter = np.nan_to_num(seen.deviation_mm * 1e3) ** 2 / np.maximum(seen.count, 1)
    variance = scatter + u_um**2
    u_um_block = np.sqrt(variance[..., front] + variance[..., back]) / 2.0
    u_mm = np.sqrt((u_um_block**2).sum(axis=-1)) / len(blocks) * 1e-3
    return radius.mean(axis=-1), u_mm


def _forward_backward(value: Array, front: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Values of fronts and of backs at every face, the mean of the two neighbours in between (Eqs 8-11)."""
    forward, backward = (_with_neighbours(np.where(rows, value, np.nan), rows) for rows in (front, ~front))
    return forward, backward


def _with_neighbours(value: Array, measured: NDArray[np.bool_]) -> Array:
    edge = np.full((*value.shape[:-1], 1), np.nan)
    padded = np.concatenate([edge, value, edge], axis=-1)
    return np.where(measured, value, (padded[..., :-2] + padded[..., 2:]) / 2.0)


def band_um(xm_um: Array) -> Array:
    """Largest minus smallest mean error (Eq 12), um, shape ``(...)``; NaN where no mean is defined."""
    defined = ~np.isnan(xm_um)
    high = np.where(defined, xm_um, -np.inf).max(axis=-1)
    low = np.where(defined, xm_um, np.inf).min(axis=-1)
    return np.where(defined.any(axis=-1), high - low, np.nan)


def worst_two_sigma_um(seen: FaceStatistics) -> Array:
    """Twice the largest standard deviation of a measured face, um, shape ``(...)``; NaN with a single cycle."""
    known = np.isfinite(seen.deviation_mm)
    worst = np.where(known, seen.deviation_mm, -np.inf).max(axis=-1)
    return np.where(known.any(axis=-1), 2e3 * worst, np.nan)

"""Pahk & Kim, equations 1 to 13, on arrays: readings by row to errors by face, for one recording or many at once.

All functions take leading dimensions: ``(..., n)`` readings give ``(..., k)`` errors, so that a Monte Carlo evaluates
thousands of recordings of one program with the code that evaluates one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.recording.face_readings import FaceStatistics

REffOrigin = Literal["first", "all", "corrected"]
"""Where the effective radius comes from: the first complete block, all of them, or the correction of the readings."""


@dataclass(frozen=True)
class FaceErrors:
    """Errors by face, um, shape ``(..., k)``; the effective radius and its standard uncertainty, mm, ``(...)``.

    The uncertainty is of certificate and repeatability, and undefined (NaN) where nothing was read twice.
    """

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


def reference_face(seen: FaceStatistics) -> int | None:
    """Index of the first front face that was measured: M_ref and S_ref belong to it. None where no front was."""
    fronts = np.flatnonzero(seen.front & (seen.count > 0))
    return int(fronts[0]) if fronts.size else None


def radius_blocks(seen: FaceStatistics, origin: REffOrigin) -> NDArray[np.intp]:
    """Indices of the blocks that the effective radius comes from: the first complete one, all, or none."""
    complete = np.flatnonzero((seen.count[0::2] > 0) & (seen.count[1::2] > 0))
    return {"first": complete[:1], "all": complete, "corrected": complete[:0]}[origin]


def face_errors(
    seen: FaceStatistics,
    u_um: Array,
    origin: REffOrigin,
    correlation: Array | None = None,
    corrected_mm: float = 0.0,
) -> FaceErrors:
    """Errors against the certificate (Eqs 1 to 11); ``u_um (k,)`` is its standard uncertainty at the faces, with their
    ``correlation (k, k)`` (None: independent).

    ``corrected_mm``: the radius of the origin ``"corrected"``, which is exact: the errors are those of the points as
    the machine indicated them, 0 for differences of readings. The section must have a measured front
    (:func:`reference_face`) and, for other origins, a complete block (:func:`radius_blocks`).
    """
    reference = reference_face(seen)
    assert reference is not None
    if origin == "corrected":
        radius_mm, u_mm = np.full(seen.mean_mm.shape[:-1], corrected_mm), np.zeros(seen.mean_mm.shape[:-1])
    else:
        radius_mm, u_mm = _effective_radius(seen, u_um, radius_blocks(seen, origin), correlation)
    tip_mm = np.where(seen.front, 0.0, 2.0 * radius_mm[..., None])
    error_um = (seen.mean_mm - seen.mean_mm[..., reference : reference + 1] - tip_mm) * 1e3
    xf, xb = _forward_backward(error_um, seen.front)
    sf, sb = _forward_backward(seen.deviation_mm * 1e3, seen.front)
    return FaceErrors(xf, sf, xb, sb, radius_mm, u_mm)


def reversal_of_scale_um(
    faces: NDArray[np.int64], count: NDArray[np.int64], position_mm: Array, xm_um: Array, origin: REffOrigin
) -> float:
    """Mean XR in um that a scale error of the size of the slope of XM shows of itself; NaN with fewer than two XM.

    All arrays are by face, (k,). Of blocks of width w with gaps g, backs are interpolated (w - g) / 2 beside the fronts
    (Eqs 8 to 11), and the tip diameter holds the error of a block, c w (Eq 1): together -c (w + g) / 2, minus half a
    pitch times the scale error c, though the machine has no reversal.
    """
    of_1_ppm = np.where(count > 0, position_mm * 1e-6, np.nan)
    seen = FaceStatistics(faces, count, of_1_ppm, np.full_like(of_1_ppm, np.nan))
    of_one = face_errors(seen, np.zeros(len(faces)), origin)
    known = np.isfinite(of_one.xr_um) & np.isfinite(xm_um)
    if known.sum() < 2:
        return float("nan")
    slope, of_1_slope = (np.polyfit(position_mm[known], xm[known], 1)[0] for xm in (xm_um, of_one.xm_um))
    return float(slope / of_1_slope * of_one.xr_um[known].mean())


def _effective_radius(
    seen: FaceStatistics, u_um: Array, blocks: NDArray[np.intp], correlation: Array | None
) -> tuple[Array, Array]:
    """Half of measured minus certified block size (Eq 1), with its standard uncertainty; NaN without any repeats.

    The repeatability is pooled over all faces, as in the budget: a face repeats no better than the others because its
    few readings happen to agree.
    """
    front, back = 2 * blocks, 2 * blocks + 1
    radius = (seen.mean_mm[..., back] - seen.mean_mm[..., front]) / 2.0
    weight = np.zeros(len(seen.faces))
    weight[back], weight[front] = 0.5 / len(blocks), -0.5 / len(blocks)
    certified = weight * u_um
    known = certified @ (certified if correlation is None else correlation @ certified)
    repeated = (seen.pooled_mm * 1e3) ** 2 * float((weight**2 / np.maximum(seen.count, 1)).sum())
    return radius.mean(axis=-1), np.asarray(np.sqrt(known + repeated) * 1e-3)


def _forward_backward(value: Array, front: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Values of fronts and of backs at every face, the mean of the two neighbours in between (Eqs 8-11)."""
    forward, backward = (_fill_from_neighbours(np.where(rows, value, np.nan), rows) for rows in (front, ~front))
    return forward, backward


def _fill_from_neighbours(value: Array, measured: NDArray[np.bool_]) -> Array:
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

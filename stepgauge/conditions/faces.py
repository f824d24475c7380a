"""Faces and blocks that stand out: in every cycle from their neighbours, or by their scatter from all others."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.condition import Condition
from stepgauge.conditions.outliers import odd_blocks, odd_faces
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.face_readings import FaceStatistics

BY_CHANCE = 1e-3
"""Probability that any face of a recording of normal scatter is remarked."""
LEAST_2S_UM = 1.0
"""No smaller 2s is remarked, however well the other faces repeat."""
NEAR = 0.7
"""Share of the limit from which a normal score, which is known nearly only, is worked out exactly."""
SHOWN = 10


def face_conditions(seen: FaceStatistics, gauge: Gauge) -> Iterator[Condition]:
    """Faces off their neighbours, blocks unlike the others, faces that repeat worse than the others."""
    repeat_um = np.nan_to_num(seen.deviation_mm) * 1e3 / np.sqrt(np.maximum(seen.count, 1))
    u_um = np.hypot(gauge.u_um[seen.faces - 1], repeat_um)
    blocks = odd_blocks(seen.faces, seen.mean_mm * 1e3, u_um)
    if blocks:
        shown = ", ".join(f"block {block} by {rounded(um, 3, plus=True)} um" for block, um in blocks[:SHOWN])
        words = f"read longer (+) or shorter (-) than the other blocks: {shown}: its faces, or its certificate"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in blocks))
    faces = odd_faces(seen.faces, gauge.position_mm[seen.faces - 1], seen.mean_mm * 1e3, u_um)
    if faces:
        shown = ", ".join(f"face {face} ({rounded(um, 3, plus=True)} um)" for face, um in faces[:SHOWN])
        why = "the face, its certificate, or the scale there; repeats cannot tell"
        words = f"off the line between their neighbours: {shown}: {why}"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in faces))
    yield from _scatter(seen)


def _scatter(seen: FaceStatistics) -> Iterator[Condition]:
    """Faces whose 2s is larger than that of the others by more than chance (F test, all faces together)."""
    often = seen.count > 1
    if often.sum() < 3:
        return
    freedom = np.where(often, seen.count - 1, 0).astype(float)
    square = np.nan_to_num(seen.deviation_mm) ** 2
    rest = freedom.sum() - freedom
    others = np.maximum((freedom * square).sum() - freedom * square, 0.0) / np.maximum(rest, 1.0)
    two_s_um = 2e3 * np.sqrt(square)
    suspect = np.flatnonzero(often & (two_s_um > LEAST_2S_UM) & (square > 0.0))
    above, below = np.maximum(freedom, 1.0)[suspect], np.maximum(rest, 1.0)[suspect]
    rows = suspect[_exceeds(square[suspect], others[suspect], above, below, BY_CHANCE / float(often.sum()))]
    if rows.size and rows.size <= often.sum() / 4:
        shown = ", ".join(f"face {seen.faces[i]} ({rounded(two_s_um[i], 3)} um)" for i in rows[:SHOWN])
        words = f"2s larger than at the other faces ({rounded(2e3 * float(seen.pooled_mm), 3)} um over all): {shown}"
        yield Condition("scatter", "contribution", words, size_um=float(two_s_um[rows].max()))


def _exceeds(square: Array, others: Array, above: Array, below: Array, chance: float) -> NDArray[np.bool_]:
    """Whether variances of ``above`` degrees of freedom are larger than others of ``below`` by more than a chance."""
    if not (_normal_score(square, others, above, below) > NEAR * NormalDist().inv_cdf(1.0 - chance)).any():
        return np.zeros(len(square), np.bool_)
    return np.asarray(square > _fisher_limit(chance, above, below) * others)


def _normal_score(square: Array, others: Array, above: Array, below: Array) -> Array:
    """A ratio of variances as a normal deviate, nearly (Paulson 1942; Abramowitz 26.6.15)."""
    a, b = 2.0 / (9.0 * above), 2.0 / (9.0 * below)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.cbrt(square / others)
        score = ((1.0 - b) * root - (1.0 - a)) / np.sqrt(b * root**2 + a)
    return np.where(others > 0.0, score, np.inf)


def _fisher_limit(chance: float, above: Array, below: Array) -> Array:
    """What a ratio of two variances with these degrees of freedom exceeds with a probability (Abramowitz 26.5.28).

    The incomplete beta function takes longer to load than to evaluate a recording, so that it is asked only where
    :func:`_normal_score` is near the limit.
    """
    from scipy.special import betaincinv

    share = betaincinv(below / 2.0, above / 2.0, chance)
    return np.asarray(below / above * (1.0 / share - 1.0))

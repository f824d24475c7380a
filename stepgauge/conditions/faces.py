"""Faces and blocks that stand out: in every cycle from their neighbours, or by their scatter from all others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import betaincinv

from stepgauge.conditions.condition import Condition
from stepgauge.conditions.outliers import odd_blocks, odd_faces
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.by_face import FaceStatistics

BY_CHANCE = 1e-3
"""Probability that any face of a recording of normal scatter is remarked."""
LEAST_2S_UM = 1.0
"""No smaller 2s is remarked, however well the other faces repeat."""
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
    limit = _fisher_limit(BY_CHANCE / float(often.sum()), np.maximum(freedom, 1.0), np.maximum(rest, 1.0)) * others
    two_s_um = 2e3 * np.sqrt(square)
    rows = np.flatnonzero(often & (square > limit) & (two_s_um > LEAST_2S_UM))
    if rows.size and rows.size <= often.sum() / 4:
        shown = ", ".join(f"face {seen.faces[i]} ({rounded(two_s_um[i], 3)} um)" for i in rows[:SHOWN])
        words = f"2s larger than at the other faces ({rounded(2e3 * float(seen.pooled_mm), 3)} um over all): {shown}"
        yield Condition("scatter", "contribution", words, size_um=float(two_s_um[rows].max()))


def _fisher_limit(chance: float, above: Array, below: Array) -> Array:
    """What a ratio of two variances with these degrees of freedom exceeds with a probability (Abramowitz 26.5.28).

    By the incomplete beta function itself: the module of distributions takes a second to load.
    """
    share = betaincinv(below / 2.0, above / 2.0, chance)
    return np.asarray(below / above * (1.0 / share - 1.0))

"""Which face of the gauge a probing meets, from geometry alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.units import unit_hint
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Program

Faces = NDArray[np.int64]
MIN_COSINE = 0.98
"""Smallest cosine between an approach and the gauge axis: 11 deg, beyond what any locating gets wrong."""
MAX_SPREAD_MM = 0.5
"""The tip centres of one program stand equally far before their faces; more spread than this is another gauge."""
AT_FACE_MM = 25.0
"""Tip centres farther than this from every face (a ball of 50 mm) do not probe the gauge."""


@dataclass(frozen=True)
class FaceWords:
    """What the geometry of points is called in messages: their places in a file, and what they are."""

    at: list[str]
    move: str
    target: str
    expected: str


def probed_faces(program: Program, gauge: Gauge, placement: Placement) -> Faces:
    """Number of the face that each measuring move of a program is aimed at, shape ``(n_points,)``.

    A move along the axis meets the next front ahead of it, one against the axis the next back. The tip radius need not
    be known: whatever it is, it is the same for all points.

    Raises
    ------
    InputError
        names the program's line: an approach across the gauge, a target beside or beyond the faces, or targets that
        stand unequally far before their faces, as with the placement of another set-up
    """
    measure = program.is_measure
    where = FaceWords(
        [f"{program.name}:{line}" for line in program.line[measure]],
        "the measuring move",
        "target",
        "the gauge and the placement that the program was planned for",
    )
    return faces_met(program.position_mm[measure], program.approach[measure], gauge, placement, where)


def faces_met(position_mm: Array, approach: Array, gauge: Gauge, placement: Placement, where: FaceWords) -> Faces:
    """The face that a tip centre near its contact is about to meet, shape ``(n,)``; errors as :func:`probed_faces`."""
    tip = placement.to_gauge(gauge, position_mm)
    along = approach @ placement.axis
    _check_approach(along, where)
    _check_on_face(tip, gauge, where)
    face = np.where(along > 0, _next_front(tip[:, 0], gauge, where, along), _next_back(tip[:, 0], gauge, where, along))
    _check_distance(np.abs(gauge.position_mm[face - 1] - tip[:, 0]), face, where)
    return face


def nearest_faces(position_mm: Array, gauge: Gauge, placement: Placement) -> tuple[Faces, Array]:
    """Nearest face of each point, and how far before it (outside its block) the point stands, mm; each ``(n,)``.

    A ball that fits between two blocks is nearer to the one it touches, so no approach is needed.
    """
    along = placement.to_gauge(gauge, position_mm)[:, 0]
    face = 1 + np.abs(along[:, None] - gauge.position_mm).argmin(axis=1)
    outward = np.where(face % 2 == 1, -1.0, 1.0)
    return face, (along - gauge.position_mm[face - 1]) * outward


def faces_touched(position_mm: Array, gauge: Gauge, placement: Placement, where: FaceWords) -> Faces:
    """The face that each point touches, from its position alone, shape ``(n,)``.

    :class:`InputError` for points beside the blocks or far from every face, and for points that stand unequally far
    before their faces.
    """
    _check_on_face(placement.to_gauge(gauge, position_mm), gauge, where)
    face, before_mm = nearest_faces(position_mm, gauge, placement)
    far = np.abs(before_mm) > AT_FACE_MM
    if far.any():
        row = int(far.argmax())
        raise InputError(
            where.at[row],
            "the point is at no face of the gauge as placed",
            found=f"{before_mm[row]:.3f} mm before face {face[row]}",
            expected=where.expected,
        )
    _check_distance(before_mm, face, where)
    return face


def tip_distance_mm(position_mm: Array, gauge: Gauge, placement: Placement) -> float | None:
    """How far before the faces the points stand, mm: about the tip radius for tip centres, 0 for surface points.

    The mean of fronts and backs, in which an error of the placement along the gauge cancels; None without both.
    """
    face, before_mm = nearest_faces(position_mm, gauge, placement)
    sides = [before_mm[face % 2 == side] for side in (1, 0)]
    return float(np.mean([np.median(side) for side in sides])) if all(side.size for side in sides) else None


def cycles_of(face: Faces) -> Faces:
    """Cycle of each probing: the n-th visit of a face is its cycle n.

    Where the first face was touched again at the end of every cycle, two of its visits are one cycle.
    """
    cycle = np.empty_like(face)
    often = np.bincount(face)
    others = often[(often > 0) & (np.arange(len(often)) != face[0])]
    again = len(face) > 1 and bool(others.size) and face[-1] == face[0] and often[face[0]] == 2 * int(np.median(others))
    for number in np.unique(face):
        visits = face == number
        cycle[visits] = np.arange(visits.sum()) // (2 if again and number == face[0] else 1) + 1
    return cycle


def _next_front(tip_a: Array, gauge: Gauge, where: FaceWords, along: Array) -> Faces:
    block = np.searchsorted(gauge.position_mm[0::2], tip_a)
    _check_exists((block >= gauge.n_blocks) & (along > 0), "front", "beyond the last front", tip_a, where)
    return 2 * np.minimum(block, gauge.n_blocks - 1) + 1


def _next_back(tip_a: Array, gauge: Gauge, where: FaceWords, along: Array) -> Faces:
    block = np.searchsorted(gauge.position_mm[1::2], tip_a) - 1
    _check_exists((block < 0) & (along < 0), "back", "before the first back", tip_a, where)
    return 2 * np.maximum(block, 0) + 2


def _check_exists(missing: NDArray[np.bool_], side: str, place: str, tip_a: Array, where: FaceWords) -> None:
    if missing.any():
        row = int(missing.argmax())
        raise InputError(
            where.at[row],
            f"{where.move} meets no {side} face of the gauge as placed",
            found=f"a {where.target} {tip_a[row]:.3f} mm along the gauge, {place}",
            expected=where.expected,
        )


def _check_approach(along: Array, where: FaceWords) -> None:
    across = np.abs(along) < MIN_COSINE
    if across.any():
        row = int(across.argmax())
        raise InputError(
            where.at[row],
            f"{where.move} is not along the gauge as placed",
            found=f"a cosine of {along[row]:+.4f} to its axis",
            expected=f"at least {MIN_COSINE:g}: {where.expected}",
        )


def check_mostly_on_blocks(
    position_mm: Array, gauge: Gauge, placement: Placement, where: FaceWords, named: bool = True
) -> None:
    """:class:`InputError` where most points lie beside the blocks; a few may be points of something else.

    ``named``: somebody named the columns, who may have exchanged two of them; a controller does not.
    """
    tip = placement.to_gauge(gauge, position_mm)
    if are_beside_blocks(tip, gauge).mean() > 0.5:
        hint = _exchanged(position_mm, gauge, placement) if named else ""
        other = "" if named else " (another placement, or the log of another program?)"
        _check_on_face(tip, gauge, where, hint, other)


def are_beside_blocks(tip: Array, gauge: Gauge) -> NDArray[np.bool_]:
    """Which points, in gauge coordinates, lie beside the blocks."""
    half = np.array([gauge.table.block_width_mm, gauge.table.block_height_mm]) / 2.0
    return np.asarray((np.abs(tip[:, 1:]) > half).any(axis=1))


def _exchanged(position_mm: Array, gauge: Gauge, placement: Placement) -> str:
    """Words where the points lie on the blocks once two of their coordinates are exchanged; else empty."""
    for one, other in ((0, 1), (1, 2), (0, 2)):
        order = [0, 1, 2]
        order[one], order[other] = other, one
        if are_beside_blocks(placement.to_gauge(gauge, position_mm[:, order]), gauge).mean() < 0.5:
            return f" (the columns of {'xyz'[one]} and {'xyz'[other]} look exchanged)"
    return ""


def _check_on_face(tip: Array, gauge: Gauge, where: FaceWords, hint: str = "", other: str = "") -> None:
    """``hint``: why the points are beside the blocks; ``other``: why where no unit says so."""
    half = np.array([gauge.table.block_width_mm, gauge.table.block_height_mm]) / 2.0
    beside = are_beside_blocks(tip, gauge)
    if beside.any():
        row = int(beside.argmax())
        hint = hint or unit_hint(float(np.ptp(tip[:, 0])), float(np.ptp(gauge.position_mm))) or other
        raise InputError(
            where.at[row],
            f"{where.move} is aimed beside the blocks of the gauge as placed{hint}",
            found=f"{tip[row, 1]:.3f} mm to the side, {tip[row, 2]:.3f} mm up from their middle",
            expected=f"within {half[0]:g} mm and {half[1]:g} mm: {where.expected}",
        )


def _check_distance(distance_mm: Array, face: Faces, where: FaceWords) -> None:
    typical = float(np.median(distance_mm))
    odd = np.abs(distance_mm - typical) > MAX_SPREAD_MM
    if odd.any():
        row = int(odd.argmax())
        raise InputError(
            where.at[row],
            f"the {where.target} of point {row + 1} does not stand before face {face[row]} as the others do before"
            " theirs",
            found=f"{distance_mm[row]:.3f} mm",
            expected=f"{typical:.3f} mm: {where.expected}",
        )

"""Which face of the gauge each measuring move of a program meets, from geometry alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.gauge import Gauge
from stepgauge.moves import Program
from stepgauge.placement import Placement

MIN_COSINE = 0.98
"""Smallest cosine between an approach and the gauge axis: 11 deg, beyond what any locating gets wrong."""
MAX_SPREAD_MM = 0.5
"""The tip centres of one program stand equally far before their faces; more spread than this is another gauge."""


def probed_faces(program: Program, gauge: Gauge, placement: Placement) -> NDArray[np.int64]:
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
    where = [f"{program.name}:{line}" for line in program.line[measure]]
    tip = placement.to_gauge(gauge, program.position_mm[measure])
    along = program.approach[measure] @ placement.axis
    _check_approach(along, where)
    _check_on_face(tip, gauge, where)
    face = np.where(along > 0, _next_front(tip[:, 0], gauge, where, along), _next_back(tip[:, 0], gauge, where, along))
    _check_distance(np.abs(gauge.position_mm[face - 1] - tip[:, 0]), face, where)
    return face


def cycles_of(face: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cycle of each probing: the n-th visit of a face is its cycle n."""
    cycle = np.empty_like(face)
    for number in np.unique(face):
        visits = face == number
        cycle[visits] = np.arange(1, visits.sum() + 1)
    return cycle


def _next_front(tip_a: NDArray[np.float64], gauge: Gauge, where: list[str], along: NDArray[np.float64]) -> NDArray:
    block = np.searchsorted(gauge.position_mm[0::2], tip_a)
    _check_exists((block >= gauge.n_blocks) & (along > 0), "front", "beyond the last front", tip_a, where)
    return 2 * np.minimum(block, gauge.n_blocks - 1) + 1


def _next_back(tip_a: NDArray[np.float64], gauge: Gauge, where: list[str], along: NDArray[np.float64]) -> NDArray:
    block = np.searchsorted(gauge.position_mm[1::2], tip_a) - 1
    _check_exists((block < 0) & (along < 0), "back", "before the first back", tip_a, where)
    return 2 * np.maximum(block, 0) + 2


def _check_exists(
    missing: NDArray[np.bool_], side: str, place: str, tip_a: NDArray[np.float64], where: list[str]
) -> None:
    if missing.any():
        row = int(missing.argmax())
        raise InputError(
            where[row],
            f"the measuring move meets no {side} face of the gauge as placed",
            found=f"a target {tip_a[row]:.3f} mm along the gauge, {place}",
            expected="the gauge and the placement that the program was planned for",
        )


def _check_approach(along: NDArray[np.float64], where: list[str]) -> None:
    across = np.abs(along) < MIN_COSINE
    if across.any():
        row = int(across.argmax())
        raise InputError(
            where[row],
            "the measuring move is not along the gauge as placed",
            found=f"a cosine of {along[row]:+.4f} to its axis",
            expected=f"at least {MIN_COSINE:g}: the placement that the program was planned for",
        )


def _check_on_face(tip: NDArray[np.float64], gauge: Gauge, where: list[str]) -> None:
    half = np.array([gauge.table.block_width_mm, gauge.table.block_height_mm]) / 2.0
    beside = (np.abs(tip[:, 1:]) > half).any(axis=1)
    if beside.any():
        row = int(beside.argmax())
        raise InputError(
            where[row],
            "the measuring move is aimed beside the blocks of the gauge as placed",
            found=f"{tip[row, 1]:.3f} mm to the side, {tip[row, 2]:.3f} mm up from their middle",
            expected=f"within {half[0]:g} mm and {half[1]:g} mm",
        )


def _check_distance(distance_mm: NDArray[np.float64], face: NDArray[np.int64], where: list[str]) -> None:
    typical = float(np.median(distance_mm))
    odd = np.abs(distance_mm - typical) > MAX_SPREAD_MM
    if odd.any():
        row = int(odd.argmax())
        raise InputError(
            where[row],
            f"the target of point {row + 1} does not stand before face {face[row]} as the others do before theirs",
            found=f"{distance_mm[row]:.3f} mm",
            expected=f"{typical:.3f} mm: the gauge and the placement that the program was planned for",
        )

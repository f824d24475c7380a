"""The geometry of two blocks from 16 points: centres, front normals, effective radius, up direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import STANDING_COS

ROLL_STEPS = 720
AXIS_ITERATIONS = 20
AXIS_SETTLED = 1e-8
"""The iteration of the axis stops after a step smaller than this, rad: the next would be a millionth of it."""
UPWARDS = np.array([0.0, 0.0, 1.0])
STEEP_COS = 0.9
"""|a.z| above which the side direction of a gauge rotates by more than twice the rotation of its axis."""
_TILT, _LARGEST_TURN = 1e-6, 0.3


@dataclass(frozen=True)
class Blocks:
    """Geometry from the 16 points; any leading dimensions, then one entry for the beginning and one for the end block.

    ``points (..., 2, 8, 3)``; ``normal (..., 2, 3)``: unit normal of the front plane, out of the block; ``centre_mm
    (..., 2, 3)``; ``radius_mm (..., 2)``: half the difference of the measured and certified size of the block, the
    effective tip radius; ``axis`` and ``up (..., 3)``.
    """

    points: Array
    normal: Array
    centre_mm: Array
    radius_mm: Array
    up: Array

    @property
    def axis(self) -> Array:
        """Unit vectors of the gauge axis, (..., 3): from the first block to the last."""
        return unit(self.centre_mm[..., 1, :] - self.centre_mm[..., 0, :])

    @property
    def side(self) -> Array:
        """Unit vectors across the gauge, (..., 3): to the right when one looks along it."""
        return np.cross(self.axis, self.up)

    @property
    def tip_radius_mm(self) -> Array:
        """Mean over the two blocks."""
        return self.radius_mm.mean(axis=-1)


def unit(vector: Array) -> Array:
    """Vectors ``(..., 3)`` at length one; a vector of length zero gives NaN."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def solve_blocks(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None = None, axis: Array | None = None
) -> Blocks:
    """Centres, normals and effective radius from the 16 points ``(..., 16, 3)``, without checks.

    ``up``: direction from the rail to the blocks; default machine +z, or, where a single gauge stands on end, the
    direction from its points. ``axis``: the start value, default :func:`first_axis` or :func:`rough_axis`.
    ``numpy.linalg.LinAlgError`` where the points do not span two blocks.
    """
    p = points.reshape(*points.shape[:-2], 2, 8, 3)
    size_mm = gauge.block_size_mm[[blocks[0] - 1, blocks[1] - 1]]
    if axis is None:
        axis = first_axis(points, gauge, blocks) if points.ndim == 2 and up is None else rough_axis(points)
    if up is None:
        up = usual_up(points, axis, gauge) if points.ndim == 2 else UPWARDS
    axis = np.broadcast_to(axis, (*points.shape[:-2], 3))
    for _ in range(AXIS_ITERATIONS):
        turn = _turn(p, axis, up, size_mm)
        axis = unit(axis + turn)
        if not (np.abs(turn) > AXIS_SETTLED).any():
            break
    return _solve(p, axis, up, size_mm)


def _turn(p: Array, axis: Array, up: Array, size_mm: Array) -> Array:
    """Newton step of the axis towards the line through the centres, ``(..., 3)``.

    Fixed-point iteration converges too slowly for a short, steep gauge, and not at all near the vertical: there the
    side direction rotates by more than the axis.
    """
    across = _square(up, axis)
    frame = np.stack([np.cross(axis, across), across], axis=-2)
    tilts = _TILT * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    lines = _solve(p, unit(axis + np.einsum("ti,...ij->t...j", tilts, frame)), up, size_mm).axis
    ahead = np.einsum("t...j,...j->t...", lines, axis)[..., None]
    off = np.einsum("...ij,t...j->t...i", frame, lines) / ahead
    off = off - tilts.reshape(3, *[1] * (axis.ndim - 1), 2)
    by = np.stack([off[1] - off[0], off[2] - off[0]], axis=-1) / _TILT
    step = np.linalg.solve(by, -off[0][..., None])[..., 0]
    length = np.linalg.norm(step, axis=-1, keepdims=True)
    step = step * np.minimum(1.0, _LARGEST_TURN / np.maximum(length, 1e-300))
    return np.einsum("...i,...ij->...j", step, frame)


def _square(up: Array, axis: Array) -> Array:
    """The component of ``up`` perpendicular to the axis, as a unit vector."""
    return unit(up - axis * (axis * up).sum(axis=-1, keepdims=True))


def first_axis(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> Array:
    """Start value of the axis, unit vector: through the means of the points ``(16, 3)`` unless the gauge is steep.

    Near the vertical, two axes may fit a given up direction; the right one is that with the up direction from the
    points.
    """
    axis = rough_axis(points)
    if abs(axis[2]) < STEEP_COS:
        return axis
    return solve_blocks(points, gauge, blocks, fit_up(points, axis, gauge)[0], axis).axis


def usual_up(points: Array, axis: Array, gauge: Gauge) -> Array:
    """Machine +z, or, for a gauge on end, the direction from its points ``(16, 3)``."""
    return fit_up(points, axis, gauge)[0] if abs(axis[2]) > STANDING_COS else UPWARDS


def rough_axis(points: Array) -> Array:
    """Unit vector between the means of the two blocks' points ``(..., 16, 3)``: the axis to a few mrad."""
    middle = points.reshape(*points.shape[:-2], 2, 8, 3).mean(axis=-2)
    return unit(middle[..., 1, :] - middle[..., 0, :])


def _solve(p: Array, axis: Array, up: Array, size_mm: Array) -> Blocks:
    """The blocks along a given axis: their centres are midway in the directions N, s and up."""
    up = _square(up, axis)

    def along(direction: Array, point: int) -> Array:
        return (p[..., point, :] * direction).sum(axis=-1)

    normal = unit(np.cross(p[..., 1, :] - p[..., 0, :], p[..., 2, :] - p[..., 0, :]))
    normal = normal * np.where(along(normal, 0) < along(normal, 7), -1.0, 1.0)[..., None]
    radius = (along(normal, 0) - along(normal, 7) - size_mm) / 2.0
    u, s = up[..., None, :], np.cross(axis, up)[..., None, :]
    u, s, normal = np.broadcast_arrays(np.concatenate([u, u], axis=-2), s, normal)
    # top and rail are both touched from above, so the tip radius does not cancel there as it does front to back
    height = (along(u, 5) + along(u, 6)) / 2.0 - radius.mean(axis=-1, keepdims=True)
    middle = np.stack([(along(normal, 0) + along(normal, 7)) / 2.0, (along(s, 3) + along(s, 4)) / 2.0, height], axis=-1)
    centre = np.linalg.solve(np.stack([normal, s, u], axis=-2), middle[..., None])[..., 0]
    return Blocks(p, normal, centre, radius, up)


def fit_up(points: Array, axis: Array, gauge: Gauge) -> tuple[Array, float]:
    """The up direction that makes width (points 4, 5) and height (points 6, 7) of both blocks fit the certificate.

    ``points (16, 3)``, ``axis (3,)``. Returns the unit vector and the rms misfit in mm.
    """
    p = points.reshape(2, 8, 3)
    sides, heights = p[:, 3] - p[:, 4], p[:, 5] - p[:, 6]
    start = np.eye(3)[np.argmin(np.abs(axis))]
    start = unit(start - axis * (start @ axis))
    # the width measures two tip radii more, which the size of the blocks along the axis tells
    length = ((p[:, 7] - p[:, 0]) @ axis).mean()
    width = gauge.table.block_width_mm + length - gauge.block_size_mm.mean()

    def turned(angle: NDArray[np.floating]) -> Array:
        return np.cos(angle)[:, None] * start + np.sin(angle)[:, None] * np.cross(axis, start)

    def misfit(angle: NDArray[np.floating]) -> Array:
        up = turned(angle)
        off = [np.cross(axis, up) @ sides.T - width, up @ heights.T - gauge.table.block_height_mm]
        return np.sqrt((np.concatenate(off, axis=1) ** 2).mean(axis=1))

    step = 2.0 * np.pi / ROLL_STEPS
    angles = np.arange(ROLL_STEPS) * step
    for _ in range(6):
        best = angles[int(misfit(angles).argmin())]
        angles, step = best + np.linspace(-step, step, 41), step / 20.0
    nearest = np.array([best])
    return turned(nearest)[0], float(misfit(nearest)[0])

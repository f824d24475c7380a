"""Errors of a stated chain of axes: bodies placed by homogeneous transformations, from the base to the tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause
from benchmarks.blind.scene import Chain, Scene

Array = NDArray[np.float64]
Random = np.random.Generator
AXES = "xyz"


def rotation(axis: int, angle: Array) -> Array:
    """Homogeneous matrices of right-handed rotations about an axis through the origin, shape ``(n, 4, 4)``."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.tile(np.eye(4), (len(angle), 1, 1))
    matrix[:, first, first] = matrix[:, second, second] = np.cos(angle)
    matrix[:, second, first] = np.sin(angle)
    matrix[:, first, second] = -np.sin(angle)
    return matrix


def translation(mm: Array) -> Array:
    """Homogeneous matrices of translations, ``(n, 3)`` to ``(n, 4, 4)``."""
    matrix = np.tile(np.eye(4), (len(mm), 1, 1))
    matrix[:, :3, 3] = mm
    return matrix


def tip_in_workpiece(chain: Chain, tip_mm: Array, turned: tuple[int, int, Array], ways: Array | None = None) -> Array:
    """Where the tip truly is when the scales indicate ``tip_mm``, mm, in the frame of the workpiece.

    ``turned`` are an axis of travel, and the axis and angle (rad) by which its carriage is turned. ``ways`` are the
    directions of the axes as rows; without them they are square.
    """
    travel, about, angle = turned
    ways = np.eye(3) if ways is None else ways
    joints = tip_mm - np.array(chain.stylus_mm)

    def branch(axes: str, sense: float) -> Array:
        frame = np.tile(np.eye(4), (len(tip_mm), 1, 1))
        for axis in (AXES.index(name) for name in axes):
            frame = frame @ translation(sense * joints[:, axis, None] * ways[axis])
            if axis == travel:
                frame = frame @ rotation(about, angle)
        return frame

    tip = np.append(np.array(chain.stylus_mm), 1.0)
    found = np.linalg.solve(branch(chain.table, -1.0), (branch(chain.probe, 1.0) @ tip)[:, :, None])
    return np.asarray(found[:, :3, 0])


def rotation_in_chain(scene: Scene, random: Random, travel: int, about: int) -> Cause:
    """A way of even curvature turns its carriage, and all that the carriage bears: other axes, probe or workpiece."""
    chain, sign = _chain_of(scene), float(random.choice([-1.0, 1.0]))
    bears_probe = AXES[travel] in chain.probe
    grid_m = np.arange(0.0, scene.travel_mm[travel, 1] + 1.0) * 1e-3
    turn = np.r_[0.0, np.cumsum(np.diff(grid_m))]

    def displace(urad_per_m: float) -> Array:
        at_m = scene.centre_mm[:, travel] * 1e-3
        angle = sign * urad_per_m * 1e-6 * np.interp(at_m, grid_m, turn)
        tip = tip_in_workpiece(chain, scene.centre_mm, (travel, about, -angle if bears_probe else angle))
        return (scene.centre_mm - tip) * 1e3

    where = f"{AXES[travel]}/{AXES[about]}"
    return Cause("angular_error", displace, where, lambda k: {"urad_per_m": sign * k}, start=5.0)


def squareness_in_chain(scene: Scene, random: Random, plane: str) -> Cause:
    """The way of the second axis leans towards the first, wherever in the chain it stands."""
    chain, sign = _chain_of(scene), float(random.choice([-1.0, 1.0]))
    first, second = AXES.index(plane[0]), AXES.index(plane[1])

    def displace(urad: float) -> Array:
        angle, ways = sign * urad * 1e-6, np.eye(3)
        ways[second, first], ways[second, second] = -np.sin(angle), np.cos(angle)
        tip = tip_in_workpiece(chain, scene.centre_mm, (0, 0, np.zeros(len(scene))), ways)
        return (scene.centre_mm - tip) * 1e3

    return Cause("squareness", displace, plane, lambda urad: {"urad": sign * urad}, start=5.0)


def _chain_of(scene: Scene) -> Chain:
    if scene.chain is None:
        raise ValueError("the measurement states no chain of axes")
    return scene.chain

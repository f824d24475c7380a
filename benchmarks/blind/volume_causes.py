"""A machine that nobody ever compensated: each carriage of a moving bridge errs in six ways, and no axis is square.

The ways are sums of few long waves and no polynomials, the rotations are matrices and not small angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause
from benchmarks.blind.chain_causes import rotation, translation
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator
BRIDGE = "yxz"
"""From the base to the tip: the bridge travels along y, its carriage along x, its ram along z."""
HALF_WAVES = (1, 2, 3)
"""Half waves over a travel; each has an amplitude in inverse proportion to its number."""
URAD_PER_UM = 3.0
"""Rotations over displacements: a carriage half a metre long turns by some urad where its way is off by one um."""
LEAN_URAD_PER_UM = 6.0


def uncompensated(scene: Scene, random: Random) -> Cause:
    """Six errors of each axis, and three angles between axes, all at once."""
    ways = {axis: [_way(scene, random, "xyz".index(axis)) for _ in range(6)] for axis in BRIDGE}
    lean = random.standard_normal(3) * LEAN_URAD_PER_UM

    def displace(um: float) -> Array:
        return (_tip(scene, ways, lean, um) - scene.centre_mm) * 1e3

    return Cause("geometric_errors", displace)


def _way(scene: Scene, random: Random, axis: int) -> Array:
    """One error of one axis at every touch, of the order one."""
    low, high = scene.travel_mm[axis]
    along = np.pi * (scene.centre_mm[:, axis] - low) / (high - low)
    waves = [np.cos(n * along + random.uniform(0.0, 2.0 * np.pi)) / n for n in HALF_WAVES]
    return np.asarray(random.standard_normal(len(HALF_WAVES)) @ np.array(waves))


def _tip(scene: Scene, ways: dict[str, list[Array]], lean: Array, um: float) -> Array:
    """Where the tip is when the scales indicate the centre of the ball, mm."""
    frame = np.tile(np.eye(4), (len(scene), 1, 1))
    for name in BRIDGE:
        axis = "xyz".index(name)
        along = np.zeros((len(scene), 3))
        along[:, axis] = scene.centre_mm[:, axis]
        along += along[:, axis, None] * _lean(axis, lean, um)
        frame = frame @ translation(along + um * 1e-3 * np.array(ways[name][:3]).T)
        for about in range(3):
            frame = frame @ rotation(about, um * URAD_PER_UM * 1e-6 * ways[name][3 + about])
    return np.asarray(frame[:, :3, 3])


def _lean(axis: int, lean: Array, um: float) -> Array:
    """How far a way leans towards those before it, rad: x is the reference, y leans to x, z to x and y."""
    to = {0: np.zeros(3), 1: np.array([lean[0], 0.0, 0.0]), 2: np.array([lean[1], lean[2], 0.0])}[axis]
    return np.asarray(um * 1e-6 * to)

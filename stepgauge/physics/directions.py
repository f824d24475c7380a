"""Directions about a probe: unit vectors <-> azimuth and elevation, and the patterns in which spheres are probed.

A direction here is the outward surface normal at the contact, which is the direction of the force on the tip; the
approach is its opposite. The pole is the stylus axis, from the tip to the probe body.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array


def probe_frame(stylus_axis: Sequence[float] = (0.0, 0.0, 1.0)) -> Array:
    """Rows x', y', z' of the frame of the probe, (3, 3): z' is the stylus axis, x' machine x made perpendicular to it.

    For a stylus along machine x, x' comes from machine y. Raises ``ValueError`` for an axis that is zero or not finite.
    """
    axis = np.asarray(stylus_axis, dtype=float)
    length = np.linalg.norm(axis)
    if not 0.0 < length < np.inf:
        raise ValueError("the stylus axis has no length")
    z = axis / length
    reference = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = reference - (reference @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def unit_vectors(azimuth_rad: ArrayLike, elevation_rad: ArrayLike) -> Array:
    """Unit vectors (..., 3) of azimuth (from x towards y) and elevation (0 = equator, 90 deg = pole)."""
    azimuth, elevation = np.asarray(azimuth_rad, dtype=float), np.asarray(elevation_rad, dtype=float)
    level = np.cos(elevation)
    return np.stack(np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)), axis=-1)


def angles_rad(direction: ArrayLike) -> tuple[Array, Array]:
    """Azimuth (-pi..pi) and elevation (-pi/2..pi/2) of vectors (..., 3) of any length; azimuth 0 at the poles."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=float), -1, 0)
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def five_points(azimuth_rad: float = 0.0) -> Array:
    """Four points on the equator, 90 deg apart from ``azimuth_rad`` on, and the pole, (5, 3) (Wozniak, section 4)."""
    equator = unit_vectors(azimuth_rad + np.pi / 2.0 * np.arange(4), 0.0)
    return np.vstack([equator, [0.0, 0.0, 1.0]])


def iso_10360_5_points(azimuth_rad: float = 0.0) -> Array:
    """The 25 points recommended by ISO 10360-5 for the probing form error, (25, 3).

    One on the pole; 4 points 22.5 deg below it; 8 at 45 deg, turned by 22.5 deg against those; 4 at 67.5 deg, turned
    by 22.5 deg; 8 on the equator, turned by 22.5 deg.
    """
    rings = [np.array([[0.0, 0.0, 1.0]])]
    for ring, count in enumerate((4, 8, 4, 8), start=1):
        azimuths = azimuth_rad + (ring - 1) * np.radians(22.5) + 2.0 * np.pi * np.arange(count) / count
        rings.append(unit_vectors(azimuths, np.pi / 2.0 - ring * np.radians(22.5)))
    return np.vstack(rings)


def nine_degree_points(repeats: int = 5) -> Array:
    """Wozniak's grid: every 9 deg of azimuth and of elevation from 0 to 81 deg, (400 * repeats, 3).

    The paper states the step, the five repeats and the total of 2000; 40 azimuths at 10 elevations give this total.
    """
    azimuth, elevation = np.meshgrid(np.radians(9.0 * np.arange(40)), np.radians(9.0 * np.arange(10)))
    return np.tile(unit_vectors(azimuth.ravel(), elevation.ravel()), (repeats, 1))


def evenly_spread_points(count: int) -> Array:
    """``count`` points spread evenly over the upper half sphere along a golden spiral, (count, 3)."""
    height = 1.0 - (np.arange(count) + 0.5) / count
    return unit_vectors(np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count), np.arcsin(height))

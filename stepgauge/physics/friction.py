"""Friction in a probing: of the tip on the surface (Wozniak's mu) and of the arms in their seats (mu_g).

Both are Coulomb friction, fully mobilised against the motion that the contact imposes; with coefficients of zero both
give the frictionless statics of :mod:`stepgauge.physics.trigger`. Wozniak names the two coefficients and
the friction moments of the two supports that stay closed, M_FB and M_FC (A. Wozniak, Simple method of 3D error
compensation of triggering probes, section 2, symbols of Eq 3); his Eq 3 is not legible in the available copies,
so the equations here are derived from the equilibrium.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics.trigger import (
    DOWN,
    Tripod,
    contact_normals,
    contact_points_mm,
    force_from_exhaustion,
    load_wrench,
    unit_forces,
    unloaded,
    wrench,
)

# The cone of friction is replaced by a pyramid of this many edges with the same area of cross-section.
_RING = 12
_RING_RADIUS = float(np.sqrt(2.0 * np.pi / (_RING * np.sin(2.0 * np.pi / _RING))))


def tip_force_direction(normal: ArrayLike, mu: float, compliance_ratio: float = 0.0) -> Array:
    """Direction (..., 3) of the force on a tip that drags over the surface with the normal (..., 3).

    The stylus bends laterally, so the tip slides along the surface; friction inclines the force against this motion,
    towards the stylus axis, by the friction angle atan(mu) at most. It does not go beyond the direction at which the
    tip sticks: there the tip follows the machine, and the force has the polar angle atan(ratio tan(polar)).

    Parameters
    ----------
    mu : coefficient of friction between tip and surface, >= 0 (Wozniak's mu)
    compliance_ratio : axial over lateral compliance of the stylus, 0 for a stylus that cannot be compressed
    """
    n = np.asarray(normal, dtype=float)
    level, along = np.hypot(n[..., 0], n[..., 1]), np.abs(n[..., 2])
    polar = np.arctan2(level, along)
    # On a wall along the stylus the tip does not slide at all: the limit of a stylus that can be compressed a little.
    sticking = np.where(along == 0.0, polar, np.arctan2(compliance_ratio * level, along))
    leaning = np.maximum(polar - np.arctan(mu), np.minimum(sticking, polar))
    sideways = np.sin(leaning) / np.where(level > 0.0, level, 1.0)
    return np.stack([n[..., 0] * sideways, n[..., 1] * sideways, np.copysign(np.cos(leaning), n[..., 2])], axis=-1)


def trigger_force_N(
    tripod: Tripod,
    direction: ArrayLike,
    mu_g: float,
    arm_radius_mm: float = 0.0,
    down: ArrayLike = DOWN,
) -> Array:
    """Largest force on the tip, (...), that the seat holds with friction of arms and balls; beyond it a contact opens.

    Reactions may be inclined against the motion by the angle of friction. The wrenches that six such contacts can
    balance form a convex cone; the result is the largest force that, with the load, is still in it. The faces of the
    cone depend neither on load nor on direction, so that once they are known a direction costs as much as without
    friction. Without friction the cone has six faces, the six motions that open one contact, and the force is the
    frictionless one.

    Since friction leaves the reactions undetermined, this is the upper end: the first contact may open earlier, down to
    the frictionless force, if friction is not fully mobilised.

    Parameters
    ----------
    direction : (..., 3) unit vectors of the force on the tip
    mu_g : coefficient of friction in the seats, >= 0
    arm_radius_mm : radius of the arms: distance of the points of contact from the axis of the arm (half of Wozniak's
        d_3)
    down : direction of gravity in the probe's frame

    Raises
    ------
    ValueError : if the seat is self-locking, for mu_g of tan(contact angle) and more
    """
    faces = _faces(unloaded(tripod), mu_g, arm_radius_mm)
    closed = -faces @ load_wrench(tripod, down)
    opened = faces @ _opening_load(tripod)
    slopes = -unit_forces(tripod.lever_mm) @ faces.T
    return force_from_exhaustion(direction, slopes, closed - opened)


def _opening_load(tripod: Tripod) -> Array:
    """The wrench of six reactions of the forces at which the contacts count as open."""
    least = tripod.opening_N[:, None] * contact_normals(tripod)
    total: Array = wrench(least, contact_points_mm(tripod)).sum(axis=0)
    return total


@lru_cache(maxsize=64)
def _faces(geometry: Tripod, mu_g: float, arm_radius_mm: float) -> Array:
    """Motions (faces, 6) in which none of the inclined reactions has positive power: the faces of their cone.

    ``geometry`` is a seat without load; do not write to the array. All inclined reactions push upwards, so the cone is
    cut at one unit of upward force, which gives a polytope. Arms that meet in one point make it degenerate; moving its
    corners by rounding errors (Qhull's QJ) removes this.
    """
    points_mm = contact_points_mm(geometry)
    edges = _leaning_reactions(contact_normals(geometry), points_mm, mu_g, arm_radius_mm)
    if np.any(edges[:, 2] <= 1e-9):
        raise ValueError(f"the seat jams with a coefficient of friction of {mu_g:g}")
    from scipy.spatial import ConvexHull  # takes longer to import than a path to plan, which needs none

    reach = float(np.linalg.norm(points_mm, axis=1).max())
    scale = np.array([1.0, 1.0, 1.0, reach, reach, reach])
    flat = np.delete(edges / scale / edges[:, 2:3], 2, axis=1)
    planes = ConvexHull(flat, qhull_options="QJ Pp").equations
    faces = np.asarray(-np.insert(planes[:, :5], 2, planes[:, 5], axis=1) / scale, float)
    faces.flags.writeable = False
    return faces


def _leaning_reactions(normals: Array, points_mm: Array, mu_g: float, arm_radius_mm: float) -> Array:
    """Wrenches (n, 6) of unit reactions inclined by the angle of friction, a ring of them for each contact."""
    touching = points_mm - arm_radius_mm * normals
    if mu_g == 0.0:
        return wrench(normals, touching)
    around = 2.0 * np.pi * np.arange(_RING) / _RING
    level = np.cross(normals, [0.0, 0.0, 1.0])
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    upwards = np.cross(level, normals)
    ring = np.cos(around)[:, None, None] * level + np.sin(around)[:, None, None] * upwards
    return wrench(normals + mu_g * _RING_RADIUS * ring, np.broadcast_to(touching, ring.shape)).reshape(-1, 6)

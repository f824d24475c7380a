"""Statics of a kinematic probe: a tripod on six contacts, a spring on it, a force at the tip.

Three arms, 120 deg apart, lie each on two balls. Six frictionless contacts constrain six degrees of freedom, so that
the equilibrium of the rigid tripod alone gives the six reactions, without stiffness and without iteration. The probe
triggers when the first reaction falls to the force at which its contact opens (zero, unless stated otherwise).

All vectors are in the frame of the probe: origin where the probe axis meets the plane of the arms, z from the tip
towards the probe body, so that the tip is at (0, 0, -lever). A ``direction`` is a unit vector (..., 3) of the force on
the tip; without friction it is the outward normal of the touched surface, the opposite of the approach. Its polar angle
counts from z (90 deg = perpendicular to the stylus, 0 = the surface pushes the stylus into the probe), its azimuth from
x towards y. Contact 2 k and contact 2 k + 1 carry arm k, the first on its clockwise side seen from the body.

Sources: M. Rodrigues, An accurate on-machine surfaces measurement using FEA method, Concordia University 2021, sections
2.7 to 2.9 and Tables 3.1, 4.1-4.9 (its "existing method"); G. Ren et al. 2020, section 3 and Fig 5, for the load K and
its eccentricity t. The equations themselves are the six of statics.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.files.arrays import Array

ARMS = 3
CONTACTS = 6
DOWN = (0.0, 0.0, -1.0)
"""Direction of gravity in the frame of a probe with its tip down."""

# A direction whose load on the best contact is this small a part of the largest possible never opens a contact.
_NEVER = 1e-12
# Numbers in one block of work, half a megabyte.
_BLOCK = 65536


@dataclass(frozen=True)
class Tripod:
    """Geometry and load of the seat; every number may be changed with :func:`dataclasses.replace`.

    Attributes
    ----------
    preload_N : spring force, parallel to the axis and towards the tip
    contact_radius_mm : from the axis to the contacts
    contact_angle_rad : of the contact normals above the plane of the arms, inside (0, pi/2)
    lever_mm : from the plane of the arms to the tip centre
    arm_azimuth_rad : azimuth of the first arm; a lateral force along an arm is the smallest, or nearly so, that
        triggers
    preload_offset_mm : x and y of the spring's line of action
    weight_N : weight of all parts that move with the tripod
    weight_depth_mm : depth of its centre of mass below the plane of the arms
    opening_force_N : reaction at which a contact counts as open, one for all or one for each of the six

    Raises
    ------
    ValueError : for values that do not make a seat
    """

    preload_N: float
    contact_radius_mm: float
    contact_angle_rad: float
    lever_mm: float
    arm_azimuth_rad: float = 0.0
    preload_offset_mm: tuple[float, float] = (0.0, 0.0)
    weight_N: float = 0.0
    weight_depth_mm: float = 0.0
    opening_force_N: float | tuple[float, ...] = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.contact_angle_rad < np.pi / 2.0:
            raise ValueError("contact normals lie between the plane of the arms and the axis")
        if self.contact_radius_mm <= 0.0:
            raise ValueError("contacts on the axis hold no moment")
        if self.preload_N < 0.0 or np.min(self.opening_force_N) < 0.0 or self.weight_N < 0.0:
            raise ValueError("forces of the seat are not negative")

    @property
    def opening_N(self) -> Array:
        """Reaction at which each contact counts as open, (6,)."""
        return np.broadcast_to(self.opening_force_N, CONTACTS).astype(float)


def contact_points_mm(tripod: Tripod) -> Array:
    """Where the contact normals meet the axes of the arms, (6, 3)."""
    azimuth = tripod.arm_azimuth_rad + 2.0 * np.pi / ARMS * np.repeat(np.arange(ARMS), 2)
    return tripod.contact_radius_mm * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(CONTACTS)], axis=-1)


def contact_normals(tripod: Tripod) -> Array:
    """Unit vectors from the balls into the arms, the directions of the reactions, (6, 3)."""
    radial = contact_points_mm(tripod) / tripod.contact_radius_mm
    sideways = np.stack([-radial[:, 1], radial[:, 0], radial[:, 2]], axis=-1)
    side = np.tile([1.0, -1.0], ARMS)[:, None]
    upwards = np.array([0.0, 0.0, np.sin(tripod.contact_angle_rad)])
    return side * np.cos(tripod.contact_angle_rad) * sideways + upwards


def wrench(force_N: ArrayLike, point_mm: ArrayLike) -> Array:
    """Force and its moment about the origin as one vector (..., 6): N and N mm."""
    force, point = np.asarray(force_N, dtype=float), np.asarray(point_mm, dtype=float)
    found = np.empty((*np.broadcast_shapes(force.shape, point.shape)[:-1], 6))
    found[..., :3] = force
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1)), 3):
        found[..., i] = point[..., j] * force[..., k] - point[..., k] * force[..., j]
    return found


def opening_twists(tripod: Tripod) -> Array:
    """The motion that opens each contact by one unit while the other five stay closed, (6, 6).

    Row i holds velocity and angular velocity of the tripod. The rows are the inverse of the matrix of unit reactions:
    the reaction of contact i is minus the power of all other forces in motion i (virtual work).
    """
    return _opening_twists(unloaded(tripod))


def unloaded(tripod: Tripod) -> Tripod:
    """The seat without load and lever: results that depend on the seat alone are computed once for it."""
    return Tripod(1.0, tripod.contact_radius_mm, tripod.contact_angle_rad, 1.0, tripod.arm_azimuth_rad)


@lru_cache(maxsize=64)
def _opening_twists(geometry: Tripod) -> Array:
    """Of an :func:`unloaded` seat; do not write to the array."""
    unit_reactions = wrench(contact_normals(geometry), contact_points_mm(geometry))
    twists = np.asarray(np.linalg.inv(unit_reactions.T), dtype=np.float64)
    twists.flags.writeable = False
    return twists


def load_wrench(tripod: Tripod, down: ArrayLike = DOWN) -> Array:
    """Spring and weight as a wrench (6,); ``down`` is the unit vector of gravity in the probe's frame."""
    spring = wrench([0.0, 0.0, -tripod.preload_N], [*tripod.preload_offset_mm, 0.0])
    if tripod.weight_N == 0.0:
        return spring
    weight = tripod.weight_N * np.asarray(down, dtype=float)
    return spring + wrench(weight, [0.0, 0.0, -tripod.weight_depth_mm])


def rest_reactions_N(tripod: Tripod, down: ArrayLike = DOWN) -> Array:
    """The six reactions before contact, (6,); a negative one means that the probe does not stay in its seat."""
    return -opening_twists(tripod) @ load_wrench(tripod, down)


def reaction_slopes(tripod: Tripod, direction: ArrayLike) -> Array:
    """Change of each reaction per newton at the tip, (..., 6); where it is negative, the force opens the contact."""
    return np.asarray(direction, dtype=float) @ _slope_matrix(opening_twists(tripod), tripod.lever_mm)


def reactions_N(tripod: Tripod, force_N: ArrayLike, down: ArrayLike = DOWN) -> Array:
    """The six reactions under a force on the tip (..., 3) in N, (..., 6); a negative one would be tensile."""
    return rest_reactions_N(tripod, down) + reaction_slopes(tripod, force_N)


def trigger_force_N(tripod: Tripod, direction: ArrayLike, down: ArrayLike = DOWN) -> Array:
    """Force on the tip at which the first contact opens, (...).

    ``inf`` where no force of this direction opens a contact (pulling the stylus out of the probe body); 0 everywhere
    if the probe is open before contact.
    """
    closed = rest_reactions_N(tripod, down) - tripod.opening_N
    return force_from_exhaustion(direction, _slope_matrix(opening_twists(tripod), tripod.lever_mm), closed)


def opening_contact(tripod: Tripod, direction: ArrayLike, down: ArrayLike = DOWN) -> NDArray[np.int64]:
    """Number 0-5 of the contact that opens first, (...); -1 where none opens."""
    closed = rest_reactions_N(tripod, down) - tripod.opening_N
    slopes = reaction_slopes(tripod, direction)
    if np.any(closed <= 0.0):
        return np.full(slopes.shape[:-1], int(np.argmin(closed)))
    used = -slopes / closed
    return np.where(used.max(axis=-1) > _least_use(used), used.argmax(axis=-1), -1)


def force_from_exhaustion(direction: ArrayLike, slope_matrix: Array, closed_N: Array) -> Array:
    """Force (...) that reduces the first of the forces ``closed_N`` (n,) to zero at the rates ``slope_matrix`` (3, n).

    One product and one maximum for any number of directions, so that maps of a million directions are fast.
    """
    directions = np.asarray(direction, dtype=float)
    if np.any(closed_N <= 0.0):
        return np.zeros(directions.shape[:-1])
    share = -slope_matrix / closed_N
    most = _most_used(directions.reshape(-1, 3), share).reshape(directions.shape[:-1])
    opens = most > _least_use(share)
    return np.where(opens, 1.0 / np.where(opens, most, 1.0), np.inf)


def _most_used(directions: Array, share: Array) -> Array:
    """Row maxima of directions (m, 3) times share (3, n), in blocks that stay in the cache."""
    rows = max(_BLOCK // share.shape[1], 1)
    most = np.empty(len(directions))
    for start in range(0, len(directions), rows):
        part = slice(start, start + rows)
        np.max(directions[part] @ share, axis=-1, out=most[part])
    return most


def _least_use(share: Array) -> float:
    return _NEVER * float(np.abs(share).max(initial=0.0))


def _slope_matrix(twists: Array, lever_mm: float) -> Array:
    """Matrix (3, n) that takes a force at the tip to minus its power in each twist (n, 6)."""
    return -unit_forces(lever_mm) @ twists.T


@lru_cache(maxsize=64)
def unit_forces(lever_mm: float) -> Array:
    """Wrenches (3, 6) of unit forces at the tip; do not write to the array."""
    found = wrench(np.eye(3), [0.0, 0.0, -lever_mm])
    found.flags.writeable = False
    return found

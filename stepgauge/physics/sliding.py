"""How the probe tip slides while the spindle is fed into a surface (Rodrigues 2021, chapter 3).

A stylus bends laterally only; the spindle is fed against the surface normal. On a wall parallel to the stylus both
directions are the same; on an inclined or curved surface the tip slides, and the deflection of the stylus is larger
than the feed. The feed is divided into sub-processes: after each, the ball is tangent to the surface again, with its
centre on the ray from the position of the unbent stylus along the last deflection direction.

Positions are those of the tip centre: the spindle is higher by the stylus length, along ``stylus_axis`` (tip to
spindle).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.files.arrays import Array
from stepgauge.physics.surfaces import Surface, fundamental_forms, unit_normal

SensingDistance = Callable[[Array], Array]

_NEWTON_STEPS = 25
_HALVINGS = 8
# The tangency is met when ball and surface agree to this fraction of the coordinates, a few times their rounding.
_TOLERANCE = 1e-12
# A normal nearer to the stylus axis than this (rad) has no deflection direction in floating point.
_AXIAL = 1e-7


class Tangency(NamedTuple):
    """A ball touching a surface: surface parameters and distance t of its centre along the ray, in mm."""

    u: Array
    v: Array
    t_mm: Array


@dataclass(frozen=True)
class SlidePath:
    """The slide of n probings over k = 0..K sub-processes; index 0 is the first contact.

    Attributes
    ----------
    feed_mm : (K + 1,) spindle travel since first contact
    deflection_mm : (K + 1, n) lateral deflection d_s of the stylus (Eq 3.7)
    centre_mm, contact_mm, normal : (K + 1, n, 3) tip centre, contact point, outward surface normal there
    u, v : (K + 1, n) surface parameters of the contact
    """

    feed_mm: Array
    deflection_mm: Array
    centre_mm: Array
    contact_mm: Array
    normal: Array
    u: Array
    v: Array

    @property
    def sliding_mm(self) -> Array:
        """(K + 1, n) path of the contact point over the surface since first contact."""
        steps = np.linalg.norm(np.diff(self.contact_mm, axis=0), axis=-1)
        return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


class Trigger(NamedTuple):
    """Where the probe triggers, one entry per probing; NaN (and sub-process -1) where it did not within the path.

    ``feed_mm`` is interpolated between sub-processes, ``subprocess`` is the thesis' k, the first at or past the
    trigger, ``deflection_mm`` the sensing distance d_sd, ``spindle_mm`` (n, 3) the tip centre of the unbent stylus,
    which the machine latches.
    """

    feed_mm: Array
    subprocess: NDArray[np.int64]
    deflection_mm: Array
    spindle_mm: Array


def inclined_deflection_mm(feed_mm: ArrayLike, polar_rad: ArrayLike) -> Array:
    """Lateral deflection on a plane, d_s = d_f / sin(polar) (Rodrigues Eq 3.2, with theta = 90 deg - polar).

    ``polar_rad`` is the angle between the surface normal and the stylus axis; 90 deg is a wall, where d_s = d_f.
    Raises ``ValueError`` outside 0 < polar < 180 deg: a surface perpendicular to the axis does not bend the stylus.
    """
    sine = np.sin(np.asarray(polar_rad, dtype=float))
    if np.any(sine <= _AXIAL):
        raise ValueError("the normal lies along the stylus axis: the stylus is not bent, the probe triggers axially")
    return np.asarray(feed_mm, dtype=float) / sine


def slide(
    surface: Surface,
    u: ArrayLike,
    v: ArrayLike,
    tip_radius_mm: float,
    feed_step_mm: float = 0.001,
    subprocesses: int = 20,
    stylus_axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> SlidePath:
    """Feed the spindle against the normal at (u, v) and follow the tip (Rodrigues Eqs 3.5-3.35 and 4.12-4.13).

    Parameters
    ----------
    surface : the part
    u, v : parameters of the target points, scalars or arrays of n
    tip_radius_mm : radius of the tip ball
    feed_step_mm : d_f, spindle travel per sub-process
    subprocesses : K
    stylus_axis : from the tip to the spindle

    Raises
    ------
    ValueError : a target's normal lies along the stylus axis, the ball does not fit into the surface, or no tangent
        position exists (the surface ends or turns away).
    """
    start_u, start_v = (np.atleast_1d(part).astype(float) for part in np.broadcast_arrays(u, v))
    start = Tangency(start_u, start_v, np.zeros(len(start_u)))
    axis = np.asarray(stylus_axis, dtype=float) / np.linalg.norm(stylus_axis)
    first_normal = surface.normal(start.u, start.v)
    touch = surface.point_mm(start.u, start.v) + tip_radius_mm * first_normal
    _check_fit(surface, start, tip_radius_mm)
    states = [start]
    normals = [first_normal]
    for k in range(1, subprocesses + 1):
        ray = _Ray(
            touch - (k - 1) * feed_step_mm * first_normal,
            -feed_step_mm * first_normal,
            deflection_direction(normals[-1], axis),
        )
        states.append(_follow(surface, tip_radius_mm, ray, states[-1]))
        normals.append(surface.normal(states[-1].u, states[-1].v))
    return _slide_path(surface, tip_radius_mm, feed_step_mm, states, normals)


def deflection_direction(normal: Array, stylus_axis: Array) -> Array:
    """Unit vector V of the deflection of the stylus: the normal without its component along the axis (Eqs 3.27, 3.28).

    The thesis' Eq 3.27 subtracts the whole scalar product from each component; its Eqs 3.9 and 4.25 show that the
    axial component is meant. Raises ``ValueError`` for a normal along the axis.
    """
    lateral = normal - np.sum(normal * stylus_axis, axis=-1, keepdims=True) * stylus_axis
    length = np.linalg.norm(lateral, axis=-1, keepdims=True)
    if np.any(length <= _AXIAL):
        raise ValueError("the normal lies along the stylus axis: the stylus is not bent, the probe triggers axially")
    return lateral / length


def trigger_point(path: SlidePath, sensing_distance_mm: SensingDistance) -> Trigger:
    """The spindle travel at which the deflection reaches the probe's sensing distance (Rodrigues section 3.4.1).

    ``sensing_distance_mm`` takes unit contact normals (..., 3) (the directions of the force on the tip) and returns
    the lateral deflection (...) at which the probe triggers under a force in that direction.
    """
    needed = np.asarray(sensing_distance_mm(path.normal), dtype=float)
    margin = path.deflection_mm - needed
    reached = margin >= 0.0
    found = reached.any(axis=0)
    k = np.argmax(reached, axis=0)
    columns = np.arange(len(k))
    before = np.maximum(k - 1, 0)
    below, above = margin[before, columns], margin[k, columns]
    share = np.divide(-below, above - below, out=np.zeros_like(below), where=above > below)
    feed = np.where(found, path.feed_mm[before] + share * (path.feed_mm[k] - path.feed_mm[before]), np.nan)
    deflection = needed[before, columns] + share * (needed[k, columns] - needed[before, columns])
    spindle = path.centre_mm[0] - feed[:, None] * path.normal[0]
    return Trigger(feed, np.where(found, k, -1), np.where(found, deflection, np.nan), spindle)


def target_point_mm(
    spindle_mm: ArrayLike, approach: ArrayLike, feed_at_trigger_mm: ArrayLike, tip_radius_mm: float
) -> Array:
    """The target point from the latched position, T_0 = S_t + (r - k d_f) N_0(in) (Rodrigues Eq 3.36).

    Parameters
    ----------
    spindle_mm : (..., 3) latched position of the tip centre of the unbent stylus (the thesis omits the stylus length
        here)
    approach : (..., 3) unit vector of travel towards the surface, N_0(in)
    feed_at_trigger_mm : (...) k d_f, spindle travel between first contact and trigger
    """
    beyond = tip_radius_mm - np.asarray(feed_at_trigger_mm, dtype=float)
    return np.asarray(spindle_mm, dtype=float) + beyond[..., None] * np.asarray(approach, dtype=float)


class _Ray(NamedTuple):
    """Possible positions of the tip centre after a sub-process: start + share * feed + t * direction."""

    start: Array
    feed: Array
    direction: Array


def _check_fit(surface: Surface, at: Tangency, radius_mm: float) -> None:
    """A hollow narrower than the ball has two points of contact: there is no single one to follow."""
    if np.any(1.0 + radius_mm * surface.curvatures_per_mm(at.u, at.v) <= 0.0):
        raise ValueError(f"{surface.name}: the hollow is narrower than the tip of radius {radius_mm} mm")


def _follow(surface: Surface, radius_mm: float, ray: _Ray, guess: Tangency) -> Tangency:
    """One sub-process, in one step or, where Newton's method does not converge, in 2, 4, 8... smaller ones."""
    for halving in range(_HALVINGS):
        state = _follow_in_steps(surface, radius_mm, ray, guess, 2**halving)
        if state is not None:
            _check_fit(surface, state, radius_mm)
            return state
    raise ValueError(
        f"{surface.name}: the tip finds no tangent position beside the feed; the surface ends or turns away"
    )


def _follow_in_steps(surface: Surface, radius_mm: float, ray: _Ray, guess: Tangency, count: int) -> Tangency | None:
    state = guess
    for share in np.arange(1, count + 1) / count:
        found = _touch(surface, radius_mm, ray.start + share * ray.feed, ray.direction, state)
        if found is None:
            return None
        state = found
    return state


def _touch(surface: Surface, radius_mm: float, origin: Array, direction: Array, guess: Tangency) -> Tangency | None:
    """Newton's method on S1(u, v) + r N(u, v) = P + t V (Eq 3.19 with corrected signs, u2, v2, lambda eliminated).

    The point of contact of the ball is opposite to the outward normal, so that the centre lies r outward of the
    contact. Returns None where it does not converge.
    """
    u, v, t = guess
    tolerance_mm = _TOLERANCE * max(1.0, radius_mm, float(np.abs(origin).max()))
    for _ in range(_NEWTON_STEPS):
        try:
            gap, jacobian = _gap(surface, radius_mm, origin, direction, Tangency(u, v, t))
            step = np.linalg.solve(jacobian, gap[..., None])[..., 0]
        except (np.linalg.LinAlgError, ValueError):
            return None
        u, v, t = u - step[:, 0], v - step[:, 1], t - step[:, 2]
        # The step before last leaves an error far below what the residual can show: test the residual, not the step.
        if np.all(np.linalg.norm(gap, axis=-1) <= tolerance_mm):
            return Tangency(u, v, t)
    return None


def _gap(surface: Surface, radius_mm: float, origin: Array, direction: Array, at: Tangency) -> tuple[Array, Array]:
    """Distance of the two surfaces at matching normals, (n, 3), and its derivatives by (u, v, t), (n, 3, 3)."""
    jet = surface.at(at.u, at.v)
    normal = unit_normal(jet, surface.outward, surface.name)
    first, second = fundamental_forms(jet, normal)
    tangents = np.stack([jet.du, jet.dv], axis=-1)
    # Weingarten: the normal turns by -(first form)^-1 (second form) times the tangents.
    offset_tangents = tangents - radius_mm * tangents @ np.linalg.solve(first, second)
    gap = jet.point + radius_mm * normal - origin - at.t_mm[:, None] * direction
    return gap, np.concatenate([offset_tangents, -direction[..., None]], axis=-1)


def _slide_path(
    surface: Surface, radius_mm: float, feed_step_mm: float, states: Sequence[Tangency], normals: Sequence[Array]
) -> SlidePath:
    u, v, t = (np.stack([state[i] for state in states]) for i in range(3))
    contact, normal = surface.point_mm(u, v), np.stack(normals)
    feed = feed_step_mm * np.arange(float(len(states)))
    return SlidePath(feed, t, contact + radius_mm * normal, contact, normal, u, v)

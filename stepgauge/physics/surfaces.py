"""Parametric surfaces r(u, v): points, derivatives, outward normals and curvatures.

A surface is defined by its jet: the point and its first and second partial derivatives. The shapes here have them in
closed form; :func:`make_surface` takes them from any r(u, v) by finite differences; :func:`transformed` carries a
surface by a rigid motion. All functions accept scalar or array parameters that broadcast together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array

PointFunction = Callable[[Array, Array], ArrayLike]

# A normal this short against the product of its two tangents has no usable direction (pole of a sphere).
_SINGULAR = 1e-9

# Fourth-order central differences: offsets in steps, weights of the first and of the second derivative.
_OFFSETS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
_FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
_SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12.0


class SurfaceDerivatives(NamedTuple):
    """A surface point (..., 3) in mm and its partial derivatives in mm per unit of the parameters."""

    point: Array
    du: Array
    dv: Array
    duu: Array
    duv: Array
    dvv: Array


@dataclass(frozen=True)
class Surface:
    """A surface given by its jet.

    Parameters
    ----------
    name : what it is, for messages
    jet : (u, v) -> :class:`SurfaceDerivatives`; u and v are arrays of one shape
    outward : +1 where r_u x r_v points out of the material, -1 where it points into it
    """

    name: str
    jet: Callable[[Array, Array], SurfaceDerivatives]
    outward: int = 1

    def at(self, u: ArrayLike, v: ArrayLike) -> SurfaceDerivatives:
        """The jet at parameters ``u``, ``v`` (broadcast together)."""
        u_array, v_array = np.broadcast_arrays(np.asarray(u, dtype=float), np.asarray(v, dtype=float))
        return self.jet(u_array, v_array)

    def point_mm(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points of the surface, shape (..., 3), in mm."""
        return self.at(u, v).point

    def normal(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Unit normals out of the material, shape (..., 3) (Rodrigues Eqs 3.25 and 3.26).

        Raises ``ValueError`` at a singular point of the parameters, where r_u x r_v vanishes.
        """
        return unit_normal(self.at(u, v), self.outward, self.name)

    def curvatures_per_mm(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Principal curvatures, shape (..., 2), smaller first, in 1/mm; positive where the material is convex."""
        jet = self.at(u, v)
        normal = unit_normal(jet, self.outward, self.name)
        first, second = fundamental_forms(jet, normal)
        shape = -np.linalg.solve(first, second)
        mean = (shape[..., 0, 0] + shape[..., 1, 1]) / 2.0
        gauss = np.linalg.det(shape)
        spread = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return np.stack([mean - spread, mean + spread], axis=-1)


def unit_normal(jet: SurfaceDerivatives, outward: int, name: str = "surface") -> Array:
    """Unit normal of a jet, shape (..., 3); ``ValueError`` where the parametrisation is singular."""
    cross = outward * np.cross(jet.du, jet.dv)
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    largest = np.linalg.norm(jet.du, axis=-1) ** 2 + np.linalg.norm(jet.dv, axis=-1) ** 2
    if np.any(length[..., 0] <= _SINGULAR * largest):
        raise ValueError(f"{name}: the parameters are singular here; turn the surface so that its pole lies elsewhere")
    return cross / length


def fundamental_forms(jet: SurfaceDerivatives, normal: Array) -> tuple[Array, Array]:
    """First and second fundamental form, shape (..., 2, 2) each."""
    first = np.stack([_dots(jet.du, jet.du, jet.dv), _dots(jet.dv, jet.du, jet.dv)], axis=-2)
    second = np.stack([_dots(normal, jet.duu, jet.duv), _dots(normal, jet.duv, jet.dvv)], axis=-2)
    return first, second


def _dots(a: Array, *others: Array) -> Array:
    return np.stack([np.sum(a * b, axis=-1) for b in others], axis=-1)


def plane(origin_mm: Sequence[float] = (0.0, 0.0, 0.0), normal: Sequence[float] = (0.0, 0.0, 1.0)) -> Surface:
    """A plane through ``origin_mm``; ``normal`` points out of the material, u and v are mm along it."""
    n = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    # Any tangent will do; the coordinate axis farthest from the normal gives the best conditioned one.
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    first /= np.linalg.norm(first)
    second = np.cross(n, first)
    origin = np.asarray(origin_mm, dtype=float)

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """Constant tangents; all second derivatives are zero."""
        flat = np.zeros((*u.shape, 3))
        return SurfaceDerivatives(
            origin + u[..., None] * first + v[..., None] * second, flat + first, flat + second, flat, flat, flat
        )

    return Surface("plane", jet)


def ellipsoid(a_mm: float, b_mm: float, c_mm: float) -> Surface:
    """An ellipsoid about the origin, r = (a cos u sin v, b sin u sin v, c cos v) (Rodrigues Eq 4.14).

    The outward normal is the cross product of the derivatives, (b c cos u sin^2 v, a c sin u sin^2 v,
    a b sin v cos v); the thesis' Eq 4.18 prints a^2, b^2, c^2 there, which holds for the sphere only.
    """
    axes = np.array([a_mm, b_mm, c_mm], dtype=float)

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """Products of sines and cosines of u and v, times the semi-axes."""
        cu, su, cv, sv, zero = np.cos(u), np.sin(u), np.cos(v), np.sin(v), np.zeros_like(u)
        rows = (
            (cu * sv, su * sv, cv),
            (-su * sv, cu * sv, zero),
            (cu * cv, su * cv, -sv),
            (-cu * sv, -su * sv, zero),
            (-su * cv, cu * cv, zero),
            (-cu * sv, -su * sv, -cv),
        )
        return SurfaceDerivatives(*(axes * np.stack(row, axis=-1) for row in rows))

    return Surface("ellipsoid", jet, outward=-1)


def sphere(radius_mm: float) -> Surface:
    """A ball about the origin, with azimuth u and polar angle v."""
    return Surface("sphere", ellipsoid(radius_mm, radius_mm, radius_mm).jet, outward=-1)


def cylinder(radius_mm: float) -> Surface:
    """A shaft about the z axis, r = (R cos u, R sin u, v); turn ``outward`` for a bore with :func:`inside_out`."""

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """A circle in u, a straight line in v."""
        cu, su, zero = radius_mm * np.cos(u), radius_mm * np.sin(u), np.zeros_like(u)
        flat, along = np.stack([zero] * 3, axis=-1), np.stack([zero, zero, zero + 1.0], axis=-1)
        return SurfaceDerivatives(
            np.stack([cu, su, v], axis=-1),
            np.stack([-su, cu, zero], axis=-1),
            along,
            np.stack([-cu, -su, zero], axis=-1),
            flat,
            flat,
        )

    return Surface("cylinder", jet)


def paraboloid(a_mm: float, b_mm: float) -> Surface:
    """The convex surface r = (a u, a v, -b (u^2 + v^2)), material below (Rodrigues Eq 4.1, second component corrected).

    The curvature at its top is 2 b / a^2; a negative ``b_mm`` gives a hollow.
    """

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """Parabolas in u and in v; the second derivatives are constant."""
        zero, one = np.zeros_like(u), np.ones_like(u)
        flat, down = np.stack([zero] * 3, axis=-1), np.stack([zero, zero, -2.0 * b_mm * one], axis=-1)
        return SurfaceDerivatives(
            np.stack([a_mm * u, a_mm * v, -b_mm * (u**2 + v**2)], axis=-1),
            np.stack([a_mm * one, zero, -2.0 * b_mm * u], axis=-1),
            np.stack([zero, a_mm * one, -2.0 * b_mm * v], axis=-1),
            down,
            flat,
            down,
        )

    return Surface("paraboloid", jet)


def make_surface(function: PointFunction, step: float = 1e-3, outward: int = 1, name: str = "surface") -> Surface:
    """A surface from any smooth r(u, v); its derivatives are taken by central differences of fourth order.

    Parameters
    ----------
    function : (u, v) -> points of shape (..., 3) in mm, for arrays u and v of one shape
    step : difference step in units of u and v. With parameters that change the surface over lengths of about 1, the
        first derivatives are good to about 1e-12 of the size of r, the second to about 1e-9.
    outward : +1 where r_u x r_v points out of the material, -1 where it points into it
    """
    moves = step * _OFFSETS

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """Differences on a 5 x 5 grid about each place."""
        grid_u, grid_v = u[..., None, None] + moves[:, None], v[..., None, None] + moves
        points = np.asarray(function(*np.broadcast_arrays(grid_u, grid_v)), dtype=float)
        along_u, along_v = points[..., :, 2, :], points[..., 2, :, :]
        first, second = _FIRST / step, _SECOND / step**2
        mixed = np.einsum("i,j,...ijk->...k", first, first, points)
        return SurfaceDerivatives(
            points[..., 2, 2, :], first @ along_u, first @ along_v, second @ along_u, mixed, second @ along_v
        )

    return Surface(name, jet, outward)


def transformed(
    surface: Surface, rotation: ArrayLike | None = None, translation_mm: Sequence[float] = (0.0, 0.0, 0.0)
) -> Surface:
    """The surface rotated by the 3 x 3 ``rotation``, then moved by ``translation_mm``.

    Raises ``ValueError`` if ``rotation`` is not a proper rotation (a reflection would exchange material and air).
    """
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=float)
    if turn.shape != (3, 3) or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-9) or np.linalg.det(turn) < 0.0:
        raise ValueError("rotation must be a proper 3 x 3 rotation matrix")
    shift = np.asarray(translation_mm, dtype=float)

    def jet(u: Array, v: Array) -> SurfaceDerivatives:
        """The jet of ``surface``: rotated, and the point also moved."""
        point, *derivatives = (part @ turn.T for part in surface.jet(u, v))
        return SurfaceDerivatives(point + shift, *derivatives)

    return Surface(surface.name, jet, surface.outward)


def inside_out(surface: Surface) -> Surface:
    """The same surface with the material on its other side: a shaft becomes a bore, a ball a socket."""
    return Surface(surface.name, surface.jet, -surface.outward)

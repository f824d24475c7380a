"""Hertzian contact: mutual approach of two elastic bodies under a force, for balls on planes, spheres and cylinders.

Every approach here is k F^(2/3); the functions give the coefficient k, which depends only on shapes and materials.
Source: K. L. Johnson, Contact Mechanics (1985), Eqs 3.22-3.24 (circle), 4.24-4.32 (ellipse). Ren et al. 2020 use the
same law with rounded constants in Eqs 6 and 11.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array

N_PER_MM2_IN_GPA = 1e3

# Below this difference of the curvatures the ellipse is a circle, to 1e-11 in the approach.
_ROUND = 1e-5
_HALVINGS = 80


def contact_modulus_N_mm2(
    first_GPa: ArrayLike, first_poisson: ArrayLike, second_GPa: ArrayLike, second_poisson: ArrayLike
) -> Array:
    """Modulus E* of a pair of materials, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; an infinite modulus is rigid."""
    first = (1.0 - np.asarray(first_poisson, dtype=float) ** 2) / np.asarray(first_GPa, dtype=float)
    second = (1.0 - np.asarray(second_poisson, dtype=float) ** 2) / np.asarray(second_GPa, dtype=float)
    with np.errstate(divide="ignore"):
        return N_PER_MM2_IN_GPA / (first + second)


def approach_mm(coefficient: ArrayLike, force_N: ArrayLike) -> Array:
    """Approach k F^(2/3) in mm; 0 for a tensile force."""
    return np.asarray(coefficient, dtype=float) * np.maximum(np.asarray(force_N, dtype=float), 0.0) ** (2.0 / 3.0)


def ball_on_plane(radius_mm: ArrayLike, modulus_N_mm2: ArrayLike) -> Array:
    """Coefficient k in mm/N^(2/3) of a ball on a plane: (9 / (16 R E*^2))^(1/3) (Johnson 3.23, Ren Eq 11)."""
    return _round_contact(1.0 / np.asarray(radius_mm, dtype=float), modulus_N_mm2)


def ball_on_sphere(radius_mm: ArrayLike, sphere_radius_mm: ArrayLike, modulus_N_mm2: ArrayLike) -> Array:
    """Coefficient k of a ball on a sphere; a negative radius is a hollow sphere.

    Raises ``ValueError`` if the ball does not fit into the hollow.
    """
    curvature = 1.0 / np.asarray(radius_mm, dtype=float) + 1.0 / np.asarray(sphere_radius_mm, dtype=float)
    _check_touching(curvature)
    return _round_contact(curvature, modulus_N_mm2)


def ball_on_cylinder(radius_mm: ArrayLike, cylinder_radius_mm: ArrayLike, modulus_N_mm2: ArrayLike) -> Array:
    """Coefficient k of a ball on a cylinder, or in a bore with a negative radius (Ren Eq 6).

    Raises ``ValueError`` if the ball does not fit into the bore.
    """
    ball = 1.0 / np.asarray(radius_mm, dtype=float)
    return elliptic_contact(ball, ball + 1.0 / np.asarray(cylinder_radius_mm, dtype=float), modulus_N_mm2)


def elliptic_contact(first_per_mm: ArrayLike, second_per_mm: ArrayLike, modulus_N_mm2: ArrayLike) -> Array:
    """Coefficient k for two principal relative curvatures in 1/mm, in any order (Johnson 4.24-4.32).

    Raises ``ValueError`` unless both are positive: with zero the contact is a line, for which the approach is not
    finite.
    """
    one, other = np.broadcast_arrays(np.asarray(first_per_mm, dtype=float), np.asarray(second_per_mm, dtype=float))
    small, large = np.minimum(one, other), np.maximum(one, other)
    _check_touching(small)
    mean = np.sqrt(small * large)
    return _round_contact(mean, modulus_N_mm2) * _ellipse_factor(large / small)


def contact_radius_mm(radius_mm: ArrayLike, modulus_N_mm2: ArrayLike, force_N: ArrayLike) -> Array:
    """Radius of the circle of contact of a ball, (3 F R / (4 E*))^(1/3) (Johnson 3.22).

    ``radius_mm`` is the ball's radius on a plane, or 1 over the sum of the curvatures.
    """
    return np.cbrt(0.75 * np.asarray(force_N) * np.asarray(radius_mm) / np.asarray(modulus_N_mm2))


def _round_contact(curvature_per_mm: ArrayLike, modulus_N_mm2: ArrayLike) -> Array:
    return np.cbrt(9.0 / 16.0 * np.asarray(curvature_per_mm) / np.asarray(modulus_N_mm2, dtype=float) ** 2)


def _check_touching(curvature_per_mm: Array) -> None:
    if np.any(curvature_per_mm <= 0.0):
        raise ValueError("the bodies do not touch in a point: the hollow is not wider than the ball")


def _ellipse_factor(ratio: Array) -> Array:
    """Johnson's F_2: approach of the ellipse over that of the circle with the same mean curvature."""
    axes = _squared_axis_ratio(np.maximum(ratio, 1.0 + _ROUND))
    k, e = _elliptic_integrals(axes)
    f1_cubed = 4.0 / (np.pi * (1.0 - axes)) * axes**0.75 * np.sqrt((e / axes - k) * (k - e))
    factor = 2.0 / np.pi * axes**0.25 * k / np.cbrt(f1_cubed)
    return np.where(ratio - 1.0 < _ROUND, 1.0, factor)


def _elliptic_integrals(axes: Array) -> tuple[Array, Array]:
    """Complete elliptic integrals K and E for the squared ratio of the axes."""
    from scipy.special import ellipe, ellipkm1  # takes longer to import than a path to plan, which needs none

    return ellipkm1(axes), ellipe(1.0 - axes)


def _squared_axis_ratio(ratio: Array) -> Array:
    """(b/a)^2 of the ellipse for the ratio of curvatures (Johnson 4.25), by bisection: the relation is monotonic."""
    low, high = np.full(np.shape(ratio), -70.0), np.zeros(np.shape(ratio))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        axes = np.exp(middle)
        k, e = _elliptic_integrals(axes)
        with np.errstate(divide="ignore", invalid="ignore"):
            too_slim = (e / axes - k) / (k - e) > ratio
        low, high = np.where(too_slim, middle, low), np.where(too_slim, high, middle)
    return np.exp(0.5 * (low + high))

"""Hertz contacts: circle against ellipse, known cases, limits, and the constants that Ren uses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from stepgauge.physics import contact

STEEL = contact.contact_modulus_N_mm2(210.0, 0.3, 210.0, 0.3)
radii = st.floats(0.1, 100)


def test_modulus_of_equal_materials():
    np.testing.assert_allclose(STEEL, 210e3 / (2 * (1 - 0.09)))
    assert contact.contact_modulus_N_mm2(210.0, 0.3, np.inf, 0.3) == pytest.approx(2 * STEEL)


def test_ball_on_plane_closed_form():
    """9 F^2 / (16 R E*^2) is the cube of the approach."""
    approach = contact.approach_mm(contact.ball_on_plane(3.0, STEEL), 1.7)
    assert approach**3 == pytest.approx(9 * 1.7**2 / (16 * 3.0 * STEEL**2))


def test_approach_is_the_area_of_the_contact_over_the_radius():
    """For balls a^2 = R delta."""
    approach = contact.approach_mm(contact.ball_on_plane(3.0, STEEL), 1.7)
    assert contact.contact_radius_mm(3.0, STEEL, 1.7) ** 2 == pytest.approx(3.0 * approach)


def test_plane_is_the_limit_of_a_large_sphere_and_cylinder():
    plane = contact.ball_on_plane(2.0, STEEL)
    large = np.array([1e2, 1e4, 1e6])
    for shape in (contact.ball_on_sphere, contact.ball_on_cylinder):
        gap = np.abs(shape(2.0, large, STEEL) / plane - 1)
        assert np.all(np.diff(gap) < 0)
        assert gap[-1] < 1e-5


def test_cylinder_lies_between_plane_and_sphere():
    plane, sphere = contact.ball_on_plane(2.0, STEEL), contact.ball_on_sphere(2.0, 5.0, STEEL)
    assert plane < contact.ball_on_cylinder(2.0, 5.0, STEEL) < sphere


def test_crossed_equal_cylinders_are_a_ball_on_a_plane():
    crossed = contact.elliptic_contact(1 / 7.0, 1 / 7.0, STEEL)
    assert crossed == pytest.approx(contact.ball_on_plane(7.0, STEEL))


@given(radii, radii)
def test_curvatures_may_be_given_in_any_order(one, other):
    first = contact.elliptic_contact(1 / one, 1 / other, STEEL)
    assert contact.elliptic_contact(1 / other, 1 / one, STEEL) == pytest.approx(float(first))


@pytest.mark.parametrize("ratio", [1.001, 1.5, 3.0, 20.0, 1e3])
def test_ellipse_solves_hertz_integrals(ratio):
    """Curvatures and approach of an ellipse with semi-axes 1 and b from the pressure's potential, by quadrature.

    With p0 = pi E* / 2 per unit: approach = I_0, curvature_x = 2 I_x, curvature_y = 2 I_y up to one common factor, with
    I over s of 1 / sqrt((a^2+s)(b^2+s)s), times 1 / (a^2+s) or 1 / (b^2+s) (Love's potential of the ellipsoid).
    """

    def integrals(b):
        def weight(t):  # s = t^2 takes the root singularity out
            return 2.0 / np.sqrt((1 + t * t) * (b * b + t * t))

        total = [
            quad(f, 0, np.inf, limit=400)[0]
            for f in (weight, lambda t: weight(t) / (1 + t * t), lambda t: weight(t) / (b * b + t * t))
        ]
        return np.array(total)

    low, high = 1e-4, 1.0
    for _ in range(60):
        b = np.sqrt(low * high)
        _, x, y = integrals(b)
        low, high = (b, high) if y / x > ratio else (low, b)
    depth, x, y = integrals(b)
    # Force 1 = (2/3) pi p0 a b; approach = p0 a b I_0 / (2 E*), curvature = p0 a b I / E*.
    scale = 3.0 / (4.0 * np.pi)
    # The contact has a = 1: its curvatures are 2 scale I_x / E* per newton.
    curvature = 2 * scale * x / STEEL, 2 * scale * y / STEEL
    assert contact.elliptic_contact(*curvature, STEEL) == pytest.approx(scale * depth / STEEL, rel=1e-6)


def test_ren_contact_factor_is_hertz_for_equal_radii():
    """Ren section 4: n_delta = 0.9744 for a ball on a pin of the same radius (Eq 6)."""
    modulus = contact.contact_modulus_N_mm2(200.0, 0.0, 200.0, 0.0)
    ren = 0.655 * 0.9744 * np.cbrt((2 / 200e3) ** 2 * 3.0)
    assert contact.ball_on_cylinder(1.0, 1.0, modulus) == pytest.approx(ren, rel=1e-4)


@given(radii, st.floats(1e-3, 100))
def test_force_grows_as_the_power_three_halves(radius, force):
    k = contact.ball_on_plane(radius, STEEL)
    assert contact.approach_mm(k, 8 * force) == pytest.approx(4 * float(contact.approach_mm(k, force)))


def test_pulling_and_rigid_bodies_give_nothing():
    assert contact.approach_mm(1.0, -2.0) == 0.0
    rigid = contact.contact_modulus_N_mm2(np.inf, 0.3, np.inf, 0.3)
    assert contact.ball_on_plane(1.0, rigid) == 0.0


@pytest.mark.parametrize("shape", [contact.ball_on_sphere, contact.ball_on_cylinder])
def test_ball_that_does_not_fit_is_refused(shape):
    assert shape(2.0, -3.0, STEEL) > 0
    with pytest.raises(ValueError, match="hollow"):
        shape(2.0, -1.5, STEEL)

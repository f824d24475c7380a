"""Surfaces: derivatives against finite differences, normals and curvatures against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from stepgauge.physics import surfaces

SHAPES = {
    "plane": surfaces.plane((1.0, -2.0, 3.0), (1.0, 2.0, -0.5)),
    "sphere": surfaces.sphere(12.5),
    "cylinder": surfaces.cylinder(7.0),
    "ellipsoid": surfaces.ellipsoid(10.0, 8.0, 6.0),
    "paraboloid": surfaces.paraboloid(20.0, 10.0),
    "moved": surfaces.transformed(
        surfaces.ellipsoid(10.0, 8.0, 6.0), Rotation.from_euler("xyz", [0.3, -0.8, 1.9]).as_matrix(), (5.0, -7.0, 2.0)
    ),
}
parameter = st.floats(0.3, 1.2)


@pytest.mark.parametrize("name", SHAPES)
@given(u=parameter, v=parameter)
def test_closed_form_derivatives_agree_with_differences(name, u, v):
    shape = SHAPES[name]
    numeric = surfaces.make_surface(shape.point_mm, outward=shape.outward)
    exact, approximate = shape.at(u, v), numeric.at(u, v)
    for part in ("point", "du", "dv"):
        np.testing.assert_allclose(getattr(approximate, part), getattr(exact, part), atol=1e-9)
    for part in ("duu", "duv", "dvv"):
        np.testing.assert_allclose(getattr(approximate, part), getattr(exact, part), atol=1e-6)


def test_normal_of_a_sphere_is_radial():
    u, v = np.meshgrid(np.linspace(-3.0, 3.0, 13), np.linspace(0.1, 3.0, 9))
    shape = surfaces.sphere(12.5)
    np.testing.assert_allclose(shape.normal(u, v), shape.point_mm(u, v) / 12.5, atol=1e-14)


def test_normal_of_an_ellipsoid_is_the_gradient_of_its_implicit_form():
    u, v = np.meshgrid(np.linspace(-3.0, 3.0, 13), np.linspace(0.1, 3.0, 9))
    axes = np.array([10.0, 8.0, 6.0])
    shape = surfaces.ellipsoid(*axes)
    gradient = shape.point_mm(u, v) / axes**2
    np.testing.assert_allclose(shape.normal(u, v), gradient / np.linalg.norm(gradient, axis=-1, keepdims=True))


@given(u=parameter, v=parameter)
def test_printed_ellipsoid_normal_holds_for_the_sphere_only(u, v):
    """Rodrigues Eq 4.18 has a^2, b^2, c^2 where the cross product has bc, ac, ab."""

    def printed(a, b, c):
        n = np.array(
            [a**2 * np.cos(u) * np.sin(v) ** 2, b**2 * np.sin(u) * np.sin(v) ** 2, c**2 * np.cos(v) * np.sin(v)]
        )
        return n / np.linalg.norm(n)

    np.testing.assert_allclose(printed(5.0, 5.0, 5.0), surfaces.sphere(5.0).normal(u, v))
    assert np.linalg.norm(printed(10.0, 8.0, 6.0) - surfaces.ellipsoid(10.0, 8.0, 6.0).normal(u, v)) > 0.05


@pytest.mark.parametrize("name", SHAPES)
def test_normals_point_out_of_the_material(name):
    """Walking out along the normal leaves the middle of a closed body; planes and paraboloids have material below."""
    shape = SHAPES[name]
    inside = {"plane": np.array([1.0, -2.0, 3.0]) - np.array([1.0, 2.0, -0.5]), "paraboloid": np.array([0, 0, -100.0])}
    middle = inside.get(name, np.array([5.0, -7.0, 2.0]) if name == "moved" else np.array([0.0, 0.0, 0.7]))
    assert np.sum(shape.normal(0.6, 0.7) * (shape.point_mm(0.6, 0.7) - middle)) > 0.0


def test_curvatures_of_known_shapes():
    np.testing.assert_allclose(SHAPES["plane"].curvatures_per_mm(3.0, 4.0), 0.0, atol=1e-15)
    np.testing.assert_allclose(SHAPES["sphere"].curvatures_per_mm(0.3, 0.9), 1 / 12.5)
    np.testing.assert_allclose(SHAPES["cylinder"].curvatures_per_mm(0.3, 0.9), [0.0, 1 / 7.0], atol=1e-15)
    np.testing.assert_allclose(SHAPES["paraboloid"].curvatures_per_mm(0.0, 0.0), 2 * 10.0 / 20.0**2)
    # At the end of the axis a, an ellipsoid has the radii b^2/a and c^2/a.
    np.testing.assert_allclose(SHAPES["ellipsoid"].curvatures_per_mm(0.0, np.pi / 2), [10 / 64.0, 10 / 36.0])


def test_inside_out_turns_normal_and_curvature():
    bore = surfaces.inside_out(surfaces.cylinder(7.0))
    np.testing.assert_allclose(bore.normal(0.4, 1.0), -SHAPES["cylinder"].normal(0.4, 1.0))
    np.testing.assert_allclose(bore.curvatures_per_mm(0.4, 1.0), [-1 / 7.0, 0.0], atol=1e-15)


@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3), u=parameter, v=parameter)
def test_curvatures_do_not_depend_on_the_place(angles, u, v):
    shape = SHAPES["ellipsoid"]
    moved = surfaces.transformed(shape, Rotation.from_euler("xyz", angles).as_matrix(), (100.0, 200.0, 300.0))
    np.testing.assert_allclose(moved.curvatures_per_mm(u, v), shape.curvatures_per_mm(u, v), rtol=1e-7)


def test_arrays_and_scalars_agree():
    u, v = np.array([0.4, 0.9]), np.array([[0.5], [1.1], [1.3]])
    whole = SHAPES["paraboloid"].normal(u, v)
    assert whole.shape == (3, 2, 3)
    np.testing.assert_array_equal(whole[2, 1], SHAPES["paraboloid"].normal(0.9, 1.3))


def test_pole_of_a_sphere_is_refused():
    with pytest.raises(ValueError, match="singular"):
        surfaces.sphere(10.0).normal(0.0, 0.0)


@pytest.mark.parametrize("rotation", [np.diag([1.0, 1.0, -1.0]), 2.0 * np.eye(3), np.eye(2)])
def test_only_rotations_may_turn_a_surface(rotation):
    with pytest.raises(ValueError, match="rotation"):
        surfaces.transformed(surfaces.sphere(1.0), rotation)

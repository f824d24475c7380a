"""Spheres: exact recovery, invariance, uncertainty against Monte Carlo, an independent optimiser."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from stepgauge.physics import directions, sphere

PATTERNS = {
    "5": directions.five_points(),
    "25": directions.iso_10360_5_points(),
    "2000": directions.nine_degree_points(),
}
SHIFT = np.array([10.0, 20.0, 30.0])
coordinate = st.floats(-1000.0, 1000.0)


def probed(pattern, radius_mm=17.0, centre=(410.0, -220.0, 650.0), radial_um=0.0):
    radius = radius_mm + 1e-3 * np.broadcast_to(radial_um, len(pattern))
    return np.asarray(centre) + pattern * radius[:, None]


@pytest.mark.parametrize("name", PATTERNS)
@given(centre=st.tuples(coordinate, coordinate, coordinate), radius=st.floats(1.0, 50.0))
def test_exact_points_give_the_exact_sphere(name, centre, radius):
    fit = sphere.fit_sphere(probed(PATTERNS[name], radius, centre))
    np.testing.assert_allclose(fit.centre_mm, centre, atol=1e-9)
    assert fit.radius_mm == pytest.approx(radius, abs=1e-9)
    assert fit.form_error_um < 1e-5


def test_agrees_with_a_general_optimiser_on_noisy_points():
    points = probed(PATTERNS["25"], radial_um=np.random.default_rng(7).normal(0.0, 500.0, 25))
    reference = least_squares(
        lambda p: np.linalg.norm(points - p[:3], axis=1) - p[3], [400.0, -200.0, 640.0, 10.0], xtol=1e-15, ftol=1e-15
    )
    fit = sphere.fit_sphere(points)
    np.testing.assert_allclose(fit.centre_mm, reference.x[:3], atol=1e-7)
    assert fit.radius_mm == pytest.approx(reference.x[3], abs=1e-7)
    np.testing.assert_allclose(fit.residuals_um, 1e3 * reference.fun, atol=1e-4)


@pytest.mark.parametrize("name", ["5", "25"])
def test_uncertainty_is_the_scatter_of_repeated_fits(name):
    """2000 qualifications with known noise: the stated u is their standard deviation (3 % sampling error, 5 sigma)."""
    rng = np.random.default_rng(11)
    fits = [
        sphere.fit_sphere(probed(PATTERNS[name], radial_um=rng.normal(0.0, 0.4, len(PATTERNS[name]))), noise_um=0.4)
        for _ in range(2000)
    ]
    assert 1e3 * np.std([fit.radius_mm for fit in fits]) == pytest.approx(fits[0].u_radius_um, rel=0.08)
    scatter = 1e3 * np.std([fit.centre_mm for fit in fits], axis=0)
    np.testing.assert_allclose(scatter, fits[0].u_centre_um, rtol=0.08)


def test_noise_from_residuals_is_unbiased():
    rng = np.random.default_rng(5)
    fits = [sphere.fit_sphere(probed(PATTERNS["25"], radial_um=rng.normal(0.0, 0.4, 25))) for _ in range(500)]
    assert np.mean([fit.noise_um**2 for fit in fits]) == pytest.approx(0.16, rel=0.07)
    assert fits[0].degrees_of_freedom == 21


def test_more_points_make_a_surer_radius():
    u = [sphere.fit_sphere(probed(PATTERNS[name]), noise_um=0.5).u_radius_um for name in ("5", "25", "2000")]
    assert u[0] == pytest.approx(0.25)  # four equator points hold the radius, the pole only the height
    assert u[0] > u[1] > u[2]


def test_form_error_is_range_of_radial_distances():
    pattern = directions.evenly_spread_points(400)
    lobes = 3.0 * np.cos(3.0 * directions.angles_rad(pattern)[0]) * (1.0 - pattern[:, 2] ** 2)
    fit = sphere.fit_sphere(probed(pattern, radial_um=lobes))
    assert fit.form_error_um == pytest.approx(np.ptp(lobes), rel=0.02)


@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_turning_and_moving_the_points_changes_nothing_else(angles):
    points = probed(PATTERNS["25"], radial_um=np.random.default_rng(3).normal(0.0, 2.0, 25))
    turn = Rotation.from_euler("xyz", angles)
    still, moved = sphere.fit_sphere(points), sphere.fit_sphere(turn.apply(points) + SHIFT)
    assert moved.radius_mm == pytest.approx(still.radius_mm, abs=1e-8)
    assert moved.form_error_um == pytest.approx(still.form_error_um, abs=1e-4)
    np.testing.assert_allclose(moved.centre_mm, turn.apply(still.centre_mm) + SHIFT, atol=1e-8)


def test_effective_radius_is_tip_less_pretravel():
    """Ren's sphere, a 4 mm ball and 3.17 um of pre-travel all around."""
    points = probed(PATTERNS["25"], radius_mm=29.98604 / 2 + 2.0 - 0.00317)
    found = sphere.effective_radius(points, 29.98604 / 2, u_sphere_radius_um=0.03, noise_um=0.3)
    assert found.r_eff_mm == pytest.approx(2.0 - 0.00317, abs=1e-9)
    assert found.u_r_eff_um == pytest.approx(np.hypot(0.03, found.fit.u_radius_um))


def test_four_points_leave_nothing_to_tell_the_noise():
    fit = sphere.fit_sphere(probed(PATTERNS["5"][[0, 1, 2, 4]]))
    assert fit.degrees_of_freedom == 0
    assert fit.u_radius_um is None
    assert fit.u_centre_um is None
    assert sphere.effective_radius(probed(PATTERNS["5"][[0, 1, 2, 4]]), 15.0).u_r_eff_um is None
    assert sphere.fit_sphere(probed(PATTERNS["5"][[0, 1, 2, 4]]), noise_um=0.2).u_radius_um > 0.0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((3, 3)), "at least 4"),
        (np.zeros((5, 2)), "three coordinates"),
        (probed(PATTERNS["5"][:4]), "one plane"),
        (np.ones((6, 3)), "one plane"),
    ],
)
def test_points_that_fit_no_sphere_are_refused(points, message):
    with pytest.raises(ValueError, match=message):
        sphere.fit_sphere(points)

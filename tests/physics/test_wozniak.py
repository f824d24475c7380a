"""Wozniak's model and its calibration: Eqs 4-9, their limits, and what the paper's own formulas do not hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from stepgauge.physics import directions, wozniak
from stepgauge.physics.sphere import effective_radius
from stepgauge.physics.wozniak import LobeModel

KINEMATIC, PIEZO = LobeModel("kinematic"), LobeModel("piezo")
SPHERE_MM, TIP_MM = 15.0, 2.0
azimuth = st.floats(-7.0, 7.0)
elevation = st.floats(0.0, 1.5)


def recorded(pattern, pretravel_um, centre=(300.0, 200.0, -50.0)):
    radius = SPHERE_MM + TIP_MM - 1e-3 * np.asarray(pretravel_um)
    return np.asarray(centre) + pattern * radius[:, None]


class TestShape:
    @given(beta=azimuth, gamma=elevation, lobe=azimuth)
    def test_period_of_a_third_turn(self, beta, gamma, lobe):
        model = LobeModel("kinematic", lobe)
        here = model.shape(directions.unit_vectors(beta, gamma))
        third = model.shape(directions.unit_vectors(beta + wozniak.LOBE_PERIOD_RAD, gamma))
        assert third == pytest.approx(float(here), rel=1e-9)

    @given(beta=azimuth, gamma=elevation)
    def test_mirror_about_a_lobe(self, beta, gamma):
        left, right = KINEMATIC.shape(directions.unit_vectors([beta, -beta], gamma))
        assert left == pytest.approx(right)

    def test_triangle_in_the_equator(self):
        """Eq 4 draws a straight-sided triangle: w cos(folded azimuth) is the same all along a side."""
        beta = np.linspace(-np.pi / 3, np.pi / 3, 25)
        points = KINEMATIC.shape(directions.unit_vectors(beta, 0.0))[:, None] * directions.unit_vectors(beta, 0.0)
        np.testing.assert_allclose(points[:, 0], 1.0)
        assert KINEMATIC.shape(directions.unit_vectors(np.pi / 3, 0.0)) == pytest.approx(2.0)

    @given(beta=azimuth, gamma=elevation)
    def test_piezo_is_round(self, beta, gamma):
        assert PIEZO.shape(directions.unit_vectors(beta, gamma)) == pytest.approx(np.cos(gamma) ** 2, abs=1e-12)

    @pytest.mark.parametrize("model", [KINEMATIC, PIEZO, LobeModel("kinematic", slip="mayer")])
    def test_nothing_at_the_pole(self, model):
        assert model.shape([0.0, 0.0, 1.0]) == pytest.approx(0.0, abs=1e-30)

    def test_printed_modulo_goes_through_a_pole(self):
        """Eq 4 prints cos(beta mod 120 deg): at 90 deg it divides by zero, where the folded form has 1.155."""
        assert np.cos(np.radians(90.0) % wozniak.LOBE_PERIOD_RAD) == pytest.approx(0.0, abs=1e-15)
        assert KINEMATIC.shape(directions.unit_vectors(np.radians(90.0), 0.0)) == pytest.approx(2 / np.sqrt(3))

    def test_opposite_directions_sum_to_a_constant_only_roughly(self):
        """Eq 7: for Eq 4 itself the sum runs from 2.31 A to 3.00 A."""
        beta = np.linspace(0.0, 2.0 * np.pi, 721)
        both = sum(KINEMATIC.shape(directions.unit_vectors(beta + turn, 0.0)) for turn in (0.0, np.pi))
        assert both.min() == pytest.approx(4 / np.sqrt(3), abs=1e-9)
        assert both.max() == pytest.approx(3.0, abs=1e-9)


class TestMayer:
    def test_coefficient_of_slip(self):
        assert wozniak.mayer_slip(0.0) == 1.0
        assert wozniak.mayer_slip(np.pi / 2) == pytest.approx(0.6752, abs=1e-4)

    @given(beta=azimuth, gamma=elevation)
    def test_option_is_the_horizontal_part_of_equation_1(self, beta, gamma):
        """A tip displaced by h = A cos(gamma) / cos(beta) across the axis and not along it."""
        normal = directions.unit_vectors(beta, gamma)
        across = np.cos(gamma) / np.cos(wozniak.fold_azimuth_rad(beta))
        expected = wozniak.mayer_pretravel_um(0.0, across, np.pi / 2 - gamma)
        assert LobeModel("kinematic", slip="mayer").shape(normal) == pytest.approx(float(expected), abs=1e-12)

    def test_along_the_axis_only_the_vertical_part_counts(self):
        assert wozniak.mayer_pretravel_um(0.7, 5.0, 0.0) == pytest.approx(0.7)


class TestCalibration:
    @pytest.mark.parametrize("model", [KINEMATIC, PIEZO, LobeModel("kinematic", 0.4, "mayer")])
    @pytest.mark.parametrize(
        "pattern", [directions.five_points(0.2), directions.iso_10360_5_points(), directions.nine_degree_points(1)]
    )
    def test_a_probe_that_obeys_the_model_is_found_exactly(self, model, pattern):
        points = recorded(pattern, model.pretravel_um(pattern, 6.0))
        found = wozniak.calibrate(points, SPHERE_MM, TIP_MM, model)
        assert found.constant_um == pytest.approx(6.0, abs=1e-6)
        np.testing.assert_allclose(found.centre_mm, [300.0, 200.0, -50.0], atol=1e-9)
        corrected = wozniak.compensated_mm(points, -pattern, found.constant_um, model, None)
        np.testing.assert_allclose(np.linalg.norm(corrected - found.centre_mm, axis=1), SPHERE_MM + TIP_MM, atol=1e-9)

    def test_constant_from_the_mean_is_equation_9(self):
        pattern = directions.five_points()
        mean_um = KINEMATIC.pretravel_um(pattern, 6.0).mean()
        # 1 + 2 / sqrt(3) + 2 + 2 / sqrt(3) + 0 over five points
        assert mean_um == pytest.approx(6.0 * (3.0 + 4.0 / np.sqrt(3)) / 5.0)
        assert wozniak.constant_from_mean_um(mean_um, pattern, KINEMATIC) == pytest.approx(6.0)
        with pytest.raises(ValueError, match="pole"):
            wozniak.constant_from_mean_um(1.0, [[0.0, 0.0, 1.0]], KINEMATIC)

    def test_fitted_five_point_sphere_does_not_give_the_mean_of_equation_6(self):
        """The single pole point holds only the height: R_eff is the tip less the mean of the equator."""
        pattern = directions.five_points()
        pretravel = KINEMATIC.pretravel_um(pattern, 6.0)
        fitted_um = 1e3 * (TIP_MM - effective_radius(recorded(pattern, pretravel), SPHERE_MM).r_eff_mm)
        assert fitted_um == pytest.approx(pretravel[:4].mean(), abs=5e-3)
        assert abs(fitted_um - pretravel.mean()) > 1.0

    @given(turn=azimuth)
    def test_equator_mean_hardly_depends_on_how_the_probe_is_mounted(self, turn):
        """The paper's reason for four points. Eq 7 being rough, the mean runs from sqrt(6) / 2 to 1.327 A.

        Against the mean of the whole equator, (3 / pi) ln tan 75 deg = 1.258 A, that is -2.6 % and +5.5 %.
        """
        mean = KINEMATIC.shape(directions.five_points(turn)[:4]).mean()
        assert np.sqrt(6) / 2 - 1e-9 <= mean <= (3 + 4 / np.sqrt(3)) / 4 + 1e-9

    def test_mean_over_the_equator_in_closed_form(self):
        everywhere = KINEMATIC.shape(directions.unit_vectors(np.linspace(0, 2 * np.pi, 36001)[:-1], 0.0)).mean()
        assert everywhere == pytest.approx(3 / np.pi * np.log(np.tan(np.radians(75.0))), rel=1e-6)

    @pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -0.6, 0.8)])
    def test_a_tilted_probe_is_calibrated_in_its_own_frame(self, axis):
        frame = directions.probe_frame(axis)
        own = directions.iso_10360_5_points()
        points = recorded(own @ frame, KINEMATIC.pretravel_um(own, 6.0))
        found = wozniak.calibrate(points, SPHERE_MM, TIP_MM, KINEMATIC, frame)
        assert found.constant_um == pytest.approx(6.0, abs=1e-6)
        corrected = wozniak.compensated_mm(points, -own @ frame, found.constant_um, KINEMATIC, frame)
        np.testing.assert_allclose(np.linalg.norm(corrected - found.centre_mm, axis=1), 17.0, atol=1e-9)

    @pytest.mark.parametrize("pattern", [directions.five_points(0.3), directions.iso_10360_5_points()])
    def test_uncertainty_is_the_scatter_of_repeated_calibrations(self, pattern):
        rng = np.random.default_rng(2)
        truth = KINEMATIC.pretravel_um(pattern, 6.0)
        found = [
            wozniak.calibrate(
                recorded(pattern, truth + rng.normal(0, 0.3, len(pattern))), SPHERE_MM, TIP_MM, KINEMATIC, noise_um=0.3
            )
            for _ in range(600)
        ]
        assert np.std([f.constant_um for f in found]) == pytest.approx(found[0].u_constant_um, rel=0.12)

    def test_wrong_radii_go_into_the_constant_as_stated(self):
        pattern = directions.iso_10360_5_points()
        points = recorded(pattern, KINEMATIC.pretravel_um(pattern, 6.0))
        right = wozniak.calibrate(points, SPHERE_MM, TIP_MM, KINEMATIC, noise_um=0.0, u_radii_um=1.0)
        wrong = wozniak.calibrate(points, SPHERE_MM, TIP_MM + 0.001, KINEMATIC)
        assert abs(wrong.constant_um - right.constant_um) == pytest.approx(right.u_constant_um, rel=1e-3)

    def test_lobe_azimuth_is_found_from_many_points(self):
        pattern = directions.iso_10360_5_points()
        model = LobeModel("kinematic", np.radians(37.3))
        points = recorded(pattern, model.pretravel_um(pattern, 6.0))
        found = wozniak.find_lobe_azimuth(points, SPHERE_MM, TIP_MM, KINEMATIC)
        assert np.degrees(found.azimuth_rad) == pytest.approx(37.3, abs=0.1)
        assert found.odds > 1e6

    def test_the_lobe_azimuth_lies_within_its_uncertainty(self):
        """Lobes at 17 deg of a probe that repeats to 0.3 um."""
        pattern, rng = directions.iso_10360_5_points(), np.random.default_rng(5)
        truth = LobeModel("kinematic", np.radians(17.0)).pretravel_um(pattern, 5.0)
        for _ in range(5):
            points = recorded(pattern, truth + rng.normal(0.0, 0.3, len(pattern)))
            found = wozniak.find_lobe_azimuth(points, SPHERE_MM, TIP_MM, KINEMATIC)
            assert abs(np.degrees(found.azimuth_rad) - 17.0) < 3.0 * np.degrees(found.u_rad) < 6.0
            assert found.odds > 20.0

    @pytest.mark.parametrize("form", ["oval", "noise", "four", "round", "off axis"])
    def test_a_form_error_is_no_lobes(self, form):
        pattern, rng = directions.iso_10360_5_points(), np.random.default_rng(6)
        azimuth, across = np.arctan2(pattern[:, 1], pattern[:, 0]), np.hypot(pattern[:, 0], pattern[:, 1])
        forms = {"oval": across**2 * np.cos(2 * azimuth + 0.4), "noise": rng.normal(0.0, 1.0, 25),
                 "four": across * np.cos(4 * azimuth + 0.7), "round": across**2,
                 "off axis": across * pattern[:, 2] * np.cos(azimuth)}  # fmt: skip
        for size in (0.5, 3.0):
            truth = 3.0 + size * forms[form] + rng.normal(0.0, 0.2, 25)
            assert wozniak.find_lobe_azimuth(recorded(pattern, truth), SPHERE_MM, TIP_MM, KINEMATIC).odds < 20.0

    @given(angles=st.tuples(*[st.floats(-0.5, 0.5)] * 3))
    def test_machine_axes_do_not_matter(self, angles):
        """Turning sphere, probe and approaches together leaves the constant as it was."""
        pattern, turn = directions.iso_10360_5_points(), Rotation.from_euler("xyz", angles).as_matrix()
        truth = 3.0 + np.random.default_rng(4).normal(0.0, 1.0, 25)
        still = wozniak.calibrate(recorded(pattern, truth), SPHERE_MM, TIP_MM, KINEMATIC)
        turned = wozniak.calibrate(recorded(pattern @ turn.T, truth), SPHERE_MM, TIP_MM, KINEMATIC, turn.T)
        assert turned.constant_um == pytest.approx(still.constant_um, abs=1e-6)

    def test_points_on_one_circle_cannot_tell_the_constant(self):
        circle = directions.unit_vectors(np.linspace(0, 5, 8), 0.6)
        with pytest.raises(ValueError, match=r"plane|spread"):
            wozniak.calibrate(recorded(circle, np.full(8, 3.0)), SPHERE_MM, TIP_MM, PIEZO)


def test_compensation_shifts_against_the_travel():
    """A probe that triggers late has travelled too far along its approach: the correction takes it back."""
    approach = np.array([[-1.0, 0.0, 0.0]])
    corrected = wozniak.compensated_mm([[10.0, 0.0, 0.0]], approach, 5.0, PIEZO, None)
    np.testing.assert_allclose(corrected, [[10.005, 0.0, 0.0]])

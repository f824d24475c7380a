"""Pre-travel: Ren's numbers, the thesis' deflections, virtual work, conventions and limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from stepgauge.physics import contact, pretravel, stylus, trigger
from stepgauge.physics.directions import unit_vectors
from stepgauge.physics.pretravel import Elasticity, PretravelLaw

from .omp40 import CARRIER_MM, EXISTING, MISPRINT, TABLE, level, normals

FEA = replace(EXISTING, lever_mm=50.0 + CARRIER_MM)
ROUNDING_UM = 0.05
SOFT = Elasticity(lateral_mm_per_N=4.6e-3, axial_mm_per_N=2e-5, seat_mm_per_N23=2e-4, tip_mm_per_N23=1.5e-4)

pushes = st.builds(unit_vectors, st.floats(-3.14, 3.14), st.floats(0, 1.57))


def deflection_um(force_N, compliance_mm_per_N):
    return 1e3 * force_N * np.sin(np.radians(TABLE["polar_deg"])) * compliance_mm_per_N


class TestThesis:
    """Sensing distances of Rodrigues 2021, printed to 0.1 um, and Table 2.3."""

    def test_existing_method(self):
        uniform = stylus.bending_compliance_mm_per_N([stylus.StylusSection(50.0, 4.5, 413.0)])
        expected = 1e3 * TABLE["sensing_statics_mm"]
        found = deflection_um(trigger.trigger_force_N(EXISTING, normals()), uniform)
        off = (np.abs(found - expected) - ROUNDING_UM) / expected
        own_force = deflection_um(TABLE["force_statics_N"], uniform)
        # Three rows print a deflection that their own force does not give: 90/0, 20/50 and 10/60.
        at_odds = (np.abs(own_force - expected) > ROUNDING_UM + 0.02) & ~MISPRINT
        np.testing.assert_array_equal(TABLE["azimuth_deg"][at_odds], [0, 50, 60])
        assert off[~at_odds].max() < 0.0002
        np.testing.assert_allclose(off[at_odds], [0.0192, 0.0208, 0.0225], atol=0.0005)

    def test_fea_is_one_compliance(self):
        expected = 1e3 * TABLE["sensing_fea_mm"]
        force = trigger.trigger_force_N(FEA, normals())
        assert np.all(np.abs(deflection_um(force, 4.60e-3) - expected) <= ROUNDING_UM + 0.02 * expected)

    def test_one_steel_head_explains_both_stylus_lengths(self):
        """A stiffer root of 2.55 mm gives the FEA's compliance at 50 mm and at 100 mm, where 413 GPa alone do not."""

        def compliance(length, head):
            parts = [stylus.StylusSection(head, 7.0, 193.0), stylus.StylusSection(length - head, 4.5, 413.0, 0.22)]
            return 1e3 * stylus.lateral_compliance_mm_per_N(parts)

        assert compliance(50.0, 2.55) == pytest.approx(4.60, rel=0.01)
        assert compliance(100.0, 2.55) == pytest.approx(38.1, rel=0.01)
        assert compliance(50.0, 1e-6) / 4.60 > 1.08

    def test_table_2_3_existing_model(self):
        """Printed 19.36 and 33.79 um: azimuth 0 and 60 deg, a uniform ceramic stylus of 100 mm."""
        tripod = replace(EXISTING, lever_mm=100.0)
        uniform = stylus.bending_compliance_mm_per_N([stylus.StylusSection(100.0, 4.5, 413.0)])
        force = trigger.trigger_force_N(tripod, unit_vectors(np.radians([0.0, 60.0]), 0.0))
        np.testing.assert_allclose(1e3 * force * uniform, [19.36, 33.79], atol=0.01)

    def test_table_2_3_measured(self):
        """Measured 15.875 and 28.865 um, FEA 16.11 and 28.456 um: the tripod with the carrier's lever and 38.1 um/N."""
        tripod = replace(EXISTING, lever_mm=100.0 + CARRIER_MM)
        found = 38.1 * trigger.trigger_force_N(tripod, unit_vectors(np.radians([0.0, 60.0]), 0.0))
        np.testing.assert_allclose(found, [16.11, 28.456], rtol=0.003)
        np.testing.assert_allclose(found / [15.875, 28.865] - 1, [0.012, -0.013], atol=0.001)


class TestRen:
    """Sensors 2020, section 4: both Hertz coefficients are printed ten times too small in Eq 13."""

    CARRIER = pretravel.ren_carrier_mm(1.5, 0.9744, 2 / 200, 1.0, 1.0)
    TIP = pretravel.ren_tip_mm(1 / 620 + 1 / 200, 4.0)
    BEAM = stylus.bending_compliance_mm_per_N([stylus.StylusSection(18.0, 2.0, 200.0)])

    def test_coefficients(self):
        assert pytest.approx(0.000641, abs=5e-7) == self.CARRIER
        assert pytest.approx(0.000183, abs=5e-7) == self.TIP
        assert pytest.approx(0.012376, abs=5e-7) == self.BEAM
        assert pytest.approx(self.CARRIER / 0.0000641, rel=0.001) == 10
        assert pytest.approx(self.TIP / 0.0000183, rel=0.002) == 10

    def test_coefficients_are_hertz(self):
        same = contact.contact_modulus_N_mm2(200.0, 0.0, 200.0, 0.0)
        ruby = contact.contact_modulus_N_mm2(620.0, 0.0, 200.0, 0.0)
        assert 1.5 * contact.ball_on_cylinder(1.0, 1.0, same) == pytest.approx(self.CARRIER, rel=2e-4)
        assert contact.ball_on_plane(4.0, ruby) == pytest.approx(self.TIP, rel=1e-4)

    def test_mean_force_and_mean_pretravel_do_not_belong_together(self):
        """0.082 N gives 1.02 um as printed and 1.10 um corrected, not the 3.17 um of the measurement."""
        printed, corrected = PretravelLaw(4.58e-5, 0.012376), pretravel.ren_law(self.CARRIER, self.BEAM, self.TIP)
        assert 1e3 * printed.pretravel_mm(0.082) == pytest.approx(1.02, abs=0.01)
        assert 1e3 * corrected.pretravel_mm(0.082) == pytest.approx(1.10, abs=0.01)
        assert corrected.force_N(3.17e-3) == pytest.approx(0.242, abs=0.001)

    def test_signs_differ_by_twice_the_indentation(self):
        laws = {sign: pretravel.ren_law(self.CARRIER, self.BEAM, self.TIP, sign) for sign in ("added", "subtracted")}
        gap = laws["added"].pretravel_mm(0.5) - laws["subtracted"].pretravel_mm(0.5)
        assert gap == pytest.approx(2 * float(contact.approach_mm(self.TIP, 0.5)))

    @given(st.floats(0, 100), st.floats(-5e-3, 5e-3), st.floats(1e-4, 1))
    def test_inverse_round_trip(self, force, hertz, beam):
        law = PretravelLaw(hertz, beam)
        travel = float(law.pretravel_mm(force))
        if travel > 1e-9:
            assert law.pretravel_mm(law.force_N(travel)) == pytest.approx(travel, rel=1e-9)
            assert law.force_N(travel) == pytest.approx(force, rel=1e-6)

    def test_inverse_of_arrays_and_against_bisection(self):
        law = pretravel.ren_law(self.CARRIER, self.BEAM, self.TIP)
        travel = np.array([0.0, 1e-6, 1e-4, 1e-3, 1e-2])
        found = law.force_N(travel)
        expected = [brentq(lambda f, w=w: law.pretravel_mm(f) - w, 0, 10, xtol=1e-15) for w in travel]
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)

    @pytest.mark.parametrize(("law", "travel"), [(PretravelLaw(1e-3, 0.0), 1e-3), (PretravelLaw(1e-3, 1e-3), -1e-3)])
    def test_inverse_refuses_what_has_none(self, law, travel):
        with pytest.raises(ValueError, match="inverse"):
            law.force_N(travel)


class TestSeats:
    def test_virtual_work(self):
        """Displacement times force is the work of the approaches: d(energy)/dF of the six Hertz springs."""
        direction, force, step = unit_vectors(0.4, 0.3), 0.5, 1e-5

        def energy(f):
            reactions = trigger.reactions_N(EXISTING, f * direction)
            return np.sum(0.6 * SOFT.seat_mm_per_N23 * reactions ** (5 / 3))

        derivative = (energy(force + step) - energy(force - step)) / (2 * step)
        rest = trigger.rest_reactions_N(EXISTING)
        preloaded = np.sum(
            trigger.reaction_slopes(EXISTING, direction) * contact.approach_mm(SOFT.seat_mm_per_N23, rest)
        )
        moved = pretravel.seat_displacement_mm(EXISTING, SOFT.seat_mm_per_N23, force, direction, direction)
        assert moved == pytest.approx(derivative - preloaded, rel=1e-6)

    def test_rigid_body_motion(self):
        """Solve the six rigid-body equations for the motion that the approaches force on the tripod."""
        push, normal, force = unit_vectors(1.1, 0.2), unit_vectors(1.4, 0.5), 0.6
        units, points = trigger.contact_normals(EXISTING), trigger.contact_points_mm(EXISTING)
        reactions = [trigger.reactions_N(EXISTING, f * push) for f in (0.0, force)]
        sink = np.subtract(*[contact.approach_mm(SOFT.seat_mm_per_N23, r) for r in reversed(reactions)])
        motion = np.linalg.solve(np.hstack([units, np.cross(points, units)]), -sink)
        tip = motion[:3] + np.cross(motion[3:], [0.0, 0.0, -EXISTING.lever_mm])
        found = pretravel.seat_displacement_mm(EXISTING, SOFT.seat_mm_per_N23, force, normal, push)
        assert found == pytest.approx(tip @ normal)

    def test_ren_lever_is_the_rigid_tilt_of_one_contact(self):
        """Ren's L / L_a: one arm of a tripod sinks, the tip moves by lever / (1.5 radius) of that."""
        steep = replace(EXISTING, contact_angle_rad=np.radians(89.9))
        twists = trigger.opening_twists(steep)
        tilt = twists[0] + twists[1]
        tip = tilt[:3] + np.cross(tilt[3:], [0.0, 0.0, -steep.lever_mm])
        assert np.hypot(tip[0], tip[1]) == pytest.approx(50.0 / (1.5 * 16.34), rel=1e-4)

    @given(pushes)
    def test_opening_is_geometry(self, direction):
        """The tip moves by the opening times the lever, whatever the forces are; the trigger force tells the same."""
        lever = pretravel.opening_lever(EXISTING, direction, direction)
        rest = trigger.rest_reactions_N(EXISTING)[0]
        assert lever == pytest.approx(rest / trigger.trigger_force_N(EXISTING, direction))


class TestTerms:
    def test_conventions(self):
        force = trigger.trigger_force_N(EXISTING, level(7))
        terms = pretravel.kinematic_terms(EXISTING, SOFT, force, level(7))
        rest = terms.transducer_mm + terms.stylus_mm
        np.testing.assert_allclose(terms.total_mm("added"), rest + terms.contact_mm)
        np.testing.assert_allclose(terms.total_mm("subtracted"), rest - terms.contact_mm)
        np.testing.assert_allclose(terms.total_mm("left out"), rest)
        assert terms.contact_mm.min() > 0

    def test_machine_reading_needs_the_indentation_added(self):
        """Three springs in a row, displaced by the machine until the force is there: the displacements add up."""
        force, normal = 0.8, np.array([1.0, 0.0, 0.0])

        def machine_travel(travel):
            def equal_forces(tip):
                indentation = travel - tip
                surface = (indentation / SOFT.tip_mm_per_N23) ** 1.5
                return surface - tip / SOFT.lateral_mm_per_N

            tip = brentq(equal_forces, 0.0, travel)
            return tip / SOFT.lateral_mm_per_N - force

        travel = brentq(machine_travel, 1e-6, 1.0)
        assert pretravel.elastic_terms(SOFT, force, normal).total_mm("added") == pytest.approx(travel)

    def test_inclined_surface_is_the_thesis_eq_3_2(self):
        """Sideways deflection d_s = d_f / cos(inclination to the vertical surface), d_f the machine's travel."""
        stiff_axis = Elasticity(lateral_mm_per_N=5e-3)
        inclination = np.radians(35.0)
        normal = unit_vectors(0.3, inclination)
        d_f = pretravel.elastic_terms(stiff_axis, 1.0, normal).total_mm()
        d_s = 5e-3 * np.cos(inclination)
        assert d_s == pytest.approx(d_f / np.cos(inclination))

    def test_wozniak_shape_of_a_piezo_probe(self):
        """Eq 4 with beta = 0: a stylus stiff along its axis gives A cos^2(gamma) at equal force."""
        elevation = np.radians(np.arange(0, 90, 9))
        terms = pretravel.elastic_terms(Elasticity(3e-3), np.full(10, 0.02), unit_vectors(0.5, elevation))
        np.testing.assert_allclose(terms.total_mm(), 6e-5 * np.cos(elevation) ** 2)

    def test_infinite_stiffness(self):
        force = trigger.trigger_force_N(EXISTING, normals())
        rigid = pretravel.kinematic_terms(EXISTING, Elasticity(0.0), force, normals())
        assert np.all(rigid.total_mm() == 0.0)

    def test_direction_that_never_triggers(self):
        down = np.array([0.0, 0.0, -1.0])
        terms = pretravel.kinematic_terms(EXISTING, SOFT, trigger.trigger_force_N(EXISTING, down), down)
        assert terms.total_mm() == np.inf
        assert terms.total_mm("subtracted") == np.inf

    @given(pushes)
    def test_120_degrees(self, normal):
        cos, sin = -0.5, np.sqrt(0.75)
        third = normal @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        totals = [
            pretravel.kinematic_terms(EXISTING, SOFT, trigger.trigger_force_N(EXISTING, n), n).total_mm()
            for n in (normal, third)
        ]
        assert totals[0] == pytest.approx(totals[1])


def test_piezo_threshold():
    directions = unit_vectors(0.7, np.radians([0.0, 90.0, 45.0]))
    force = pretravel.piezo_force_N(directions, 0.02, 0.08)
    np.testing.assert_allclose(force[:2], [0.02, 0.08])
    assert (force[2] ** 2 / 2) * (1 / 0.02**2 + 1 / 0.08**2) == pytest.approx(1)
    np.testing.assert_allclose(pretravel.piezo_force_N(directions, 0.05, 0.05), 0.05)

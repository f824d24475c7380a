"""The stylus: uniform and stepped beams against closed forms and a numerical integration of the beam equation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from stepgauge.physics import stylus
from stepgauge.physics.stylus import StylusSection

CERAMIC = StylusSection(50.0, 4.5, 413.0)
STEPPED = [
    StylusSection(12.0, 7.0, 193.0, 0.3),
    StylusSection(30.0, 3.0, 620.0, 0.22),
    StylusSection(8.0, 1.5, 400.0, 0.25),
]

lengths = st.floats(1, 100)
sections = st.lists(st.builds(StylusSection, lengths, st.floats(0.5, 10), st.floats(50, 800)), min_size=1, max_size=5)


def test_uniform_beam():
    expected = 50**3 / (3 * 413e3 * np.pi * 4.5**4 / 64)
    assert stylus.bending_compliance_mm_per_N([CERAMIC]) == pytest.approx(expected)
    assert 1e3 * expected == pytest.approx(5.012, abs=0.001)


def test_ren_beam():
    """Ren Eq 13: 0.012376 mm/N for 18 mm of 2 mm steel."""
    assert stylus.bending_compliance_mm_per_N([StylusSection(18.0, 2.0, 200.0)]) == pytest.approx(0.012376, abs=5e-7)


@given(sections, st.floats(0.05, 0.95))
def test_cutting_a_section_changes_nothing(parts, at):
    first = parts[0]
    cut = [
        StylusSection(at * first.length_mm, first.diameter_mm, first.modulus_GPa),
        StylusSection((1 - at) * first.length_mm, first.diameter_mm, first.modulus_GPa),
        *parts[1:],
    ]
    for compliance in (
        stylus.bending_compliance_mm_per_N,
        stylus.shear_compliance_mm_per_N,
        stylus.axial_compliance_mm_per_N,
        stylus.centre_of_mass_mm,
    ):
        assert compliance(cut) == pytest.approx(compliance(parts))


def test_stepped_beam_solves_the_beam_equation():
    """E I w'' = F (L - x), integrated section by section."""
    length, x, state = stylus.length_mm(STEPPED), 0.0, [0.0, 0.0]
    for section in STEPPED:
        rigidity = section.modulus_N_mm2 * section.second_moment_mm4
        end = x + section.length_mm
        solution = solve_ivp(lambda x, y, b=rigidity: [y[1], (length - x) / b], (x, end), state, rtol=1e-10, atol=1e-16)
        x, state = end, solution.y[:, -1]
    assert stylus.bending_compliance_mm_per_N(STEPPED) == pytest.approx(state[0], rel=1e-8)


def test_sag_solves_the_beam_equation():
    """The same integration under the stylus' own weight, lying level."""
    heavy = [
        StylusSection(20.0, 6.0, 193.0, density_kg_m3=7900.0),
        StylusSection(40.0, 2.0, 620.0, density_kg_m3=15600.0),
    ]
    loads = [s.mass_kg * stylus.GRAVITY_M_S2 / s.length_mm for s in heavy]

    def moment(x):
        inner, outer = max(20.0 - x, 0.0), 60.0 - max(x, 20.0)
        return loads[0] * inner**2 / 2 + loads[1] * outer * (max(x, 20.0) - x + outer / 2)

    x, state = 0.0, [0.0, 0.0]
    for section in heavy:
        rigidity = section.modulus_N_mm2 * section.second_moment_mm4
        end = x + section.length_mm
        bend = solve_ivp(lambda x, y, b=rigidity: [y[1], moment(x) / b], (x, end), state, rtol=1e-10, atol=1e-18)
        x, state = end, bend.y[:, -1]
    assert stylus.sag_mm(heavy) == pytest.approx(state[0], rel=1e-7)


def test_sag_of_a_uniform_beam():
    beam = StylusSection(60.0, 3.0, 200.0, density_kg_m3=7900.0)
    load = beam.mass_kg * stylus.GRAVITY_M_S2 / 60.0
    expected = load * 60.0**4 / (8 * beam.modulus_N_mm2 * beam.second_moment_mm4)
    assert stylus.sag_mm([beam]) == pytest.approx(expected)


def test_shear_of_a_solid_round_bar():
    """Cowper: kappa = 6 (1 + nu) / (7 + 6 nu); a thin tube has 2 (1 + nu) / (4 + 3 nu)."""
    assert StylusSection(1.0, 2.0, 200.0, 0.3).shear_coefficient == pytest.approx(6 * 1.3 / 8.8)
    thin = StylusSection(1.0, 2.0, 200.0, 0.3, bore_mm=1.99999)
    assert thin.shear_coefficient == pytest.approx(2 * 1.3 / 4.9, rel=1e-4)


def test_shear_fades_for_slender_styli_and_rules_short_ones():
    def share(length):
        parts = [StylusSection(length, 4.0, 400.0, 0.25)]
        return stylus.shear_compliance_mm_per_N(parts) / stylus.bending_compliance_mm_per_N(parts)

    assert share(100.0) == pytest.approx(share(50.0) / 4)
    assert share(200.0) < 5e-4
    assert share(2.0) > 1


def test_tip_moves_with_the_force_across_and_along():
    moved = stylus.tip_displacement_mm(STEPPED, np.array([[1.0, 0, 0], [0, 2.0, 0], [0, 0, 3.0]]))
    lateral, axial = stylus.lateral_compliance_mm_per_N(STEPPED), stylus.axial_compliance_mm_per_N(STEPPED)
    np.testing.assert_allclose(moved, np.diag([lateral, 2 * lateral, 3 * axial]))
    assert axial < 0.01 * lateral


def test_rigid_stylus_does_not_move():
    rigid = [StylusSection(50.0, 4.5, np.inf)]
    assert stylus.lateral_compliance_mm_per_N(rigid) == 0.0
    assert stylus.axial_compliance_mm_per_N(rigid) == 0.0


def test_deflection_along_the_beam():
    """Ren Eq 8: nothing at the root, the tip's compliance at the tip, and F x^2 (3L - x) / 6EI between."""
    along = stylus.uniform_deflection_mm(CERAMIC, 2.0, np.array([0.0, 25.0, 50.0]))
    tip = 2 * stylus.bending_compliance_mm_per_N([CERAMIC])
    np.testing.assert_allclose(along, [0.0, tip * 5 / 16, tip])


def test_mass_and_its_centre():
    parts = [
        StylusSection(10.0, 2.0, 200.0, density_kg_m3=8000.0),
        StylusSection(10.0, 2.0, 200.0, density_kg_m3=4000.0),
    ]
    assert stylus.mass_kg(parts) == pytest.approx(np.pi * 10 * 12000e-9)
    assert stylus.centre_of_mass_mm(parts) == pytest.approx((2 * 5 + 15) / 3)


@pytest.mark.parametrize("wrong", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 2.0)])
def test_sections_without_body_are_refused(wrong):
    length, diameter, bore = wrong
    with pytest.raises(ValueError, match="section"):
        StylusSection(length, diameter, 200.0, bore_mm=bore)


def test_no_sections_no_stylus():
    with pytest.raises(ValueError, match="at least one"):
        stylus.bending_compliance_mm_per_N([])

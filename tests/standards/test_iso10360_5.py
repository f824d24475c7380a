"""Probing performance: spheres of known form, size and place, found again; the smallest sphere by another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares, minimize

from stepgauge.conditions.decision import INCOMPLETE
from stepgauge.errors import InputError
from stepgauge.files.tables import Rows
from stepgauge.physics.directions import five_points, iso_10360_5_points, probe_frame
from stepgauge.probes.files import ProbedPoints
from stepgauge.standards.iso10360_5 import ProbingLimits, TestSphere, enclosing_radius, probing_test, rules_of
from stepgauge.standards.iso10360_5_files import decide_test, probing_to_dict

SPHERE = TestSphere(25.0, 0.1, 0.2, 0.05)
TIP_MM = 4.0
WAYS = five_points() * [1.0, 1.0, 1.0]
Array = np.ndarray


def probed(radial_um: Array | float = 0.0, axis: Array | None = None, centre_um: Array | float = 0.0, name: str = "p"):
    """The 25 points with these radial deviations, the pole along ``axis``, of a sphere moved by ``centre_um``."""
    normals = iso_10360_5_points() @ probe_frame(tuple((0.0, 0.0, 1.0) if axis is None else axis))
    reach = 12.5 + TIP_MM / 2.0 + np.broadcast_to(radial_um, 25) * 1e-3
    return ProbedPoints(Rows(name, [], [], []), normals * reach[:, None] + np.asarray(centre_um) * 1e-3, -normals)


def values(test) -> dict[str, float]:
    return {one.name: one.value_um for one in test.values}


@given(st.integers(0, 2**32 - 1))
def test_form_and_size_against_an_independent_fit(seed: int) -> None:
    off = np.random.default_rng(seed).normal(0.0, 2.0, 25)
    points = probed(off)
    found = values(probing_test([points], SPHERE, [TIP_MM]))
    normals = -points.approach
    surface = points.position_mm - normals * TIP_MM / 2.0  # the fitted normals differ from these by micrometres
    fit = least_squares(
        lambda p: np.linalg.norm(surface - p[:3], axis=1) - p[3], [0.0, 0.0, 0.0, 12.0], xtol=1e-15, gtol=1e-15
    )
    radial = np.linalg.norm(surface - fit.x[:3], axis=1)
    assert found["P_Form"] == pytest.approx(1e3 * np.ptp(radial), abs=2e-3)
    assert found["P_Size"] == pytest.approx(1e3 * (2.0 * fit.x[3] - 25.0), abs=2e-3)


def test_a_tip_qualified_too_small_is_an_error_of_size_and_none_of_form() -> None:
    found = values(probing_test([probed()], SPHERE, [TIP_MM - 3e-3]))
    assert found == pytest.approx({"P_Form": 0.0, "P_Size": 3.0}, abs=1e-6)


def five(centres_um: Array) -> list[ProbedPoints]:
    pairs = zip(WAYS, centres_um, strict=True)
    return [probed(0.0, way, centre, f"stylus {i}") for i, (way, centre) in enumerate(pairs)]


def test_five_styli_of_known_places() -> None:
    """Two centres 6 um apart, the others between them: L_Dia is 6 um, and so is the range of x."""
    centres = np.array([[3.0, 0, 0], [-3.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0, 0, 0]])
    test = probing_test(five(centres), SPHERE, [TIP_MM])
    assert values(test)["L_Dia"] == pytest.approx(6.0, abs=1e-6)
    np.testing.assert_allclose(test.ranges_um(), [6.0, 1.0, 1.0], atol=1e-6)
    assert [one.symbol for one in test.values] == [
        "P_Form.Sph.5x25:MS:Tact", "P_Size.Sph.5x25:MS:Tact", "L_Dia.5x25:MS:Tact",
    ]  # fmt: skip
    assert values(test)["P_Form"] > 3.0
    same = probing_test(five(np.zeros((5, 3))), SPHERE, [TIP_MM])
    assert values(same) == pytest.approx({"P_Form": 0.0, "P_Size": 0.0, "L_Dia": 0.0}, abs=1e-6)
    assert [rule.met for rule in rules_of(same)] == [True, True, True, True, None]


def test_the_sphere_around_a_tetrahedron() -> None:
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    assert enclosing_radius(corners) == pytest.approx(np.sqrt(3.0))
    assert enclosing_radius([[0.0, 0, 0]] * 3) == 0.0


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_the_smallest_sphere_by_minimisation(seed: int) -> None:
    points = np.random.default_rng(seed).normal(0.0, 1.0, (5, 3))
    square = (points**2).sum(axis=1)  # |p - c|^2 <= q + |c|^2 is linear in c and q
    room = {"type": "ineq", "fun": lambda x: x[3] - square + 2.0 * points @ x[:3]}
    start = np.append(np.zeros(3), square.max())
    options = {"ftol": 1e-14, "maxiter": 500}
    found = minimize(lambda x: x[3] + x[:3] @ x[:3], start, constraints=[room], method="SLSQP", options=options)
    assert enclosing_radius(points) == pytest.approx(np.sqrt(found.fun), rel=1e-5)


def test_decisions_need_the_uncertainty_of_the_sphere() -> None:
    """u(P_Form) = sqrt(0.1^2 + 0.05^2) = 0.1118 um of a form error of 0.2 um; U = 0.2236 um."""
    off = np.where(np.arange(25) % 2, 1.0, -1.0)
    limits = ProbingLimits({"P_Form": 2.4, "P_Size": 1.0, "L_Dia": None})
    test = probing_test([probed(off)], SPHERE, [TIP_MM], limits)
    form, size = test.values
    assert form.expanded_um == pytest.approx(2.0 * np.hypot(0.1, 0.05))
    assert size.outcome == "conforms"
    assert test.outcome == form.outcome
    assert "Decision rule: ISO 14253-1" in decide_test(test).text
    bare = probing_test([probed(off)], TestSphere(25.0), [TIP_MM], limits)
    assert bare.outcome is None
    assert len(bare.missing) == 2
    assert "Conformity is not proven" in decide_test(bare).text
    assert "No statement of conformity" in decide_test(probing_test([probed(off)], SPHERE, [TIP_MM])).text
    assert "computed, not measured" in decide_test(probing_test([probed()], SPHERE, [TIP_MM], limits)).text
    assert decide_test(test).text.startswith(INCOMPLETE)
    whole = probing_test([probed(off)], replace(SPHERE, another=True), [TIP_MM], limits)
    assert decide_test(whole).text.startswith("The probing performance conforms.")
    assert "Open" not in decide_test(whole).text
    half = probing_test([probed(off)], replace(SPHERE, another=True), [TIP_MM], ProbingLimits({"P_Form": 2.4}))
    assert "Open: P_Size: no limit stated." in decide_test(half).text
    assert probing_to_dict(test)["standard"] == "ISO 10360-5:2020"


def test_points_on_a_cap_do_not_cover_the_hemisphere() -> None:
    points = probed()
    high = points.position_mm[:, 2] > 9.0
    cap = ProbedPoints(points.rows, points.position_mm[high], points.approach[high])
    met = {rule.asks.split(" (")[0]: rule.met for rule in rules_of(probing_test([cap], SPHERE, [TIP_MM]))}
    assert met["25 points"] is False
    assert met["points spread over at least a hemisphere"] is False


def test_points_that_lie() -> None:
    with pytest.raises(InputError, match="contradict sphere_diameter"):
        probing_test([probed()], SPHERE, [TIP_MM / 2.0])
    with pytest.raises(InputError, match="the same points as p"):
        probing_test([probed(), probed(name="q")], SPHERE, [TIP_MM])
    with pytest.raises(InputError, match="one for all styli or one for each"):
        probing_test([probed()], SPHERE, [TIP_MM, TIP_MM])
    points = probed()
    with pytest.raises(InputError, match="from within"):
        probing_test([ProbedPoints(points.rows, points.position_mm, -points.approach)], SPHERE, [TIP_MM])

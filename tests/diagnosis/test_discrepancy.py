"""Laws of processes that hold to some per cent: what they leave out is no further cause."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.laws.discrepancy import MOST_AMPLITUDES, UnobservedCourses
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.problem import make_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.diagnosis.wording.phrases import worded_all
from stepgauge.inference.search import Search
from tests.diagnosis.made import gauge, machine, made
from tests.diagnosis.test_selection import BETWEEN, NOISE_UM, along, bent, told

Array = NDArray[np.float64]
TIME = np.linspace(0.0, 1.0, 301)
CONSTANTS = np.geomspace(0.02, 2.0, 20)
WARMING = np.array([-np.expm1(-TIME / constant) for constant in CONSTANTS])[:, None]
ALONG_Y_MOSTLY = (0.3, 0.95, 0.0)


def two_bodies(t: Array, share: float = 0.05) -> Array:
    """The second body follows the first with a time constant that is a ``share`` of its own."""
    first = 0.6 * np.ptp(t)
    second = share * first
    since = t - t.min()
    return 1.0 - (first * np.exp(-since / first) - second * np.exp(-since / second)) / (first - second)


def square_wave(t: Array) -> Array:
    """A heater behind three lags: a sine with a third harmonic of some per cent."""
    period_s = np.ptp(t) / 6.5
    phase = 2.0 * np.pi * t / period_s
    return np.sin(phase) + 0.04 * np.sin(3.0 * phase + 0.4)


@given(atom=st.integers(0, len(CONSTANTS) - 1), scale=st.floats(1e-3, 1e3))
@settings(max_examples=20, deadline=None)
def test_what_a_shape_becomes_by_others_is_none_of_itself_and_as_large_as_it(atom: int, scale: float) -> None:
    beside = UnobservedCourses(scale * WARMING).beside(atom)
    own = scale * WARMING[atom, 0]
    assert 0 < len(beside) <= MOST_AMPLITUDES
    assert_allclose(beside @ own, 0.0, atol=2e-3 * (own @ own))  # but for what the courses leave out
    unit = UnobservedCourses(WARMING).beside(atom)
    assert_allclose(beside.T @ beside, scale**2 * unit.T @ unit, atol=1e-9 * np.abs(own).max() ** 2)
    assert np.linalg.norm(beside) < np.linalg.norm(own)


@pytest.mark.parametrize("share", [0.01, 0.03, 0.05])
def test_a_second_time_constant_is_in_the_span(share: float) -> None:
    """The exact solution of two bodies in series, less its best single exponential, is nearly a sum of the courses."""
    truth = two_bodies(TIME, share)
    atom = int(np.argmin(np.abs(CONSTANTS - 0.6)))
    span = np.vstack([WARMING[atom], UnobservedCourses(WARMING).beside(atom)])

    def left(columns: Array) -> float:
        return float(np.linalg.norm(truth - np.linalg.lstsq(columns.T, truth, rcond=None)[0] @ columns))

    assert left(span) < 0.1 * left(WARMING[atom])


def exactly() -> Priors:
    """Priors by which every law has exactly its shape."""
    shipped = shipped_priors()
    return shipped.model_copy(update={"laws": shipped.laws.model_copy(update={"discrepancy": 0.0})})


def by(priors: Priors, um: float, direction: tuple[float, float, float] = ALONG_Y_MOSTLY) -> GaugeDiagnosis:
    recording = bent(along(direction, lambda t: um * two_bodies(t)))
    return diagnose(recording, gauge(), machine(noise_um=NOISE_UM), priors=priors)


@pytest.mark.parametrize("um", [30.0, 300.0])
def test_a_drift_of_two_bodies_is_one_drift_however_large(um: float) -> None:
    """At 100 and at 1000 times the scatter, where what its shape leaves out is seen."""
    found = by(shipped_priors(), um)
    assert [one.kind for one in found.findings] == ["thermal_drift"]
    assert not found.unexplained
    assert found.fit.chi2_dof_after < 1.15
    assert um < 100.0 or any("thermal drift is not exactly of this shape" in one for one in worded_all(found.remarks))


def test_laws_that_must_be_exact_do_not_name_a_large_drift() -> None:
    """By other priors, what a law leaves out is told by something that nothing in the machine is."""
    exact = by(exactly(), 300.0)
    assert [one.kind for one in exact.findings] != ["thermal_drift"]
    assert exact.unexplained


def test_a_small_drift_is_told_as_by_an_exact_law() -> None:
    """Of what is ten times the scatter the tolerance is nothing: the same value, and no remark."""
    found, exact = by(shipped_priors(), 3.0, BETWEEN), by(exactly(), 3.0, BETWEEN)
    for one in (found, exact):
        assert [finding.kind for finding in one.findings] == ["thermal_drift"]
        assert not any("exactly of this shape" in remark for remark in worded_all(one.remarks))
    rates = [one.findings[0].parameters["rate_um_per_h"] for one in (found, exact)]
    assert rates[1].u is not None
    assert abs(rates[0].value - rates[1].value) < 0.2 * rates[1].u
    assert abs(found.findings[0].probability - exact.findings[0].probability) < 0.05


def test_the_harmonics_of_a_cycle_are_no_further_cycles() -> None:
    found = told(bent(along(ALONG_Y_MOSTLY, lambda t: 15.0 * square_wave(t))))
    assert [one.kind for one in found.findings] == ["temperature_cycle"]
    assert not found.unexplained


def test_what_is_more_than_a_tolerance_is_a_cause_of_its_own() -> None:
    """A step of a fifth of a drift is not put down to the drift."""

    def course(t: Array) -> Array:
        return 10.0 * two_bodies(t, 0.02) + 2.0 * (t > t.min() + 0.55 * np.ptp(t))

    found = told(bent(along(ALONG_Y_MOSTLY, course)))
    assert {one.kind for one in found.findings} == {"thermal_drift", "step_change"}


def test_what_a_law_leaves_out_is_in_proportion_to_what_it_is() -> None:
    """A drift that might have been large, and is small, leaves no more out: a cycle beside it is a cause."""
    recording, _ = made("pair")
    data = make_residuals(recording, gauge(), machine())
    search = Search(make_problem(data, shipped_priors()), shipped_priors().scatter)
    search.run()
    states = [one for one in search.evidence.current if any(len(term.discrepancy) for term in one.terms)]
    assert len(states) > 20
    for state in states:
        for place, term in enumerate(state.terms):
            if len(term.discrepancy):
                amplitude = float(np.linalg.norm(state.amplitudes(place)[0]))
                assert term.discrepancy_sd is not None
                assert 0.5 * amplitude <= term.discrepancy_sd <= 2.0 * amplitude

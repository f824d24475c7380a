"""Recordings as loggers write them: clocks that start anew or count from 1970, columns of any name, few rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.diagnosis.fits.solve import solve
from stepgauge.diagnosis.laws.library import effect_families
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.diagnosis.wording.phrases import worded_all
from stepgauge.effects import Probings, Setting, along_approach_um
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X, gauge, machine, made
from tests.diagnosis.test_selection import NOISE_UM, along, bent, clean, names, side, told


def test_a_clock_that_starts_anew_in_every_placement_loses_no_history() -> None:
    recording = clean()
    frame = recording.frame.copy()
    frame["time_s"] -= frame.groupby("placement")["time_s"].transform("min")
    setting = Setting.of(machine(), gauge())
    one, anew = Probings(recording.frame, setting), Probings(frame, setting)
    np.testing.assert_array_equal(anew.way(), one.way())
    np.testing.assert_allclose(anew.since_turning_mm(), one.since_turning_mm())
    np.testing.assert_array_equal(anew.touches_since_pause(20.0), one.touches_since_pause(20.0))
    first = frame.groupby("placement")["time_s"].idxmin().to_numpy()
    others = np.setdiff1d(np.arange(len(frame)), first)
    np.testing.assert_allclose(anew.rest_s()[others], one.rest_s()[others])


@pytest.mark.parametrize("name", ["c1", "room humidity %"])
def test_a_column_of_any_name_is_told_and_never_taken_for_another(name: str) -> None:
    recording, random = clean(), np.random.default_rng(11)
    values = random.normal(40.0, 3.0, len(recording.frame))
    moved = bent(lambda _: 0.8 * (values - 40.0), replace(recording, frame=recording.frame.assign(**{name: values})))
    found = told(moved)
    assert found.verdict == "unknown"
    assert any(name in one.covariate for one in found.located)
    for law in found.forms:
        left = moved.frame[name].to_numpy() - 40.0
        assert np.corrcoef(law.share_um, left)[0, 1] > 0.95


def test_few_rows_without_repeats_are_insufficient_and_no_more() -> None:
    once = clean()
    few = replace(once, frame=once.frame.iloc[:16].reset_index(drop=True))
    assert told(few).verdict in ("insufficient", "adequate")


def test_a_parameter_at_its_bound_has_no_uncertainty() -> None:
    """A ramp fitted by a drift that must level off: its time constant is the longest tried, which nobody measured."""
    ramp = bent(lambda r: 0.02 * r.frame["time_s"].to_numpy() * r.frame["approach_i"].to_numpy())
    data = make_residuals(ramp, gauge(), machine(noise_um=NOISE_UM))
    (law,) = (one for one in effect_families(data, shipped_priors()) if one.label == "thermal_drift_x")
    longest = max(range(len(law.atoms)), key=lambda i: law.atoms[i]["time_constant_h"] or 0.0)
    (solved,) = solve([law], [longest], data, white(data)).solved
    constant = solved.parameters["time_constant_h"]
    assert constant.value == pytest.approx(law.ranges["time_constant_h"][1], rel=0.5)
    assert constant.u is None


def white(data: Residuals) -> Metric:
    """What makes residuals with the noise of these recordings independent numbers."""
    problem = bare_problem(data)
    scatters = NoiseModels(problem, shipped_priors().scatter)
    return Metric(problem, scatters.plain(), scatters, NOISE_UM)


@pytest.mark.parametrize("seed", range(2))
def test_no_step_of_a_fit_lets_time_run_backwards(seed: int) -> None:
    """Scatter says nothing of a time constant: the search wanders, and a warning of an overflow would be an error."""
    random = np.random.default_rng(seed)
    scatter = bent(lambda r: random.normal(0.0, 5.0 * NOISE_UM, len(r.frame)), clean(pause_s=35.0))
    data = make_residuals(scatter, gauge(), machine(noise_um=NOISE_UM))
    whitening = white(data)
    laws = {
        one.label: one
        for one in effect_families(data, shipped_priors())
        if one.kind in ("thermal_drift", "approach_memory")
    }
    for law in laws.values():
        shaped = [number for number, atom in enumerate(law.atoms) if None not in atom.values()]
        for atom in (shaped[0], shaped[-1]):
            (solved,) = solve([law], [atom], data, whitening).solved
            assert all(solved.parameters[name].value > 0.0 for name in law.atoms[atom])


def test_a_law_keeps_its_name_beside_structure_without_one() -> None:
    recording: Recording = made("scale")[0]
    wander = np.cumsum(np.random.default_rng(4).normal(0.0, 0.15, len(recording.frame)))
    found = told(
        bent(lambda r: 8.0 * np.sin(2.0 * np.pi * r.frame["time_s"].to_numpy() / 217.0) * side(r) + wander * side(r))
    )
    assert "temperature_cycle" in names(found)
    assert found.fit.rms_after_um < 0.2 * found.fit.rms_before_um


SINCE_1970_S = 1.76e9


def test_a_drift_is_a_drift_whatever_the_clock_read() -> None:
    """From the clock's nought it would be all but a constant."""
    drifting = bent(along(ALONG_X, lambda t: 9.0 * t / 3600.0))
    found = [told(one) for one in (drifting, later(drifting, SINCE_1970_S))]
    assert [names(one) for one in found] == [["thermal_drift"]] * 2
    rates = [one.findings[0].parameters["rate_um_per_h"].value for one in found]
    assert rates[1] == pytest.approx(rates[0], rel=0.02)  # a rate at the first touch, and one at nought
    first_s = float(drifting.frame["time_s"].min())
    assert found[1].findings[0].choices["start_s"] == pytest.approx(SINCE_1970_S + first_s)
    assert "of the clock" in worded_all(found[1].remarks)[-1]


def test_a_swing_is_told_with_the_phase_that_the_clock_gives_it() -> None:
    swinging = later(bent(along(ALONG_X, lambda t: 1.5 * np.sin(2.0 * np.pi * t / 217.0 + 0.4))), SINCE_1970_S)
    (found,) = told(swinging).findings
    assert found.kind == "temperature_cycle"
    data = make_residuals(swinging, gauge(), machine(noise_um=NOISE_UM))
    np.testing.assert_allclose(along_approach_um(found.effect, data.probings), found.share_um, atol=1e-4)
    phase = found.parameters["phase_deg"]
    assert phase.u is None or phase.u > 1.0  # the period carries its uncertainty through all turns since


def later(recording: Recording, start_s: float) -> Recording:
    return replace(recording, frame=recording.frame.assign(time_s=recording.frame["time_s"] + start_s))

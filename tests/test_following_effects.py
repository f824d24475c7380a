"""What follows a recorded temperature: against the solution of its differential equation, and by hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from stepgauge.effects import Probings, Setting, make_effects, total_displacement_um
from stepgauge.effects.probings import followed
from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine

GAUGE, MACHINE = read_gauge("step-gauge-420"), read_machine("bridge-cmm")
MINUTES = np.arange(0.0, 14400.0, 30.0)


def bend(table: dict, **columns: object) -> np.ndarray:
    """Displacement in machine axes, um, (n, 3), of rows every half a minute at x = 400 mm along +x."""
    start = {
        "face": 1,
        "x_mm": 400.0,
        "y_mm": 100.0,
        "z_mm": 50.0,
        "approach_i": 1.0,
        "approach_j": 0.0,
        "approach_k": 0.0,
    }
    frame = pd.DataFrame({"time_s": MINUTES} | start | columns)
    setting = Setting.of(MACHINE, GAUGE, {1: np.array([1.0, 0.0, 0.0])})
    return total_displacement_um(make_effects([table], "machine.toml"), Probings(frame, setting))


SHIFT = {"kind": "thermal_shift", "column": "air_C", "direction": "x", "um_per_K": 3.0}


def test_the_origin_moves_with_the_temperature_along_its_direction() -> None:
    air = 20.0 + 0.5 * np.sin(MINUTES / 900.0)
    assert_allclose(bend(SHIFT, air_C=air)[:, 0], 1.5 * np.sin(MINUTES / 900.0), atol=1e-12)
    slanted = bend(SHIFT | {"direction": [0.0, 3.0, 4.0]}, air_C=21.0)
    assert_allclose(slanted, np.tile([0.0, 1.8, 2.4], (len(MINUTES), 1)))
    assert_allclose(bend(SHIFT | {"from_C": 15.0}, air_C=21.0)[:, 0], 18.0)


def test_a_body_with_a_time_constant_answers_a_jump_by_an_exponential() -> None:
    """Between two readings a jump is a ramp: the difference of the answers to two ramps that begin at either."""
    air = np.where(MINUTES >= 1500.0, 21.0, 20.0)
    got = bend(SHIFT | {"lag_s": 1200.0}, air_C=air)[:, 0]
    between = float(MINUTES[1] - MINUTES[0])
    since = np.maximum(MINUTES[:, None] - [1500.0 - between, 1500.0], 0.0)
    ramps = since + 1200.0 * np.expm1(-since / 1200.0)
    assert_allclose(got, 3.0 * (ramps[:, 0] - ramps[:, 1]) / between, atol=1e-12)
    waited = MINUTES[MINUTES >= 1500.0] - 1500.0
    assert_allclose(3.0 - got[MINUTES >= 1500.0], (3.0 - got[MINUTES == 1500.0]) * np.exp(-waited / 1200.0))


def test_a_swing_is_followed_smaller_and_later() -> None:
    """First-order lag of a slow sine: amplitude 1 / sqrt(1 + (w lag)^2), late by atan(w lag)."""
    rate, lag = 2.0 * np.pi / 3600.0, 900.0
    got = bend(SHIFT | {"lag_s": lag}, air_C=20.0 + np.sin(rate * MINUTES))[:, 0]
    expected = 3.0 / np.hypot(1.0, rate * lag) * np.sin(rate * MINUTES - np.arctan(rate * lag))
    late = 8.0 * lag < MINUTES
    assert_allclose(got[late], expected[late], atol=0.05)


def test_a_gradient_is_one_column_minus_another_each_as_late() -> None:
    above, below = 21.0 + MINUTES * 1e-4, 20.5 + MINUTES * 5e-5
    table = SHIFT | {"minus": "below_C", "lag_s": 600.0}
    got = bend(table, air_C=above, below_C=below)
    alone = bend(SHIFT | {"lag_s": 600.0}, air_C=above - below + 20.0)
    assert_allclose(got, alone, atol=1e-12)
    assert not bend(table, air_C=above, below_C=above).any()


def test_scale_and_gauge_grow_from_their_zeros() -> None:
    grown = {"kind": "thermal_expansion_of", "column": "air_C", "um_per_m_K": 11.5}
    assert_allclose(bend(grown | {"of": "x"}, air_C=22.0)[0], [9.2, 0.0, 0.0])
    assert_allclose(bend(grown | {"of": "y"}, air_C=22.0)[0], [0.0, 2.3, 0.0])
    face = np.full(len(MINUTES), 41)
    expected = 23.0 * GAUGE.position_mm[40] * 1e-3
    assert_allclose(bend(grown | {"of": "gauge"}, air_C=22.0, face=face)[0], [expected, 0.0, 0.0])


def test_it_is_the_scale_temperature_that_nobody_corrected() -> None:
    """A scale 2 K warmer than recorded reads short by its expansion."""
    warm = bend({"kind": "scale_temperature", "axis": "x", "delta_K": 2.0})
    grown = {"kind": "thermal_expansion_of", "column": "air_C", "of": "x", "um_per_m_K": -11.5}
    assert_allclose(bend(grown, air_C=22.0), warm)


def test_a_gradient_bends_a_guideway_and_pitches_its_carriage_alike() -> None:
    """Steel, 2 K over 0.5 m of height: curvature alpha g; bow alpha g x^2 / 2 and pitch alpha g x about y."""
    curvature = 11.5 * 2.0 / 0.5
    bent = {"kind": "thermal_bending", "column": "above_C", "minus": "below_C", "axis": "x"}
    bow = bend(bent | {"component": "z", "order": 2, "per_K": curvature / 4.0}, above_C=22.0, below_C=20.0)[0]
    pitch = bend(bent | {"component": "ry", "order": 1, "per_K": curvature / 2.0}, above_C=22.0, below_C=20.0)[0]
    assert_allclose(bow, [0.0, 0.0, curvature / 2.0 * 0.4**2])
    assert_allclose(pitch, [curvature * 0.4 * 0.05, 0.0, 0.0])  # arm z = 50 mm


def test_a_scale_warms_after_its_event_and_not_before() -> None:
    got = bend({"kind": "scale_warm_up", "axis": "x", "um_per_m": 10.0, "time_constant_h": 0.25, "start_s": 1800.0})
    hours = (MINUTES - 1800.0) / 3600.0
    assert_allclose(got[:, 0], np.where(hours > 0, -4.0 * np.expm1(-hours / 0.25), 0.0), atol=1e-12)


def test_a_reversed_gauge_has_its_mirror_image() -> None:
    """The last face is the first one: nothing at both ends, alike about the middle, and nothing twice reversed."""
    reversed_, faces = {"kind": "gauge_reversed"}, GAUGE.position_mm
    off = [bend(reversed_, face=np.full(len(MINUTES), face))[0, 0] for face in range(1, len(faces) + 1)]
    assert (off[0], off[-1]) == (0.0, 0.0)
    assert_allclose(off, off[::-1], atol=1e-9)
    assert_allclose(np.add(faces * 1e3, off), (faces[-1] - faces)[::-1] * 1e3, atol=1e-9)


def test_a_gauge_soaks_from_its_event_on_and_anew_anew() -> None:
    """23 um of a metre and 2 K at once, 1 / e of it after a time constant; nothing before."""
    face, soaking = np.full(len(MINUTES), 41), {"kind": "gauge_soaking", "delta_K": 2.0, "time_constant_h": 0.25}
    whole, hours = 23.0 * GAUGE.position_mm[40] * 1e-3, (MINUTES - 1800.0) / 3600.0
    once = bend(soaking | {"start_s": 1800.0}, face=face)[:, 0]
    assert_allclose(once, np.where(hours >= 0.0, whole * np.exp(-hours / 0.25), 0.0), atol=1e-12)
    placement = 1 + (MINUTES >= 1800.0)
    anew = bend(soaking | {"warmed": "anew"}, face=face, placement=placement)[:, 0]
    since = np.where(placement == 1, MINUTES - MINUTES[0], MINUTES - MINUTES[placement == 2].min())
    assert_allclose(anew, whole * np.exp(-since / 900.0), atol=1e-12)


@pytest.mark.parametrize("time_constant", [{}, {"time_constant_h": 0.2}])
def test_a_drift_begins_at_its_event(time_constant: dict) -> None:
    drift = {"kind": "thermal_drift", "direction": "y", "rate_um_per_h": 8.0, "start_s": 3000.0} | time_constant
    got = bend(drift)[:, 1]
    assert not got[MINUTES <= 3000.0].any()
    soon = got[MINUTES == 3030.0] / (30.0 / 3600.0)
    assert soon == pytest.approx(8.0, rel=0.03)


def test_a_year_is_a_period() -> None:
    year = {"kind": "temperature_cycle", "direction": "x", "amplitude_um": 4.0, "period_s": 365.25 * 86400.0}
    assert_allclose(bend(year, time_s=MINUTES * 0.0 + 365.25 * 86400.0 / 4.0)[:, 0], 4.0)


def test_a_column_that_was_not_recorded_is_named() -> None:
    with pytest.raises(InputError, match="no column 'air_C'"):
        bend(SHIFT)


def test_a_body_follows_what_changes_steadily_as_its_equation_says() -> None:
    """dT'/dt = (T - T') / lag for T = rate t: T' = rate (t - lag (1 - exp(-t / lag))), whatever the rows are."""
    random = np.random.default_rng(5)
    time, lags = np.append(random.uniform(0.0, 3000.0, 200), 0.0), np.array([3.0, 50.0, 4000.0])
    expected = 0.02 * (time + lags[:, None] * np.expm1(-time / lags[:, None]))
    assert_allclose(followed(time, 20.0 + 0.02 * time, lags), 20.0 + expected, rtol=1e-12)


def test_a_body_follows_a_wandering_temperature_as_a_solver_says() -> None:
    random = np.random.default_rng(6)
    time, values = np.sort(random.uniform(0.0, 900.0, 60)), random.normal(20.0, 1.0, 60)
    fine = np.linspace(time[0], time[-1], 400_001)
    air, step, now = np.interp(fine, time, values), fine[1] - fine[0], values[0]
    course = [now, *(now := now + step / 50.0 * ((a + b) / 2.0 - now) for a, b in pairwise(air.tolist()))]
    order = random.permutation(60)
    assert_allclose(followed(time[order], values[order], [50.0])[0], np.interp(time, fine, course)[order], atol=1e-4)


def test_a_jump_between_two_readings_at_once_is_followed_later() -> None:
    late = followed(np.array([0.0, 10.0, 10.0, 60.0]), np.array([20.0, 20.0, 21.0, 21.0]), [50.0])[0]
    assert_allclose(late, [20.0, 20.0, 20.0, 21.0 - np.exp(-1.0)], rtol=1e-12)


def test_a_lag_by_run_is_worked_out_run_by_run() -> None:
    frame = pd.DataFrame({"time_s": MINUTES, "air_C": 20.0 + np.sin(MINUTES / 900.0), "face": 1})
    seen = Probings(frame, Setting.of(MACHINE, GAUGE))
    (effect,) = make_effects([SHIFT], "machine.toml")
    got = effect.replace_values(lag_s=np.array([[0.0], [600.0]])).displacement_um(seen)["x"]
    for run, lag in enumerate((0.0, 600.0)):
        assert_allclose(got[run], effect.replace_values(lag_s=lag).displacement_um(seen)["x"], atol=1e-12)

"""What acts in one place, after one way or at one speed only: by hand at a few rows."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from stepgauge.effects import Probings, Setting, make_effects, total_displacement_um
from stepgauge.effects.totals import scatter_um
from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine


def bend(table: dict, **columns: object) -> np.ndarray:
    """Displacement in machine axes, um, (n, 3)."""
    start = {"face": 1, "approach_i": 1.0, "approach_j": 0.0, "approach_k": 0.0, "placement": 1, "speed_mm_s": 3.0}
    frame = pd.DataFrame(start | {"x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0} | columns)
    frame["time_s"] = columns.get("time_s", 5.0 * np.arange(len(frame)))
    setting = Setting.of(read_machine("bridge-cmm"), read_gauge("step-gauge-420"), {1: np.array([1.0, 0.0, 0.0])})
    return total_displacement_um(make_effects([table], "machine.toml"), Probings(frame, setting))


def test_a_worn_place_reverses_more_and_what_stands_does_not_reverse() -> None:
    worn = {"kind": "reversal_wear", "axis": "x", "at_mm": 300.0, "width_mm": 80.0, "um": 6.0}
    got = bend(worn, x_mm=[300.0, 300.0, 340.0, 300.0, 900.0], approach_i=[1.0, -1.0, -1.0, 0.0, 1.0])
    assert_allclose(got[:, 0], [3.0, -3.0, -1.5, 0.0, 0.0], atol=1e-12)


def test_a_bump_wider_than_the_machine_is_the_reversal_of_the_whole_axis() -> None:
    x, sense = np.linspace(0.0, 700.0, 9), np.resize([1.0, -1.0], 9)
    wide = {"kind": "reversal_wear", "axis": "x", "at_mm": 300.0, "width_mm": 1e5, "um": 6.0}
    whole = bend({"kind": "reversal_error", "axis": "x", "um": 6.0}, x_mm=x, approach_i=sense)
    assert_allclose(bend(wide, x_mm=x, approach_i=sense), whole, rtol=1e-4)


def test_an_axis_that_came_on_in_the_sense_of_its_approach_has_run_free() -> None:
    """Touches at 0, 20, 50, 40, 40, 90 mm; the last begins a placement, of which nothing is known before."""
    stuck = {"kind": "stick_slip", "axis": "x", "um": 4.0, "decay_mm": 10.0}
    x, sense = [0.0, 20.0, 50.0, 40.0, 40.0, 90.0], [1.0, 1.0, -1.0, -1.0, 1.0, 1.0]
    run = np.array([0.0, 20.0, 0.0, 10.0, 0.0, 0.0])
    expected = 2.0 * np.array(sense) * np.exp(-run / 10.0)
    placement = [1, 1, 1, 1, 1, 2]
    assert_allclose(bend(stuck, x_mm=x, approach_i=sense, placement=placement)[:, 0], expected)
    order = np.array([3, 0, 5, 1, 4, 2])  # rows as they stand, time as it was
    mixed = {"x_mm": np.array(x)[order], "approach_i": np.array(sense)[order], "time_s": 5.0 * order}
    assert_allclose(bend(stuck, **mixed, placement=np.array(placement)[order])[:, 0], expected[order])


def test_beyond_a_joint_a_scale_has_a_gap_or_another_slope() -> None:
    joint = {"kind": "scale_joint", "axis": "x", "at_mm": 400.0}
    x = [399.9, 400.0, 650.0]
    assert_allclose(bend(joint | {"order": 0, "size": 3.0}, x_mm=x)[:, 0], [0.0, 3.0, 3.0])
    assert_allclose(bend(joint | {"size": 8.0}, x_mm=x)[:, 0], [0.0, 0.0, 2.0], atol=1e-12)


def test_a_screw_runs_out_with_its_turns_and_its_gear() -> None:
    x = np.linspace(0.0, 60.0, 50)
    screw = {"kind": "screw_error", "axis": "x", "pitch_mm": 12.0, "amplitude_um": 2.0, "phase_deg": 35.0}
    plain = {"kind": "periodic_scale_error", "axis": "x", "amplitude_um": 2.0, "phase_deg": 35.0}
    geared = bend(screw | {"order": 2, "gear": 2.5}, x_mm=x)
    assert_allclose(geared, bend(plain | {"period_mm": 12.0 / 5.0}, x_mm=x), atol=1e-12)
    assert_allclose(bend(screw, x_mm=x + 12.0), bend(screw, x_mm=x), atol=1e-12)


def test_a_lag_of_the_square_of_the_speed_and_one_of_the_speed() -> None:
    got = bend({"kind": "servo_lag", "um_per_mm2_s2": 0.5}, speed_mm_s=[1.0, 2.0, 6.0], approach_i=[1.0, -1.0, 1.0])
    assert_allclose(got[:, 0], [0.5, -2.0, 18.0])


def test_positions_are_latched_at_the_next_cycle() -> None:
    step = {"kind": "interpolation_step", "cycle_ms": 4.0}
    got = bend(step, time_s=np.array([0.001, 0.003, 0.004, 8.0]), approach_i=[1.0, -1.0, 1.0, 1.0])[:, 0]
    assert_allclose(got, [9.0, -3.0, 0.0, 0.0], atol=1e-9)
    late = bend(step, time_s=np.random.default_rng(3).uniform(0.0, 100.0, 5000), speed_mm_s=2.0)[:, 0]
    assert late.mean() == pytest.approx(4.0, abs=0.15)
    assert late.std() == pytest.approx(8.0 / np.sqrt(12.0), rel=0.03)


@pytest.mark.parametrize("number", [1, 2])
def test_another_tip_is_a_radius_in_its_placement(number: int) -> None:
    approach, placement = np.array([1.0, -1.0, 1.0, -1.0]), np.array([1, 1, 2, 2])
    got = bend({"kind": "tip_change", "placement": number, "um": 1.5}, approach_i=approach, placement=placement)
    assert_allclose(got[:, 0], 1.5 * approach * (placement == number))


SCALE = {"kind": "scale_error", "axis": "x", "ppm": 10.0}


@pytest.mark.parametrize(
    ("when", "there"),
    [
        ("x_mm > 300", [0, 0, 1, 1]),
        ("side > 0", [1, 0, 1, 0]),
        ("time_s >= 5", [0, 1, 1, 1]),
        ("(x_mm > 300) * (approach_i < 0)", [0, 0, 0, 1]),
        ("air_C > 21", [0, 1, 1, 0]),
    ],
)
def test_a_law_of_one_regime_holds_there_only(when: str, there: list[int]) -> None:
    rows = {"x_mm": [100.0, 200.0, 400.0, 500.0], "approach_i": [1.0, -1.0, 1.0, -1.0], "face": [1, 2, 3, 4]}
    rows["air_C"] = [20.0, 22.0, 23.0, 21.0]
    assert_allclose(bend(SCALE | {"when": when}, **rows), bend(SCALE, **rows) * np.array(there)[:, None])


def test_scatter_of_one_regime_grows_there_only() -> None:
    (growth,) = make_effects([{"kind": "noise_growth", "per": "speed", "rate": 2.0, "when": "x_mm > 300"}], "m.toml")
    frame = pd.DataFrame({"face": 1, "x_mm": [100.0, 400.0], "speed_mm_s": 2.0})
    seen = Probings(frame, Setting.of(read_machine("bridge-cmm")))
    assert_allclose(scatter_um([growth], seen, 3.0)[-1], [3.0, 5.0])


def test_a_regime_that_cannot_be_told_is_named() -> None:
    with pytest.raises(InputError, match=r"effect\[1\]\.when is wrong"):
        bend(SCALE | {"when": "x_mm >"}, x_mm=[1.0])
    with pytest.raises(InputError, match=r"scale_error.*no column 'fog'"):
        bend(SCALE | {"when": "fog > 1"}, x_mm=[1.0])

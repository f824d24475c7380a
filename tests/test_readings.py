"""Can this be a reading of this gauge? Gross errors are refused, slips left out by name, the rest is used."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.conditions.outliers import find_outliers
from stepgauge.conditions.resolution import step_of
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import write_evaluation
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import read_machine
from stepgauge.montecarlo import recording_model
from stepgauge.recording import Recording, join_recordings, read_recording, write_recording
from stepgauge.recording.columns import near_miss
from stepgauge.recording.face_readings import FaceReadings
from stepgauge.recording.identity import check_recording
from stepgauge.standards.iso10360 import Specification, length_test
from stepgauge.standards.mpe import Mpe
from tests.build import make_gauge, make_pose
from tests.test_evaluate import record

CYCLES, BLOCKS, NOISE_UM = 5, 21, 0.3


def gauge() -> Gauge:
    return make_gauge(BLOCKS, u_um=0.1)


def measured(seed: int = 0, pitch: float = 0.15, **columns: float) -> Recording:
    """209 readings that repeat to 0.3 um, on a gauge that is tilted (one reading of 210 is missing)."""
    random = np.random.default_rng(seed)
    keys = [(c, k) for c in range(1, CYCLES + 1) for k in range(1, 2 * BLOCKS + 1)][:-1]
    pose = make_pose(0.4, pitch, origin=(300.0, 200.0, 100.0))
    return record(gauge(), pose, {key: float(random.normal(0.0, NOISE_UM)) for key in keys}, **columns)


def moved(recording: Recording, row: int, um: float) -> Recording:
    """One reading moved along its approach."""
    frame = recording.frame.copy()
    frame.loc[row, ["x_mm", "y_mm", "z_mm"]] += recording.approach[row] * um * 1e-3
    return replace(recording, frame=frame)


def with_cell(recording: Recording, row: int, name: str, value: float) -> Recording:
    frame = recording.frame.copy()
    frame.loc[row, name] = value
    return replace(recording, frame=frame)


# along the gauge


@pytest.mark.parametrize("um", [5000.0, -5000.0, 900.0, -900.0])
@pytest.mark.parametrize("row", [46, 47])
def test_a_reading_off_by_more_than_half_a_millimetre_is_refused(um: float, row: int) -> None:
    """A front 5 mm too deep lay between the levels of fronts and backs, and passed."""
    wrong = moved(measured(), row, um)
    for check in (lambda: evaluate(wrong, gauge()), lambda: check_recording(wrong, gauge())):
        with pytest.raises(InputError, match=rf"probing {row + 1} of face {wrong.frame['face'][row]} is not where"):
            check()


@settings(max_examples=25)
@given(row=st.integers(0, 208), um=st.sampled_from([20.0, -20.0, 9.0, -400.0]), seed=st.integers(0, 50))
def test_a_slip_among_repeats_is_left_out_and_named(row: int, um: float, seed: int) -> None:
    """What is left is what would have been measured without that reading."""
    whole = measured(seed)
    result = evaluate(moved(whole, row, um), gauge()).results[0]
    (left_out,) = result.left_out
    face, cycle = whole.frame.loc[row, ["face", "cycle"]]
    assert (left_out.face, left_out.cycle) == (face, cycle)
    assert abs(left_out.off_um) == pytest.approx(abs(um), abs=6 * NOISE_UM)
    assert any(
        f"left out: 1 reading that the repeats contradict: face {face} in cycle {cycle}" in n for n in result.notes
    )
    without = replace(whole, frame=whole.frame.drop(index=row))
    np.testing.assert_allclose(result.xm_um, evaluate(without, gauge()).results[0].xm_um, atol=1e-9)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), growth=st.floats(0.0, 9.0))
def test_readings_that_scatter_as_the_machine_does_are_all_used(seed: int, growth: float) -> None:
    """Normal noise, also ten times as large at the far end as at the beginning."""
    whole = measured(seed)
    random = np.random.default_rng(seed + 20_000)
    noise = random.normal(0.0, NOISE_UM * (1.0 + growth * whole.frame["face"].to_numpy() / (2 * BLOCKS)))
    frame = whole.frame.copy()
    frame[["x_mm", "y_mm", "z_mm"]] += whole.approach * noise[:, None] * 1e-3
    assert evaluate(replace(whole, frame=frame), gauge()).results[0].left_out == ()


def test_a_cycle_that_differs_is_no_slip() -> None:
    """A knock between two cycles moves every face: that is how it was measured."""
    whole = measured()
    frame = whole.frame.copy()
    rows = frame["cycle"] == 1
    frame.loc[rows, ["x_mm", "y_mm", "z_mm"]] += np.outer(np.ones(rows.sum()), whole.approach[0]) * 0.02
    assert evaluate(replace(whole, frame=frame), gauge()).results[0].left_out == ()


def test_more_than_a_few_are_kept_and_said() -> None:
    whole = measured()
    for row in range(0, 150, 15):
        whole = moved(whole, row, 30.0)
    result = evaluate(whole, gauge()).results[0]
    assert result.left_out == ()
    assert any("10 of 209 readings are far from their repeats: too many to be slips" in note for note in result.notes)


@pytest.mark.parametrize(("step_mm", "expected"), [(1e-3, 1e-3), (1e-4, 1e-4), (0.1, 0.1)])
def test_the_steps_of_a_coarse_display_are_no_slips(step_mm: float, expected: float) -> None:
    whole = measured(pitch=0.0)
    position = np.round(whole.position_mm / step_mm) * step_mm
    assert max(step_of(one) for one in position.T) == pytest.approx(expected)
    off = np.repeat([0.0, 0.0, 0.0, 0.0, 3 * step_mm], 1)
    readings = FaceReadings.of(np.tile(off, 4), np.repeat([1, 2, 3, 4], 5))
    assert find_outliers(readings, np.tile(np.arange(5), 4), step_mm).rows.size == 0


def test_what_was_left_out_stands_in_the_file(tmp_path: Path) -> None:
    evaluation = evaluate(moved(measured(), 46, 20.0), gauge())
    data = json.loads(write_evaluation(tmp_path, evaluation)[0].read_text())
    (one,) = data["placements"][0]["left_out"]
    assert (one["placement"], one["cycle"], one["face"]) == (1, 2, 5)
    assert one["off_um"] > one["limit_um"] > 0.0


def test_the_budget_leaves_out_the_same(tmp_path: Path) -> None:
    wrong = moved(measured(), 46, 20.0)
    model = recording_model(wrong, read_machine("bridge-cmm"), gauge())
    assert sum(len(part) for part in model.parts) == 208
    np.testing.assert_allclose(model.nominal.results[0].xm_um, evaluate(wrong, gauge()).results[0].xm_um)


def test_a_standard_uses_it_and_says_so() -> None:
    """ISO 10360-2 judges what was measured; whoever signs must know of the reading."""
    wrong, limit = moved(measured(), 46, 20.0), Specification(Mpe.parse("5"))
    assert not any("far from their repeats" in rule.found for rule in length_test(measured(), gauge(), limit).rules)
    (rule,) = [rule for rule in length_test(wrong, gauge(), limit).rules if "far from their repeats" in rule.found]
    assert rule.met is False
    assert "placement 1: face 5 in cycle 2" in rule.found


@settings(max_examples=25)
@given(face=st.integers(1, 2 * BLOCKS), um=st.sampled_from([25.0, -25.0]))
def test_a_face_that_is_off_in_every_cycle_is_said(face: int, um: float) -> None:
    """Certificate, face or scale: repeats cannot tell, so it is used, but not without a word."""
    whole = measured()
    frame, rows = whole.frame.copy(), (whole.frame["face"] == face).to_numpy()
    frame.loc[rows, ["x_mm", "y_mm", "z_mm"]] += whole.approach[rows] * um * 1e-3
    notes = " ".join(evaluate(replace(whole, frame=frame), gauge()).results[0].notes)
    assert f"block {(face + 1) // 2} by" in notes
    assert "neighbours" not in " ".join(evaluate(whole, gauge()).results[0].notes)


# across the gauge


@pytest.mark.parametrize(("name", "value"), [("y_mm", 1e4), ("z_mm", 0.0), ("x_mm", -5000.0)])
def test_a_reading_beside_the_gauge_is_refused(name: str, value: float) -> None:
    along_x = record(
        gauge(), make_pose(0.0, 0.0, origin=(300, 200, 100)), {(c, k): 0.0 for c in (1, 2) for k in range(1, 9)}
    )
    tilted = measured(pitch=0.5)
    for recording in (along_x, tilted):
        with pytest.raises(InputError, match=r"lies beside the gauge|is not where"):
            evaluate(with_cell(recording, 3, name, value), gauge())


def test_another_line_on_the_same_faces_is_a_reading() -> None:
    whole = measured(pitch=0.0)
    frame = whole.frame.assign(z_mm=whole.frame["z_mm"] + np.where(whole.frame["cycle"] > 3, 6.0, 0.0))
    assert evaluate(replace(whole, frame=frame), gauge()).results[0].left_out == ()


def test_an_axis_that_the_readings_do_not_follow_is_said() -> None:
    """cos(3 mrad): 4.5 ppm, 1.8 um over the 410 mm of this gauge."""
    whole = measured(pitch=0.0)
    c, s = np.cos(0.003), np.sin(0.003)
    turned = whole.frame.copy()
    turned[["approach_i", "approach_j", "approach_k"]] = whole.approach @ [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
    notes = evaluate(replace(whole, frame=turned), gauge()).results[0].notes
    assert any("3.00 mrad off the axis that is used: a cosine error of up to 1.8" in note for note in notes)


# temperatures and times


def test_one_temperature_with_the_point_in_the_wrong_place_is_refused() -> None:
    warm = measured(gauge_temperature_C=20.4)
    notes = evaluate(warm, gauge()).results[0].notes
    assert not any("temperature" in note.replace("temperature_convention", "") for note in notes)
    for row in (0, 50, 208):
        with pytest.raises(InputError, match=rf"gauge_temperature_C of probing {row + 1} leaves the temperatures"):
            evaluate(with_cell(warm, row, "gauge_temperature_C", 2.04), gauge())


def test_a_gauge_that_warms_or_a_door_that_opens_is_no_slip() -> None:
    whole = measured(gauge_temperature_C=20.0)
    rows = np.arange(len(whole))
    for temperature in (20.0 + 0.05 * rows, np.where(rows < 80, 20.0, 23.0), 20.0 + 3.0 * np.sin(rows / 20.0)):
        warming = replace(whole, frame=whole.frame.assign(gauge_temperature_C=temperature))
        assert evaluate(warming, gauge()).results[0].left_out == ()


def test_a_time_out_of_order_is_refused_and_a_clock_that_starts_anew_is_not() -> None:
    whole = measured()
    rows = np.arange(len(whole), dtype=float)
    timed = replace(whole, frame=whole.frame.assign(time_s=4.0 * rows))
    check_recording(timed, gauge())
    check_recording(replace(whole, frame=whole.frame.assign(time_s=np.where(rows < 90, 4.0 * rows, rows))), gauge())
    with pytest.raises(InputError, match="time_s of probing 31 is out of order; found 9120 between 116 and 124"):
        check_recording(with_cell(timed, 30, "time_s", 9120.0), gauge())


# columns


@pytest.mark.parametrize(
    "name",
    ["gauge_temperature_c", "Gauge_temperature_C", "gauge_temp_C", "gauge_temperature_K", "temperature_C", "placemnt"],
)
def test_a_slip_in_a_header_is_asked_about(name: str, tmp_path: Path) -> None:
    """Each of these was a covariate, and the correction of the temperature was gone."""
    whole = measured()
    write_recording(tmp_path / "r.csv", replace(whole, frame=whole.frame.drop(columns="placement").assign(**{name: 1})))
    with pytest.raises(InputError, match=rf"column '{name}' is not known, and '\w+' is missing"):
        read_recording(tmp_path / "r.csv")


@pytest.mark.parametrize(
    "name", ["humidity", "air_temperature_C", "spindle_load", "c12", "µ_in", "force_N", "operator"]
)
def test_a_covariate_keeps_its_name(name: str) -> None:
    assert near_miss(name) is None


def test_a_missing_column_is_told_by_the_one_that_is_nearly_it(tmp_path: Path) -> None:
    frame = measured().frame.rename(columns={"cycle": "cylce"})
    frame.to_csv(tmp_path / "r.csv", index=False)
    with pytest.raises(InputError, match="column 'cylce' is not known, and 'cycle' is missing"):
        read_recording(tmp_path / "r.csv")


# twice


def test_a_row_that_is_there_twice_is_refused() -> None:
    whole = measured()
    twice = replace(whole, frame=pd.concat([whole.frame, whole.frame.iloc[[7]]], ignore_index=True))
    with pytest.raises(InputError, match="face 8 was probed twice in cycle 1 of placement 1, with the same result"):
        evaluate(twice, gauge())


def test_the_same_file_twice_is_no_second_measurement() -> None:
    for check in (evaluate, check_recording):
        with pytest.raises(InputError, match="placement 2 repeats the readings of placement 1"):
            check(join_recordings([measured(), measured()]), gauge())
    check_recording(join_recordings([measured(0), measured(1)]), gauge())


def test_coordinates_of_no_machine_are_refused(tmp_path: Path) -> None:
    """In a diagnosis 1e12 mm asked for 13 TiB."""
    write_recording(tmp_path / "r.csv", with_cell(measured(), 5, "x_mm", 1e12))
    with pytest.raises(InputError, match=r"r\.csv:8: column x_mm is no coordinate of a machine"):
        read_recording(tmp_path / "r.csv")

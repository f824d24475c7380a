"""Equations 1 to 13 against a table calculation written out by hand, and recordings that are not perfect."""

from __future__ import annotations

import csv
import json
import math
import re
import statistics
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.evaluation.files import CSV_COLUMNS, read_evaluation, write_evaluation
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording
from tests.build import Pose, make_gauge, make_pose


def record(
    gauge: Gauge, pose: Pose, error_um: dict[tuple[int, int], float], radius: float = 1.997, **columns: float
) -> Recording:
    """A recording whose probing of ``(cycle, face)`` is off by ``error_um`` along the gauge axis."""
    rows = []
    for (cycle, face), um in error_um.items():
        sign = 1 if face % 2 else -1
        along = gauge.position_mm[face - 1] - sign * radius + um * 1e-3
        rows.append([1, cycle, face, *pose.place(np.array([along, 0.0, 0.0])), *(sign * pose.rotation[0])])
    names = ["placement", "cycle", "face", "x_mm", "y_mm", "z_mm", "approach_i", "approach_j", "approach_k"]
    frame = pd.DataFrame(rows, columns=names).astype({"placement": int, "cycle": int, "face": int})
    return Recording(frame.assign(**columns), {}, "r.csv")


def table_calculation(gauge: Gauge, error_um: dict[tuple[int, int], float], radius: float) -> dict[str, list[float]]:
    """Pahk & Kim equations 1 to 13, cell by cell with python's own numbers, in um; M is along the axis."""
    n = gauge.n_faces
    s = [float(p) for p in gauge.position_mm]
    cycles = sorted({c for c, _ in error_um})
    m = {
        (c, k): s[k - 1] + (-radius if k % 2 else radius) + error_um[c, k] * 1e-3
        for c in cycles
        for k in range(1, n + 1)
    }
    mean = {k: math.fsum(m[c, k] for c in cycles) / len(cycles) for k in range(1, n + 1)}
    r_eff = ((mean[2] - mean[1]) - (s[1] - s[0])) / 2  # Eq 1
    m_ref, s_ref = mean[1], s[0]
    xf, xb, sf, sb = ([math.nan] * (n + 2) for _ in range(4))
    for k in range(1, n + 1):
        tip = 0.0 if k % 2 else 2 * r_eff
        each = [((m[c, k] - m_ref - tip) - (s[k - 1] - s_ref)) * 1e3 for c in cycles]  # Eqs 2, 3
        x, sd = (xf, sf) if k % 2 else (xb, sb)
        x[k], sd[k] = math.fsum(each) / len(each), statistics.stdev(each)  # Eqs 4-7
    for k in range(2, n + 1, 2):
        xf[k], sf[k] = (xf[k - 1] + xf[k + 1]) / 2, (sf[k - 1] + sf[k + 1]) / 2  # Eqs 8, 10
    for k in range(1, n + 1, 2):
        xb[k], sb[k] = (xb[k - 1] + xb[k + 1]) / 2, (sb[k - 1] + sb[k + 1]) / 2  # Eqs 9, 11
    xm = [(f + b) / 2 for f, b in zip(xf, xb, strict=True)]  # Eq 12
    xr = [b - f for f, b in zip(xf, xb, strict=True)]  # Eq 13
    columns = {"xf_um": xf, "xb_um": xb, "sf_um": sf, "sb_um": sb, "xm_um": xm, "xr_um": xr}
    return {**{name: values[1:-1] for name, values in columns.items()}, "r_eff_mm": [r_eff]}


@given(
    st.integers(2, 6),
    st.integers(2, 5),
    st.floats(-np.pi, np.pi),
    st.floats(-1.0, 1.0),
    st.floats(0.5, 3.0),
    st.integers(0, 2**32 - 1),
)
def test_evaluate_agrees_with_a_table_calculation_to_1e_9_mm(blocks, cycles, yaw, pitch, radius, seed) -> None:
    random = np.random.default_rng(seed)
    gauge = make_gauge(blocks, deviation_um=np.concatenate([[0.0], random.normal(0, 2, 2 * blocks - 1)]))
    error = {(c, k): float(random.normal(0, 5)) for c in range(1, cycles + 1) for k in range(1, 2 * blocks + 1)}
    pose = make_pose(yaw, pitch, origin=(300.0, 200.0, 100.0))
    result = evaluate(record(gauge, pose, error, radius), gauge).results[0]
    expected = table_calculation(gauge, error, radius)
    for name, values in expected.items():
        if name != "r_eff_mm":
            np.testing.assert_allclose(getattr(result, name), values, atol=1e-6, err_msg=name)  # 1e-6 um = 1e-9 mm
    assert result.radius.r_eff_mm == pytest.approx(expected["r_eff_mm"][0], abs=1e-9)


def full(blocks: int = 4, cycles: int = 3, seed: int = 0) -> dict[tuple[int, int], float]:
    random = np.random.default_rng(seed)
    return {(c, k): float(random.normal()) for c in range(1, cycles + 1) for k in range(1, 2 * blocks + 1)}


def test_a_reversal_error_of_all_blocks_is_in_the_radius_and_a_note_says_so() -> None:
    """Every back read late by 5 um: half of it is missing in R_eff, and XR shows none of it."""
    um = {key: 5.0 * (key[1] % 2 == 0) for key in full()}
    late, none = (
        evaluate(record(make_gauge(4), make_pose(0.2, 0.1), one), make_gauge(4)).results[0]
        for one in (um, dict.fromkeys(um, 0.0))
    )
    assert abs(late.radius.r_eff_mm - none.radius.r_eff_mm) == pytest.approx(2.5e-3, abs=1e-6)
    assert np.nanmax(np.abs(late.xr_um)) == pytest.approx(0.0, abs=1e-6)
    assert any(
        "a backlash that is the same at all blocks counts as tip radius, not as reversal XR" in one
        for one in late.notes
    )


def test_the_ends_are_undefined_and_the_first_back_is_zero() -> None:
    result = evaluate(record(make_gauge(4), make_pose(0.2, 0.1), full()), make_gauge(4)).results[0]
    assert np.isnan(result.xb_um[0])
    assert np.isnan(result.xf_um[-1])
    assert np.flatnonzero(np.isnan(result.xm_um)).tolist() == [0, 7]
    assert result.xb_um[1] == pytest.approx(0.0, abs=1e-9)
    assert result.xf_um[0] == pytest.approx(0.0, abs=1e-9)
    assert any("zero by construction" in note for note in result.notes)


def test_summary_numbers_come_from_the_table() -> None:
    result = evaluate(record(make_gauge(4), make_pose(0.2, 0.1), full()), make_gauge(4)).results[0]
    assert result.band_um == pytest.approx(np.nanmax(result.xm_um) - np.nanmin(result.xm_um))
    measured = [result.sf_um[i] if i % 2 == 0 else result.sb_um[i] for i in range(8)]
    assert result.worst_two_sigma_um == pytest.approx(2 * max(measured))
    assert result.span_mm == 70.0
    assert result.cycles == (3, 3)


def test_a_pure_scale_error_is_a_straight_line_in_both_directions() -> None:
    gauge = make_gauge(6)
    error = {(1, k): 0.02 * gauge.position_mm[k - 1] for k in range(1, 13)}
    result = evaluate(record(gauge, make_pose(0, 0), error), gauge, r_eff_origin="first").results[0]
    np.testing.assert_allclose(result.xf_um[:-1], 0.02 * gauge.position_mm[:-1], atol=1e-9)
    # the first block is read 0.2 um too long, so every back face is taken 0.2 um too short
    np.testing.assert_allclose(result.xb_um[1:], 0.02 * gauge.position_mm[1:] - 0.2, atol=1e-9)


def test_backlash_passes_for_pretravel_and_the_reversal_is_left_at_zero() -> None:
    gauge = make_gauge(4)
    error = {(1, k): 0.7 if k % 2 else -0.7 for k in range(1, 9)}
    result = evaluate(record(gauge, make_pose(0, 0), error), gauge).results[0]
    assert result.radius.r_eff_mm == pytest.approx(1.997 - 0.0007, abs=1e-9)
    np.testing.assert_allclose(result.xr_um[1:-1], 0.0, atol=1e-9)


def test_effective_radius_from_all_blocks_is_their_mean_with_a_smaller_uncertainty() -> None:
    gauge, error = make_gauge(5), full(5, 4)
    recording = record(gauge, make_pose(1.0, 0.0), error)
    first, every = (evaluate(recording, gauge, r_eff_origin=origin).results[0].radius for origin in ("first", "all"))
    each = [evaluate(recording, gauge, (b, b + 1)).results[0].radius.r_eff_mm for b in range(1, 5)]
    last = np.mean([error[c, 10] - error[c, 9] for c in range(1, 5)]) / 2e3 + 1.997
    assert first.blocks == (1,)
    assert every.blocks == (1, 2, 3, 4, 5)
    assert every.r_eff_mm == pytest.approx(np.mean([*each, last]), abs=1e-9)
    assert every.u_mm < first.u_mm


def test_the_uncertainty_of_the_effective_radius_by_hand() -> None:
    """u(R) = sqrt(2 s^2/n + u_f^2 + u_b^2) / 2 for one block (Eq 1 by GUM 5.1.2), s pooled over all faces (4.2.4)."""
    gauge = make_gauge(2, u_um=0.3)
    error = {(c, k): full(2, 4)[c, k] for c in range(1, 5) for k in range(1, 5)}
    result = evaluate(record(gauge, make_pose(0, 0), error), gauge).results[0]
    pooled = statistics.mean(statistics.variance([error[c, k] for c in range(1, 5)]) for k in range(1, 5))
    expected_um = math.sqrt(2 * pooled / 4 + 2 * 0.3**2) / 2
    assert result.radius.u_mm * 1e3 == pytest.approx(expected_um, rel=1e-6)


def test_a_section_of_the_gauge_has_its_own_reference() -> None:
    gauge = make_gauge(6)
    recording = record(gauge, make_pose(0, 0), full(6))
    result = evaluate(recording, gauge, (2, 5)).results[0]
    assert result.face.tolist() == list(range(3, 11))
    assert result.xf_um[0] == pytest.approx(0.0, abs=1e-9)
    assert result.radius.blocks == (2,)
    assert result.span_mm == 70.0


def test_missing_faces_leave_what_needs_them_undefined_and_are_said() -> None:
    gauge = make_gauge(5)
    error = {key: um for key, um in full(5).items() if key[1] not in (5, 8)}
    result = evaluate(record(gauge, make_pose(0, 0), error), gauge).results[0]
    assert np.flatnonzero(np.isnan(result.xf_um)).tolist() == [3, 4, 5, 9]
    assert np.flatnonzero(np.isnan(result.xb_um)).tolist() == [0, 6, 7, 8]
    assert any("not measured: faces 5, 8" in note for note in result.notes)
    assert result.count.tolist() == [3, 3, 3, 3, 0, 3, 3, 0, 3, 3]


@pytest.mark.parametrize(("missing", "reference", "radius_block"), [(1, 3, 2), (2, 1, 2)])
def test_a_missing_face_of_the_first_block_moves_reference_or_radius_and_is_said(
    missing, reference, radius_block
) -> None:
    gauge = make_gauge(4)
    error = {key: um for key, um in full().items() if key[1] != missing}
    result = evaluate(record(gauge, make_pose(0, 0), error), gauge, (1, 4)).results[0]
    assert result.xf_um[reference - 1] == pytest.approx(0.0, abs=1e-9)
    assert result.radius.blocks == (radius_block,)
    words = " ".join(result.notes)
    assert f"R_eff is from block {radius_block}" in words
    assert ("the reference is face 3" in words) == (missing == 1)


def test_unequal_cycles_are_averaged_as_they_are_and_said() -> None:
    gauge, error = make_gauge(4), full(4, 4)
    fewer = {key: um for key, um in error.items() if key not in ((4, 3), (3, 3), (4, 6))}
    result = evaluate(record(gauge, make_pose(0, 0), fewer), gauge).results[0]
    reference = np.mean([error[c, 1] for c in range(1, 5)])
    assert result.xf_um[2] == pytest.approx(np.mean([error[1, 3], error[2, 3]]) - reference, abs=1e-9)
    assert result.count[[2, 5]].tolist() == [2, 3]
    assert any("unequal cycles: 2 to 4" in note and "3, 6" in note for note in result.notes)


def test_a_gauge_temperature_that_nobody_recorded_is_said() -> None:
    """30 mm of 11.5e-6 / K: 0.34 um for each K; and with a temperature there is no such note."""
    gauge = make_gauge(4)
    cold, warm = (
        evaluate(record(gauge, make_pose(0, 0), full(4), **columns), gauge).results[0].notes
        for columns in ({}, {"gauge_temperature_C": 21.0})
    )
    (note,) = (one for one in cold if "temperature of the gauge is not recorded" in one)
    span_mm = gauge.position_mm[7] - gauge.position_mm[0]
    assert f"{span_mm * 1e3 * gauge.table.expansion_per_K:.2g} um over {span_mm:.0f} mm" in note
    assert not [one for one in warm if "is not recorded" in one]


def test_a_single_cycle_has_errors_but_no_repeatability() -> None:
    gauge = make_gauge(4)
    result = evaluate(record(gauge, make_pose(0, 0), full(4, 1)), gauge).results[0]
    assert np.isnan(result.sf_um).all()
    assert np.isnan(result.worst_two_sigma_um)
    assert np.isfinite(result.band_um)
    assert any("single cycle" in note for note in result.notes)


def test_a_radius_that_was_measured_once_has_no_uncertainty_of_its_certificate_alone(tmp_path: Path) -> None:
    """Its scatter counts and is not known: undefined in summary, JSON and back, not 0.007 um."""
    gauge = make_gauge(4)
    once = evaluate(record(gauge, make_pose(0, 0), full(4, 1)), gauge)
    assert np.isnan(once.results[0].radius.u_mm)
    assert "(u = undefined)" in once.summary()
    write_evaluation(tmp_path, once)
    data = json.loads((tmp_path / "evaluation.json").read_text())
    assert data["u_r_eff_mm"] is data["placements"][0]["u_r_eff_mm"] is None
    assert np.isnan(sg.read_evaluation(tmp_path, gauge).results[0].radius.u_mm)


def test_a_block_that_was_measured_once_repeats_as_the_others_do() -> None:
    """u(R) = sqrt(2 s^2 + 2 u^2) / 2 with s pooled over the faces that were read four times (GUM 4.2.4)."""
    gauge, error = make_gauge(4, u_um=0.3), full(4, 4)
    kept = {(c, k): um for (c, k), um in error.items() if k > 2 or c == 1}
    result = evaluate(record(gauge, make_pose(0, 0), kept), gauge).results[0]
    pooled = statistics.mean(statistics.variance([error[c, k] for c in range(1, 5)]) for k in range(3, 9))
    assert result.radius.u_mm * 1e3 == pytest.approx(math.sqrt(2 * pooled + 2 * 0.3**2) / 2, rel=1e-6)


@pytest.mark.parametrize(("pitch", "width", "origin"), [(20, 10, "first"), (60, 5, "first"), (60, 40, "all")])
def test_a_scale_error_shows_as_a_reversal_of_half_a_pitch(pitch: float, width: float, origin: str) -> None:
    """-c P / 2 at every face for c = 50 um/m, by hand in docs/uncertainty.md; the note states it where it matters."""
    gauge = make_gauge(5, size=width, gap=pitch - width)
    for ppm, noted in ((50.0, True), (1.0, False)):
        error = {(c, k): ppm * 1e-3 * gauge.position_mm[k - 1] for c in (1, 2) for k in range(1, 11)}
        result = evaluate(record(gauge, make_pose(0, 0), error), gauge, r_eff_origin=origin).results[0]
        np.testing.assert_allclose(result.xr_um[1:-1], -ppm * 1e-3 * pitch / 2, atol=2e-3)
        assert (
            any(f"{-ppm * 1e-3 * pitch / 2:.2g} um of the reversal XR are of the scale" in one for one in result.notes)
            == noted
        )


def test_several_placements_are_evaluated_each_on_its_own_axis() -> None:
    gauge = make_gauge(4)
    parts = [record(gauge, make_pose(yaw, 0.0), full(4, 3, seed)) for seed, yaw in enumerate((0.0, 1.0))]
    frame = pd.concat([part.frame.assign(placement=n) for n, part in enumerate(parts, 1)])
    both = evaluate(Recording(frame, {}, "r.csv"), gauge)
    for result, part in zip(both.results, parts, strict=True):
        alone = evaluate(part, gauge).results[0]
        np.testing.assert_allclose(result.xm_um, alone.xm_um)
    np.testing.assert_allclose(both.results[1].axis, make_pose(1.0, 0.0).rotation[0], atol=1e-12)


def test_a_given_placement_replaces_the_mean_approach() -> None:
    gauge, pose = make_gauge(4), make_pose(0.3, 0.0)
    recording = record(gauge, pose, full())
    tilted = np.array([np.cos(0.302), np.sin(0.302), 0.0])  # the controller drove 2 mrad off the gauge
    sign = np.where(recording.frame["face"] % 2 == 1, 1.0, -1.0)
    for i, name in enumerate(("approach_i", "approach_j", "approach_k")):
        recording.frame[name] = sign * tilted[i]
    along_gauge = evaluate(recording, gauge, placements=[pose.placement(gauge)]).results[0]
    along_drive = evaluate(recording, gauge).results[0]
    short_um = gauge.position_mm[6] * (1 - np.cos(0.002)) * 1e3
    assert along_gauge.xf_um[6] - along_drive.xf_um[6] == pytest.approx(short_um, abs=1e-3)


def test_the_recorded_gauge_temperature_lengthens_the_certified_positions() -> None:
    gauge = make_gauge(4, expansion=10e-6)
    cold, warm = (
        evaluate(record(gauge, make_pose(0, 0), full(), gauge_temperature_C=t), gauge).results[0] for t in (20.0, 25.0)
    )
    assert cold.xf_um[6] - warm.xf_um[6] == pytest.approx(10e-6 * 5 * gauge.position_mm[6] * 1e3, abs=1e-6)
    assert warm.gauge_temperature_C == 25.0


def refused(recording: Recording, gauge: Gauge) -> str:
    """What the error says."""
    with pytest.raises(InputError) as caught:
        evaluate(recording, gauge)
    return str(caught.value)


def test_recordings_that_are_not_of_this_gauge_are_refused() -> None:
    gauge, pose = make_gauge(4), make_pose(0, 0)
    good = record(gauge, pose, full())
    assert re.search("has no face 10; .*1 to 8", refused(record(make_gauge(5), pose, full(5)), gauge))
    assert "is not where Test gauge has that face" in refused(record(make_gauge(4, gap=12.0), pose, full()), gauge)
    inches = good.frame.copy()
    inches[["x_mm", "y_mm", "z_mm"]] /= 25.4
    assert "looks like inches" in refused(Recording(inches, {}, "r.csv"), gauge)
    swapped = good.frame.copy()
    swapped.loc[:1, "face"] = [2, 1]
    complaint = refused(Recording(swapped, {}, "r.csv"), gauge)
    assert re.search(r"probing 1 approaches its face from the wrong side .*face 2, a back", complaint)
    numbered = good.frame.copy()
    numbered["face"] = numbered["face"].replace({3: 5, 5: 3})
    assert re.search(
        r"faces 3 and 5 look exchanged; found face 5 at 20.00\d mm", refused(Recording(numbered, {}, "r.csv"), gauge)
    )
    uneven = good.frame.copy()
    uneven.loc[uneven["face"].isin([3, 4]), ["x_mm", "y_mm", "z_mm"]] += 3.0 * pose.rotation[0]
    third = replace(gauge, position_mm=gauge.position_mm - np.array([0.0, 0, 0, 0, 3, 3, 0, 0]))
    assert "lies end for end" in refused(Recording(uneven, {}, "r.csv"), third)
    one = good.frame[good.frame["face"] <= 2]
    assert "only one block" in refused(Recording(one, {}, "r.csv"), gauge)
    fronts = good.frame[good.frame["face"] % 2 == 1]
    assert "no block has both faces" in refused(Recording(fronts, {}, "r.csv"), gauge)


def test_the_files_say_what_the_evaluation_says(tmp_path: Path) -> None:
    gauge = make_gauge(4)
    evaluation = evaluate(record(gauge, make_pose(0, 0), full()), gauge)
    json_path, csv_path = write_evaluation(tmp_path / "new" / "folder", evaluation)
    data = read_evaluation(json_path)
    result = evaluation.results[0]
    assert isinstance(data["r_eff_mm"], float)
    assert isinstance(data["u_r_eff_mm"], float)
    assert data["r_eff_mm"] == result.radius.r_eff_mm
    assert data["band_um"] == result.band_um
    rows = list(csv.DictReader(csv_path.read_text().splitlines()))
    assert tuple(rows[0]) == CSV_COLUMNS
    for i, row in enumerate(rows):
        for name in ("xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um"):
            value = float(getattr(result, name)[i])
            assert (row[name] == "") == math.isnan(value)
            if row[name]:
                assert float(row[name]) == pytest.approx(value, rel=1e-9, abs=1e-12)
    assert [row["side"] for row in rows] == ["front", "back"] * 4
    assert [row["interpolated"] for row in rows] == ["xb", "xf"] * 4


def test_several_placements_in_the_files(tmp_path: Path) -> None:
    gauge = make_gauge(4)
    frame = record(gauge, make_pose(0, 0), full()).frame
    both = pd.concat([frame, frame.assign(placement=2, x_mm=frame["x_mm"] + 50.0)])
    evaluation = evaluate(Recording(both, {}, "r.csv"), gauge)
    wider = replace(evaluation, results=(evaluation.results[0], replace(evaluation.results[1], xm_um=np.arange(8.0))))
    data = read_evaluation(write_evaluation(tmp_path, wider)[0])
    assert data["band_um"] == 7.0
    assert len(data["placements"]) == 2
    rows = list(csv.DictReader((tmp_path / "evaluation.csv").read_text().splitlines()))
    assert [row["placement"] for row in rows] == ["1"] * 8 + ["2"] * 8


def test_undefined_numbers_are_null_in_json(tmp_path: Path) -> None:
    gauge = make_gauge(4)
    evaluation: Evaluation = evaluate(record(gauge, make_pose(0, 0), full(4, 1)), gauge)
    text = write_evaluation(tmp_path, evaluation)[0].read_text()
    assert "NaN" not in text
    assert json.loads(text)["worst_two_sigma_um"] is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "other"}', "not json"])
def test_other_json_is_not_an_evaluation(tmp_path: Path, text: str) -> None:
    path = tmp_path / "evaluation.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"evaluation|JSON"):
        read_evaluation(path)

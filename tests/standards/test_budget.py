"""The uncertainty budget: GUM H.1, small budgets by hand, and the Monte Carlo of the same model."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from GTC import ureal
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from stepgauge.dcc.write import machine_certificate
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.files.resources import find_data
from stepgauge.files.text import write_json
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import make_placement, write_placement
from stepgauge.machine.file import Machine, StandardUncertainty, UncertaintyTable, read_machine
from stepgauge.machine.uncertain import Uncertain
from stepgauge.montecarlo import ModelOptions, MonteCarloModel, read_model, recording_model, run_monte_carlo
from stepgauge.recording import Recording, write_recording
from stepgauge.recording.conventions import recorded_scales_C
from stepgauge.standards.budget import BudgetLine, UncertaintyBudget, make_budget
from stepgauge.standards.budget_files import (
    budget_csv,
    budget_to_dict,
    check_budget,
    read_budget,
    stored_budget,
    write_budget,
)
from stepgauge.standards.budget_sources import BudgetOptions, cosine_rms
from stepgauge.standards.coverage import coverage_factor, expand
from tests.dcc.made import laboratory
from tests.measured import ALONG_X, lay, named, run, shipped, with_gaps

U_CERTIFICATE = np.array([0.10, 0.11, 0.11, 0.12, 0.12, 0.13, 0.13, 0.14, 0.14, 0.15, 0.16, 0.17]) / 2.0
"""Expanded uncertainties of the first faces of the shipped gauge (k = 2), um, typed in by hand."""


def measured(cycles: int = 3, noise_um: float = 0.5, warmer_K: float = 0.0) -> Recording:
    recording = named(run(cycles, noise_um=noise_um).recording)
    if not warmer_K:
        return recording
    return Recording(recording.frame.assign(gauge_temperature_C=20.0 + warmer_K), recording.comments, recording.path)


def quiet_gauge(correlation: float | None = None, dof: float | None = None) -> Gauge:
    """The shipped gauge without uncertainty of its expansion."""
    gauge = shipped()[0]
    certificate = gauge.certificate.model_copy(update={"correlation": correlation, "degrees_of_freedom": dof})
    table = gauge.table.model_copy(update={"expansion_uncertainty_per_K": 0.0})
    return replace(gauge, table=table, certificate=certificate, u_um=np.resize(U_CERTIFICATE, gauge.n_faces))


def modelled(
    gauge: Gauge,
    machine: Machine | None = None,
    recording: Recording | None = None,
    u_K: float = 0.0,
    origin: str = "first",
) -> MonteCarloModel:
    recording = measured() if recording is None else recording
    return recording_model(recording, machine or shipped()[1], gauge, u_K, origin)  # type: ignore[arg-type]


def line(budget: UncertaintyBudget, name: str, face: int | None = None) -> BudgetLine:
    return next(one for one in budget.lines if (one.name, one.face) == (name, face))


def test_gum_h1_end_gauge_calibration() -> None:
    """JCGM 100:2008, H.1: u_c = 32 nm, 16 effective degrees of freedom, k = 2.92, U99 = 93 nm (92 nm unrounded)."""
    standard = ureal(50_000_623.0, 25.0, 18)
    difference = ureal(215.0, 5.8, 24) + ureal(0.0, 3.9, 5) + ureal(0.0, 6.7, 8)
    expansion_difference = ureal(0.0, 1e-6 / math.sqrt(3.0), 50)
    temperature_difference = ureal(0.0, 0.05 / math.sqrt(3.0), 2)
    expansion = ureal(11.5e-6, 2e-6 / math.sqrt(3.0))
    off_20 = ureal(-0.1, math.hypot(0.2, 0.5 / math.sqrt(2.0)))
    length = standard + difference - standard * (expansion_difference * off_20 + expansion * temperature_difference)
    result = expand(length, 99.0)
    assert result.u == pytest.approx(31.7, abs=0.1)
    assert 16.0 < result.dof < 17.0
    assert result.k == pytest.approx(2.92, abs=0.005)
    assert result.expanded == pytest.approx(92.5, abs=0.5)


@pytest.mark.parametrize(("dof", "percent", "k"), [(math.inf, 95.45, 2.0), (10, 95.45, 2.28), (16.9, 99.0, 2.92)])
def test_coverage_factors_of_gum_table_g2(dof: float, percent: float, k: float) -> None:
    """Table G.2 prints 2.28 for 10 degrees of freedom at 95.45 % and 2.92 for 16 at 99 %."""
    assert coverage_factor(dof, percent) == pytest.approx(k, abs=0.005)


@pytest.mark.parametrize("r", [None, 0.0, 0.4, 1.0])
def test_certificate_by_hand_with_its_correlation(r: float | None) -> None:
    """R_eff = (o2 - o1)/2, XF3 = o3 - o1, XB4 = o4 - o1 - 2 R_eff = o4 - o2, XM3 = (o3 - o1)/2 + (o4 - o2)/4."""
    budget = make_budget(modelled(quiet_gauge(r)))
    u = U_CERTIFICATE
    covariance = np.outer(u, u) * (r or 0.0)
    np.fill_diagonal(covariance, u**2)
    for name, face, weights in (
        ("r_eff_mm", None, [-0.5, 0.5, 0, 0]),
        ("xf_um", 3, [-1, 0, 1, 0]),
        ("xb_um", 4, [0, -1, 0, 1]),
        ("xm_um", 3, [-0.5, -0.25, 0.5, 0.25]),
        ("xr_um", 3, [1, -0.5, -1, 0.5]),
    ):
        c = np.zeros(len(u))
        c[: len(weights)] = weights
        assert line(budget, name, face).contribution["certificate"] == pytest.approx(
            math.sqrt(c @ covariance @ c), abs=1e-9
        )
    said = " ".join(budget.assumptions)
    assert ("independent (correlation 0)" in said) == (r is None)


def test_a_proportional_part_is_common_to_all_faces() -> None:
    """U = a + b S with a common b S: between two faces b (S2 - S1) is left of it, and R_eff hardly sees it."""
    gauge = quiet_gauge()
    certificate = gauge.certificate.model_copy(update={"proportional_um_per_m": 2.0})
    common = 1.0 * gauge.position_mm * 1e-3  # standard uncertainty, k = 2
    own = 0.05
    gauge = replace(gauge, certificate=certificate, u_um=np.hypot(own, common))
    budget = make_budget(modelled(gauge))
    xf = line(budget, "xf_um", 11)
    assert xf.contribution["certificate"] == pytest.approx(math.hypot(own * math.sqrt(2.0), common[10]), rel=1e-6)
    r_eff = line(budget, "r_eff_mm").contribution["certificate"]
    assert r_eff == pytest.approx(math.hypot(own * math.sqrt(2.0), common[1]) / 2.0, rel=1e-6)
    assert any("2 um per m" in one and "common to all faces" in one for one in budget.assumptions)


def test_a_part_larger_than_the_whole_is_an_error(tmp_path: Path) -> None:
    for name in ("step-gauge-420.toml", "step-gauge-420.csv"):
        text = find_data("step-gauge-420", "gauge").with_name(name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace("[certificate]", "[certificate]\nproportional_um_per_m = 5.0"))
    with pytest.raises(InputError, match=r"csv:\d+: uncertainty_um is smaller than its part"):
        read_gauge(tmp_path / "step-gauge-420.toml")


def test_xb_of_the_radius_block_is_certain_by_construction() -> None:
    xb = line(make_budget(modelled(quiet_gauge())), "xb_um", 2)
    assert xb.value == pytest.approx(0.0, abs=1e-9)
    assert xb.expanded.u == pytest.approx(0.0, abs=1e-12)


def test_repeatability_is_pooled_with_the_degrees_of_freedom_of_all_faces() -> None:
    """GUM 4.2.4 and H.1: u = s_p / sqrt(n); 12 faces of 4 cycles have 36 degrees of freedom."""
    recording = measured(cycles=4)
    gauge = replace(quiet_gauge(), u_um=np.zeros(quiet_gauge().n_faces))
    budget = make_budget(modelled(gauge, recording=recording), BudgetOptions(percent=95.0))
    result = evaluate(recording, gauge).results[0]
    s = np.sqrt(np.mean(np.where(result.face % 2 == 1, result.sf_um, result.sb_um) ** 2))
    xf = line(budget, "xf_um", 9)
    assert xf.expanded.u == pytest.approx(s / 2.0 * math.sqrt(2.0), rel=1e-9)
    assert xf.expanded.dof == pytest.approx(36.0)
    assert xf.expanded.k == pytest.approx(stats.t.ppf(0.975, 36), rel=1e-6)


def test_repeatability_by_face_has_n_minus_1() -> None:
    recording = measured(cycles=4)
    gauge = replace(quiet_gauge(), u_um=np.zeros(quiet_gauge().n_faces))
    budget = make_budget(modelled(gauge, recording=recording), BudgetOptions(repeats="face"))
    result = evaluate(recording, gauge).results[0]
    s1, s9 = result.sf_um[0], result.sf_um[8]
    xf = line(budget, "xf_um", 9)
    assert xf.expanded.u == pytest.approx(math.sqrt((s1**2 + s9**2) / 4.0), rel=1e-9)
    welch = (s1**2 + s9**2) ** 2 / ((s1**4 + s9**4) / 3.0)
    assert xf.expanded.dof == pytest.approx(welch, rel=1e-6)


def test_one_probing_of_a_face_has_no_deviation_of_its_own() -> None:
    recording = measured(cycles=1)
    model = modelled(quiet_gauge(), recording=recording)
    repeatability = make_budget(model).sources[1]
    assert (repeatability.kind, repeatability.stated_by) == ("B", "machine file: repeatability_um")
    frame = measured().frame
    kept = ~((frame["face"] == 5) & (frame["cycle"] > 1))
    once = modelled(quiet_gauge(), recording=Recording(frame[kept].reset_index(drop=True), {}, "once.csv"))
    with pytest.raises(InputError, match="face 5 was probed once"):
        make_budget(once, BudgetOptions(repeats="face"))


@pytest.mark.parametrize("convention", ["as_read", "corrected_to_20"])
def test_temperature_and_expansion_of_the_gauge_by_hand(convention: str) -> None:
    """S alpha u(T) and S (T - 20) u(alpha), whoever corrected the readings with T and alpha."""
    gauge, warm = shipped()[0], measured(warmer_K=2.0)
    recording = Recording(warm.frame, {**warm.comments, "temperature_convention": convention}, warm.path)
    budget = make_budget(modelled(gauge, recording=recording, u_K=0.1))
    xf = line(budget, "xf_um", 11)
    length_um = gauge.position_mm[10] * 1e3
    assert xf.contribution["gauge temperature"] == pytest.approx(length_um * 11.5e-6 * 0.1, rel=1e-3)
    assert xf.contribution["gauge.expansion_per_K"] == pytest.approx(length_um * 2.0 * 0.5e-6, rel=1e-3)


def test_a_gauge_temperature_that_was_not_recorded_can_be_stated() -> None:
    """The certificate's temperature is taken; how far it may be off is for the person to say."""
    recording = Recording(RECORDING.frame.drop(columns="gauge_temperature_C"), {}, "cold.csv")
    silent = make_budget(modelled(quiet_gauge(), recording=recording))
    assert "temperature of the gauge (not recorded; taken as the certificate's)" in [
        one.what for one in silent.not_included
    ]
    stated = make_budget(modelled(quiet_gauge(), recording=recording, u_K=0.5))
    xf = line(stated, "xf_um", 11).contribution["gauge temperature"]
    assert xf == pytest.approx(quiet_gauge().position_mm[10] * 1e3 * 11.5e-6 * 0.5, rel=1e-3)


def test_a_thermometer_that_was_not_read_makes_no_temperature_certain() -> None:
    """The machine file's 0.05 K is of a reading: without one it does not count, and the contribution stays open."""
    machine = replace(shipped()[1], stated=UncertaintyTable(gauge_temperature_K=StandardUncertainty(u=0.05)))
    silent = Recording(RECORDING.frame.drop(columns="gauge_temperature_C"), {}, "cold.csv")
    for recording, asked, counted in ((RECORDING, None, True), (silent, None, False), (silent, 0.5, True)):
        budget = make_budget(read_model([recording], machine, quiet_gauge(), (), ModelOptions(asked)))
        assert ("gauge temperature" in [source.name for source in budget.sources]) == counted
        assert any(one.what.startswith("temperature of the gauge") for one in budget.not_included) != counted


@pytest.mark.parametrize("compensated", [True, False])
def test_temperature_and_expansion_of_the_scales_by_hand(compensated: bool) -> None:
    """x alpha_s u(T_s) and x (T_s - 20) u(alpha_s), whoever corrects for the scales' temperature."""
    gauge, machine = shipped()
    table = machine.table.model_copy(update={"temperature_C": 21.0, "scales_compensated": compensated})
    uncertain = (
        Uncertain("machine.temperature_C", 21.0, 0.1),
        Uncertain("machine.scale_expansion_per_K", 11.5e-6, 1e-6),
    )
    of_scales = {f"scale_temperature_{axis}_C" for axis in "xyz"}
    silent = Recording(RECORDING.frame.drop(columns=of_scales), {}, "silent.csv")
    warm = Recording(RECORDING.frame.assign(**dict.fromkeys(of_scales, 24.0)), {}, "warm.csv")
    for recording, warmer_K in ((silent, 1.0), (warm, 4.0)):  # as the machine file states it, and as recorded
        budget = make_budget(modelled(gauge, replace(machine, table=table, uncertain=uncertain), recording))
        xf, length_um = line(budget, "xf_um", 11), gauge.position_mm[10] * 1e3
        assert xf.contribution["machine.temperature_C"] == pytest.approx(length_um * 11.5e-6 * 0.1, rel=1e-3)
        assert xf.contribution["machine.scale_expansion_per_K"] == pytest.approx(length_um * warmer_K * 1e-6, rel=1e-3)
        doubted = [one for one in budget.assumptions if "24.00 °C as recorded, and not at 21.00 °C" in one]
        assert len(doubted) == (recording is warm)


def test_the_temperature_of_the_scales_is_that_of_those_that_read_the_length() -> None:
    """Along (0.8, 0.6, 0), x reads 0.64 of a length and y the rest; z does not count, nor a mere third of it."""
    side = np.where(RECORDING.frame["face"] % 2 == 1, 1.0, -1.0)
    approach = {"approach_i": 0.8 * side, "approach_j": 0.6 * side, "approach_k": 0.0}
    frame = RECORDING.frame.assign(**approach).assign(
        scale_temperature_x_C=24.0, scale_temperature_y_C=21.0, scale_temperature_z_C=30.0
    )
    whole = Recording(frame, {}, "whole.csv")
    assert recorded_scales_C(whole) == pytest.approx(0.64 * 24.0 + 0.36 * 21.0)
    for gone, expected in (("x", None), ("y", 24.0)):
        part = Recording(frame.drop(columns=f"scale_temperature_{gone}_C"), {}, "part.csv")
        found = recorded_scales_C(part)
        assert (None if found is None else found[0]) == expected


def test_resolution_probing_and_degrees_of_freedom_by_hand() -> None:
    gauge = replace(quiet_gauge(), u_um=np.zeros(quiet_gauge().n_faces))
    stated = UncertaintyTable(resolution_um=0.6, probing_um=StandardUncertainty(u=0.3, dof=8))
    machine = replace(shipped()[1], stated=stated)
    budget = make_budget(modelled(gauge, machine, measured(noise_um=0.0)))
    xf = line(budget, "xf_um", 5)
    assert xf.contribution["resolution"] == pytest.approx(0.6 / math.sqrt(12.0) * math.sqrt(2.0))
    assert xf.contribution["probing"] == pytest.approx(0.3 * math.sqrt(2.0))
    u2 = 2 * 0.6**2 / 12, 2 * 0.3**2
    assert xf.expanded.dof == pytest.approx(sum(u2) ** 2 / (u2[1] ** 2 / 8))
    assert line(budget, "xb_um", 6).through_radius == pytest.approx(2.0 * line(budget, "r_eff_mm").expanded.u)


def test_alignment_is_the_cosine_error_of_the_axis_uncertainty() -> None:
    u1, u2 = 800e-6, 500e-6
    angles = np.random.default_rng(1).normal(size=(2, 400_000)) * [[u1], [u2]]
    cosine = (angles**2).sum(axis=0) / 2.0
    assert cosine_rms(u1, u2) == pytest.approx(math.sqrt((cosine**2).mean()), rel=0.01)
    placement = replace(lay(shipped()[0]), details={"uncertainty": {"yaw_urad": 800.0, "pitch_urad": 500.0}})
    budget = make_budget(modelled(quiet_gauge()), BudgetOptions([placement]))
    xf = line(budget, "xf_um", 11)
    assert xf.contribution["alignment"] == pytest.approx(100e3 * cosine_rms(u1, u2), rel=1e-4)
    assert line(budget, "r_eff_mm").contribution["alignment"] == pytest.approx(
        10e3 * cosine_rms(u1, u2) / 2.0, rel=1e-4
    )


def test_what_nobody_states_is_listed_and_not_counted() -> None:
    budget = make_budget(modelled(quiet_gauge()))
    assert {source.name for source in budget.sources} == {"certificate", "repeatability"}
    missing = " ".join(one.what for one in budget.not_included)
    for what in (
        "expansion of the gauge",
        "temperature of the gauge",
        "temperature of the scales",
        "probing",
        "resolution",
    ):
        assert what in missing
    assert "alignment" in missing
    stated = UncertaintyTable(resolution_um=0.1)
    fewer = make_budget(modelled(quiet_gauge(), replace(shipped()[1], stated=stated))).not_included
    assert "resolution" not in [one.what for one in fewer]


UNCERTAIN = """
[[effect]]
kind = "scale_error"
axis = "y"
ppm = { value = 2.5, u = 0.8 }
[[effect]]
kind = "squareness"
plane = "xy"
urad = { value = 0.0, u = 3.0 }
"""


@pytest.mark.parametrize(("r", "per_m"), [(0.0, None), (0.8, None), (1.0, None), (0.3, 0.7)])
@pytest.mark.parametrize("origin", ["first", "all"])
def test_monte_carlo_of_the_same_model_agrees(tmp_path: Path, r: float, per_m: float | None, origin: str) -> None:
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    source = source.replace("temperature_C = 20.0", "temperature_C = { value = 20.0, u = 0.2 }")
    (tmp_path / "machine.toml").write_text(source + UNCERTAIN, encoding="utf-8")
    machine = read_machine(tmp_path / "machine.toml")
    assert "machine.temperature_C" in [one.key for one in machine.uncertain]
    frame = run(3, axis=ALONG_X).recording.frame.assign(gauge_temperature_C=21.0)
    recording = Recording(frame, {"temperature_convention": "as_read"}, "recording.csv")
    gauge = replace(quiet_gauge(r), table=shipped()[0].table)
    gauge = replace(gauge, certificate=gauge.certificate.model_copy(update={"proportional_um_per_m": per_m}))
    model = modelled(gauge, machine, recording, 0.1, origin)
    runs = 3000
    budget = make_budget(model, monte_carlo=run_monte_carlo(model, runs, seed=3))
    compared = 0
    for one in budget.lines:
        assert one.monte_carlo is not None
        assert one.same_terms_u == pytest.approx(one.expanded.u)
        if one.expanded.u > 1e-9:
            assert one.monte_carlo[0] == pytest.approx(one.expanded.u, rel=4.0 / math.sqrt(2.0 * runs))
            compared += 1
    assert compared > 40
    sources = {one.name: (one.label, one.unit) for one in budget.sources}
    assert sources["effect[1].ppm"] == ("scale error y: ppm", "um/m")
    assert sources["effect[2].urad"] == ("squareness xy: urad", "urad")
    band = budget.bands[0]
    assert band.value == pytest.approx(model.nominal.results[0].band_um)
    assert band.low < band.high


def test_runs_of_another_correlation_are_not_continued(tmp_path: Path) -> None:
    """An interrupted Monte Carlo goes on only with the same certificate."""

    def stop(done: int, total: int) -> None:
        if done > total // 2:
            raise KeyboardInterrupt

    kept = tmp_path / "runs"
    with pytest.raises(KeyboardInterrupt):
        run_monte_carlo(modelled(quiet_gauge(), recording=RECORDING), 3000, 1, checkpoint=kept, progress=stop)
    correlated = modelled(quiet_gauge(1.0), recording=RECORDING)
    resumed = run_monte_carlo(correlated, 3000, 1, checkpoint=kept)
    np.testing.assert_array_equal(resumed.u, run_monte_carlo(correlated, 3000, 1).u)


def test_budget_of_gaps_has_a_line_for_every_defined_error_only() -> None:
    evaluation = with_gaps()
    recording = run(3).recording
    frame = recording.frame
    kept = ~frame["face"].isin([4, 7]) & ~((frame["face"] == 9) & (frame["cycle"] > 1))
    budget = make_budget(
        modelled(quiet_gauge(), recording=Recording(frame[kept].reset_index(drop=True), {}, "gaps.csv"))
    )
    result = evaluation.results[0]
    defined = {
        (f"{name}_um", int(face))
        for name in ("xf", "xb", "xm", "xr")
        for face, value in zip(result.face, getattr(result, f"{name}_um"), strict=True)
        if not math.isnan(value)
    }
    assert {(one.name, one.face) for one in budget.lines if one.face is not None} == defined


@settings(max_examples=15)
@given(
    u=st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12),
    r=st.floats(0.0, 1.0),
    resolution=st.floats(0.01, 5.0),
    probing=st.floats(0.0, 2.0),
)
def test_contributions_add_up_in_quadrature(u: list[float], r: float, resolution: float, probing: float) -> None:
    gauge = replace(quiet_gauge(r), u_um=np.resize(np.array(u), shipped()[0].n_faces))
    stated = UncertaintyTable(resolution_um=resolution, probing_um=StandardUncertainty(u=probing))
    budget = make_budget(modelled(gauge, replace(shipped()[1], stated=stated), RECORDING))
    for one in budget.lines:
        assert one.expanded.u == pytest.approx(math.hypot(*one.contribution.values()), rel=1e-7, abs=1e-9)
        assert one.expanded.expanded == pytest.approx(one.expanded.k * one.expanded.u)
        assert one.expanded.k >= 2.0


RECORDING = measured()


def test_files_are_read_back_and_belong_to_one_evaluation(tmp_path: Path) -> None:
    gauge = quiet_gauge()
    model = modelled(gauge, recording=RECORDING)
    budget = make_budget(model)
    write_budget(tmp_path, stored_budget(model, budget, 0))
    stored = read_budget(tmp_path)
    assert len(stored.quantities) == len(budget.lines)
    assert stored.find("xm", 1, 5).u_um == pytest.approx(line(budget, "xm_um", 5).expanded.u)  # type: ignore[union-attr]
    rows = list(csv.DictReader(budget_csv(stored).splitlines()))
    assert float(rows[0]["u: certificate"]) == pytest.approx(line(budget, "r_eff_mm").contribution["certificate"])
    evaluation = evaluation_to_dict(evaluate(RECORDING, gauge))
    check_budget(stored, evaluation, "budget.json")
    other = evaluation_to_dict(evaluate(measured(noise_um=2.0), gauge))
    with pytest.raises(InputError, match="budget of another evaluation: r_eff of placement 1; found"):
        check_budget(stored, other, "budget.json")
    with pytest.raises(InputError, match="origin of R_eff"):
        check_budget(stored, {**evaluation, "r_eff_origin": "all"}, "budget.json")


@pytest.mark.parametrize("percent", [50.0, 60.0, 68.0])
def test_a_small_coverage_has_a_factor_below_one(tmp_path: Path, percent: float) -> None:
    """Closed form: 0.674 standard deviations hold half of a normal distribution. A DCC has no k < 1."""
    model = modelled(quiet_gauge(), recording=RECORDING)
    stored = stored_budget(model, make_budget(model, BudgetOptions(percent=percent)), 0)
    write_budget(tmp_path, stored)
    least = min(line.k for line in read_budget(tmp_path).quantities)
    assert least == pytest.approx(NormalDist().inv_cdf(0.5 + percent / 200.0), abs=1e-3)
    evaluation = {"comments": {}, "placements": []}
    with pytest.raises(InputError, match=rf"a coverage factor below 1 .*found k = 0\.\d+ \({percent:g} %\)"):
        machine_certificate(evaluation, stored, laboratory(), model.gauge, None)


def test_a_file_that_is_no_budget_is_named(tmp_path: Path) -> None:
    model = modelled(quiet_gauge(), recording=RECORDING)
    data = budget_to_dict(model, make_budget(model), 0)
    for text, message in (
        ("{", "budget.json:1: not valid JSON"),
        ('{"format": "stepgauge evaluation 1"}', "not a budget"),
        (json.dumps(data), "this budget has no checksum"),
        (json.dumps({**data, "checksum": "0" * 64}), "this budget was changed after it was written"),
        ({**data, "quantities": [{**data["quantities"][0], "k": 0.0}]}, r"key quantities.0.k is wrong"),
    ):
        if isinstance(text, dict):
            write_json(tmp_path / "budget.json", text)
        else:
            (tmp_path / "budget.json").write_text(text)
        with pytest.raises(InputError, match=message):
            read_budget(tmp_path)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("probe_um = 0.1", r"key uncertainty.probe_um is not known; expected probing_um\?"),
        ("probing_um = -0.1", "key uncertainty.probing_um.u is wrong"),
        ("probing_um = { u = 0.1, dof = 0 }", "key uncertainty.probing_um.dof is wrong"),
        ("resolution_um = 0", "key uncertainty.resolution_um is wrong"),
        ('gauge_temperature_K = "0.1"', "key uncertainty.gauge_temperature_K.u is wrong"),
    ],
)
def test_wrong_keys_of_the_machine_file(tmp_path: Path, table: str, message: str) -> None:
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(f"[uncertainty]\n{table}\n{source}")
    with pytest.raises(InputError, match=message):
        read_machine(tmp_path / "machine.toml")


def test_what_is_asked_goes_before_what_the_machine_file_states() -> None:
    machine = shipped()[1]
    stated = replace(machine, stated=UncertaintyTable(gauge_temperature_K=StandardUncertainty(u=0.2)))
    assert (machine.u_gauge_temperature_K(), stated.u_gauge_temperature_K()) == (0.0, 0.2)
    assert (stated.u_gauge_temperature_K(0.0), stated.u_gauge_temperature_K(0.5)) == (0.0, 0.5)


def test_values_that_nothing_depends_on_stand_with_nothing(machine: Machine) -> None:
    uncertain = (*machine.uncertain, Uncertain("machine.repeatability_um", 0.3, 0.05))
    budget = make_budget(modelled(quiet_gauge(), replace(machine, uncertain=uncertain), RECORDING))
    assert "machine.repeatability_um" not in [source.name for source in budget.sources]


def test_command_line(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from stepgauge.cli import cli

    write_recording(tmp_path / "recording.csv", run(3).recording)
    placement = lay(shipped()[0])
    details = {"uncertainty": {"yaw_urad": 5.0, "pitch_urad": 5.0}}
    write_placement(tmp_path / "placement.toml", replace(placement, details=details))
    common = ["-g", "step-gauge-420", "-m", "bridge-cmm", "-o", str(tmp_path / "out")]

    def call(*more: str) -> str:
        words = ["budget", str(tmp_path / "recording.csv"), *common, *more]
        result = CliRunner().invoke(cli, words)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            return str(result.exception)
        return result.output

    said = call("-p", str(tmp_path / "placement.toml"), "--runs", "200", "--u-gauge-temperature", "0.1")
    assert "not evaluated: resolution; state it by resolution_um in [uncertainty]" in said
    assert "not evaluated: alignment" not in said
    assert "Monte Carlo u" in said
    assert (tmp_path / "out" / "budget-1.png").stat().st_size > 20_000
    stored = read_budget(tmp_path / "out")
    assert {source.name for source in stored.sources} >= {"alignment", "gauge temperature", "certificate"}
    full = call("--runs", "0", "--certificate-correlation", "1", "--coverage", "99", "--blocks", "1:3")
    assert "not evaluated: alignment" in full
    assert "99 %" in full
    assert read_budget(tmp_path / "out").quantities[-1].face == 5
    assert "too few runs" in call("--runs", "1")
    other = ["-m", str(tmp_path / "other.toml")]
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    (tmp_path / "other.toml").write_text(source.replace('name = "Bridge CMM"', 'name = "Another"'))
    assert "not the machine of this recording; found Another" in call(*other)
    assert "one placement file per placement" in call("-p", "a", "-p", "b") or "no such file" in call("-p", "a")


def test_placements_must_match(gauge: Gauge) -> None:
    a = make_placement([0, 0, 0], [0, 400, 0], 1, gauge.n_blocks)
    with pytest.raises(InputError, match="one placement file per placement; found 2; expected 1 or none"):
        make_budget(modelled(quiet_gauge(), recording=RECORDING), BudgetOptions([a, a]))

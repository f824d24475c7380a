"""What a diagnosis writes: the contract of the JSON, the report in words, and a machine file that simulates better."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.design import planned_command
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.further_runs import further_runs
from stepgauge.diagnosis.laws.library import effect_families
from stepgauge.diagnosis.output.files import commands_in, diagnosis_to_dict, write_diagnosis
from stepgauge.diagnosis.output.machine_text import machine_text
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.diagnosis.result import Diagnosis, Finding, GaugeDiagnosis, Located
from stepgauge.diagnosis.wording.aliases import even_steps_mm
from stepgauge.diagnosis.wording.findings import name_of, remedy
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.diagnosis.wording.notation import plus_minus, probability, symbol, um
from stepgauge.effects import Probings, along_approach_um, effect_kinds, make_effects
from stepgauge.effects.grids import LEADS_MM
from stepgauge.errors import InputError
from stepgauge.files.notation import significant
from stepgauge.machine.file import read_machine
from stepgauge.machine.readout import machine_effects
from stepgauge.programs import DIALECTS
from stepgauge.recording import Recording
from stepgauge.reports.diagnosis import diagnosis_story
from stepgauge.reports.findings import uncertainties, values
from stepgauge.reports.first_steps import MOST_RIVALS
from stepgauge.reports.render import markdown
from tests.diagnosis.made import (
    ALONG_X,
    SCALE,
    gauge,
    machine,
    made,
    made_insufficient,
    made_unknown,
    record,
    rms,
)

VERDICTS = {"adequate", "effects", "unknown", "insufficient"}
NAMES = ("null", "scale", "scale, one placement", "pair", "growth", "outliers", "unknown", "insufficient")


def case(name: str) -> tuple[Recording, GaugeDiagnosis]:
    return {"unknown": made_unknown, "insufficient": made_insufficient}.get(name, lambda: made(name))()


def said(name: str) -> dict[str, Any]:
    recording, found = case(name)
    return diagnosis_to_dict(replace(found, recordings=(recording,)))


def report_text(data: dict[str, Any], figures: Sequence[str] = ()) -> str:
    return markdown(diagnosis_story(data, dict.fromkeys(figures, "")))


def numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from numbers(one)
    elif isinstance(value, float):
        yield value


def test_the_appendix_says_what_may_stand_for_a_finding_and_for_which_others_with_it() -> None:
    """A combination stood there once for each of its companions, which were not named."""
    data = said("scale")
    data["effects"][0]["several"] = [
        {"labels": ["geometric_errors"], "others": ["squareness_xy"], "odds": 0.04},
        *({"labels": ["roll_x", f"block_defect_{k}"], "others": [], "odds": 1e-3} for k in range(1, 8)),
    ]
    lines = [line for line in report_text(data).splitlines() if "may stand in its place" in line]
    assert lines[0] == "- geometric errors may stand in its place, and in that of squareness xy: 25 to 1 against"
    assert lines[1] == "- roll x and block defect 1 may stand in its place: 1\u00a0000 to 1 against"
    assert len(lines) == 5


@pytest.mark.parametrize("name", NAMES)
def test_the_json_keeps_the_contract(name: str) -> None:
    data = said(name)
    assert data["verdict"] in VERDICTS
    fit = {"noise_um", "rms_before_um", "rms_after_um", "holdout_rms_before_um", "holdout_rms_after_um"}
    assert fit | {"chi2_dof_before", "chi2_dof_after", "holdout"} <= set(data["fit"])
    for effect in data["effects"]:
        assert effect["kind"] in effect_kinds()
        assert {"probability", "confounded_with", "alternatives", "reason", "separate_by", "set", "several"} <= set(
            effect
        )
        assert 0.0 <= effect["probability"] <= 1.0
        for parameter in effect["parameters"].values():
            assert set(parameter) in ({"value"}, {"value", "u", "unit"})
    for one in data["located"] + data["unexplained"]:
        (stated,) = {"probability", "probability_if_alone"} & set(one)
        assert set(one) - {"beside", "laws", "separate_by", "expected_information_nats", "rms_um"} == {
            "covariate",
            "side",
            "where",
            "phrases",
            "share",
            stated,
            "form",
        }
        if one["form"] == "smooth" and "beside" in one:
            assert f"{one['covariate']} and {one['beside']}" in one["where"]
        assert 0.0 <= one[stated] <= 1.0
    assert all(math.isfinite(number) for number in numbers(data))
    json.dumps(data, allow_nan=False)


def test_named_parameters_are_the_truth_within_their_uncertainty() -> None:
    (effect,) = said("scale")["effects"]
    assert effect["parameters"]["axis"] == {"value": "x"}
    ppm = effect["parameters"]["ppm"]
    assert ppm["unit"] == "um/m"
    assert abs(ppm["value"] - 8.0) < 4.0 * ppm["u"]


def test_what_is_not_known_is_null() -> None:
    recording, found = made("null")
    fit = replace(found.fit, chi2_dof_after=math.nan, holdout={})
    data = diagnosis_to_dict(replace(found, fit=fit, recordings=(recording,)))
    assert data["fit"]["chi2_dof_after"] is None
    assert data["fit"]["holdout_rms_before_um"] is None


def test_held_out_numbers_are_those_of_the_first_kind_of_group() -> None:
    fit = said("scale")["fit"]
    assert fit["holdout_rms_before_um"] == fit["holdout"]["cycles"]["rms_before_um"]
    assert fit["holdout_rms_after_um"] == fit["holdout"]["cycles"]["rms_after_um"]
    assert fit["holdout_rms_after_um"] < 0.8 * fit["holdout_rms_before_um"]


def test_outliers_are_found_again_in_the_file_that_they_stand_in() -> None:
    recording, found = made("outliers")
    first, second = recording.frame.iloc[:50], recording.frame.iloc[50:]
    parts = tuple(Recording(f, {}, p) for f, p in ((first, "deep/one.csv"), (second, "deep/two.csv")))
    (effect,) = diagnosis_to_dict(replace(found, recordings=tuple(parts)))["effects"]
    assert effect["parameters"]["rows"] == {"value": [5, 60]}
    assert [(row["recording"], row["row"]) for row in effect["rows"]] == [("one.csv", 5), ("two.csv", 10)]
    assert all(abs(row["off_um"] - 6.0) < 1.5 for row in effect["rows"])
    assert replace(found, recordings=tuple(parts)).row_in_file(51) == ("two.csv", 1)


def test_all_files_are_written_and_read_back(tmp_path: Path) -> None:
    recording, found = made("scale")
    paths = write_diagnosis(tmp_path / "new", replace(found, recordings=(recording,)))
    names = {path.name for path in paths}
    assert {"diagnosis.json", "diagnosis.md", "machine.diagnosed.toml", "residuals.png", "effects.png"} <= names
    assert set(found.placements) <= names
    assert {path.name for path in (tmp_path / "new").iterdir()} == names
    assert Diagnosis.read(paths[0]).verdict == "effects"


def test_checksums_are_those_of_the_files(tmp_path: Path) -> None:
    import hashlib

    recording, found = made("null")
    path = tmp_path / "r.csv"
    path.write_text("content")
    inputs = diagnosis_to_dict(replace(found, recordings=(replace(recording, path=str(path)),)))["inputs"]
    assert inputs["recordings"] == [{"path": str(path), "sha256": hashlib.sha256(b"content").hexdigest()}]
    assert len(inputs["gauge"]["sha256"]) == len(inputs["gauge"]["faces_sha256"]) == 64


@pytest.mark.parametrize("name", NAMES)
def test_the_report_says_what_the_json_says(name: str) -> None:
    data = said(name)
    text = report_text(data, ["residuals.png"])
    assert f"**Verdict: {data['verdict']}.**" in text
    assert f"{significant(data['noise']['sigma_um'])} um" in text
    for effect in data["effects"]:
        assert effect["kind"].replace("_", " ") in text
        assert effect["meaning"] in text
        for kind in effect["confounded_with"]:
            assert all(name_of(part) in text for part in kind.split(" + "))
        for key, parameter in effect["parameters"].items():
            if "unit" in parameter:
                assert f"- {symbol(key, parameter, 2)}= {plus_minus(parameter)}" in text
    for one in data["unexplained"]:
        assert one["where"] in text
    assert "None" not in text
    assert "nan" not in text


def test_the_report_says_what_a_recording_that_cannot_tell_should_have_had() -> None:
    text = report_text(said("insufficient"))
    assert "more cycles: too few repeats" in first_page(text)
    assert "degrees of freedom; measure more cycles" in text
    assert "The gauge lay in one place" in text
    assert "The gauge lay in one place" not in report_text(said("scale"))


def test_the_report_of_no_repeats_says_what_that_costs() -> None:
    data = said("null")
    data["noise"]["from_repeats"] = False
    assert "No face was probed twice" in report_text(data)
    assert "No face was probed twice" not in report_text(said("null"))
    assert "every face probed at least twice" in report_text(data | {"verdict": "insufficient"})


def first_page(text: str) -> str:
    return text.split("## Evidence")[0]


def test_what_remains_says_each_covariate_once() -> None:
    data = said("unknown")
    first = data["unexplained"][0]
    data["unexplained"] = [first, {**first, "where": "in another way too", "probability": 0.5}]
    text = report_text(data)
    (row,) = [line for line in first_page(text).splitlines() if f"law: {first['covariate']} |" in line]
    assert f"{first['where']}; in another way too" in row
    assert f" {probability(first['probability'])} |" in row


def test_what_speaks_against_the_nearest_law_stands_beside_what_remains() -> None:
    data = said("unknown")
    data["unexplained"][0]["laws"] = [{"labels": ["temperature_cycle_x"], "odds": 0.025}]
    text = first_page(report_text(data))
    assert "in place of what has none: temperature cycle x is the nearest law; the form is 40 times as probable" in text


def test_what_to_do_stands_before_the_evidence_for_it() -> None:
    """Sets with every member's own value and instruction, and what separates them; no chi-square, no trail."""
    data = said("scale, one placement")
    text = report_text(data)
    first = first_page(text)
    (effect,) = data["effects"]
    assert len(effect["set"]) > 1
    for member in effect["set"][: 1 + MOST_RIVALS]:
        (row,) = [line for line in first.splitlines() if member["meaning"] in line]
        assert row.startswith("| 1 |" if member is effect["set"][0] else f"| or | {name_of(member['label'])} |")
        assert values(member).replace("\n", "; ") in row
        assert uncertainties(member).replace("\n", "; ") in row
        assert f" {probability(member['conditional_probability'] * effect['probability'])} |" in row
        alone = {name: {**p, "u": None} for name, p in member["parameters"].items()}  # each u has its column
        assert remedy({**member, "parameters": alone}).repair in row
        assert remedy(member).check in first
    assert effect["commands"][0] in first
    for word in ("chi-square", "held out", "Steps of the search", "degrees of freedom"):
        assert word not in first
        assert word in text


@pytest.mark.parametrize("name", NAMES)
def test_a_probability_is_told_to_two_digits_and_never_as_certain(name: str) -> None:
    text = report_text(said(name))
    assert "probability 1" not in text
    assert "| 1.00 |" not in text


def test_the_odds_and_the_predictive_check_are_in_the_report() -> None:
    data = said("scale")
    assert set(data["probabilities"]) == {"adequate", "all_geometry", "explained", "scatter", "statements", "possible"}
    assert {one["check"] for one in data["checks"]} == {"rows", "repeats", "sequence", "tails"}
    text = report_text(data)
    assert "| nothing beyond the scatter | below 0.01 |" in text
    for one in data["checks"]:
        assert f"| {one['check']} | {one['deviation']:.1f} | passes | {one['words']} |" in text
    failed = data["checks"][0] | {"passed": False}
    assert f"check of the {failed['check']} fails" in first_page(report_text(data | {"checks": [failed]}))


def test_commands_name_what_is_shipped_by_its_name() -> None:
    """No file inside the installed package."""
    (command,) = said("scale, one placement")["effects"][0]["commands"]
    assert "-g step-gauge-420 -m bridge-cmm " in command


def test_the_same_kind_twice_is_said_once() -> None:
    _, found = made("pair")
    one = found.findings[0]
    assert replace(found, findings=(one, one, one)).summary().splitlines()[0].count(name_of(one.label)) == 1
    assert f"twice {name_of(one.label)}" in replace(found, findings=(one, one)).summary()


def test_what_is_left_without_a_form_is_in_the_report() -> None:
    recording, clean = made("null")
    hidden = 0.02 * clean.data.probings.approach("x") * clean.data.probings.coordinate_mm("x")
    um_left = clean.data.without_origins(clean.after_um + hidden)
    far = Located("machine x", "both", "trend", "grows", 1.0, 0.0, share_um=clean.data.without_origins(hidden))
    found = replace(clean, verdict="unknown", after_um=um_left, before_um=um_left, unexplained=(far,))
    said = diagnosis_to_dict(replace(found, recordings=(recording,)))
    assert said["unexplained"][0]["rms_um"] == pytest.approx(rms(clean.data.without_origins(hidden)))
    assert said["fit"]["rest_rms_um"] == pytest.approx(rms(clean.after_um))
    text = report_text({**said, "inputs": said["inputs"]})
    assert f"Without the structure that is stated {um(said['fit']['rest_rms_um'])} rms are left" in text


def test_commands_stand_alone_in_the_report() -> None:
    recording, found = made("scale, one placement")
    first = replace(found.findings[0], separate_by="the gauge turned: stepgauge plan separate-1.toml -o separate-1.dmi")
    changed = replace(found, findings=(first,), placements={"separate-1.toml": "text"})
    data = diagnosis_to_dict(replace(changed, recordings=(recording,)), folder="some/where")
    command = "stepgauge plan some/where/separate-1.toml -o some/where/separate-1.dmi"
    assert data["effects"][0]["commands"] == [command]
    assert f"```sh\n{command}\n```" in report_text(data)


@pytest.mark.parametrize(
    ("parameter", "text"),
    [
        ({"value": 2.4512, "u": 0.21, "unit": "um/m"}, "2.45 ± 0.42 um/m"),
        ({"value": 304.91, "u": 7.3, "unit": "s"}, "305 ± 15 s"),
        ({"value": -12575.1, "u": 2670.1, "unit": "um/m"}, "-12600 ± 5300 um/m"),
        ({"value": 41.26, "u": 4.99, "unit": "mm"}, "41 ± 10 mm"),
        ({"value": 12.3456, "u": None, "unit": "mm"}, "12.35 mm"),
        ({"value": -0.0123, "u": 0.0004, "unit": "K"}, "-0.01230 ± 0.00080 K"),
        ({"value": 5.93e-50, "u": 3.76e-25, "unit": "s"}, "5.930e-50 ± 7.5e-25 s"),
        ({"value": [1, 2]}, "1, 2"),
        ({"value": "x"}, "x"),
    ],
)
def test_parameters_are_printed_to_two_digits_of_their_uncertainty(parameter: dict[str, Any], text: str) -> None:
    assert plus_minus(parameter) == text


def stated(effects: list[Any]) -> dict[str, Any]:
    """What a headline needs of a diagnosis."""
    return {"verdict": "effects", "effects": effects, "inputs": {}, "probabilities": {}}


def effect_said(kind: str, confounded_with: tuple[str, ...] = (), several: tuple[tuple[str, ...], ...] = ()) -> Any:
    """What a summary needs of a finding."""
    combinations = [{"labels": list(laws), "others": [], "odds": 0.5} for laws in several]
    return {
        "kind": kind,
        "label": kind,
        "parameters": {},
        "confounded_with": list(confounded_with),
        "alternatives": [],
        "several": combinations,
    }


def test_several_findings_with_sets_are_numbered_and_their_laws_have_their_axes() -> None:
    radius = effect_said(
        "effective_radius",
        ("trigger_delay", "reversal_error + reversal_error"),
        (("reversal_error_x", "reversal_error_y"), ("reversal_error_x", "squareness_xy")),
    )
    text = "tip correction (or trigger delay or reversal error x + reversal error y)"
    assert headline(stated([radius])).endswith(f": {text}.")
    both = headline(stated([radius, effect_said("misalignment")]))
    assert both.endswith(f": 1: {text}; 2: misalignment.")
    alone = headline(stated([effect_said("misalignment"), effect_said("misalignment")]))
    assert alone.endswith(": twice misalignment.")


@pytest.mark.parametrize("aliased", [True, False])
def test_an_alias_is_only_spoken_of_where_one_is_named(aliased: bool) -> None:
    parameters = {"axis": {"value": "x"}, "period_mm": {"value": 10.0, "u": 0.1, "unit": "mm"}}
    one = {
        "kind": "periodic_scale_error",
        "parameters": parameters,
        "aliases": {"periods_mm": [5.0]} if aliased else {},
    }
    check = remedy(one).check
    assert ("alias" in check) == aliased
    assert "{" not in check
    assert check.startswith("Compare the period, and" if aliased else "Compare the period with the pitch of the x")


def test_a_pitch_that_goes_into_the_step_of_the_faces_is_a_limit() -> None:
    """Of a gauge along x every tip radius may be a periodic error of the screw; a diagonal tells them apart."""
    steps = diagnosis_to_dict(made("scale")[1])["measured"]["even_steps_mm"]
    assert steps == {"x": pytest.approx(20.0, abs=0.01), "y": pytest.approx(20.0, abs=0.01)}
    text = report_text(said("scale"))
    assert "whole steps of 20.00 mm of x" in text
    assert "(1, 2, 2.5, 4, 5, 10 or 20 mm)" in text
    beside = record(machine(), [ALONG_X, (1.0, 1.0, 0.0)], seed=3)
    assert set(even_steps_mm(make_residuals(beside, gauge(), machine()))) == {"y"}
    shifted = record(machine(), [ALONG_X, ALONG_X], seed=3, centres=[(350.0, 600.0, 250.0), (354.7, 600.0, 250.0)])
    assert even_steps_mm(make_residuals(shifted, gauge(), machine())) == {}


def test_half_of_the_periods_of_a_machine_with_screws_are_usual_leads() -> None:
    """Shapes compete by the volume of their prior: an error of every lead lost against any period that fits noise."""
    data = make_residuals(record(machine(), [ALONG_X, (1.0, 1.0, 0.0)], seed=3), gauge(), machine())
    with_screws = shipped_priors().adapt(["machine tool"])
    every = (effect_families(data, one) for one in (shipped_priors(), with_screws))
    plain, screws = (next(one for one in own if one.label == "periodic_scale_error_x") for own in every)
    periods = np.array([atom["period_mm"] for atom in screws.atoms])
    leads = np.isin(periods, LEADS_MM)
    assert leads.sum() >= 10
    assert np.exp(screws.log_weight[leads]).sum() == pytest.approx(0.5 * leads.sum() / len(LEADS_MM), rel=0.1)
    assert np.exp(screws.log_weight[~leads]).sum() == pytest.approx(0.5 * np.exp(plain.log_weight).sum(), rel=0.1)


def finding(kind: str, **values: Any) -> Finding:
    """A finding of any kind, its effect checked as the machine file's would be."""
    (effect,) = make_effects([{"kind": kind, **values}], "test")
    estimates = {k: Estimate(v, 0.1, "") for k, v in values.items() if isinstance(v, float)}
    choices = {k: v for k, v in values.items() if not isinstance(v, float)}
    return Finding(kind, effect.label, effect, choices, estimates, 0.9, np.zeros(1))


@pytest.mark.parametrize(
    ("program", "dialect"), [("x.gcode", "grbl"), ("a.ngc; b.ngc", "linuxcnc"), ("", "dmis"), ("x.unknown", "dmis")]
)
def test_the_next_run_is_planned_in_the_language_of_the_program_that_was_run(program: str, dialect: str) -> None:
    _, found = made("null")
    run = next(further_runs(found.data))
    command = planned_command(run, replace(found.data, program=program), {})
    assert f" -d {dialect} " in command
    assert command.endswith(f"-o separate-1{DIALECTS[dialect].suffix}")
    assert commands_in(f"the gauge along x: {command}; nothing else") == [command]


EXAMPLES: list[tuple[str, dict[str, Any], list[str]]] = [
    ("reversal_slope", {"axis": "x", "um_per_m": 4.0}, ["reversal error of x grows", "4 um/m"]),
    ("drive_cycle", {"direction": "x", "amplitude_um": 1.5, "turn_s": 480.0}, ["worm", "480 s"]),
    ("scale_error", {"axis": "x", "ppm": 10.0}, ["x scale", "too long", "10 um/m"]),
    ("scale_error", {"axis": "x", "ppm": -10.0}, ["too short"]),
    ("scale_curvature", {"axis": "x", "um_per_m2": 30.0}, ["parabola"]),
    (
        "periodic_scale_error",
        {"axis": "x", "period_mm": 10.0, "amplitude_um": 0.5},
        ["every 10 mm", "0.5 um", "twice that"],
    ),
    (
        "interpolation_error",
        {"axis": "x", "period_mm": 2.0, "amplitude_um": 0.5, "second_um": 0.2},
        ["every 2 mm", "0.5 um", "0.2 um at half"],
    ),
    ("local_scale_defect", {"axis": "x", "at_mm": 350.0, "width_mm": 40.0, "height_um": 0.9}, ["x = 350 mm", "0.9 um"]),
    ("squareness", {"plane": "xy", "urad": 3.0}, ["axes xy", "3 urad over 90 deg"]),
    ("squareness", {"plane": "xy", "urad": -3.0}, ["3 urad under 90 deg"]),
    ("angular_error", {"travel_axis": "x", "rotation_axis": "z", "urad_per_m": 9.0}, ["rotates about z", "9 urad"]),
    ("roll", {"axis": "x", "urad_per_m": 9.0}, ["rolls"]),
    ("straightness", {"axis": "x", "direction": "y", "um": 3.0, "length_mm": 1000.0}, ["+y", "3 um", "1000 mm"]),
    ("reversal_error", {"axis": "x", "um": -0.6}, ["less", "0.6 um"]),
    ("effective_radius", {"um": 2.0}, ["2 um later", "too small by twice"]),
    ("probe_lobing", {"amplitude_um": 0.5, "phase_deg": 10.0}, ["0.5 um", "three lobes", "10 deg"]),
    ("trigger_delay", {"ms": 1.0}, ["1 ms late", "at the speeds"]),
    ("lever_arm", {"mm": 14.5}, ["longer"]),
    ("pretravel_scale", {"percent": -9.0}, ["9 % smaller", "bends less"]),
    ("gauge_temperature", {"delta_K": 1.0}, ["1 K warmer"]),
    ("scale_temperature", {"axis": "x", "delta_K": 1.0}, ["warmer", "too short"]),
    ("thermal_drift", {"direction": "x", "rate_um_per_h": 10.0}, ["+x", "10 um/h"]),
    ("thermal_drift", {"direction": "x", "rate_um_per_h": -10.0, "time_constant_h": 0.1}, ["-x", "0.1 h", "10 um/h"]),
    ("temperature_cycle", {"direction": "y", "amplitude_um": 0.5, "period_s": 300.0}, ["every 300 s"]),
    ("step_change", {"direction": "x", "time_s": 200.0, "um": 0.6}, ["At 200 s", "+x"]),
    ("misalignment", {"mrad": 2.0}, ["2 mrad"]),
    ("block_defect", {"face": 14, "um": 0.8}, ["Face 14", "end block"]),
    ("block_shift", {"block": 7, "um": -1.5}, ["Both faces of block 7", "beginning block", "1.5 um"]),
    ("gauge_bending", {"supports_mm": [0.0, 400.0], "sag_um": 5.0}, ["5 um"]),
    ("approach_memory", {"um": 1.5, "touches": 8.0}, ["later", "8 touches"]),
    ("vibration", {"direction": "x", "amplitude_um": 0.5, "frequency_hz": 3.3}, ["3.3 Hz"]),
    ("noise_growth", {"per": "x", "rate": 2.0}, ["with x", "2 um"]),
    ("outliers", {"rows": (1, 2), "um": 3.0}, ["Some probings"]),
    ("kinematic_pretravel", {"um_per_N": 5.0, "lever_mm": 65.0, "arm_azimuth_deg": 20.0}, ["tripod", "20 deg"]),
    ("thermal_shift", {"column": "air_C", "direction": "x", "um_per_K": 2.0}, ["along x with air_C", "2 um/K"]),
    (
        "thermal_expansion_of",
        {"column": "air_C", "of": "gauge", "um_per_m_K": 10.0, "lag_s": 60.0},
        ["Lengths of gauge", "air_C, 60 s late"],
    ),
    ("thermal_expansion_of", {"column": "air_C", "of": "y", "um_per_m_K": 10.0}, ["Lengths of y"]),
    ("thermal_drift", {"direction": "x", "rate_um_per_h": 10.0, "start_s": 200.0}, ["from 200 s on"]),
    (
        "thermal_bending",
        {"column": "air_C", "axis": "x", "component": "ry", "order": 1, "per_K": 9.0},
        ["ry (r: a rotation) with air_C", "9 urad per K"],
    ),
    (
        "error_motion",
        {"axis": "x", "component": "x", "order": 3, "coefficient": 40.0, "about_mm": 350.0},
        ["power 3", "in x"],
    ),
    ("scale_warm_up", {"axis": "x", "um_per_m": -9.0, "time_constant_h": 0.5}, ["0.5 h", "too short"]),
    ("gauge_reversed", {"share": 1.02}, ["wrong way round", "share 1.02"]),
    (
        "gauge_soaking",
        {"warmed": "once", "delta_K": -0.5, "time_constant_h": 0.2},
        ["0.5 K colder", "once", "0.2 h"],
    ),
    ("gauge_soaking", {"warmed": "anew", "delta_K": 0.5, "time_constant_h": 0.77}, ["anew", "0.5 K warmer", "0.77 h"]),
    ("reversal_wear", {"axis": "x", "at_mm": 300.0, "width_mm": 90.0, "um": 2.0}, ["2 um larger about x = 300 mm"]),
    ("stick_slip", {"axis": "x", "um": 2.0, "decay_mm": 4.0}, ["differ by 2 um", "4 mm of way"]),
    ("scale_joint", {"axis": "x", "order": 0, "at_mm": 300.0, "size": 2.0}, ["gap of 2 um", "reads more"]),
    ("scale_joint", {"axis": "y", "order": 1, "at_mm": 300.0, "size": -9.0}, ["slope, by 9 um/m", "reads less"]),
    ("servo_lag", {"um_per_mm2_s2": 0.1}, ["square of the measuring speed"]),
    ("tip_change", {"placement": 2, "um": -2.0}, ["placement 2", "2 um earlier"]),
    ("seat_defect", {"um_per_N": 5.0, "lever_mm": 65.0, "share": 0.2}, ["One seat", "0 deg"]),
]


def with_air(data: Residuals) -> Residuals:
    """The same with the temperature of the air recorded, which rises by 2 K."""
    air_C = np.linspace(19.0, 21.0, len(data))
    frame = data.frame.assign(air_C=air_C)
    return replace(data, frame=frame, probings=Probings(frame, data.probings.setting))


@pytest.mark.parametrize(("kind", "values", "words"), EXAMPLES)
def test_what_a_finding_means_in_practice(kind: str, values: dict[str, Any], words: list[str]) -> None:
    sentence = meaning_of(finding(kind, **values))
    for word in words:
        assert word in sentence
    assert "{" not in sentence


def test_every_kind_that_can_be_named_has_its_sentence() -> None:
    assert {kind for kind, _, _ in EXAMPLES} == set(effect_kinds()) - {"axis_compensation", "empirical", "error_map"}


def meaning_of(one: Finding) -> str:
    """What the JSON file says of a finding of the recording without a cause, with the air recorded."""
    recording, found = made("null")
    told = replace(found, data=with_air(found.data), findings=(one,))
    return str(diagnosis_to_dict(replace(told, recordings=(recording,)))["effects"][0]["meaning"])


def diagnosed_machine(folder: Path, found: GaugeDiagnosis) -> Path:
    """The better machine file alone, without the figures and the report beside it."""
    path = folder / "machine.diagnosed.toml"
    path.write_text(machine_text(found, folder)[0])
    return path


@pytest.mark.parametrize("name", NAMES)
def test_the_machine_file_is_readable_and_keeps_what_its_owner_wrote(name: str, tmp_path: Path) -> None:
    _, found = case(name)
    path = diagnosed_machine(tmp_path, found)
    before = Path(found.data.machine.path).read_text()
    assert path.read_text().startswith(before.rstrip("\n"))
    added = machine_effects(read_machine(path))
    named = [f.kind for f in found.findings if f.kind != "outliers"]
    assert [effect.kind for effect in added] == named


@pytest.mark.parametrize("name", ["scale", "pair"])
def test_the_diagnosed_machine_explains_the_recording(name: str, tmp_path: Path) -> None:
    recording, found = case(name)
    again = make_residuals(recording, gauge(), read_machine(diagnosed_machine(tmp_path, found)))
    along = again.um * again.side
    origin = [along[again.placement == p].mean() for p in range(int(again.placement.max()) + 1)]
    left = rms(along - np.array(origin)[again.placement])
    assert left < 0.8 * found.fit.rms_before_um
    named = np.sum([one.share_um for one in found.findings], axis=0)
    assert left == pytest.approx(rms(found.data.without_origins(found.data.um - named)), rel=1e-3)
    assert left < found.fit.rms_after_um + 0.02  # what the laws leave out of their shapes is in no machine file


def test_simulated_anew_the_diagnosed_machine_makes_the_same_errors(tmp_path: Path) -> None:
    recording, found = made("pair")
    better = read_machine(diagnosed_machine(tmp_path, found))
    simulated = record(machine(better.effects, noise_um=0.0))
    columns = ["placement", "cycle", "face"]
    np.testing.assert_array_equal(simulated.frame[columns], recording.frame[columns])
    plain = record(machine(noise_um=0.0))
    before = ((recording.position_mm - plain.position_mm) * recording.approach).sum(axis=1) * 1e3
    after = ((recording.position_mm - simulated.position_mm) * recording.approach).sum(axis=1) * 1e3
    side, placement = found.data.side, found.data.placement
    assert rms(_without_origins(after, side, placement)) < 1.1 * 0.3
    assert rms(_without_origins(before, side, placement)) > 2.0 * 0.3


def _without_origins(um: np.ndarray, side: np.ndarray, placement: np.ndarray) -> np.ndarray:
    along = um * side
    return along - np.array([along[placement == p].mean() for p in (0, 1)])[placement]


def test_uncertainties_stand_beside_the_values(tmp_path: Path) -> None:
    _, found = made("scale")
    text, remarks = machine_text(found, tmp_path)
    u = found.findings[0].parameters["ppm"].u
    assert f"# u = {u:.2g} um/m" in text
    assert remarks == []


def test_files_beside_the_machine_file_are_found_from_the_new_folder(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "map.csv").write_text("coordinate_mm,error\n0,0\n700,5\n")
    text = Path(read_machine("bridge-cmm").path).read_text()
    table = '[[effect]]\nkind = "error_map"\naxis = "x"\ncomponent = "x"\nfile = "map.csv"\n'
    (home / "cmm.toml").write_text(text + table)
    model = read_machine(home / "cmm.toml")
    recording = record(machine(SCALE), [ALONG_X])
    found = diagnose(recording, gauge(), model)
    write_diagnosis(tmp_path / "out" / "deep", replace(found, recordings=(recording,)))
    moved = machine_effects(read_machine(tmp_path / "out" / "deep" / "machine.diagnosed.toml"))
    (own,) = machine_effects(model)
    share = along_approach_um(moved[0], found.data.probings)
    np.testing.assert_allclose(share, along_approach_um(own, found.data.probings))
    assert rms(share) > 0.0


def test_effects_in_one_line_are_kept(tmp_path: Path) -> None:
    text = Path(read_machine("bridge-cmm").path).read_text()
    path = tmp_path / "cmm.toml"
    path.write_text('effect = [{ kind = "roll", axis = "x", urad_per_m = 1.0 }]\n' + text)
    _, found = made("scale")
    data = replace(found.data, machine=read_machine(path))
    written, _ = machine_text(replace(found, data=data), tmp_path)
    assert [effect["kind"] for effect in tomllib.loads(written)["effect"]] == ["roll", "scale_error"]


def test_a_value_outside_the_vocabulary_is_left_out_with_its_reason(tmp_path: Path) -> None:
    recording, found = made("scale")
    first = found.findings[0]
    assert first.effect is not None
    wild = replace(first, effect=first.effect.replace_values(ppm=1e9))
    write_diagnosis(tmp_path, replace(replace(found, findings=(wild,)), recordings=(recording,)))
    assert read_machine(tmp_path / "machine.diagnosed.toml").effects == ()
    assert any("scale_error_x" in remark for remark in Diagnosis.read(tmp_path / "diagnosis.json").contents["remarks"])


def test_nothing_is_written_when_the_machine_file_has_gone(tmp_path: Path) -> None:
    recording, found = made("scale")
    data = replace(found.data, machine=replace(found.data.machine, path=str(tmp_path / "gone.toml")))
    with pytest.raises(InputError, match=r"gone\.toml"):
        write_diagnosis(tmp_path / "out", replace(replace(found, data=data), recordings=(recording,)))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("text", "words"), [("{", "not valid JSON"), ("{}", "not a diagnosis"), ("[]", "not a diag")])
def test_other_files_are_no_diagnosis(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "d.json").write_text(text)
    with pytest.raises(InputError, match=words):
        Diagnosis.read(tmp_path / "d.json")

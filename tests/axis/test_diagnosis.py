"""Diagnoses of axes without gauge and machine: known errors by name, in the user's units; unknown ones without."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import AxisRecording, write_axis_recording
from stepgauge.axis.sensors import not_candidates, without_probe
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.engine import diagnose
from stepgauge.effects import effect_kinds
from tests.axis.made import axis, distances, spot
from tests.cli.conftest import Run
from tests.conftest import ROOT
from tests.diagnosis.made import ALONG_X, gauge, machine, record

LINE = np.arange(0.0, 501.0, 25.0)
CIRCLE = np.arange(0.0, 360.0, 15.0)

BY_TOUCH = {kind for kind, one in effect_kinds().items() if one.touch}


def scale(per_unit: float):
    return lambda t, w: per_unit * t


NAMED = [
    (axis(LINE, scale(0.008)), {"scale_error": ("um/m", 8.0)}),
    (axis(LINE / 25.4, scale(0.3 * 25.4), 10.0, ("inch", None)), {"scale_error": ("uin/inch", 7.62)}),
    (axis(LINE / 10.0, scale(0.5), 2.0, ("um", "nm"), "capacitive"), {"scale_error": ("um/m", 500.0)}),
    (axis(LINE, lambda t, w: 2.0 * w), {"reversal_error": ("um", 4.0)}),  # in positive minus in negative travel
    (axis(np.arange(0, 300, 7.0), lambda t, w: 3 * np.sin(np.pi * t / 20)), {"periodic_scale_error": ("mm", 40.0)}),
    (
        axis(CIRCLE, lambda t, w: 8 * np.sin(np.radians(t)), 0.4, ("deg", None)),
        {"periodic_scale_error": ("arcsec", 8.0)},
    ),
    (spot(lambda t: 0.01 * (1 - np.exp(-t / 600)), 5e-4), {"thermal_drift": ("um/h", 60.0)}),
    (spot(lambda t: 0.005 * (t > 700), 5e-4), {"step_change": ("um", 5.0)}),
    (distances(3.0, 0.5), {"effective_radius": ("mm", 3.0)}),
]


@pytest.mark.parametrize(
    ("recording", "expected"), NAMED, ids=[f"{one.form}-{next(iter(e))}-{n}" for n, (one, e) in enumerate(NAMED)]
)
def test_a_known_error_is_named_with_its_size_in_the_users_unit(recording: AxisRecording, expected: dict) -> None:
    told = diagnose_axis(recording)
    said = told.contents
    assert said["verdict"] == "effects"
    assert [effect["kind"] for effect in said["effects"]] == list(expected)
    assert all(told.to_frame()["meaning"])
    for effect, (unit, value) in zip(said["effects"], expected.values(), strict=True):
        found = next(p for p in effect["parameters"].values() if p.get("unit") == unit)
        assert found["value"] == pytest.approx(value, rel=0.1)
        assert found["u"] > 0.0
        assert abs(found["value"] - value) < 4.0 * found["u"]


@pytest.mark.parametrize("targets", [2, 3, 4])
def test_of_a_machine_with_screws_a_few_targets_tell_no_period_but_their_scale(targets: int) -> None:
    made = axis(25.0 * np.arange(targets), scale(0.5))
    told = diagnose_axis(replace(made, comments=made.comments | {"kind": "machine tool"}))
    assert [effect["kind"] for effect in told.contents["effects"]] == ["scale_error"]
    assert told.contents["effects"][0]["parameters"]["ppm"]["value"] == pytest.approx(500.0, abs=5.0)


def test_a_screw_that_warms_as_it_is_driven_is_named_with_its_growth_and_its_time_constant() -> None:
    made = axis(LINE, scale(0.0))
    time_s = 30.0 * np.arange(len(made.frame))
    grown = 12e-6 * made.frame["target"] * (1.0 - np.exp(-time_s / 1800.0))
    frame = made.frame.assign(reading=made.frame["reading"] + grown, time_s=time_s)
    (effect,) = diagnose_axis(replace(made, frame=frame)).contents["effects"]
    assert effect["kind"] == "scale_warm_up"
    for name, true in (("um_per_m", 12.0), ("time_constant_h", 0.5)):
        found = effect["parameters"][name]
        assert abs(found["value"] - true) < 3.0 * found["u"] < 0.4 * true


@pytest.mark.parametrize(
    "recording",
    [
        axis(LINE, scale(0.0)),
        axis(CIRCLE, scale(0.0), 0.4, ("deg", None)),
        spot(lambda t: 0 * t, 5e-4),
        distances(0, 0.5),
    ],
    ids=["line", "circle", "spot", "distances"],
)
def test_scatter_alone_is_adequate(recording: AxisRecording) -> None:
    assert diagnose_axis(recording).contents["verdict"] == "adequate"


@pytest.mark.parametrize(("seed", "step"), [(0, True), (1, True), (7, True), (1, False)])
def test_targets_that_are_off_at_random_are_given_no_law(seed: int, step: bool) -> None:
    """Each target by itself, or a random walk along the axis: neither is a scale error or a period."""
    places = np.linspace(0.0, 500.0, 41)
    off = np.random.default_rng(10 + seed).normal(0.0, 3.0, len(places))
    off = np.cumsum(off) if step else off
    told = diagnose_axis(axis(places, lambda t, w: np.interp(t, places, off), seed=seed))
    assert told.verdict == "unknown"
    assert told.contents["effects"] == []
    (size,) = told.to_frame().query("parameter == 'rms'")[["value", "unit"]].to_numpy().tolist()
    assert size == [pytest.approx(off.std(), rel=0.1), "um"]


def test_heights_that_nobody_took_off_are_no_error_of_the_distance_meter() -> None:
    for heights_m in (0.3, 1.0):
        said = diagnose_axis(distances(0.0, 0.4, heights_m)).contents
        assert (said["verdict"], said["effects"]) == ("unknown", [])
        assert any("of one height" in line for line in said["limits"])


def test_a_touching_sensor_may_have_a_pretravel_and_a_laser_has_none() -> None:
    sets = {}
    for sensor in ("touch", "laser"):
        found = diagnose_axis(axis(LINE, lambda t, w: 2.0 * w, sensor=sensor)).contents["effects"][0]
        sets[sensor] = {found["kind"], *found["confounded_with"]}
    assert sets == {"touch": {"reversal_error", "effective_radius"}, "laser": {"reversal_error"}}


def test_a_gauge_that_a_laser_read_has_no_pretravel() -> None:
    """The same recording of a gauge, read later on all faces, by a probe that touches and by one that does not."""
    later = ({"kind": "effective_radius", "um": 3.0},)
    recording = record(machine(later), (ALONG_X,), cycles=3)
    kinds = {
        sensor: {kind for one in found.findings for kind in (one.kind, *one.confounded_with)}
        for sensor in ("touch", "laser")
        for found in [diagnose(recording.assign_comments(sensor=sensor), gauge(), machine())]
    }
    assert "effective_radius" in kinds["touch"]
    assert not kinds["laser"] & BY_TOUCH


def test_kinds_that_are_known_not_to_be_there_are_named_rightly(run: Run, tmp_path: Path) -> None:
    write_axis_recording(tmp_path / "axis.csv", NAMED[0][0])
    result = run("diagnose", tmp_path / "axis.csv", "--without", "scale_eror", "-o", tmp_path / "out")
    assert result.code == 2
    assert "no such kind of effect; found scale_eror; expected scale_error?" in result.err


def test_a_circle_has_no_scale_error_and_a_spot_no_scale() -> None:
    assert {"scale_error", "scale_curvature"} <= not_candidates("encoder", "axis", rotary=True)
    assert {"scale_error", "reversal_error", "effective_radius"} <= not_candidates("inductive", "spot")
    assert "effective_radius" not in not_candidates("edm", "distances")
    assert {"effective_radius", "probe_lobing"} <= set(without_probe("laser")) <= BY_TOUCH
    assert not without_probe("touch")
    assert not without_probe(None)


def test_every_number_that_was_recorded_is_looked_at() -> None:
    """A spot that follows a recorded temperature, which swings without a rule that time has."""
    made = spot(lambda t: 0 * t, 5e-4)
    warmth = np.cumsum(np.random.default_rng(4).normal(0.0, 0.2, len(made)))
    frame = made.frame.assign(reading=made.frame["reading"] + 4e-3 * warmth, spindle_C=20.0 + warmth)
    said = diagnose_axis(AxisRecording(frame, made.form, made.units, made.sensor, {}, "")).contents
    assert any("spindle_C" in json.dumps(one) for one in [*said["unexplained"], *said["effects"]])


def test_the_report_is_told_in_the_users_units_and_words(run: Run, tmp_path: Path) -> None:
    made = axis(CIRCLE, lambda t, w: 8 * np.sin(np.radians(t)) + 2 * w, 0.4, ("deg", None), "autocollimator")
    write_axis_recording(tmp_path / "axis.csv", made)
    result = run("diagnose", tmp_path / "axis.csv", "-o", tmp_path / "out")
    assert result.code == 0, result.err
    assert "arcsec" in result.out + result.err
    report = (tmp_path / "out/diagnosis.md").read_text()
    assert "read by an autocollimator" in report
    assert "once a turn" in report
    for word in (" um", " mm", " gauge", "face", "probing", "touch", "machine x"):
        assert word not in report, word
    said = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert said["axis"]["unit"] == "deg"
    assert "rms_before_arcsec" in said["fit"]
    assert (tmp_path / "out/residuals.png").stat().st_size > 10_000


def test_one_recording_of_an_axis_and_one_of_a_gauge_are_not_diagnosed_together(run: Run, tmp_path: Path) -> None:
    write_axis_recording(tmp_path / "axis.csv", NAMED[0][0])
    (tmp_path / "other.csv").write_text("cycle,face\n1,1\n")
    result = run("diagnose", tmp_path / "axis.csv", tmp_path / "other.csv", "-o", tmp_path / "out")
    assert result.code == 2
    assert "is of one axis, the others are of a gauge" in result.err


def test_one_target_has_scatter_and_nothing_else() -> None:
    """It ended in an error: nothing varies with which the scatter could grow."""
    found = diagnose_axis(axis(np.full(4, 100.0), lambda t, w: 0.0 * t)).found
    assert found.verdict == "adequate"
    assert not found.findings


def test_readings_on_the_steps_of_a_display_end_in_no_error() -> None:
    """A reversal of 1 um that grows along three targets, in steps of 0.1 um: a covariance was singular."""

    def rounded_um(target: np.ndarray, way: np.ndarray) -> np.ndarray:
        noise = np.random.default_rng(1).normal(0.0, 0.05, len(target))
        up, down = 0.45 + 0.0175 * (target - 15.0), -0.55 + 0.004 * (target - 15.0)
        return np.round(np.where(way > 0, up, down) + noise, 1)

    found = diagnose_axis(axis(np.array([15.0, 35.0, 55.0]), rounded_um, noise=0.0)).found
    assert found.verdict == "unknown"  # no law of the vocabulary has a reversal that grows along the axis


def test_a_spot_that_settles_is_a_thermal_drift_although_nothing_else_is_beside_it() -> None:
    """A hypothesis without terms and nuisance parameters has no products to be screened with."""
    rows = pd.read_csv(ROOT / "docs/recipes/data/drift.csv")
    found = sg.diagnose(sg.import_recording(rows, sensor="inductive"))
    assert set(found.to_frame()["kind"]) == {"thermal_drift"}


def test_an_error_that_is_the_same_both_ways_is_not_located_in_the_direction_of_travel() -> None:
    turn = axis(np.arange(0.0, 360.0, 30.0), lambda x, way: 5.0 * np.sin(np.radians(x) + 1.0), units=("deg", "arcsec"))
    located = diagnose_axis(turn).contents["located"]
    assert {one["covariate"] for one in located} <= {"position", "target"}
    assert all("opposite" not in one["where"] for one in located)


def test_the_summary_says_what_the_evidence_says() -> None:
    """A check that fails, and the values of rivals."""
    random = np.random.default_rng(7)
    two_places = axis(LINE, lambda x, way: np.sign(random.normal(size=len(x))), noise=0.05)
    told = diagnose_axis(two_places)
    assert [one["check"] for one in told.contents["checks"] if not one["passed"]] == ["tails"]
    assert "note: The posterior predictive check of the tails fails: excess of the fourth moment -1.9" in told.summary()
    bent = diagnose_axis(axis(LINE, lambda x, way: 8e-3 * x + 2.0 * np.sin(x / 500.0 * np.pi)))
    (rivals,) = [one["set"] for one in bent.contents["effects"] if len(one["set"]) > 1]
    for one in rivals[1:]:
        assert f"or {one['kind'].replace('_', ' ')}: " in bent.summary()


def test_two_steps_of_opposite_signs_are_two_findings() -> None:
    """Either may be the first in a hypothesis; each has the u of a difference of means."""
    told = diagnose_axis(spot(lambda t: 3e-3 * (t >= 600.0) - 2e-3 * (t >= 1300.0), 3e-4)).contents
    assert told["verdict"] == "effects"
    found = sorted((one["parameters"]["um"] for one in told["effects"]), key=lambda one: one["value"])
    assert [one["value"] for one in found] == pytest.approx([-2.0, 3.0], abs=0.2)
    expected = [0.3 * np.sqrt(1.0 / 70.0 + 1.0 / n) for n in (70.0, 60.0)]
    assert [one["u"] for one in found] == pytest.approx(expected, rel=0.2)


def test_single_readings_that_are_off_stand_in_the_table_by_their_place_and_with_the_sign_that_was_read() -> None:
    made = axis(np.linspace(0.0, 300.0, 16), lambda x, w: 0.01 * x + w, 0.2)
    frame = made.frame.copy()
    frame.loc[[37, 90], "reading"] += [0.009, -0.006]
    told = diagnose_axis(replace(made, frame=frame))
    table = told.to_frame().set_index("parameter")
    assert re.search(r"outliers: row 38 by [89]\.\d+ um, row 91 by -[56]\.\d+ um, probability", told.summary())
    assert frame.loc[90, "way"] < 0
    assert table.loc["iloc[37]", "value"] == pytest.approx(9.0, abs=0.8)
    assert table.loc["iloc[90]", "value"] == pytest.approx(-6.0, abs=0.8)
    assert set(table.loc[["iloc[37]", "iloc[90]"], "unit"]) == {"um"}

"""ISO 230-2 from readings of an instrument: closed forms, signs, what is left out and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import AxisRecording, ways_doubt
from stepgauge.errors import InputError
from stepgauge.standards.iso230 import AxisParameters
from stepgauge.standards.iso230_decision import Requirement, parameters_um
from stepgauge.standards.iso230_files import positioning_to_dict
from stepgauge.standards.positioning_axis import axis_positioning_test
from tests.axis.made import axis, distances
from tests.cli.conftest import Run
from tests.cli.conftest import run as run

TARGETS = np.array([0.0, 61.0, 119.0, 181.0, 240.0, 302.0])


def straight(sensor: str = "laser", **more: object) -> AxisRecording:
    """10 um/m and 3 um of reversal, without scatter unless it is asked for."""
    return axis(TARGETS, lambda target, way: 0.01 * target + 1.5 * way, **{"noise": 0.0, "sensor": sensor, **more})  # type: ignore[arg-type]


@pytest.mark.parametrize("units", [("mm", "um"), ("m", "mm"), ("inch", "uin")])
def test_slope_and_reversal_in_closed_form(units: tuple[str, str]) -> None:
    """In the user's units and in um alike: A = E = the range of both directions, R = B, and M the slope alone."""
    made = straight()
    frame = made.frame.assign(
        target=made.frame["target"] / {"mm": 1.0, "m": 1e3, "inch": 25.4}[units[0]],
        reading=made.frame["reading"] / {"mm": 1.0, "m": 1e3, "inch": 25.4}[units[0]],
    )
    found = axis_positioning_test(replace(made, frame=frame, units=made.units.of(*units))).axes[0]
    p = found.parameters
    np.testing.assert_allclose([p.B_um, p.mean_B_um, p.R_um], 3.0, atol=1e-6)
    np.testing.assert_allclose([p.E_um, p.A_um], 3.02 + 3.0, atol=1e-6)
    assert p.M_um == pytest.approx(3.02, abs=1e-6)
    np.testing.assert_allclose(found.targets.machine_mm, TARGETS, atol=1e-9)
    assert len(found.runs) == 5


def test_a_probe_that_touches_reads_what_the_machine_indicates() -> None:
    """Its certified targets are the actual positions, so the sign is the other; a person may say so of any sensor."""
    laser, probe = axis_positioning_test(straight()), axis_positioning_test(straight("touch"))
    assert laser.axes[0].parameters.mean_B_um == pytest.approx(3.0)
    assert probe.axes[0].parameters.mean_B_um == pytest.approx(-3.0)
    assert "target minus reading" in positioning_to_dict(probe)["sign_convention"]
    said = axis_positioning_test(straight(), "target")
    np.testing.assert_array_equal(said.axes[0].parameters.up.x_um, probe.axes[0].parameters.up.x_um)


def test_the_scatter_is_that_of_the_readings() -> None:
    """R up is 4 s of the worst target, by numpy of the very readings."""
    made = axis(TARGETS, lambda target, way: 0.0 * target, noise=2.0)
    found = axis_positioning_test(made).axes[0].parameters
    up = made.frame[made.frame["way"] > 0].assign(um=made.deviation[made.frame["way"] > 0])
    assert found.up.R_um == pytest.approx(4.0 * up.groupby("target")["um"].std(ddof=1).max(), rel=1e-6)


def test_rules_and_what_is_left_out() -> None:
    made = straight()
    frame = made.frame
    lost = frame.drop(frame[(frame["cycle"] == 4) & (frame["target"] > 200.0)].index)
    found = axis_positioning_test(replace(made, frame=lost)).axes[0]
    assert found.runs == (1, 2, 3, 5)
    assert [part.what for part in found.excluded] == ["runs 4"]
    met = {rule.asks: rule.met for rule in found.rules}
    assert met["5 runs in each direction"] is False
    assert met["5 targets per metre, 5 at least"] is True
    assert met["temperature of the reference known"] is False
    lone = frame[~((frame["target"] == TARGETS[-1]) & (frame["way"] < 0))]
    (part,) = axis_positioning_test(replace(made, frame=lone.assign(air_temperature_C=20.1))).axes[0].excluded
    assert part.what == "targets 302 mm"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: distances(0.0, 0.1), "no positioning of an axis; found distances"),
        (
            lambda: replace(straight(), frame=straight().frame.assign(cycle=1)),
            "a target was read twice; found target 0 mm",
        ),
        (lambda: replace(straight(), frame=straight().frame.query("cycle == 1")), "found 6 targets, 1 runs"),
    ],
)
def test_what_cannot_be_evaluated(wrong: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        axis_positioning_test(wrong())  # type: ignore[operator]


TURN_DEG = np.array([0.0, 46.0, 90.0, 137.0, 180.0, 226.0, 270.0, 314.0, 360.0])


def test_a_rotary_axis_is_told_in_arcsec_by_the_same_formulas(tmp_path: Path, run: Run) -> None:
    """One wave a turn of 5 arcsec and 4 arcsec of reversal: E is the range of all means, M that of the wave."""
    made = axis(TURN_DEG, lambda t, w: 5.0 * np.sin(np.radians(t)) + 2.0 * w, 1e-7, ("deg", None), "autocollimator")
    test = axis_positioning_test(made, requirement=Requirement.parse(["A=15"], 0.5))
    found = test.axes[0].parameters
    assert isinstance(found, AxisParameters)
    np.testing.assert_allclose([found.B_um, found.mean_B_um, found.R_um], 4.0, atol=1e-5)
    np.testing.assert_allclose([found.E_um, found.A_um, found.M_um], [14.0, 14.0, 10.0], atol=1e-5)
    assert all(rule.met for rule in test.axes[0].rules if "targets by travel" in rule.asks)
    few = replace(made, frame=made.frame[made.frame["target"].isin(TURN_DEG[::2])])
    (rule,) = [one for one in axis_positioning_test(few).axes[0].rules if "targets by travel" in one.asks]
    assert (rule.met, rule.found) == (False, "5 targets over 360.0°, asked 8")
    made.write(tmp_path / "table.csv")
    done = run(
        "test", "iso230", tmp_path / "table.csv", "--tolerance", "A=15", "--expanded-uncertainty", 0.5, "-o", tmp_path
    )
    assert "A 14.00 arcsec" in done.err
    said = json.loads((tmp_path / "iso230.json").read_text())
    assert said["decision"]["text"].startswith("The parameters conform. axis: A = 14.00 arcsec, tolerance 15 arcsec")
    assert said["axes"][0]["parameters_arcsec"]["M"] == pytest.approx(10.0)
    assert said["axes"][0]["measured_deg"] == [0.0, 360.0]
    assert not any(key.endswith(("_um", "_mm")) for key in [*said, *said["axes"][0], *said["axes"][0]["targets"][0]])
    header = (tmp_path / "iso230.csv").read_text().splitlines()[0]
    assert header.startswith("placement,target_deg,along_gauge_deg,block,mean_up_arcsec,u_mean_up_arcsec,s_up_arcsec")


@pytest.mark.parametrize("way", ["up", "down"])
def test_approaches_from_one_side_give_the_parameters_of_that_direction(way: str, tmp_path: Path, run: Run) -> None:
    """The same numbers as that direction has in a test of both; what needs both is not there and is not judged."""
    both = axis(TARGETS, lambda target, w: 0.01 * target + 1.5 * w, noise=0.4)
    alone = replace(both, frame=both.frame[both.frame["way"] == (1 if way == "up" else -1)])
    (test,) = axis_positioning_test(alone).axes
    known = parameters_um(axis_positioning_test(both).axes[0].parameters)
    found = parameters_um(test.parameters)
    assert found == {name: pytest.approx(known[name]) for name in (f"A_{way}", f"E_{way}", f"R_{way}")}
    (rule,) = [one for one in test.rules if one.asks == "targets approached in both directions"]
    assert not rule.met
    assert f"approached {way} only" in rule.found
    alone.write(tmp_path / "axis.csv")
    command = ("test", "iso230", tmp_path / "axis.csv", "-o", tmp_path / "out")
    done = run(*command, "--tolerance", "B=3")
    assert done.code == 2
    assert f"this parameter needs approaches from both sides; found B; expected A_{way}" in done.err
    assert run(*command, "--tolerance", f"A_{way}=9", "--expanded-uncertainty", 0.1).code == 0
    said = json.loads((tmp_path / "out/iso230.json").read_text())
    assert set(said["axes"][0]["targets"][0]) == {
        *("target_mm", "along_gauge_mm", "block"),
        *(f"mean_{way}_um", f"u_mean_{way}_um", f"s_{way}_um", f"r_{way}_um"),
    }  # fmt: skip
    assert said["decision"]["text"].startswith("The parameters conform.")
    assert (tmp_path / "out/iso230.pdf").stat().st_size > 10_000


def test_directions_that_the_order_of_the_targets_contradicts_are_doubtful() -> None:
    """Rising targets on all ways down and falling ones on all ways up; a table that is sorted tells nothing."""
    made = axis(TARGETS, lambda target, way: 0.0 * target)
    turned = replace(made, frame=made.frame.assign(way=-made.frame["way"]))
    rules = [rule.asks for rule in axis_positioning_test(turned).axes[0].rules if not rule.met]
    assert "directions of approach as the targets follow each other" in rules
    for kept in (
        made.frame,
        turned.frame[turned.frame["way"] < 0],
        turned.frame.sort_values(["cycle", "way", "target"]),
    ):
        assert ways_doubt(kept) is None


def test_the_verb_reads_an_axis_without_a_gauge(tmp_path: Path, run: Run) -> None:
    straight(noise=1e-6).write(tmp_path / "axis.csv")
    out = tmp_path / "out"
    done = run("test", "iso230", tmp_path / "axis.csv", "--tolerance", "A=12", "--expanded-uncertainty", 0.5, "-o", out)
    assert done.code == 0, done.err
    assert "A 6.02 um" in done.err
    said = json.loads((out / "iso230.json").read_text())
    assert said["instrument"] == "laser interferometer"
    assert "gauge" not in said
    assert said["decision"]["text"].startswith("The parameters conform.")
    assert (out / "iso230.csv").read_text().count("\n") == 7
    assert (out / "iso230.pdf").stat().st_size > 10_000
    for more, words in (
        (["--tip-diameter", 4], "has no tip"),
        (["-g", "step-gauge-420"], "--gauge: is for recordings of a step gauge"),
        (["--tolerance", "A=3", "--tolerance", "A=12"], "a parameter has two tolerances; found A=3 and A=12"),
        (["--expanded-uncertainty", 0], "out of range; found 0.0; expected more than 0 um"),
        (["--date", "2999-01-01"], "lies in the future; found 2999-01-01"),
        ([tmp_path / "axis.csv"], "setting up 2 repeats the readings of setting up 1"),
    ):
        done = run("test", "iso230", tmp_path / "axis.csv", *more, "-o", out)
        assert done.code == 2
        assert words in done.err
    (tmp_path / "gauge.csv").write_text("cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n1,1,0,0,0,1,0,0\n")
    done = run("test", "iso230", tmp_path / "gauge.csv", "-o", out)
    assert "--gauge: a recording of a step gauge needs it" in done.err


def test_a_piezo_stage_is_told_with_the_digits_that_it_has() -> None:
    """A reversal of 12 nm over 0.1 mm of travel, in a report for um and mm: three digits of the largest deviation."""
    rng, rows = np.random.default_rng(1), []
    for cycle in range(1, 6):
        for way, sign in (("+", 6.0), ("-", -6.0)):
            rows += [(at, 0.15 * at + sign + rng.normal(0.0, 0.1), way, cycle) for at in np.arange(0.0, 101.0, 10.0)]
    table = pd.DataFrame(rows, columns=["position [um]", "deviation [nm]", "direction", "run"])
    test = sg.iso230(sg.import_recording(table, sensor="laser"), tolerances="A=0.03", expanded_uncertainty_um=0.002)
    assert "mean_B 0.0120 um" in test.summary()
    assert "A = 0.02" in test.summary()
    assert test.test.units.position_decimals == 4

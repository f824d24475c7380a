"""ISO 230-2 from readings of an instrument: closed forms, signs, what is left out and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepgauge.axis.recording import AxisRecording
from stepgauge.errors import InputError
from stepgauge.standards.iso230_files import positioning_to_dict
from stepgauge.standards.positioning_axis import axis_positioning_test
from tests.axis.made import axis, distances
from tests.cli.conftest import Run
from tests.cli.conftest import run as run

TARGETS = np.array([0.0, 61.0, 119.0, 181.0, 240.0, 302.0])


def straight(sensor: str = "laser", **more: object) -> AxisRecording:
    """10 um/m and 3 um of reversal, without scatter."""
    return axis(TARGETS, lambda target, way: 0.01 * target + 1.5 * way, noise=0.0, sensor=sensor, **more)  # type: ignore[arg-type]


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
        (lambda: straight(both=False), "all targets were approached from one side; expected each target from both"),
        (lambda: straight(units=("deg", None)), "no positioning of a linear axis; found a rotary axis"),
        (lambda: distances(0.0, 0.1), "no positioning of a linear axis; found distances"),
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


def test_the_verb_reads_an_axis_without_a_gauge(tmp_path: Path, run: Run) -> None:
    straight().write(tmp_path / "axis.csv")
    out = tmp_path / "out"
    done = run("iso230", tmp_path / "axis.csv", "--tolerance", "A=12", "--expanded-uncertainty", 0.5, "-o", out)
    assert done.code == 0, done.err
    assert "A 6.02 um" in done.err
    said = json.loads((out / "iso230.json").read_text())
    assert said["instrument"] == "laser interferometer"
    assert "gauge" not in said
    assert said["overall"].startswith("The parameters conform.")
    assert (out / "iso230.csv").read_text().count("\n") == 7
    assert (out / "iso230.pdf").stat().st_size > 10_000
    for more, words in ((["--tip-diameter", 4], "has no tip"), (["-g", "nowhere.toml"], "")):
        done = run("iso230", tmp_path / "axis.csv", *more, "-o", out)
        assert (done.code == 2) == bool(words)
        assert words in done.err
    assert "needs --gauge" in run("iso230", tmp_path / "axis.toml", "-o", out).err

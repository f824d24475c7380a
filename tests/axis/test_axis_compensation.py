"""An axis beside which an instrument stood: measured, compensated by the table, measured again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import AxisRecording
from stepgauge.axis.units import AxisUnits
from stepgauge.compensation import FORMATS
from stepgauge.compensation.conventions import CONVENTIONS
from tests.axis.made import axis as made_axis
from tests.cli.conftest import invoke
from tests.compensating_controls import CONTROLS, Motor

PLAIN = ("grbl", "marlin", "rrf")
"""These know a scale and a backlash."""
UNITS = ("mm", "um"), ("inch", "uin"), ("m", "nm")


def error_um(motor: np.ndarray, sense: np.ndarray, wave_um: float) -> np.ndarray:
    """Indicated minus actual: a screw that is too long by 40 um per m, a wave, and a backlash of 6 um."""
    return 0.04 * motor + wave_um * np.sin(2 * np.pi * motor / 160.0) + 3.0 * sense


def measured(
    motor: Motor,
    start_mm: float,
    wave_um: float,
    sensor: str = "laser",
    runs: int = 2,
    unit: tuple[str, str] = UNITS[0],
) -> AxisRecording:
    """Readings at targets 9 mm apart up and down; a control sends the axis to ``motor(indicated, sense)``."""
    up = start_mm + 9.0 * np.arange(31)
    indicated, sense = np.tile(np.r_[up, up[::-1]], runs), np.tile(np.repeat([1, -1], 31), runs)
    at = np.array([float(motor(np.array([p]), int(s))[0]) for p, s in zip(indicated, sense, strict=True)])
    actual = at - 1e-3 * error_um(at, sense, wave_um) + 1e-7 * np.arange(len(at))  # no copies
    target, reading = (actual, indicated) if sensor == "touch" else (indicated, actual)
    told = AxisUnits.of(*unit)
    columns = {"placement": 1, "cycle": np.repeat(np.arange(1, runs + 1), 62), "way": sense}
    frame = pd.DataFrame({**columns, "target": target, "reading": reading})
    frame[["target", "reading"]] /= told.base_position
    return AxisRecording(frame, "axis", told, sensor, {}, "x.csv")


def largest_um(recording: AxisRecording, travel: str) -> float:
    """Largest deviation about the middle, of both senses together or of each."""
    um, way = recording.deviation * recording.units.base_deviation, recording.frame["way"].to_numpy()
    parts = [um] if travel == "both" else [um[way == one] for one in (1, -1)]
    return max(float(np.ptp(one)) / 2.0 for one in parts)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("start", [-300.0, 20.0])
def test_what_was_measured_again_with_the_table_in_force_has_a_tenth_of_the_error(name: str, start: float) -> None:
    """By every format, on a control written from its maker's sentence; a wrong sign would double the error."""
    form, wave = FORMATS[name], 0.1 if name in PLAIN else 4.0
    travel, home = ("both" if form.both else "mean"), round(start + 130.0, -1)
    before = measured(lambda p, _: p, start, wave)
    asked = {"unconfirmed_sense": name} if CONVENTIONS[name].unconfirmed else {}
    for source in (before, sg.iso230(before)):
        table = sg.compensate(source, to=name, axis="x", zero_at_mm=home, extend="linear", **asked)
        after = measured(CONTROLS[name](table.text, 0, home), start, wave)
        resolution = 1.0 if name.startswith("fanuc") else 0.0
        assert largest_um(after, travel) < max(0.1 * largest_um(before, travel), resolution)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("sensor", ["laser", "touch"])
def test_whoever_reads_and_in_whatever_unit_the_sign_is_that_of_indicated_minus_actual(
    sensor: str, unit: tuple[str, str]
) -> None:
    """A probe that touches reads what the axis indicates; its targets are where it is."""
    table = sg.compensate(measured(lambda p, _: p, 0.0, 4.0, sensor, 2, unit), to="csv", axis="x").to_frame()
    x = table["position_mm"].to_numpy()
    for sense, column in ((1, "positive_um"), (-1, "negative_um")):
        expected = error_um(x, np.full(31, sense), 4.0)
        assert table[column].to_numpy() == pytest.approx(expected, abs=0.02)


def test_the_uncertainty_is_that_of_the_mean_and_grows_with_the_length() -> None:
    """Closed form: two means of five readings each, pooled, and 2 um/m over the distance from the zero."""
    recording = made_axis(np.linspace(0.0, 500.0, 26), lambda x, way: 0.01 * x + way, 0.5)
    alone = sg.compensate(recording, to="csv", axis="x", travel="positive").to_frame()
    repeats = recording.frame.assign(um=recording.deviation)
    pooled = repeats.groupby(["target", "way"])["um"].var().mean()
    assert alone["u_positive_um"].to_numpy()[1:] == pytest.approx(np.sqrt(2.0 * pooled / 5.0))
    assert alone["u_positive_um"].iloc[0] == 0.0
    more = sg.compensate(recording, to="csv", axis="x", travel="positive", u_length_um_per_m=2.0).to_frame()
    grown = np.hypot(alone["u_positive_um"], 2e-3 * alone["position_mm"])
    assert more["u_positive_um"].to_numpy() == pytest.approx(grown.to_numpy())
    single = replace(recording, frame=recording.frame[recording.frame["cycle"] == 1])
    assert "repeatability (nothing was read twice)" in sg.compensate(single, to="csv", axis="x").summary()


def test_the_command_line_writes_a_table_from_the_file_of_a_laser(tmp_path: Path) -> None:
    measured(lambda p, _: p, 0.0, 4.0).write(tmp_path / "laser.csv")
    done = invoke("compensate", tmp_path / "laser.csv", "--axis", "x", "--to", "linuxcnc", "-o", tmp_path / "x.comp")
    assert "31 rows from 0.000 to 270.000 mm" in done.output
    rows = np.loadtxt(tmp_path / "x.comp", comments="#")
    assert rows[:, 0] == pytest.approx(9.0 * np.arange(31))
    lost = 1e3 * (rows[:, 2] - rows[:, 1])  # type 0: nominal minus error, so that backlash is 6 um of it
    assert lost == pytest.approx(6.0, abs=0.01)


def test_what_has_no_table_says_of_what_one_is_made_and_that_does() -> None:
    recording = made_axis(np.linspace(0.0, 500.0, 11), lambda x, way: 0.01 * x + way)
    with pytest.raises(
        sg.InputError, match="this has no table; found AxisDiagnosis; expected what it was made from: the rec"
    ):
        sg.compensate(sg.diagnose(recording), to="csv", axis="x")
    assert len(sg.compensate(recording, to="csv", axis="x").to_frame()) == 11


def test_what_contradicts_the_recording_or_does_not_concern_it_is_refused() -> None:
    recording = made_axis(np.linspace(0.0, 500.0, 11), lambda x, way: 0.01 * x + way)
    stated = replace(recording, comments={"axis": "Y"})
    assert sg.compensate(stated, to="csv").table.axis == "y"
    turned = made_axis(np.linspace(0.0, 90.0, 11), lambda x, way: way + 0.0 * x, units=("deg", None))
    twice = replace(recording, frame=pd.concat([recording.frame, recording.frame.assign(placement=2)]))
    for given, more, words in (
        (stated, {"axis": "x"}, "axis: the recording is of another axis; found x; expected y"),
        (recording, {}, "axis for a table"),
        (recording, {"axis": "x", "tip_radius_mm": 2.0}, "tip_radius_mm: a recording of one axis has no tip"),
        (sg.iso230(recording), {"axis": "x", "actual": "target"}, "actual: the test has it; expected actual of the"),
        (turned, {"axis": "x"}, "no table for a controller is made of a rotary axis; expected .*iso230"),
        (twice, {"axis": "x"}, "several settings up of the axis; found 1, 2; expected one, with placement_number"),
    ):
        with pytest.raises(sg.InputError, match=words):
            sg.compensate(given, to="csv", **more)

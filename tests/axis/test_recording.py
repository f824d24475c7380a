"""The recording of an axis as a file: there and back, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepgauge.axis.recording import (
    is_axis_recording,
    join_axis_recordings,
    read_axis_recording,
    write_axis_recording,
)
from stepgauge.axis.sensors import SENSORS
from stepgauge.axis.units import NAMES, AxisUnits
from stepgauge.errors import InputError
from stepgauge.verbs import import_
from tests.axis.made import axis, distances, spot
from tests.cli.conftest import Run

TARGETS = np.arange(0.0, 101.0, 10.0)
RECORDINGS = [axis(TARGETS, lambda t, w: 0.1 * t + w), spot(lambda t: 1e-6 * t, 1e-4), distances(1.0, 0.3)]


def test_blank_lines_and_comments_are_read_over_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    write_axis_recording(path, RECORDINGS[0])
    lines = path.read_text().splitlines()
    path.write_text("\n".join(["", *lines[:-1], "", "# the last one", lines[-1], ""]))
    assert is_axis_recording(path)
    assert len(read_axis_recording(path)) == len(RECORDINGS[0])
    path.write_text("\n".join(["", *lines[:-1], "", "# the last one", lines[-1].replace(",", ",x", 1)]))
    with pytest.raises(InputError, match=rf"axis\.csv:{len(lines) + 3}: "):
        read_axis_recording(path)


@pytest.mark.parametrize("recording", RECORDINGS, ids=lambda one: one.form)
def test_a_recording_is_read_as_it_was_written(tmp_path: Path, recording) -> None:
    path = tmp_path / "axis.csv"
    write_axis_recording(path, recording)
    back = read_axis_recording(path)
    assert is_axis_recording(path)
    assert (back.form, back.units, back.sensor) == (recording.form, recording.units, recording.sensor)
    assert list(back.frame.columns) == list(recording.frame.columns)
    np.testing.assert_allclose(back.frame["reading"], recording.frame["reading"], rtol=1e-11)
    np.testing.assert_allclose(back.deviation, recording.deviation, atol=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("# sensor: laser", "# sensor: nose", "the sensor is not known; found 'nose'; expected touch"),
        ("# unit: mm", "# unit: ell", "not a unit of length or angle; found 'ell'"),
        ("# unit: mm", "# unit: deg", "not a unit of this axis; found um; expected as arcsec"),
        ("# recording: axis", "# recording: plane", "not a recording of an axis; found 'plane'"),
        ("target_mm", "goal_mm", "column target is missing"),
        ("\n1,1,1,10,", "\n1,1,1,ten,", r"axis.csv:\d+: column target is not a number; found 'ten'"),
        ("\n1,1,1,10,", "\n1,1,3,10,", "column way is no sense of travel"),
        (
            "# probings: 110",
            "# probings: 120",
            "the recording is cut, or rows were added; found 110 rows; expected 120",
        ),
    ],
)
def test_a_file_that_is_wrong_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "axis.csv"
    write_axis_recording(path, RECORDINGS[0])
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        read_axis_recording(path)


def test_settings_up_of_one_axis_are_joined_and_other_ones_refused() -> None:
    again = replace(RECORDINGS[0], frame=RECORDINGS[0].frame.assign(reading=RECORDINGS[0].frame["reading"] + 1e-4))
    joined = join_axis_recordings([RECORDINGS[0], again])
    assert len(joined) == 2 * len(RECORDINGS[0])
    assert sorted(joined.frame["placement"].unique()) == [1, 2]
    with pytest.raises(InputError, match="not a recording of the same kind; found spot by dial in mm"):
        join_axis_recordings(RECORDINGS[:2])
    with pytest.raises(InputError, match="setting up 3 repeats the readings of setting up 1"):
        join_axis_recordings([RECORDINGS[0], again, RECORDINGS[0]])


def test_verbs_of_gauges_say_which_verb_reads_it(run: Run, tmp_path: Path) -> None:
    write_axis_recording(tmp_path / "axis.csv", RECORDINGS[0])
    result = run("evaluate", tmp_path / "axis.csv", "-g", "step-gauge-420", "-o", tmp_path / "out")
    assert result.code == 2
    assert "this is no recording of a gauge; found axis" in result.err
    assert "of this one 'stepgauge test iso230' gives mean and u at every target" in result.err


def test_the_verb_offers_every_sensor_and_names_units_that_there_are() -> None:
    assert tuple(SENSORS) == import_.SENSORS
    assert set(import_.UNITS.split(", ")) <= set(NAMES)


@pytest.mark.parametrize(
    ("position", "deviation", "ratio"),
    [("mm", "um", 1e3), ("m", "mm", 1e3), ("inch", "uin", 1e6), ("deg", "arcsec", 3600.0), ("um", "nm", 1e3)],
)
def test_units_of_position_and_deviation(position: str, deviation: str, ratio: float) -> None:
    units = AxisUnits.of(position, deviation)
    assert units.deviations_per_position == pytest.approx(ratio)
    assert units.base_position * units.deviations_per_position == pytest.approx(
        units.base_position
        / (units.base_deviation / {"linear": 1e3, "rotary": 3600.0}[units.axis])
        * units.base_position
    )

"""A diagnosis of an axis asks the conditions of its readings, as every verb does; a name of a column is no trap."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import read_axis_recording
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.files.formula import parse_formula
from stepgauge.files.units import column_name
from tests.axis.made import axis

EVEN = np.arange(0.0, 401.0, 25.0)


def table(scale: float = 1.0, runs: int = 3) -> pd.DataFrame:
    """Runs there and back at even steps; ``scale``: of the deviations, whose header says um."""
    random, rows = np.random.default_rng(1), []
    for run in range(1, runs + 1):
        for way in (1, -1):
            for at in EVEN[::way]:
                off = 0.012 * at + 1.5 * way + random.normal(0.0, 0.2)
                rows.append((at, off * scale, run, "+" if way > 0 else "-", 20.0 + 0.003 * len(rows)))
    return pd.DataFrame(rows, columns=["target [mm]", "deviation [um]", "run", "direction", "Air temp [degC]"])


def test_mm_under_a_header_of_um_are_asked_for_and_stand_on_the_first_page(tmp_path: Path) -> None:
    asked = sg.import_recording(table(1e-3), sensor="laser")
    assert asked.recording is None
    assert len(asked.questions) == 1
    assert "is their unit um?" in asked.questions[0].text
    assert "target [mm]" in asked.questions[0].text
    stated = sg.import_recording(table(1e-3), sensor="laser", deviation_unit="um")
    assert "no axis is so good" in stated.summary()
    found = sg.diagnose(stated.settled())
    assert [one["state"] for one in found.contents["conditions"]] == ["contribution"]
    assert "note: no axis is so good" in found.summary()
    found.write(tmp_path)
    assert "no axis is so good" in (tmp_path / "diagnosis.md").read_text().split("## ")[0]
    right = sg.import_recording(table(1e-3), sensor="laser", deviation_unit="mm").settled()
    assert sg.diagnose(right).verdict == found.verdict
    assert np.ptp(right.deviation) == pytest.approx(np.ptp(table()["deviation [um]"]) * 1e-3)


def test_a_copied_run_prevents_and_what_is_sought_does_not() -> None:
    made = axis(EVEN, lambda t, w: 0.012 * t)
    frame = made.frame.copy()
    frame.loc[frame["cycle"] == 2, "reading"] = frame.loc[frame["cycle"] == 1, "reading"].to_numpy()
    copied = diagnose_axis(replace(made, frame=frame))
    assert copied.verdict == "insufficient"
    assert "copied" in copied.summary()
    frame = made.frame.copy()
    frame.loc[20, "reading"] += 0.5
    slip = diagnose_axis(replace(made, frame=frame))
    assert slip.verdict == "effects"


def test_any_header_becomes_a_name_that_laws_understand() -> None:
    """The alias of even steps is told in the summary, too."""
    stated = sg.import_recording(table(runs=5), sensor="laser")
    assert stated.settled().covariates == ["Air_temp_C"]
    found = sg.diagnose(stated.settled())
    assert "whole steps of 25.00 mm" in found.summary()
    for header in ("Air humidity [%]", "2nd sensor", "lambda", "T°", "Luft-Druck / hPa", "ΔT", "µ", "[V]"):
        assert parse_formula(f"{column_name(header)} > 19.5").names == {column_name(header)}
    assert column_name("Air humidity [%]") == "Air_humidity_percent"


def test_a_column_of_a_written_file_has_such_a_name(tmp_path: Path) -> None:
    made = axis(EVEN, lambda t, w: 0.0 * t)
    made.frame["air temp C"] = 20.0
    made.write(tmp_path / "axis.csv")
    assert read_axis_recording(tmp_path / "axis.csv").covariates == ["air_temp_C"]


def test_a_gap_in_a_temperature_is_told() -> None:
    holed = table()
    holed.loc[4, "Air temp [degC]"] = np.nan
    assert "Air temp [degC] (no number in 1 of 102 rows)" in sg.import_recording(holed, sensor="laser").summary()


def test_rows_that_were_pasted_again_are_told_and_equal_readings_are_not() -> None:
    """Half of a run twice in the same run; two readings at each target that a coarse dial shows alike are no copy."""
    once = table()
    pasted = pd.concat([once, once.iloc[50:70]])
    twice = once.loc[np.repeat(once.index, 2)].round({"deviation [um]": 0})
    told = ["copied" in sg.import_recording(one, sensor="laser").summary() for one in (once, pasted, twice)]
    assert told == [False, True, False]
    found = sg.diagnose(sg.import_recording(pasted, sensor="laser").settled())
    assert "20 rows stand there twice" in found.summary()
    assert found.verdict == "insufficient"


def test_counts_over_the_columns_of_a_dataframe_are_no_reading() -> None:
    """A table without a header, as numpy gives it: the labels 0 and 1 are none, and there is one row less."""
    numbers = table().iloc[:, :2].set_axis([0, 1], axis=1)
    made = sg.import_recording(numbers, sensor="laser", header="target_mm,deviation_um").settled()
    assert len(made) == len(numbers)
    assert made.deviation.tolist() == pytest.approx(numbers[1].tolist())

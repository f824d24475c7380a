"""Deviations come with either sign: the order of a subtraction and the word for a correction say which."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import read_axis_recording
from stepgauge.errors import InputError
from tests.cli.conftest import Run
from tests.importing.layouts.axes import TARGETS

PER_M = 24.8
AS_DEVIATION = [
    "Abweichung Ist-Soll [um]",
    "Deviation actual-nominal (um)",
    "Fehler (Ist - Soll) [um]",
    "Ecart mesure-consigne [um]",
    "Ist-Position minus Soll-Position [um]",
    "reading minus target [um]",
    "Abweichung Soll/Ist [um]",
    "error_um",
]
AS_CORRECTION = [
    "Abweichung Soll-Ist [um]",
    "Soll-Ist-Abweichung [um]",
    "Soll−Ist [um]",
    "Sollwert - Istwert [um]",
    "Deviation nominal-actual (um)",
    "Difference target - measured [um]",
    "target minus reading [um]",
    "Nom.-Act. [um]",
    "Set point - actual [um]",
    "Fehler (Soll-Ist) [um]",
    "Écart consigne-mesure [um]",
    "Correction [um]",
    "Korrektur [um]",
    "Korrekturwert Soll-Ist [um]",
    "Compensation value [um]",
]
CONTRADICTORY = ["Correction actual-nominal [um]", "Fehlerkurve (Soll-Ist / Ist-Soll) [um]", "error compensation [um]"]


def table(folder: Path, header: str, sign: int, values: str = "") -> Path:
    rows = [f"{t:g};{values or f'{sign * PER_M * t / 1000.0:.4f}'}" for t in TARGETS]
    path = folder / "t.csv"
    path.write_text("\n".join([f"Position [mm];{header}", *rows, ""]), encoding="utf-8")
    return path


def scale_um_m(path: Path) -> float:
    """Slope of the deviations of a recording, um/m."""
    back = read_axis_recording(path)
    return float(np.polyfit(back.frame["target"], back.deviation, 1)[0]) * 1e3


@pytest.mark.parametrize("turned", [False, True])
def test_directions_against_the_order_of_the_targets_are_told(run: Run, tmp_path: Path, turned: bool) -> None:
    rows = [
        f"{cycle},{way},{t:g},{t + 0.001 * cycle:.4f}"
        for cycle in (1, 2)
        for way, order in (("+-"[turned], TARGETS), ("-+"[turned], TARGETS[::-1]))
        for t in order
    ]
    (tmp_path / "t.csv").write_text("\n".join(["run,direction,target (mm),reading (mm)", *rows, ""]), encoding="utf-8")
    done = run("import", tmp_path / "t.csv", "--sensor", "laser", "-o", tmp_path / "axis.csv")
    assert done.code == 0, done.err
    assert ("doubtful: targets rise where the direction is stated as down" in done.err) == turned


@pytest.mark.parametrize(
    ("header", "sign"), [*((one, 1) for one in AS_DEVIATION), *((one, -1) for one in AS_CORRECTION)]
)
def test_a_deviation_is_reading_minus_target_whatever_the_table_holds(
    run: Run, tmp_path: Path, header: str, sign: int
) -> None:
    """And the import says, and writes down, that it has turned a sign."""
    result = run("import", table(tmp_path, header, sign), "--sensor", "laser", "-o", tmp_path / "axis.csv")
    assert result.code == 0, result.err
    assert scale_um_m(tmp_path / "axis.csv") == pytest.approx(PER_M, rel=1e-3)
    name = header.rpartition(" [")[0] if "[" in header else header
    assert (f"turned: sign of {name}" in result.err) == (sign < 0), result.err
    assert ("# turned: sign of" in (tmp_path / "axis.csv").read_text(encoding="utf-8")) == (sign < 0)


@pytest.mark.parametrize("header", CONTRADICTORY)
def test_what_contradicts_itself_is_asked_for(run: Run, tmp_path: Path, header: str) -> None:
    path = table(tmp_path, header, 1)
    result = run("import", path, "--sensor", "laser", "-o", tmp_path / "axis.csv")
    assert result.code == 2
    assert "contradicts itself" in result.err
    assert f'--column deviation="{header}"' in result.err
    assert f'--column correction="{header}"' in result.err
    assert not (tmp_path / "axis.csv").exists()


@pytest.mark.parametrize(("role", "sign"), [("deviation", 1), ("correction", -1)])
@pytest.mark.parametrize("header", ["Abweichung Soll-Ist [um]", "error compensation [um]", "Ist-Soll [um]"])
def test_what_is_stated_goes_before_the_name(run: Run, tmp_path: Path, header: str, role: str, sign: int) -> None:
    path = table(tmp_path, header, sign)
    stated = ("--sensor", "laser", "--column", f"{role}={header}")
    assert run("import", path, *stated, "-o", tmp_path / "axis.csv").code == 0
    assert scale_um_m(tmp_path / "axis.csv") == pytest.approx(PER_M, rel=1e-3)


def test_readings_are_never_turned(run: Run, tmp_path: Path) -> None:
    """A column of readings that speaks of a correction: its slope against the targets is one."""
    rows = "".join(f"{t:g};{t * (1 + PER_M * 1e-6):.6f}\n" for t in TARGETS)
    (tmp_path / "t.csv").write_text(f"Target [mm];Reading after correction [mm]\n{rows}", encoding="utf-8")
    result = run("import", tmp_path / "t.csv", "--sensor", "laser", "-o", tmp_path / "axis.csv")
    assert result.code == 0, result.err
    assert "turned: sign" not in result.err
    assert scale_um_m(tmp_path / "axis.csv") == pytest.approx(PER_M, rel=1e-3)


def test_a_wide_table_is_turned_in_all_its_columns(run: Run, tmp_path: Path) -> None:
    """Both ways and cycles, as a form of another maker has them."""
    heads = [f"Soll-Ist Lauf {cycle} {way}" for cycle in (1, 2) for way in ("hin", "zurück")]
    rows = [";".join([f"{t:g}", *[f"{-PER_M * t / 1000.0:.4f}"] * 4]) for t in TARGETS]
    (tmp_path / "t.csv").write_text("\n".join([";".join(["Soll [mm]", *heads]), *rows, ""]), encoding="utf-8")
    unit = ("--deviation-unit", "um")
    result = run("import", tmp_path / "t.csv", "--sensor", "laser", *unit, "-o", tmp_path / "axis.csv")
    assert result.code == 0, result.err
    assert scale_um_m(tmp_path / "axis.csv") == pytest.approx(PER_M, rel=1e-3)


@pytest.mark.parametrize("um_per_m", [-3000.0, -1000.0, -25.4, -20.0, 0.0, 20.0, 39.4, 100.0, 1000.0, 3000.0])
@pytest.mark.parametrize("header", ["value", "Messwert", "error", "reading"])
def test_a_stated_unit_makes_deviations_of_any_scale_error(um_per_m: float, header: str) -> None:
    """A slope of 0.02 is an error of 20 um/m: no size of it says that the numbers are none."""
    target = np.tile(np.r_[0.0:401.0:20.0], 3)
    away = um_per_m * 1e-3 * target + np.random.default_rng(1).normal(0.0, 0.4, len(target))
    table = pd.DataFrame({"target_mm": target, header: away})
    found = sg.import_recording(table, sensor="laser", deviation_unit="um").settled()
    np.testing.assert_allclose(found.deviation, away, atol=1e-9)


@pytest.mark.parametrize("um_per_m", [-3000.0, -20.0, 20.0, 3000.0])
def test_numbers_that_do_not_follow_their_targets_ask_for_the_unit_of_deviations(um_per_m: float) -> None:
    target = np.tile(np.r_[0.0:401.0:20.0], 3)
    table = pd.DataFrame({"target_mm": target, "value": um_per_m * 1e-3 * target + np.arange(len(target)) % 2})
    asked = sg.import_recording(table, sensor="laser")
    assert [choice.argument for one in asked.questions for choice in one.choices] == ["deviation_unit"]


@pytest.mark.parametrize(("factor", "words"), [(1.0 / 25.4, "looks like inches"), (-1.0, "go against their targets")])
def test_a_stated_unit_of_deviations_makes_none_of_readings(factor: float, words: str) -> None:
    target = np.tile(np.r_[0.0:401.0:20.0], 3)
    read = (target + 0.01 * np.random.default_rng(1).normal(size=len(target))) * factor
    with pytest.raises(InputError, match=words):
        sg.import_recording(
            pd.DataFrame({"target_mm": target, "reading": read}), sensor="laser", deviation_unit="um"
        ).settled()


@pytest.mark.parametrize("value", ["error_um", "actual_mm"])
def test_names_of_targets_and_readings_that_are_exchanged_are_asked_about(value: str) -> None:
    """Targets come again in every run; under the name of what is read there they are told by that."""
    target = np.tile(np.r_[0.0:401.0:20.0], 3)
    away = np.random.default_rng(1).normal(0.0, 0.4, len(target)).round(4)
    read = away if value == "error_um" else target + 1e-3 * away
    right = pd.DataFrame({"run": np.repeat([1, 2, 3], 21), "target_mm": target, value: read})
    wrong = right.rename(columns={"target_mm": value, value: "target_mm"})
    assert sg.import_recording(right, sensor="laser").recording is not None
    choices = {one.argument: one.value for one in sg.import_recording(wrong, sensor="laser").questions[0].choices}
    assert choices["header"] == f"run;target_mm;{value}"
    settled = sg.import_recording(wrong, sensor="laser", header=choices["header"]).settled()
    pd.testing.assert_frame_equal(settled.frame, sg.import_recording(right, sensor="laser").settled().frame)

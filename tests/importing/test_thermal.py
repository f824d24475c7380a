"""What a log says of temperature: the convention of its lengths is set on import, told, and never guessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stepgauge as sg
from stepgauge.importing import dmis
from stepgauge.importing.thermal import read_convention, said_lines
from tests.measured import shipped

CORRECTED = (
    "$$ All lengths corrected to 20 °C",
    "# Temperature compensation: ON",
    "Part Temp Comp = active (11.5e-6/K)",
    "Temperaturkompensation;ein",
    "Werkstücktemperaturkompensation: ja",
    "Längen auf 20 °C bezogen",
    "Values are compensated for temperature to 20.0 deg C",
    "TECOMP/ON",
    "TECOMP/PART,ON,0,0,11.5",
    "Longueurs corrigées à 20 °C",
)
AS_READ = (
    "Temperature compensation: off",
    "TECOMP/OFF",
    "Lengths are not temperature compensated",
    "ohne Temperaturkompensation",
    "Temperaturkorrektur: keine",
)
NOTHING_SAID = (
    "Part temperature: 20.4",
    "points not compensated for the tip radius",
    "Volumetric compensation: on",
    "TECOMP/MACH,ON",
    "Environmental compensation: on",
    "corrected by A. Meyer",
    "20 C",
)


@pytest.mark.parametrize("line", CORRECTED)
def test_lengths_that_were_corrected(line: str) -> None:
    comments, told = read_convention(said_lines(f"a log\n{line}\n1 2 3\n"))
    assert comments == {"temperature_convention": "corrected_to_20"}
    assert line.strip() in told[0]


@pytest.mark.parametrize("line", AS_READ)
def test_lengths_that_were_not(line: str) -> None:
    assert read_convention([line])[0] == {"temperature_convention": "as_read"}


@pytest.mark.parametrize("line", NOTHING_SAID)
def test_other_lines_say_nothing(line: str) -> None:
    assert read_convention([line]) == ({}, ())


@pytest.mark.parametrize("lines", [["TECOMP/ON", "TECOMP/OFF"], ["Temperature compensation: scales"]])
def test_what_contradicts_itself_or_is_not_understood_settles_nothing_and_is_told(lines: list[str]) -> None:
    comments, told = read_convention(lines)
    assert not comments
    assert told[0].startswith("doubtful")
    assert all(line in told[0] for line in lines)


def test_a_laser_corrects_the_material_where_it_has_a_coefficient() -> None:
    """Alone its environmental compensation is that of the wavelength."""
    on = "Environmental compensation: on"
    for coefficient, expected in (("11.7", "corrected_to_20"), ("0.0", "as_read")):
        comments, _ = read_convention([on, f"Material expansion coefficient (ppm/C): {coefficient}"])
        assert comments["temperature_convention"] == expected


def as_table(head: str) -> str:
    """A perfect machine that corrects a gauge at 22 deg C to 20 deg C: readings at certified positions."""
    gauge, _ = shipped()
    face = np.arange(1, 13)
    front = face % 2 == 1
    rows = [
        f"{cycle},{one},{150 + x - (2.0 if f else -2.0):.6f},150,200,{1 if f else -1},0,0,22.0"
        for cycle in (1, 2)
        for one, x, f in zip(face, gauge.position_mm[:12] + 1e-4 * cycle, front, strict=True)
    ]
    header = "cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,gauge_temperature_C"
    return "\n".join([*head.splitlines(), header, *rows]) + "\n"


@pytest.mark.parametrize(("head", "largest_um"), [("# Temperature compensation: on", 0.2), ("# Operator: A", 2.0)])
def test_the_table_of_a_machine_that_corrects_is_evaluated_as_such(
    tmp_path: Path, head: str, largest_um: float
) -> None:
    """Where it says nothing the gauge at 22 deg C is 2.5 um longer over 110 mm than its readings."""
    path = tmp_path / "t.csv"
    path.write_text(as_table(head))
    imported = sg.import_recording(path)
    evaluation = sg.evaluate(imported.settled(), shipped()[0])
    largest = float(np.nanmax(np.abs(evaluation.results[0].xm_um)))
    assert largest < 0.2 if largest_um < 1.0 else largest > 2.0
    assert any("Temperature compensation: on" in line for line in imported.report) is (largest_um < 1.0)


def test_a_statement_of_dmis_is_read_and_not_dropped() -> None:
    point = "FA(C1F{})=FEAT/POINT,CART,{}.0,2.0,3.0,-1.0,0.0,0.0"
    text = "\n".join(["TECOMP/PART,ON", *(point.format(n, n) for n in (1, 3)), "ENDFIL", ""])
    assert not any("TECOMP" in line for line in dmis.read(text, "a.dmo").left_out)


@pytest.mark.parametrize(("head", "warns"), [("# Temperature compensation: on", False), ("# Operator: A", True)])
def test_what_follows_without_a_temperature_of_the_gauge_is_said_once(tmp_path: Path, head: str, warns: bool) -> None:
    path = tmp_path / "t.csv"
    path.write_text(as_table(head).replace(",gauge_temperature_C", "").replace(",22.0\n", "\n"))
    said = [line for line in sg.import_recording(path).report if "passes for a scale error" in line]
    assert len(said) == warns
    stated = sg.import_recording(path, gauge_temperature_C=21.0).report
    assert not any("passes for a scale error" in line for line in stated)

"""Results by face as a report of a coordinate measuring machine has them, whatever it calls the faces, or nothing."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.importing.result import Imported
from tests.build import make_gauge
from tests.importing.made import RADIUS_MM, make_case

CASE = make_case(make_gauge(12, deviation_um=np.r_[0.0, np.random.default_rng(4).normal(0.0, 2.0, 23)]))
GAUGE, PLACEMENT = CASE.gauge, CASE.placement
FACES = range(1, 25)
RUNS_MM = (GAUGE.position_mm[:, None] + 1e-3 * np.random.default_rng(5).normal(size=(24, 5))).round(4)


def label(face: int) -> str:
    return f"FACE_{face:02d}"


def table(header: str, name: Callable[[int], str] = label, unit_mm: float = 1.0) -> str:
    rows = np.column_stack([GAUGE.nominal_mm, RUNS_MM]) / unit_mm
    cells = [",".join([name(face), *(f"{value:.6f}" for value in rows[face - 1])]) for face in FACES]
    return "\n".join([header] * bool(header) + cells)


def block(face: int, run: int, name: str) -> str:
    nominal, found = GAUGE.nominal_mm[face - 1], RUNS_MM[face - 1, run]
    return (
        f"DIM LOC{face}= LOCATION OF POINT {name}  UNITS=MM ,$\n"
        "AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL\n"
        f"X     {nominal:.4f}  0.0100  0.0100  {found:.4f}  {found - nominal:.4f}  0.0000\n\n"
    )


def given(text: str, **known: Any) -> Imported:
    known = {"gauge": GAUGE, "placement": PLACEMENT, "tip_radius_mm": RADIUS_MM, **known}
    return sg.import_recording(io.StringIO(text), **known)


def choices(found: Imported) -> list[tuple[str, str]]:
    return [(one.argument, one.value) for asked in found.questions for one in asked.choices]


def check_touches(found: Imported, tolerance_mm: float = 1e-6) -> None:
    """The positions along the gauge, by the pose of the case: of its tip centres, one radius before each face."""
    frame = found.settled().frame
    assert sorted(frame["face"]) == sorted(list(FACES) * int(frame["cycle"].max()))
    points = frame[["x_mm", "y_mm", "z_mm"]].to_numpy()
    along = (points - PLACEMENT.to_machine(GAUGE, np.zeros((1, 3)))) @ PLACEMENT.axis
    face, cycle = frame["face"].to_numpy(), frame["cycle"].to_numpy()
    expected = RUNS_MM[face - 1, cycle - 1] - np.where(face % 2 == 1, 1.0, -1.0) * RADIUS_MM
    np.testing.assert_allclose(along, expected, atol=tolerance_mm)


REPORTS = {
    "a feature": table("Feature,Nominal,Run 1,Run 2,Run 3,Run 4,Run 5"),
    "numbers": table("Element,Nominal,Actual 1,Actual 2,Actual 3,Actual 4,Actual 5", str),
    "an id": table("ID,Sollwert,Lauf 1,Lauf 2,Lauf 3,Lauf 4,Lauf 5", str),
    "a German feature": table("Merkmal;Nennmaß;Ist 1;Ist 2;Ist 3;Ist 4;Ist 5".replace(";", ","), lambda n: f"Fl {n}"),
    "blocks": "".join(block(face, 0, label(face)) for face in FACES),
    "blocks of three runs": "".join(block(face, run, f"PNT{face}") for run in range(3) for face in FACES),
}


@pytest.mark.parametrize("text", REPORTS.values(), ids=REPORTS.keys())
def test_positions_of_the_gauge_are_those_of_its_faces(text: str) -> None:
    assert ("sensor", "touch") in choices(given(text, placement=None))
    check_touches(given(text, sensor="touch"))
    check_touches(given(text))


def test_a_report_of_an_office_program_with_lines_between_the_blocks() -> None:
    """As PC-DMIS prints it: settings of the drawing above, a drawn deviation behind, and an end of every block."""
    more = "GRAPH=OFF  TEXT=OFF  MULT=10.00  OUTPUT=BOTH\nAX "
    blocks = (block(face, 0, label(face)).replace("AX ", more).replace("0000\n\n", "0000 ---#---\n") for face in FACES)
    text = "PART NAME : gauge\n\n" + "END OF DIMENSION\n".join(blocks)
    assert ("sensor", "touch") in choices(given(text, placement=None))
    check_touches(given(text, sensor="touch"))
    check_touches(given(text))


def test_runs_below_one_another_without_a_header_are_offered_one() -> None:
    rows = (f"{run + 1},{f},{GAUGE.nominal_mm[f - 1]},{RUNS_MM[f - 1, run]}" for run in range(3) for f in FACES)
    text = "\n".join(rows)
    answer = ("header", "column 1,face,nominal_mm,reading_mm")
    assert answer in choices(given(text))
    check_touches(given(text, header=answer[1], sensor="touch"))


def test_positions_of_another_artefact_are_not() -> None:
    text = "\n".join(["Feature,Nominal,Run 1", *(f"P{n},{7.3 * n},{7.3 * n + 0.001}" for n in range(24))])
    assert ("sensor", "touch") not in choices(given(text))


@pytest.mark.parametrize(("unit", "size_mm"), [("mm", 1.0), ("inch", 25.4)])
@pytest.mark.parametrize("name", [label, str])
def test_a_table_without_a_header_is_offered_one_that_settles_it(
    name: Callable[[int], str], unit: str, size_mm: float
) -> None:
    text = table("", name, size_mm)
    answer = ("header", ",".join(["face", f"nominal_{unit}", *(f"run {run}_{unit}" for run in range(1, 6))]))
    assert answer in choices(given(text))
    assert choices(given(text, sensor="touch")) == [answer]
    assert ("sensor", "touch") in choices(given(text, header=answer[1], placement=None))
    check_touches(given(text, header=answer[1], sensor="touch"), 5e-5)


def test_a_header_to_be_typed_has_as_many_names_as_columns() -> None:
    found = given(table(""), gauge=None, placement=None)
    wanted = next(one for asked in found.questions for one in asked.choices if one.argument == "header")
    assert wanted.suggestions == ('"x_mm,y_mm,z_mm,column 4,column 5,column 6,column 7"',)
    assert found.refusal is not None
    assert " : " not in found.refusal.cli_text()


def exchange(rows: list[int]) -> str:
    """The report with the rows of faces 7 and 8 exchanged from a column on."""
    lines = [line.split(",") for line in table(HEADER).split("\n")]
    first, second = lines[7], lines[8]
    for place in rows:
        first[place], second[place] = second[place], first[place]
    return "\n".join(map(",".join, lines))


HEADER = "Feature,Nominal,Run 1,Run 2,Run 3,Run 4,Run 5"


@pytest.mark.parametrize("columns", [[0], [0, 1], [2, 3, 4, 5, 6]], ids=["names", "names and nominals", "readings"])
def test_two_faces_that_are_exchanged_are_named(columns: list[int]) -> None:
    with pytest.raises(InputError, match=r"faces 7 and 8 look exchanged; found .*; expected"):
        given(exchange(columns), sensor="touch")


def test_rows_in_another_order_and_numbers_that_only_count_rows_are_no_exchange() -> None:
    header, *rows = table(HEADER).split("\n")
    check_touches(given("\n".join([header, *rows[12:], *rows[:12]]), sensor="touch"))
    without = [f"{n},{row.partition(',')[2]}" for n, row in enumerate(rows[:18] + rows[19:])]
    found = given("\n".join([header.replace("Feature", "No."), *without]), sensor="touch")
    assert any("nothing was measured of faces" in line and line.endswith(" 19") for line in found.report)


@pytest.mark.parametrize(("unit", "size_mm"), [("inch", 25.4), ("um", 1e-3)])
def test_positions_in_another_unit_are_asked_about_with_the_unit_that_settles_it(unit: str, size_mm: float) -> None:
    text = table(HEADER, unit_mm=size_mm)
    assert ("sensor", "touch") in choices(given(text, placement=None))
    found = given(text, sensor="touch")
    assert choices(found) == choices(given(text)) == [("unit", unit)]
    assert found.refusal is not None
    assert f"no positions of {GAUGE.table.name} in mm, and all of them on its list in {unit}" in str(found.refusal)
    check_touches(given(text, sensor="touch", unit=unit), 1e-4)
    stated = text.replace("Nominal", "Nominal [mm]")
    assert f"{unit} in the name" in str(given(stated, sensor="touch").refusal)


@pytest.mark.parametrize("header", ["Face,Nominal,Certified,U", "Fläche,Nennmaß,Istmaß,U", "No.,Nominal,Actual,u"])
@pytest.mark.parametrize("sensor", [None, "touch"])
def test_a_certificate_is_no_measurement(header: str, sensor: str | None) -> None:
    columns = zip(FACES, GAUGE.nominal_mm, GAUGE.position_mm, strict=True)
    text = "\n".join([header, *(f"{face},{a:.3f},{b:.5f},0.3" for face, a, b in columns)])
    with pytest.raises(InputError, match=r"looks like a certificate of .* no measurement; found .*[uU];"):
        given(text, sensor=sensor)


@pytest.mark.parametrize(("header", "scale"), [("Deviation [um]", 1e3), ("Abweichung", 1e3), ("Dev [mm]", 1.0)])
def test_a_certificate_of_deviations_is_no_measurement(header: str, scale: float) -> None:
    columns = zip(FACES, GAUGE.nominal_mm, GAUGE.position_mm, strict=True)
    rows = (f"{face},{a:.3f},{scale * (b - a):.{1 if scale > 1.0 else 4}f},0.3" for face, a, b in columns)
    with pytest.raises(InputError, match="looks like a certificate of"):
        given("\n".join([f"Face,Nominal,{header},U", *rows]), sensor="touch")


def test_a_report_that_states_inches_once_is_read_in_them() -> None:
    rows = "".join(f"{label(f)},{GAUGE.nominal_mm[f - 1] / 25.4:.5f},{RUNS_MM[f - 1, 0] / 25.4:.6f}\n" for f in FACES)
    check_touches(given(f"Units: inch\nFeature,Nominal,Actual\n{rows}", sensor="touch"), 5e-5)


def test_readings_with_their_uncertainty_are_a_measurement() -> None:
    columns = zip(FACES, GAUGE.nominal_mm, RUNS_MM[:, 0], strict=True)
    text = "\n".join(["Face,Nominal,Actual,U", *(f"{face},{a:.3f},{b:.5f},0.3" for face, a, b in columns)])
    check_touches(given(text, sensor="touch"))

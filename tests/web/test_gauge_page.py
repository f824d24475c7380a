"""Gauge and machine without a browser: what a form brings becomes the files that the readers accept."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stepgauge as sg
from stepgauge.dcc.face_table import read_face_table
from stepgauge.errors import InputError
from stepgauge.importing.tables.source import Source
from stepgauge.web.pages import gauge as gauge_page
from stepgauge.web.pages import machine as machine_page
from stepgauge.web.texts import Words
from tests.conftest import ROOT
from tests.dcc.made import gauge_xml
from tests.web.conftest import Asked, Served, Watched

NOMINAL = [0, 10, 20, 30, 40, 50]
OFF_UM = [0.0, 0.41, -0.32, 0.65, 0.12, 0.2]
U_UM = [0.1, 0.11, 0.11, 0.12, 0.12, 0.13]
POSITION = [n + 1e-3 * off for n, off in zip(NOMINAL, OFF_UM, strict=True)]
FORM = {
    "name": "Gauge A",
    "serial": "A-1",
    "material": "steel",
    "expansion_per_K": "11,5",
    "expansion_uncertainty_per_K": "0,5",
    "reference_temperature_C": "20",
    "block_width_mm": "20",
    "block_height_mm": "15",
    "number": "K-1",
    "laboratory": "A laboratory",
    "date": "2026-03-02",
    "coverage_factor": "2",
}


def lines(*columns: list[Any], head: str = "", between: str = "\t", comma: bool = False) -> str:
    rows = [
        between.join(f"{one:.5f}" if isinstance(one, float) else str(one) for one in row)
        for row in zip(*columns, strict=True)
    ]
    text = "\n".join(rows)
    return (f"{head}\n" if head else "") + (text.replace(".", ",") if comma else text)


def faces(text: str, **stated: Any) -> np.ndarray:
    return read_face_table(Source("table", text.encode()), **stated).values


FACE = list(range(1, 7))
OFF_MM = [1e-3 * off for off in OFF_UM]
LAYOUTS = {
    "as Excel pastes it": lines(
        FACE, NOMINAL, POSITION, U_UM, head="Fläche\tNennmaß mm\tIstmaß mm\tU (k=2) µm", comma=True
    ),
    "semicolons, no header": lines(FACE, NOMINAL, POSITION, U_UM, between=";", comma=True),
    "blanks, no header": lines(FACE, NOMINAL, POSITION, U_UM, between="  "),
    "no numbers of faces": lines(NOMINAL, POSITION, U_UM, head="nominal,position,U µm", between=","),
    "deviations in um": lines(NOMINAL, OFF_UM, U_UM, head="Nominal\tDeviation (µm)\tU (µm)"),
    "deviations, no header, one negative": lines(NOMINAL, OFF_UM, U_UM),
    "deviations in mm": lines(NOMINAL, OFF_MM, U_UM, head="Nominal (mm)\tError (mm)\tU (µm)"),
    "nominal minus actual": lines(NOMINAL, [-off for off in OFF_UM], U_UM, head="Nominal\tSoll-Ist µm\tU µm"),
    "U in mm": lines(NOMINAL, POSITION, [1e-3 * u for u in U_UM], head="nominal\tposition\tU (mm)"),
    "a row of units": "Nominal\tPosition\tU\nmm\tmm\tµm\n" + lines(NOMINAL, POSITION, U_UM),
    "positions beside deviations": lines(NOMINAL, POSITION, OFF_UM, U_UM, head="nominal\tposition\tdeviation µm\tU µm"),
    "faces from 0": lines([n - 1 for n in FACE], NOMINAL, POSITION, U_UM, head="Face\tNominal\tPosition\tU µm"),
    "faces from 0, no header": lines([n - 1 for n in FACE], NOMINAL, POSITION, OFF_UM, U_UM, between=" "),
    "names of several words above single blanks": (
        "Messfläche Nr.   Nennmaß   Istmaß   Abweichung   Messunsicherheit U (k=2)\n"
        "                 mm        mm       µm           µm\n"
        + lines(FACE, NOMINAL, POSITION, OFF_UM, U_UM, between=" ", comma=True)
    ),
    "in m": lines(
        [n / 1e3 for n in NOMINAL], [f"{p / 1e3:.8f}" for p in POSITION], U_UM, head="nominal (m)\tposition (m)\tU µm"
    ),
    "without nominal": lines(POSITION, U_UM, head="position mm\tU µm"),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_table_of_a_certificate_is_read_in_every_layout(name: str) -> None:
    expected = np.column_stack([FACE, NOMINAL, POSITION, U_UM])
    np.testing.assert_allclose(faces(LAYOUTS[name]), expected, atol=2e-5)


@pytest.mark.parametrize("first", [None, 1, 2], ids=["not numbered", "from 0", "from 1"])
def test_a_table_without_the_face_at_0_gets_it(first: int | None) -> None:
    columns = [NOMINAL[1:], POSITION[1:], U_UM[1:]]
    head = "Nominal\tPosition\tU µm" if first is None else "Face\tNominal\tPosition\tU µm"
    numbers = [] if first is None else [list(range(first, first + 5))]
    found = read_face_table(Source("table", lines(*numbers, *columns, head=head).encode()))
    assert found.values[:, 0].tolist() == FACE
    assert found.values[0].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert found.notes == ("face_1_added",)


@pytest.mark.parametrize("nominal", [NOMINAL, [1000 * one for one in NOMINAL]], ids=["mm", "um"])
def test_positions_in_um_under_a_header_of_mm_are_named_and_the_header_settles_it(nominal: list[float]) -> None:
    head = "Face\tNominal (mm)\tPosition (mm)\tU (um)"
    text = lines(FACE, nominal, [1000.0 * one for one in POSITION], U_UM, head=head)
    with pytest.raises(InputError, match=r"the position is far too large in mm and looks like um .*; found 50000.* mm"):
        faces(text)
    right = text.replace("Position (mm)", "Position (um)")
    right = right if nominal == NOMINAL else right.replace("Nominal (mm)", "Nominal (um)")
    np.testing.assert_allclose(faces(right)[:, 1:3], np.c_[NOMINAL, POSITION], atol=1e-9)


def test_what_may_be_two_things_is_asked_and_the_answer_settles_it() -> None:
    positive = [abs(off) for off in OFF_UM]
    text = lines(NOMINAL, positive, U_UM)
    with pytest.raises(InputError, match="positions are not found"):
        faces(text)
    found = faces(text, roles={1: "deviation", 2: "uncertainty"})
    assert found[1, 2] == pytest.approx(10.00041)
    small = lines(NOMINAL, POSITION, [0.02] * 6, head="nominal\tposition\tU")
    with pytest.raises(InputError, match="unit of the uncertainty is not stated"):
        faces(small)
    assert faces(small, units={"uncertainty": "mm"})[0, 3] == pytest.approx(20.0)


def test_deviations_that_contradict_the_positions_beside_them_are_refused() -> None:
    wrong = [*OFF_UM[:3], 6.5, *OFF_UM[4:]]
    with pytest.raises(InputError, match="position minus nominal is not the stated deviation"):
        faces(lines(NOMINAL, POSITION, wrong, U_UM, head="nominal\tposition\tdeviation µm\tU µm"))


def test_a_pasted_certificate_and_a_machine_become_a_project(tmp_path: Path) -> None:
    said = Asked(tmp_path).post(gauge_page.check, {**FORM, "table": LAYOUTS["as Excel pastes it"]})
    assert "6 faces of 3 blocks" in said
    assert "/gauge?saved=gauge" in Asked(tmp_path).post(
        gauge_page.save, {**FORM, "table": LAYOUTS["as Excel pastes it"]}
    )
    gauge = sg.read_gauge(tmp_path / "gauge/A-1.toml")
    np.testing.assert_allclose(gauge.position_mm, POSITION, atol=1e-9)
    np.testing.assert_allclose(gauge.u_um, np.array(U_UM) / 2.0)
    assert gauge.table.expansion_per_K == 11.5e-6
    ends = {"x_low": "0", "x_high": "700", "y_low": "0", "y_high": "1000", "z_low": "0", "z_high": "600"}
    machine = {
        "new": "1",
        "name": "CMM 3",
        "repeatability_um": "0,3",
        "measuring_speed_mm_s": "3",
        "travel_speed_mm_s": "50",
    }
    probe = {"tip_radius_mm": "2", "pretravel_um": "3"}
    limit = {"mpe_constant": "1,8", "mpe_divisor": "350", "u_gauge_temperature_K": "0,05", "temperature_C": "20"}
    answer = Asked(tmp_path).post(
        machine_page.save, {**machine, **ends, **probe, **limit, "u_scale_temperature_K": "0.1"}
    )
    assert "/machine?saved=" in answer
    found = sg.read_machine(tmp_path / "machine/cmm-3.toml")
    assert found.table.mpe == "1.8 + L/350"
    assert found.stated.gauge_temperature_K is not None
    assert [one.key for one in found.uncertain] == ["machine.temperature_C"]
    assert 'gauge = "gauge/A-1.toml"' in (tmp_path / "stepgauge.toml").read_text()
    text = (tmp_path / "machine/cmm-3.toml").read_text()
    (tmp_path / "machine/cmm-3.toml").write_text(
        text + '\n[[effect]]  # found in May\nkind = "scale_error"\naxis = "x"\nppm = 2.0\n'
    )
    del machine["new"]
    Asked(tmp_path).post(machine_page.save, {**machine, **ends, **probe, "name": "CMM 3", "mpe_constant": "2"})
    again = sg.read_machine(tmp_path / "machine/cmm-3.toml")
    assert again.table.mpe == "2"
    assert len(again.effects) == 1, "what the form does not show stays"
    assert "# found in May" in (tmp_path / "machine/cmm-3.toml").read_text()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"table": "nominal\tposition\tU µm\n0\t0\t.1\n10\t9.99\t.1\n20\t20\t.1\n15\t30\t.1"}, "rise"),
        ({"table": lines(FACE[:5], NOMINAL[:5], POSITION[:5], U_UM[:5])}, "even number"),
        ({"table": lines(FACE, NOMINAL, [p / 25.4 for p in POSITION], U_UM)}, "inches"),
        ({"table": ""}, "empty"),
        ({"block_width_mm": ""}, "Width of a block: it is not filled in"),
        ({"expansion_per_K": "11500"}, "Linear expansion: not a number in its range"),
        ({"date": "soon"}, "Date of calibration: not a date"),
    ],
)
def test_a_slip_is_named_by_its_field_or_row_and_nothing_is_written(
    tmp_path: Path, change: dict[str, str], said: str
) -> None:
    answer = Asked(tmp_path).post(gauge_page.save, {**FORM, "table": LAYOUTS["as Excel pastes it"], **change})
    assert 'role="alert"' in answer
    assert said in answer
    assert "--" not in answer
    assert list(tmp_path.iterdir()) == []


def test_a_face_unlike_its_neighbours_is_shown(tmp_path: Path) -> None:
    text = (ROOT / "calibration_data/step-gauge-420.csv").read_text().replace("200.00", "200.03")
    said = Asked(tmp_path, "de").post(gauge_page.check, {**FORM, "table": text})
    assert "Fläche 21 liegt 30" in said
    assert said.count("anders als ihre Nachbarn") == 1


def test_a_digital_certificate_fills_in_the_rest(tmp_path: Path) -> None:
    gauge = sg.read_gauge("step-gauge-420")
    data = gauge_xml().encode()
    answer = Asked(tmp_path).post(gauge_page.save, {}, file=data)
    assert "/gauge?saved=gauge" in answer, answer
    made = next((tmp_path / "gauge").glob("*.toml"))
    np.testing.assert_allclose(sg.read_gauge(made).position_mm, gauge.position_mm, atol=1e-9)


def test_the_table_of_a_german_page_is_read_back(tmp_path: Path) -> None:
    form = {**FORM, "table": lines(FACE, NOMINAL, POSITION, head="Fläche\tNennmaß mm\tPosition mm"), "U_um": "0,3"}
    Asked(tmp_path).post(gauge_page.save, {**form, "U_um_per_m": "1"})
    read = sg.read_gauge(tmp_path / "gauge/A-1.toml")
    np.testing.assert_allclose(read.nominal_mm, NOMINAL)
    np.testing.assert_allclose(read.position_mm, POSITION)


def test_u_that_grows_with_the_length_is_two_fields(tmp_path: Path) -> None:
    form = {**FORM, "table": lines(FACE, NOMINAL, POSITION, head="face\tnominal mm\tposition mm")}
    said = Asked(tmp_path).post(gauge_page.check, form)
    assert "U = a + b·L" in said
    Asked(tmp_path).post(gauge_page.save, {**form, "U_um": "0,3", "U_um_per_m": "1"})
    read = sg.read_gauge(tmp_path / "gauge/A-1.toml")
    np.testing.assert_allclose(2.0 * read.u_um, 0.3 + np.array(NOMINAL) / 1e3)
    both = {**FORM, "table": LAYOUTS["as Excel pastes it"], "U_um": "0,3"}
    assert "stated twice" in Asked(tmp_path).post(gauge_page.check, both)
    shown = Asked(tmp_path).get(gauge_page.show)
    assert all(f'name="{name}"' in shown for name in (*gauge_page.EXPANDED, *gauge_page.UNIT_FIELDS))
    assert re.search(r"Drift in a year[^*]*<b[^>]*>\*\*</b>", shown)


def test_a_deviation_that_is_too_large_is_shown_with_its_sign(tmp_path: Path) -> None:
    """-1.50 was shown as 1.5 mm."""
    table = lines(
        NOMINAL, [-1.5 * (n == 2) for n in range(len(NOMINAL))], U_UM, head="Nominal mm\tDeviation (mm)\tU (µm)"
    )
    assert "−1.5 mm" in Asked(tmp_path).post(gauge_page.check, {**FORM, "table": table})


@pytest.mark.parametrize(
    ("table", "unit"),
    [
        (lines(NOMINAL, OFF_UM, U_UM, head="Nominal mm\tDeviation (mm)\tU (µm)"), "deviation_unit"),
        (lines(NOMINAL, POSITION, U_UM, head="Nominal mm\tPosition mm\tU (mm)"), "uncertainty_unit"),
    ],
)
def test_um_under_a_header_of_mm_are_recognised_and_settled_by_the_field(tmp_path: Path, table: str, unit: str) -> None:
    said = Asked(tmp_path).post(gauge_page.check, {**FORM, "table": table})
    assert "looks like um (factor 1000)" in said
    assert Words("en").label(unit) in said
    assert "6 faces of 3 blocks" in Asked(tmp_path).post(gauge_page.check, {**FORM, "table": table, unit: "um"})


def test_what_nobody_stated_is_a_hint_and_in_no_file(tmp_path: Path) -> None:
    for page in (machine_page, gauge_page):
        shown = Asked(tmp_path).get(page.show)
        for name in ("pretravel_um", "repeatability_um", "tip_radius_mm", "material", "expansion_per_K"):
            assert not re.search(rf'name="{name}"[^>]* value="[^"]', shown)
    assert 'placeholder="typically 3"' in Asked(tmp_path).get(machine_page.show)
    kind = Asked(tmp_path).get(machine_page.show, kind="machine_tool")
    form = filled_in(kind)
    answer = Asked(tmp_path).post(machine_page.save, {**form, "name": "Mill", "tip_radius_mm": "3"})
    assert "/machine?saved=" in answer
    made = sg.read_machine(tmp_path / "machine/mill.toml")
    assert made.table.kind == "machine tool"
    assert not made.probe.states_radius
    text = (tmp_path / "machine/mill.toml").read_text()
    assert not re.search("pretravel|repeatability|temperature|expansion|stylus", text)
    again = Asked(tmp_path).get(machine_page.show)
    assert not re.search(r'name="(pretravel_um|repeatability_um|temperature_C)"[^>]* value="[^"]', again)
    assert "is not filled in" in Asked(tmp_path).post(
        machine_page.save, {**form, "name": "Mill", "tip_radius_mm": "3", "u_scale_temperature_K": "0.1"}
    )


def filled_in(page: str) -> dict[str, str]:
    """What a browser would send of a form as it was opened."""
    chosen = re.findall(r'<select [^>]*name="(\w+)">(?:(?!</select>).)*?<option value="([^"]+)" selected', page)
    return dict([*re.findall(r'name="(\w+)"[^>]* value="([^"]+)"', page), *chosen])


def test_the_kind_of_the_machine_is_written_as_it_was_preselected_and_saving_overwrites(tmp_path: Path) -> None:
    asked = Asked(tmp_path, "de")
    form = {**filled_in(asked.get(machine_page.show)), "name": "KMG Halle 2", "tip_radius_mm": "2"}
    assert form["kind"] == "bridge"
    assert "/machine?saved=" in asked.post(machine_page.save, form)
    assert sg.read_machine(tmp_path / "machine/kmg-halle-2.toml").table.kind == "cmm"

    other = asked.get(machine_page.show, kind="small_mill")
    assert 'placeholder="typisch 30"' in other
    form = filled_in(other)
    assert (form["name"], form["kind"], form["x_high"]) == ("KMG Halle 2", "small_mill", "700")
    asked.post(machine_page.save, form)
    assert [one.name for one in (tmp_path / "machine").iterdir()] == ["kmg-halle-2.toml"]
    assert sg.read_machine(tmp_path / "machine/kmg-halle-2.toml").table.kind == "machine tool"


@pytest.mark.parametrize("kind", ["bridge", "gantry", "machine_tool", "small_mill"])
def test_a_kind_comes_back_as_it_was_chosen(tmp_path: Path, kind: str) -> None:
    form = filled_in(Asked(tmp_path).get(machine_page.show, kind=kind))
    Asked(tmp_path).post(machine_page.save, {**form, "name": "M", "tip_radius_mm": "2"})
    assert filled_in(Asked(tmp_path).get(machine_page.show))["kind"] == kind


def test_another_kind_of_a_machine_file_stays_and_none_stays_none(tmp_path: Path) -> None:
    asked = Asked(tmp_path)
    form = filled_in(asked.get(machine_page.show))
    asked.post(machine_page.save, {**form, "name": "M", "tip_radius_mm": "2"})
    place = tmp_path / "machine/m.toml"
    text = place.read_text()
    for line, kind in (('kind = "printer"', "printer"), ("", None)):
        place.write_text(text.replace('kind = "cmm"', line))
        asked.post(machine_page.save, filled_in(asked.get(machine_page.show)))
        assert sg.read_machine(place).table.kind == kind


@pytest.mark.parametrize(
    ("constant", "divisor", "limit"),
    [
        ("1,8", "L/300", "1.8 + L/300"),
        ("1,8", "l / 300", "1.8 + L/300"),
        ("1,8", "300", "1.8 + L/300"),
        ("1,8 + L/300", "", "1.8 + L/300"),
        ("1,8", "", "1.8"),
    ],
)
def test_a_limit_is_taken_as_the_data_sheet_writes_it(tmp_path: Path, constant: str, divisor: str, limit: str) -> None:
    form = {**filled_in(Asked(tmp_path).get(machine_page.show)), "name": "M", "tip_radius_mm": "2"}
    Asked(tmp_path).post(machine_page.save, {**form, "mpe_constant": constant, "mpe_divisor": divisor})
    assert sg.read_machine(tmp_path / "machine/m.toml").table.mpe == limit


def test_a_limit_with_a_cap_comes_through_the_page_as_it_was(tmp_path: Path) -> None:
    asked, form = Asked(tmp_path), filled_in(Asked(tmp_path).get(machine_page.show))
    asked.post(machine_page.save, {**form, "name": "M", "tip_radius_mm": "2", "mpe_constant": "min(1.8 + L/300, 3)"})
    asked.post(machine_page.save, filled_in(asked.get(machine_page.show)))
    assert sg.read_machine(tmp_path / "machine/m.toml").table.mpe == "min(1.8 + L/300, 3)"


def test_another_kind_keeps_what_was_typed_in_the_browser(tmp_path: Path, watched: Watched) -> None:
    with Served(tmp_path) as server:
        page = watched.page
        page.goto(f"{server.address}/machine")
        page.get_by_label("Name").fill("KMG Halle 2")
        page.locator("#x_high").fill("650")
        page.locator("#kind").select_option("machine_tool")
        page.locator("#stylus_diameter_mm[placeholder='typically 4']").wait_for()
        watched.until("document.activeElement.name === 'kind'")
        values = {name: page.locator(f"#{name}").input_value() for name in ("name", "kind", "x_high", "y_high")}
        assert values == {"name": "KMG Halle 2", "kind": "machine_tool", "x_high": "650", "y_high": "250"}


def test_a_column_taken_wrong_is_put_right_where_it_is_refused(tmp_path: Path, watched: Watched) -> None:
    """By the lists above the columns, which stay as they are chosen while the table is refused."""
    columns = [FACE, NOMINAL, POSITION, OFF_UM, U_UM]
    with Served(tmp_path) as server:
        page = watched.page
        page.goto(f"{server.address}/gauge")
        page.locator("#table").fill(lines(*columns, head="Face No. Nominal Actual Deviation um U um", between=" "))
        page.get_by_role("alert").wait_for()
        for place, role in enumerate(["face", "nominal", "position", "deviation", "uncertainty"]):
            taken = page.locator(f"select[name=column_{place}]")
            if taken.locator(f"option[value={role}]").count():  # else it is taken for it already
                taken.select_option(role)
                page.locator(f"th.role-{role} select[name=column_{place}]").wait_for()
        page.get_by_text("6 faces of 3 blocks").wait_for()


def test_a_mark_that_cannot_be_told_is_chosen_where_it_is_refused(tmp_path: Path) -> None:
    """A comma in one column and a point in the other."""
    cells = (f"{n + 1}\t{10 * n},000\t{0.1 * n:.2f}\t0,25" for n in range(6))
    form = {**FORM, "table": "\n".join(["Fläche\tNennmaß mm\tAbweichung µm\tU µm", *cells])}
    asked = Asked(tmp_path, "de")
    said = asked.post(gauge_page.check, form)
    assert "erwartet: Dezimalzeichen: Komma oder Dezimalzeichen: Punkt" in said
    assert set(re.findall('<input type="radio" name="decimal" value="(.*?)"', said)) == {"comma", "point"}
    said = asked.post(gauge_page.check, {**form, "decimal": "comma"})
    assert "6 Flächen von 3 Blöcken, 50 mm lang" in said
    assert '<input type="radio" name="decimal" value="comma" checked>' in said
    assert asked.post(gauge_page.save, {**form, "decimal": "comma"})
    gauge = sg.read_gauge(next((tmp_path / "gauge").glob("*.toml")))
    np.testing.assert_allclose(gauge.position_mm, [10 * n + 1e-4 * n for n in range(6)], atol=1e-9)

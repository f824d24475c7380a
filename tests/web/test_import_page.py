"""Import on the page: what the columns were taken for, questions as choices, and the recording in the project."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.axis.recording import read_axis_recording
from stepgauge.errors import InputError
from stepgauge.recording import APPROACH, POSITION
from stepgauge.recording.columns import CORRECTED
from stepgauge.web.forms import Form
from stepgauge.web.pages import importing
from stepgauge.web.texts import Words
from tests.measured import lay
from tests.web.conftest import Asked, make_project

TARGETS = range(0, 500, 50)
READINGS = [target * (1.0 + ppm * 1e-6) for ppm in (10.0, 12.0) for target in TARGETS]
ROWS = [f"{target};{reading:.4f}" for target, reading in zip([*TARGETS, *TARGETS], READINGS, strict=True)]
TABLE = "\n".join(["Soll;Ist", *ROWS]).replace(".", ",")


KNOWN = {"measured_on": "2026-05-04", "gauge_temperature": "21", "temperature_convention": "as_read"}
"""What a decision needs beside the table."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_project(tmp_path / "project")


def test_a_question_is_a_choice_that_settles_it_and_stays_shown(folder: Path) -> None:
    asked, form = Asked(folder), {"pasted": TABLE, "sensor": "laser"}
    first = asked.post(importing.look, form)
    assert "unit of the targets is not stated" in first
    assert 'name="typed_unit"' in first
    assert '<th scope="col" class="number role-length">target' in first
    assert "All is clear" not in first
    second = asked.post(importing.look, {**form, "answer": "unit=", "typed_unit": "mm"})
    assert 'name="answer" value="unit=mm" checked' in second
    assert "All is clear: 20 readings" in second
    assert "the unit of the targets" in asked.post(importing.save, {**form, "output": "recordings/laser.csv"})
    assert not (folder / "recordings/laser.csv").exists()
    saved = asked.post(importing.save, {**form, "answer": "unit=mm", "output": "recordings/laser.csv"})
    assert "/importing?saved=recordings%2Flaser.csv" in saved
    frame = read_axis_recording(folder / "recordings/laser.csv").frame
    np.testing.assert_allclose(sorted(frame["reading"]), sorted(np.round(READINGS, 4)))


def test_points_of_the_gauge_become_a_recording_with_the_files_of_the_project(folder: Path) -> None:
    gauge, machine = sg.read_gauge(folder / "gauge/step-gauge-420.toml"), sg.read_machine("bridge-cmm")
    asked = Asked(folder)
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=machine)
    placement.write(folder / "placement.toml")
    plan = sg.plan(placement, gauge, machine, cycles=2, blocks="1:4")
    recording = sg.simulate(plan, machine, gauge, placement, seed=1).recording
    columns = recording.frame[["x_mm", "y_mm", "z_mm"]].rename(columns={"x_mm": "X", "y_mm": "Y", "z_mm": "Z"})
    table = columns.to_csv(index=False, sep="\t", float_format="%.5f")
    said = asked.post(importing.look, {"pasted": table})
    assert (
        "Read: 16 probings; placement placement.toml, axis 0.01; 1.00; 0.01; machine Bridge CMM. A decision still"
        in said
    ), said
    for needed in ("<li>Day of the measurement</li>", "the temperature of the gauge is not recorded"):
        assert needed in said
    corrected = {"pasted": table, "measured_on": "2026-05-04", "temperature_convention": "corrected_to_20"}
    assert "<li>Temperature of the gauge</li>" in asked.post(importing.look, corrected)  # its u is a part of U
    warm = asked.post(importing.look, {"pasted": table, "measured_on": "2026-05-04", "gauge_temperature": "21"})
    assert "“Temperature correction of the readings”" in warm
    assert "All is clear" not in said + warm
    assert "All is clear: 16 probings" in asked.post(importing.look, {"pasted": table, **KNOWN})
    twice = {**KNOWN, "pasted": "\n".join([table.strip(), *table.strip().splitlines()[1:]])}
    assert "every reading is that of an earlier cycle" in asked.post(importing.look, twice)
    form = {"pasted": table, "output": "recordings/a.csv", "gauge_temperature": "20,4"}
    assert "Day of the measurement: it is not filled in" in asked.post(importing.save, form)
    asked.post(importing.save, {**form, "measured_on": "2026-05-04"})
    read = sg.read_recording(folder / "recordings/a.csv")
    assert read.comments["measured_at"].startswith("2026-05-04")
    found = read.frame
    assert found["face"].tolist() == recording.frame["face"].tolist()
    assert set(found["gauge_temperature_C"]) == {20.4}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"output": "../elsewhere.csv"}, "outside of the project"),
        ({"output": "elsewhere.csv"}, "not the name of a recording"),
        ({"answer": "unit=parsec"}, "parsec"),
        ({"answer": "nothing=1"}, "not a choice"),
        ({"answer": "source=/etc/passwd"}, "not a choice"),
        ({"pasted": "no table"}, "table"),
    ],
)
def test_what_cannot_be_imported_says_why_without_words_of_the_command_line(
    folder: Path, change: dict[str, str], said: str
) -> None:
    form = {"pasted": TABLE, "sensor": "laser", "answer": "unit=mm", "output": "recordings/a.csv", **change}
    answer = Asked(folder).post(importing.save, form)
    assert 'role="alert"' in answer
    assert said in answer
    assert not re.search(r"--[a-z]", answer)
    assert not list(folder.rglob("recordings/*.csv"))


@pytest.mark.parametrize("apart", ["\t", ";", "  "])
def test_the_points_of_a_placement_are_led_to_the_page_that_takes_them(folder: Path, apart: str) -> None:
    """It was asked how their columns are called."""
    rows = [
        apart.join([str(n), *(f"{place:.4f}".replace(".", ",") for place in (117.0 + n, 243.1 - n, 91.2))])
        for n in range(1, 17)
    ]
    shown = Asked(folder).post(importing.look, {"pasted": "\n".join(rows)})
    assert "These are 16 points of a placement" in shown
    assert 'href="/locate"' in shown
    assert "no row names" not in shown
    assert "16 points of a placement" not in Asked(folder).post(importing.look, {"pasted": "\n".join(rows[:15])})


def test_the_program_that_fits_is_named_where_another_was_selected(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("old.dmi", "new.dmi"):
        (folder / name).write_text("")

    def imported(_: object, form: Form, *_more: object) -> object:
        if form.text("program") != "new.dmi":
            raise InputError(form.text("program"), "the probing move is not along the gauge of this placement")
        return SimpleNamespace(recording=object())

    monkeypatch.setattr(importing, "_imported", imported)
    shown = Asked(folder).post(importing.look, {"pasted": TABLE, "program": "old.dmi"})
    assert "These readings fit the program new.dmi" in shown


FACES = range(1, 43)
OF_FACES = "\n".join(
    ["Face;Nominal;Actual 1;Actual 2", *(f"{n};{10 * n - 10};{10 * n - 10}.001;{10 * n - 10}.002" for n in FACES)]
)
OF_FEATURES = "\n".join(["Feature;Nominal;Run 1", *(f"FACE_{n:02d};{10 * n - 10};{10 * n - 10}.001" for n in FACES)])
OF_FACES_IN_ORDER = "\n".join(["Fläche;X;Wert", *(f"{n};{10 * n - 10};{10 * n - 10}.001" for n in FACES)])


def choices(shown: str) -> list[tuple[str, str]]:
    """Every choice of the questions of a page, as a form sends it: of a select its first and its last value."""
    found = re.findall(r'type="radio" name="(question_\d+)" value="([^"]+)"', shown)
    for name, options in re.findall(r'<select name="(question_\d+)">(.*?)</select>', shown):
        values = [one for one in re.findall(r'value="([^"]*)"', options) if one]
        found += [(name, values[0]), (name, values[-1])]
    return found


def test_a_number_is_shown_with_all_of_its_digits(tmp_path: Path) -> None:
    frame = pd.DataFrame({"target (mm)": [0.0, 100.0, 200.0], "reading (mm)": [0.0001, 100.00035, 200.0 + 0.1 + 0.2]})
    frame.to_excel(tmp_path / "axis.xlsx", index=False)
    imported = sg.import_recording(tmp_path / "axis.xlsx", sensor="laser")
    assert imported.columns[1].cells == ("0.0001", "100.00035", "200.3")


@pytest.mark.parametrize("table", [OF_FACES, OF_FACES_IN_ORDER, OF_FEATURES])
def test_faces_along_a_gauge_that_is_located_are_not_asked_about(folder: Path, table: str) -> None:
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=sg.read_machine("bridge-cmm"))
    placement.write(folder / "placement.toml")
    asked = Asked(folder)
    shown = asked.post(importing.look, {"pasted": table})
    assert re.search(r"Read: \d+ probings", shown)
    assert choices(shown) == []
    asked.post(importing.save, {"pasted": table, "measured_on": "2026-05-04", "output": "recordings/f.csv"})
    assert "/result/evaluate" in asked.get(importing.show, saved="recordings/f.csv")


def test_readings_along_a_gauge_are_those_of_the_placement_that_is_chosen(folder: Path) -> None:
    """The newest was taken without a word: a table of the first placement was booked on the second."""
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    first = sg.locate(Path("examples/demo/points.csv"), gauge, machine=sg.read_machine("bridge-cmm"))
    first.write(folder / "placement.toml")
    asked = Asked(folder, "de")
    assert 'name="placement"' not in asked.get(importing.show)
    second = replace(lay(gauge, first.side.tolist()), tip_radius_mm=first.tip_radius_mm)
    second.write(folder / "placement-2.toml")
    shown = asked.get(importing.show)
    assert "Lage des Stufenendmaßes bei dieser Messung" in shown
    assert shown.index(">placement.toml (") < shown.index(">placement-2.toml (")
    for number, (name, lies) in enumerate((("placement.toml", first), ("placement-2.toml", second))):
        given = {"pasted": OF_FACES, "measured_on": "2026-05-04", "output": f"recordings/{number}.csv"}
        answer = asked.post(importing.save, {**given, "placement": name})
        assert 'role="alert"' not in answer, answer
        frame = sg.read_recording(folder / f"recordings/{number}.csv").frame
        np.testing.assert_allclose(np.abs(frame[APPROACH].to_numpy(float) @ lies.axis), 1.0, atol=1e-6)


def test_a_placement_that_cannot_be_read_is_not_replaced_by_another_one(folder: Path) -> None:
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    lay(gauge).write(folder / "placement-2.toml")
    (folder / "placement.toml").write_text("c1_mm = 1\n")
    answer = Asked(folder).post(importing.look, {"pasted": OF_FACES})
    assert 'role="alert"' in answer
    assert "placement.toml" in answer


def test_without_a_header_the_names_that_fit_the_gauge_are_a_choice_that_settles_it(folder: Path) -> None:
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=sg.read_machine("bridge-cmm"))
    placement.write(folder / "placement.toml")
    form, asked = {"pasted": OF_FEATURES.partition("\n")[2]}, Asked(folder)
    answer = ("question_1", "header=face,nominal_mm,reading_mm")
    assert answer in choices(asked.post(importing.look, form))
    assert "Read: 42 probings" in asked.post(importing.look, {**form, answer[0]: answer[1]})


@pytest.mark.parametrize("table", [OF_FACES, OF_FACES_IN_ORDER])
def test_faces_along_the_gauge_are_asked_for_with_choices_that_settle_it(folder: Path, table: str) -> None:
    asked, form = Asked(folder), {"pasted": table}
    first = asked.post(importing.look, form)
    assert "HEADER" not in first
    found = choices(first)
    assert found
    for name, value in found:
        second = asked.post(importing.look, {**form, name: value})
        assert f'name="answer" value="{value}" checked' in second
        assert (name, value) not in choices(second)
        of = re.search(r'name="answers_of" value="(\w+)"', second)
        assert of
        kept = {"answer": value, "answers_of": of[1]}
        assert choices(asked.post(importing.look, {"pasted": f"{table}\n", **kept})) == found
    settled = asked.post(importing.look, {**form, "question_1": "sensor=touch"})
    assert "All is clear" in settled
    asked.post(
        importing.save, {**form, "answer": "sensor=touch", "measured_on": "2026-05-04", "output": "recordings/f.csv"}
    )
    saved = asked.get(importing.show, saved="recordings/f.csv")
    assert "/result/evaluate" not in saved
    assert 'action="/diagnosis"' in saved


def test_what_is_wrong_with_positions_of_faces_is_said_at_once(folder: Path) -> None:
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=sg.read_machine("bridge-cmm"))
    placement.write(folder / "placement.toml")
    asked = Asked(folder)
    exchanged = OF_FEATURES.replace(";60.001", ";x").replace(";70.001", ";60.001").replace(";x", ";70.001")
    assert "faces 7 and 8 look exchanged" in asked.post(importing.look, {"pasted": exchanged})
    inches = "\n".join(["Face;Nominal;Actual", *(f"{n};{(n - 1) / 2.54:.4f};{(n - 1) / 2.54:.5f}" for n in FACES)])
    assert ("question_1", "unit=inch") in choices(asked.post(importing.look, {"pasted": inches}))
    settled = asked.post(importing.look, {"pasted": inches, "question_1": "unit=inch"})
    assert "Read: 42 probings" in settled


def test_positions_of_faces_are_evaluated_where_the_gauge_lay(folder: Path) -> None:
    gauge, machine = sg.read_gauge(folder / "gauge/step-gauge-420.toml"), sg.read_machine("bridge-cmm")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=machine)
    error_um = np.arange(42) * 0.05
    rows = [
        f"{n};{a:.3f};{b:.6f}"
        for n, a, b in zip(FACES, gauge.nominal_mm, gauge.position_mm + error_um / 1e3, strict=True)
    ]
    table = pd.read_csv(io.StringIO("\n".join(["Face;Nominal;Actual", *rows])), sep=";")
    known = {"sensor": "touch", "gauge": gauge, "placement": placement}
    recording = sg.import_recording(table, **known, gauge_temperature_C=20.0).recording
    result = sg.evaluate(recording, gauge).results[0]
    np.testing.assert_allclose(result.xf_um[::2], error_um[::2], atol=0.06)
    np.testing.assert_array_equal(recording.frame["face"], FACES)


def points(folder: Path, without: int = 0, unit_mm: float = 1.0, unit: str = "") -> str:
    gauge, machine = sg.read_gauge(folder / "gauge/step-gauge-420.toml"), sg.read_machine("bridge-cmm")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=machine)
    placement.write(folder / "placement.toml")
    plan = sg.plan(placement, gauge, machine, cycles=1, blocks="1:10")
    frame = sg.simulate(plan, machine, gauge, placement, seed=1).recording.frame
    frame = frame[frame["face"] != without]
    header = [f"{one}{unit}" for one in "XYZ"]
    named = (frame[["x_mm", "y_mm", "z_mm"]] / unit_mm).set_axis(header, axis="columns")
    return named.to_csv(index=False, sep="\t", float_format="%.7f")


def test_faces_that_are_missing_are_named_before_the_import_is_accepted(folder: Path) -> None:
    assert "nothing was measured of faces" not in Asked(folder).post(importing.look, {"pasted": points(folder)})
    said = Asked(folder).post(importing.look, {"pasted": points(folder, without=17)})
    assert '<p class="warning">warning: nothing was measured of faces that lie between measured ones: 17</p>' in said
    german = Asked(folder, "de").post(importing.look, {"pasted": points(folder, without=17)})
    assert "Warnung: nichts gemessen" in german


def test_a_row_that_is_missing_of_faces_along_the_gauge_is_named(folder: Path) -> None:
    """'All is clear: 71 probings' was said of three cycles of 24 faces."""
    gauge = sg.read_gauge(folder / "gauge/step-gauge-420.toml")
    lay(gauge).write(folder / "placement.toml")
    noise = np.random.default_rng(4).normal(0.0, 4e-4, (3, 42))
    rows = [f"{c + 1};{n};{10 * n - 10};{10 * n - 10 + noise[c, n - 1]:.4f}" for c in range(3) for n in FACES]
    whole = "\n".join(["Zyklus;Fläche;Nennmaß;Messwert", *rows])
    lacking = "\n".join(["Zyklus;Fläche;Nennmaß;Messwert", *(row for row in rows if not row.startswith("2;17;"))])
    assert "readings that other cycles have are missing" not in Asked(folder).post(importing.look, {"pasted": whole})
    shown = Asked(folder).post(importing.look, {"pasted": lacking})
    assert "readings that other cycles have are missing, as cycle/face: 2/17" in shown, shown


def test_inches_are_recognised_and_a_choice_takes_them(folder: Path) -> None:
    table = points(folder, unit_mm=25.4)
    said = Asked(folder).post(importing.look, {"pasted": table})
    assert "on it where they are in inch" in said
    assert "shifted" not in said
    assert ("question_1", "unit=inch") in choices(said)
    assert "Read: 20 probings" in Asked(folder).post(importing.look, {"pasted": table, "question_1": "unit=inch"})


def test_a_question_and_its_choice_are_german_throughout(folder: Path) -> None:
    asked = Asked(folder, "de")
    assert (
        "Positionen von Flächen längs des Stufenendmaßes, ohne x, y und z: eine Achse, oder ein Stufenendmaß?: Face"
        in asked.post(importing.look, {"pasted": OF_FACES})
    )
    settled = asked.post(importing.look, {"pasted": OF_FACES.replace(".", ","), "question_1": "sensor=touch"})
    assert "Sensor: Taster" in settled
    assert "Dezimalzeichen Komma" in settled
    said = Words("de").message(
        "axis by touch-trigger probe: 120 readings at 40 targets, 3 cycles, in mm, deviations in um"
    )
    assert said == "Achse mit Taster: 120 Messwerte an 40 Zielen, 3 Durchgänge, in mm, Abweichungen in um"


def test_compensated_points_of_two_placements_are_turned_back_by_the_radius_of_the_machine() -> None:
    """Each was by the effective radius of its own placement, and a diagnosis of both was refused."""
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    placement = sg.locate(Path("examples/demo/points.csv"), gauge, machine=machine)
    plan = sg.plan(placement, gauge, machine, cycles=3, blocks="1:4")
    centres = sg.simulate(plan, machine, gauge, placement, seed=1).recording
    tip = centres.frame[list(POSITION)].to_numpy()
    points = tip + machine.probe.tip_radius_mm * centres.approach
    table = pd.DataFrame(points, columns=["X", "Y", "Z"])
    for radius_mm in (2.0012859, 2.0012095):
        lies = replace(placement, tip_radius_mm=radius_mm)
        found = sg.import_recording(table, gauge=gauge, placement=lies, machine=machine, points="surface").recording
        assert float(found.comments[CORRECTED]) == machine.probe.tip_radius_mm
        np.testing.assert_allclose(found.frame[list(POSITION)], tip, atol=1e-9)

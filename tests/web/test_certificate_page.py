"""The certificate's form, the faults by name and the values that are stated: from a form to the files, as functions."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import stepgauge as sg
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.languages.messages import LANGUAGES
from stepgauge.live.faults import read_faults
from stepgauge.reports.certificate_file import check_filled, read_laboratory
from stepgauge.web import concealed
from stepgauge.web.forms import Form
from stepgauge.web.pages import certificate, plan, run, sources
from stepgauge.web.render import render
from stepgauge.web.site import WorkList
from stepgauge.web.texts import Words
from tests.dcc.made import one_recording
from tests.web.conftest import Asked, make_project

FILLED = {
    "certificate.number": "2026-017",
    "certificate.issued": "2026-05-06",
    "certificate.performed_from": "4.5.2026",
    "certificate.performed_to": "2026-05-05",
    "certificate.example": "1",
    "item.manufacturer": "Maker",
    "item.serial": "B7",
    "laboratory.name": "Lab",
    "laboratory.city": "Town",
    "customer.name": "Customer",
    "method.name": "Procedure 1",
    "person.name": "A. Person",
    "conditions.temperature_C_low": "19,8",
    "conditions.temperature_C_high": "20,3",
    "statements.mpe": "1.8 + L/350",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_project(tmp_path / "project")


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """What would be run, in place of running it."""
    found: list[list[str]] = []

    def start(_: WorkList, arguments: list[str], then: str) -> SimpleNamespace:
        found.append(list(arguments))
        return SimpleNamespace(number=1, is_running=True, has_failed=False, seconds=0.0, then=then, words=list)

    monkeypatch.setattr(WorkList, "start", start)
    return found


def test_a_filled_form_is_a_file_that_may_be_signed_and_comes_back(folder: Path, begun: list[list[str]]) -> None:
    (folder / "results/evaluation").mkdir()
    asked = Asked(folder)
    asked.post(certificate.make, {**FILLED, "result": "results/evaluation"})
    said = read_laboratory(folder / "certificate.toml")
    check_filled(said)
    assert said.conditions.temperature_C == (19.8, 20.3)
    assert [(one.name, one.signs) for one in said.persons] == [("A. Person", True)]
    output = f"results/certificate-{said.certificate.number}.pdf"
    written = ["report", "results/evaluation", "--certificate", "certificate.toml", "--language", "en", "-o", output]
    assert begun == [written]
    shown = Asked(folder, "de").get(certificate.show, result="results/evaluation")
    assert re.search('name="laboratory.city"[^>]* value="Town"', shown)
    assert re.search('name="conditions.temperature_C_low"[^>]* value="19,8"', shown)
    assert re.search('name="statements.mpe"[^>]* value="1,8 \\+ L/350"', shown)
    asked.post(certificate.make, {**FILLED, "statements.mpe": "1,8 + L/350", "result": "results/evaluation"})
    assert read_laboratory(folder / "certificate.toml").statements.mpe == "1.8 + L/350"
    emptied = {**FILLED, "result": "results/evaluation", "statements.mpe": ""}
    asked.post(certificate.make, emptied)
    assert read_laboratory(folder / "certificate.toml").statements.mpe is None


def test_days_in_the_wrong_order_are_told_without_a_file_and_written_to_none(
    folder: Path, begun: list[list[str]]
) -> None:
    """It named a file that the technician does not know, and left the wrong one in the project."""
    (folder / "results/evaluation").mkdir()
    days = {"certificate.issued": "2026-03-13", "certificate.performed_to": "2026-03-14"}
    own = {**days, "certificate.performed_from": "2026-03-14", "result": "results/evaluation"}
    answer = Asked(folder, "de").post(certificate.make, {**FILLED, **own})
    assert "diese Angaben passen nicht zueinander; erwartet: „Letzter Tag“ (2026-03-14) nicht nach" in answer
    assert "certificate.toml" not in answer
    assert not (folder / "certificate.toml").exists()
    assert begun == []


@pytest.mark.parametrize(("page", "section"), [("certificate", "report"), ("probe", "machine"), ("result", "result")])
def test_every_page_is_in_a_section_of_the_navigation(folder: Path, page: str, section: str) -> None:
    """On the page of the certificate none was marked."""
    answer = bytes(render(Asked(folder).request(f"/{page}"), "base.html.j2").body).decode()
    assert re.findall(r'<a href="([^"]*)" aria-current="page">', answer) == [f"/{section}"]


@pytest.mark.parametrize("lacking", sorted(certificate.REQUIRED))
def test_what_must_be_there_is_asked_for_by_its_field(folder: Path, begun: list[list[str]], lacking: str) -> None:
    (folder / "results/evaluation").mkdir()
    answer = Asked(folder).post(certificate.make, {**FILLED, lacking: "", "result": "results/evaluation"})
    label = Words("en").label(lacking.partition(".")[2])
    assert f"{label}: it is not filled in" in answer
    assert begun == []


@pytest.mark.parametrize(
    ("key", "value", "label"),
    [("temperature_C", "200", "„Temperatur der Luft“"), ("humidity_percent", "120", "„Feuchte der Luft“")],
)
def test_a_wrong_value_is_told_by_the_field_of_this_form(
    folder: Path, begun: list[list[str]], key: str, value: str, label: str
) -> None:
    """The temperature of the scales, a key of the same name, was named for that of the air."""
    (folder / "results/evaluation").mkdir()
    own = {f"conditions.{key}_{end}": value for end in ("low", "high")}
    answer = Asked(folder, "de").post(certificate.make, {**FILLED, **own, "result": "results/evaluation"})
    assert f"„Die Luft des Raums“ ist falsch; erwartet: {label} als [kleinster, größter]" in answer, answer
    assert "Maßstäbe" not in answer
    assert "/machine" not in answer
    assert begun == []


@pytest.mark.parametrize("kind", sorted(concealed.kinds()))
def test_every_fault_of_the_list_can_be_concealed_with_its_usual_values(tmp_path: Path, kind: str) -> None:
    form = {"fault": kind, **concealed.fault(kind).usual}
    effect = concealed.table(Form(form, {}))
    assert effect is not None
    path = tmp_path / "fault.toml"
    path.write_text(concealed.text(effect))
    assert [one.kind for one in read_faults(path).effects] == [kind]
    assert all(Words(language).effect(kind) for language in LANGUAGES)


@pytest.mark.parametrize("along", ["x", "y", "z"])
def test_a_fault_is_proposed_where_a_gauge_along_this_axis_shows_it(along: str) -> None:
    """One axis of the travel is that of the gauge, and a rotation is about another, or nothing would be found."""
    for kind in concealed.kinds():
        usual = concealed.fault(kind, along).usual
        for name in ("fault_axis", "fault_travel_axis", "fault_plane"):
            assert along in usual.get(name, along), kind
        assert usual.get("fault_rotation_axis") != along
    assert concealed.fault("thermal_drift", along).usual["fault_direction"] == along


def test_a_fault_is_shown_with_its_fields_and_one_that_is_none_is_refused(folder: Path) -> None:
    shown = Asked(folder, "de").get(run.show_fault, fault="scale_error")
    assert 'name="fault_ppm"' in shown
    assert "Größe (µm/m)" in shown
    assert Asked(folder).get(run.show_fault).strip() == ""
    for wrong in ({"fault": "error_map"}, {"fault": "scale_error", "fault_axis": "w", "fault_ppm": "1"}):
        assert "not a choice" in Asked(folder).post(lambda _, form: concealed.table(form), wrong)


def test_files_of_a_project_are_found_from_a_folder_beside_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    beside = folder.parent / "beside"
    beside.mkdir()
    monkeypatch.chdir(beside)
    stated = Asked(folder).request("/").app.state.site.stated("machine")
    assert Path(stated).is_absolute()
    assert Path(stated).samefile(folder / "machine/bridge-cmm.toml")


def test_values_that_were_tried_are_written_into_the_machine_file(
    folder: Path, begun: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "recording_names", lambda site, name: ["recordings/a.csv"])
    path = folder / "machine/bridge-cmm.toml"
    before = path.read_text()
    values = {"gauge_temperature": "0,05", "scale_temperature": "0.1", "scale_expansion": "0.5"}
    Asked(folder).post(sources.state, {**values, "evaluation": "results/evaluation"})
    machine = sg.read_machine(path)
    assert machine.stated.gauge_temperature_K is not None
    assert {one.key: one.u for one in machine.uncertain} == pytest.approx(
        {"machine.temperature_C": 0.1, "machine.scale_expansion_per_K": 0.5e-6}
    )
    assert before.splitlines()[0] in path.read_text(), "comments stay"
    assert tomllib.loads(before)["probe"] == tomllib.loads(path.read_text())["probe"]
    assert begun == [["evaluate", "recordings/a.csv", "-o", "results/evaluation"]]


def test_all_empty_fields_are_named_at_once_and_the_days_are_those_of_the_measurement(
    folder: Path, begun: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    measured = replace(one_recording(), comments={**one_recording().comments, "measured_at": "2026-05-04T10:00:00"})
    measured.write(folder / "recordings/a.csv")
    evaluate(sg.read_recording(folder / "recordings/a.csv"), sg.read_gauge("step-gauge-420")).write(
        folder / "results/evaluation"
    )
    answer = Asked(folder).post(certificate.make, {"result": "results/evaluation"})
    words = Words("en")
    assert all(words.label(name) in answer for name in certificate.REQUIRED)
    assert answer.count("it is not filled in") == 1
    assert "Stated on the pages" not in answer  # the number of the certificate is none of the gauge's
    shown = Asked(folder).get(certificate.show, result="results/evaluation")
    for name in certificate.DAYS:
        assert re.search(f'name="{name}"[^>]* value="2026-05-04"', shown)


def test_another_program_does_not_replace_one_that_may_be_at_the_machine(folder: Path, begun: list[list[str]]) -> None:
    (folder / "program.dmi").write_text("the first")
    Asked(folder).post(plan.write, {"cycles": "3"})
    assert begun[0][-1] == "program-2.dmi"
    assert (folder / "program.dmi").read_text() == "the first"

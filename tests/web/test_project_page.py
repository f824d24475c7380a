"""Project: what was taken by mistake goes into an archive, and nothing looks at it any more."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from stepgauge.cli import main
from stepgauge.diagnosis.output.files import stated_digest
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.files.checksum import file_sha256
from stepgauge.files.text import write_json
from stepgauge.machine.file import read_machine
from stepgauge.project.file import read_project
from stepgauge.project.status import project_status
from stepgauge.recording import Recording
from stepgauge.verbs.catalogue import VERBS
from stepgauge.web.pages import importing, project
from tests.dcc.made import one_recording
from tests.diagnosis.test_files import said as said_of
from tests.measured import lay, shipped
from tests.web.conftest import Asked, make_project
from tests.web.test_result_page import budget


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = make_project(tmp_path / "project")
    monkeypatch.chdir(folder)
    one_recording().write(folder / "recordings/one.csv")
    evaluate(one_recording(), shipped()[0]).write(folder / "results/evaluation")
    return folder


def test_a_wrong_recording_and_its_evaluation_are_removed_and_kept(folder: Path) -> None:
    was = (folder / "recordings/one.csv").read_bytes()
    left = ("recordings/one.csv.journal", "recordings/one.csv.fault.toml")
    for name in (*left, "recordings/one.csvx"):
        (folder / name).write_text("")
    for name in ("recordings/one.csv", "results/evaluation"):
        assert f'value="{name}"' in Asked(folder).get(project.status)
        answer = Asked(folder).post(project.remove, {"path": name})
        assert "is removed, and kept in" in answer
        assert not (folder / name).exists()
    shown = Asked(folder).get(project.status)
    assert "recordings/one.csv" not in shown
    assert "results/evaluation" not in shown
    assert not list(folder.rglob("evaluation.json"))
    with zipfile.ZipFile(folder / "removed/recordings-one.csv.zip") as archive:
        assert archive.read("recordings/one.csv") == was
        assert set(left) < set(archive.namelist())
    assert [one.name for one in (folder / "recordings").iterdir()] == ["one.csvx"]
    with zipfile.ZipFile(folder / "removed/results-evaluation.zip") as archive:
        assert "results/evaluation/evaluation.json" in archive.namelist()


@pytest.mark.parametrize("name", ["stepgauge.toml", "gauge", "machine/bridge-cmm.toml", "../elsewhere", "", "results"])
def test_nothing_else_is_removed(folder: Path, name: str) -> None:
    before = sorted(folder.rglob("*"))
    assert 'role="alert"' in Asked(folder).post(project.remove, {"path": name})
    assert sorted(folder.rglob("*")) == before


def test_a_day_that_is_still_to_come_is_refused_where_it_is_entered(folder: Path) -> None:
    text = (folder / "recordings/one.csv").read_text()
    rows = "\n".join(line for line in text.splitlines() if not line.startswith("#")) + "\n"
    form = {"pasted": rows, "measured_on": "2999-01-15", "output": "recordings/two.csv"}
    answer = Asked(folder).post(importing.save, form)
    assert "this day is still to come" in answer
    assert not (folder / "recordings/two.csv").exists()


def test_a_report_is_next_only_where_something_can_be_decided(folder: Path) -> None:
    """The recording was at 23 deg C, and nobody said whether its readings are corrected for that."""
    recording = one_recording()
    lay(shipped()[0]).write(folder / "placement.toml")
    warm = recording.frame.assign(gauge_temperature_C=23.0)
    comments = {key: text for key, text in recording.comments.items() if key != "temperature_convention"}
    Recording(warm, comments).write(folder / "recordings/one.csv")
    main(["evaluate", "recordings/one.csv", "-o", "results/evaluation"])
    shown = Asked(folder).get(project.status)
    assert "Nothing can be decided yet" in shown
    assert "the temperature correction of the readings" in shown
    assert 'href="/machine"' in shown
    assert 'href="/report"' not in shown


def test_a_result_is_outdated_by_what_it_depends_on_alone(folder: Path) -> None:
    """A new limit outdated diagnoses, which do not know it, and another uncertainty no budget."""
    file = folder / "machine/bridge-cmm.toml"
    text = file.read_text("utf-8") + "\n[uncertainty]\ngauge_temperature_K = 0.1\n"
    file.write_text(text, "utf-8")
    budget(folder, [])
    data = said_of("scale")
    inputs = {
        "path": "machine/bridge-cmm.toml",
        "sha256": file_sha256(file),
        "stated_sha256": stated_digest(read_machine(file)),
    }
    data["inputs"] = {**data["inputs"], "recordings": [], "gauge": {}, "machine": inputs}
    (folder / "results/diagnosis").mkdir()
    write_json(folder / "results/diagnosis/diagnosis.json", data)

    def outdated(was: str, now: str) -> set[str]:
        assert was in text
        file.write_text(text.replace(was, now, 1), "utf-8")
        found = project_status(read_project("stepgauge.toml", VERBS)).items
        return {one.what for one in found if one.wrong and one.what in ("budget", "diagnosis")}

    assert outdated("", "") == set()
    assert outdated("[machine]\n", '[machine]\nmpe = "3 + L/300"\n') == set()
    assert outdated("gauge_temperature_K = 0.1", "gauge_temperature_K = 0.2") == {"budget"}
    assert outdated("repeatability_um = ", "repeatability_um = 1") == {"budget", "diagnosis"}

"""The page of a diagnosis: of a probe's map, and of what two causes together may stand for."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from starlette.responses import Response

import stepgauge as sg
from stepgauge.files.text import write_json
from stepgauge.web.pages import diagnosis
from tests.conftest import ROOT
from tests.dcc.made import one_recording
from tests.diagnosis.test_files import said as said_of
from tests.web.conftest import Asked, Served, make_project
from tests.web.test_run import post

FEA = ROOT / "examples/omp40-fea"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A project with a probe, its map, and the diagnosis of that."""
    folder = make_project(tmp_path / "project")
    for name in ("map.csv", "existing-method.toml"):
        shutil.copy(FEA / name, folder / name)
    sg.diagnose(folder / "map.csv", probe=folder / "existing-method.toml").write(folder / "results/map")
    return folder


def said(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "diagnosis.json").read_text()))


def test_the_map_of_a_probe_has_a_page_with_all_its_causes(folder: Path) -> None:
    """The page failed: only findings of recordings have sets. And no cause is left out of a map's diagnosis."""
    first = said(folder / "results/map")["effects"][0]
    with Served(folder) as server:
        status, _, body = server.ask("/diagnosis?result=results/map")
        assert status == 200
        for label in (first["label"], *first["confounded_with"], *first["alternatives"]):
            assert label.replace("_", " ") in body.decode()
        assert b"/diagnosis/without" not in body
        assert "size 14." in body.decode()
        assert "</span> σ</dd>" in body.decode()
        status, body = post(server, "/diagnosis/without", result="results/map", kind=first["kind"])
        assert status == 422
        assert b"no cause can be left out" in body


def test_causes_that_stand_for_a_finding_together_have_a_row_and_a_probability(tmp_path: Path) -> None:
    """The first page had that row; in the browser a reader missed what the probabilities lack to one."""
    data, folder = said_of("scale"), make_project(tmp_path / "project")
    first = data["effects"][0]
    rival = {**first, "kind": "gauge_temperature", "label": "gauge_temperature", "conditional_probability": 0.25}
    first |= {"probability": 0.9, "own_probability": 0.45, "set": [{**first, "conditional_probability": 0.5}, rival]}
    first["confounded_with"] = ["gauge_temperature", "scale_temperature + thermal_drift"]
    (folder / "results/one").mkdir(parents=True)
    write_json(folder / "results/one/diagnosis.json", data)
    with Served(folder) as server:
        body = server.ask("/diagnosis?result=results/one")[2].decode()
    assert "scale temperature + thermal drift" in body
    assert body.count("22.5 %") == 2  # the rival, and what 0.9 (1 - 0.5 - 0.25) is
    assert body.count("/diagnosis/without") == 2


@pytest.mark.parametrize("of", ["effects", "unexplained"])
def test_placements_of_one_state_are_diagnosed_together_by_default(tmp_path: Path, of: str) -> None:
    """The recording that a diagnosis had planned was diagnosed alone, and could not tell its rivals apart."""
    folder = make_project(tmp_path / "project")
    days = {
        "first": "2026-05-04",
        "old": "2026-03-01",
        "other": "2026-05-04",
        "planned": "2026-05-05",
        "same": "2026-05-05",
    }
    for number, (name, day) in enumerate(days.items()):
        made = one_recording().assign_comments(measured_at=day, gauge_serial="B" if name == "other" else "A")
        made.write(folder / f"recordings/{name}.csv")
        os.utime(folder / f"recordings/{name}.csv", (1000 + 10 * number,) * 2)
    (folder / "results/first").mkdir(parents=True)
    (folder / "results/first/separate-1.dmi").write_text("")
    os.utime(folder / "results/first/separate-1.dmi", (1025, 1025))
    data = said_of("scale")
    data["inputs"]["recordings"] = [{"path": "recordings/first.csv", "sha256": ""}]
    commands = ["stepgauge plan next.toml -o results/first/separate-1.dmi"]
    proposing = {"separate_by": "the gauge along y", "commands": commands, "laws": [], "probability": 0.9}
    first = {"effects": data["effects"][0], "unexplained": {**data["located"][0], **proposing}}[of]
    data |= {"effects": [], "unexplained": []} | {of: [{**first, "commands": commands}]}
    write_json(folder / "results/first/diagnosis.json", data)
    shown = Asked(folder).get(diagnosis.show, recording="recordings/planned.csv")
    ticked = {name for name in days if f'value="recordings/{name}.csv" checked' in shown}
    assert ticked == {"first", "planned", "same"}
    assert 'value="recordings/old.csv">' in shown
    assert "2026-03-01" in shown
    assert "Made from: Placement 1: recordings/first.csv" in shown or "Made from: recordings/first.csv" in shown


def test_one_that_cannot_be_read_leaves_the_page_on_which_another_is_made(tmp_path: Path) -> None:
    folder = make_project(tmp_path / "project")
    data = said_of("scale")
    (folder / "results/old").mkdir(parents=True)
    write_json(folder / "results/old/diagnosis.json", {**data, "format": "stepgauge diagnosis 1"})
    (folder / "recordings/one.csv").write_text("cycle,face\n")
    shown = Asked(folder).get(diagnosis.show)
    assert 'role="alert"' in shown
    assert "the page Diagnosis" not in shown
    assert 'value="recordings/one.csv" checked' in shown
    assert "Diagnose</button>" in shown


def test_structure_has_the_run_that_tells_what_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, data = make_project(tmp_path / "project"), said_of("scale")
    command = "stepgauge plan results/one/s.toml -g gauge/g.toml -m machine/m.toml -d dmis -o results/one/a.dmi"
    run = {"separate_by": f"the gauge along y: {command}", "commands": [command], "laws": [], "probability": 0.9}
    data |= {"verdict": "unknown", "effects": [], "unexplained": [{**data["located"][0], **run}]}
    (folder / "results/one").mkdir(parents=True)
    write_json(folder / "results/one/diagnosis.json", data)
    shown = Asked(folder).get(diagnosis.show)
    assert "What would tell them apart: the gauge along y" in shown
    begun: list[list[str]] = []
    monkeypatch.setattr(diagnosis, "run_verb", lambda _, words, *_a, **_k: begun.append(words) or Response())
    Asked(folder).post(diagnosis.plan_next, {"result": "results/one", "finding": "1"})
    assert begun == [command.split()[1:]]

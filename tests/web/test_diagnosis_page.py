"""The page of a diagnosis: of a probe's map, and of what two causes together may stand for."""

from __future__ import annotations

import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from starlette.responses import Response

import stepgauge as sg
from stepgauge.diagnosis import design
from stepgauge.diagnosis.further_runs import _directions, placement_of
from stepgauge.diagnosis.maps import further_measurements
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.wording.findings import CHOICES, name_of
from stepgauge.diagnosis.wording.notation import symbol
from stepgauge.effects import effect_kinds
from stepgauge.files.checksum import file_digest
from stepgauge.files.text import write_json
from stepgauge.gauge.placement import format_placement, make_placement
from stepgauge.languages.messages import parameter_name
from stepgauge.reports.first_steps import proposal
from stepgauge.verbs.catalogue import VERBS
from stepgauge.web.pages import diagnosis
from stepgauge.web.recordings import recording_choices
from stepgauge.web.site import Site
from tests.conftest import ROOT
from tests.dcc.made import one_recording, shipped
from tests.diagnosis.test_files import said as said_of
from tests.web.conftest import Asked, Served, make_project
from tests.web.gathered import english_words
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


def scattered_anew(frame: pd.DataFrame, seed: int) -> pd.DataFrame:
    """The same faces with readings of another measurement."""
    along = str(frame[["x_mm", "y_mm", "z_mm"]].std().idxmax())
    noise = np.random.default_rng(seed).normal(0.0, 3e-4, len(frame))
    return frame.assign(**{along: frame.groupby("face")[along].transform("mean") + noise})


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
        "checked": "2026-06-04",
    }
    for number, (name, day) in enumerate(days.items()):
        made = one_recording().assign_comments(measured_at=day, gauge_serial="B" if name == "other" else "A")
        made = replace(made, frame=scattered_anew(made.frame, number))
        if name == "planned":  # laid elsewhere, about as it was proposed
            made = made.assign_columns(x_mm=made.frame["x_mm"] + 180.0)
        made.write(folder / f"recordings/{name}.csv")
        os.utime(folder / f"recordings/{name}.csv", (1000 + 10 * number,) * 2)
    (folder / "results/first").mkdir(parents=True)
    place, lies = folder / "results/first/separate-1.toml", placement_of(make_residuals(one_recording(), *shipped()))
    aside = np.array([200.0, 0.0, 0.0])
    place.write_text(format_placement(make_placement(lies.c1_mm + aside, lies.c2_mm + aside, 1, lies.last_block)))
    os.utime(place, (1025, 1025))
    data = said_of("scale")
    data["inputs"]["recordings"] = [{"path": "recordings/first.csv", "sha256": ""}]
    machine = next(folder.glob("machine/*.toml"))
    stated = {"path": str(machine.relative_to(folder)), "sha256": file_digest(machine)}
    data["inputs"] |= {"gauge": {}, "machine": stated}
    commands = ["stepgauge plan results/first/separate-1.toml -o results/first/separate-1.dmi"]
    proposing = {"separate_by": "the gauge along y", "commands": commands, "laws": [], "probability": 0.9}
    first = {"effects": data["effects"][0], "unexplained": {**data["located"][0], **proposing}}[of]
    data |= {"effects": [], "unexplained": []} | {of: [{**first, "commands": commands}]}
    write_json(folder / "results/first/diagnosis.json", data)

    def ticked(name: str) -> set[str]:
        site = Site(folder, VERBS, 8420, "token")
        return {Path(one.name).stem for one in recording_choices(site, [f"recordings/{name}.csv"]) if one.ticked}

    shown = Asked(folder).get(diagnosis.show, recording="recordings/planned.csv")
    assert ticked("planned") == {"first", "planned", "same"}
    assert re.search(r"first.csv <[^>]*>2026-05-04, [0-9.]+ °C – another day: its diagnosis proposed", shown)
    assert 'value="recordings/old.csv">' in shown
    assert ticked("checked") == {"checked"}  # the same program on another day is none that a diagnosis asked for
    assert "Made from: Placement 1: recordings/first.csv" in shown or "Made from: recordings/first.csv" in shown
    machine.write_text(machine.read_text("utf-8") + "# corrected\n", "utf-8")
    assert ticked("planned") == {"planned", "same"}


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


def test_the_measurement_that_decides_most_comes_first(tmp_path: Path) -> None:
    """Several were proposed side by side; one that is not there was "the measurement that is proposed"."""
    folder, data = make_project(tmp_path / "project"), said_of("scale")
    effect = data["effects"][0]
    command = "stepgauge plan results/one/separate-{0}.toml -o results/one/separate-{0}.dmi"

    def finding(number: int, words: str, nats: float) -> dict[str, Any]:
        own = [command.format(number)] if nats else []
        said = f"{words}: {own[0]}" if own else words
        return {**effect, "separate_by": said, "commands": own, "expected_information_nats": nats}

    run = "the gauge along {}, about (375, 403, 143) mm, which separates it from reversal_error_x"
    data["effects"] = [
        finding(1, run.format("machine y"), 0.2),
        finding(2, run.format("the diagonal of x and -y"), 0.7),
    ]
    data["effects"].append(finding(3, design.NO_SEPARATION, 0.0))
    (folder / "results/one").mkdir(parents=True)
    write_json(folder / "results/one/diagnosis.json", data)
    shown = Asked(folder, "de").get(diagnosis.show)
    first = (
        "entscheidet voraussichtlich am meisten: das Stufenendmaß längs der Diagonale von x und -y, um (375, 403, 143)"
    )
    later = "wenn es dann noch offen ist: das Stufenendmaß längs der Maschinenachse y, um (375, 403, 143) mm"
    assert shown.count(first.replace("-y", "−y")) + shown.count(first) == 2  # with the finding, and in the list
    assert shown.count(later) == 2
    assert shown.index("2, zuerst messen") < shown.index("1, danach")
    assert "3, was die Ursachen trennt: keine Messung in diesem Arbeitsraum trennt sie sicher" in shown
    assert "vorgeschlagene" not in shown
    assert len(re.findall('<button class="main">Diese Messung planen', shown)) == 1


@pytest.mark.parametrize(("nats", "is_main"), [(0.07, False), (0.5, True)])
def test_what_tells_little_of_what_is_open_is_no_first_step(tmp_path: Path, nats: float, is_main: bool) -> None:
    """The primary button excluded a cause of 1.3 %, and could not tell apart those of 65 and 32 %."""
    folder, data = make_project(tmp_path / "project"), said_of("scale")
    shares = {"scale_error_x": 0.65, "scale_temperature_x": 0.337, "angular_error_x_y": 0.013}
    one = {**data["effects"][0], "aliases": {}}
    alike = [{**one, "kind": name[:-2], "label": name, "conditional_probability": p} for name, p in shares.items()]
    command = "stepgauge plan results/one/separate-1.toml -o results/one/separate-1.dmi"
    run = {"separate_by": f"the gauge along machine y, about (1, 2, 3) mm: {command}", "commands": [command]}
    data["effects"] = [{**one, "set": alike, **run, "expected_information_nats": nats}]
    (folder / "results/one").mkdir(parents=True)
    write_json(folder / "results/one/diagnosis.json", data)
    shown = Asked(folder).get(diagnosis.show)
    assert ('<button class="main">Plan this measurement' in shown) == is_main
    assert ("tells little of what is open" in shown) != is_main


def test_every_proposal_is_german() -> None:
    """Of a run that tells what has no law the page said 'the gauge along the diagonal of x and -y'."""
    places = [f"the gauge along {words}, about (375, 403, 143) mm" for words, _ in _directions()]
    places += ["the gauge end for end in the same position", "the gauge raised on supports to (375, 403, 540) mm"]
    places += ["the gauge shifted to (262, 403, 143) mm", "the same placement at 3 mm/s instead of 9 mm/s"]
    one, two, three = (
        [frozenset({name})] for name in ("scale_error_x", "gauge_temperature", "kinematic_pretravel_varying")
    )
    english = re.compile(r"\b(the|gauge|which|it|from|no|another|and|or|command|varying|about|along|same)\b")
    for words in places:
        run = SimpleNamespace(words=words)
        for excludes, leaves, elsewhere in ((one, [*two, *three], two), ([], [*one, *three], []), (two, three, [])):
            best: Any = design.ProposedRun(run, 1.0, tuple(excludes), tuple(leaves), tuple(elsewhere))  # type: ignore[arg-type]
            said = f"{words}, {design._what_it_separates(best)}: COMMAND{design._what_it_leaves(best)}"
            for text in (said, f"{words}: COMMAND"):
                told = proposal({"separate_by": text, "commands": ["COMMAND"]}, "de")
                assert not english.search(told), told


def test_every_proposal_for_a_map_is_german() -> None:
    words = [one for one, *_ in further_measurements.GRIDS]
    words += ["measure the same directions with a stylus longer by 50 mm", "measure the deflection of the tip too"]
    words += ["load the force gauge with a known weight of about 1 N", "measure the trigger force too"]
    words += ["measure the force that lifts the stylus along its axis"]
    for text in words:
        said = f"{text} (expected information 0.4 of 0.5 nats)"
        for separate, commands in ((said, []), (f"{said}: COMMAND", ["COMMAND"])):
            assert english_words(proposal({"separate_by": separate, "commands": commands}, "de")) == [], text


def test_every_number_and_choice_of_a_finding_has_german_words() -> None:
    """The page said 'lever 60 mm' and 'Vorlauf des Dreipunkttasters varying'."""
    for kind, effect in effect_kinds(every=True).items():
        for one in effect.parameters():
            if one.role in ("linear", "nonlinear", "phase") and symbol(one.name, {"unit": one.unit}, 2) != "size ":
                assert parameter_name(one.name, "de"), (kind, one.name)
            if one.role == "choice":
                choices = get_args(effect.model_fields[one.name].annotation)
                words = [str(word) for word in choices if isinstance(word, str) and len(word) > 2]
                assert [word for word in words if word not in CHOICES] == [], kind
    assert name_of("kinematic_pretravel_varying", language="de") == "Vorlauf des Dreipunkttasters je nach Richtung"


def test_the_same_readings_imported_twice_are_ticked_once(tmp_path: Path) -> None:
    """Both were taken as placements. They are the same in whatever way they came, and another measurement is not."""
    folder = make_project(tmp_path / "project")
    made = measured_twice = one_recording().assign_comments(measured_at="2026-05-04")
    rounded = made.frame.assign(**{name: made.frame[name].round(4) + 0.25 for name in ("x_mm", "y_mm", "z_mm")})
    again = scattered_anew(made.frame, 3)
    for number, (name, frame) in enumerate({"one": made.frame, "shifted": rounded, "anew": again}.items()):
        replace(measured_twice, frame=frame).write(folder / f"recordings/{name}.csv")
        os.utime(folder / f"recordings/{name}.csv", (1000 + number,) * 2)
    site = Site(folder, VERBS, 8420, "token")
    choices = {one.name: one for one in recording_choices(site, ["recordings/one.csv"])}
    copies = {name: one.copy_of for name, one in choices.items()}
    assert copies == {
        "recordings/one.csv": "",
        "recordings/shifted.csv": "recordings/one.csv",
        "recordings/anew.csv": "",
    }
    assert not choices["recordings/shifted.csv"].ticked
    assert choices["recordings/anew.csv"].ticked
    shown = Asked(folder, "de").get(diagnosis.show, recording="recordings/one.csv")
    assert "dieselben Messwerte wie recordings/one.csv" in shown

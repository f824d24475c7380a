"""Pass, fail or undecidable on the page of a result, by the limit that the project or its machine file states."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from starlette.requests import Request
from starlette.responses import Response

import stepgauge as sg
from stepgauge.cli import main
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.recording import join_recordings
from stepgauge.standards.budget_files import StoredGap, StoredLine, read_budget, write_budget
from stepgauge.standards.budget_given import stated_with
from stepgauge.standards.conformity import conformity
from stepgauge.standards.mpe import Mpe
from stepgauge.verbs.catalogue import VERBS
from stepgauge.web.evaluations import placement_files, placement_words, read_evaluation
from stepgauge.web.judgement import STATED_AT, verdict
from stepgauge.web.pages import locate, plan, report, result, sources
from stepgauge.web.pages.result import errors, errors_chart
from stepgauge.web.server import make_app
from stepgauge.web.site import Site, WorkList
from stepgauge.web.texts import Words
from tests.conftest import ROOT
from tests.dcc.made import evaluated, one_recording
from tests.measured import ALONG_X, ALONG_Y, lay, run, shipped
from tests.web.conftest import Asked, make_project

MACHINE = "machine/bridge-cmm.toml"
NOT_RUN = {"number": 1, "is_running": True, "has_failed": False, "seconds": 0.0, "then": "", "words": list}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with one evaluation, from whose folder the server runs."""
    folder = make_project(tmp_path / "project")
    monkeypatch.chdir(folder)
    one_recording().write(folder / "recordings/one.csv")
    evaluate(one_recording(), shipped()[0]).write(folder / "results/evaluation")
    return folder


def limit(folder: Path, text: str) -> None:
    """Stated in the project file."""
    path = folder / "stepgauge.toml"
    path.write_text(f'mpe = "{text}"\n{path.read_text("utf-8")}', "utf-8")


def of_machine(folder: Path, text: str, name: str = "") -> None:
    """Stated in the machine file; ``name``: of another machine."""
    path = folder / MACHINE
    said = path.read_text("utf-8").replace("[machine]\n", f'[machine]\nmpe = "{text}"\n', 1)
    path.write_text(said.replace('name = "', f'name = "{name}', 1), "utf-8")


def test_the_chart_has_the_limit_as_the_data_sheet_gives_it(folder: Path) -> None:
    of_machine(folder, "2.5 + L/300")
    for stated in (False, True):
        if stated:
            limit(folder, "3 + L/100")
        data = json.loads(Asked(folder).get(errors_chart, evaluation="results/evaluation"))["data"]
        above, below = (one for one in data if one.get("name") == "MPE")
        a, b = (3.0, 100.0) if stated else (2.5, 300.0)
        np.testing.assert_allclose(above["y"], a + np.array(above["x"]) / b, rtol=1e-5)
        assert below["y"] == [-one for one in above["y"]]


def smaller(line: StoredLine) -> dict[str, Any]:
    contributions = {name: um / 9 for name, um in line.contributions_um.items()}
    return {"u_um": line.u_um / 9, "expanded_um": line.expanded_um / 9, "contributions_um": contributions}


def budget(folder: Path, gaps: list[str]) -> None:
    """A budget of the evaluation with a U that is small against 30 um."""
    found = evaluated(1)[1]
    sure = [one.model_copy(update=smaller(one)) for one in found.quantities]
    left = [StoredGap(what=gap, state_by="-") for gap in gaps]
    where = folder / f"results/budget-{len(gaps)}"
    where.mkdir()
    given = stated_with(sg.read_gauge(folder / "gauge/step-gauge-420.toml"), sg.read_machine(folder / MACHINE), [])
    write_budget(where, found.model_copy(update={"quantities": sure, "not_included": left, "given": given}))


def page(folder: Path, language: str = "en") -> str:
    app = make_app(Site(folder, VERBS, 1, "-"))
    scope = {
        "type": "http",
        "app": app,
        "headers": [(b"accept-language", language.encode())],
        "query_string": b"evaluation=results/evaluation",
    }
    return bytes(errors(Request({**scope, "method": "GET", "path": "/result/errors"})).body).decode()


@pytest.mark.parametrize(
    ("mpe", "gaps", "word"),
    [("30", [], "Pass"), ("0.01", [], "Fail"), ("0.01", ["probing"], "Undecidable")],
)
def test_the_page_decides_as_the_report_does(folder: Path, mpe: str, gaps: list[str], word: str) -> None:
    limit(folder, mpe)
    budget(folder, gaps)
    shown = page(folder)
    assert f"<p><b>{word}</b></p><p>MPE = ± {mpe} µm" in shown, shown[:900]
    assert ("U lacks: probing" in shown) is bool(gaps)
    judged = conformity(evaluated(1)[0], None, Mpe.parse(mpe))
    assert shown.count("</td></tr>") >= len(judged.faces) > 0
    assert f"<td>{word}</td></tr>" in shown


def test_each_source_that_u_lacks_leads_to_the_field_that_states_it(folder: Path) -> None:
    limit(folder, "30")
    budget(folder, [])
    where = folder / "results/budget-0"
    found = read_budget(where / "budget.json")
    gaps = evaluated(1)[1].not_included
    write_budget(where, found.model_copy(update={"not_included": gaps}))
    lacking = {one.source for one in gaps}
    assert {"probing", "resolution"} <= lacking <= set(STATED_AT)
    shown = page(folder)
    assert [source for source in lacking if f'href="/{STATED_AT[source]}"' not in shown] == []


def test_several_placements_have_one_decision_that_names_the_placement(folder: Path) -> None:
    judged = conformity(evaluated(2)[0], None, Mpe.parse("30"))
    worst = max(judged.faces, key=lambda one: abs(one.error_um) / one.limit_um)
    assert {one.placement for one in judged.faces} == {1, 2}
    assert f"at face {worst.face} of placement {worst.placement}: " in judged.text
    for language, said in (
        ("en", f"{worst.face} of placement {worst.placement}:"),
        ("de", f"in Lage {worst.placement}:"),
    ):
        assert said in verdict(Words(language), judged, False)["lines"][1]


def test_the_sources_of_several_placements_know_how_each_lies(folder: Path) -> None:
    gauge = sg.read_gauge("gauge/step-gauge-420.toml")
    runs = [run(3).recording, run(3, ALONG_X).recording]
    for one, axis, name in zip(runs, (ALONG_Y, ALONG_X), ("", "-2"), strict=True):
        one.write(folder / f"recordings/run{name}.csv")
        turned = {"uncertainty": {"yaw_urad": 20.0, "pitch_urad": 20.0}}
        replace(lay(gauge, axis), details=turned).write(folder / f"placement{name}.toml")
    joined = join_recordings([sg.read_recording(f"recordings/run{name}.csv") for name in ("", "-2")])
    sg.evaluate(joined, gauge).write(folder / "results/both")
    shown = Asked(folder).get(sources.budget, evaluation="results/both")
    assert "<td>the alignment of the gauge</td>" in shown
    assert "alignment" not in shown.partition("Not in it")[2].partition("</p>")[0]


def test_recordings_are_evaluated_together_by_ticking_them(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[list[str]] = []
    monkeypatch.setattr(result, "run_verb", lambda _, words, *__, **___: given.append(words) or Response())
    one_recording().write(folder / "recordings/two.csv")
    earlier = one_recording().assign_comments(measured_at="2026-01-02T10:00:00")
    earlier.write(folder / "recordings/zero.csv")  # written last, measured first
    shown = Asked(folder).get(result.show)
    assert 'type="checkbox" name="recordings" value="recordings/one.csv"' in shown
    assert 'type="checkbox" name="recordings" value="recordings/two.csv"' in shown
    Asked(folder).post(result.evaluate, {"recordings": "recordings/one.csv\nrecordings/two.csv\nrecordings/zero.csv"})
    measured = [f"recordings/{name}.csv" for name in ("zero", "one", "two")]
    assert given == [["evaluate", *measured, "-o", "results/evaluation-zero-and-one-and-two"]]
    assert "none is ticked" in Asked(folder).post(result.evaluate, {})
    assert "one is ticked" in Asked(folder).post(result.evaluate, {"recordings": measured[0], "together": "1"})
    assert "no such file" in Asked(folder).post(result.evaluate, {"recordings": "recordings/three.csv"})


@pytest.mark.parametrize(
    ("language", "said"), [("en", "The largest source is"), ("de", "Der größte Beitrag kommt von")]
)
def test_what_would_decide_is_the_largest_source_with_the_page_where_it_is_made_smaller(
    folder: Path, language: str, said: str
) -> None:
    """More cycles were advised, whatever was the largest."""
    limit(folder, "0.65")
    budget(folder, [])
    shown = page(folder, language)
    assert said in shown
    assert {"en": "the repeatability", "de": "die Wiederholbarkeit"}[language] in shown
    assert 'class="button" data-leads href="/plan#cycles"' in shown


def test_of_two_budgets_the_complete_one_counts(folder: Path) -> None:
    limit(folder, "30")
    budget(folder, ["probing"])
    budget(folder, [])
    assert "<b>Pass</b>" in page(folder)


def test_without_a_budget_nothing_is_decided_and_without_a_limit_nothing_is_said(folder: Path) -> None:
    shown = page(folder)
    assert "No maximum permissible error is stated" in shown
    of_machine(folder, "25")
    shown = page(folder)
    assert "<b>Not decided yet: the uncertainty is missing</b></p><p>MPE = ± 25 µm" in shown
    assert "Undecidable" not in shown
    assert "compute the uncertainty first" in shown
    assert "Compute the uncertainty</button>" in shown
    limit(folder, "30")
    assert "is missing</b></p><p>MPE = ± 30 µm" in page(folder)


def test_the_limit_of_another_machine_and_a_wrong_one_decide_nothing(folder: Path) -> None:
    limit(folder, "nothing")
    shown = page(folder)
    assert "this is no maximum permissible error" in shown
    assert "Range of the mean error XM" in shown
    of_machine(folder, "25", "Another ")
    shown = page(folder)
    assert "Undecidable:" in shown
    assert "not the machine of this recording" in shown


@pytest.mark.parametrize(("mpe", "gaps", "word"), [("30", [], "Pass"), ("30", ["probing"], "Undecidable")])
def test_result_page_and_preview_find_the_same_budget(
    folder: Path, monkeypatch: pytest.MonkeyPatch, mpe: str, gaps: list[str], word: str
) -> None:
    limit(folder, mpe)
    budget(folder, gaps)
    assert f"<b>{word}</b>" in page(folder)
    project = folder / "stepgauge.toml"
    project.write_text(re.sub("^placement = .*$", "", project.read_text("utf-8"), flags=re.M), "utf-8")
    begun: list[list[str]] = []
    monkeypatch.setattr(
        WorkList, "start", lambda _, arguments, then: begun.append(arguments) or SimpleNamespace(**NOT_RUN)
    )
    Asked(folder).post(report.make, {"result": "results/evaluation"})
    (arguments,) = begun
    assert arguments[2:4] == ["--budget", f"results/budget-{len(gaps)}/budget.json"]
    without = [*arguments[:2], "-o", "results/found.html"]
    for one in (arguments, without):
        main(one)
        text = Path(one[-1]).read_text("utf-8")
        assert word.lower() in text.lower()
        assert "uncertainty was not evaluated" not in text
        assert "lacks the uncertainty budget" not in text
    (folder / "results/evaluation/budget.json").write_text("{}")
    assert f"<b>{word}</b>" in page(folder)


def test_a_budget_of_another_measurement_is_not_taken(folder: Path) -> None:
    limit(folder, "30")
    budget(folder, [])
    path = folder / "results/budget-0/budget.json"
    path.write_text(path.read_text("utf-8").replace('"value_um": ', '"value_um": 1'), "utf-8")
    assert "compute the uncertainty first" in page(folder)


def test_another_placement_does_not_replace_that_of_readings_that_were_taken(folder: Path) -> None:
    """The certificate of the first was refused, and its result lost its uncertainty."""
    gauge, site = sg.read_gauge("gauge/step-gauge-420.toml"), Site(folder, VERBS, 8420, "token")
    placed = sg.read_evaluation("results/evaluation", gauge).results[0]
    lay(gauge, placed.axis).write("placement.toml")
    before = (folder / "placement.toml").read_bytes()
    data = read_evaluation(site, "results/evaluation")
    assert placement_files(site, data) == ["placement.toml"]
    points = (ROOT / "examples/demo/points.csv").read_text("utf-8")
    assert "The gauge is located" in Asked(folder).post(locate.locate, {"pasted": points})
    assert (folder / "placement.toml").read_bytes() == before
    assert "Planned for: placement placement-2.toml, axis " in Asked(folder).get(plan.part)
    assert 'placement = "placement-2.toml"' in (folder / "stepgauge.toml").read_text("utf-8")
    assert placement_words(site, "results/evaluation") == ["--placement", "placement.toml"]


def advised(folder: Path, **um: float) -> str:
    """The page where every error has this budget, and the hardest needs U = 0.8 um at most."""
    found = evaluated(1)[1]
    u = float(np.hypot.reduce([*um.values()]))
    lines = [
        one.model_copy(update={"u_um": u, "expanded_um": 2 * u, "k": 2.0, "contributions_um": um})
        for one in found.quantities
    ]
    where = folder / "results/budget-advice"
    where.mkdir(exist_ok=True)
    given = stated_with(sg.read_gauge(folder / "gauge/step-gauge-420.toml"), sg.read_machine(folder / MACHINE), [])
    write_budget(where, found.model_copy(update={"quantities": lines, "not_included": [], "given": given}))
    worst = max(abs(one.error_um) for one in conformity(evaluated(1)[0], None, Mpe.parse("30")).faces)
    limit(folder, f"{worst + 0.8:.6f}")
    return page(folder)


def test_what_is_undecidable_is_led_to_the_largest_contribution_and_how_far_it_must_fall(folder: Path) -> None:
    """It advised more cycles, whatever the budget said."""
    shown = advised(folder, **{"gauge temperature": 0.5, "repeatability": 0.1, "certificate": 0.1})
    assert 'href="/machine#u_gauge_temperature_K"' in shown
    assert "cycles" not in shown.split("verdict")[1].split("</div>")[0]

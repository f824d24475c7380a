"""The uncertainty of a result by source: what no file states is tried with a slider, and stated on demand."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.evaluations import (
    ERRORS,
    EvaluationView,
    placement_files,
    recording_names,
    recordings_and_gauge,
    stored_budget,
)
from stepgauge.web.folder import existing, relative, stamps
from stepgauge.web.forms import Form, asked_form, form_endpoint
from stepgauge.web.judgement import source_name
from stepgauge.web.render import render, run_verb, site_of, words_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.evaluation.face_errors import REffOrigin
    from stepgauge.standards.budget_files import StoredBudget, StoredLine
    from stepgauge.standards.budget_trial import BudgetTrial
    from stepgauge.web.texts import Words


@lru_cache(4)
def _trial(
    recordings: tuple[Path, ...], gauge: str, machine: str, placements: tuple[str, ...], choice: tuple[str, str], _: Any
) -> BudgetTrial:
    import stepgauge as sg
    from stepgauge.montecarlo import ModelOptions
    from stepgauge.recording import read_recording
    from stepgauge.standards.budget_sources import BudgetOptions
    from stepgauge.standards.budget_trial import budget_trial

    steps = sg.read_gauge(gauge)
    lies = tuple(sg.read_placement(one, steps) for one in placements)
    read = [read_recording(one) for one in recordings]
    options = ModelOptions(blocks=choice[0], origin=cast("REffOrigin", choice[1]))
    return budget_trial(read, sg.read_machine(machine), steps, BudgetOptions(lies), options)


def _trial_of(site: Site, shown: EvaluationView) -> BudgetTrial:
    recordings, gauge = recordings_and_gauge(site, shown.name)
    machine = site.stated("machine")
    placements = tuple(str(site.folder / one) for one in placement_files(site, shown.data))
    first, last = shown.data["blocks"]
    choice = f"{first}:{last}", str(shown.data["r_eff_origin"])
    files: list[str | Path] = [*recordings, gauge, machine, *placements]
    return _trial(tuple(recordings), gauge, machine, placements, choice, stamps(*files))


def budget(request: Request) -> Response:
    """The budget of one error at one face, by source, with the values that are tried; nothing is stated by trying."""
    from stepgauge.standards.budget_trial import OPEN_SOURCES

    shown, form = EvaluationView.of(request), asked_form(request)
    trial = _trial_of(site_of(request), shown)
    values = {name: form.number(name, 0.0, OPEN_SOURCES[name].most, 0.0) or 0.0 for name in trial.names}
    tried = trial.replace_values(values)
    line = _line(tried, shown, form)
    words = words_of(request)
    labels = {one.name: source_name(words, one.label) for one in tried.sources}
    shares = sorted(line.contributions_um.items(), key=lambda one: -one[1])
    return render(
        request,
        "result_budget.html.j2",
        line=line,
        title=_title(words, line),
        shares=[(labels[name], um, (um / line.u_um) ** 2 if line.u_um else 0.0) for name, um in shares],
        values={name: u for name, u in values.items() if u > 0.0},
        shown=shown,
        has_budget=stored_budget(site_of(request), shown) is not None,
        missing=[source_name(words, one.what) for one in tried.not_included],
        assumptions=tried.assumptions,
        percent=tried.coverage_percent,
    )


def _title(words: Words, line: StoredLine) -> str:
    """Which error of which face a budget is of."""
    error = words(f"error_name.{line.quantity}")
    position = words.number(line.position_mm, 0)
    return words("result.at_face", error=error, face=line.face, position=position)


def _line(tried: StoredBudget, shown: EvaluationView, form: Form) -> StoredLine:
    from stepgauge.standards.budget_files import farthest

    number = shown.placement["placement"]
    face = form.whole("face", 1, 10_000)
    line = tried.find(shown.error, number, face) if face else farthest(tried, number, shown.error)
    if line is None:
        raise InputError("face", "this error is not defined there", found=face, expected="another face")
    return line


def sliders(request: Request) -> Response:
    """The controls of the budget: what is not stated, each with a slider."""
    from stepgauge.standards.budget_trial import OPEN_SOURCES

    shown = EvaluationView.of(request)
    trial = _trial_of(site_of(request), shown)
    faces = [one["face"] for one in shown.placement["faces"] if one[f"{shown.error}_um"] is not None]
    sources = {name: OPEN_SOURCES[name] for name in trial.names}
    return render(request, "result_sliders.html.j2", shown=shown, sources=sources, faces=faces, errors=ERRORS)


def state(request: Request, form: Form) -> Response:
    """Write the values that were tried into the machine file, and evaluate again with it."""
    from stepgauge.files.text import write_text
    from stepgauge.machine.file import read_machine
    from stepgauge.standards.budget_trial import OPEN_SOURCES, machine_statement
    from stepgauge.web.site import changed

    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    place = existing(site.folder, site.stated("machine"))
    recordings = recording_names(site, name)
    values = {key: form.number(key, 0.0, one.most, 0.0) or 0.0 for key, one in OPEN_SOURCES.items()}
    tables = tomllib.loads(machine_statement(read_machine(place), values))
    text = changed(place, tables)
    with site.writing():
        write_text(place, text)
        read_machine(place)
    return run_verb(request, ["evaluate", *recordings, "-o", name], "/result", evaluation=name)


ROUTES = [
    Route("/result/sliders", sliders),
    Route("/result/budget", budget),
    Route("/result/state", form_endpoint(state), methods=["POST"]),
]

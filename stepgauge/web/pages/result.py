"""Result: errors with their bands, the probings behind a face, earlier runs laid over, and the budget by source."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.folder import existing, inside, listed, relative
from stepgauge.web.forms import Form, asked_form, with_form
from stepgauge.web.judgement import condition_line, decided, source_name, verdict
from stepgauge.web.render import json_answer, render, site_of, words_of
from stepgauge.web.site import Site
from stepgauge.web.stamps import Stamp, stamps

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from stepgauge.recording import Recording
    from stepgauge.standards.budget_files import StoredBudget, StoredLine
    from stepgauge.standards.budget_trial import BudgetTrial
    from stepgauge.web.texts import Words

ERRORS = ("xm", "xf", "xb", "xr")
MOST_OVER = 4
MOST_ROWS = 500
"""Single probings in the table of a face."""
MOST_LISTED = 200
MOST_BUDGETS = 10


def _evaluations(site: Site) -> list[str]:
    """Folders of the project with an ``evaluation.json``, the latest measurement first."""
    found = []
    for path in _files(site, "evaluation.json"):
        try:
            said = json.loads(path.read_text("utf-8"))
            when = str(said.get("measured_at") or "")
        except (OSError, ValueError, AttributeError):
            when = ""
        found.append((when, path.stat().st_mtime, str(path.parent.relative_to(site.folder))))
    return [name for _, _, name in sorted(found, reverse=True)]


def _files(site: Site, name: str) -> list[Path]:
    """Files of this name below the project's folder, nothing hidden and no link that leads out."""
    found = [site.folder / one for one in listed(site.folder, [Path(name).suffix], deep=20) if Path(one).name == name]
    return [path for path in found if path.resolve().is_relative_to(site.folder)][:MOST_LISTED]


def _recordings(site: Site) -> list[str]:
    from stepgauge.project.create import RECORDINGS

    folder = site.folder / RECORDINGS
    there = sorted(folder.glob("*.csv")) + sorted(folder.glob("*.parquet")) if folder.is_dir() else []
    return [str(path.relative_to(site.folder)) for path in there]


def show(request: Request) -> Response:
    """The evaluations that there are, and the one that was chosen; recordings that may be evaluated."""
    site = site_of(request)
    names = _evaluations(site)
    chosen = request.query_params.get("evaluation", "")
    if chosen:
        chosen = relative(site.folder, chosen)
        _place(site, chosen)
    elif names:
        chosen = names[0]
    placements = [one["placement"] for one in _read(site, chosen)["placements"]] if chosen else []
    return render(
        request,
        "result.html.j2",
        names=names,
        chosen=chosen,
        placements=placements,
        errors=ERRORS,
        recordings=_recordings(site),
    )


def _place(site: Site, name: str) -> Path:
    """The file of an evaluation, as one would type it."""
    return existing(site.folder, f"{name}/evaluation.json").relative_to(site.folder)


def _read(site: Site, name: str, with_inputs: bool = True) -> dict[str, Any]:
    """An ``evaluation.json`` of the project, checked."""
    place = _place(site, name)
    return _read_file(str(place), with_inputs, stamps(place, *(_made_from(place) if with_inputs else ())))


@lru_cache(16)
def _read_file(place: str, with_inputs: bool, _: tuple[Stamp, ...]) -> dict[str, Any]:
    from stepgauge.reports.reading import read_checked_evaluation

    return read_checked_evaluation(place, with_inputs)


def _made_from(place: Path) -> list[Path]:
    """The files that it was made from, whatever has become of them."""
    try:
        said = json.loads(place.read_text("utf-8")).get("inputs", [])
    except (ValueError, AttributeError):
        return []
    return [place.parent / str(one["file"]) for one in said if isinstance(one, dict) and "file" in one]


@dataclass(frozen=True)
class Shown:
    """What a request asks to see: an evaluation, a placement of it, and others laid over it."""

    name: str
    data: Mapping[str, Any]
    index: int
    over: tuple[str, ...]
    error: str

    @classmethod
    def of(cls, request: Request) -> Shown:
        """:class:`InputError` for what the project does not have."""
        site, query = site_of(request), request.query_params
        name = relative(site.folder, query.get("evaluation", ""))
        data = _read(site, name)
        over = tuple(relative(site.folder, one) for one in query.getlist("over") if one and one != name)[:MOST_OVER]
        numbers = [str(one["placement"]) for one in data["placements"]]
        asked = query.get("placement") or numbers[0]
        if asked not in numbers:
            raise InputError("placement", "the evaluation does not have it", found=asked, expected=", ".join(numbers))
        error = query.get("error", ERRORS[0])
        if error not in ERRORS:
            raise InputError("error", "not an error of an evaluation", found=error, expected=", ".join(ERRORS))
        return cls(name, data, numbers.index(asked), over, error)

    @property
    def placement(self) -> Mapping[str, Any]:
        """The placement asked for, as ``evaluation.json`` has it."""
        found: Mapping[str, Any] = self.data["placements"][self.index]
        return found

    def query(self) -> str:
        """As an address has it."""
        pairs = [("evaluation", self.name), ("placement", str(self.placement["placement"])), ("error", self.error)]
        return urlencode([*pairs, *(("over", one) for one in self.over)])


def errors(request: Request) -> Response:
    """The decision, main numbers, notes, the chart, and the table of all faces."""
    shown, site, words = Shown.of(request), site_of(request), words_of(request)
    budget = _stored_budget(site, shown)
    judged, why = decided(site, shown.data, budget)
    number = shown.placement["placement"]
    rows = [(row, judged.of(number, row["face"]) if judged else None) for row in shown.placement["faces"]]
    return render(
        request,
        "result_errors.html.j2",
        shown=shown,
        placement=shown.placement,
        gauge=shown.data["gauge"],
        rows=rows,
        judged=judged,
        verdict=verdict(words, judged) if judged else None,
        why=why,
        notes=_notes(shown, words),
        simulated=_is_simulated(shown.data),
        has_budget=budget is not None,
    )


def _notes(shown: Shown, words: Words) -> list[str]:
    """The conditions that are not as they have to be, and the notes that are none of them."""
    from stepgauge.conditions import stored_conditions

    conditions = [one for one in stored_conditions(shown.data) if one.state != "met"]
    known = {one.sentence for one in conditions}
    own = [note for note in shown.placement["notes"] if note not in known]
    return [*(condition_line(words, one) for one in conditions), *own]


def _is_simulated(data: Mapping[str, Any]) -> bool:
    from stepgauge.recording.simulated import is_simulated

    return is_simulated(data["comments"])


def errors_chart(request: Request) -> Response:
    """The errors along the gauge; with others laid over, one error of each and the differences."""
    from stepgauge.figures.error_chart import error_chart, overlay_chart
    from stepgauge.reports.overlay import short_names
    from stepgauge.standards.difference import differences

    shown, site = Shown.of(request), site_of(request)
    if not shown.over:
        return json_answer(request, json.dumps(error_chart(shown.placement, _expanded(site, shown))))
    others = [_read(site, one, with_inputs=False) for one in shown.over]
    found = [
        differences(one, shown.data, (name, shown.name))[shown.index]
        for name, one in zip(shown.over, others, strict=True)
    ]
    placements = [shown.placement, *(one["placements"][shown.index] for one in others)]
    chart = overlay_chart(placements, [None, *found], short_names([shown.name, *shown.over]), shown.error)
    return json_answer(request, json.dumps(chart))


def _expanded(site: Site, shown: Shown) -> NDArray[np.float64] | None:
    """Expanded uncertainty of XM by face from the budget of this evaluation, where the project has it."""
    import numpy as np

    found, number = _stored_budget(site, shown), shown.placement["placement"]
    if found is None:
        return None
    lines = {one.face: one.expanded_um for one in found.quantities if (one.quantity, one.placement) == ("xm", number)}
    return np.array([lines.get(row["face"], np.nan) for row in shown.placement["faces"]])


def _stored_budget(site: Site, shown: Shown) -> StoredBudget | None:
    """The budget of this evaluation that the project has; of several the one that lacks least."""
    from stepgauge.standards.budget_files import check_budget, read_budget

    there = []
    for path in _files(site, "budget.json")[:MOST_BUDGETS]:
        try:
            found = read_budget(path)
            check_budget(found, dict(shown.data), path)
        except InputError:
            continue
        there.append(found)
    return min(there, key=lambda one: len(one.not_included), default=None)


def _inputs(site: Site, name: str) -> tuple[list[Path], str]:
    """The recordings of an evaluation and its gauge; :class:`InputError` where one lies outside of the project."""
    from stepgauge.reports.made_from import gauge_of, recordings_of

    data, place = _read(site, name), _place(site, name)
    recordings = [inside(site.folder, str(one)) for one in recordings_of(data, place)]
    try:
        return recordings, str(gauge_of(data, place))
    except InputError:  # written by a program that said nothing of its gauge; whether it is this one is checked
        return recordings, site.stated("gauge")


@lru_cache(3)
def _probings(place: str, recordings: tuple[Path, ...], gauge: str, _: tuple[Stamp, ...]) -> list[pd.DataFrame]:
    """The error of every single probing, a table per placement."""
    import stepgauge as sg
    from stepgauge.evaluation.probings import probing_errors

    return probing_errors(_joined(recordings), sg.read_evaluation(place, gauge))


def _joined(recordings: Sequence[Path]) -> Recording:
    from stepgauge.recording import join_recordings, read_recording

    tables = [read_recording(one) for one in recordings]
    return tables[0] if len(tables) == 1 else join_recordings(tables)


def _of_face(request: Request) -> tuple[Shown, int, pd.DataFrame]:
    shown, site = Shown.of(request), site_of(request)
    recordings, gauge = _inputs(site, shown.name)
    place = _place(site, shown.name)
    tables = _probings(str(place), tuple(recordings), gauge, stamps(place, *recordings, gauge))
    table = tables[shown.index]
    face = Form(dict(request.query_params), {}).whole("face", 1, 10_000, 1)
    found = table[table["face"] == face]
    if found.empty:
        raise InputError("face", "it was not probed", found=face, expected="one of the measured faces")
    return shown, int(face or 1), found


def probings(request: Request) -> Response:
    """The single probings of a face: a chart and a table."""
    shown, face, table = _of_face(request)
    own = next(one for one in shown.placement["faces"] if one["face"] == face)
    columns = [name for name in ("time_s", "gauge_temperature_C") if name in table]
    rows = table[["cycle", "used", "error_um", "residual_um", *columns]].head(MOST_ROWS).to_dict("records")
    faces = [one["face"] for one in shown.placement["faces"] if one["count"]]
    return render(
        request,
        "result_probings.html.j2",
        shown=shown,
        face=face,
        own=own,
        rows=rows,
        columns=columns,
        total=len(table),
        faces=faces,
    )


def probings_json(request: Request) -> Response:
    """The same as a chart."""
    from stepgauge.figures.error_chart import probings_chart

    _, face, table = _of_face(request)
    cycle, error_um, used = (table[name].to_numpy() for name in ("cycle", "error_um", "used"))
    return json_answer(request, json.dumps(probings_chart(cycle, error_um, used, f"face {face}")))


@lru_cache(4)
def _trial(
    recordings: tuple[Path, ...], gauge: str, machine: str, placement: str, choice: tuple[str, str], _: Any
) -> BudgetTrial:
    import stepgauge as sg
    from stepgauge.montecarlo import ModelOptions
    from stepgauge.standards.budget_sources import BudgetOptions
    from stepgauge.standards.budget_trial import budget_trial

    steps = sg.read_gauge(gauge)
    lies = (sg.read_placement(placement, steps),) if placement else ()
    options = ModelOptions(blocks=choice[0], origin="all" if choice[1] == "all" else "first")
    return budget_trial([_joined(recordings)], sg.read_machine(machine), steps, BudgetOptions(lies), options)


def _trial_of(site: Site, shown: Shown) -> BudgetTrial:
    recordings, gauge = _inputs(site, shown.name)
    machine = site.stated("machine")
    one_placement = len(shown.data["placements"]) == 1 and Path(site.placement).exists()
    placement = site.placement if one_placement else ""
    first, last = shown.data["blocks"]
    choice = f"{first}:{last}", str(shown.data["r_eff_origin"])
    files: list[str | Path] = [*recordings, gauge, machine, *([placement] if placement else [])]
    return _trial(tuple(recordings), gauge, machine, placement, choice, stamps(*files))


def budget(request: Request) -> Response:
    """The budget of one error at one face, by source, with the values that are tried; nothing is stated by trying."""
    from stepgauge.standards.budget_trial import OPEN_SOURCES

    shown, form = Shown.of(request), asked_form(request)
    trial = _trial_of(site_of(request), shown)
    values = {name: form.number(name, 0.0, OPEN_SOURCES[name].most, 0.0) or 0.0 for name in trial.names}
    tried = trial.with_values(values)
    line = _line(tried, shown, form)
    labels = {one.name: one.label for one in tried.sources}
    shares = sorted(line.contributions_um.items(), key=lambda one: -one[1])
    return render(
        request,
        "result_budget.html.j2",
        line=line,
        title=_title(words_of(request), line),
        shares=[(labels[name], um, (um / line.u_um) ** 2 if line.u_um else 0.0) for name, um in shares],
        values={name: u for name, u in values.items() if u > 0.0},
        shown=shown,
        missing=[source_name(words_of(request), one.what) for one in tried.not_included],
        percent=tried.coverage_percent,
    )


def _title(words: Words, line: StoredLine) -> str:
    """Which error of which face a budget is of."""
    error = words(f"error_name.{line.quantity}")
    position = words.number(line.position_mm, 0)
    return words("result.at_face", error=error, face=line.face, position=position)


def _line(tried: StoredBudget, shown: Shown, form: Form) -> StoredLine:
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

    shown = Shown.of(request)
    trial = _trial_of(site_of(request), shown)
    faces = [one["face"] for one in shown.placement["faces"] if one[f"{shown.error}_um"] is not None]
    sources = {name: OPEN_SOURCES[name] for name in trial.names}
    return render(request, "result_sliders.html.j2", shown=shown, sources=sources, faces=faces, errors=ERRORS)


def state(request: Request, form: Form) -> Response:
    """Write the values that were tried into the machine file, and evaluate again with it."""
    import tomllib

    from stepgauge.files.text import write_text
    from stepgauge.machine.file import read_machine
    from stepgauge.standards.budget_trial import OPEN_SOURCES, machine_statement
    from stepgauge.web.project_file import changed

    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    place = existing(site.folder, site.stated("machine"))
    recordings = [relative(site.folder, str(one)) for one in _inputs(site, name)[0]]
    values = {key: form.number(key, 0.0, one.most, 0.0) or 0.0 for key, one in OPEN_SOURCES.items()}
    tables = tomllib.loads(machine_statement(read_machine(place), values))
    text = changed(place, tables)
    with site.writing():
        write_text(place, text)
        read_machine(place)
    then = f"/result?{urlencode({'evaluation': name})}"
    return render(request, "work.html.j2", work=site.works.start(["evaluate", *recordings, "-o", name], then))


def diagnose(request: Request, form: Form) -> Response:
    """``stepgauge diagnose`` of the recordings of an evaluation."""
    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    recordings = [relative(site.folder, str(one)) for one in _inputs(site, name)[0]]
    output = _own_folder(site, "diagnose", "diagnosis", recordings[0])
    work = site.works.start(["diagnose", *recordings, "-o", output], f"/diagnosis?{urlencode({'result': output})}")
    return render(request, "work.html.j2", work=work)


def evaluate(request: Request, form: Form) -> Response:
    """``stepgauge evaluate`` of a recording, into a folder of its own."""
    site = site_of(request)
    recording = relative(site.folder, str(existing(site.folder, form.text("recording"))))
    output = _own_folder(site, "evaluate", "evaluation", recording)
    work = site.works.start(["evaluate", recording, "-o", output], f"/result?{urlencode({'evaluation': output})}")
    return render(request, "work.html.j2", work=work)


def _own_folder(site: Site, verb: str, kind: str, recording: str) -> str:
    """Where the result of a recording goes: the usual folder, or one of its own where that is taken."""
    from stepgauge.project.create import OUTPUTS, RESULTS

    usual = OUTPUTS[verb]
    return f"{RESULTS}/{kind}-{Path(recording).stem}" if (site.folder / usual).exists() else usual


def write_budget(request: Request, form: Form) -> Response:
    """``stepgauge budget`` with the Monte Carlo, of what the files state."""
    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    recordings = [relative(site.folder, str(one)) for one in _inputs(site, name)[0]]
    output = _own_folder(site, "budget", "budget", recordings[0])
    then = f"/result?{urlencode({'evaluation': name})}"
    return render(request, "work.html.j2", work=site.works.start(["budget", *recordings, "-o", output], then))


ROUTES = [
    Route("/result", show),
    Route("/result/errors", errors),
    Route("/result/errors.json", errors_chart),
    Route("/result/probings", probings),
    Route("/result/probings.json", probings_json),
    Route("/result/sliders", sliders),
    Route("/result/budget", budget),
    Route("/result/diagnose", with_form(diagnose), methods=["POST"]),
    Route("/result/state", with_form(state), methods=["POST"]),
    Route("/result/evaluate", with_form(evaluate), methods=["POST"]),
    Route("/result/budget", with_form(write_budget), methods=["POST"]),
]

"""Result: errors with their bands, the probings behind a face, earlier runs laid over."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.evaluations import (
    ERRORS,
    EvaluationView,
    evaluation_choices,
    evaluation_file,
    evaluation_folders,
    placement_words,
    read_evaluation,
    recording_names,
    recordings_and_gauge,
    stored_budget,
)
from stepgauge.web.folder import Stamp, relative, stamps
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.judgement import decided, verdict
from stepgauge.web.recordings import recording_choices, stems, ticked_recordings
from stepgauge.web.render import json_answer, render, run_verb, site_of, words_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from stepgauge.conditions import Conditions
    from stepgauge.web.texts import Words

MOST_ROWS = 500
"""Single probings in the table of a face."""


def show(request: Request) -> Response:
    """The evaluations that there are, and the one that was chosen; recordings that may be evaluated."""
    site = site_of(request)
    names = evaluation_folders(site)
    chosen = request.query_params.get("evaluation", "")
    if chosen:
        chosen = relative(site.folder, chosen)
        evaluation_file(site, chosen)
    elif names:
        chosen = names[0]
    placements, stale = [], None
    try:
        placements = [one["placement"] for one in read_evaluation(site, chosen)["placements"]] if chosen else []
    except InputError as error:
        stale = error
    return render(
        request,
        "result.html.j2",
        names=names,
        chosen=chosen,
        placements=placements,
        stale=stale,
        errors=ERRORS,
        recordings=recording_choices(site),
    )


def errors(request: Request) -> Response:
    """The decision, main numbers, notes, the chart, and the table of all faces."""
    from stepgauge.conditions import stored_conditions

    shown, site, words = EvaluationView.of(request), site_of(request), words_of(request)
    budget = stored_budget(site, shown)
    judged, why = decided(site, shown.data, budget)
    conditions, number = stored_conditions(shown.data), shown.placement["placement"]
    rows = [(row, judged.of(number, row["face"]) if judged else None) for row in shown.placement["faces"]]
    return render(
        request,
        "result_errors.html.j2",
        shown=shown,
        placement=shown.placement,
        gauge=shown.data["gauge"],
        rows=rows,
        judged=judged,
        verdict=verdict(words, judged, budget is not None) if judged else None,
        why=why,
        notes=_notes(conditions, shown, words),
        preventing=" ".join(one.expected for one in conditions.preventing),
        simulated=_is_simulated(shown.data),
        choices=evaluation_choices(site, shown.name),
        has_budget=budget is not None and why is None,
    )


def _notes(conditions: Conditions, shown: EvaluationView, words: Words) -> list[str]:
    """The conditions that are not as they have to be, and the notes that are none of them."""
    met = {one.sentence for one in conditions if one.state == "met"}
    stated = [one.sentence for one in conditions if one.state != "met"]
    notes = [*stated, *(note for note in shown.placement["notes"] if note not in (*met, *stated))]
    return [words.message(note) for note in notes]


def _is_simulated(data: Mapping[str, Any]) -> bool:
    from stepgauge.recording.simulated import is_simulated

    return is_simulated(data["comments"])


def errors_chart(request: Request) -> Response:
    """The errors along the gauge; with others laid over, one error of each and the differences."""
    from stepgauge.figures.error_chart import error_chart, overlay_chart
    from stepgauge.reports.overlay import short_names
    from stepgauge.standards.difference import differences

    shown, site = EvaluationView.of(request), site_of(request)
    if not shown.over:
        return json_answer(request, json.dumps(error_chart(shown.placement, *_u_and_limit(site, shown))))
    others = [read_evaluation(site, one, with_inputs=False) for one in shown.over]
    found = [
        differences(one, shown.data, (name, shown.name))[shown.index]
        for name, one in zip(shown.over, others, strict=True)
    ]
    placements = [shown.placement, *(one["placements"][shown.index] for one in others)]
    chart = overlay_chart(placements, [None, *found], short_names([shown.name, *shown.over]), shown.error)
    return json_answer(request, json.dumps(chart))


def _u_and_limit(site: Site, shown: EvaluationView) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Expanded uncertainty of XM and maximum permissible error by face, where the project states them."""
    budget, number = stored_budget(site, shown), shown.placement["placement"]
    judged, _ = decided(site, shown.data, budget)
    u = (
        {one.face: one.expanded_um for one in budget.quantities if (one.quantity, one.placement) == ("xm", number)}
        if budget
        else {}
    )
    limit: dict[int | None, float] = (
        {} if judged is None else {one.face: one.limit_um for one in judged.faces if one.placement == number}
    )
    return (_face_values(shown, u) if budget else None), (_face_values(shown, limit) if judged else None)


def _face_values(shown: EvaluationView, values: Mapping[int | None, float]) -> NDArray[np.float64]:
    """Values by face of the placement that is shown, NaN where there is none."""
    import numpy as np

    return np.array([values.get(row["face"], np.nan) for row in shown.placement["faces"]], float)


@lru_cache(3)
def _probings(
    place: str, recordings: tuple[Path, ...], gauge: str, machine: str, _: tuple[Stamp, ...]
) -> list[pd.DataFrame]:
    """The error of every single probing, a table per placement."""
    import stepgauge as sg
    from stepgauge.evaluation.probings import probing_errors
    from stepgauge.verbs.inputs import joined_recordings

    joined = joined_recordings(list(map(str, recordings)), machine=sg.read_machine(machine))
    return probing_errors(joined, sg.read_evaluation(place, gauge))


def _requested_face(request: Request) -> tuple[EvaluationView, int, pd.DataFrame]:
    shown, site = EvaluationView.of(request), site_of(request)
    recordings, gauge = recordings_and_gauge(site, shown.name)
    place = evaluation_file(site, shown.name)
    machine = site.stated("machine")
    files = stamps(place, *recordings, gauge, machine)
    tables = _probings(str(place), tuple(recordings), gauge, machine, files)
    table = tables[shown.index]
    face = Form(dict(request.query_params), {}).whole("face", 1, 10_000, 1)
    found = table[table["face"] == face]
    if found.empty:
        raise InputError("face", "it was not probed", found=face, expected="one of the measured faces")
    return shown, int(face or 1), found


def probings(request: Request) -> Response:
    """The single probings of a face: a chart and a table."""
    shown, face, table = _requested_face(request)
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

    _, face, table = _requested_face(request)
    cycle, error_um, used = (table[name].to_numpy() for name in ("cycle", "error_um", "used"))
    return json_answer(request, json.dumps(probings_chart(cycle, error_um, used, f"face {face}")))


def evaluate(request: Request, form: Form) -> Response:
    """``stepgauge evaluate`` of recordings, several as placements with one decision, into a folder of its own."""
    site = site_of(request)
    recordings = ticked_recordings(site, form)
    if form.has("together") and len(recordings) == 1:
        raise InputError("recordings", "one is ticked", expected="two or more")
    output = _own_folder(site, "evaluate", "evaluation", recordings)
    return run_verb(request, ["evaluate", *recordings, "-o", output], "/result", evaluation=output)


def evaluate_again(request: Request, form: Form) -> Response:
    """``stepgauge evaluate`` of the recordings of an evaluation, whose files have changed since, into its folder."""
    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    recordings = recording_names(site, name, with_inputs=False)
    return run_verb(request, ["evaluate", *recordings, "-o", name], "/result", evaluation=name)


def _own_folder(site: Site, verb: str, kind: str, recordings: Sequence[str]) -> str:
    """Where the result of recordings goes: the usual folder, or one that names them where that is taken."""
    from stepgauge.project.create import OUTPUTS, RESULTS

    usual = OUTPUTS[verb]
    return f"{RESULTS}/{kind}-{stems(recordings)}" if (site.folder / usual).exists() else usual


def write_budget(request: Request, form: Form) -> Response:
    """``stepgauge budget`` with the Monte Carlo, of what the files state."""
    site = site_of(request)
    name = relative(site.folder, form.text("evaluation"))
    recordings = recording_names(site, name)
    output = _own_folder(site, "budget", "budget", recordings)
    lies = placement_words(site, name)
    return run_verb(request, ["budget", *recordings, *lies, "-o", output], "/result", evaluation=name)


ROUTES = [
    Route("/result", show),
    Route("/result/errors", errors),
    Route("/result/errors.json", errors_chart),
    Route("/result/probings", probings),
    Route("/result/probings.json", probings_json),
    Route("/result/evaluate", form_endpoint(evaluate), methods=["POST"]),
    Route("/result/again", form_endpoint(evaluate_again), methods=["POST"]),
    Route("/result/budget", form_endpoint(write_budget), methods=["POST"]),
]

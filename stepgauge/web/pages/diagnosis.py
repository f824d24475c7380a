"""Diagnosis: residuals against any covariate, findings off and on, rivals with their odds, and what to measure next."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.folder import existing, free_name, inside, listed, relative
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.recordings import proposed_runs, recording_choices, stems, ticked_recordings
from stepgauge.web.render import json_answer, render, run_verb, site_of, words_of
from stepgauge.web.site import Site
from stepgauge.web.texts import Words

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.diagnosis.wording.findings import Subject

FILE, ROWS = "diagnosis.json", "residuals.csv"
NOT_COVARIATES = {"placement", "time_s", "approach_i", "approach_j", "approach_k"}
"""Columns of a recording that the table of residuals has, or that say nothing alone."""
LEAST_SHOWN = 0.001
"""Probability from which combinations of other causes are listed."""
COMMAND = re.compile(r"stepgauge plan [^;|&<>\n]+")


def folders(site: Site) -> list[str]:
    """Folders with a diagnosis, newest first."""
    return [str(Path(one).parent) for one in listed(site.folder, [".json"]) if Path(one).name == FILE]


def show(request: Request) -> Response:
    """The newest diagnosis, or the one that was asked for, and the form for another."""
    site = site_of(request)
    known = folders(site)
    name = relative(site.folder, request.query_params.get("result") or (known[0] if known else "."))
    told, stale = None, None
    try:
        told = _told(site, name, words_of(request)) if (site.folder / name / FILE).is_file() else None
    except InputError as error:  # another one can be chosen, or made
        stale = error
    asked = request.query_params.get("recording", "")
    choices = recording_choices(site, [relative(site.folder, str(existing(site.folder, asked)))] if asked else ())
    content: dict[str, Any] = {"name": name, "told": told, "known": known, "choices": choices, "stale": stale}
    return render(request, "diagnosis.html.j2", **content, is_new=bool(asked) or told is None)


def _told(site: Site, name: str, words: Words) -> dict[str, Any]:
    """What the page says of a diagnosis, from its file."""
    from stepgauge.diagnosis.wording.findings import subject
    from stepgauge.diagnosis.wording.headline import headline
    from stepgauge.diagnosis.wording.limits import warnings
    from stepgauge.reports.diagnosis import read_said
    from stepgauge.reports.first_steps import do_first, nats, tells_enough

    said, _ = read_said(existing(site.folder, name))
    of_map = "map" in said["inputs"]
    unit = next((key.removeprefix("noise_") for key in said["fit"] if key.startswith("noise_")), "")
    effects = [_finding(number, effect, subject(said), words) for number, effect in enumerate(said["effects"], 1)]
    proposed = proposed_runs(said)
    steps = do_first(said, words.language)["blocks"]
    return {
        "summary": headline({**said, "effects": [_likely_only(one) for one in said["effects"]]}, words.language),
        "warnings": warnings(said, words.language),
        "made_from": _made_from(said, words),
        "verdict": said["verdict"],
        "unit": "σ" if of_map else unit,  # of a map, whose quantities have several
        "effects": effects,
        "structure": _structure(said, words),
        "of_map": of_map,
        "runs": sorted(proposed, key=lambda number: -nats(proposed[number])),
        "little": [number for number, one in proposed.items() if not tells_enough(one)],
        "steps": [block for block in steps if block["kind"] != "code"],
    }


def _made_from(said: Mapping[str, Any], words: Words) -> list[str]:
    """The recordings of a diagnosis, each with the placement that it is there, as the figure counts them."""
    names = [str(one["path"]) for one in said["inputs"].get("recordings", ())]
    numbers = [one["placement"] for one in said.get("measured", {}).get("placements", ())]
    if len(names) != len(numbers):
        return names
    return [f"{words('diagnosis.placement')} {number}: {name}" for number, name in zip(numbers, names, strict=True)]


def _structure(said: Mapping[str, Any], words: Words) -> dict[str, Any] | None:
    """What tells of structure without a law what it is: one run, whichever form it has."""
    from stepgauge.reports.first_steps import proposal

    of_structure = [(n, one) for n, one in proposed_runs(said).items() if n > len(said["effects"])]
    return next(({"number": n, "next": proposal(one, words.language)} for n, one in of_structure), None)


def _likely_only(effect: Mapping[str, Any]) -> Mapping[str, Any]:
    """Without combinations of causes in its place that are as good as excluded: the verdict names the others."""
    from stepgauge.diagnosis.wording.notation import members_of
    from stepgauge.reports.findings import combinations

    if combinations(effect)[1] >= LEAST_SHOWN:
        return effect
    known = {one["kind"] for one in members_of(effect)}
    return {**effect, "several": [], "confounded_with": [one for one in effect["confounded_with"] if one in known]}


def _finding(number: int, effect: Mapping[str, Any], at: Subject, words: Words) -> dict[str, Any]:
    from stepgauge.diagnosis.wording.notation import members_of
    from stepgauge.reports.findings import combinations
    from stepgauge.reports.first_steps import proposal

    members = members_of(effect)
    first = max(one["conditional_probability"] or 0.0 for one in members) or 1.0
    together, p = combinations(effect, words.language)
    return {
        "number": number,
        "kind": effect["kind"],
        "probability": effect["probability"],
        "rivals": [_rival(one, effect["probability"], first, at, words) for one in members],
        "together": {"names": together, "probability": p} if together and p >= LEAST_SHOWN else None,
        "next": proposal(effect, words.language),
        "can_plan": bool(effect["commands"]),
    }


def _rival(one: Mapping[str, Any], probability: float, first: float, at: Subject, words: Words) -> dict[str, Any]:
    """A cause of a finding; of several laws that stand together the probability is not known."""
    from stepgauge.diagnosis.wording.findings import meaning, name_of, remedy
    from stepgauge.diagnosis.wording.notation import odds_text
    from stepgauge.reports.findings import uncertainties, values

    share = one["conditional_probability"]
    return {
        "kind": one["kind"],
        "name": name_of(one["label"], at.of, words.language),
        "values": [words.decimal(text) for text in _uncertainty_lines(values(one, words.language), uncertainties(one))],
        "probability": None if share is None else share * probability,
        "odds": "" if share is None or share == first else odds_text(share / first, words.language),
        "means": meaning(one, at, words.language),
        "repair": remedy(one, at, words.language).repair,
    }


def _uncertainty_lines(values: str, uncertainties: str) -> list[str]:
    """A line for each number, with its standard uncertainty."""
    pairs = zip(values.split("\n"), uncertainties.split("\n"), strict=True)
    return [f"{one}, u = {its}" if its else one for one, its in pairs if one]


def scene(request: Request) -> Response:
    """Residuals, covariates and what each finding adds, as JSON."""
    site = site_of(request)
    folder = existing(site.folder, request.query_params.get("result", ""))
    stamps = tuple((folder / name).stat().st_mtime_ns for name in (FILE, ROWS) if (folder / name).exists())
    return json_answer(request, _scene(folder, site.folder, stamps))


@lru_cache(maxsize=2)
def _scene(folder: Path, root: Path, _stamps: tuple[int, ...]) -> str:
    """Kept for the diagnosis that is being looked at; anew when its files change."""
    from stepgauge.diagnosis.output.rows import read_rows
    from stepgauge.reports.diagnosis import diagnosis_story, read_said
    from stepgauge.reports.interactive import diagnosis_scene

    said, place = read_said(folder)
    rows = read_rows(place)
    return json.dumps(diagnosis_scene(said, diagnosis_story(said), rows, _covariates(said, root, len(rows))))


def _covariates(said: dict[str, Any], root: Path, count: int) -> pd.DataFrame | None:
    """Numeric columns of the recordings that the table of residuals lacks; None where these are not as they were."""
    import pandas as pd

    from stepgauge.recording import read_recording

    if "gauge" not in said["inputs"]:
        return None
    try:
        paths = [inside(root, one["path"]) for one in said["inputs"]["recordings"]]
        frame = pd.concat([read_recording(path).frame for path in paths], ignore_index=True)
    except InputError:
        return None
    if len(frame) != count:
        return None
    numbers = frame.select_dtypes("number")
    wanted = [name for name in numbers if name not in NOT_COVARIATES and numbers[name].nunique() > 1]
    return numbers[wanted].rename(columns={name: _spoken(str(name)) for name in wanted})


def _spoken(column: str) -> str:
    """``scale_temperature_x_C`` as ``scale temperature x (°C)``."""
    units = {"mm": "mm", "C": "°C", "s": "s", "um": "µm", "deg": "°", "N": "N"}
    words = column.replace("mm_s", "mm/s").split("_")
    unit = words[-1] if words[-1] == "mm/s" else units.get(words[-1], "")
    return f"{' '.join(words[:-1])} ({unit})" if unit else " ".join(words)


def diagnose(request: Request, form: Form) -> Response:
    """``stepgauge diagnose`` of the ticked recordings as placements of one machine."""
    site = site_of(request)
    files = ticked_recordings(site, form)
    folder = f"results/diagnosis-{stems(files)}"
    return _run(request, site, files, folder, [])


def without(request: Request, form: Form) -> Response:
    """The same diagnosis, without a cause that somebody has excluded."""
    from stepgauge.diagnosis.wording.notation import members_of
    from stepgauge.reports.diagnosis import read_said

    site = site_of(request)
    said, place = read_said(existing(site.folder, form.text("result")))
    if "map" in said["inputs"]:
        raise InputError("result", "of a probe's map no cause can be left out")
    kinds = {one["kind"] for effect in said["effects"] for one in members_of(effect)}
    if form.text("kind") not in kinds:
        raise InputError("kind", "is no finding of this diagnosis", found=form.text("kind"))
    files = [relative(site.folder, one["path"]) for one in said["inputs"]["recordings"]]
    before = _excluded(place)
    kinds_out = sorted({*before, form.text("kind")})
    stem = re.sub(r"-without-.*", "", relative(site.folder, form.text("result")))
    folder = f"{stem}-without-{'-'.join(kinds_out)}"
    arguments = [word for kind in kinds_out for word in ("--without", kind)]
    return _run(request, site, files, folder, arguments)


def _excluded(place: Path) -> list[str]:
    """What was excluded already: it stands in the name of the folder."""
    from stepgauge.effects import effect_kinds

    _, found, names = place.name.partition("-without-")
    return [kind for kind in effect_kinds(every=True) if found and kind in names.split("-")]


def _run(request: Request, site: Site, files: list[str], folder: str, more: list[str]) -> Response:
    if (site.folder / folder / FILE).exists() and not more:
        folder = relative(site.folder, str(free_name(site.folder, folder)))
    arguments = ["diagnose", *files, *more, "-o", relative(site.folder, folder)]
    return run_verb(request, arguments, "/diagnosis", result=folder)


def plan_next(request: Request, form: Form) -> Response:
    """Plan the measurement that tells rivals apart: the command that the diagnosis itself states."""
    from stepgauge.programs import DIALECTS
    from stepgauge.reports.diagnosis import read_said

    suffixes = tuple({one.suffix for one in DIALECTS.values()})
    site, number = site_of(request), form.whole("finding", 1, 1000, 1) or 1
    said, _ = read_said(existing(site.folder, form.text("result")))
    proposing = proposed_runs(said)
    if number not in proposing:
        raise InputError("finding", "states no measurement", found=number)
    command = proposing[number]["commands"][0]
    words = shlex.split(command)
    if not COMMAND.fullmatch(command) or not words[-1].endswith(suffixes):
        raise InputError(FILE, "states a command that is none of ours", found=command)
    for word in words[2:]:
        if "/" in word or word.endswith((".toml", *suffixes)):
            inside(site.folder, word)
    program = relative(site.folder, words[-1])
    return run_verb(request, words[1:], "/diagnosis/planned", program=program, placement=words[2])


def planned(request: Request) -> Response:
    """The measurement that was planned: how the gauge is laid for it, and what is done then."""
    import stepgauge as sg

    site, query = site_of(request), request.query_params
    placement, program = (relative(site.folder, query.get(name, "")) for name in ("placement", "program"))
    lies = sg.read_placement(placement, site.stated("gauge"))
    ends = [("C1", lies.c1_mm.tolist()), ("C2", lies.c2_mm.tolist())]
    return render(request, "planned.html.j2", placement=placement, program=program, ends=ends, lies=lies)


ROUTES = [
    Route("/diagnosis", show),
    Route("/diagnosis", form_endpoint(diagnose), methods=["POST"]),
    Route("/diagnosis/scene.json", scene),
    Route("/diagnosis/without", form_endpoint(without), methods=["POST"]),
    Route("/diagnosis/planned", planned),
    Route("/diagnosis/next", form_endpoint(plan_next), methods=["POST"]),
]

"""The story of an investigation as a page: the answer, every run with its reason and what it told, what is missing."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.notation import percent, plus_minus
from stepgauge.files.notation import counted, significant
from stepgauge.files.text import read_result, result_file
from stepgauge.recording.simulated import SIMULATED_WARNING
from stepgauge.reports.blocks import Block, bullets, heading, part, table, words
from stepgauge.reports.diagnosis import STORY

Said = Mapping[str, Any]
HOW = {
    "cause": "The cause is named",
    "set": "One of a set: what was within reach does not tell its members apart",
    "adequate": "Nothing was found: the machine file explains what was measured",
    "unknown": "There is a structure that no known effect has",
    "insufficient": "The readings are too few to tell",
}
VERDICTS = {"cause": "effects", "set": "effects"}


def investigation_story(said: Said) -> dict[str, Any]:
    """The content of a page on an investigation; ``said``: content of an ``investigation.json``."""
    return {
        "layout": STORY,
        "title": f"Investigation: {said['machine']} with {said['gauge']['name']}",
        "verdict": VERDICTS.get(said["end"]["how"], said["end"]["how"]),
        "summary": sentence(said),
        "warnings": list(_warnings(said)),
        "example": bool(said["gauge"]["example"]),
        "parts": [
            part("The answer", *_answer(said)),
            part("What was asked, why, and what was learnt", *_asked(said)),
        ],
        "data": {"name": "investigation.json", "text": json.dumps(said, indent=1, ensure_ascii=False)},
        "version": said["stepgauge"],
        "own": [said["machine"], said["gauge"]["name"]],
    }


def _warnings(said: Said) -> Iterator[str]:
    if said["simulated"]:
        yield SIMULATED_WARNING
    if not said["end"]["stands"]:
        yield _open(said)


def read_story(path: str | Path) -> dict[str, Any]:
    """The page of the folder of an investigation, or of its ``investigation.json``."""
    return investigation_story(read_result(result_file(path, "investigation.json"), "investigation", with_inputs=False))


def sentence(said: Said) -> str:
    """How it ended, in a line."""
    end, last = said["end"], said["runs"][-1]["learnt"]
    found = ", ".join(_named(one) for one in last["found"])
    count, minutes = len(said["runs"]), significant(said["minutes"])
    spent = f"{counted(count, 'run')}, {minutes} min, {significant(said['machine_minutes'])} of them on the machine"
    return f"{HOW[end['how']]}{': ' + found if found else ''} ({end['why']}; {spent})"


def _named(one: Said) -> str:
    rivals = f" (or {', '.join(name_of(kind) for kind in one['set'])})" if one["set"] else ""
    return f"{one['label'].replace('_', ' ')}{rivals}"


def _open(said: Said) -> str:
    odds = f"{said['asked']['odds']:g} to 1"
    return f"The answer does not have the odds of {odds} that were asked for: {said['end']['why']}."


def _answer(said: Said) -> Iterator[Block]:
    last = said["runs"][-1]["learnt"]
    if not (last["found"] or last["unexplained"]):
        yield words(f"{HOW[said['end']['how']]}.")
    if last["found"]:
        rows = [
            (_named(one), _values(one["parameters"]), percent(one["own_probability"]), percent(one["probability"]))
            for one in last["found"]
        ]
        yield table(("effect", "values (k = 2)", "probability", "with its set"), rows, (0.0, 1.0, 0.0, 0.0))
    if last.get("matters_um"):
        yield words(f"Beside it, what displaces no reading by {significant(last['matters_um'])} um was not looked for.")
    if last["unexplained"]:
        yield bullets(last["unexplained"], "Without a known cause:")
    if said["needed"]:
        yield bullets(said["needed"], "What would tell more, and was not to be had:")
    if said["declined"]:
        yield bullets(said["declined"], "Declined:")


def _values(parameters: Said) -> str:
    """Parameters with their uncertainties; one that is called by its unit needs no name."""
    return "; ".join(f"{name.rpartition('_')[0]} {plus_minus(one)}".strip() for name, one in parameters.items())


def _asked(said: Said) -> Iterator[Block]:
    rows = [_row(run) for run in said["runs"]]
    columns = ("run", "minutes", "verdict", "most probable after it", "open")
    note = "open: what is not known about which hypothesis holds (their entropy)"
    yield table(columns, rows, (1.0, 0.0, 0.0, 1.0, 0.0), note=note)
    if len(said.get("styli", ())) > 1:
        own = "Nothing was taken to be known of the effective radius of a stylus but the first"
        yield bullets(said["styli"], f"The styli that were at hand. {own}:")
    for run in said["runs"]:
        yield heading(f"Run {run['number']}: {run['words']}")
        yield words(_why(run["why"]) if run["why"] else "The first run: how the gauge lay.")
        yield words(f"After it: {run['learnt']['summary']}.")
        if run["learnt"]["hypotheses"]:
            yield bullets([f"{_words(one)}: {percent(one['probability'])}" for one in run["learnt"]["hypotheses"]])


def _row(run: Said) -> Sequence[str]:
    learnt = run["learnt"]
    first = learnt["hypotheses"][0] if learnt["hypotheses"] else None
    lead = "" if first is None else f"{_words(first)}, {percent(first['probability'])}"
    left = "" if learnt["entropy_nats"] is None else f"{significant(learnt['entropy_nats'])} nats"
    return f"{run['number']}: {run['words']}", significant(run["minutes"]), learnt["verdict"], lead, left


def _words(one: Said) -> str:
    return str(one["words"]).replace("_", " ")


def _why(why: Said) -> str:
    """Why this run and no other, in words."""
    told = [f"expected to tell {significant(why['nats'])} nats in {significant(why['minutes'])} min, most per minute"]
    if why["tells_apart"]:
        told.append(f"it tells the leading answer from {', '.join(why['tells_apart']).replace('_', ' ')}")
    if why["may_show"] and why["chance_hidden"] > 0.0:
        kinds = ", ".join(name_of(kind) for kind in why["may_show"])
        told.append(f"with a chance of {percent(why['chance_hidden'])} it shows what was hidden so far ({kinds})")
    return f"Chosen because: {'; '.join(told)}."

"""Blocks that the page of any diagnosis has: probabilities, the predictive check, findings in full, the search."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stepgauge.diagnosis.wording.catalogue import say
from stepgauge.diagnosis.wording.findings import meaning, name_of, subject
from stepgauge.diagnosis.wording.headline import possible_name
from stepgauge.diagnosis.wording.notation import percent, plus_minus, probability, symbol
from stepgauge.diagnosis.wording.phrases import structure_words
from stepgauge.reports.blocks import Block, heading, table, words

Said = Mapping[str, Any]


def odds_blocks(said: Said) -> Iterator[Block]:
    """Probabilities of all statements."""
    odds = said["probabilities"]
    if not odds:
        return
    rows = [["nothing beyond the scatter", probability(odds["adequate"])]]
    rows += [
        [_statement(one), probability(one["probability"])] for one in odds["statements"] if not one["includes_set"]
    ]
    rows += [[f"{possible_name(one)} (not stated)", probability(one["probability"])] for one in odds["possible"]]
    rows += [[say(f"scatter_{name}"), probability(p)] for name, p in odds["scatter"].items() if p >= 0.01]
    yield heading("Probabilities")
    yield words(
        "Averaged over all hypotheses that were computed, weighted by their probability; the assumptions are"
        " in the priors."
    )
    yield table(("statement", "probability"), rows, (0.0, 0.0))


def _statement(one: Said) -> str:
    if "kind" not in one:
        return f"{one['form']} in {one['covariate']}"
    choices = [str(p["value"]) for p in one["parameters"].values() if isinstance(p["value"], str)]
    return ", ".join([name_of(one["kind"]), *(choices if one["kind"] != "outliers" else [])])


def check_blocks(said: Said) -> Iterator[Block]:
    """The posterior predictive check."""
    if not said["checks"]:
        return
    yield heading("Posterior predictive check")
    yield words(
        "Residuals compared with the scatter of the stated hypothesis; the deviation is in standard deviations of each"
        " statistic."
    )
    rows = [
        [one["check"], f"{one['deviation']:.1f}", "passes" if one["passed"] else "fails", one["words"]]
        for one in said["checks"]
    ]
    yield table(("part", "deviation", "", "what was found"), rows)


def located_row(one: Said, said: Said, language: str, *faces: str) -> list[str]:
    """A form of the residuals: covariate, the faces it is on where that is told, words, share and probability."""
    p = one.get("probability", one.get("probability_if_alone"))
    where = structure_words(one, subject(said), language)
    return [one["covariate"], *faces, where, percent(one["share"]), probability(p)]


def trail_blocks(said: Said, language: str) -> Iterator[Block]:
    """The steps of the search."""
    yield heading("Steps of the search")
    if said["trail"]:
        rows = [
            [step["action"], _step_words(step["effect"], language), f"{step['log10_odds']:.1f}"]
            for step in said["trail"]
        ]
        yield table(("step", "hypothesis", "log10 of the odds against the one before"), rows, (0.0, 1.0, 0.0))
    elif said["verdict"] == "insufficient" and not said["probabilities"]:
        yield words("No search was made: the noise is not known well enough to test any effect.")
    else:
        yield words("No hypothesis is more probable than scatter alone.")


def _step_words(labels: str, language: str) -> str:
    """Laws by their names; what is exchanged has the label ``a for b``."""
    one, *other = [name_of(label, language=language) for label in labels.split(" for ")]
    return say("instead", language, one=one, other=other[0]) if other else one


def recording_files(said: Said) -> Iterator[str]:
    """The recordings, with the beginning of their checksums."""
    for one in said["inputs"]["recordings"]:
        yield f"recording {one['path']}" + (f", sha256 {one['sha256'][:16]}…" if one["sha256"] else "")


def set_table(effect: Said, said: Said, language: str = "en") -> Iterator[Block]:
    """The causes that would each explain a finding alone, with their values; none where it is alone."""
    if not effect["set"]:
        return
    at = subject(said)
    yield words("Each of these causes alone would explain it; the stated one first, then by probability.")
    rows = [
        [
            *(name_of(one["label"], at.of, language), percent(one["conditional_probability"])),
            *("; ".join(numbers(one)), one["meaning"] if language == "en" else meaning(one, at, language)),
        ]
        for one in effect["set"]
    ]
    yield table(("cause", "probability in the set", "value (k = 2)", "what it would mean"), rows, (0.0, 0.0, 1.0, 2.0))


def numbers(one: Said) -> list[str]:
    """The numbers of a finding, or of one of its set: ``ppm = 2.27 ± 0.47 um/m``."""
    known = [(name, p) for name, p in one["parameters"].items() if "unit" in p and p["unit"] != "count"]
    return [f"{symbol(name, p, 2)}= {plus_minus(p)}" for name, p in known]

"""The verdict in a sentence and in a line, and the numbers of the findings, from what a ``diagnosis.json`` states."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from stepgauge.diagnosis.result import NUMBERS
from stepgauge.diagnosis.wording.aliases import periods_of
from stepgauge.diagnosis.wording.notation import (
    counted,
    in_place,
    listed,
    name_of,
    probability,
    scatter_ratio,
    significant,
)

Said = Mapping[str, Any]
MODELS = {"gauge": ("recording", "simulation"), "axis": ("recording", "targets"), "map": ("map", "probe file")}
"""What was diagnosed, and what it was compared with."""
LIKELY = 0.5
"""Probability of all findings together from which they are said to explain what was measured."""
IN_PLACE = ", or in its place "
IN_LINE = 4
"""Aliases of a period that a line names; usual ones are first."""
NO_CHOICE = ("start_s", "pause_s", "about_mm")
"""Parameters of the computation that are not part of the name of a law."""
REPEATABILITY = "repeatability"


def subject(said: Said) -> str:
    """What was diagnosed: a recording of a ``gauge``, of an ``axis`` without one, or the ``map`` of a probe."""
    return "axis" if "axis" in said else "map" if "map" in said["inputs"] else "gauge"


def headline(said: Said) -> str:
    """The verdict in some sentences; a scatter that is not the stated one comes first."""
    what, model = MODELS[subject(said)]
    if subject(said) == "axis" and said["axis"]["form"] != "axis":
        model = "model"
    verdict, odds = said["verdict"], said["odds"]
    scatter, named = list(_scatter(said)), _numbered([_named(one, said) for one in _systematic(said)])
    if verdict == "adequate":
        sure = f" (probability {probability(odds['adequate'])})" if odds else ""
        return f"The {what} agrees with the {model} within the scatter{sure}. Nothing needs to be added to the model."
    if verdict == "insufficient":
        return f"The {what} cannot tell whether the {model} is right.{_possible(said)}"
    if verdict == "effects":
        text = [*scatter, *(_explained(what, model, named, odds) if named else ["Nothing systematic is beside it."])]
        return " ".join(text)
    text = [*scatter, f"The {what} disagrees with the {model} in a way that no known effect explains."]
    text.append(f"Its form: {said['unexplained'][0]['where']}{_or_laws(said)}.")
    return " ".join([*text, *([f"A part is explained: {named}."] if named else [])])


def _explained(what: str, model: str, named: str, odds: Said) -> Iterator[str]:
    if odds.get("explained", 1.0) >= LIKELY:
        yield f"The {what} disagrees with the {model}, and known physics explains it: {named}."
    else:
        yield f"The {what} disagrees with the {model}. Each of these is likelier than not, not all of them: {named}."


def _scatter(said: Said) -> Iterator[str]:
    """The sentence about a scatter that is not the stated one."""
    for one in said["effects"]:
        if one["kind"] == REPEATABILITY:
            yield f"{_ratio(one)}."


def _ratio(effect: Said) -> str:
    return scatter_ratio(*(effect["parameters"][name]["value"] for name in ("repeatability_um", "stated_um")))


def _systematic(said: Said) -> list[Said]:
    return [one for one in said["effects"] if one["kind"] != REPEATABILITY]


def _or_laws(said: Said) -> str:
    """Laws that the readings do not exclude in the place of the first structure."""
    first = said["unexplained"][0]
    if not first.get("separate_by"):
        return ""
    law = first["laws"][0]
    together = " together" if len(law["labels"]) > 1 else ""
    names, odds = listed([name_of(label) for label in law["labels"]]), significant(1.0 / law["odds"], 2)
    return f"; or {names}{together}, at odds of 1 to {odds}, which these readings do not exclude"


def _possible(said: Said) -> str:
    """What is as likely as anything where nothing is likelier than not."""
    if not said["odds"]:
        return ""
    words = [f"nothing at all has a probability of {probability(said['odds']['adequate'])}"]
    for one in said["odds"].get("possible", ()):
        name = name_of(one["label"]) if "label" in one else f"structure in {one['covariate']}"
        words.append(f"{name} {probability(one['probability'])}")
    return f" No statement is likelier than not: {', '.join(words)}."


def _numbered(named: Sequence[str]) -> str:
    """Findings with the numbers that they have on the page, where one has others in its place; else a plain list."""
    if len(named) < 2 or not any(IN_PLACE in one for one in named):
        return listed(counted(named))
    return "; ".join(f"{number}: {one}" for number, one in enumerate(named, 1))


def _named(effect: Said, said: Said) -> str:
    """An effect with its choices or its period, and its alternatives."""
    if subject(said) == "axis":
        return _at_axis(effect, said["axis"]["form"])
    choices = [str(value) for value in chosen(effect) if not isinstance(value, list)]
    name = " ".join([name_of(effect["kind"]), *(choices and [f"({', '.join(choices)})"])])
    if subject(said) == "map":
        name = name_of(effect["label"])
    others = in_place_of(effect) + [name_of(label) for label in effect["alternatives"]]
    return f"{name}{IN_PLACE}{listed(others, 'or')}" if others else name


def in_place_of(effect: Said) -> list[str]:
    """What may be in place of an effect, in words."""
    return in_place(effect["confounded_with"], [one["labels"] for one in effect.get("several", ())])


def chosen(effect: Said) -> list[Any]:
    """Choices that distinguish an effect from others of its kind: axis, plane, face, direction; no times."""
    parameters = effect["parameters"].items()
    return [p["value"] for name, p in parameters if "unit" not in p and name not in ("rows", *NO_CHOICE)]


def _at_axis(effect: Said, form: str) -> str:
    """An effect of an axis with the others that may be in its place."""
    from stepgauge.diagnosis.wording.axis import kind_name

    others = [kind_name(kind, form) for kind in effect["confounded_with"]]
    name = f"{effect['name']}{_period_of(effect)}"
    return f"{name} (or {listed(others, 'or')})" if others else name


def _period_of(effect: Said) -> str:
    """The period of an effect with its aliases, where it has any: they are all that is known of it."""
    others, unit = periods_of(effect.get("aliases", {}))
    if not others:
        return ""
    own = next(one for name, one in effect["parameters"].items() if name.startswith("period"))
    every = ", ".join(significant(one) for one in others[:IN_LINE])
    return f", period {significant(own['value'])} {unit} or an alias of it: {every} {unit} or shorter"


def summary_line(said: Said) -> str:
    """Verdict, findings and fit in a line."""
    names = [_ratio(one).lower() for one in said["effects"] if one["kind"] == REPEATABILITY]
    own = [_short(one, said) for one in _systematic(said)]
    names += own if subject(said) == "axis" else counted(own)
    names += [f"without a law: {one['where']}{_or_laws(said)}" for one in said["unexplained"][:1]]
    if said["verdict"] == "insufficient" and not names:
        names = [*said.get("lacking", ()), *filter(None, [_possible(said).strip().rstrip(".")])]
    what, numbers = ", ".join(names), _fit(said)
    return said["verdict"] + (f": {what}" if what else "") + (f" ({numbers})" if numbers else "")


def _short(effect: Said, said: Said) -> str:
    if subject(said) == "axis":
        return _at_axis(effect, said["axis"]["form"])
    if subject(said) == "map":
        return str(effect["kind"])
    others = [*in_place_of(effect), *map(name_of, effect["alternatives"])]
    return name_of(effect["label"]) + (f" (or {', '.join(others)})" if others else "")


def _fit(said: Said) -> str:
    """Residuals before and after, and the noise; none of a map, whose quantities have several units."""
    fit = said["fit"]
    if subject(said) == "map":
        return ""
    if subject(said) == "gauge":
        before, after, noise = (_um(fit[key]) for key in ("rms_before_um", "rms_after_um", "noise_um"))
        imitated = fit.get("with_empirical", {}).get("rms_after_um")
        more = "" if imitated is None else f"{imitated:.2f} um with the form imitated, "
        return f"rms {before} -> {after} um, {more}noise {noise} um"
    unit, step = said["axis"]["deviation_unit"], said["axis"].get("even_step")
    before, after, noise = (significant(fit[f"{key}_{unit}"]) for key in ("rms_before", "rms_after", "noise"))
    unseen = ""
    if said["verdict"] == "adequate" and step:
        steps = f"the even steps of {significant(step)} {said['axis']['unit']}"
        unseen = f"; a period that divides {steps} cannot be seen"
    return f"rms {before} -> {after} {unit}, noise {noise} {unit}{unseen}"


def _um(value: float | None) -> str:
    return f"{math.nan if value is None else value:.2f}"


def numbers_of(said: Said) -> pd.DataFrame:
    """One row per number of an effect: probability, value, standard uncertainty (NaN where none is known), unit."""
    return pd.DataFrame(list(_rows(said["effects"])), columns=NUMBERS)


def _rows(effects: Iterable[Said]) -> Iterator[dict[str, Any]]:
    for effect in effects:
        head = {"kind": effect["kind"], "effect": effect["label"], "probability": effect["probability"]}
        numbers = {name: one for name, one in effect["parameters"].items() if "unit" in one}
        for name, one in (numbers or {"": {"value": None, "u": None, "unit": ""}}).items():
            value, u = (math.nan if one[key] is None else one[key] for key in ("value", "u"))
            yield {**head, "parameter": name, "value": value, "u": u, "unit": one["unit"]}

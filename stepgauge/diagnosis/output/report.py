"""Words and numbers of the report of a ``diagnosis.json``: verdict, limits, values with their uncertainties."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.conditions.duplicates import copies_words
from stepgauge.diagnosis.forms.form import SMOOTH
from stepgauge.diagnosis.output.aliases import leads_into_mm
from stepgauge.diagnosis.output.practice import counted
from stepgauge.diagnosis.output.words import in_place, listed, name_of, significant
from stepgauge.files.notation import LEAST_PLAIN

COVERAGE = 2.0
"""Coverage factor of the expanded uncertainty after a plus-minus sign."""
VERDICTS = {
    "adequate": "The recording agrees with the simulation within the noise. Nothing needs to be added to the model.",
    "effects": "The recording disagrees with the simulation, and known physics explains it:",
    "unknown": "The recording disagrees with the simulation in a way that no known effect explains.",
    "insufficient": "The recording cannot tell whether the simulation is right.",
}
IN_PLACE = ", or in its place "
FEW_DOF = 20
SURE = 0.99
"""Probability above which no digits are stated: the priors are not known so well."""
SCATTER_WORDS = {
    "growth": "scatter that grows",
    "burst": "scatter that is larger in one stretch of the record",
    "correlation": "scatter correlated from touch to touch",
    "certificate": "certificate with uncertainties that are too small",
    "outlying": "single outliers",
    "heavy": "tails heavier than normal",
}
NO_CHOICE = ("start_s", "pause_s", "about_mm")
"""Parameters of the computation that are not part of the name of a law."""


def summary(said: Mapping[str, Any]) -> str:
    """The verdict in a sentence or two."""
    text = VERDICTS[said["verdict"]]
    named = _numbered([_named(effect) for effect in said["effects"]])
    if said["verdict"] == "effects":
        return f"{text} {named}."
    if said["verdict"] == "unknown":
        where = said["unexplained"][0]["where"] if said["unexplained"] else "somewhere"
        return f"{text} Its form: {where}.{f' A part is explained: {named}.' if named else ''}"
    return text


def _numbered(named: Sequence[str]) -> str:
    """Findings with the numbers that they have on the page, where one has others in its place; else a plain list."""
    if len(named) < 2 or not any(IN_PLACE in one for one in named):
        return listed(counted(named))
    return "; ".join(f"{number}: {one}" for number, one in enumerate(named, 1))


def _named(effect: Mapping[str, Any]) -> str:
    """An effect with its choices, and its alternatives."""
    choices = [str(value) for value in chosen(effect) if not isinstance(value, list)]
    name = " ".join([name_of(effect["kind"]), *(choices and [f"({', '.join(choices)})"])])
    others = in_place_of(effect) + [name_of(label) for label in effect["alternatives"]]
    return f"{name}{IN_PLACE}{listed(others, 'or')}" if others else name


def in_place_of(effect: Mapping[str, Any]) -> list[str]:
    """What may be in place of an effect, in words."""
    return in_place(effect["confounded_with"], [one["labels"] for one in effect.get("several", ())])


def chosen(effect: Mapping[str, Any]) -> list[Any]:
    """Choices that distinguish an effect from others of its kind: axis, plane, face, direction; no times."""
    parameters = effect["parameters"].items()
    return [p["value"] for name, p in parameters if "unit" not in p and name not in ("rows", *NO_CHOICE)]


def members_of(effect: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The causes of a finding, the stated one first, each with its ``share``; the finding itself where it is alone."""
    if effect.get("set"):
        return list(effect["set"])
    own = effect["own_probability"] / effect["probability"] if effect["probability"] else 1.0
    return [{**effect, "share": min(float(own), 1.0)}]


def limits(said: Mapping[str, Any]) -> list[str]:
    """What this recording cannot show, whatever the verdict."""
    measured, found = said["measured"], []
    if not said["noise"]["from_repeats"]:
        found.append(
            "No face was probed twice under the same conditions. The noise is estimated from the repeatability in the"
            " machine file and from the residuals of the model: structure from face to face may count as noise."
        )
    elif said["noise"]["dof"] < FEW_DOF:
        found.append(f"The noise has only {said['noise']['dof']} degrees of freedom; measure more cycles.")
    if len(measured["placements"]) == 1:
        found.append(
            "The gauge lay in one place. Errors of the machine (scales, guideways) and of the gauge (certificate,"
            " temperature, bending) can be separated only by further placements."
        )
    if len(measured["speeds_mm_s"]) < 2:
        found.append("There was one measuring speed: a trigger delay cannot be separated from a larger pre-travel.")
    for axis, step in measured.get("even_steps_mm", {}).items():
        leads = listed([f"{one:g}" for one in leads_into_mm(step)], "or")
        found.append(
            f"Fronts and backs were probed in whole steps of {significant(step, 4)} mm of {axis}: a periodic error of a"
            f" period that goes into it ({leads} mm), as of a screw, is the same at all of them, and cannot be told"
            f" from a tip radius or a backlash of {axis}. A placement shifted along {axis} by a quarter of the pitch"
            " shows it."
        )
    if not measured["time_recorded"]:
        found.append("No times were recorded: drift, cycles, steps and vibration could not be tested.")
    if not measured["gauge_temperature_recorded"]:
        found.append("The temperature of the gauge was not recorded; that of the certificate was assumed.")
    if said["inputs"]["gauge"]["example"]:
        found.append("The certificate is an example, not that of a real gauge.")
    return found


def without_scatter(said: Mapping[str, Any]) -> Iterator[str]:
    """That readings repeat as no reading does, which whoever reads the result must know."""
    cycles, alike = defaultdict[int, list[int]](list), defaultdict[str, list[str]](list)
    for one in said.get("measured", {}).get("copied_cycles", ()):
        cycles[one["placement"]].append(one["cycle"])
    for placement, own in cycles.items():
        alike[copies_words(own)].append(str(placement))
    if cycles:
        each = listed([f"{own} of placement{'s' * (len(of) > 1)} {listed(of)}" for own, of in alike.items()])
        yield (
            f"Left out as copies: {each}. All their readings are those of an earlier cycle: they were copied, or"
            " simulated without scatter, and tell nothing."
        )
    if said.get("noise", {}).get("least"):
        yield (
            "The readings scatter less than those of any probe and machine: they were copied, averaged or simulated"
            " without scatter. A few per cent of the repeatability were taken as their standard deviation."
        )


def lacking(said: Mapping[str, Any]) -> list[str]:
    """What an insufficient recording lacks."""
    if said["verdict"] != "insufficient":
        return []
    found = []
    if not said["noise"]["from_repeats"]:
        found.append("every face probed at least twice, better five times, in the same placement and at the same speed")
    return found or ["more cycles: too few repeats to separate noise from structure"]


def remaining(unexplained: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The forms by covariate: each covariate once, with the faces, its forms, and the largest probability."""
    found: dict[str, dict[str, Any]] = {}
    for one in unexplained:
        empty = {"covariate": one["covariate"], "sides": [], "where": [], "p": [], "beside": [], "forms": []}
        row = found.setdefault(one["covariate"], empty)
        row["beside"] += [one["beside"]] if one.get("beside") and one["form"] == SMOOTH else []
        row["sides"].append(one["side"])
        row["where"].append(one["where"])
        row["p"].append(one["probability"])
        row["forms"].append(one["form"])
    return [
        {
            "covariate": row["covariate"],
            "side": ", ".join(dict.fromkeys(row["sides"])),
            "where": "; ".join(dict.fromkeys(row["where"])),
            "probability": max(row["p"]),
            "beside": " and ".join(dict.fromkeys(row["beside"])),
            "forms": row["forms"],
        }
        for row in found.values()
    ]


def wrapped_sum(formulas: Sequence[str], width: int = 96) -> list[str]:
    """The sum of some formulas in lines that break between terms, of ``width`` characters where a term allows it."""
    lines = [""]
    for number, term in enumerate(re.split(r" \+ (?=c\d+ \*)", " + ".join(formulas))):
        added = f"+ {term}" if number else term
        if lines[-1] and len(lines[-1]) + 1 + len(added) > width:
            lines.append(added)
        else:
            lines[-1] = f"{lines[-1]} {added}".lstrip()
    return lines


def um(value: float | None) -> str:
    """A length in um with a suitable number of digits."""
    return "undefined" if value is None else f"{significant(value, 3)} um"


def plus_minus(parameter: Mapping[str, Any]) -> str:
    """A parameter as a report prints it: ``2.27 +- 0.47 um/m``, to two digits of the uncertainty."""
    value, unit = parameter["value"], parameter.get("unit", "")
    unit = "" if unit == "1" else unit
    if isinstance(value, list):
        return ", ".join(str(one) for one in value) + (f" {unit}" if unit else "")
    if not isinstance(value, float):
        return f"{value} {unit}".strip()
    u = parameter.get("u")
    if not u:
        return f"{significant(value, 4)} {unit}".strip()
    expanded = COVERAGE * u
    if expanded < LEAST_PLAIN:
        return f"{significant(value, 4)} ± {significant(expanded, 2)} {unit}".strip()
    place = 1 - math.floor(math.log10(float(f"{expanded:.1e}")))
    value, expanded = (round(one, place) for one in (value, expanded))
    return f"{value:.{max(place, 0)}f} ± {expanded:.{max(place, 0)}f} {unit}".strip()


def probability_of(effect: Mapping[str, Any]) -> str:
    """The probability of a finding in words, and that of the cause it names where something else may stand for it."""
    first = members_of(effect)[0]["share"]
    alone = effect["own_probability"] if first is None else first * effect["probability"]
    own = f" that it is one of the set, {probability(alone)} that it is the first of it"
    return f"probability {probability(effect['probability'])}{own if effect['confounded_with'] else ''}"


def probability(value: float) -> str:
    """A probability to two digits; above ``SURE`` only that it is above."""
    if value > SURE:
        return f"above {SURE:g}"
    return f"below {1.0 - SURE:.2g}" if value < 1.0 - SURE else f"{value:.2f}"


def percent(share: float | None) -> str:
    """A share as a percentage."""
    return "undefined" if share is None else f"{100.0 * share:.3g} %"


def without(text: str, commands: Sequence[str]) -> str:
    """A sentence without the commands that are printed below it."""
    for command in commands:
        text = text.replace(f": {command}", " (the command below)")
    return text

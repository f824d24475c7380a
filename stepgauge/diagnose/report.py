"""``diagnosis.md``: what a ``diagnosis.json`` says: what to do on the first page, the evidence for it after that.

The template ``templates/reports/diagnosis.md.j2`` sees ``d``, the content of the JSON; ``figures``, the names of the
figures beside it; ``limits``, what this recording cannot show however long one looks; and the words of this module.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
from jinja2.sandbox import ImmutableSandboxedEnvironment

from stepgauge.diagnose.located import SCATTER
from stepgauge.diagnose.practice import counted, line, name_of
from stepgauge.files.notation import clean
from stepgauge.files.resources import folder
from stepgauge.files.text import read_text

COVERAGE = 2.0
"""Coverage factor of what the report prints after a plus-minus sign."""
VERDICTS = {
    "adequate": "The recording agrees with the simulation within the noise. Nothing needs to be added to the model.",
    "effects": "The recording disagrees with the simulation, and known physics explains it:",
    "unknown": "The recording disagrees with the simulation in a way that no known effect explains.",
    "insufficient": "The recording cannot tell whether the simulation is right.",
}
FEW_DOF = 20
SURE = 0.99
"""Probability above which no digits are told: the priors are not known so well."""
SCATTER_WORDS = {
    "growth": "scatter that grows",
    "correlation": "scatter correlated from touch to touch",
    "certificate": "certificate with uncertainties that are too small",
    "outlying": "single outliers",
    "heavy": "tails heavier than normal",
}
NO_CHOICE = ("start_s", "pause_s")
"""What a law was computed with, and is not called by."""


def report_text(said: Mapping[str, Any], figures: Sequence[str] = (), template: str | Path | None = None) -> str:
    """The report of a diagnosis.

    Parameters
    ----------
    said : content of a ``diagnosis.json``
    figures : names of the figures beside it
    template : Jinja file to use instead of the shipped one
    """
    source = Path(template) if template else folder("templates") / "reports" / "diagnosis.md.j2"
    context = {
        "d": said,
        "figures": list(figures),
        "summary": summary(said),
        "limits": limits(said),
        "lacking": lacking(said),
        "remaining": remaining(said["unexplained"]),
        "scatter": SCATTER,
        "scatter_words": SCATTER_WORDS,
        "coverage": COVERAGE,
    }
    return environment().from_string(read_text(source)).render(context)


def environment() -> ImmutableSandboxedEnvironment:
    """Where the templates of diagnoses are rendered, with the words and numbers of this module as filters."""
    found = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    found.filters.update(
        um=um, sig=significant, plus_minus=plus_minus, words=name_of, cell=cell, percent=percent, line=line
    )
    found.filters["wrapped"] = wrapped_sum
    found.filters["without"] = without
    found.filters["chosen"] = chosen
    found.filters["probability"] = probability
    return found


def summary(said: Mapping[str, Any]) -> str:
    """The verdict in a sentence or two."""
    text = VERDICTS[said["verdict"]]
    named = counted(_named(effect) for effect in said["effects"])
    if said["verdict"] == "effects":
        return f"{text} {listed(named)}."
    if said["verdict"] == "unknown":
        where = said["unexplained"][0]["where"] if said["unexplained"] else "somewhere"
        return f"{text} Its form: {where}.{f' A part is explained: {listed(named)}.' if named else ''}"
    return text


def _named(effect: Mapping[str, Any]) -> str:
    """An effect with its choices, and what it may be instead."""
    choices = [str(value) for value in chosen(effect) if not isinstance(value, list)]
    name = " ".join([name_of(effect["kind"]), *(choices and [f"({', '.join(choices)})"])])
    others = [name_of(kind) for kind in effect["confounded_with"]] + [
        name_of(label) for label in effect["alternatives"]
    ]
    return f"{name}, or in its place {listed(others, 'or')}" if others else name


def chosen(effect: Mapping[str, Any]) -> list[Any]:
    """What tells an effect from others of its kind: axis, plane, face, direction, and no time."""
    parameters = effect["parameters"].items()
    return [p["value"] for name, p in parameters if "unit" not in p and name not in ("rows", *NO_CHOICE)]


def listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def limits(said: Mapping[str, Any]) -> list[str]:
    """What this recording cannot show, whatever the verdict."""
    measured, found = said["measured"], []
    if not said["noise"]["from_repeats"]:
        found.append(
            "No face was probed twice under the same conditions. The noise rests on the repeatability that the machine"
            " file states and on what is left beside the model: structure from face to face may count as noise."
        )
    elif said["noise"]["dof"] < FEW_DOF:
        found.append(
            f"The noise rests on {said['noise']['dof']} degrees of freedom only; more cycles would sharpen it."
        )
    if len(measured["placements"]) == 1:
        found.append(
            "The gauge lay in one place. What goes with the machine (scales, guideways) and what goes with the gauge"
            " (certificate, temperature, bending) differ only where the gauge is moved or turned."
        )
    if len(measured["speeds_mm_s"]) < 2:
        found.append("There was one measuring speed: a trigger delay cannot be told from a longer pre-travel.")
    if not measured["time_recorded"]:
        found.append("No times were recorded: drift, cycles, jumps and vibration could not be looked for.")
    if not measured["gauge_temperature_recorded"]:
        found.append("The gauge's temperature was not recorded and is taken as that of the certificate.")
    if said["inputs"]["gauge"]["example"]:
        found.append("The certificate is an example, not that of a real gauge.")
    return found


def lacking(said: Mapping[str, Any]) -> list[str]:
    """What a recording that cannot tell should have had."""
    if said["verdict"] != "insufficient":
        return []
    found = []
    if not said["noise"]["from_repeats"]:
        found.append("every face probed at least twice, better five times, in the same placement and at the same speed")
    if (said["noise"]["sigma_um"] or 0.0) <= 0.0:
        found.append("readings that differ between repeats: these are identical to the last digit, so they are rounded,"
                     " copied or simulated without noise")  # fmt: skip
    return found or ["more cycles: too few repeats are left to tell noise from structure"]


def remaining(unexplained: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """What has no law, by covariate: each once, with the faces, all forms seen in it, and the largest probability."""
    found: dict[str, dict[str, Any]] = {}
    for one in unexplained:
        row = found.setdefault(one["covariate"], {"covariate": one["covariate"], "sides": [], "where": [], "p": []})
        row["sides"].append(one["side"])
        row["where"].append(one["where"])
        row["p"].append(one["probability"])
    return [
        {
            "covariate": row["covariate"],
            "side": ", ".join(dict.fromkeys(row["sides"])),
            "where": "; ".join(dict.fromkeys(row["where"])),
            "probability": max(row["p"]),
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
    """A length in um with what digits it deserves."""
    return "undefined" if value is None else f"{significant(value, 3)} um"


def significant(value: float | None, digits: int = 3) -> str:
    """A number to some significant digits, without an exponent where people would not write one."""
    if value is None:
        return "undefined"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        decimals = 0 if value == 0.0 else max(digits - 1 - math.floor(math.log10(abs(value))), 0)
        return f"{value:.{decimals}f}"
    return f"{value:.{digits - 1}e}"


def plus_minus(parameter: Mapping[str, Any]) -> str:
    """A parameter as a report prints it: ``2.27 +- 0.47 um/m``, to two digits of the uncertainty."""
    value, unit = parameter["value"], parameter.get("unit", "")
    if isinstance(value, list):
        return ", ".join(str(one) for one in value) + (f" {unit}" if unit else "")
    if not isinstance(value, float):
        return f"{value} {unit}".strip()
    u = parameter.get("u")
    if not u:
        return f"{significant(value, 4)} {unit}".strip()
    expanded = COVERAGE * u
    decimals = max(1 - math.floor(math.log10(expanded)), 0)
    return f"{value:.{decimals}f} ± {expanded:.{decimals}f} {unit}".strip()


def probability(value: float) -> str:
    """A probability to two digits; beyond ``SURE`` only that it is."""
    if value > SURE:
        return f"above {SURE:g}"
    return f"below {1.0 - SURE:.2g}" if value < 1.0 - SURE else f"{value:.2f}"


def percent(share: float | None) -> str:
    """A share as a percentage."""
    return "undefined" if share is None else f"{100.0 * share:.3g} %"


def cell(text: object) -> str:
    """Text that neither ends a cell of a table nor starts markup."""
    return clean(text).replace("\n", " ").replace("|", "\\|").replace("`", "'")


def without(text: str, commands: Sequence[str]) -> str:
    """A sentence whose commands are printed under it."""
    for command in commands:
        text = text.replace(f": {command}", " (the command below)")
    return text

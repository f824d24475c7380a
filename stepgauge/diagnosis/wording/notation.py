"""Sizes, lengths and directions as a technician reads them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from stepgauge.axis.units import unit_words
from stepgauge.diagnosis.wording.catalogue import say
from stepgauge.effects.words import COVERAGE as COVERAGE
from stepgauge.files.notation import LEAST_PLAIN, significant, uncertain

MOST_NUMBERS = 8
"""Numbers of a finding of which all are told; of more only those that are determined."""
SURE = 0.99
"""Probability above which no digits are stated: the priors are not known so well."""


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
    if parameter.get("bound") == "least":
        return f"≥ {significant(max(value - COVERAGE * (u or 0.0), 0.0), 2)} {unit}".strip()
    if not u:
        return f"{significant(value, 4)} {unit}".strip()
    expanded = COVERAGE * u
    if expanded < LEAST_PLAIN:
        return f"{significant(value, 4)} ± {significant(expanded, 2)} {unit}".strip()
    said, sure = uncertain(value, expanded, most=9)
    return f"{said.replace('−', '-')} ± {sure} {unit}".strip()


def told_numbers(one: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """The numbers of a finding with an uncertainty, by name; of very many the ones that are determined."""
    known = [(name, p) for name, p in one["parameters"].items() if "unit" in p and p.get("u")]
    return known if len(known) <= MOST_NUMBERS else [one for one in known if is_determined(one[1])]


def single_readings(one: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """How far single readings are off, by their places in the table of the recording, which count from 0."""
    rows = one.get("rows", ())
    several = len({row.get("recording") for row in rows}) > 1
    found = {}
    for row in rows:
        unit = next(name for name in row if name.startswith("off_")).removeprefix("off_")
        place = f"iloc[{row['row'] - 1}]"
        found[f"{row['recording']}.{place}" if several else place] = {"value": row[f"off_{unit}"], "unit": unit}
    return found


def rms_of(form: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The root mean square of what has no law, by its name, in the unit of the readings; empty where it has several."""
    key = next((key for key in form if key.startswith("rms_")), "")
    return {"rms": {"value": form[key], "unit": key.removeprefix("rms_")}} if key else {}


def symbol(name: str, parameter: Mapping[str, Any], count: int) -> str:
    """What stands before a number where a finding has several: its name without the unit; else nothing."""
    stem = name.removesuffix(unit_words(str(parameter["unit"]))).strip("_").replace("_", " ")
    return "" if count == 1 else f"{stem if stem not in ('', 'ppm') else 'size'} "


def is_determined(parameter: Mapping[str, Any]) -> bool:
    """Whether a number differs from zero by more than its expanded uncertainty."""
    return bool(abs(parameter["value"]) > COVERAGE * (parameter.get("u") or math.inf))


def members_of(effect: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The causes of a finding, the stated one first, each with its probability in the set; or the finding itself."""
    if effect.get("set"):
        return list(effect["set"])
    own = effect["own_probability"] / effect["probability"] if effect["probability"] else 1.0
    return [{**effect, "conditional_probability": min(float(own), 1.0)}]


def probability_of(effect: Mapping[str, Any]) -> str:
    """The probability of a finding in words, and that of the cause it names where something else may stand for it."""
    first = members_of(effect)[0]["conditional_probability"]
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


def odds_text(odds: float, language: str = "en") -> str:
    """Odds of one cause over another as one says them: 0.00065 is ``1 500 to 1 against``."""
    times = max(odds, 1.0 / max(odds, 1e-300))
    return say("odds_for" if odds > 1.0 else "odds_against", language, times=times_text(times, language))


def times_text(times: float, language: str = "en") -> str:
    """How many times, to two digits, thousands set apart (ISO 80000-1); over a million nobody needs a number."""
    if times >= MOST_TIMES:
        return say("over_a_million", language)
    text = f"{float(f'{times:.2g}'):,.{1 if times < 9.95 else 0}f}".removesuffix(".0")
    return text.replace(",", "\u00a0")


MOST_TIMES = 1e6


def without(text: str, commands: Sequence[str]) -> str:
    """A sentence without the commands that are printed below it."""
    for command in commands:
        text = text.replace(f": {command}", " (the command below)")
    return text

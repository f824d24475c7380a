"""What any diagnosis found, with its rivals, as a table; from its ``diagnosis.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.wording.action import (
    actions,
)
from stepgauge.diagnosis.wording.catalogue import say
from stepgauge.diagnosis.wording.findings import (
    describe_rivals,
    finding_name,
    meaning,
    name_of,
    remedy,
    subject,
)
from stepgauge.diagnosis.wording.notation import (
    COVERAGE,
    SURE,
    members_of,
    plus_minus,
    probability,
    symbol,
    told_numbers,
)
from stepgauge.diagnosis.wording.phrases import nearest_law, structure_words
from stepgauge.diagnosis.wording.structure import SCATTER
from stepgauge.languages.messages import parameter_name
from stepgauge.reports.blocks import Block, part, table, words
from stepgauge.reports.first_steps import shown_rivals, structure_rows

Said = Mapping[str, Any]
FOUND = ("", "Cause", "Value", "u", "Probability", "What it means; repair")
_SHARES = (0.0, 1.5, 0.0, 0.0, 0.0, 5.0)
UNKNOWN_NAME = "structure without a known law"


def found_part(said: Said, *more: Block | None, language: str = "en") -> dict[str, Any]:
    """The part with the table of findings: each cause with its own value, uncertainty, probability and instruction."""
    rows, action = list[list[str]](), actions(said)
    inner: list[int] = []
    left_out = 0
    for number, effect in enumerate(said["effects"], 1):
        p = _member_probability(members_of(effect)[0], effect)
        rows.append(_row(str(number), effect, p, said, language, action[number - 1] in ("check", "enter", "repair")))
        rivals = shown_rivals(said, effect)
        left_out += max(len(members_of(effect)) - 1 - len(rivals), 0)
        for one in rivals:
            inner.append(len(rows))
            rows.append(_row("or", one, _member_probability(one, effect), said, language))
        others, left = combinations(effect, language)
        if others and left >= 1.0 - SURE:
            inner.append(len(rows))
            rows.append(_together_row(others, left))
    rows += [_form_row(row, number, said, language) for number, row in structure_rows(said)]
    if not rows:
        return part("What was found", words(_nothing(said)), *more)
    listing = table(FOUND, rows, _SHARES, inner, _note(said, left_out))
    nearest = filter(None, (nearest_law(one, subject(said), language) for one in said["unexplained"]))
    against = [words(f"Known laws in place of what has none: {one}.") for one in nearest]
    return part("What was found", listing, *against, *more)


def _member_probability(one: Said, effect: Said) -> float | None:
    """Probability of a member of a set; None where only that of the first one is known."""
    return (
        None
        if one["conditional_probability"] is None
        else float(one["conditional_probability"] * effect["probability"])
    )


def combinations(effect: Said, language: str = "en") -> tuple[list[str], float]:
    """What may be instead of a finding and is no member of its set: several laws, or one for several findings.

    Their names, and the probability that is left for all of them.
    """
    members = members_of(effect)
    known = {one["kind"] for one in members}
    left = float(effect["probability"]) - sum(_member_probability(one, effect) or 0.0 for one in members)
    others = [name for name in effect["confounded_with"] if name not in known]
    several = [one["labels"] for one in effect.get("several", ())]
    return describe_rivals(others, several, language=language), max(left, 0.0)


def _together_row(others: Sequence[str], p: float) -> list[str]:
    text = f"{'; '.join(others)}: in place of this finding, or of this and others; see the appendix."
    return ["or", "others", "", "", probability(p), text]


def _row(first: str, one: Said, p: float | None, said: Said, language: str, repair: bool = True) -> list[str]:
    """``repair``: whether it is to be repaired, or may be once it is known to be the cause."""
    at = subject(said)
    name = finding_name(one, at, language) if first != "or" else name_of(one["label"], at.of, language)
    alone = {name: {**p, "u": None} for name, p in one["parameters"].items()}  # each u has its column
    told = one["meaning"] if language == "en" else meaning(one, at, language)
    text = f" {say('repair', language)}: {remedy({**one, 'parameters': alone}, at, language).repair}"
    text = told + text * repair
    return [first, name, values(one, language), uncertainties(one), "" if p is None else probability(p), text]


def _form_row(row: Said, number: int, said: Said, language: str) -> list[str]:
    text = f"{structure_words(row, subject(said), language)}. Its cause is not known."
    name = row["form"] if row.get("form") in SCATTER else f"{UNKNOWN_NAME}: {row['covariate']}"
    return [str(number), name, "", "", probability(row["probability"]), text]


def values(one: Said, language: str = "en") -> str:
    """The numbers that were fitted, one to a line, with as many digits as their standard uncertainty has.

    A name stands before each where there are several; what the unit says is left out of it.
    """
    numbers = told_numbers(one)

    def named(name: str, p: Mapping[str, Any]) -> str:
        said = symbol(name, p, len(numbers))
        german = parameter_name("size" if said == "size " else name, language) if said and language != "en" else ""
        return f"{german} " if german else said

    return "\n".join(f"{named(name, p)}{_digits(p)[0]} {_unit(p)}".strip() for name, p in numbers)


def uncertainties(one: Said) -> str:
    """Their standard uncertainties, in the same order."""
    return "\n".join(f"{_digits(p)[1]} {_unit(p)}".strip() for _, p in told_numbers(one))


def _digits(parameter: Said) -> tuple[str, str]:
    """The value and its standard uncertainty, to two digits of the latter."""
    coverage = 1.0 if "bound" in parameter else COVERAGE
    text = plus_minus({**parameter, "u": parameter["u"] / coverage, "unit": ""})
    value, _, u = text.replace("-", "−").partition(" ± ")
    return value, u


def _unit(parameter: Said) -> str:
    return "" if parameter["unit"] in ("1", "count") else str(parameter["unit"])


def _note(said: Said, left_out: int) -> str:
    sets = any(len(members_of(effect)) > 1 or combinations(effect)[0] for effect in said["effects"])
    note = "u: standard uncertainty."
    if sets:
        note += (
            " \u201cor\u201d: a rival that this recording does not discriminate from the cause above it, with its own"
            " value; the probabilities of a cause and its rivals add up to that of the finding."
        )
    return note + (f" Further rivals, in the appendix: {left_out}." if left_out else "")


def _nothing(said: Said) -> str:
    if said["verdict"] == "insufficient":
        prevented = stored_conditions(said).no_statement
        if prevented:
            return prevented
        tested = "No cause is sure enough to be stated: see the probabilities."
        return tested if said["probabilities"] else "Nothing could be tested: the noise is not known well enough."
    return "No systematic effect, and no structure, is more probable than scatter alone."

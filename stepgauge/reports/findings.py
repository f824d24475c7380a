"""The first page of any diagnosis: what to do first, then what was found with its rivals.

It is made from a ``diagnosis.json``, whatever was diagnosed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import (
    describe_rivals,
    finding_name,
    kind_and_choice,
    meaning,
    name_of,
    remedy,
    states_value,
    subject,
)
from stepgauge.diagnosis.wording.limits import lacking, misfits, remaining
from stepgauge.diagnosis.wording.notation import (
    COVERAGE,
    SURE,
    is_determined,
    members_of,
    plus_minus,
    probability,
    symbol,
    told_numbers,
    without,
)
from stepgauge.diagnosis.wording.phrases import covariate_name, nearest_law, structure_words
from stepgauge.diagnosis.wording.structure import SCATTER, remedy_of_structure
from stepgauge.effects.words import Wording
from stepgauge.reports.blocks import Block, bullets, code, part, table, words

Said = Mapping[str, Any]
MOST_SIZES = 4
"""Numbers of a finding that its repair repeats; of more it is too long to read."""
MOST_RIVALS, MOST_ROWS = 4, 8
"""Rivals of a finding, and rows of the table, on the first page; the appendix has all."""
FOUND = ("", "Cause", "Value", "u", "Probability", "What it means; repair")
_SHARES = (0.0, 1.5, 0.0, 0.0, 0.0, 5.0)
UNKNOWN_NAME = "structure without a known law"
_WORD = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")


def do_first(said: Said, language: str = "en") -> dict[str, Any]:
    """The part that says what to do: check, repair, measure again."""
    return part(say("do_first", language), *_steps(said, language))


def _steps(said: Said, language: str) -> Iterator[Block]:
    if said["verdict"] == "adequate":
        yield words(say("nothing_to_do", language))
        return
    for title, items in _lists(said, language):
        if items:
            yield bullets(items, say(title, language))
    if found := commands(said):
        yield code(*found, language="sh")


def _lists(said: Said, language: str) -> list[tuple[str, list[str]]]:
    every = {"check": _checks, "repair": _repairs, "again": _again}
    return [(title, list(items(said, language))) for title, items in every.items()]


def first_lines(said: Said, language: str = "en") -> list[str]:
    """The same in lines for a terminal, each with the word for what it is."""
    found = [f"{say(title, language).lower()}: {text}" for title, items in _lists(said, language) for text in items]
    return found + commands(said)


def commands(said: Said) -> list[str]:
    """The commands of all measurements that are proposed, each once."""
    every = (*said["effects"], *said["unexplained"])
    return list(dict.fromkeys(command for one in every for command in one.get("commands", ())))


def _checks(said: Said, language: str) -> Iterator[str]:
    at = subject(said)
    for number, effect in enumerate(said["effects"], 1):
        members = [effect, *_rivals(said, effect)]
        first = dict.fromkeys(remedy(one, at, language).check for one in members)
        for text in first:
            one = next(each for each in members if remedy(each, at, language).check == text)
            name = finding_name(one, at, language)
            which = name if one is effect else say("or_member", language, name=name)
            yield f"{number}{f', {which}' if len(members) > 1 else ''}: {text}"
    for number, row in _structure(said):
        yield f"{number}: {_remedy_of_row(row, language).check}"
        yield from (f"{number}, {which}: {check}" for which, check in _checks_of_laws(row, language))


def _checks_of_laws(row: Said, language: str) -> Iterator[tuple[str, str]]:
    """Laws that the readings do not exclude in the place of a structure, with what to check of each."""
    for one in row["open"]:
        for label in dict.fromkeys(label for law in one["laws"] for label in law["labels"]):
            kind, choice = kind_and_choice(label)
            law = {"kind": kind, "parameters": {name: {"value": choice} for name in ("axis", "plane")}}
            yield (
                say("or_member", language, name=name_of(label, "gauge", language)),
                remedy(law, language=language).check,
            )


def _repairs(said: Said, language: str) -> Iterator[str]:
    """What to repair by finding; findings of which the cause is not known yet are named together."""
    unsure = [n for n, effect in enumerate(said["effects"], 1) if _has_rivals(effect)]
    if misfits(said):
        unsure = list(range(1, len(said["effects"]) + 1))
        yield f"{', '.join(map(str, unsure))}: {say('misfit', language)}"
    elif unsure:
        yield f"{', '.join(map(str, unsure))}: {say('first', language)}"
    for number, effect in enumerate(said["effects"], 1):
        if number not in unsure:
            yield f"{number}: {_size(effect, said, language)}{remedy(effect, subject(said), language).repair}"
    left = list(_structure(said))
    if left:
        yield f"{', '.join(str(number) for number, _ in left)}: {_remedy_of_row(left[0][1], language).repair}"


def _size(effect: Said, said: Said, language: str) -> str:
    """Which finding and how large, before a repair that is not to enter just these numbers."""
    at, numbers = subject(said), [one for one in told_numbers(effect) if is_determined(one[1])]
    if not numbers or len(numbers) > MOST_SIZES or states_value(effect["kind"], at.of):
        return ""
    sizes = ", ".join(f"{symbol(name, p, len(numbers))}{plus_minus(p)}" for name, p in numbers)
    sizes = sizes.replace(".", ",") if language == "de" else sizes
    return f"{finding_name(effect, at, language)}, {sizes} (k = {COVERAGE:g}): "


def _structure(said: Said) -> Iterator[tuple[int, Said]]:
    """What is left without a known law, numbered on from the effects."""
    return enumerate(remaining(said["unexplained"]), len(said["effects"]) + 1)


def _has_rivals(effect: Said) -> bool:
    several = len(members_of(effect)) > 1 or effect["confounded_with"] or effect["alternatives"]
    return bool(several or effect.get("aliases"))


def _again(said: Said, language: str) -> Iterator[str]:
    yield from lacking(said, language)
    for number, effect in enumerate(said["effects"], 1):
        if effect["separate_by"]:
            yield f"{number}, {say('separate', language, text=proposal(effect, language))}"
    for number, row in _structure(said):
        for one in row["open"]:
            laws = [" + ".join(name_of(label, "gauge", language) for label in law["labels"]) for law in one["laws"]]
            told = {"laws": listed(laws, "or", language), "text": proposal(one, language)}
            yield f"{number}, {say('tell_laws' if laws else 'separate', language, **told)}"
    of = subject(said).of
    if of != "axis" and said["verdict"] != "insufficient" and (said["effects"] or said["unexplained"]):
        yield say(f"compare_{of}", language)


def proposal(one: Said, language: str) -> str:
    """A further measurement without its commands, which stand below; in German only that there is one."""
    if language != "en":
        return say("planned", language)
    return _WORD.sub(lambda match: name_of(match[0]), without(one["separate_by"], one["commands"]))


def _remedy_of_row(row: Said, language: str = "en") -> Wording:
    on = [covariate_name(row[key], language=language) for key in ("covariate", "beside") if row.get(key)]
    return remedy_of_structure(row["forms"], listed(on, language=language), language)


def found_part(said: Said, *more: Block | None, language: str = "en") -> dict[str, Any]:
    """The part with the table of findings: each cause with its own value, uncertainty, probability and instruction."""
    rows: list[list[str]] = []
    inner: list[int] = []
    left_out = 0
    for number, effect in enumerate(said["effects"], 1):
        rows.append(_row(str(number), effect, _member_probability(members_of(effect)[0], effect), said, language))
        rivals = _rivals(said, effect)
        left_out += max(len(members_of(effect)) - 1 - len(rivals), 0)
        for one in rivals:
            inner.append(len(rows))
            rows.append(_row("or", one, _member_probability(one, effect), said, language))
        others, p = combinations(effect, language)
        if others and p >= 1.0 - SURE:
            inner.append(len(rows))
            rows.append(_together_row(others, p))
    rows += [_form_row(row, number, said, language) for number, row in _structure(said)]
    if not rows:
        return part("What was found", words(_nothing(said)), *more)
    listing = table(FOUND, rows, _SHARES, inner, _note(said, left_out))
    nearest = filter(None, (nearest_law(one, subject(said), language) for one in said["unexplained"]))
    against = [words(f"Known laws in place of what has none: {one}.") for one in nearest]
    return part("What was found", listing, *against, *more)


def _rivals(said: Said, effect: Said) -> list[Said]:
    """The rivals of a finding for the first page, the most probable first: one, or more where findings are few."""
    sets = sum(len(members_of(one)) > 1 for one in said["effects"])
    room = (MOST_ROWS - len(said["effects"])) // max(sets, 1)
    return members_of(effect)[1:][: min(max(room, 1), MOST_RIVALS)]


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


def _row(first: str, one: Said, p: float | None, said: Said, language: str) -> list[str]:
    at = subject(said)
    name = finding_name(one, at, language) if first != "or" else name_of(one["label"], at.of, language)
    alone = {name: {**p, "u": None} for name, p in one["parameters"].items()}  # each u has its column
    told = one["meaning"] if language == "en" else meaning(one, at, language)
    text = f"{told} {say('repair', language)}: {remedy({**one, 'parameters': alone}, at, language).repair}"
    return [first, name, values(one), uncertainties(one), "" if p is None else probability(p), text]


def _form_row(row: Said, number: int, said: Said, language: str) -> list[str]:
    text = f"{structure_words(row, subject(said), language)}. Its cause is not known."
    name = row["form"] if row.get("form") in SCATTER else f"{UNKNOWN_NAME}: {row['covariate']}"
    return [str(number), name, "", "", probability(row["probability"]), text]


def values(one: Said) -> str:
    """The numbers that were fitted, one to a line, with as many digits as their standard uncertainty has.

    A name stands before each where there are several; what the unit says is left out of it.
    """
    numbers = told_numbers(one)
    return "\n".join(f"{symbol(name, p, len(numbers))}{_digits(p)[0]} {_unit(p)}".strip() for name, p in numbers)


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
        tested = "No statement is likelier than not: see the probabilities."
        return tested if said["probabilities"] else "Nothing could be tested: the noise is not known well enough."
    return "No systematic effect, and no structure, is more probable than scatter alone."

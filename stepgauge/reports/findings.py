"""The first page of any diagnosis: what to do first, then what was found with its rivals.

It is made from a ``diagnosis.json``, whatever was diagnosed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.wording.action import (
    COURSE,
    actions,
    held_um,
    is_good_enough,
    is_of_file,
    limits_of_machine,
    most_um,
    spoils,
)
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import (
    STEPPERS,
    check_of,
    describe_rivals,
    finding_name,
    meaning,
    name_of,
    remedy,
    states_value,
    subject,
)
from stepgauge.diagnosis.wording.limits import lacking, remaining
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
from stepgauge.files.notation import significant, uncertainty
from stepgauge.languages.messages import parameter_name, translate_message
from stepgauge.reports.blocks import Block, bullets, code, part, table, words

Said = Mapping[str, Any]
TELLING_PART = 0.25
"""Part of what is open, nats, from which a measurement goes before the checks."""
MOST_SIZES = 4
"""Numbers of a finding that its repair repeats; of more it is too long to read."""
MOST_RIVALS, MOST_ROWS = 4, 8
"""Rivals of a finding, and rows of the table, on the first page; the appendix has all."""
FOUND = ("", "Cause", "Value", "u", "Probability", "What it means; repair")
_SHARES = (0.0, 1.5, 0.0, 0.0, 0.0, 5.0)
UNKNOWN_NAME = "structure without a known law"
_WORD = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")


def do_first(said: Said, language: str = "en") -> dict[str, Any]:
    """The part that says what to do: stop, or check, enter, repair, measure again."""
    return part(say("do_first", language), *_steps(said, language))


def _steps(said: Said, language: str) -> Iterator[Block]:
    if said["verdict"] == "adequate":
        yield words(say("nothing_to_do", language))
    for title, items in _lists(said, language):
        if items:
            yield bullets(items, say(title, language))
    if found := commands(said):
        yield code(*found, language="sh")


def _lists(said: Said, language: str) -> list[tuple[str, list[str]]]:
    every = {"good_enough": _good_enough, "check": _checks, "enter": _entered, "repair": _repairs, "again": _again}
    return [(title, list(items(said, language))) for title, items in every.items()]


def first_lines(said: Said, language: str = "en") -> list[str]:
    """The same in lines for a terminal, each with the word for what it is."""
    found = [f"{say(title, language).lower()}: {text}" for title, items in _lists(said, language) for text in items]
    return found + commands(said)


def commands(said: Said) -> list[str]:
    """The commands of all measurements that are proposed, each once."""
    open_ = [one for one, what in zip(said["effects"], actions(said), strict=True) if what != "left"]
    every = (*open_, *said["unexplained"], said.get("further", {}))
    return list(dict.fromkeys(command for one in every for command in one.get("commands", ())))


def _good_enough(said: Said, language: str) -> Iterator[str]:
    """That there is nothing to do, and what may remain; findings that are left as they are."""
    for number, (effect, action) in enumerate(zip(said["effects"], actions(said), strict=True), 1):
        if action == "left":
            told = say(
                "left", language, held=_deviation(held_um(said), said, language), most=_most(effect, said, language)
            )
            yield f"{number}: {_size(effect, said, language)}{told}"
    if is_good_enough(said):
        yield say("stop", language, each=_remaining(said, language))
    elif limits := limits_of_machine(said):
        yield say("entered", language, each=_remaining(said, language))
        for one in limits:
            name = finding_name(one, subject(said), language)
            yield say("limit", language, name=name, most=_most(one, said, language))


def _most(effect: Said, said: Said, language: str) -> str:
    """By how much a finding moves readings at most."""
    return _deviation(most_um(effect, said), said, language)


def _deviation(size: float, said: Said, language: str) -> str:
    """A size in the unit of what was diagnosed, to two digits."""
    text = f"{significant(size, 2)} {subject(said).deviation}"
    return text.replace(".", ",") if language == "de" else text


def _remaining(said: Said, language: str) -> str:
    """What the errors that are set by a number may still be."""
    every = [
        f"{name_of(one['label'], subject(said).of, language)} ± {uncertainty(COVERAGE * one['u'])} {one['unit']}"
        for one in said.get("may_remain", ())
    ]
    return listed(every, language=language)


def _checks(said: Said, language: str) -> Iterator[str]:
    at, action = subject(said), actions(said)
    for number, effect in enumerate(said["effects"], 1):
        if action[number - 1] == "left":
            continue
        members = [effect, *_rivals(said, effect)]
        first = dict.fromkeys(remedy(one, at, language).check for one in members)
        for text in first:
            one = next(each for each in members if remedy(each, at, language).check == text)
            name = finding_name(one, at, language)
            which = name if one is effect else say("or_member", language, name=name)
            yield f"{number}{f', {which}' if len(members) > 1 else ''}: {text}"
    for number, row in _structure(said):
        yield from (f"{number}: {text}" for text in _checks_of_row(row, said, language))
        # laws that the readings do not exclude in the place of this structure
        labels = (label for one in row["open"] for law in one["laws"] for label in law["labels"])
        for label in dict.fromkeys(labels):
            which = say("or_member", language, name=name_of(label, at.of, language))
            yield f"{number}, {which}: {check_of(label, at, language)}"


def _checks_of_row(row: Said, said: Said, language: str) -> list[str]:
    """What to check for structure: of the laws that it is like, where it is like some."""
    every = (phrase for one in said["unexplained"] if one["covariate"] == row["covariate"] for phrase in _phrases(one))
    like = dict.fromkeys(phrase["law"] for phrase in every if "law" in phrase)
    return [check_of(label, subject(said), language) for label in like] or [_remedy_of_row(row, said, language).check]


def _phrases(one: Said) -> list[Said]:
    return [phrase for phrase in one.get("phrases", ()) if isinstance(phrase, Mapping)]


def _repairs(said: Said, language: str) -> Iterator[str]:
    """What to repair by finding, what is no number; findings of which nothing is repaired yet are named together."""
    for action, key in {"misfit": "misfit", "check": "first"}.items():
        if numbers := _numbers_of(action, said):
            yield f"{', '.join(map(str, numbers))}: {say(key, language)}"
    yield from _remedies("repair", said, language)
    left = list(_structure(said))
    if left:
        yield f"{', '.join(str(number) for number, _ in left)}: {_remedy_of_row(left[0][1], said, language).repair}"


def _entered(said: Said, language: str) -> Iterator[str]:
    """The numbers to enter; none before what spoils them is mended and measured again; what they do not wait for."""
    if waiting := _numbers_of("wait", said):
        spoiling = [number for number, one in enumerate(said["effects"], 1) if spoils(one)]
        course = {one["covariate"] for one in said["unexplained"] if spoils(one)}
        spoiling += [number for number, row in _structure(said) if row["covariate"] in course]
        yield f"{', '.join(map(str, waiting))}: {say('wait', language, numbers=_numbers(spoiling, language))}"
    for number in _numbers_of("unknown", said):
        effect = said["effects"][number - 1]
        open_text = say("not_known", language, most=_most(effect, said, language))
        yield f"{number}: {_size(effect, said, language)}{open_text}"
    yield from _remedies("enter", said, language)
    entered, open_ = _numbers_of("enter", said), _numbers_of("check", said)
    if entered and (open_ := [*open_, *(number for number, _ in _structure(said))]):
        yield f"{', '.join(map(str, entered))}: {say('not_waiting', language, numbers=_numbers(open_, language))}"


def _numbers(numbers: Sequence[int], language: str) -> str:
    return listed([str(one) for one in numbers], language=language)


def _numbers_of(action: str, said: Said) -> list[int]:
    """The numbers of the findings with an action."""
    return [number for number, one in enumerate(actions(said), 1) if one == action]


def _remedies(action: str, said: Said, language: str) -> Iterator[str]:
    for number in _numbers_of(action, said):
        effect = said["effects"][number - 1]
        size = "" if action == "enter" else _size(effect, said, language)
        yield f"{number}: {size}{remedy(effect, subject(said), language).repair}"


def _size(effect: Said, said: Said, language: str) -> str:
    """Which finding and how large, where it is not told by the number to enter."""
    at, numbers = subject(said), told_numbers(effect)
    if not states_value(effect["kind"], at.of):
        numbers = [one for one in numbers if is_determined(one[1])]
    if not numbers or len(numbers) > MOST_SIZES:
        return ""
    sizes = ", ".join(f"{symbol(name, p, len(numbers))}{plus_minus(p)}" for name, p in numbers)
    sizes = sizes.replace(".", ",") if language == "de" else sizes
    return f"{finding_name(effect, at, language)}, {sizes} (k = {COVERAGE:g}): "


def _structure(said: Said) -> Iterator[tuple[int, Said]]:
    """What is left without a known law, numbered on from the effects."""
    return enumerate(remaining(said["unexplained"]), len(said["effects"]) + 1)


def _again(said: Said, language: str) -> Iterator[str]:
    if said["verdict"] == "insufficient" and not is_good_enough(said):
        yield from lacking(said, language)
        yield from [say("may_remain", language, each=each)] if (each := _remaining(said, language)) else []
    if said.get("further", {}).get("separate_by"):
        yield say("worth", language, text=proposal(said["further"], language))
    every = [(number, effect) for number, effect in enumerate(said["effects"], 1) if effect["separate_by"]]
    every = [(number, effect) for number, effect in every if actions(said)[number - 1] != "left"]
    several = sum(bool(effect["commands"]) for _, effect in every) > 1
    for place, (number, effect) in enumerate(sorted(every, key=lambda one: -nats(one[1]))):
        key = "separate" if not several or not effect["commands"] else "separate_later" if place else "separate_first"
        key = key if tells_enough(effect) or key == "separate_later" else "separate_little"
        yield f"{number}, {say(key, language, text=proposal(effect, language))}"
    for number, row in _structure(said):
        for one in row["open"]:
            laws = [" + ".join(name_of(label, "gauge", language) for label in law["labels"]) for law in one["laws"]]
            told = {"laws": listed(laws, "or", language), "text": proposal(one, language)}
            yield f"{number}, {say('tell_laws' if laws else 'separate', language, **told)}"
    if any(one.startswith("stepgauge plan") for one in commands(said)):
        yield say("further", language)
    at = subject(said)
    changed = [one for one in zip(said["effects"], actions(said), strict=True) if one[1] != "left"]
    if at.of != "axis" and (said["unexplained"] or changed) and not limits_of_machine(said):
        only_file = not (said["unexplained"] or at.corrected) and all(
            is_of_file(effect, what) for effect, what in changed
        )
        yield say("compare_file" if only_file and at.of == "gauge" else f"compare_{at.of}", language)


def nats(one: Said) -> float:
    """What the measurement that a finding proposes is expected to decide; of an older file not known."""
    return float(one.get("expected_information_nats", 0.0))


def tells_enough(one: Said) -> bool:
    """Whether what is proposed is expected to tell a good part of which cause it is; of an older file not known."""
    if not one.get("commands") or "expected_information_nats" not in one:
        return True
    shares = [float(each["conditional_probability"] or 0.0) for each in one.get("set", ())]
    open_nats = sum(-p * math.log(p) for p in (*shares, 1.0 - sum(shares)) if 0.0 < p < 1.0)
    return nats(one) >= TELLING_PART * open_nats


def proposal(one: Said, language: str) -> str:
    """A further measurement without its commands, which stand below."""
    said = _WORD.sub(lambda match: name_of(match[0]), without(one["separate_by"], one["commands"]))
    return said if language == "en" else translate_message(said)


def _remedy_of_row(row: Said, said: Said, language: str = "en") -> Wording:
    on = [covariate_name(row[key], language=language) for key in ("covariate", "beside") if row.get(key)]
    warms = subject(said).machine in STEPPERS and row["covariate"] in COURSE
    return remedy_of_structure(row["forms"], row["covariate"], listed(on, language=language), language, warms)


def found_part(said: Said, *more: Block | None, language: str = "en") -> dict[str, Any]:
    """The part with the table of findings: each cause with its own value, uncertainty, probability and instruction."""
    rows, action = list[list[str]](), actions(said)
    inner: list[int] = []
    left_out = 0
    for number, effect in enumerate(said["effects"], 1):
        p = _member_probability(members_of(effect)[0], effect)
        rows.append(_row(str(number), effect, p, said, language, action[number - 1] in ("check", "enter", "repair")))
        rivals = _rivals(said, effect)
        left_out += max(len(members_of(effect)) - 1 - len(rivals), 0)
        for one in rivals:
            inner.append(len(rows))
            rows.append(_row("or", one, _member_probability(one, effect), said, language))
        others, left = combinations(effect, language)
        if others and left >= 1.0 - SURE:
            inner.append(len(rows))
            rows.append(_together_row(others, left))
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

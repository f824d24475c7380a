"""What to do first after any diagnosis: check, enter, repair, measure again or stop; from its ``diagnosis.json``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

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
    finding_name,
    name_of,
    remedy,
    states_value,
    subject,
)
from stepgauge.diagnosis.wording.limits import lacking, remaining
from stepgauge.diagnosis.wording.notation import (
    COVERAGE,
    is_determined,
    members_of,
    plus_minus,
    symbol,
    told_numbers,
    without,
)
from stepgauge.diagnosis.wording.phrases import covariate_name
from stepgauge.diagnosis.wording.structure import remedy_of_structure
from stepgauge.effects.words import Wording
from stepgauge.files.notation import significant, uncertainty
from stepgauge.languages.messages import translate_message
from stepgauge.reports.blocks import Block, bullets, code, part, words

Said = Mapping[str, Any]
TELLING_PART = 0.25
"""Part of what is open, nats, from which a measurement goes before the checks."""
MOST_RIVALS, MOST_ROWS = 4, 8
"""Rivals of a finding, and rows of the table, on the first page; the appendix has all."""
MOST_SIZES = 4
"""Numbers of a finding that its repair repeats; of more it is too long to read."""
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
        members = [effect, *shown_rivals(said, effect)]
        first = dict.fromkeys(remedy(one, at, language).check for one in members)
        for text in first:
            one = next(each for each in members if remedy(each, at, language).check == text)
            name = finding_name(one, at, language)
            which = name if one is effect else say("or_member", language, name=name)
            yield f"{number}{f', {which}' if len(members) > 1 else ''}: {text}"
    for number, row in structure_rows(said):
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
    left = list(structure_rows(said))
    if left:
        yield f"{', '.join(str(number) for number, _ in left)}: {_remedy_of_row(left[0][1], said, language).repair}"


def _entered(said: Said, language: str) -> Iterator[str]:
    """The numbers to enter; none before what spoils them is mended and measured again; what they do not wait for."""
    if waiting := _numbers_of("wait", said):
        spoiling = [number for number, one in enumerate(said["effects"], 1) if spoils(one)]
        course = {one["covariate"] for one in said["unexplained"] if spoils(one)}
        spoiling += [number for number, row in structure_rows(said) if row["covariate"] in course]
        yield f"{', '.join(map(str, waiting))}: {say('wait', language, numbers=_numbers(spoiling, language))}"
    for number in _numbers_of("unknown", said):
        effect = said["effects"][number - 1]
        open_text = say("not_known", language, most=_most(effect, said, language))
        yield f"{number}: {_size(effect, said, language)}{open_text}"
    yield from _remedies("enter", said, language)
    entered, open_ = _numbers_of("enter", said), _numbers_of("check", said)
    if entered and (open_ := [*open_, *(number for number, _ in structure_rows(said))]):
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


def structure_rows(said: Said) -> Iterator[tuple[int, Said]]:
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
    for number, row in structure_rows(said):
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


def shown_rivals(said: Said, effect: Said) -> list[Said]:
    """The rivals of a finding for the first page, the most probable first: one, or more where findings are few."""
    sets = sum(len(members_of(one)) > 1 for one in said["effects"])
    room = (MOST_ROWS - len(said["effects"])) // max(sets, 1)
    return members_of(effect)[1:][: min(max(room, 1), MOST_RIVALS)]

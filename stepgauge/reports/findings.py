"""The first page of any diagnosis: what to do first, then what was found with its rivals.

It is made from a ``diagnosis.json``, whatever was diagnosed; :class:`Words` holds what differs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stepgauge.diagnosis.wording.headline import chosen, in_place_of
from stepgauge.diagnosis.wording.limits import remaining
from stepgauge.diagnosis.wording.notation import (
    COVERAGE,
    direction_words,
    listed,
    members_of,
    misfit,
    name_of,
    plus_minus,
    probability,
    without,
)
from stepgauge.diagnosis.wording.remedies import Remedy, remedy, remedy_of_form
from stepgauge.diagnosis.wording.structure import SCATTER
from stepgauge.effects import effect_kinds
from stepgauge.reports.blocks import Block, bullets, code, part, table, words

Said = Mapping[str, Any]
MOST_RIVALS, MOST_ROWS, MOST_NUMBERS = 4, 8, 8
"""Rivals of a finding, rows of the table, and numbers of a finding, on the first page; the appendix has all."""
FOUND = ("", "Cause", "Value", "u", "Probability", "What it means; repair")
_SHARES = (0.0, 1.5, 0.0, 0.0, 0.0, 5.0)
UNKNOWN_NAME = "structure without a known law"
_WORD = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")
_FIRST = "Do not adjust anything before the checks have told which of the causes of a finding it is."
_MISFIT = "Nothing: alone, without what has no known law, the named effects do not explain the readings."


def _named(effect: Said) -> str:
    """A finding with its choices: axis, plane, face."""
    choices = [direction_words(one) if isinstance(one, list) else str(one) for one in chosen(effect)]
    return " ".join([name_of(effect["kind"]), *choices])


def _member(one: Said) -> str:
    return name_of(one["label"])


@dataclass(frozen=True)
class Words:
    """``name`` of an effect, ``member`` of a set; ``of``: what was diagnosed (see :func:`remedy`); ``lacking``: of it.

    ``compare``: how a further measurement is compared with this one.
    """

    lacking: Sequence[str] = ()
    name: Callable[[Said], str] = _named
    member: Callable[[Said], str] = _member
    of: str = "gauge"
    compare: str = ""


def do_first(said: Said, told: Words) -> dict[str, Any]:
    """The part that says what to do: check, repair, measure again."""
    return part("What to do first", *_steps(said, told))


def _steps(said: Said, told: Words) -> Iterator[Block]:
    if said["verdict"] == "adequate":
        yield words("Nothing: no named effect is needed, and nothing is left beyond the scatter.")
        return
    checks, repairs = list(_checks(said, told)), list(_repairs(said, told))
    if checks:
        yield bullets(checks, "Check")
    if repairs:
        yield bullets(repairs, "Repair")
    again = list(_again(said, told))
    if again:
        yield bullets(again, "Measure again")
    if found := commands(said):
        yield code(*found, language="sh")


def first_lines(said: Said, told: Words) -> list[str]:
    """The same in lines for a terminal, each with the word for what it is."""
    verbs = (("check", _checks), ("repair", _repairs), ("measure again", _again))
    found = [f"{verb}: {text}" for verb, told_by in verbs for text in told_by(said, told)]
    return found + commands(said)


def commands(said: Said) -> list[str]:
    """The commands of all measurements that are proposed, each once."""
    every = (*said["effects"], *said["unexplained"])
    return list(dict.fromkeys(command for one in every for command in one.get("commands", ())))


def _checks(said: Said, told: Words) -> Iterator[str]:
    for number, effect in enumerate(said["effects"], 1):
        members = [effect, *_rivals(said, effect)]
        several = len(members) > 1
        seen = dict.fromkeys(_remedy(one, told).check for one in members)
        for text in seen:
            first = next(one for one in members if _remedy(one, told).check == text)
            which = told.name(effect) if first is members[0] else f"or {told.member(first)}"
            yield f"{number}{f', {which}' if several else ''}: {text}"
    for number, row in _forms(said):
        yield f"{number}: {_of_form(row).check}"
        yield from (f"{number}, or {names}: {check}" for names, check in _checks_of_laws(row))


def _checks_of_laws(row: Said) -> Iterator[tuple[str, str]]:
    """Laws that the readings do not exclude in the place of a structure, with what to check of each."""
    for one in row["open"]:
        for label in dict.fromkeys(label for law in one["laws"] for label in law["labels"]):
            kind = max((kind for kind in effect_kinds() if label.startswith(kind)), key=len, default=label)
            choice = {"value": label.removeprefix(kind).strip("_")}
            yield name_of(label), remedy(kind, {"axis": choice, "plane": choice}).check


def _repairs(said: Said, told: Words) -> Iterator[str]:
    """What to repair by finding; findings of which the cause is not known yet are named together."""
    unsure = [n for n, effect in enumerate(said["effects"], 1) if _has_rivals(effect)]
    if any(misfits(said)):
        unsure = list(range(1, len(said["effects"]) + 1))
        yield f"{', '.join(map(str, unsure))}: {_MISFIT}"
    elif unsure:
        yield f"{', '.join(map(str, unsure))}: {_FIRST}"
    for number, effect in enumerate(said["effects"], 1):
        if number not in unsure:
            yield f"{number}: {_remedy(effect, told).repair}"
    forms = list(_forms(said))
    if forms:
        yield f"{', '.join(str(number) for number, _ in forms)}: {_of_form(forms[0][1]).repair}"


def misfits(said: Said) -> Iterator[str]:
    """That the named effects of a recording make the residuals no smaller."""
    before_um, after_um = (said["fit"].get(f"rms_{when}_um") for when in ("before", "after"))
    if said["effects"] and before_um is not None and after_um is not None:
        yield from misfit(before_um, after_um)


def _forms(said: Said) -> Iterator[tuple[int, Said]]:
    """What is left without a known law, numbered on from the effects."""
    return enumerate(remaining(said["unexplained"]), len(said["effects"]) + 1)


def _has_rivals(effect: Said) -> bool:
    several = len(members_of(effect)) > 1 or effect["confounded_with"] or effect["alternatives"]
    return bool(several or effect.get("aliases"))


def _again(said: Said, told: Words) -> Iterator[str]:
    yield from (text for text in told.lacking if said["verdict"] == "insufficient")
    for number, effect in enumerate(said["effects"], 1):
        if effect["separate_by"]:
            separate = without(effect["separate_by"], effect["commands"])
            yield f"{number}, what would separate the causes: {_WORD.sub(_spaced, separate)}"
    for number, row in _forms(said):
        for one in row["open"]:
            laws = listed([" and ".join(map(name_of, law["labels"])) for law in one["laws"]], "or")
            place = one["separate_by"].split(": stepgauge")[0]
            yield f"{number}, what would tell whether it is {laws}: {_WORD.sub(_spaced, place)}"
    if said["verdict"] != "insufficient" and told.compare:
        yield told.compare


def _spaced(match: re.Match[str]) -> str:
    return name_of(match[0])


def _of_form(row: Said) -> Remedy:
    both = f"{row['covariate']} and {row['beside']}" if row.get("beside") else str(row["covariate"])
    return remedy_of_form(row["forms"], both)


def _remedy(effect: Said, told: Words) -> Remedy:
    return remedy(effect["kind"], effect["parameters"], told.of, aliased=bool(effect.get("aliases")))


def found_part(said: Said, told: Words, *more: Block | None) -> dict[str, Any]:
    """The part with the table of findings: each cause with its own value, uncertainty, probability and instruction."""
    rows: list[list[str]] = []
    inner: list[int] = []
    left_out = 0
    for number, effect in enumerate(said["effects"], 1):
        rows.append(_row(str(number), told.name(effect), effect, _of_set(members_of(effect)[0], effect), told))
        rivals = _rivals(said, effect)
        left_out += max(len(members_of(effect)) - 1 - len(rivals), 0)
        for one in rivals:
            inner.append(len(rows))
            rows.append(_row("or", told.member(one), one, _of_set(one, effect), told))
        others, p = combinations(effect)
        if others:
            inner.append(len(rows))
            rows.append(_together_row(others, p))
    rows += [_form_row(row, number) for number, row in _forms(said)]
    if not rows:
        return part("What was found", words(_nothing(said)), *more)
    listed = table(FOUND, rows, _SHARES, inner, _note(said, left_out))
    against = [f"Known laws in place of what has none: {why}." for why in said["refuted"]]
    return part("What was found", listed, *(words(text) for text in against if said["unexplained"]), *more)


def _rivals(said: Said, effect: Said) -> list[Said]:
    """The rivals of a finding for the first page, the most probable first: one, or more where findings are few."""
    sets = sum(len(members_of(one)) > 1 for one in said["effects"])
    room = (MOST_ROWS - len(said["effects"])) // max(sets, 1)
    return members_of(effect)[1:][: min(max(room, 1), MOST_RIVALS)]


def _of_set(one: Said, effect: Said) -> float | None:
    """Probability of a member of a set; None where only that of the first one is known."""
    return None if one["share"] is None else float(one["share"] * effect["probability"])


def combinations(effect: Said) -> tuple[list[str], float]:
    """What may be instead of a finding and is no member of its set: several laws, or one for several findings.

    Their names, and the probability that is left for all of them.
    """
    members = members_of(effect)
    known = {one["kind"] for one in members}
    left = float(effect["probability"]) - sum(_of_set(one, effect) or 0.0 for one in members)
    others = {**effect, "confounded_with": [name for name in effect["confounded_with"] if name not in known]}
    return in_place_of(others), max(left, 0.0)


def _together_row(others: Sequence[str], p: float) -> list[str]:
    text = "In place of this finding, or of this and others: see the appendix. No size is told."
    return ["or", "; ".join(others), "", "", probability(p), text]


def _row(first: str, name: str, one: Said, p: float | None, told: Words) -> list[str]:
    text = f"{one['in_practice']} Repair: {_remedy(one, told).repair}"
    where = f" Acts {one['where']}." if one.get("where") else ""
    return [first, name, values(one), uncertainties(one), "" if p is None else probability(p), text + where]


def _form_row(row: Said, number: int) -> list[str]:
    text = f"{row['where']}. Its cause is not known."
    name = row["form"] if row.get("form") in SCATTER else f"{UNKNOWN_NAME}: {row['covariate']}"
    return [str(number), name, "", "", probability(row["probability"]), text]


def _numbers(one: Said) -> Iterator[tuple[str, Said]]:
    """The numbers with an uncertainty; of very many the ones that are determined, all are in the appendix."""
    known = [(name, p) for name, p in one["parameters"].items() if "unit" in p and p.get("u")]
    yield from known if len(known) <= MOST_NUMBERS else (each for each in known if _is_determined(each[1]))


def _is_determined(parameter: Said) -> bool:
    return bool(abs(parameter["value"]) > COVERAGE * parameter["u"])


def values(one: Said) -> str:
    """The numbers that were fitted, one to a line, with as many digits as their standard uncertainty has.

    A name stands before each where there are several; what the unit says is left out of it.
    """
    numbers = list(_numbers(one))
    return "\n".join(f"{_symbol(name, p, len(numbers))}{_digits(p)[0]} {_unit(p)}".strip() for name, p in numbers)


def uncertainties(one: Said) -> str:
    """Their standard uncertainties, in the same order."""
    return "\n".join(f"{_digits(p)[1]} {_unit(p)}".strip() for _, p in _numbers(one))


def _symbol(name: str, parameter: Said, count: int) -> str:
    stem = name.removesuffix(str(parameter["unit"]).replace("/", "_per_")).strip("_").replace("_", " ")
    return "" if count == 1 else f"{stem or 'size'} "


def _digits(parameter: Said) -> tuple[str, str]:
    """The value and its standard uncertainty, to two digits of the latter."""
    text = plus_minus({**parameter, "u": parameter["u"] / COVERAGE, "unit": ""})
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
        tested = "No statement is likelier than not: see the probabilities."
        return tested if said["odds"] else "Nothing could be tested: the noise is not known well enough."
    return "No systematic effect, and no structure, is more probable than scatter alone."

"""What a diagnosis says in a sentence and what to do first, from its keys and values, in the language of the page.

In English the program's own sentences are shown. In another language they are made anew from what ``diagnosis.json``
states: nothing is translated from English.
"""

from __future__ import annotations

import string
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from stepgauge.web.texts import Words

Said = Mapping[str, Any]


@cache
def remedies() -> Mapping[str, Mapping[str, Sequence[str]]]:
    """Check and repair by what was diagnosed (gauge, axis, map) and by kind, in German."""
    with Path(__file__).with_name("remedies.toml").open("rb") as file:
        return tomllib.load(file)


def subject(said: Said) -> str:
    """What was diagnosed: the recording of a gauge, of an axis, or the map of a probe."""
    return "axis" if "axis" in said else "map" if "map" in said["inputs"] else "gauge"


def remedy(words: Words, effect: Said, of: str) -> tuple[str, str]:
    """What to check and what to repair for a finding."""
    known = remedies()[of].get(effect["kind"]) or remedies()["gauge"].get(effect["kind"])
    if known is None:
        return words("diagnosis.check_unknown"), words("diagnosis.repair_unknown")
    values = {name: _value(words, one["value"]) for name, one in effect["parameters"].items() if "value" in one}
    check, repair = (_filled(text, values) for text in known)
    return check, repair


def _value(words: Words, value: Any) -> str:
    if value == "all":
        return words("diagnosis.all_axes")
    return words.decimal(f"{value:.5g}") if isinstance(value, float) else str(value)


def _filled(text: str, values: Mapping[str, str]) -> str:
    names = [name for _, name, _, _ in string.Formatter().parse(text) if name]
    return text.format(**{name: "" if name == "aliases" else values.get(name, name.split("_")[0]) for name in names})


def summary(words: Words, said: Said) -> str:
    """The findings below the verdict, and the residuals before and after."""
    names = [f"{words.effect(one['label'])} ({words.number(100 * one['probability'], 0)} %)" for one in said["effects"]]
    text = f"{', '.join(names)}." if names else ""
    before, after = ((said["fit"].get(f"rms_{when}_um")) for when in ("before", "after"))
    if before is None or after is None:
        return text
    return f"{text} {words('diagnosis.fit', before=words.number(before), after=words.number(after))}"


def steps(words: Words, said: Said) -> list[dict[str, Any]]:
    """What to check, to repair and to measure again, as lists with their titles."""
    if said["verdict"] == "adequate":
        return [{"kind": "words", "text": words("diagnosis.nothing_to_do")}]
    lists = {words("diagnosis.to_check"): _checks(words, said), words("diagnosis.to_repair"): _repairs(words, said)}
    found = {title: list(items) for title, items in lists.items()}
    return [{"kind": "bullets", "title": title, "items": items} for title, items in found.items() if items]


def _checks(words: Words, said: Said) -> Iterator[str]:
    for number, effect in enumerate(said["effects"], 1):
        members = [effect, *effect["set"]]
        for one in members:
            check, _ = remedy(words, {**effect, **one}, subject(said))
            which = f", {words.effect(one['label'])}" if len(members) > 1 else ""
            yield f"{number}{which}: {check}"
    if said["unexplained"]:
        yield words("diagnosis.check_form")


def _repairs(words: Words, said: Said) -> Iterator[str]:
    """What to repair; where a finding has rivals, nothing before the checks."""
    for number, effect in enumerate(said["effects"], 1):
        unsure = effect["set"] or effect["confounded_with"] or effect["alternatives"]
        yield f"{number}: {words('diagnosis.repair_first') if unsure else remedy(words, effect, subject(said))[1]}"
    if said["unexplained"]:
        yield words("diagnosis.repair_form")

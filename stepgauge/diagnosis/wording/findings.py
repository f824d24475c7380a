"""What a finding is called, what it means, what to check and to repair, in English or German.

The words are those that its effect declares (:class:`stepgauge.effects.words.Wording`), filled with the values that a
``diagnosis.json`` states. Nothing is translated or rewritten: a sentence is composed in its language from these.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from stepgauge.axis.units import AxisUnits
from stepgauge.diagnosis.wording.aliases import aliases_words
from stepgauge.diagnosis.wording.catalogue import listed, say, words
from stepgauge.diagnosis.wording.notation import is_determined
from stepgauge.effects import Effect, effect_kinds
from stepgauge.effects.words import FACTOR, UNCERTAIN, Wording, direction_words, filled

Said = Mapping[str, Any]
NO_CHOICE = ("start_s", "pause_s", "about_mm")
"""Parameters of the computation that are not part of the name of a law."""
PER_TURN, WHOLE = ("turn_1", "turn_2", "turn_3", "turn_3"), 1e-6
"""The words for one, two, .. periods in a turn, and the angle, deg, by which these may differ from a turn."""


@dataclass(frozen=True)
class Subject:
    """What was diagnosed: ``of`` a recording of a ``gauge``, of an ``axis`` by itself, or the ``map`` of a probe.

    ``position``, ``deviation``: the units in which it is told; ``form``: of an axis, ``axis``, ``spot`` or
    ``distances``; ``both_ways``: whether it was read in both directions of travel; ``machine``: the kind of machine;
    ``pretravel_um``: the one that its file states; ``corrected``: whether the readings had been corrected for the tip,
    so that it has no part in them; ``files``: the recording of each placement, where it has its own.
    """

    of: str = "gauge"
    position: str = "mm"
    deviation: str = "um"
    form: str = ""
    both_ways: bool = True
    machine: str = ""
    pretravel_um: float | None = None
    corrected: bool = False
    files: tuple[tuple[int, str], ...] = ()

    @property
    def worded(self) -> str:
        """Of what a sentence is told."""
        return "corrected" if self.corrected else self.of

    def key(self, name: str) -> str:
        """The name of a number in the user's units: ``period_mm`` as ``period_deg``."""
        return AxisUnits(self.position, self.deviation).key(name)


GAUGE, MAP = Subject(), Subject("map")
CHOICES: Mapping[str, str] = {
    "all": "aller Achsen",
    "whole": "insgesamt",
    "varying": "je nach Richtung",
    "once": "einmal",
    "anew": "jedes Mal",
    "first": "erster Arm",
    "second": "zweiter Arm",
    "third": "dritter Arm",
    "gauge": "des Stufenendmaßes",
    "position": "über der Position",
    "speed": "über der Geschwindigkeit",
    "time": "über der Zeit",
}
"""The choices of effects that are words, and how they are said behind a name in German."""
STEPPERS = ("machine tool", "printer")
"""Kinds of machines whose controllers are set by steps per mm and a backlash."""


def subject(said: Said) -> Subject:
    """What a ``diagnosis.json`` is of."""
    if "axis" in said:
        axis = said["axis"]
        ways = bool(axis["both_ways"]) and axis["form"] == "axis"
        return Subject("axis", axis["unit"], axis["deviation_unit"], axis["form"], ways)
    inputs = said["inputs"]
    if "map" in inputs:
        return MAP
    machine, placements = inputs.get("machine", {}), said.get("measured", {}).get("placements", ())
    files = tuple((one["placement"], one["recording"]) for one in placements if one.get("recording"))
    corrected, known_um = bool(inputs.get("tip_corrected")), machine.get("pretravel_um")
    return replace(GAUGE, machine=machine.get("kind") or "", pretravel_um=known_um, corrected=corrected, files=files)


def words_of(kind: str, of: str = "gauge", language: str = "en") -> Wording:
    """The words that a kind declares for a recording of a gauge (``corrected`` or not), an axis or a probe's map."""
    known, declared = _effects().get(kind), words("finding").get(kind)
    if of == "map" and kind in words("map"):
        declared = words("map")[kind]
    elif known is not None:
        declared = known.words_at(of)
    return (declared or words("finding")["unknown"]).said_in(language)


def _effects() -> Mapping[str, type[Effect]]:
    return effect_kinds(every=True)


def name_of(label: str, of: str = "gauge", language: str = "en") -> str:
    """A law by its kind, or by its label, which has its choices behind the kind: ``scale_error_x``."""
    kind = _kind_of(label, tuple(_effects()))
    name = words_of(kind, of, language).name or kind.replace("_", " ")
    more = "" if of == "axis" else label.removeprefix(kind).replace("_", " ")
    return " ".join([name, *(_choice(one, language) for one in more.split())])


def _choice(word: str, language: str) -> str:
    return word if language == "en" else CHOICES.get(word, word)


def kind_and_choice(label: str) -> tuple[str, str]:
    """The kind of a law by its label, and its axis or plane."""
    kind = _kind_of(label, tuple(_effects()))
    return kind, label.removeprefix(kind).strip("_")


@cache
def _kind_of(label: str, effects: tuple[str, ...]) -> str:
    known = (*effects, *words("finding"), *words("map"))
    return max(
        (one for one in known if label == one or label.startswith((f"{one}_", f"{one} "))), key=len, default=label
    )


def finding_name(effect: Said, at: Subject = GAUGE, language: str = "en") -> str:
    """A finding with its choices, as far as these tell it from others of its kind: axis, plane, face, direction."""
    if at.of != "gauge":
        name = name_of(effect["label"], at.of, language)
        period = effect["parameters"].get("period_deg") if at.of == "axis" else None
        turns = _turns({"period_mm": period}, language) if period else ""
        return f"{name} ({turns})" if turns else name
    named = effect["parameters"].items()
    choices = [
        dict(at.files).get(p["value"], p["value"]) if name == "placement" else p["value"]
        for name, p in named
        if "unit" not in p and name not in ("rows", *NO_CHOICE)
    ]
    words = [_choice(direction_words(_text(one)), language) for one in choices]
    return " ".join([name_of(effect["kind"], at.of, language), *words])


def _text(value: Any) -> Any:
    return value if isinstance(value, list) else str(value)


def describe_rivals(
    kinds: Iterable[str], combinations: Sequence[Sequence[str]], of: str = "gauge", language: str = "en"
) -> list[str]:
    """What may be in place of a finding, in words; several laws together by their labels, which have the axes.

    ``kinds``: as ``confounded_with`` has them, ``a + b`` for two together; ``combinations``: the labels of these.
    """
    found: list[str] = []
    for kind in kinds:
        parts = sorted(kind.split(" + "))
        same = [sorted(laws) for laws in combinations if len(laws) == len(parts) > 1]
        alike = [laws for laws in same if all(map(str.startswith, laws, parts))]
        found += [" + ".join(name_of(label, of, language) for label in laws) for laws in alike or [parts]]
    return list(dict.fromkeys(found))


def meaning(one: Said, at: Subject = GAUGE, language: str = "en") -> str:
    """What a finding, or one of its set, means: sentences with its values, in the units of the diagnosis."""
    declared = words_of(one["kind"], at.worded, language).means or _equation(one["kind"])
    part = say("only_where", language, where=one["where"]) if one.get("where") else ""
    aliases = aliases_words(one.get("aliases", {}), language)
    return part + filled(declared, _values(one, at, language), language) + aliases


def _equation(kind: str) -> str:
    known = _effects().get(kind)
    text = f"{kind.replace('_', ' ')}." if known is None else f"{known.title()}: {known.equation}."
    return text.replace("{", "{{").replace("}", "}}")


def remedy(one: Said, at: Subject = GAUGE, language: str = "en") -> Wording:
    """What to check by other means, and what to repair once that confirms a finding."""
    declared, unknown = words_of(one["kind"], at.worded, language), words("finding")["unknown"].said_in(language)
    values = _values(one, at, language)
    check, repair = (declared.check or unknown.check, declared.repair or unknown.repair)
    return Wording(check=filled(check, values, language), repair=filled(repair, values, language))


def check_of(label: str, at: Subject = GAUGE, language: str = "en") -> str:
    """What to check of a law of which only the label is known: its kind and choice, and no numbers."""
    kind, choice = kind_and_choice(label)
    return remedy({"kind": kind, "parameters": _choices(kind, choice)}, at, language).check


def _choices(kind: str, choice: str) -> dict[str, Said]:
    """The choice of a label by the names that it may have in the texts of its kind."""
    known = _effects().get(kind)
    names = [] if known is None else [one.name for one in known.parameters() if one.role == "choice"]
    return {name: {"value": choice} for name in names if choice}


def states_value(kind: str, of: str = "gauge") -> bool:
    """Whether the repair of a kind is to enter a number that it states with its uncertainty."""
    return UNCERTAIN in words_of(kind, of).repair or f":{FACTOR}}}" in words_of(kind, of).repair


def _per_turn(values: Mapping[str, Said]) -> int:
    """How often something repeats in a turn, as a whole number."""
    period = float(values.get("period_mm", {}).get("value") or 0.0)
    return round(360.0 / period) if period else 0


def _turns(values: Mapping[str, Said], language: str) -> str:
    """How often something repeats in a turn; of a whole number that is known beforehand what it is usual for, too."""
    stated = values.get("period_mm", {})
    period = float(stated.get("value") or 0.0)
    count = _per_turn(values)
    if not count:
        return ""
    if stated.get("u") is None and count <= len(PER_TURN) and abs(count * period - 360.0) < WHOLE:
        return say(PER_TURN[count - 1], language, count=count)
    return say("turn", language) if count == 1 else say("turns", language, count=count)


def _values(one: Said, at: Subject, language: str) -> dict[str, Said]:
    """The values of a template by the names that its effect declares."""
    stated = one["parameters"]
    values: dict[str, Said] = dict(stated)
    known = _effects().get(one["kind"])
    for each in () if known is None else known.parameters():
        values[each.name] = stated.get(each.name) or stated.get(at.key(each.name)) or {"value": None}
    sure = [name for name, p in stated.items() if p.get("u") and is_determined(p)]
    values["determined"] = {"value": listed([name_of(name) for name in sure])}
    values["turns"] = {"value": _turns(values, language) if at.position == "deg" else None}
    count = _per_turn(values) if at.position == "deg" else 0
    values["seat"] = {"value": 0 < count <= len(PER_TURN)}
    values["gear"], values["scale"] = {"value": count > len(PER_TURN)}, {"value": count == 0}
    values["steps"] = {"value": at.machine in STEPPERS}
    if (number := values.get("placement", {}).get("value")) in dict(at.files):
        values["placement"] = {"value": dict(at.files)[number]}
    more, known_um = stated.get("um", {}), at.pretravel_um
    new_um = (more["value"] + known_um) if more and known_um is not None else -1.0
    values["new_um"] = {**more, "value": new_um if new_um >= 0.0 else None}
    values["aliases"] = {"value": bool(one.get("aliases"))}
    values["largest"] = {"value": one.get(at.key("largest_um")), "unit": at.deviation}
    return values

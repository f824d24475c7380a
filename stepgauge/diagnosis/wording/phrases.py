"""Phrases: a key of the catalogue with its values, which is put into words once, for whoever reads it.

What a diagnosis says of structure without a law, of its predictive check and of itself is kept as phrases in
``diagnosis.json``: numbers with their units, covariates and laws by their names. Words follow from these, in the units
and terms of a gauge or of an axis, in English or German.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.wording.catalogue import listed, say, sentences
from stepgauge.diagnosis.wording.findings import GAUGE, Subject, name_of
from stepgauge.diagnosis.wording.notation import times_text
from stepgauge.effects.words import filled

Phrase = Mapping[str, Any]
COVARIATES = {
    "position": "Position",
    "machine x": "Maschinenachse x",
    "machine y": "Maschinenachse y",
    "machine z": "Maschinenachse z",
    "face": "Fläche",
    "pair": "Blockpaar",
    "cycle": "Zyklus",
    "placement": "Lage",
    "order": "Reihenfolge",
    "time": "Zeit",
    "speed": "Geschwindigkeit",
    "azimuth": "Antastrichtung",
    "direction": "Antastrichtung",
    "direction of travel": "Fahrtrichtung",
    "way since turning round": "Weg seit der Umkehr",
    "rest before the touch": "Pause vor der Antastung",
    "target": "Ziel",
    "time since the reading before": "Zeit seit dem Wert davor",
}
"""German names; other covariates are columns of the recording."""
AT_AXIS = {
    "machine x": "position",
    "face": "target",
    "rest before the touch": "time since the reading before",
    "touches since a pause": "readings since a pause",
}
TOUCHES = "touches since a pause"


def number(value: float, unit: str = "") -> dict[str, Any]:
    """A number of a phrase."""
    return {"value": float(value), "unit": unit}


def misfit(before_um: float, after_um: float) -> Iterator[Phrase]:
    """That named effects do not reduce the residuals, which must not be overlooked."""
    if after_um > before_um:
        yield {"say": "do_not_enter", "before": number(before_um, "um"), "after": number(after_um, "um")}


def covariate_name(name: str, at: Subject = GAUGE, language: str = "en") -> str:
    """What a covariate is called in a recording of a gauge or of an axis."""
    if at.of == "axis":
        name = (
            f"{AT_AXIS[TOUCHES]}{name.removeprefix(TOUCHES)}" if name.startswith(TOUCHES) else AT_AXIS.get(name, name)
        )
        name = {"position": "distance", "target": "pair"}.get(name, name) if at.form == "distances" else name
    return COVARIATES.get(name, name) if language == "de" else name


def worded(phrases: Phrase | str | Sequence[Phrase], at: Subject = GAUGE, language: str = "en") -> str:
    """Phrases in words, one after the other; text stays as it is."""
    if isinstance(phrases, str):
        return phrases
    every = [phrases] if isinstance(phrases, Mapping) else phrases
    return ", ".join(filter(None, (_one(each, at, language) for each in every)))


def structure_words(one: Mapping[str, Any], at: Subject = GAUGE, language: str = "en") -> str:
    """Structure without a law, as a ``diagnosis.json`` has it, in words."""
    return worded(one["phrases"], at, language) if one.get("phrases") else str(one["where"])


def nearest_law(one: Mapping[str, Any], at: Subject = GAUGE, language: str = "en") -> str:
    """The odds against the laws that come nearest to structure without one; empty where none does."""
    if not one.get("laws"):
        return ""
    laws, times = one["laws"][0]["labels"], times_text(1.0 / max(one["laws"][0]["odds"], 1e-300), language)
    say = {"say": "nearest", "law": laws[0]} if len(laws) == 1 else {"say": "nearest_laws", "laws": laws}
    return worded({**say, "times": times}, at, language)


def worded_all(phrases: Iterable[Phrase | str], at: Subject = GAUGE, language: str = "en") -> list[str]:
    """Each phrase in words."""
    return [worded(one, at, language) for one in phrases]


def _one(phrase: Phrase, at: Subject, language: str) -> str:
    key = f"{phrase['say']}_{at.of}"
    if key in sentences() and at.of == "axis" and phrase["say"] in ("gauge", "approach") and not at.both_ways:
        return ""
    template = say(key if key in sentences() else phrase["say"], language)
    return filled(template, {name: _value(name, one, at, language) for name, one in phrase.items()}, language)


def _value(name: str, value: Any, at: Subject, language: str) -> Mapping[str, Any]:
    if isinstance(value, Mapping):
        return value
    if name in ("covariate", "beside"):
        value = covariate_name(value, at, language)
    elif name == "covariates":
        value = listed([covariate_name(one, at, language) for one in value], "or", language)
    elif name == "law":
        value = name_of(value, at.of, language)
    elif name == "laws":
        value = listed([name_of(one, at.of, language) for one in value], "and", language)
    return {"value": value}

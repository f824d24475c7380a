"""What readers and verbs say, in the language of the page: templates of the code with their German (``messages.toml``).

A message is recognized by the words between its gaps; what fills the gaps is put into the German words, itself
translated where it is a message, and with the decimal mark of the language. What no template knows stays as it is.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

from stepgauge.files.notation import DEGREES

LANGUAGES = {"en": "English", "de": "Deutsch"}
DEEPEST = 5
"""Messages in the gaps of messages in the gaps."""
OWN_SHARE = 0.35
"""So much of a message is a template's own words, or it may be a list of messages."""
_POINT = re.compile(r"(?<![\w./:'\"=-])(?<!= )([-+−]?\d+)\.(\d+)(?![\w./'\"])")
_QUOTED = re.compile(r"""('[^']*'|"[^"]*")""")
_MICRO = re.compile(r"(?<=\d )u(?=m\b|rad\b)")
_ROW = re.compile(r"\brow (?=\d)")
_JOINTS = ("; ", ": ", ", ", " (")


@cache
def texts() -> Mapping[str, tuple[str, ...]]:
    """Texts of the page by their keys, ``"nav.project"``, in the order of :data:`LANGUAGES` (``texts.toml``)."""
    with Path(__file__).with_name("texts.toml").open("rb") as file:
        return {f"{part}.{key}": tuple(said) for part, keys in tomllib.load(file).items() for key, said in keys.items()}


@cache
def catalogue() -> Mapping[str, str]:
    """German by English; ``{}`` stands for what is filled in."""
    with Path(__file__).with_name("messages.toml").open("rb") as file:
        german: dict[str, str] = tomllib.load(file)["german"]
    return german


@cache
def unchanged() -> frozenset[str]:
    """Texts that are the same in every language: keys, formats, names."""
    with Path(__file__).with_name("messages.toml").open("rb") as file:
        return frozenset(tomllib.load(file)["unchanged"])


@cache
def _sorted_templates() -> tuple[tuple[tuple[str, ...], str], ...]:
    """Templates with gaps as the words between them, those with most words first."""
    known = {**effects(), **catalogue()}
    whole = [(_one_gap(one), _one_gap(german)) for one, german in known.items() if "{}" in one]
    split = [(tuple(one.split("{}")), german) for one, german in whole]
    return tuple(sorted(split, key=lambda one: -_length(one[0])))


@cache
def effects() -> Mapping[str, str]:
    """German names of effects, alone and with their axes, and of sensors."""
    from stepgauge.diagnosis.wording.findings import name_of
    from stepgauge.effects import effect_kinds

    names = {name_of(kind): name_of(kind, language="de") for kind in effect_kinds(every=True)}
    known = {f"{name}{more}": f"{german}{more}" for name, german in names.items() for more in ("", " {}")}
    return {**known, **_sensors()}


def _sensors() -> Mapping[str, str]:
    """German names of sensors, which the fields of the pages have too."""
    from stepgauge.axis.sensors import SENSORS

    named = {kind: texts().get(f"choice_sensor.{kind}") for kind in SENSORS}
    return {SENSORS[kind].words: german[1] for kind, german in named.items() if german}


def _one_gap(text: str) -> str:
    """With one gap for those that stand side by side: where one ends, nobody can tell."""
    return re.sub(r"({}){2,}", "{}", text)


def translate_message(text: str) -> str:
    """A message of the program in German."""
    return _decimal_commas(_ROW.sub("Zeile ", _translated(text, DEEPEST)))


def said_in_german(line: str) -> str:
    """The last line of a verb that failed, whose parts stand one behind the other (see :class:`InputError`)."""
    line = line.removeprefix("stepgauge: error: ")
    head, *more = re.split("; (?=found |expected )", line)
    starts = [0, *(found.end() for found in re.finditer(": ", head))]
    what = max(starts, key=lambda start: _known_words(head[start:]))  # the place stands in front, unless there is none
    parts = [head[:what] + _translated(head[what:], DEEPEST)]
    for one in more:
        word, _, value = one.partition(" ")
        parts.append(f"{'gefunden:' if word == 'found' else 'erwartet:'} {_translated(value, DEEPEST)}")
    return _decimal_commas(_ROW.sub("Zeile ", "; ".join(parts)))


def _translated(text: str, deep: int) -> str:
    if text in catalogue() or text in effects():
        return catalogue().get(text) or effects()[text]
    if not deep or _QUOTED.fullmatch(text):
        return text
    found = _template(text)
    if found is not None and _length(found[0]) >= OWN_SHARE * len(text):
        return _fill_gaps(found, deep)
    return _joined(text, deep, whole=True) or (_fill_gaps(found, deep) if found else _joined(text, deep) or text)


def _template(text: str) -> tuple[tuple[str, ...], str, list[str]] | None:
    """The template with most words of its own that a text has, and what fills its gaps."""
    for words, german in _sorted_templates():
        gaps = _gaps(text, words)
        if gaps is not None:
            return words, german, gaps
    return None


def _fill_gaps(found: tuple[tuple[str, ...], str, list[str]], deep: int) -> str:
    return _filled(found[1], [_translated(one, deep - 1) for one in found[2]])


def _joined(text: str, deep: int, whole: bool = False) -> str:
    """A list of messages, each translated; ``whole``: empty unless each is one."""
    for joint in _JOINTS:
        parts = text.split(joint)
        if len(parts) > 1 and not (whole and any(_known_words(one) < OWN_SHARE * len(one) for one in parts)):
            return joint.join(_translated(one, deep - 1) for one in parts)
    return ""


def _length(words: tuple[str, ...]) -> int:
    return sum(map(len, words))


def _filled(text: str, gaps: Sequence[str]) -> str:
    """With the gaps filled; other braces are the text's own."""
    words = text.split("{}")
    return "".join(part for pair in zip(words, [*gaps, ""], strict=True) for part in pair)


def _known_words(text: str) -> int:
    """How much of a text is a template's own."""
    if text in catalogue() or text in effects():
        return len(text)
    found = _template(text)
    return _length(found[0]) if found else 0


def _gaps(text: str, words: tuple[str, ...]) -> list[str] | None:
    """What stands in the gaps between ``words``; None where the text does not have these words in this order."""
    first, *middle, last = words
    if not (text.startswith(first) and text.endswith(last)) or len(text) < len(first) + len(last):
        return None
    at, end, gaps = len(first), len(text) - len(last), list[str]()
    for one in middle:
        there = text.find(one, at + 1, end)
        if there < 0:
            return None
        gaps.append(text[at:there])
        at = there + len(one)
    gaps.append(text[at:end])
    return gaps


def _decimal_commas(text: str) -> str:
    """Numbers with a decimal comma, outside of quotation marks."""
    return _outside_quotes(lambda one: _POINT.sub(r"\1,\2", one), text)


def print_units(text: str) -> str:
    """Units behind numbers as they are printed, outside of quotation marks: a bracket may begin with a German word."""
    return _outside_quotes(lambda one: DEGREES.sub("°C", _MICRO.sub("µ", one)), text)


def _outside_quotes(change: Callable[[str], str], text: str) -> str:
    parts = _QUOTED.split(text)
    parts[::2] = map(change, parts[::2])
    return "".join(parts)

"""What readers and verbs say, in the language of the page: templates of the code with their German (``messages.toml``).

A message is recognized by the words between its gaps; what fills the gaps is put into the German words, itself
translated where it is a message, and with the decimal mark of the language. What no template knows stays as it is.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, lru_cache, partial
from pathlib import Path

from stepgauge.files.notation import DEGREES

LANGUAGES = {"en": "English", "de": "Deutsch"}
DEEPEST = 5
"""Messages in the gaps of messages in the gaps."""
OWN_SHARE = 0.35
"""So much of a message is a template's own words, or it may be a list of messages."""
MOST = 0.8
"""So much of several sentences is one template's own words."""
_SENTENCE = re.compile(r"(?<=[.]) (?=[^\W\d_a-z]|[–*\u201c])")
_POINT = re.compile(r"(?<![\w./:'\"=-])(?:(?<=\([uU] = )|(?<!= ))([-+−]?\d+)\.(\d+)(?![\w./'\"])")
_WORD = re.compile(r"[^\W\d_]{2}")
_QUOTED = re.compile(r"""('[^']*'|"[^"]*")""")
_WRITTEN = re.compile(r"""'[^']*'|"[^"]*"|[a-z]+_\w+""")
"""What somebody wrote, and keys of files."""
_NO_PROSE = re.compile(r"""'[^']*'|"[^"]*"|--[\w-]+|[\w-]*[_/][\w/.-]*""")
_MICRO = re.compile(r"(?<=\d )u(?=m\b|rad\b)")
_ROW = re.compile(r"\brow (?=\d)")
ENGLISH = re.compile(
    r"\b(the|is|are|not|of|and|or|with|which|than|there|these|those|to|from|at|as|by|it|one|none|no|must|first|also)\b"
)
"""Words of English sentences, and of none of the names, keys and values that fill gaps."""
_BRACKET = " ("
_JOINTS = ("\n", "; ", ": ", ", ", _BRACKET)
_PRINTED_POINT = re.compile(r"(?<![\w./:'\"-])([-+−]?\d+)\.(\d+)(?![\w'\"/]|\.\d)")
_VECTOR = re.compile(r"(?<=\()[-−\d.]+(?:, [-−\d.]+)+(?=\))")
_BETWEEN = re.compile(r"(?<=[\d%°CmKN]) (to|and|or) (?=[-−\d])")
_DAY = re.compile(r"(?<![\w./-])(\d{4})-(\d\d)-(\d\d)(?![\w/-]|\.\w)")


@cache
def texts() -> Mapping[str, tuple[str, ...]]:
    """Texts of the page by their keys, ``"nav.project"``, in the order of :data:`LANGUAGES` (``texts.toml``)."""
    with Path(__file__).with_name("texts.toml").open("rb") as file:
        return {f"{part}.{key}": tuple(said) for part, keys in tomllib.load(file).items() for key, said in keys.items()}


class UntranslatedError(Exception):
    """Some words of a message are in no template."""


@cache
def catalogue() -> Mapping[str, str]:
    """German by English; ``{}`` stands for what is filled in: of messages, of printed pages, of figures."""
    return {**dict(figure_words()), **read_german("printed.toml"), **read_german("messages.toml")}


def read_german(name: str) -> dict[str, str]:
    """German by English of one of the tables: ``messages.toml`` or ``printed.toml``."""
    with Path(__file__).with_name(name).open("rb") as file:
        return dict(tomllib.load(file)["german"])


def figure_words() -> list[tuple[str, str]]:
    """The words of figures of the page, in English and in German."""
    return [(said[0], said[1]) for key, said in texts().items() if key.startswith("figure.")]


@cache
def unchanged() -> frozenset[str]:
    """Texts that are the same in every language: keys, formats, names."""
    with Path(__file__).with_name("messages.toml").open("rb") as file:
        return frozenset(tomllib.load(file)["unchanged"])


@cache
def _sorted_templates() -> tuple[tuple[tuple[str, ...], str], ...]:
    """Templates with gaps as the words between them, those with most words first."""
    whole = [(_one_gap(one), _one_gap(german)) for one, german in known_texts().items() if "{}" in one]
    split = [(tuple(one.split("{}")), german) for one, german in whole]
    return tuple(sorted(split, key=lambda one: -_length(one[0])))


@cache
def known_texts() -> Mapping[str, str]:
    """All texts with their German: those of the catalogue, also as they are set in print, and names of effects."""
    known = {**_diagnosed(), **effects(), **catalogue()}
    return {one.replace(" um", " µm").replace("deg C", "°C"): german for one, german in known.items()} | known


_LISTED = re.compile(r"(, | and | or | \+ )")
_CHOICE = re.compile(r"r?[xyz]{1,2}|\d+|all|once|anew|whole|varying|first|second|third|gauge|position|speed|time")
"""What stands behind the name of an effect in its label: axis, plane, placement."""


def _named(label: str) -> str | None:
    """The German of a text that is known whole, or of the label of an effect: its name and its choices."""
    if label in known_texts() or _WRITTEN.fullmatch(label):
        return known_texts().get(label, label)
    words = label.split()
    count = next((n for n, one in enumerate(reversed(words)) if not _CHOICE.fullmatch(one)), 0)
    if count == 1 and (numbered := catalogue().get(f"{' '.join(words[:-1])} {{}}")):
        return numbered.format(known_texts().get(words[-1], words[-1]))
    name = known_texts().get(" ".join(words[: len(words) - count]))
    return " ".join([name, *(known_texts().get(one, one) for one in words[len(words) - count :])]) if name else None


def _list_of_names(text: str) -> str | None:
    """A list of such texts in German; None where any of them is not known."""
    parts = _LISTED.split(text)
    names = [_named(one) for one in parts[::2]]
    if text in known_texts() or None in names:
        return known_texts().get(text)
    joints = [f" {catalogue()[one.strip()]} " if one.strip() in ("and", "or") else one for one in parts[1::2]]
    return "".join(f"{name}{joint}" for name, joint in zip(names, [*joints, ""], strict=True))


_NAMED = re.compile(r"{([^{}]*)}")
SHORT = 12
"""Letters of a sentence of a diagnosis: a shorter one may stand in any text."""


def _diagnosed() -> dict[str, str]:
    """The sentences of a diagnosis whose gaps stand in one order in both languages."""
    from stepgauge.diagnosis.wording.catalogue import sentences

    alike = [one for one in sentences().values() if _NAMED.findall(one[0]) == _NAMED.findall(one[1])]
    pairs = [tuple(_NAMED.sub("{}", text) for text in one) for one in alike]
    return {english: german for english, german in pairs if len(english.replace("{}", "")) >= SHORT}


@cache
def effects() -> Mapping[str, str]:
    """German names of effects, alone and with their axes, of covariates and of sensors."""
    from stepgauge.diagnosis.wording.findings import CHOICES, name_of, words
    from stepgauge.diagnosis.wording.phrases import COVARIATES
    from stepgauge.effects import effect_kinds

    kinds = [(kind, "gauge") for kind in effect_kinds(every=True)] + [(kind, "map") for kind in words("map")]
    names = {name_of(*one): name_of(*one, "de") for one in kinds}
    known = {f"{name}{more}": f"{german}{more}" for name, german in names.items() for more in ("", " {}")}
    return {**CHOICES, **COVARIATES, **known, **_sensors(), **_columns()}


def _columns() -> Mapping[str, str]:
    """German names of what a column of a table is taken for."""
    taken = {key.removeprefix("choice_taken."): said[1] for key, said in texts().items() if "choice_taken." in key}
    return {key: said for key, said in taken.items() if key.isalpha() and key not in ("from", "to", "values")}


def parameter_name(name: str, language: str) -> str:
    """A parameter of an effect as the pages call it, in lower case but for German nouns; empty where they do not."""
    stem = name.rpartition("_")[0]
    said = next((texts()[key] for key in (f"field.{name}", f"field.{stem}") if key in texts()), ("", ""))
    return said[1] if language == "de" else said[0].lower()


def _sensors() -> Mapping[str, str]:
    """German names of sensors, which the fields of the pages have too."""
    from stepgauge.axis.sensors import SENSORS

    named = {kind: texts().get(f"choice_sensor.{kind}") for kind in SENSORS}
    return {SENSORS[kind].words: german[1] for kind, german in named.items() if german}


def _one_gap(text: str) -> str:
    """With one gap for those that stand side by side: where one ends, nobody can tell."""
    return re.sub(r"({}){2,}", "{}", text)


def translate_message(text: str) -> str:
    """A message of the program in German, whole or not at all; of several sentences each by itself."""
    return _decimal_commas(_between_numbers(_apart(_ROW.sub("Zeile ", _whole(text)))))


def _apart(text: str) -> str:
    """Semicolons between components, whose decimal marks are commas."""
    return _VECTOR.sub(lambda found: found[0].replace(", ", "; ") if "." in found[0] else found[0], text)


def _whole(text: str) -> str:
    if text.startswith(_MAPPED):
        return catalogue()[f"{_MAPPED}{{}}"].format(_TAKEN.sub(_taken, text.removeprefix(_MAPPED)))
    try:
        return _translated(text, DEEPEST)
    except UntranslatedError:
        first, joint, rest = text.partition("; ")
        return f"{_whole(first)}{joint}{_whole(rest)}" if rest else text


_MAPPED, _TAKEN = "mapped: ", re.compile(r"(?<= -> )(\w+)(?: \(from ([\w ]+)\))?")
"""What columns were taken for: their headers are what somebody wrote."""


def _taken(one: re.Match[str]) -> str:
    role = known_texts().get(one[1], one[1])
    return f"{role} (aus {known_texts().get(one[2], one[2])})" if one[2] else role


def said_in_german(line: str) -> str:
    """The last line of a verb that failed, whose parts stand one behind the other (see :class:`InputError`)."""
    line = line.removeprefix("stepgauge: error: ")
    head, *more = re.split("; (?=found |expected )", line)
    starts = [0, *(found.end() for found in re.finditer(": ", head))]
    what = max(starts, key=lambda start: _known_words(head[start:]))  # the place stands in front, unless there is none
    parts = [head[:what] + _whole(head[what:])]
    for one in more:
        word, _, value = one.partition(" ")
        parts.append(f"{'gefunden:' if word == 'found' else 'erwartet:'} {_whole(value)}")
    return _decimal_commas(_between_numbers(_ROW.sub("Zeile ", "; ".join(parts))))


def translate_printed(text: str, own: Collection[str] = ()) -> str:
    """A text of a printed page in German, numbers and dates too; nothing of what people wrote (``own``)."""
    if text in own and not _DAY.fullmatch(text):
        return text
    kept = [re.escape(one) for one in own if re.search(r"\d[.-]\d", one) and not _DAY.fullmatch(one)]
    parts = re.split(rf"(?<!\w)({'|'.join(kept) or '(?!)'})(?!\w)", " ".join(_sentences(text)))
    parts[::2] = map(_german_numbers, parts[::2])
    return "".join(parts)


def _sentences(text: str) -> Iterator[str]:
    """The sentences of a text in German: those that belong together are known as one."""
    parts = _SENTENCE.split(text)
    while parts:
        count = next((n for n in range(len(parts), 1, -1) if _is_known(" ".join(parts[:n]))), 1)
        told, parts = " ".join(parts[:count]), parts[count:]
        said, end = _known_form(told)
        german = _translated(said, DEEPEST, False) + end
        yield german if said[:1] == told[:1] else german[:1].upper() + german[1:]


def _known_form(told: str) -> tuple[str, str]:
    """A sentence as it is known, and the stop behind it: notes are made sentences with a capital letter and a stop."""
    forms = [one.removesuffix(end) for one in (told, told[:1].lower() + told[1:]) for end in (".", "")]
    said = max(forms, key=_known_words)
    return said, "." if told.endswith(".") and not said.endswith(".") else ""


def _is_known(text: str) -> bool:
    """Whether a text is a message, and not only begins and ends as one."""
    return _known_words(text) >= MOST * len(text)


def _german_numbers(text: str) -> str:
    """Decimal commas, semicolons between components, days in the order of DIN 5008, ranges with bis."""
    text = _VECTOR.sub(lambda found: found[0].replace(", ", "; "), text)
    text = _DAY.sub(r"\3.\2.\1", _PRINTED_POINT.sub(r"\1,\2", text))
    return _between_numbers(text)


def _between_numbers(text: str) -> str:
    return _BETWEEN.sub(lambda found: f" {catalogue()[found[1]]} ", text)


@lru_cache(4096)
def _translated(text: str, deep: int, whole: bool = True) -> str:
    """A message in German; ``whole``: :class:`UntranslatedError` where words of it are English that no template knows,
    and may not be names that people gave."""
    if (names := _list_of_names(text)) is not None:
        return names
    ways: list[Callable[[], str]] = []
    if deep and not _QUOTED.fullmatch(text):
        found = _template(text)
        lists = [(joint, parts) for joint in _JOINTS if len(parts := text.split(joint)) > 1]
        known = [all(map(_is_part, parts)) for _, parts in lists]
        joined = [partial(_join, parts, joint, deep, whole) for joint, parts in lists]
        filled = [partial(_fill_gaps, found, deep, whole)] if found else []
        owned = found is not None and _length(found[0]) >= OWN_SHARE * len(text)
        sure, rest = (
            [one for one, is_known in zip(joined, known, strict=True) if is_known is wanted] for wanted in (True, False)
        )
        ways = [*filled, *sure, *rest] if owned else [*sure, *filled, *rest]
        named = [joint != _BRACKET and all(map(_is_named, parts)) for joint, parts in lists]
        ways = [*(one for one, is_named in zip(joined, named, strict=True) if is_named), *ways]
    for way in ways:
        with suppress(UntranslatedError):
            return way()
    if whole and ENGLISH.search(_BETWEEN.sub("", _NO_PROSE.sub("", text))):
        raise UntranslatedError(text)
    return text


def _is_part(text: str) -> bool:
    """Whether a part of a list is a message, or has no words at all."""
    return _known_words(text) >= OWN_SHARE * len(text) or not _WORD.search(text)


def _is_named(text: str) -> bool:
    """Whether a part of a list is a list of names that are known whole, or has no words."""
    return not _WORD.search(text) or _list_of_names(text) is not None


def _join(parts: Sequence[str], joint: str, deep: int, whole: bool) -> str:
    return joint.join(_translated(one, deep - 1, whole) for one in parts)


def _template(text: str) -> tuple[tuple[str, ...], str, list[str]] | None:
    """The template with most words of its own that a text has, and what fills its gaps."""
    for words, german in _sorted_templates():
        gaps = _gaps(text, words)
        if gaps is not None:
            return words, german, gaps
    return None


def _fill_gaps(found: tuple[tuple[str, ...], str, list[str]], deep: int, whole: bool) -> str:
    words, german, gaps = found
    quoted = [before.endswith(("'", '"')) for before in words]  # as somebody wrote it
    return _filled(
        german, [one if raw else _translated(one, deep - 1, whole) for one, raw in zip(gaps, quoted, strict=False)]
    )


def _length(words: tuple[str, ...]) -> int:
    return sum(map(len, words))


def _filled(text: str, gaps: Sequence[str]) -> str:
    """With the gaps filled; other braces are the text's own."""
    words = text.split("{}")
    return "".join(part for pair in zip(words, [*gaps, ""], strict=True) for part in pair)


@lru_cache(4096)
def _known_words(text: str) -> int:
    """How much of a text is a template's own."""
    if text in known_texts():
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

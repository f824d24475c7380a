"""What the names of columns say: words by what they mean (``words.toml``), units, cycles and directions, signs.

One list for all kinds of tables. Words are compared in small letters without accents (ß is ss), umlauts also as ``ae``.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from stepgauge.files.numerals import tidy
from stepgauge.files.units import Unit, find_unit

WORDS = {
    name: frozenset(words.split())
    for name, words in tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8")).items()
}
"""Words by what they say."""
_KNOWN = frozenset().union(*WORDS.values())
_TOKEN = re.compile(r"[^\W\d_]+|[-\u2010\u2014]")
_LABEL = re.compile(r"[^\W\d_]+|\d+|[+\-−–↑↓→←<>]+")
_COMPOUND = re.compile(r"(\w{3,}?)s?(temperature|temperatur|temp)")
"""German names in one word, such as "Prüflingstemperatur"."""
MEASURE = re.compile(r"([-+]?\d[\d.,']*) ?(mm|[uµμn]m|cm|m|in|inch|deg|°|arcsec|s|ms|min|°C|degC)")
"""A number with its unit."""
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_BEHIND = re.compile(r"(.*?)\s*(?:\s/\s*|\s+in\s+|_|\s+(?=°))([^\s/]+(?:/[^\s/]+)?)\s*$", re.IGNORECASE)
_LOOSELY = (
    re.compile(r"(.+)_([^_\s]+)"),
    re.compile(r"(.+?)(?:\s*/\s*|\s*,\s*|\s+)(\w*[a-zµμ°]{2,}|°|min|arc sec)\s*", re.IGNORECASE),
)
_SIGNED = re.compile(r"\s*([+\-−–])\s?(\d{1,9})\s*")
"""``+1``, ``-2``: the sign is a direction; in ``Run-1`` it may be a hyphen."""
_NUMBERED_NAME = re.compile(r"([^\W\d_]+)\d+")
"""``Run3``, and ``ILD2300``, whose number is that of no run."""
_RUNS = ("cycle", "cycle beside", "way", "placement")
MOST_CYCLES = 10_000


def folded(text: str) -> str:
    """A name in small letters without accents, with plain minus signs."""
    letters = unicodedata.normalize("NFKD", tidy(text).casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


@lru_cache(4096)
def words_of(name: str) -> tuple[str, ...]:
    """The words of a name, folded; umlauts written as two letters as one, temperatures out of German compounds."""
    found = list[str]()
    for word in re.split(r"[^a-z0-9#]+", folded(name)):
        plain = re.sub("([aou])e", r"\1", word)
        word = plain if word not in _KNOWN and plain in _KNOWN else word
        compound = _COMPOUND.fullmatch(word) if word not in _KNOWN else None
        found += [words_of(compound[1])[0], compound[2]] if compound else [word] if word else []
    return tuple(found)


def says(words: tuple[str, ...], *of: str) -> set[str]:
    """Those of the words that are of these lists."""
    return {word for word in words if any(word in WORDS[one] for one in of)}


# units


def _split_unit(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header such as ``X [mm]``, ``X (inch)``, ``Position X / µm``, ``T in °C`` or ``x_mm``."""
    for pattern in (_BRACKETS, _BEHIND):
        match = pattern.fullmatch(header.strip())
        unit = find_unit(match[2]) if match else None
        if match and unit is not None and match[1]:
            return match[1].strip(), unit
    return header.strip(), None


def split_name(header: str) -> tuple[str, Unit | None]:
    """Name and unit of a header; beside ``X [mm]`` also ``x_mm``, ``X mm``, ``X/mm`` and ``X, mm``.

    The last word of ``speed_mm_s`` is a part of its unit, and none by itself.
    """
    name, unit = _split_unit(header)
    match = None if unit is not None else next(filter(None, (one.fullmatch(header.strip()) for one in _LOOSELY)), None)
    known = find_unit(match[2].replace("arc sec", "arcsec")) if match else None
    if match is None or known is None or known.quantity == "none" or _is_compound(match[1]):
        return name, unit
    return match[1].strip(), known


def _is_compound(before: str) -> bool:
    """Whether what stands before a unit ends in a unit as well, or in ``per``: ``speed_mm``, ``um_per``."""
    _, *words = re.split(r"[\W_]+", before.strip())
    last = words[-1] if words else ""
    unit = None if last in ("", "in") else find_unit(last)
    return last == "per" or (unit is not None and unit.quantity != "none")


# cycles and directions of travel


@dataclass(frozen=True)
class Label:
    """``cycle``: a number, nought for none; ``way``: +1 or -1, nought for none."""

    cycle: int = 0
    way: int = 0


LABEL = Label()


def parse_label(text: str) -> Label:
    """``Run 3 fwd``, ``x2↓``, ``-2``, ``Lauf 1 (rück)``, ``+``: cycle and direction, as far as the words say them."""
    signed = _SIGNED.fullmatch(text)
    if signed:
        return Label(int(signed[2]) if int(signed[2]) < MOST_CYCLES else 0, way_of(signed[1]))
    tokens = _LABEL.findall(folded(text))
    numbers = [int(token) for token in tokens if token.isascii() and token.isdigit()]
    way = 0
    for place, token in enumerate(tokens):
        plain = token not in WORDS["way alone"] or place == len(tokens) - 1
        if plain and (len(tokens) > 1 or len(text.strip()) <= 12):
            way = way or way_of(token)
    return Label(numbers[0] if len(numbers) == 1 and 0 < numbers[0] < MOST_CYCLES else 0, way)


def title_label(title: str) -> Label:
    """Cycle and direction of the line above a block: a number in it is that of a run where a word says so, or alone."""
    title = _NUMBERED_NAME.sub(lambda name: name[0] if says(words_of(name[1]), *_RUNS) else " ", title)
    words = words_of(re.sub(r"\d+", " ", title))
    ways = {way_of(word) for word in words if word not in WORDS["way alone"]}
    label = LABEL if {1, -1} <= ways else parse_label(title)
    return label if not words or label.way or says(words, *_RUNS) else LABEL


def says_run(text: str) -> bool:
    """Whether a line names a run, one direction or a placement, in words."""
    return any(map(str.isalpha, text)) and title_label(text) != LABEL


def way_of(text: str) -> int:
    """+1 or -1 for a word of a direction, nought for another."""
    word = folded(text)
    return 1 if word in WORDS["way forward"] else -1 if word in WORDS["way backward"] else 0


def travel_of(text: str) -> int:
    """As :func:`way_of`, of a word that is a direction of travel in all readings, and names no side of a block."""
    return 0 if folded(text) in WORDS["side"] else way_of(text)


# signs


def subtractions(name: str) -> set[int]:
    """The orders in which a name subtracts: +1 for reading minus target, -1 for target minus reading."""
    tokens = [token for token in _TOKEN.findall(folded(name)) if token not in WORDS["place of subtraction"]]
    plain = re.sub("-+", "-", "".join(map(_letter, tokens)))
    return {sign for order, sign in (("R-T", 1), ("T-R", -1)) if order in plain}


def _letter(token: str) -> str:
    """``T`` for a word of targets, ``R`` for one of readings, ``-`` for a minus, ``.`` for another word."""
    return next(
        (letter for of, letter in (("minus", "-"), ("target", "T"), ("reading", "R")) if token in WORDS[of]), "."
    )


def signs_of(name: str, deviation: bool | None = None) -> set[int]:
    """The signs that the words of a name give its values: +1 for reading minus target, -1 for target minus reading.

    None without such a word, both where they contradict. The order in which a name subtracts (``Soll-Ist``) says more
    than its other words, for an ``Abweichung Soll-Ist`` is no deviation. A correction or compensation value is what is
    added to a reading: the negative of its deviation (VIM 2.53). ``deviation``: whether one of the words is a word for
    a deviation; default: by the words.
    """
    tokens = frozenset(_TOKEN.findall(folded(name)))
    if deviation is None:
        deviation = bool(tokens & WORDS["deviation"])
    told = subtractions(name) or ({1} if deviation else set())
    return told | ({-1} if tokens & WORDS["correction"] else set())

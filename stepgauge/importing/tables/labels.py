"""Cycle and direction of travel in a few words: a column's name, a line above a block, a cell."""

from __future__ import annotations

import re
from dataclasses import dataclass

from stepgauge.importing.tables.vocabulary import folded

_PLUS = """+ +1 f fw fwd forward forwards up upward upwards rising increasing pos positive positiv positif positivo cw
    hin vor vorwarts vorwaerts aufwarts aufwaerts steigend ↑ → > >> plus out outward ascending right aller u avanti
    andata adelante ida"""
_MINUS = """- -1 − – r b bw bwd rev reverse reversed backward backwards down downward downwards falling decreasing neg
    negative negativ negatif negativo ccw zuruck zurueck ruck rueck ruckwarts rueckwaerts abwarts abwaerts fallend ↓ ← <
    << minus in inward descending left retour d indietro ritorno atras vuelta"""
_BRIEF = "f r b u d in out pos neg > < + - − – right left"
_FORWARD, _BACKWARD, _ALONE = (frozenset(words.split()) for words in (_PLUS, _MINUS, _BRIEF))
"""Words of each direction, and those that say one only at the end of a name or alone."""
_TOKEN = re.compile(r"[^\W\d_]+|\d+|[+\-−–↑↓→←<>]+")
_SIGNED = re.compile(r"\s*([+\-−–])\s?(\d{1,9})\s*")
"""``+1``, ``-2``: the sign is a direction; in ``Run-1`` it may be a hyphen."""
MOST_CYCLES = 10_000


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
    tokens = _TOKEN.findall(folded(text))
    numbers = [int(token) for token in tokens if token.isascii() and token.isdigit()]
    way = 0
    for place, token in enumerate(tokens):
        plain = token not in _ALONE or place == len(tokens) - 1
        if plain and (len(tokens) > 1 or len(text.strip()) <= 12):
            way = way or way_of(token)
    return Label(numbers[0] if len(numbers) == 1 and 0 < numbers[0] < MOST_CYCLES else 0, way)


def way_of(text: str) -> int:
    """+1 or -1 for a word of a direction, nought for another."""
    word = folded(text)
    return 1 if word in _FORWARD else -1 if word in _BACKWARD else 0

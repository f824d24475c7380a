"""Which sign the name of a column gives its values: reading minus target (a deviation), or target minus reading.

The order in which a name subtracts (``Soll-Ist``, ``actual - nominal``) says more than its other words do, for an
``Abweichung Soll-Ist`` is no deviation. A correction or compensation value is what is added to a reading: the negative
of its deviation (VIM 2.53).
"""

from __future__ import annotations

import re
import unicodedata

from stepgauge.files.numerals import tidy

_TARGETS = """target nominal nom command commanded demand demanded setpoint set soll sollwert sollposition sollmass ref
    reference referenz consigne konsigne theoretical theorique nennwert nennmass"""
_READINGS = """actual act ist istwert istposition istmass measured measurement meas reading indicated indication laser
    messwert gemessen anzeige anzeigewert mesure mesuree lecture observed feedback reel"""
_IDLES = "value values val position positions pos point wert werte mass punkt"
_TARGET, _READING, _IDLE = (frozenset(words.split()) for words in (_TARGETS, _READINGS, _IDLES))
"""Words of both sides of a subtraction, fewer than those of a column: ``Soll-Wert`` subtracts nothing; and words beside
them."""
CORRECTIONS = """correction corrections compensation compensations korrektur korrekturen korrekturwert korrekturwerte
    kompensation kompensationswert kompensationswerte"""
_CORRECTION = frozenset(CORRECTIONS.split())
_MINUS = frozenset(("minus", "moins", "-", "\u2010", "\u2014"))
_TOKEN = re.compile(r"[^\W\d_]+|[-\u2010\u2014]")


def subtractions(name: str) -> set[int]:
    """The orders in which a name subtracts: +1 for reading minus target, -1 for target minus reading."""
    letters = "".join(_letter(token) for token in _TOKEN.findall(folded(name)) if token not in _IDLE)
    plain = re.sub("-+", "-", letters)
    return {sign for order, sign in (("R-T", 1), ("T-R", -1)) if order in plain}


def _letter(token: str) -> str:
    """``T`` for a word of targets, ``R`` for one of readings, ``-`` for a minus, ``.`` for another word."""
    return "-" if token in _MINUS else "T" if token in _TARGET else "R" if token in _READING else "."


def signs_of(name: str, deviation: bool) -> set[int]:
    """The signs that the words of a name give its values: none without such a word, both where they contradict.

    ``deviation``: whether one of them is a word for a deviation, which is reading minus target where no order is told.
    """
    told = subtractions(name) or ({1} if deviation else set())
    return told | ({-1} if _CORRECTION & set(_TOKEN.findall(folded(name))) else set())


def folded(text: str) -> str:
    """A name in small letters without accents, with plain minus signs."""
    letters = unicodedata.normalize("NFKD", tidy(text).casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))

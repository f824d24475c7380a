"""What a log or table says of itself about temperature: whether its lengths have been corrected to 20 deg C.

Only what is listed here is understood: statements of DMIS, a switch by name (``Part temperature compensation: on``) and
sentences (``all lengths corrected to 20 °C``), in English, German and French. A switch with another value, and a file
that says both, are told and settle nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from stepgauge.files.text import margins
from stepgauge.recording.conventions import CONVENTIONS, KEY, Convention

SOME_LINES = 400
"""Lines at the beginning of a file, and at its end, that may speak of the whole; of DMIS every line may."""
_20 = r"\+?20(?:[.,]0+)?\s*(?:°|º|deg\.?|grad)?\s*C(?:elsius)?\b"
_DONE = r"(?:corrected|compensated|referred|normali[sz]ed|reduced|scaled|korrigiert|kompensiert|bezogen|umgerechnet)"
_TO_20 = re.compile(
    rf"\b{_DONE}\b.{{0,30}}?\b(?:to|auf)\s+{_20}|\bauf\s+{_20}\s+{_DONE}\b|\b(?:corrig|ramen)\w*\s+à\s+{_20}",
    re.IGNORECASE,
)
_UNDONE = re.compile(
    r"\b(?:not|nicht|un|non)[ -]?(?:temperature[ -])?(?:corrected|compensated|korrigiert|kompensiert)\b"
    r"|\b(?:without|no|ohne|sans)\s+(?:temperature|thermal|temperatur|compensation\s+thermique)",
    re.IGNORECASE,
)
_OF_TEMPERATURE = re.compile(r"temperat|thermi|therma|expansion|ausdehnung|°|deg|celsius", re.IGNORECASE)
_SWITCH = re.compile(
    r"^(?:(?:part|work ?piece|piece|gauge|material|object|linear)[ _-]*)?"
    r"(?:temperature|temp\.?|thermal|expansion|material)[ _-]*(?:compensation|correction|comp\.?)(?:[ _-]*state)?$"
    r"|^(?:werkst(?:ü|ue)ck|teile|material)?-?(?:temperatur|material|ausdehnungs)-?(?:kompensation|korrektur)$"
    r"|^compensation (?:thermique|de temp(?:é|e)rature)$",
    re.IGNORECASE,
)
_ENVIRONMENT = re.compile(
    r"^(?:environment(?:al)?|umwelt)[ _-]*(?:compensation|correction|kompensation)$", re.IGNORECASE
)
_COEFFICIENT = re.compile(
    r"^(?:material |part |workpiece )?(?:thermal )?expansion(?: coefficient)?\b|^(?:material-?)?ausdehnungskoeffizient",
    re.IGNORECASE,
)
_ON = re.compile(r"^(?:on|yes|active|activated|enabled|true|ein|an|ja|aktiv|oui|active|activée?)\b", re.IGNORECASE)
_OFF = re.compile(r"^(?:off|no|none|inactive|disabled|false|aus|nein|inaktiv|keine?|non|inactive)\b", re.IGNORECASE)
_DMIS = re.compile(r"^\s*TECOMP\s*/\s*(?:PART\s*,\s*)?(ON|OFF)\b", re.IGNORECASE)
_PAIR = re.compile(r"^[\s#/%!$;(*'\"]*([^:=;,\t]{3,60}?)\s*[:=;,\t]\s*(.*?)[\s)\"';,]*$")
_NUMBER = re.compile(r"[-+]?\d+(?:[.,]\d+)?(?:e[-+]?\d+)?", re.IGNORECASE)


@dataclass(frozen=True)
class ThermalStatement:
    """What a line says: None where it names the switch with a value that is not understood."""

    convention: Convention | None
    line: str


def read_convention(lines: Iterable[str]) -> tuple[dict[str, str], tuple[str, ...]]:
    """The comment of a recording that follows from the lines of a log, and what to tell of it; both empty without."""
    found = list(_statements([one.strip() for one in lines if one.strip()]))
    said = {one.convention for one in found if one.convention is not None}
    if len(said) == 1:
        convention = said.pop()
        line = next(one.line for one in found if one.convention == convention)
        return {KEY: str(convention)}, (f"{KEY} {convention}, for the file says {line!r}: {CONVENTIONS[convention]}",)
    if found:
        shown = " and ".join(repr(one.line) for one in found[:2])
        return {}, (f"doubtful: {shown} settles no {KEY}: it has to be stated",)
    return {}, ()


def said_lines(text: str) -> list[str]:
    """The lines of a text that may speak of the whole file."""
    if text.count("\n") <= 2 * SOME_LINES:
        return text.splitlines()
    start, end = margins(text, SOME_LINES)
    dmis = max(text.find(name, start, end) for name in ("TECOMP", "tecomp")) >= 0
    middle = text[start:end].splitlines() if dmis else ()
    return [*text[:start].splitlines(), *filter(_DMIS.match, middle), *text[end:].splitlines()]


def _statements(lines: list[str]) -> Iterator[ThermalStatement]:
    pairs = [(match[1].strip(), match[2].strip(), one) for one in lines if (match := _PAIR.match(one))]
    material = [_is_expansion(value) for key, value, _ in pairs if _COEFFICIENT.match(key)]
    for one in lines:
        if dmis := _DMIS.match(one):
            yield ThermalStatement("corrected_to_20" if dmis[1].upper() == "ON" else "as_read", one)
        elif _UNDONE.search(one) and _OF_TEMPERATURE.search(one):
            yield ThermalStatement("as_read", one)
        elif _TO_20.search(one):
            yield ThermalStatement("corrected_to_20", one)
    for key, value, line in pairs:
        if _SWITCH.match(key):
            yield ThermalStatement(_switched(value), line)
        elif _ENVIRONMENT.match(key) and material:
            yield ThermalStatement("corrected_to_20" if material[0] and _ON.match(value) else "as_read", line)


def _switched(value: str) -> Convention | None:
    """By the value of a switch; one that has been read as a sentence already agrees."""
    if _ON.match(value) or _TO_20.search(value):
        return "corrected_to_20"
    return "as_read" if _OFF.match(value) else None


def _is_expansion(value: str) -> bool:
    number = _NUMBER.search(value)
    return number is not None and float(number[0].replace(",", ".")) != 0.0

"""RepRapFirmware 3 as a virtual controller: G38 searches, meta commands for checks and for the log.

A search has the speed of its probe (``M558``). ``G38.2`` ends at the contact, where ``move.axes[n].userPosition`` is
read (the position of the stopped axes, no latch); without a contact ``result`` is not 0. ``G38.3`` on the way says
nothing: the program compares position and target.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from stepgauge.programs.expression import Grammar, Value, in_words
from stepgauge.programs.gcode import GCode
from stepgauge.programs.reading import Reader

_ECHO = re.compile(r'echo\s*(>>?)\s*"([^"]*)"\s+(.+)', re.IGNORECASE)
_VARIABLE = re.compile(r"var\s+(\w+)\s*=\s*(.+)", re.IGNORECASE)
_IF = re.compile(r"if\s+(.+)", re.IGNORECASE)
_ABORT = re.compile(r'abort\s+"([^"]*)"', re.IGNORECASE)
_MESSAGE = re.compile(r"M291\b(.*)", re.IGNORECASE)
_PROBE = re.compile(r"M558\s*K(\d+)\s*F([\d.]+)", re.IGNORECASE)
_POSITION = re.compile(r"move\.axes\[([012])\]\.userPosition", re.IGNORECASE)


def recognises(text: str) -> bool:
    """Whether the position of an axis is read from the object model after a straight probe."""
    return "38.2" in text and _POSITION.search(text) is not None


class _Interpreter(GCode):
    """The firmware between lines."""

    states: ClassVar[Mapping[float, str]] = {21: "units", 90: "distances", 94: "feed", 54: "coordinates"}
    searches: ClassVar[frozenset[float]] = frozenset({38.2, 38.3})
    m_codes: ClassVar[frozenset[float]] = frozenset({120.0, 121.0, 400.0})
    ends: ClassVar[frozenset[float]] = frozenset({121.0})
    grammar: ClassVar[Grammar] = Grammar(
        r"var\.\w+|move\.axes\[[012]\]\.userPosition|result", {"&&": "and", "||": "or", "^": "<<"}, "()"
    )

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.skipped_from: int | None = None
        self.speed_mm_s: dict[float, float] = {}
        self.probe = 0.0

    def line(self, raw: str) -> None:
        """A line with its indentation; the lines under an ``if`` that does not hold are passed over."""
        text = re.sub(r'("[^"]*")|;.*', lambda match: match[1] or "", raw)
        indent = len(text) - len(text.lstrip())
        if not text.strip():
            return
        if self.skipped_from is not None and indent > self.skipped_from:
            return
        self.skipped_from = None
        self._statement(text.strip(), indent)

    def _statement(self, text: str, indent: int) -> None:
        self.check_end(text)
        if condition := _IF.fullmatch(text):
            if not self.number(condition[1].strip().removeprefix("{").removesuffix("}")):
                self.skipped_from = indent
        elif abort := _ABORT.fullmatch(text):
            self.reader.alarm(abort[1])
        elif echo := _ECHO.fullmatch(text):
            self.reader.log.append(in_words(self.value(echo[3])))
        elif variable := _VARIABLE.fullmatch(text):
            self._set(variable[1], self.number(variable[2]))
        elif probe := _PROBE.fullmatch(text):
            self.speed_mm_s[float(probe[1])] = self.number(probe[2]) / 60.0
        elif not _MESSAGE.fullmatch(text):
            self.block(re.sub(r"\s+", "", text.upper()))

    def _set(self, name: str, value: float) -> None:
        self.variables[f"var.{name}"] = value
        if name == "search":
            self.reader.set(search_mm=value)

    def look_up(self, name: str) -> Value:
        """The object model: positions have three decimals."""
        axis = _POSITION.fullmatch(name)
        if axis:
            return round(self.contact.position[int(axis[1])], 3)
        if name == "result":
            return 0.0 if self.contact.hit else 2.0
        return super().look_up(name)

    def take_arguments(self, words: dict[str, list[float]], codes: Sequence[float]) -> None:
        """K of G38 is the number of the probe."""
        if self.searches & set(codes):
            self.probe = words.pop("K", [0.0])[0]
        super().take_arguments(words, codes)

    def go(self, target: Mapping[str, float], motion: float | None) -> None:
        """A search has the speed of its probe (M558), whatever F says."""
        feed = self.feed_mm_s
        if motion in self.searches:
            self.feed_mm_s = self.speed_mm_s.get(self.probe)
        super().go(target, motion)
        self.feed_mm_s = feed

    def take_code(self, code: float) -> None:
        """Offsets other than the first are coordinates, too."""
        if code in (55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3):
            self.reader.states["coordinates"] = f"G{code:g}"
        else:
            super().take_code(code)

    def measures(self, code: float) -> bool:
        """G38.2 must find its face."""
        return code == 38.2


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    interpreter = _Interpreter(reader)
    for reader.line, raw in enumerate(text.splitlines(), 1):
        interpreter.line(raw)
    if not interpreter.ended:
        reader.cut_short("M121 at the end")

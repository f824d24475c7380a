"""SINUMERIK 840D sl, 828D and ONE as a virtual controller: MEAS=1, the registers $AA_MW, STOPRE, WRITE.

``MEAS=1 G1 ..`` goes straight until the probe switches, and without a contact to its end; ``$AC_MEA[1]`` says which it
was. A measuring block whose registers are written before the next move is a measurement, any other protects the way.
``$AA_MW`` are workpiece coordinates with the tool length in force.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from stepgauge.programs.expression import Grammar, Value, in_words
from stepgauge.programs.gcode import GCode, moves_with_result
from stepgauge.programs.reading import Reader
from stepgauge.programs.steps import Steps

MEASURE = 1000.0
"""A block with MEAS=1, among the motions."""
ALARM = "ALARM: "
"""What the message of a stop begins with that is none for the operator's preparations."""
_BRANCH = re.compile(r"(?:IF (.+) )?GOTO[FB] (\w+)", re.IGNORECASE)
_LABEL = re.compile(r"([A-Z_]{2}\w*):", re.IGNORECASE)
_ASSIGNMENT = re.compile(r"(R\d+|OUT)\s*=\s*(.+)", re.IGNORECASE)
_WRITE = re.compile(r'WRITE\(RET,\s*"[^"]*",\s*(OUT|"[^"]*")\)', re.IGNORECASE)
_MESSAGE = re.compile(r'MSG\("([^"]*)"\)', re.IGNORECASE)
_DEFINITION = re.compile(r"DEF (?:INT|REAL|STRING\[\d+\]) \w+", re.IGNORECASE)
_SEARCH = "R90"
"""The R parameter that says how far a search goes beyond the nominal contact."""


def recognises(text: str) -> bool:
    """Whether a move with MEAS=1 is in the text."""
    return re.search(r"(?im)^[ \t]*(N\d+[ \t]+)?MEAS *= *1\b", text) is not None


class Control(GCode):
    """The control between blocks."""

    states: ClassVar[Mapping[float, str]] = {
        40: "tool radius",
        60: "path",
        90: "distances",
        94: "feed",
        **dict.fromkeys((54, 55, 56, 57, 500), "coordinates"),
        **dict.fromkeys((71, 710), "units"),
    }
    no_effect: ClassVar[frozenset[float]] = frozenset({17.0})
    refused: ClassVar[Mapping[float, str]] = {
        **dict.fromkeys((70, 700), "G710 (mm)"),
        91: "G90 (absolute)",
        93: "G94 (mm/min)",
        95: "G94 (mm/min)",
    }
    searches: ClassVar[frozenset[float]] = frozenset({MEASURE})
    m_codes: ClassVar[frozenset[float]] = frozenset({0.0, 5.0, 2.0, 30.0})
    word: ClassVar[re.Pattern[str]] = re.compile(r"(MEAS|SPOS|[A-Z])=?([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
    grammar: ClassVar[Grammar] = Grammar(
        r"\$A[AC]_\w+\[\w+\]|\$P_TOOLNO|R\d+|RET|OUT", {"<>": "!=", "AND": "and", "OR": "or"}, "()"
    )

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.steps = Steps(reader, [], {})
        self.measuring: list[bool] = []
        self.message = ""
        self.synchronised = True

    def run(self, text: str) -> None:
        """Execute a program text."""
        lines = [re.sub(r'("[^"]*")|;.*', lambda match: match[1] or "", line).strip() for line in text.splitlines()]
        written = [bool(re.search(r"\$AA_MW", line)) for line in lines]
        moves = [re.search(r"\bG[01]\b", line) is not None for line in lines]
        self.measuring = moves_with_result(written, moves)
        named = [(_LABEL.match(line), place) for place, line in enumerate(lines)]
        self.steps = Steps(self.reader, lines, {match[1].upper(): place for match, place in named if match})
        jumps = [(_BRANCH.fullmatch(line), number) for number, line in enumerate(lines, 1)]
        self.steps.check({match[2].upper(): number for match, number in jumps if match})
        self.steps.run(self.statement, lambda: self.ended)
        rest = [(number, line) for number, line in enumerate(lines, 1) if line and number > self.steps.at]
        for self.reader.line, line in rest:
            if not re.fullmatch(rf'M0|M30|\w+: MSG\("{ALARM}[^"]*"\)', line):
                self.check_end(line)
        if not self.ended or (rest[-1:] and rest[-1][1] != "M30"):
            self.reader.cut_short("M30 at the end")

    def statement(self, text: str) -> None:
        """One block."""
        text = _LABEL.sub("", text, count=1).strip() if _LABEL.match(text) else text
        if not text or _DEFINITION.fullmatch(text):
            return
        if text.upper() == "STOPRE":
            self.synchronised = True
        elif branch := _BRANCH.fullmatch(text):
            if branch[1] is None or self.number(branch[1]):
                self.steps.go_to(branch[2].upper())
        elif message := _MESSAGE.fullmatch(text):
            self.message = message[1]
        elif written := _WRITE.fullmatch(text):
            self.reader.log.append(in_words(self.value(written[1])))
            self.variables["RET"] = 0.0
        elif assignment := _ASSIGNMENT.fullmatch(text):
            self._assign(assignment[1].upper(), self.value(assignment[2]))
        else:
            self.block(re.sub(r"\s+", "", text.upper()))

    def _assign(self, name: str, value: Value) -> None:
        self.variables[name] = value
        if name == _SEARCH and not isinstance(value, str):
            self.reader.set(search_mm=value)

    def look_up(self, name: str) -> Value:
        """System variables: they hold only after the block preparation has waited for the move."""
        name = name.upper()
        if name == "$P_TOOLNO":
            self.reader.states["tool length"] = "checked"
            return 1.0
        if name.startswith("$A"):
            if not self.synchronised:
                self.reader.fail("read before the move has ended", found=name, expected="STOPRE first")
            if name == "$AC_MEA[1]":
                return float(self.contact.hit)
            axes = {f"$AA_MW[{axis}]": place for place, axis in enumerate("XYZ")}
            if name not in axes:
                self.reader.fail("system variable not understood", found=name)
            return self.contact.position[axes[name]]
        return super().look_up(name)

    def take_arguments(self, words: dict[str, list[float]], codes: Sequence[float]) -> None:
        """SPOS turns the spindle to an angle and holds it there."""
        words.pop("SPOS", None)
        super().take_arguments(words, codes)

    def take_m_codes(self, words: dict[str, list[float]]) -> dict[str, list[float]]:
        """A stop for an alarm is one that the program does not come back from."""
        if 0.0 in words.get("M", []) and self.message.startswith(ALARM):
            self.reader.alarm(self.message.removeprefix(ALARM))
        return super().take_m_codes(words)

    def take_words(self, words: dict[str, float], motion: float | None) -> None:
        """MEAS=1 makes a search of the move."""
        if "MEAS" in words:
            if words.pop("MEAS") != 1.0 or motion != 1.0:
                self.reader.fail("only MEAS=1 with G1 is understood")
            motion = MEASURE
            self.synchronised = False
        super().take_words(words, motion)

    def measures(self, code: float) -> bool:
        """A measuring block whose registers are read before the next move."""
        return self.measuring[self.steps.at - 1]


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    Control(reader).run(text)

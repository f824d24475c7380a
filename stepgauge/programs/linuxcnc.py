"""Reader of LinuxCNC G-code: G0/G1 moves and G38.2 straight probes, in millimetres and absolute coordinates.

G38.2 names the end of the search; the named parameter ``#<_search_mm>`` says how far that is beyond the nominal tip
centre at contact. The controller itself stops where a search ends without a contact, and where the probe trips on the
way. ``(LOG,..)`` and ``(PROBEOPEN ..)`` write the log.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import ClassVar

from stepgauge.files.templating import fixed
from stepgauge.programs.expression import Value
from stepgauge.programs.gcode import GCode
from stepgauge.programs.reading import Reader

_PARAMETER = re.compile(r"#<(\w+)>=(.+)")
_READ_INPUT, _INPUT_WORDS = 66.0, "PELQ"
_COMMENT = re.compile(r"\(([^()]*)\)")
_FORMAT = re.compile(r"%(d|\.\d+f)(#<\w+>|#\d+)", re.ASCII)
_REGISTERS = {"#5061": 0, "#5062": 1, "#5063": 2}


def recognises(text: str) -> bool:
    """Whether a G38.2 straight probe is in the text."""
    return re.search(r"(?im)^[^(;\n]*G38\.2", text) is not None


class _Interpreter(GCode):
    """The controller between lines."""

    states: ClassVar[Mapping[float, str]] = {
        21: "units",
        40: "tool radius",
        49: "tool length",
        54: "coordinates",
        61: "path",
        90: "distances",
        94: "feed",
    }
    no_effect: ClassVar[frozenset[float]] = frozenset({17.0, 80.0})
    refused: ClassVar[Mapping[float, str]] = {**GCode.refused, 31: "G38.2"}
    searches: ClassVar[frozenset[float]] = frozenset({38.2})
    m_codes: ClassVar[frozenset[float]] = frozenset({2.0, 30.0, _READ_INPUT})

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.opened = False

    def statement(self, text: str) -> None:
        """One line without its comments."""
        self.check_end(text)
        parameter = _PARAMETER.fullmatch(text)
        if parameter:
            self._parameter(parameter[1], parameter[2])
        elif text == "%":
            self.ended = "units" in self.reader.states
        else:
            self.block(text)

    def _parameter(self, name: str, value: str) -> None:
        number = self.reader.number(value, f"#<{name}>")
        if name == "_search_mm":
            self.reader.set(search_mm=number)
        elif not name.startswith("_n"):
            self.reader.fail("named parameter not understood", found=f"#<{name}>", expected="#<_search_mm> or #<_n>")
        self.variables[f"#<{name}>"] = number

    def take_m_codes(self, words: dict[str, list[float]]) -> dict[str, list[float]]:
        """M66 reads an input of the controller into #5399 and moves nothing."""
        if _READ_INPUT in words.get("M", []):
            words = {letter: values for letter, values in words.items() if letter not in _INPUT_WORDS}
        return super().take_m_codes(words)

    def look_up(self, name: str) -> Value:
        """Registers of the probe; the analog input is taken as a clock."""
        if name in _REGISTERS:
            return self.contact.position[_REGISTERS[name]]
        if name == "#5070":
            return float(self.contact.hit)
        return self.contact.time_s if name == "#5399" else super().look_up(name)

    def after_search(self, code: float, measuring: bool) -> None:
        """A miss halts the program; an open file gets the point."""
        if not self.contact.hit:
            self.reader.alarm("G38.2 move finished without making contact.")
        if self.opened:
            self.reader.log.append(" ".join([*(fixed(v, 6) for v in self.contact.position), *["0.000000"] * 6]))

    def comment(self, text: str) -> None:
        """Comments that write."""
        name, _, rest = text.partition(",")
        word = name.strip().upper()
        if word == "LOG":
            self.reader.log.append(_FORMAT.sub(self._printed, rest))
        elif word.startswith("PROBEOPEN"):
            self.opened = True
        elif word == "PROBECLOSE":
            self.opened = False

    def _printed(self, match: re.Match[str]) -> str:
        value = self.number(match[2])
        return f"{value:.0f}" if match[1] == "d" else fixed(value, int(match[1][1:-1]))


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    interpreter = _Interpreter(reader)
    for reader.line, raw in enumerate(text.splitlines(), 1):
        block = _COMMENT.sub("", raw).split(";")[0]
        block = block if "#<" in block else block.upper()
        block = re.sub(r"\s+", "", block)
        if block:
            interpreter.statement(block)
        for comment in _COMMENT.findall(raw):
            interpreter.comment(comment)
    if not interpreter.ended:
        reader.cut_short("M2 or % at the end")

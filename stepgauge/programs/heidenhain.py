"""HEIDENHAIN klartext (TNC 640, iTNC 530) as a virtual controller: L moves, TCH PROBE 4, Q parameters, FN16.

``TCH PROBE 4`` searches from where the tip is along a vector, as far as SET UP says, and goes back by MB at most; four
Q parameters get x, y, z and the result, which is -1 without a contact. In z the length of the stylus is not taken off.
Moves with ``L`` are watched by the control's own monitoring of the probe, not by the program.
"""

from __future__ import annotations

import re
from typing import NoReturn

from stepgauge.files.templating import fixed
from stepgauge.programs.expression import Grammar, Value, evaluate, in_words
from stepgauge.programs.reading import Reader
from stepgauge.programs.steps import Steps

_N = r"([-+]?(?:\d+\.?\d*|\.\d+))"
_LINE = re.compile(rf"L X{_N} Y{_N} Z{_N} R0 F{_N}", re.ASCII)
_TO = re.compile(r"TCH PROBE 4\.1 Q(\d+)")
_VECTOR = re.compile(rf"TCH PROBE 4\.2 IX{_N} IY{_N} IZ{_N}", re.ASCII)
_SEARCH = re.compile(rf"TCH PROBE 4\.3 SET UP {_N} F{_N} MB {_N} REFERENCE SYSTEM:0", re.ASCII)
_BRANCH = re.compile(r'FN ?(9|10|11|12): IF (\S+) (EQU|NE|GT|LT) (\S+) GOTO LBL (?:"([^"]*)"|(\d+))')
_LABEL = re.compile(r'LBL (?:"([^"]*)"|(\d+))')
_READ = re.compile(r"FN ?18: SYSREAD (Q\d+) ?= ?(ID350 NR5[12](?: IDX1)?)")
_PRINT = re.compile(r"FN ?16: F-PRINT (\S+) / (\S+)")
_TEXT = re.compile(r'DECLARE STRING (QS\d+) ?= ?"([^"]*)"')
_TO_CHAR = re.compile(r"(QS\d+) ?= ?TOCHAR\( ?DAT\+(Q\d+) DECIMALS(\d) ?\)")
_ASSIGNMENT = re.compile(r"(QS?\d+) ?= ?(.+)")
_NOTHING = re.compile(r"FN ?20: WAIT FOR SYNC|TCH PROBE 4\.0 MEASURING IN 3D|CYCL DEF 13\.[01] .*|M19|M5")
_CONDITION = {"EQU": "==", "NE": "!=", "GT": ">", "LT": "<"}
GRAMMAR = Grammar(r"QS?\d+", {"||": "<<"}, "()")
SEARCH_Q, TOOL_LENGTH_Q = "Q11", "Q114"


def recognises(text: str) -> bool:
    """Whether the text is a program in mm with the touch probe cycle 4."""
    return re.search(r"(?im)^[ \t]*(\d+ +)?BEGIN PGM ", text) is not None and "TCH PROBE 4." in text


class Control:
    """The control between blocks; ``length_mm``: calibrated length of the stylus."""

    def __init__(self, reader: Reader, length_mm: float = 0.0) -> None:
        self.reader = reader
        self.length_mm = length_mm
        self.variables: dict[str, Value] = {TOOL_LENGTH_Q: length_mm}
        self.steps = Steps(reader, [], {})
        self.result, self.vector = 0, [0.0, 0.0, 0.0]
        self.ended = self.alarmed = False

    def fail(self, text: str) -> NoReturn:
        """A block that is not understood."""
        self.reader.fail("statement not understood", found=repr(text))

    def run(self, text: str) -> None:
        """Execute a program text."""
        lines = [re.sub(r"^\d+ +", "", re.sub(r";.*", "", line).strip()) for line in text.splitlines()]
        named = [(_LABEL.fullmatch(line), place) for place, line in enumerate(lines)]
        labels = {match[1] or match[2]: place for match, place in named if match}
        self.steps = Steps(self.reader, lines, labels)
        jumps = [(_BRANCH.fullmatch(line), number) for number, line in enumerate(lines, 1)]
        self.steps.check({match[5] or match[6]: number for match, number in jumps if match})
        last = next((line for line in reversed(lines) if line), "")
        self.reader.line = len(lines)
        if not re.fullmatch(r"END PGM \S+ MM", last):
            self.reader.cut_short("END PGM .. MM")
        self.steps.run(self.statement, lambda: self.ended)
        for number, line in enumerate(lines[self.steps.at : -1], self.steps.at + 1):
            self.reader.line = number
            if line and line != "M0" and not _LABEL.fullmatch(line) and not _BRANCH.fullmatch(line):
                self.reader.fail("statement after the end of the program", found=repr(line))

    def statement(self, text: str) -> None:
        """One block."""
        if not text or _NOTHING.fullmatch(text):
            return
        for pattern, action in (
            (_LINE, self._go),
            (_TO, self._to),
            (_VECTOR, self._along),
            (_SEARCH, self._search),
            (_BRANCH, self._branch),
            (_LABEL, self._label),
            (_READ, self._read),
            (_PRINT, self._print),
            (_TEXT, self._text),
            (_TO_CHAR, self._to_char),
            (_ASSIGNMENT, self._assign),
        ):
            match = pattern.fullmatch(text)
            if match:
                action(match)
                return
        self._frame(text)

    def _frame(self, text: str) -> None:
        """Beginning, stops and end."""
        if re.fullmatch(r"BEGIN PGM \S+ MM", text):
            self.reader.states["units"] = "MM"
        elif text == "M0" and self.alarmed:
            self.reader.alarm("PROBE DID NOT TOUCH")
        elif text == "M30" or text.startswith("END PGM"):
            self.ended = True
        elif text != "M0":
            self.fail(text)

    def number(self, text: str) -> float:
        """An expression whose value is a number."""
        return self.reader.as_number(self.value(text))

    def value(self, text: str) -> Value:
        """An expression."""
        try:
            return evaluate(text, GRAMMAR, self._look_up)
        except ValueError as error:
            self.reader.fail("expression not understood", found=f"{error} in {text!r}")

    def _look_up(self, name: str) -> Value:
        if name not in self.variables:
            self.reader.fail("parameter without a value", found=name)
        return self.variables[name]

    def _go(self, match: re.Match[str]) -> None:
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="BEGIN PGM .. MM first")
        *end, feed = (float(value) for value in match.groups())
        self.reader.set(travel_speed_mm_s=self._speed(feed))
        self.reader.travel(end)

    def _speed(self, feed: float) -> float:
        if feed <= 0:
            self.reader.fail("the feed must be positive", found=f"F{feed:g}")
        return feed / 60.0

    def _to(self, match: re.Match[str]) -> None:
        self.result = int(match[1])

    def _along(self, match: re.Match[str]) -> None:
        self.vector = [float(value) for value in match.groups()]

    def _search(self, match: re.Match[str]) -> None:
        here = self.reader.builder.last_position
        if here is None:
            self.reader.fail("TCH PROBE 4 before any position is known", expected="an L block first")
        direction = self.reader.direction(self.vector, "IX IY IZ")
        way, feed = float(match[1]), float(match[2])
        if float(match[3]) < way:
            self.reader.fail(
                "the probe does not go back all the way", found=f"MB {match[3]}", expected=f"SET UP, {way:g}"
            )
        self.reader.set(measuring_speed_mm_s=self._speed(feed))
        contact = self.reader.search([p + way * d for p, d in zip(here, direction, strict=True)], "TCH PROBE 4")
        x, y, z = contact.position
        for place, value in enumerate((x, y, z + self.length_mm, 1.0 if contact.hit else -1.0)):
            self.variables[f"Q{self.result + place}"] = value

    def _branch(self, match: re.Match[str]) -> None:
        if self.number(f"{match[2]} {_CONDITION[match[3]]} {match[4]}"):
            self.steps.go_to(match[5] or match[6])
            self.alarmed = (match[5] or "") == "NOTRIGGER"

    def _label(self, match: re.Match[str]) -> None:
        """A place to jump to."""

    def _read(self, match: re.Match[str]) -> None:
        self.variables[match[1]] = self.length_mm

    def _print(self, match: re.Match[str]) -> None:
        """The mask file prints QS1 and nothing else."""
        self.reader.log.append(in_words(self._look_up("QS1")))

    def _text(self, match: re.Match[str]) -> None:
        self.variables[match[1]] = match[2]

    def _to_char(self, match: re.Match[str]) -> None:
        self.variables[match[1]] = fixed(self.number(match[2]), int(match[3]))

    def _assign(self, match: re.Match[str]) -> None:
        self.variables[match[1]] = self.value(match[2])
        if match[1] == SEARCH_Q:
            self.reader.set(search_mm=self.number(match[2]))


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    Control(reader).run(text)

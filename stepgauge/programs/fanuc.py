"""Fanuc custom macro B as a virtual controller, with what Haas, Mazak and Mitsubishi share of it.

``G31`` goes straight until the skip signal comes, and without one to its end, silently: the program itself compares
``#5061..`` with the end. A G31 whose registers are printed before the next move is a measurement, any other protects
the way. ``#5061..`` are workpiece coordinates; with parameter 6014 bit 4 at 0 they contain the tool length in z.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from stepgauge.programs.expression import Grammar, Value
from stepgauge.programs.gcode import DWELL, GCode, moves_with_result
from stepgauge.programs.reading import Reader
from stepgauge.programs.steps import Steps

SKIP, CALL, LOOK_AHEAD = 31.0, 65.0, 103.0
_ALARM, _MESSAGE = "#3000", "#3006"
_GROUPS = {
    "#4001": (0, 1),
    "#4003": (90, 91),
    "#4005": (94, 95),
    "#4006": (20, 21),
    "#4008": (43, 49),
    "#4014": (54, 55, 56, 57, 58, 59),
}
"""Modal information by group, and the codes of the group that are known here."""
_STATES: Mapping[float, str] = {
    21: "units",
    40: "tool radius",
    43: "tool length",
    49: "tool length",
    90: "distances",
    94: "feed",
}
_BACK: Mapping[float, str] = {
    **_STATES,
    20: "units",
    91: "distances",
    95: "feed",
    **dict.fromkeys(_GROUPS["#4014"], "coordinates"),
}
"""States that a block of variables may give back; a move after it would be none of the plan."""
_SPINDLE_OR_TOOL = {3.0, 4.0, 6.0, 98.0, 99.0, 198.0}
_ASSIGNMENT = re.compile(r"(#\d+|#\[.+?\])=(.+)")
_BRANCH = re.compile(r"(?:N\d+ *)?(?:IF\[(.+)\])?GOTO(\d+)")
_PRINT = re.compile(r"DPRNT\[(.*)\]")
_FIELD = re.compile(r"(#\d+)\[(\d)(\d)\]", re.ASCII)


def recognises(text: str) -> bool:
    """Whether there is a G31, and not the labels or the assignments of other controls."""
    return re.search(r"(?im)^[^(;\n]*G31(?!\d)", text) is not None and re.search(r"#\d+ *=", text) is not None


class Control(GCode):
    """The control between blocks.

    It starts as an operator may have left it: in inches, incremental, feed per revolution, and with the tool length
    of the probe active (``length_mm`` in the offset table, and in the register where bit 4 of 6014 is 0).
    """

    states: ClassVar[Mapping[float, str]] = {**_STATES, **dict.fromkeys(_GROUPS["#4014"], "coordinates")}
    no_effect: ClassVar[frozenset[float]] = frozenset({DWELL, LOOK_AHEAD, CALL, 17.0, 53.0, 80.0})
    searches: ClassVar[frozenset[float]] = frozenset({SKIP})
    one_shot: ClassVar[frozenset[float]] = frozenset({SKIP})
    word: ClassVar[re.Pattern[str]] = re.compile(r"([A-Z])([-+]?(?:#\d+|\d+\.?\d*|\.\d+|\[[^\]]*\]))", re.ASCII)
    grammar: ClassVar[Grammar] = Grammar(
        r"#\d+|PRM\[\d+,\d\]",
        {"EQ": "==", "NE": "!=", "GT": ">", "GE": ">=", "LT": "<", "LE": "<=", "AND": "and", "OR": "or"},
        "[]",
    )

    def __init__(self, reader: Reader, length_mm: float = 0.0, bit_6014_4: int = 0) -> None:
        super().__init__(reader)
        self.length_mm, self.bit_6014_4 = length_mm, bit_6014_4
        self.modal = {"#4001": 0.0, "#4003": 91.0, "#4005": 95.0, "#4006": 20.0, "#4008": 43.0, "#4014": 57.0}
        self.steps = Steps(reader, [], {})
        self.measuring: list[bool] = []

    def run(self, text: str) -> None:
        """Execute a program text."""
        statements = [_squeezed(line) for line in text.splitlines()]
        prints = [bool(_PRINT.match(one) and _FIELD.search(one)) for one in statements]
        moves = [re.search(r"G(0*[01]|31)(?!\d)", one) is not None for one in statements]
        self.measuring = moves_with_result(prints, moves)
        named = [(re.match(r"N(\d+)", one), line) for line, one in enumerate(statements)]
        self.steps = Steps(self.reader, statements, {match[1]: line for match, line in named if match})
        jumps = [(_BRANCH.fullmatch(one), line) for line, one in enumerate(statements, 1)]
        self.steps.check({match[2]: line for match, line in jumps if match})
        self.steps.run(self.statement, lambda: self.ended)
        rest = [(line, one) for line, one in enumerate(statements, 1) if line > self.steps.at and one]
        for self.reader.line, one in rest:
            if one != "%" and not re.match(rf"N\d+ *{_ALARM} *=", one):  # behind the end stand the alarms
                self.check_end(one)
        if not self.ended or (statements[0] == "%" and (not rest or rest[-1][1] != "%")):
            self.reader.cut_short("M30, and % where it began with one")

    def statement(self, text: str) -> None:
        """One block."""
        text = re.sub(r"^N\d+ *", "", text)
        if not text or text.startswith("%") or re.fullmatch(r"O\d+(\(.*\))?", text):
            return
        branch = _BRANCH.fullmatch(text)
        if branch:
            if branch[1] is None or self.number(f"[{branch[1]}]"):
                self.steps.go_to(branch[2])
        elif assignment := _ASSIGNMENT.fullmatch(text):
            self._assign(assignment[1], assignment[2])
        elif printed := _PRINT.fullmatch(text):
            self.reader.log.append(_FIELD.sub(self._printed, printed[1].replace("*", " ")))
        elif text not in ("POPEN", "PCLOS"):
            self.block(text)

    def _assign(self, name: str, text: str) -> None:
        if name in (_ALARM, _MESSAGE):
            words = re.sub(r"^[-\d.]+", "", text).strip("()")
            if name == _ALARM:
                self.reader.alarm(f"{3000 + self.number(_without_comments(text)):.0f} {words}")
            return
        value = self.number(_without_comments(text))
        if name == "#100":
            self.reader.set(search_mm=value)
        self.variables[name] = value

    def look_up(self, name: str) -> Value:
        """Registers of the last skip, modal codes, offsets and parameters."""
        if name in ("#5061", "#5062", "#5063"):
            length = self.length_mm if name == "#5063" and not self.bit_6014_4 else 0.0
            return self.contact.position[int(name[-1]) - 1] + length
        if name in self.modal:
            if name == "#4008":
                self.reader.states["tool length"] = (
                    f"G{self.modal[name]:g}"  # a program that looks at it may rely on it
                )
            return self.modal[name]
        if name.upper() == "PRM[6014,4]":
            return float(self.bit_6014_4)
        offsets = {"#4111": 1.0, "#2001": self.length_mm, "#2201": 0.0}
        return offsets[name] if name in offsets else super().look_up(name)

    def take_code(self, code: float) -> None:
        """A G code; its group keeps it. A block of codes from variables gives back what was before."""
        for group, codes in _GROUPS.items():
            if code in codes:
                self.modal[group] = code
        if re.fullmatch(r"(G#\d+)+", self.steps.statements[self.steps.at - 1]):
            if code in _BACK:
                self.reader.states[_BACK[code]] = f"G{code:g}"
        else:
            super().take_code(code)

    def take_m_codes(self, words: dict[str, list[float]]) -> dict[str, list[float]]:
        """M codes are the builder's; the ones that turn the spindle, change the tool or call are refused."""
        codes = set(words.pop("M", []))
        if codes & _SPINDLE_OR_TOOL:
            self.reader.fail(
                "M code not understood", found=", ".join(f"M{code:g}" for code in codes & _SPINDLE_OR_TOOL)
            )
        self.ended = bool(self.ends & codes)
        return {letter: values for letter, values in words.items() if letter != "P" or not codes}

    def take_arguments(self, words: dict[str, list[float]], codes: Sequence[float]) -> None:
        """G103 limits the look-ahead of a Haas; the only calls are those that turn a probe on and off."""
        if LOOK_AHEAD in codes:
            words.pop("P", None)
        if CALL in codes and words.pop("P", []) not in ([9832.0], [9833.0]):
            self.reader.fail("G65 calls what is not known here", expected="P9832 (probe on) or P9833 (off)")
        super().take_arguments(words, codes)

    def measures(self, code: float) -> bool:
        """A skip whose registers are printed before the next move."""
        return self.measuring[self.steps.at - 1]

    def _printed(self, match: re.Match[str]) -> str:
        """A number as DPRNT prints it with parameter 6001 bit 1 at 0: blanks for the zeros in front."""
        value, whole, decimals = self.number(match[1]), int(match[2]), int(match[3])
        size = f"{abs(value):.{decimals}f}"
        width = whole + (decimals + 1 if decimals else 0)
        return ("-" if value < 0 else " ") + size.rjust(width)


def _squeezed(line: str) -> str:
    """A block in capitals without blanks and remarks; the text of a message or an alarm stays."""
    keep = re.match(r"\s*(?:N\d+\s*)?#300[06]\s*=", line) is not None
    kept = line if keep else _without_comments(line)
    return kept.upper() if keep else re.sub(r"\s+", "", kept.upper())


def _without_comments(text: str) -> str:
    return re.sub(r"\([^()]*\)", "", text).split(";")[0]


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    Control(reader).run(text)

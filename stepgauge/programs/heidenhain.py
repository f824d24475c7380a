"""HEIDENHAIN klartext (TNC 640, iTNC 530) as a virtual controller: L moves, TCH PROBE 4, Q parameters, FN16.

``TCH PROBE 4`` searches from where the tip is along a vector, as far as SET UP says, and goes back by MB at most; four
Q parameters get x, y, z and the result, which is -1 without a contact. In z the length of the stylus is not taken off.
Moves with ``L`` are watched by the control's own monitoring of the probe, not by the program.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.files.controls import fixed
from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import SEARCH, Dialect
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.expression import Grammar, number_words
from stepgauge.programs.gcode import end_of_line
from stepgauge.programs.grammar import (
    CLOSING,
    ENDS,
    FIRST,
    IF,
    JUMP,
    LAST,
    QUIET,
    START,
    DialectGrammar,
    Production,
    Slot,
    Variable,
)
from stepgauge.programs.options import YES_NO, Name, NumberOption, Option
from stepgauge.programs.reading import Contact, Reader

POST = "Autodesk's post for HEIDENHAIN"
MANUAL = "TNC 640 user's manual, klartext"
CYCLES = "TNC 640 manual, touch probe cycles, cycle 4"
_FOLDER = r"TNC:\\(?:[A-Za-z0-9_-]{1,24}\\){0,6}"
_TEXT_FILE, _MASK_FILE = r"[A-Za-z0-9_-]{1,24}\.(?:TXT|txt|LOG|log)", r"[A-Za-z0-9_-]{1,24}\.[Aa]"
TOOL_LENGTH_Q = "Q114"
CONDITIONS = {"FN9": "==", "FN10": "!=", "FN11": ">", "FN12": "<"}

TABLE = DialectGrammar(
    "heidenhain",
    forms=(
        Production("begin", "BEGIN PGM {program} MM", "begin of a program in mm", MANUAL, QUIET, FIRST),
        Production("end", "END PGM {program} MM", "end of the program", MANUAL, ENDS, LAST),
        Production("line", "L X{number} Y{number} Z{number} R0 F{positive}", "straight move, mm/min", MANUAL),
        Production("orientation", "CYCL DEF 13.0 ORIENTATION", "orientation of the spindle", POST, when=START),
        Production("orient", "CYCL DEF 13.1 ANGLE {number}", "its angle", POST, when=START, after="orientation"),
        Production("cycle", "TCH PROBE 4.0 MEASURING IN 3D", "search along a vector", CYCLES),
        Production(
            "result_to", "TCH PROBE 4.1 Q{first}", "first of four parameters for the result", CYCLES, after="cycle"
        ),
        Production("vector", "TCH PROBE 4.2 IX{number} IY{number} IZ{number}", "direction", CYCLES, after="result_to"),
        Production(
            "measure",
            "TCH PROBE 4.3 SET UP {positive} F{positive} MB {positive} REFERENCE SYSTEM:0",
            "way, mm/min, way back",
            CYCLES,
            after="vector",
        ),
        Production("nothing", "{sync}", "waits for the move", POST, QUIET),
        Production("read_length", "{fn18}SYSREAD Q{q} = ID350 NR51", "length of the stylus", POST, QUIET),
        Production("always", "{fn9}IF +1 EQU +1 GOTO LBL {label}", "goes on at a label further down", POST, JUMP),
        Production("branch", "{fn9}IF {operand} EQU {operand} GOTO LBL {label}", "goes on there if equal", MANUAL, IF),
        Production("branch", "{fn10}IF {operand} NE {operand} GOTO LBL {label}", "if not equal", POST, IF),
        Production("branch", "{fn11}IF {operand} GT {operand} GOTO LBL {label}", "if greater", MANUAL, IF),
        Production("branch", "{fn12}IF {operand} LT {operand} GOTO LBL {label}", "if less", POST, IF),
        Production("printed", "{fn16}F-PRINT {mask} / {file}", "prints QS1 by the mask", POST),
        Production("text", 'DECLARE STRING QS{q} = "{text}"', "text", POST, QUIET),
        Production("to_text", "QS{q} = TOCHAR( DAT+Q{q} DECIMALS{decimals} )", "number as text", POST, QUIET),
        Production("say_search", "Q11 = {number}", "way of a search beyond the nominal contact, mm", "stepgauge"),
        Production("assign", "{local} = {expression}", "own parameter", MANUAL, QUIET),
        Production("stopped", "M0", "stop until the operator goes on", MANUAL, QUIET),
        Production("nothing", "M5", "spindle off", MANUAL, CLOSING),
        Production("nothing", "M19", "spindle to the angle of cycle 13", POST, when=START),
        Production("nothing", "M30", "end of the program", MANUAL, ENDS),
    ),
    comments=(end_of_line(";", MANUAL, "()?"),),
    slots={
        "program": Slot(r"[A-Za-z0-9_-]{1,24}", "name of the program"),
        "q": Slot(r"(?:[1-9]|[1-9]\d)", "1 to 99"),
        "first": Slot(r"(?:[1-9]|[1-8]\d|9[0-6])", "1 to 96"),
        "local": Slot(r"QS?(?:[1-9]|[1-9]\d)", "Q1 to Q99, QS1 to QS99"),
        "operand": Slot(r"[-+]?\d{1,6}(?:\.\d{1,6})?|[-+]?Q(?:[1-9]|[1-9]\d)", "a number or Q1 to Q99"),
        "label": Slot(r'"[A-Z0-9_]{1,16}"|[1-9]\d{0,4}', "a label further down: a name in quotes or a number from 1"),
        "text": Slot(r"[ A-Za-z0-9.,:_-]*", "letters, digits and . , : _ -"),
        "decimals": Slot(r"[4-6]", "4 to 6"),
        "mask": Slot(_FOLDER + _MASK_FILE, "the mask that is written beside the program (.A)"),
        "file": Slot(_FOLDER + _TEXT_FILE, "the log, one in a program (.TXT or .LOG)"),
        "sync": Slot("FN ?20: ?WAIT FOR SYNC", "`FN20: WAIT FOR SYNC`"),
        **{f"fn{n}": Slot(rf"FN ?{n}: ?", f"`FN{n}:` or `FN {n}:`") for n in (9, 10, 11, 12, 16, 18)},
    },
    variables=(
        Variable(r"QS?(?:[1-9]\d?)(?!\d)", "Q1 to Q99, QS1 to QS99", "own parameters", MANUAL),
        Variable(r"Q114(?!\d)", "Q114", "active length of the stylus", POST),
    ),
    label=r'(?:\d{1,6} +)?LBL ("[A-Z0-9_]{1,16}"|[1-9]\d{0,4})(?=\s*$)|\d{1,6}(?:\s+|$)()',
    any_case=False,
    last="end",
)


def recognises(text: str) -> bool:
    """Whether the text is a program in mm with the touch probe cycle 4."""
    return re.search(r"(?im)^[ \t]*(\d+ +)?BEGIN PGM ", text) is not None and "TCH PROBE 4." in text


class Heidenhain(VirtualController):
    """The control between blocks; ``length_mm``: calibrated length of the stylus."""

    table: ClassVar[DialectGrammar] = TABLE
    grammar: ClassVar[Grammar] = Grammar("|".join(one.pattern for one in reversed(TABLE.variables)), {"||": "<<"}, "()")

    def __init__(self, reader: Reader, length_mm: float = 0.0) -> None:
        super().__init__(reader)
        self.length_mm = length_mm
        self.variables[TOOL_LENGTH_Q] = length_mm
        self.first_q, self.direction = 0, [0.0, 0.0, 0.0]
        self.program = ""
        self.message = "PROBE DID NOT TOUCH"

    def begin(self, block: Block) -> None:
        """The program is in mm."""
        self.program = block.fields[0]
        self.reader.states["units"] = "MM"

    def end(self, block: Block) -> None:
        """The end has the name of the beginning."""
        if block.fields[0] != self.program:
            self.reader.fail("another program ends here", found=repr(block.text), expected=self.program)

    def stopped(self, block: Block) -> None:
        """A stop, which is an alarm where a check has led to it."""
        self.stop(block)

    def line(self, block: Block) -> None:
        """A straight move, which the control itself watches."""
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="BEGIN PGM .. MM first")
        *end, feed = map(float, block.fields)
        self.reader.set(travel_speed_mm_s=self._speed(feed))
        self.reader.travel(end)

    def _speed(self, feed: float) -> float:
        if feed <= 0:
            self.reader.fail("the feed must be positive", found=f"F{feed:g}")
        return feed / 60.0

    def cycle(self, block: Block) -> None:
        """What follows says where and how."""

    orientation = cycle

    def result_to(self, block: Block) -> None:
        """Where the result goes to."""
        self.first_q = int(block.fields[0])

    def vector(self, block: Block) -> None:
        """The direction of the search."""
        self.direction = list(map(float, block.fields))

    def measure(self, block: Block) -> None:
        """The search."""
        here = self.reader.builder.last_position
        if here is None:
            self.reader.fail("TCH PROBE 4 before any position is known", expected="an L block first")
        direction = self.reader.direction(self.direction, "IX IY IZ")
        way, feed, back = map(float, block.fields)
        if back < way:
            found, expected = f"MB {block.fields[2]}", f"SET UP, {way:g}"
            self.reader.fail("the probe does not go back all the way", found=found, expected=expected)
        self.reader.set(measuring_speed_mm_s=self._speed(feed))
        self.search([p + way * d for p, d in zip(here, direction, strict=True)], "TCH PROBE 4", True)

    def settle(self, contact: Contact, measuring: bool) -> None:
        """Four parameters have the result."""
        super().settle(contact, measuring)
        x, y, z = contact.position
        for place, value in enumerate((x, y, z + self.length_mm, 1.0 if contact.hit else -1.0)):
            self.variables[f"Q{self.first_q + place}"] = value

    def holds(self, block: Block) -> bool:
        """The condition of FN9 to FN12."""
        number, left, right, _ = block.fields
        return bool(self.number(f"{left} {CONDITIONS[re.sub('[ :]', '', number)]} {right}"))

    def orient(self, block: Block) -> None:
        """The spindle, as the option says."""
        self.reader.once("angle of the spindle", f"{float(block.fields[0]):+.10g}")

    def read_length(self, block: Block) -> None:
        """The calibrated length of the stylus."""
        self.variables[f"Q{block.fields[1]}"] = self.length_mm

    def printed(self, block: Block) -> None:
        """The mask prints QS1 and nothing else."""
        self.reader.once("log", " / ".join(block.fields[1:]))
        self.reader.log.append(number_words(self.look_up("QS1")))

    def text(self, block: Block) -> None:
        """A text parameter."""
        self.variables[f"QS{block.fields[0]}"] = block.fields[1]

    def to_text(self, block: Block) -> None:
        """A number with its decimals."""
        to, number, decimals = block.fields
        self.variables[f"QS{to}"] = fixed(self.number(f"Q{number}"), int(decimals))

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.variables["Q11"] = float(block.fields[0])
        self.reader.set(search_mm=float(block.fields[0]))

    def assign(self, block: Block) -> None:
        """An own parameter."""
        self.variables[block.fields[0]] = self.value(block.fields[1])


DIALECTS = (
    Dialect(
        "heidenhain",
        "HEIDENHAIN klartext, TNC 640 and iTNC 530 (TCH PROBE 4, FN16)",
        ".h",
        Heidenhain,
        recognises,
        4,
        SEARCH,
        states={"units": "MM"},
        comment="; {}",
        options={
            "folder": Option(
                "TNC:\\STEPGAUGE\\", Name(_FOLDER, "TNC:\\ and folders, each ending with \\"), "of mask and log"
            ),
            "mask": Option("STEPGAUGE.A", Name(_MASK_FILE, "a name that ends in .A"), "written beside the program"),
            "file": Option("STEPGAUGE.TXT", Name(_TEXT_FILE, "a name that ends in .TXT or .LOG"), "name of the log"),
            "spindle_deg": Option("+0", NumberOption(-360, 360, "deg", signed=True), "angle of the spindle"),
            "length_in_z": Option("yes", YES_NO, "whether z of TCH PROBE 4 has the length of the stylus in it"),
        },
        once={"log": "{folder}{mask} / {folder}{file}", "angle of the spindle": "{spindle_deg}"},
        beside={"{mask}": '"%s",QS1;\n'},
        log_decimals=4,
    ),
)

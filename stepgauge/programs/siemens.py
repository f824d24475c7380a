"""SINUMERIK 840D sl, 828D and ONE as a virtual controller: MEAS=1, the registers $AA_MW, STOPRE, WRITE.

``MEAS=1 G1 ..`` goes straight until the probe switches, and without a contact to its end; ``$AC_MEA[1]`` says which it
was. A measuring block whose registers are written before the next move is a measurement, any other protects the way.
``$AA_MW`` are workpiece coordinates with the tool length in force.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import MODAL, SEARCH, Dialect
from stepgauge.programs.expression import Grammar, Value, number_words
from stepgauge.programs.gcode import MOTION, GCode, end_of_line, modal, moves_with_result
from stepgauge.programs.grammar import (
    CLOSING,
    ENDS,
    IF,
    JUMP,
    NOT_CONFIRMED,
    QUIET,
    START,
    Code,
    DialectGrammar,
    Production,
    Slot,
    Variable,
)
from stepgauge.programs.options import ChoiceOption, Name, NumberOption, Option
from stepgauge.programs.reading import Contact, Reader

MEASURE = "MEAS"
ALARM = "ALARM: "
"""What the message of a stop begins with that is none for the operator's preparations."""
POST = "Autodesk's post for 840D"
MANUAL = "840D sl Programming Manual Fundamentals"
ADVANCED = "840D sl Programming Manual Job Planning"
LOG_NAME = r"(?=[A-Z_]{2})\w{1,24}(?<!_[A-Z]{3})(?:_(?:MPF|LOG|TXT))?"

TABLE = DialectGrammar(
    "siemens",
    forms=(
        Production("nothing", "DEF INT RET", "declares a variable", POST, QUIET),
        Production("nothing", "DEF STRING[{count}] OUT", "declares a text", POST, QUIET),
        Production("synchronise", "STOPRE", "stops the block preparation", POST, QUIET),
        Production("branch", "IF {condition} GOTOF {label}", "goes on at a label further down", POST, IF),
        Production("jump", "GOTOF {label}", "goes on at a label further down", ADVANCED, JUMP),
        Production("say", 'MSG("{text}")', "message", MANUAL, QUIET),
        Production("written", 'WRITE(RET, "{file}", OUT)', "appends a line to the log", POST),
        Production("written", 'WRITE(RET, "{file}", {quoted})', "appends a line to the log", POST),
        Production("say_search", "R90 = {number}", "way of a search beyond the nominal contact, mm", "stepgauge"),
        Production("assign", "{local} = {expression}", "own variable", MANUAL, QUIET),
        Production("orient", "SPOS={number}", "spindle to an angle", MANUAL, when=START),
    ),
    comments=(end_of_line(";", MANUAL, "()?!<>"),),
    codes=(
        Code("G0", "rapid move", MANUAL, MOTION),
        Code("G1", "straight move, with `MEAS=1` a search", POST, MOTION, words="MEAS"),
        *modal(MANUAL, units="G71 G710", distances="G90", feed="G94", plane="G17", tool_radius="G40", path="G60"),
        *modal(MANUAL, coordinates="G54 G55 G56 G57 G500"),
        Code("M0", "stop until the operator goes on", MANUAL, "M", way=QUIET),
        Code("M5", "spindle off", MANUAL, "M", way=CLOSING),
        Code("M2", "end of the program", MANUAL, "M", way=ENDS),
        Code("M30", "end of the program", MANUAL, "M", way=ENDS),
    ),
    words={"X": "number", "Y": "number", "Z": "number", "F": "positive", "MEAS": "one"},
    slots={
        "one": Slot("1", "1: the first probe, rising edge"),
        "label": Slot(r"[A-Za-z_]{2}\w{0,30}", "a label further down"),
        "text": Slot(r"[ A-Za-z0-9.,:?_-]*", "letters, digits and . , : ? _ -"),
        "quoted": Slot(r'"[ A-Za-z0-9.,:_-]*"', "a text of letters, digits and . , : _ - in quotes"),
        "file": Slot(LOG_NAME, "the name of the log, one in a program: _MPF, _LOG, _TXT or without an ending"),
        "local": Slot("R9[1-9]|OUT", "R91 to R99, OUT"),
    },
    variables=(
        Variable(r"\$AA_MW\[[XYZ]\]", "$AA_MW[X]", "where the probe switched (X, Y, Z), workpiece", POST),
        Variable(r"\$AC_MEA\[1\]", "$AC_MEA[1]", "1 after a contact", NOT_CONFIRMED),
        Variable(r"\$P_TOOLNO", "$P_TOOLNO", "number of the tool, 0 for none", NOT_CONFIRMED),
        Variable(r"R9\d(?!\d)|RET(?!\w)|OUT(?!\w)", "R90 to R99, RET, OUT", "own variables", MANUAL),
    ),
    label=r"(?:N\d{1,5}\s+)?([A-Z_]{2}\w{0,30}):|N(\d{1,5})(?=\s|$)",
)


def recognises(text: str) -> bool:
    """Whether a move with MEAS=1 is in the text."""
    return re.search(r"(?im)^[ \t]*(N\d+[ \t]+)?MEAS *= *1\b", text) is not None


class Siemens(GCode):
    """The control between blocks."""

    table: ClassVar[DialectGrammar] = TABLE
    searches: ClassVar[frozenset[str]] = frozenset({MEASURE})
    grammar: ClassVar[Grammar] = Grammar(
        "|".join(one.pattern for one in TABLE.variables), {"<>": "!=", "AND": "and", "OR": "or"}, "()"
    )

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.measuring: set[int] = set()
        self.tool = 1.0
        self.synchronised = True

    def prepare(self) -> None:
        """Which measuring blocks are measurements."""
        self.measuring = moves_with_result(self.blocks, lambda one: "$AA_MW" in one.text.upper())

    def move(self, block: Block, motion: str) -> None:
        """MEAS=1 makes a search of the move."""
        measuring = MEASURE in block.words
        if measuring and (motion != "G1" or not set("XYZ") & set(block.words)):
            self.reader.fail("only MEAS=1 with G1 and coordinates is understood", found=repr(block.text))
        super().move(block, MEASURE if measuring else motion)

    def settle(self, contact: Contact, measuring: bool) -> None:
        """The registers hold only after the block preparation has waited for the move."""
        super().settle(contact, measuring)
        self.synchronised = False

    def stop(self, block: Block) -> None:
        """A stop for an alarm is one that the program does not come back from."""
        if self.message.startswith(ALARM):
            self.reader.alarm(self.message.removeprefix(ALARM))
        super().stop(block)

    def orient(self, block: Block) -> None:
        """The spindle, as the option says."""
        self.reader.once("angle of the spindle", f"{float(block.fields[0]):.10g}")

    def synchronise(self, block: Block) -> None:
        """The registers hold."""
        self.synchronised = True

    def say(self, block: Block) -> None:
        """A message, which a stop shows."""
        self.message = block.fields[0]

    def written(self, block: Block) -> None:
        """A line of the log."""
        self.reader.once("log", block.fields[0])
        self.reader.log.append(number_words(self.value(block.fields[1] if len(block.fields) > 1 else "OUT")))
        self.variables["RET"] = 0.0

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.variables["R90"] = float(block.fields[0])
        self.reader.set(search_mm=float(block.fields[0]))

    def assign(self, block: Block) -> None:
        """An own variable."""
        self.variables[block.fields[0].upper()] = self.value(block.fields[1])

    def look_up(self, name: str) -> Value:
        """System variables and own ones."""
        name = name.upper()
        if name == "$P_TOOLNO":
            return self.tool
        if name.startswith("$A"):
            if not self.synchronised:
                self.reader.fail("read before the move has ended", found=name, expected="STOPRE first")
            return float(self.contact.hit) if "MEA" in name else self.contact.position["XYZ".index(name[-2])]
        return super().look_up(name)

    def holds(self, block: Block) -> bool:
        """A condition; one that stops the program without a tool has checked its length."""
        if self.stops_with(block, "tool", 0.0):
            self.reader.states["tool length"] = "checked"
        return super().holds(block)

    def measures(self, code: str) -> bool:
        """A measuring block whose registers are read before the next move."""
        return self.at - 1 in self.measuring


DIALECTS = (
    Dialect(
        "siemens",
        "Siemens SINUMERIK 840D sl, 828D, ONE (MEAS, WRITE)",
        ".mpf",
        Siemens,
        recognises,
        4,
        SEARCH,
        states={
            **MODAL,
            "units": "G710",
            "coordinates": "{offset}",
            "tool length": "checked",
            "path": "G60",
        },
        comment="; {}",
        once={"log": "{file}", "angle of the spindle": "{spindle_deg}"},
        options={
            "offset": Option("G54", ChoiceOption(("G54", "G55", "G56", "G57", "G500")), "work offset"),
            "spindle_deg": Option("0", NumberOption(-360, 360, "deg"), "angle of the spindle"),
            "file": Option("STEPGAUGE_LOG", Name(LOG_NAME, TABLE.slot("file").what), "name of the log"),
        },
        log_decimals=6,
    ),
)

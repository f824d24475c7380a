"""grbl 1.1 and what keeps to it (grblHAL, FluidNC) as a virtual controller: no variables, no file, a console.

``G38.2`` is a measurement; without a contact the controller stops with ALARM:5. ``G38.3`` protects the way: a contact
ends it, and the next search then stops with ALARM:4, for the probe is deflected before it starts. The console shows
``[PRB:x,y,z:1]`` after every search: machine coordinates, three decimals. The program therefore makes G59 the same as
machine coordinates.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.files.controls import fixed
from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import MODAL, SEARCH, Dialect
from stepgauge.programs.gcode import MOTION, GCode, modal, not_executed
from stepgauge.programs.grammar import END, ENDS, QUIET, START, Code, DialectGrammar, Production
from stepgauge.programs.reading import Contact, Reader

NIST = "NIST RS274/NGC"
DOCS = "grbl 1.1, doc/markdown/commands.md"
INTERFACE = "grbl 1.1, doc/markdown/interface.md"
PROBE, GUARD = "G38.2", "G38.3"

TABLE = DialectGrammar(
    "grbl",
    forms=(
        Production("set_offset", "G10L2P6X0Y0Z0", "makes G59 machine coordinates", f"{NIST}, 3.5.5", when=START),
        Production("nothing", "G4P{positive}", "dwell, s", f"{NIST}, 3.5.4", QUIET),
        Production(
            "say_search", "(SEARCH {positive} MM BEYOND THE NOMINAL CONTACT)", "states that way, mm", "stepgauge"
        ),
    ),
    comments=not_executed(INTERFACE),
    codes=(
        Code("G0", "rapid move", f"{NIST}, 3.5.1", MOTION),
        Code("G1", "straight move", f"{NIST}, 3.5.2", MOTION),
        Code(PROBE, "search; without a contact ALARM:5", DOCS, MOTION),
        Code(GUARD, "move that a contact ends; deflected before it: ALARM:4", DOCS, MOTION),
        *modal(f"{NIST}, 3.5.6 to 3.5.11", plane="G17", units="G21", tool_radius="G40", tool_length="G49"),
        *modal(f"{NIST}, 3.5.14 to 3.5.19", path="G61", cycle="G80", distances="G90", feed="G94"),
        Code("G54", "work offset that is in force before", f"{NIST}, 3.5.13", "coordinates", when=END),
        *modal(f"{NIST}, 3.5.13", coordinates="G59"),
        Code("G92.1", "no shift of the origin", f"{NIST}, 3.5.18", "shift", when=START),
        Code("M0", "stop until the operator goes on", f"{NIST}, 3.6.1", "M", way=QUIET),
        Code("M2", "end of the program", f"{NIST}, 3.6.1", "M", way=ENDS),
        Code("M30", "end of the program", f"{NIST}, 3.6.1", "M", way=ENDS),
    ),
    words={"X": "number", "Y": "number", "Z": "number", "F": "positive"},
    label=r"N(\d{1,5})(?!\d)",
    blanks_ignored=True,
)
LONGEST_BLOCK = 80
"""Characters of a line that grbl 1.1 has room for, without blanks and comments."""


def recognises(text: str) -> bool:
    """Whether G59 is made machine coordinates before a straight probe."""
    return re.search(r"(?im)^ *G10 *L2 *P6\b", text) is not None and "38.2" in text


class Grbl(GCode):
    """The controller between lines."""

    table: ClassVar[DialectGrammar] = TABLE
    searches: ClassVar[frozenset[str]] = frozenset({PROBE, GUARD})
    one_shot: ClassVar[frozenset[str]] = frozenset({PROBE, GUARD})

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.deflected = False

    def step(self) -> None:
        """A line, which the console answers."""
        block = self.blocks[self.at]
        if len(block.text) > LONGEST_BLOCK and not block.text.startswith("("):
            self.reader.line = block.line
            found = f"{len(block.text)} characters"
            self.reader.fail("the line is too long for grbl", found=found, expected=f"{LONGEST_BLOCK}")
        super().step()
        if not block.text.startswith("("):
            self.reader.log.append("ok")

    def after_one_shot(self, code: str) -> str:
        """After a search no motion holds."""
        return ""

    def set_offset(self, block: Block) -> None:
        """The only offset that may be set."""
        self.reader.states["offset"] = "G10 L2 P6 X0 Y0 Z0"

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.reader.set(search_mm=float(block.fields[0]))

    def go(self, target: dict[str, float], motion: str) -> None:
        """No search starts with the probe deflected."""
        if motion in self.searches and self.deflected:
            self.reader.log.append("ALARM:4")
            self.reader.alarm("ALARM:4 probe fail: the probe is not in the expected initial state")
        self.deflected = False
        super().go(target, motion)

    def measures(self, code: str) -> bool:
        """G38.2 must find its face."""
        return code == PROBE

    def settle(self, contact: Contact, measuring: bool) -> None:
        """The console shows every search; a contact keeps the probe deflected."""
        super().settle(contact, measuring)
        self.deflected = contact.hit
        x, y, z = (fixed(value, 3) for value in contact.position)
        self.reader.log.append(f"[PRB:{x},{y},{z}:{int(contact.hit)}]")
        if measuring and not contact.hit:
            self.reader.log.append("ALARM:5")
            self.reader.alarm("ALARM:5 probe fail: no contact")


DIALECTS = (
    Dialect(
        "grbl",
        "grbl 1.1, grblHAL, FluidNC (G38.2)",
        ".gcode",
        Grbl,
        recognises,
        4,
        SEARCH,
        states={
            **MODAL,
            "coordinates": "G59",
            "offset": "G10 L2 P6 X0 Y0 Z0",
            "shift": "G92.1",
            "tool length": "G49",
            "path": "G61",
        },
        comment="({})",
        log_decimals=3,
    ),
)

"""LinuxCNC G-code: G0/G1 moves and G38.2 straight probes, in millimetres and absolute coordinates.

G38.2 names the end of the search; the named parameter ``#<_search_mm>`` says how far that is beyond the nominal tip
centre at contact. The controller itself stops where a search ends without a contact, and where the probe trips on the
way. ``(LOG,..)`` and ``(PROBEOPEN ..)`` write the log.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.files.controls import fixed
from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import MODAL, SEARCH, Dialect
from stepgauge.programs.expression import Value
from stepgauge.programs.gcode import MOTION, STOP, GCode, modal, not_executed
from stepgauge.programs.grammar import (
    CLOSING,
    END,
    ENDS,
    FRAME,
    QUIET,
    START,
    Code,
    DialectGrammar,
    Production,
    Slot,
)
from stepgauge.programs.reading import Contact, Reader

NIST = "NIST RS274/NGC"
DOCS = "LinuxCNC 2.9, G-code overview"
LOGGING = "LinuxCNC 2.9, G-code overview: probe and general logging"
_FORMAT = re.compile(r"%(d|\.\d+f)(#<\w+>|#\d+)", re.ASCII)
_REGISTERS = {"#5061": 0, "#5062": 1, "#5063": 2}

TABLE = DialectGrammar(
    "linuxcnc",
    forms=(
        Production("tape", "%", "begin and end of the program", f"{NIST}, 3.2", QUIET, FRAME),
        Production(
            "say_search", "#<_search_mm>={positive}", "way of a search beyond the nominal contact, mm", "stepgauge"
        ),
        Production("count", "#<_n>={count}", "number of the point", f"{DOCS}: parameters", QUIET),
        Production("read_input", "M66E0L0", "reads an analog input into #5399", "LinuxCNC 2.9, M-codes: M66", QUIET),
        Production("open_log", "(LOGOPEN,{file})", "opens the log", LOGGING, when=START),
        Production("printed", "(LOG,{print})", "prints a line of the log", LOGGING),
        Production("nothing", "(LOGCLOSE)", "closes the log", LOGGING, CLOSING, END),
        Production("open_points", "(PROBEOPEN {file})", "opens a log of all contacts", LOGGING, when=START),
        Production("close_points", "(PROBECLOSE)", "closes it", LOGGING, CLOSING, END),
    ),
    comments=not_executed(f"{DOCS}: comments"),
    codes=(
        Code("G0", "rapid move", f"{NIST}, 3.5.1", MOTION),
        Code("G1", "straight move", f"{NIST}, 3.5.2", MOTION),
        Code("G38.2", "search; without a contact an alarm", "LinuxCNC 2.9, G-codes: G38.n", MOTION),
        *modal(f"{NIST}, 3.5.6 to 3.5.19", plane="G17", units="G21", tool_radius="G40", tool_length="G49"),
        *modal(f"{NIST}, 3.5.13 to 3.5.19", coordinates="G54", path="G61", cycle="G80", distances="G90", feed="G94"),
        STOP,
        Code("M2", "end of the program", f"{NIST}, 3.6.1", "M", way=ENDS),
        Code("M30", "end of the program", f"{NIST}, 3.6.1", "M", way=ENDS),
    ),
    words={"X": "number", "Y": "number", "Z": "number", "F": "positive"},
    slots={
        "file": Slot(r"[A-Za-z0-9_-]{1,40}\.(?:txt|log|csv)", "the log, one in a program, in the program's folder"),
        "print": Slot(
            r"(?:[ A-Za-z0-9.,:_-]|%(?:d|\.\df)#(?:<_n>|50(?:6[123]|70)|5399))+",
            "letters, digits and . , : _ -, `%d` or `%.7f` and `#<_n>`, `#5061` to `#5063`, `#5070`, `#5399`",
        ),
    },
    label=r"N(\d{1,5})(?!\d)",
    blanks_ignored=True,
    longest=255,
)


def recognises(text: str) -> bool:
    """Whether a G38.2 straight probe is in the text."""
    return re.search(r"(?im)^[^(;\n]*G38\.2", text) is not None


class LinuxCNC(GCode):
    """The controller between lines."""

    table: ClassVar[DialectGrammar] = TABLE
    searches: ClassVar[frozenset[str]] = frozenset({"G38.2"})

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.logs, self.opened = False, False

    def tape(self, block: Block) -> None:
        """The second one ends the program."""
        self.ended = self.at > 1

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.reader.set(search_mm=float(block.fields[0]))

    def count(self, block: Block) -> None:
        """The number of the point, for the log."""
        self.variables["#<_N>"] = float(block.fields[0])

    def read_input(self, block: Block) -> None:
        """The analog input is taken as a clock."""

    def open_log(self, block: Block) -> None:
        """The file of the log."""
        self.reader.once("log", block.fields[0])
        self.logs = True

    def open_points(self, block: Block) -> None:
        """From here on every contact is written."""
        self.reader.once("log of all contacts", block.fields[0])
        self.opened = True

    def close_points(self, block: Block) -> None:
        """No more."""
        self.opened = False

    def printed(self, block: Block) -> None:
        """A line of the log."""
        self.reader.log.append(_FORMAT.sub(self._digits, block.fields[0]))

    def _digits(self, match: re.Match[str]) -> str:
        value = self.reader.require_number(self.look_up(match[2].upper()))
        return f"{value:.0f}" if match[1] == "d" else fixed(value, int(match[1][1:-1]))

    def look_up(self, name: str) -> Value:
        """Registers of the probe."""
        if name in _REGISTERS:
            return self.contact.position[_REGISTERS[name]]
        if name == "#5070":
            return float(self.contact.hit)
        return self.contact.time_s if name == "#5399" else super().look_up(name)

    def settle(self, contact: Contact, measuring: bool) -> None:
        """A miss halts the program; an open file gets the point. Beside a log of the program it is a second file."""
        super().settle(contact, measuring)
        if not contact.hit:
            self.reader.alarm("G38.2 move finished without making contact.")
        if self.opened and not self.logs:
            self.reader.log.append(" ".join([*(fixed(v, 6) for v in contact.position), *["0.000000"] * 6]))


DIALECTS = (
    Dialect(
        "linuxcnc",
        "LinuxCNC 2.9 G-code (G38.2)",
        ".ngc",
        LinuxCNC,
        recognises,
        6,
        SEARCH,
        states={**MODAL, "coordinates": "G54", "tool length": "G49", "path": "G61"},
        comment="({})",
    ),
)

"""RepRapFirmware 3 as a virtual controller: G38 searches, meta commands for checks and for the log.

A search has the speed of its probe (``M558``). ``G38.2`` ends at the contact, where ``move.axes[n].userPosition`` is
read (the position of the stopped axes, no latch); without a contact ``result`` is not 0. ``G38.3`` on the way says
nothing: the program compares position and target.
"""

from __future__ import annotations

from typing import ClassVar

from stepgauge.programs.blocks import WORDS, Block
from stepgauge.programs.dialect import SEARCH, Dialect
from stepgauge.programs.expression import Grammar, Value, number_words
from stepgauge.programs.gcode import MOTION, GCode, modal
from stepgauge.programs.grammar import (
    CLOSING,
    ENDS,
    IF,
    NOT_CONFIRMED,
    QUIET,
    START,
    Code,
    Comment,
    DialectGrammar,
    Production,
    Slot,
    Variable,
)
from stepgauge.programs.options import ChoiceOption, Name, NumberOption, Option
from stepgauge.programs.reading import Contact, Reader

DOCS = "docs.duet3d.com, G-code dictionary"
META = "docs.duet3d.com, G-code meta commands"
SOURCE = "RepRapFirmware, straightProbe2"
PROBE, GUARD = "G38.2", "G38.3"
LOG_FILE = r"[01]:/(?:sys|gcodes)/[A-Za-z0-9_-]{1,40}\.(?:txt|log|csv)"
OFFSETS = "G54 G55 G56 G57 G58 G59 G59.1 G59.2 G59.3"
_NO_LABEL = r"(?!\s*(?i:printing|stop|mesh|process|layer|begin|height|remaining|z:))"

TABLE = DialectGrammar(
    "rrf",
    forms=(
        Production("branch", "if {{condition}}", "the lines below, further in, if it holds", META, IF),
        Production("abort", 'abort "{text}"', "ends the program with a text", META, ENDS),
        Production("created", 'echo >"{file}" {expression}', "first line of the log", META, when=START),
        Production("written", 'echo >>"{file}" {expression}', "a line of the log", META),
        Production(
            "say_search", "var search = {positive}", "way of a search beyond the nominal contact, mm", "stepgauge"
        ),
        Production("assign", "var {local} = {expression}", "own variable", META, QUIET),
        Production("speed", "M558 K{count} F{positive}", "speed of searches with a probe, mm/min", SOURCE, CLOSING),
        Production("nothing", 'M291 R"{text}" P"{text}" S{wait}', "message, and waits", DOCS, QUIET),
        Production("nothing", 'M291 P"{text}" S{wait}', "message, and waits", DOCS, QUIET),
        Production("nothing", "M400", "waits for the move", DOCS, QUIET),
        Production("nothing", "M120", "keeps the state", NOT_CONFIRMED, when=START),
        Production("nothing", "M121", "gives the state back: the end of the program", NOT_CONFIRMED, ENDS),
    ),
    comments=(
        Comment(
            ";",
            "",
            rf"{_NO_LABEL}[ A-Za-z0-9.,;:_/=+*'?()-]*",
            "letters, digits and . , ; : _ / = + * ' ? ( ) -, not the words that label objects and layers",
            DOCS,
        ),
    ),
    codes=(
        Code("G0", "rapid move", DOCS, MOTION),
        Code("G1", "straight move", DOCS, MOTION),
        Code(PROBE, "search; without a contact `result` is not 0", SOURCE, MOTION, words="K"),
        Code(GUARD, "move that a contact ends", SOURCE, MOTION, words="K"),
        *modal(DOCS, units="G21", distances="G90", feed="G94", coordinates=OFFSETS),
    ),
    words={"X": "number", "Y": "number", "Z": "number", "F": "positive", "K": "count"},
    slots={
        "text": Slot(r"[ A-Za-z0-9.,:?_-]*", "letters, digits and . , : ? _ -"),
        "file": Slot(LOG_FILE, "the log, one in a program: 0:/sys/ or 0:/gcodes/, .txt, .log or .csv"),
        "local": Slot(r"(?!search\b)[A-Za-z]\w{0,30}", "a name"),
        "wait": Slot("[23]", "2 or 3: until the operator goes on"),
    },
    variables=(
        Variable(
            r"move\.axes\[[012]\]\.userPosition",
            "move.axes[0].userPosition",
            "where axis 0, 1, 2 is",
            "macros of users",
        ),
        Variable(r"var\.\w+", "var.name", "own variables", META),
        Variable(r"result(?!\w)", "result", "0 if the command before was done", NOT_CONFIRMED),
    ),
    any_case=False,
)


def recognises(text: str) -> bool:
    """Whether the position of an axis is read from the object model after a straight probe."""
    return "38.2" in text and "].userPosition" in text


class RepRapFirmware(GCode):
    """The firmware between lines."""

    table: ClassVar[DialectGrammar] = TABLE
    searches: ClassVar[frozenset[str]] = frozenset({PROBE, GUARD})
    one_shot: ClassVar[frozenset[str]] = frozenset({PROBE, GUARD})
    grammar: ClassVar[Grammar] = Grammar(
        "|".join(one.pattern for one in TABLE.variables), {"&&": "and", "||": "or", "^": "<<"}, "()"
    )

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.speed_mm_s: dict[float, float] = {}
        self.probe = 0.0
        self.missed = False

    def step(self) -> None:
        """The next line; ``result`` is that of the command before."""
        block = self.blocks[self.at]
        if block.form is WORDS or block.text.startswith("M"):
            self.missed = False
        super().step()

    def find_targets(self) -> dict[int, int]:
        """A condition that does not hold goes on behind the lines that are further in."""
        targets, inside = {}, [0]
        for place, block in enumerate(self.blocks):
            self.reader.line = block.line
            inside = [one for one in inside if one <= block.indent]
            if block.indent != inside[-1]:
                self.reader.fail("a line is further in than the one before", found=repr(block.text))
            if block.way == IF:
                behind = range(place + 1, len(self.blocks) + 1)
                ends = (n for n in behind if n == len(self.blocks) or self.blocks[n].indent <= block.indent)
                targets[place] = next(ends)
                if targets[place] == place + 1:
                    self.reader.fail("a condition without lines below it, further in", found=repr(block.text))
                inside.append(self.blocks[place + 1].indent)
        return targets

    def holds(self, block: Block) -> bool:
        """The lines below are left out unless the condition holds."""
        return not super().holds(block)

    def words(self, block: Block) -> None:
        """A block that moves says how."""
        if set("XYZ") & set(block.words) and not any(one.group == MOTION for one in block.codes):
            self.reader.fail("coordinates without a motion", found=repr(block.text), expected="G1 or a search")
        self.probe = block.words.get("K", 0.0)
        super().words(block)

    def abort(self, block: Block) -> None:
        """The program stops itself."""
        self.reader.alarm(block.fields[0])

    def created(self, block: Block) -> None:
        """A line of the log."""
        self.reader.once("log", block.fields[0])
        self.reader.log.append(number_words(self.value(block.fields[1])))

    written = created

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.variables["var.search"] = float(block.fields[0])
        self.reader.set(search_mm=float(block.fields[0]))

    def assign(self, block: Block) -> None:
        """An own variable."""
        self.variables[f"var.{block.fields[0]}"] = self.value(block.fields[1])

    def speed(self, block: Block) -> None:
        """The speed of a probe."""
        self.reader.once("probe", block.fields[0])
        self.speed_mm_s[float(block.fields[0])] = float(block.fields[1]) / 60.0

    def look_up(self, name: str) -> Value:
        """The object model: positions have three decimals."""
        if name.startswith("move."):
            return round(self.contact.position[int(name[len("move.axes[")])], 3)
        if name == "result":
            return 2.0 if self.missed else 0.0
        return super().look_up(name)

    def go(self, target: dict[str, float], motion: str) -> None:
        """A search has the speed of its probe (M558), whatever F says."""
        feed = self.feed_mm_s
        if motion in self.searches:
            self.feed_mm_s = self.speed_mm_s.get(self.probe)
        super().go(target, motion)
        self.feed_mm_s = feed

    def settle(self, contact: Contact, measuring: bool) -> None:
        """Only a search that must find its face fails without one."""
        super().settle(contact, measuring)
        self.missed = measuring and not contact.hit

    def measures(self, code: str) -> bool:
        """G38.2 must find its face."""
        return code == PROBE


DIALECTS = (
    Dialect(
        "rrf",
        "RepRapFirmware 3 (Duet, MillenniumOS)",
        ".g",
        RepRapFirmware,
        recognises,
        4,
        SEARCH,
        states={"units": "G21", "distances": "G90", "feed": "G94", "coordinates": "{offset}"},
        comment="; {}",
        options={
            "offset": Option("G54", ChoiceOption(tuple(OFFSETS.split())), "work offset"),
            "probe": Option("0", NumberOption(0, 31, whole=True), "number of the probe (K)"),
            "file": Option("0:/sys/stepgauge-log.txt", Name(LOG_FILE, TABLE.slot("file").what), "the log"),
        },
        once={"log": "{file}", "probe": "{probe}"},
        log_decimals=3,
    ),
)

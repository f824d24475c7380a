"""Fanuc custom macro B as a virtual controller, with what Haas, Mazak and Mitsubishi share of it.

``G31`` goes straight until the skip signal comes, and without one to its end, silently: the program itself compares
``#5061..`` with the end. A G31 whose registers are printed before the next move is a measurement, any other protects
the way. ``#5061..`` are workpiece coordinates; with parameter 6014 bit 4 at 0 they contain the tool length in z.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import ClassVar

from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import MODAL, SEARCH, Dialect
from stepgauge.programs.expression import Grammar, Value
from stepgauge.programs.gcode import MOTION, ORDINARY, GCode, modal, moves_with_result
from stepgauge.programs.grammar import (
    CLOSING,
    END,
    ENDS,
    FIRST,
    FRAME,
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
from stepgauge.programs.options import YES_NO, ChoiceOption, NumberOption, Option
from stepgauge.programs.reading import Reader

POST = "Autodesk's inspection post for Fanuc"
MANUAL = "Fanuc 15i operator's manual"
HAAS = "Haas NGC manual, G31"
GROUPS = {
    "4001": {"G0", "G1"},
    "4003": {"G90", "G91"},
    "4005": {"G94", "G95"},
    "4006": {"G20", "G21"},
    "4014": {"G54", "G55", "G56", "G57", "G58", "G59"},
}
"""Modal information by group, and the codes of the group that are known here."""
_FIELD = re.compile(r"#(\d+)\[(\d)(\d)\]")

TABLE = DialectGrammar(
    "fanuc",
    forms=(
        Production("tape", "%", "begin and end of the tape", MANUAL, QUIET, FRAME),
        Production("nothing", "O{program}", "number of the program", MANUAL, QUIET, FIRST),
        Production("ask", "#3006=1", "stop with the comment as message", POST, QUIET),
        Production("alarm", "#3000={alarm}", "alarm 3000 + n with the comment as text", POST, ENDS),
        Production("save", "#{saved}=#{modal}", "keeps a modal code", NOT_CONFIRMED, when=START),
        Production("give_back", "{given}", "gives the kept modal codes back", NOT_CONFIRMED, when=END),
        Production("say_search", "#100={point}", "way of a search beyond the nominal contact, mm", "stepgauge"),
        Production("assign", "#{local}={expression}", "own variable", MANUAL, QUIET),
        Production("branch", "IF[{condition}]GOTO{label}", "goes on at block N..", POST, IF),
        Production("jump", "GOTO{label}", "goes on at block N..", POST, JUMP),
        Production("printed", "DPRNT[{print}]", "prints a line of the log", POST),
        Production("nothing", "POPEN", "opens the output", POST, when=START),
        Production("nothing", "PCLOS", "closes the output", POST, CLOSING, END),
        Production("nothing", "{dwell}", "dwell", HAAS, QUIET),
        Production("nothing", "G53", "alone: ends the look-ahead", f"{POST} (a waiting loop); {NOT_CONFIRMED}", QUIET),
        Production("nothing", "G65P9832", "turns the probe on (Renishaw)", POST, when=START),
        Production("nothing", "G65P9833", "turns the probe off (Renishaw)", POST, CLOSING, END),
    ),
    comments=(replace(ORDINARY, source=MANUAL),),
    codes=(
        Code("G0", "rapid move", MANUAL, MOTION),
        Code("G1", "straight move", MANUAL, MOTION),
        Code("G31", "search: straight until the skip signal", MANUAL, MOTION),
        *modal(MANUAL, units="G21", distances="G90", feed="G94", plane="G17", tool_radius="G40", cycle="G80"),
        *modal(MANUAL, coordinates="G54 G55 G56 G57 G58 G59"),
        Code("M0", "stop until the operator goes on", MANUAL, "M", way=QUIET),
        Code("M5", "spindle off", MANUAL, "M", way=CLOSING),
        Code("M19", "spindle to its angle", POST, "M", when=START),
        Code("M30", "end of the program", MANUAL, "M", way=ENDS),
    ),
    words={"X": "point", "Y": "point", "Z": "point", "F": "point"},
    slots={
        "dwell": Slot(r"G0?4P\d{1,5}", "`G04 P..`, ms"),
        "program": Slot(r"[1-7]?\d{1,3}", "a number up to 7999 (from 8000 on they are the maker's)"),
        "alarm": Slot(r"\d{1,3}", "a number up to 999"),
        "saved": Slot(r"12[1-5]", "121 to 125"),
        "modal": Slot("40(?:01|03|05|06|14)", "4001, 4003, 4005, 4006, 4014 (groups of G01, G90, G94, G21, G54)"),
        "given": Slot(r"(?:G#12[1-5]){1,5}", "`G#121` to `G#125`, each kept before"),
        "local": Slot(r"1(?:0[1-9]|1\d)", "101 to 119"),
        "print": Slot(r"(?:[A-Z0-9*.+-]|#1(?:0[1-9]|1\d)\[\d\d\])+", "capitals, digits, * for a blank, `#n[wd]`"),
    },
    variables=(
        Variable(r"#1(?:0[1-9]|1\d)(?!\d)", "#101 to #119", "own variables", MANUAL),
        Variable(r"#506[123](?!\d)", "#5061 #5062 #5063", "where the last skip was, or the end of the move", MANUAL),
        Variable(r"#4008(?!\d)", "#4008", "G43 or G49 in force", POST),
        Variable(r"#\[2[02]00\+#4111\]", "#[2000+#4111] #[2200+#4111]", "length of the tool and its wear", POST),
        Variable(r"PRM\[6014,4\]", "PRM[6014,4]", "whether #5063 is without the length of the tool", POST),
    ),
    label=r"N(\d{1,5})(?!\d)",
    blanks_ignored=True,
    any_case=False,
    last="tape",
)


def recognises(text: str) -> bool:
    """Whether there is a G31, and not the labels or the assignments of other controls."""
    return re.search(r"(?im)^[^(;\n]*G31(?!\d)", text) is not None and re.search(r"#\d+ *=", text) is not None


class Fanuc(GCode):
    """The control between blocks.

    It starts as an operator may have left it: in inches, incremental, feed per revolution, and with the tool length
    of the probe active (``length_mm`` in the offset table, and in the register where bit 4 of 6014 is 0).
    """

    table: ClassVar[DialectGrammar] = TABLE
    searches: ClassVar[frozenset[str]] = frozenset({"G31"})
    one_shot: ClassVar[frozenset[str]] = frozenset({"G31"})
    grammar: ClassVar[Grammar] = Grammar(
        "|".join(one.pattern for one in TABLE.variables),
        {"EQ": "==", "NE": "!=", "GT": ">", "GE": ">=", "LT": "<", "LE": "<=", "AND": "and", "OR": "or"},
        "[]",
    )

    def __init__(self, reader: Reader, length_mm: float = 0.0, bit_6014_4: int = 0) -> None:
        super().__init__(reader)
        self.length_mm, self.bit_6014_4 = length_mm, bit_6014_4
        self.modal = {"4001": "G0", "4003": "G91", "4005": "G95", "4006": "G20", "4014": "G57"}
        self.saved: dict[str, tuple[str, str]] = {}
        self.tool_length = 43.0
        self.measuring: set[int] = set()

    def prepare(self) -> None:
        """Which skips are measurements."""
        self.measuring = moves_with_result(
            self.blocks, lambda one: one.form.name == "printed" and bool(_FIELD.search(one.fields[0]))
        )

    def words(self, block: Block) -> None:
        """A block of words; each group keeps its code."""
        for code in block.codes:
            self.modal.update({group: code.code for group, codes in GROUPS.items() if code.code in codes})
        super().words(block)

    def tape(self, block: Block) -> None:
        """Begin and end."""

    def ask(self, block: Block) -> None:
        """A stop for the operator."""

    def alarm(self, block: Block) -> None:
        """The program stops itself."""
        self.reader.alarm(f"{3000 + int(block.fields[0])} {block.comment}")

    def save(self, block: Block) -> None:
        """A modal code into a variable that nothing else writes."""
        name, group = block.fields
        if group in {kept for kept, _ in self.saved.values()} or name in self.saved:
            self.reader.fail("a modal code is kept twice", found=repr(block.text))
        self.saved[name] = group, self.modal[group]

    def give_back(self, block: Block) -> None:
        """The kept codes, each group once."""
        for name in re.findall(r"#(\d+)", block.fields[0]):
            if name not in self.saved:
                self.reader.fail("gives back what was not kept", found=f"G#{name}", expected=f"#{name}=#40.. before")
            group, code = self.saved.pop(name)
            self.modal[group] = code

    def say_search(self, block: Block) -> None:
        """How far a search goes beyond the nominal contact."""
        self.reader.set(search_mm=float(block.fields[0]))

    def assign(self, block: Block) -> None:
        """An own variable."""
        self.variables[f"#{block.fields[0]}"] = self.number(block.fields[1])

    def printed(self, block: Block) -> None:
        """A line of the log, ``*`` for a blank."""
        self.reader.log.append(_FIELD.sub(self._digits, block.fields[0].replace("*", " ")))

    def _digits(self, match: re.Match[str]) -> str:
        """A number as DPRNT prints it with parameter 6001 bit 1 at 0: blanks for the zeros in front."""
        value, whole, decimals = self.number(f"#{match[1]}"), int(match[2]), int(match[3])
        size = f"{abs(value):.{decimals}f}"
        if len(size.split(".")[0]) > whole:
            found, expected = f"{value:.4f} in [{match[2]}{match[3]}]", "more digits before the point (setting digits)"
            self.reader.fail("the number does not fit in the log", found=found, expected=expected)
        width = whole + (decimals + 1 if decimals else 0)
        return ("-" if value < 0 else " ") + size.rjust(width)

    def look_up(self, name: str) -> Value:
        """Registers of the last skip, modal codes, offsets and parameters."""
        if name.startswith("#506"):
            length = self.length_mm if name == "#5063" and not self.bit_6014_4 else 0.0
            return self.contact.position[int(name[-1]) - 1] + length
        if name == "#4008":
            return self.tool_length
        known = {"PRM[6014,4]": float(self.bit_6014_4), "#[2000+#4111]": self.length_mm, "#[2200+#4111]": 0.0}
        return known[name] if name in known else super().look_up(name)

    def holds(self, block: Block) -> bool:
        """A condition; one that stops the program without G43 states the tool length."""
        if self.stops_with(block, "tool_length", 49.0):
            self.reader.states["tool length"] = "G43"
        return super().holds(block)

    def measures(self, code: str) -> bool:
        """A skip whose registers are printed before the next move."""
        return self.at - 1 in self.measuring


class Haas(Fanuc):
    """What a Haas has besides."""

    table: ClassVar[DialectGrammar] = replace(
        TABLE,
        name="haas",
        forms=(
            *TABLE.forms,
            Production("nothing", "G103P1", "look-ahead of one block", NOT_CONFIRMED, QUIET),
            Production("nothing", "G103", "look-ahead without a limit", NOT_CONFIRMED, QUIET),
            Production("nothing", "M59P1134", "turns the probe on", NOT_CONFIRMED, when=START),
            Production("nothing", "M69P1134", "turns the probe off", NOT_CONFIRMED, CLOSING, END),
        ),
    )


def _variant(control: type[Fanuc], name: str, title: str, most_feed_mm_s: float = math.inf, **defaults: str) -> Dialect:
    """A control that reads the macro language of Fanuc, with what differs."""
    options = {key: replace(one, default=defaults.get(key, one.default)) for key, one in OPTIONS.items()}
    if control is Haas:
        options["probe_on"] = replace(options["probe_on"], kind=ChoiceOption(("M59 P1134", "G65 P9832", "")))
        options["probe_off"] = replace(options["probe_off"], kind=ChoiceOption(("M69 P1134", "G65 P9833", "")))
        options["digits"] = replace(options["digits"], kind=ChoiceOption(("44", "34", "35")))
    return replace(
        FANUC, name=name, title=title, control=control, family="fanuc", options=options, most_feed_mm_s=most_feed_mm_s
    )


OPTIONS = {
    "number": Option(
        "7000", NumberOption(1, 7999, whole=True), "number of the program (from 8000 on they are the maker's)"
    ),
    "offset": Option("G54", ChoiceOption(("G54", "G55", "G56", "G57", "G58", "G59")), "work offset"),
    "probe_on": Option("", ChoiceOption(("", "G65 P9832")), "turns the probe on; `G65 P9832`: Renishaw"),
    "probe_off": Option("", ChoiceOption(("", "G65 P9833")), "turns the probe off; `G65 P9833`: Renishaw"),
    "orient": Option("M19", ChoiceOption(("M19", "")), "turns the spindle to its angle"),
    "length_in_z": Option(
        "parameter",
        ChoiceOption(("parameter", *YES_NO.values)),
        "whether `#5063` has the tool length in it; `parameter`: as bit 4 of parameter 6014 states",
    ),
    "look_ahead": Option(
        "G53", ChoiceOption(("G53", "G04 P1", "")), "block that ends the look-ahead before a register is read"
    ),
    "digits": Option(
        "44",
        ChoiceOption(("34", "44", "54", "35", "45", "55", "36", "46", "56", "57")),
        "digits of DPRNT before and after the point; not coarser than the coordinates of the program",
    ),
    "open": Option("POPEN", ChoiceOption(("POPEN", "")), "opens the output of DPRNT"),
}
FANUC = Dialect(
    "fanuc",
    "Fanuc custom macro B (G31, DPRNT)",
    ".nc",
    Fanuc,
    recognises,
    4,
    SEARCH,
    states={**MODAL, "coordinates": "{offset}", "tool length": "G43"},
    comment="({})",
    options=OPTIONS,
    log_decimals=4,
)
DIALECTS = (
    FANUC,
    _variant(
        Haas, "haas", "Haas NGC", 2500.0 / 60.0, probe_on="M59 P1134", probe_off="M69 P1134", length_in_z="yes", open=""
    ),
    _variant(Fanuc, "mazak", "Mazak Matrix and Smooth, EIA", length_in_z="yes"),
    _variant(Fanuc, "mitsubishi", "Mitsubishi M70 and M80", length_in_z="yes"),
)

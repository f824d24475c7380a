"""Kinds of places of a program text, and texts with a construct at each of them."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from benchmarks.attack.constructs import Construct

Insertion = tuple[str, str, int, int]
"""Kind of place, text with the construct, and where it stands in it (offset of its first sign and behind its last)."""


@dataclass(frozen=True)
class Lines:
    """How lines of a dialect are known, and what surrounds a construct; ``{}`` is the construct.

    ``travel``, ``measure``, ``result``: patterns of lines that go on, measure, and print a result; ``end``: of the line
    that ends the program; ``remark``: a line that says something; ``own_remark``: a remark of the construct alone;
    ``block_end``: what ends a block or begins the remark behind it; ``alarm``: a line that only an alarm reaches;
    ``wrapped``: branches and loops whose condition depends on a reading; ``line``: a whole command.
    """

    travel: str
    measure: str
    result: str
    end: str
    remark: str = r"(?!)"
    own_remark: str = ""
    block_end: str = ""
    alarm: str = r"(?!)"
    wrapped: Sequence[str] = ()
    line: str = "{}"


_MACRO_B = Lines(
    r"G31 .*F2500|G31 .*F3000",
    r"G31 .*F180",
    r"DPRNT\[N",
    r"M30",
    r"\((?!BEFORE).*\)$",
    "({})",
    ";",
    r"N9001",
    (
        "IF [#5061 LT 99999] GOTO 9050\n{}\nN9050",
        "IF [#5061 GT 99999] GOTO 9051\nGOTO 9052\nN9051 {}\nN9052",
        "WHILE [#5061 GT 99999] DO1\n{}\nEND1",
        "IF [#5061 GT 99999] THEN {}",
    ),
)
LINES = {
    "fanuc": _MACRO_B,
    "haas": _MACRO_B,
    "mazak": _MACRO_B,
    "mitsubishi": _MACRO_B,
    "siemens": Lines(
        r"MEAS=1 G1 .*F3000",
        r"MEAS=1 G1 .*F180",
        r"WRITE\(RET,.*OUT\)",
        r"M30",
        r"; [^S]",
        "; {}",
        ";",
        r"OBSTRUCTED:",
        (
            "IF $AA_MW[X]<99999 GOTOF ATTACKED\n{}\nATTACKED:",
            "IF R91>99999\n{}\nENDIF",
            "WHILE R91>99999\n{}\nENDWHILE",
            "IF R91>99999 GOTOF AT1\nGOTOF AT2\nAT1: {}\nAT2:",
        ),
    ),
    "heidenhain": Lines(
        r"L X",
        r"TCH PROBE 4\.3",
        r"FN16",
        r"M30",
        r"; [^S]",
        "; {}",
        ";",
        r'LBL "NOTRIGGER"',
        (
            'FN12: IF Q5 LT 99999 GOTO LBL "ATTACKED"\n{}\nLBL "ATTACKED"',
            'FN11: IF Q5 GT 99999 GOTO LBL "AT1"\nFN9: IF +1 EQU +1 GOTO LBL "AT2"\nLBL "AT1"\n{}\nLBL "AT2"',
            'LBL "AT3"\n{}\nFN11: IF Q5 GT 99999 GOTO LBL "AT3"',
            "CALL LBL 77\nFN9: IF +1 EQU +1 GOTO LBL 78\nLBL 77\n{}\nLBL 0\nLBL 78",
        ),
    ),
    "linuxcnc": Lines(
        r"G1 X",
        r"G38\.2",
        r"\(LOG,",
        r"M2",
        r"\((?:point|stepgauge)",
        "({})",
        ";",
        wrapped=(
            "o100 if [#5061 GT 99999]\n{}\no100 endif",
            "o101 while [#5061 GT 99999]\n{}\no101 endwhile",
            "o102 sub\n{}\no102 endsub\no102 call",
        ),
    ),
    "grbl": Lines(r"G38\.3", r"G38\.2", r"\(POINT", r"M2", r"\((?:POINT|STEP)", "({})", ";"),
    "rrf": Lines(
        r"G38\.3",
        r"G38\.2",
        r"echo >>",
        r"M121",
        r"; ",
        "; {}",
        ";",
        r'  abort "path',
        (
            "if {{move.axes[0].userPosition > 99999}}\n  {}",
            "while {{move.axes[0].userPosition > 99999}}\n  {}",
            "if {{result != 0}}\n  {}\nelse\n  M400",
        ),
    ),
    "dmis": Lines(
        r"GOTO/",
        r"PTMEAS/",
        r"OUTPUT/",
        r"ENDFIL",
        r"\$\$ ",
        "$$ {}",
        "$$",
        wrapped=("IF/(X .GT. 99999)\n{}\nENDIF", "DO/I,1,0\n{}\nENDDO", "JUMPTO/(AT)\n{}\n(AT)"),
    ),
    "ippdme": Lines(r"\d+ GoTo", r"\d+ PtMeas", r"\d+ PtMeas", r"\d+ EndSession", line="99990 {}\n\\\\"),
    "jinyoung": Lines(r"MV ", r"MS ", r"PO ", r"END;", block_end=";"),
}
_NUMBER = re.compile(r"(?<![\w.#\[])[-+]?\d+\.\d+(?![\w.])|(?<=[XYZFxyz])[-+]?\d+\.\d+(?![\w.])")


def _value(text: str) -> float | None:
    """A number as every control reads it, in brackets too; None where it is none."""
    try:
        return float(text.removeprefix("[").removesuffix("]"))
    except ValueError:
        return None


class Text:
    """A program text with the numbers of its lines of each kind."""

    def __init__(self, text: str, dialect: str) -> None:
        self.dialect, self.kinds = dialect, LINES[dialect]
        self.lines = text.splitlines()
        self.travels, self.measures, self.results, self.remarks, self.alarms = (
            [n for n, line in enumerate(self.lines) if re.match(pattern, line)]
            for pattern in (
                self.kinds.travel,
                self.kinds.measure,
                self.kinds.result,
                self.kinds.remark,
                self.kinds.alarm,
            )
        )
        self.first_move = self.travels[0]
        self.end = next(n for n, line in enumerate(self.lines) if re.match(self.kinds.end, line))

    def put(self, at: int, replaced: int, form: str, construct: str) -> tuple[str, int, int]:
        """The text with lines ``at`` to ``at + replaced`` replaced by a form that has the construct for ``{}``."""
        before = "".join(f"{line}\n" for line in self.lines[:at])
        head, tail = form.replace("{{", "\x01").replace("}}", "\x02").split("{}")
        head, tail = (part.replace("\x01", "{").replace("\x02", "}") for part in (head, tail))
        start = len(before) + len(head)
        rest = "".join(f"{line}\n" for line in self.lines[at + replaced :])
        return f"{before}{head}{construct}{tail}\n{rest}", start, start + len(construct)

    def with_line(self, at: int, construct: str) -> tuple[str, int, int]:
        """The construct as a line of its own before line ``at``."""
        return self.put(at, 0, self.kinds.line, construct)


def insertions(known: Text, construct: Construct, pick: random.Random) -> Iterator[Insertion]:
    """A construct at every kind of place of a text, one line of each kind drawn."""
    if construct.kind == "number":
        yield from _in_numbers(known, construct, pick)
    elif construct.kind == "block":
        yield from _as_lines(known, construct.text, pick)
        if "\n" not in construct.text:
            yield from _in_lines(known, construct.text, pick)


def _as_lines(known: Text, text: str, pick: random.Random) -> Iterator[Insertion]:
    inner = [n for n in known.travels if n > known.first_move]
    places: dict[str, Callable[[], int]] = {
        "in the first line": lambda: 0,
        "in the header": lambda: pick.randint(0, known.first_move),
        "at the end of the header": lambda: known.first_move,
        "before a move": lambda: pick.choice(inner),
        "after a move": lambda: pick.choice(inner) + 1,
        "before a measurement": lambda: pick.choice(known.measures),
        "after a measurement": lambda: pick.choice(known.measures) + 1,
        "after a result": lambda: pick.choice(known.results) + 1,
        "before the end": lambda: known.end,
        "behind the end": lambda: known.end + 1,
        "in the last line": lambda: len(known.lines),
    }
    for place, at in places.items():
        yield place, *known.with_line(at(), text)
    if known.alarms:
        yield "in an alarm", *known.put(pick.choice(known.alarms) + 1, 0, known.kinds.line, text)
    for number, form in enumerate(known.kinds.wrapped, 1):
        indented = text.replace("\n", "\n  ") if form.endswith("  {}") else text
        yield f"in branch or loop {number}", *known.put(pick.choice(known.results) + 1, 0, form, indented)


def _in_lines(known: Text, text: str, pick: random.Random) -> Iterator[Insertion]:
    def braced(line: str) -> str:
        return line.replace("{", "{{").replace("}", "}}")

    for kind, numbers in (("move", known.travels[1:]), ("measurement", known.measures)):
        at = pick.choice(numbers)
        line = braced(known.lines[at])
        yield f"behind a {kind}, in its block", *known.put(at, 1, f"{line} {{}}", text)
        yield f"before a {kind}, in its block", *known.put(at, 1, f"{{}} {line}", text)
        if known.kinds.block_end:
            yield (
                f"behind the end of the block of a {kind}",
                *known.put(at, 1, f"{line} {known.kinds.block_end} {{}}", text),
            )
    if known.remarks:
        at = pick.choice(known.remarks)
        line = braced(known.lines[at])
        form = f"{line[:-1]} {{}})" if line.endswith(")") else f"{line} {{}}"
        yield "in a remark", *known.put(at, 1, form, text)
    if known.kinds.own_remark:
        yield "as a remark", *known.put(pick.choice(known.travels), 0, known.kinds.own_remark, text)


def _in_numbers(known: Text, construct: Construct, pick: random.Random) -> Iterator[Insertion]:
    for kind, numbers in (("move", known.travels), ("measurement", known.measures)):
        at = pick.choice(numbers)
        line = known.lines[at]
        found = list(_NUMBER.finditer(line))
        for place in pick.sample(found, min(3, len(found))):
            text = construct.in_place_of(place[0])
            if _value(text) == float(place[0]):
                continue  # the same number in other signs
            form = [part.replace("{", "{{").replace("}", "}}") for part in (line[: place.start()], line[place.end() :])]
            yield f"number of a {kind}", *known.put(at, 1, "{}".join(form), text)

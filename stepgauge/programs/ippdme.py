"""I++ DME command files as a virtual server: GoTo and PtMeas with named fields, one tagged command each.

PtMeas names the nominal surface point and the outward normal IJK; the server knows the tool's radius, goes to the
stand-off, searches and retracts by itself.
"""

from __future__ import annotations

import re
from typing import ClassVar

from stepgauge.files.controls import fixed
from stepgauge.programs.blocks import Block
from stepgauge.programs.dialect import AUTOMATIC, Dialect
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.grammar import ENDS, FIRST, LAST, QUIET, SLOTS, START, DialectGrammar, Production, Slot
from stepgauge.programs.reading import Reader

SPEC = "I++ DME 1.4.3"
FILES = "NIST's test suite of I++ DME"
PROPERTIES = {
    "PtMeasPar.Speed": "measuring_speed_mm_s",
    "PtMeasPar.Approach": "standoff_mm",
    "PtMeasPar.Search": "search_mm",
    "PtMeasPar.Retract": "retract_mm",
    "GoToPar.Speed": "travel_speed_mm_s",
}
_N = SLOTS["number"].pattern
_FIELD = rf"(?:[XYZ]\({_N}\)|IJK\({_N}, *{_N}, *{_N}\))"
_NAMED = re.compile(r"([A-Z]+)\(([^()]*)\)", re.ASCII)

TABLE = DialectGrammar(
    "ippdme",
    forms=(
        Production("command", "{tag} StartSession()", "begin", SPEC, when=FIRST),
        Production("command", "{tag} ClearAllErrors()", "clears errors", SPEC, when=START),
        Production("command", "{tag} Home()", "goes to the reference points", SPEC, when=START),
        Production("command", "{tag} IsHomed()", "asks for it", SPEC, QUIET),
        Production("coordinates", "{tag} SetCoordSystem(MachineCsy)", "coordinates of the machine", SPEC, when=START),
        Production("tool", '{tag} SetTool("{tool}")', "names the tool", SPEC, when=START),
        Production("set_property", "{tag} SetProp(Tool.{property}({positive}))", "distances, mm; speeds, mm/s", SPEC),
        Production("command", "{tag} GetProp(Tool.{property}())", "asks for one", SPEC, QUIET),
        Production("report", "{tag} OnPtMeasReport({report})", "what a measurement answers", SPEC, when=START),
        Production("go_to", "{tag} GoTo({fields})", "move", SPEC),
        Production("measure", "{tag} PtMeas({fields})", "measures a point", f"{SPEC}, 6.3.2.13"),
        Production("end_session", "{tag} EndSession()", "end", SPEC, ENDS),
        Production("nothing", "{between}", "between two commands", FILES, QUIET),
        Production("end_file", ":", "end of the file", FILES, QUIET, LAST),
    ),
    slots={
        "tag": Slot(r"(?!00000)\d{5}", "00001 to 99999"),
        "tool": Slot(r"[A-Za-z0-9_-]{1,32}", "letters, digits, _ and -"),
        "property": Slot(
            r"(?:PtMeasPar\.(?:Speed|Approach|Search|Retract)|GoToPar\.Speed)",
            "PtMeasPar.Speed, .Approach, .Search, .Retract, GoToPar.Speed",
        ),
        "report": Slot(r"[A-Z]{1,3}\(\)(?:, *[A-Z]{1,3}\(\)){2,5}", "X(), Y(), Z(), and IJK(), ER(), Q(), each once"),
        "fields": Slot(rf"{_FIELD}(?:, *{_FIELD})*", "X(..), Y(..), Z(..), of PtMeas also IJK(.., .., ..), each once"),
        "between": Slot(r"\\{1,80}", "backslashes"),
    },
    any_case=False,
    last="end_file",
)


def recognises(text: str) -> bool:
    """Whether a tagged StartSession opens the text."""
    return re.match(r"\s*\d{5} StartSession\(\)", text) is not None


class Ippdme(VirtualController):
    """The server between commands."""

    table: ClassVar[DialectGrammar] = TABLE

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.data = ""

    def step(self) -> None:
        """A command, and what the server answers."""
        block = self.blocks[self.at]
        self.data = ""
        super().step()
        if block.form.name not in ("nothing", "end_file"):
            tag = block.fields[0]
            data = [f"{tag} # {self.data}"] if self.data else []
            self.reader.log += [block.text, f"{tag} &", *data, f"{tag} %"]

    def command(self, block: Block) -> None:
        """What moves nothing that the plan knows."""

    end_session = command
    end_file = command

    def coordinates(self, block: Block) -> None:
        """Coordinates are those of the machine."""
        self.reader.states["coordinates"] = "MachineCsy"

    def tool(self, block: Block) -> None:
        """The tool by its name."""
        self.reader.once("tool", block.fields[1])
        self.reader.states["tool"] = block.fields[1]

    def set_property(self, block: Block) -> None:
        """Distances and speeds."""
        name = PROPERTIES.get(block.fields[1])
        if name is not None:
            self.reader.set(**{name: float(block.fields[2])})

    def report(self, block: Block) -> None:
        """At least the coordinates."""
        self._fields(block, {"X", "Y", "Z"}, {"IJK", "ER", "Q"})

    def _fields(self, block: Block, wanted: set[str], more: set[str] | None = None) -> dict[str, str]:
        """Fields by name, each once."""
        fields: dict[str, str] = {}
        for name, value in _NAMED.findall(block.fields[1]):
            if name in fields:
                self.reader.fail("a field twice in a command", found=f"{name}({value})", expected=f"{name} once")
            fields[name] = value
        if not wanted <= set(fields) <= wanted | (more or set()):
            expected = " ".join(sorted(wanted, reverse=True))
            self.reader.fail("fields not understood", found=block.fields[1], expected=expected)
        return fields

    def go_to(self, block: Block) -> None:
        """A move of the tip centre."""
        fields = self._fields(block, {"X", "Y", "Z"})
        self.reader.goto([float(fields[axis]) for axis in "XYZ"])

    def measure(self, block: Block) -> None:
        """A surface point: the radius outwards is the tip centre."""
        fields = self._fields(block, {"X", "Y", "Z", "IJK"})
        normal = self.reader.direction([float(value) for value in fields["IJK"].split(",")], "IJK")
        radius = self.reader.settings.tip_radius_mm
        tip = [float(fields[axis]) + radius * n for axis, n in zip("XYZ", normal, strict=True)]
        contact = self.reader.touch(tip, [-n for n in normal])
        if not contact.hit:
            self.reader.alarm("Error(3, 1006, PtMeas, Surface not found)")
        self.data = ", ".join(f"{axis}({fixed(v, 7)})" for axis, v in zip("XYZ", contact.position, strict=True))


DIALECTS = (
    Dialect(
        "ippdme",
        "I++ DME 1.4 command file",
        ".ipp",
        Ippdme,
        recognises,
        6,
        AUTOMATIC,
        "\r\n",
        states={"coordinates": "MachineCsy"},
        tool="StepGaugeProbe",
        self_positioning=True,
    ),
)

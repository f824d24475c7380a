"""Reader of I++ DME command files: GoTo and PtMeas with named fields, one tagged command each.

PtMeas names the nominal surface point and the outward normal IJK; the server knows the tool's radius, goes to the
stand-off, searches and retracts by itself.
"""

from __future__ import annotations

import re

from stepgauge.files.templating import fixed
from stepgauge.programs.reading import Reader

_COMMAND = re.compile(r"(\d{5}) (\w+)\((.*)\)", re.ASCII)
_FIELD = re.compile(r"([A-Z]{1,9})\(([^()]*)\)\s*(?:,|$)")
_PROPERTY = re.compile(r"Tool\.(PtMeasPar|GoToPar)\.(Speed|Accel|Approach|Search|Retract)\(([^()]*)\)")
_PROPERTIES = {
    "PtMeasPar.Speed": "measuring_speed_mm_s",
    "PtMeasPar.Approach": "standoff_mm",
    "PtMeasPar.Search": "search_mm",
    "PtMeasPar.Retract": "retract_mm",
    "GoToPar.Speed": "travel_speed_mm_s",
}
_BEFORE_MOVES = {"StartSession", "ClearAllErrors", "Home", "SetTool", "ChangeTool", "OnPtMeasReport", "SetCoordSystem"}
"""These move the machine, or change what a position means: once the program moves, they make it another one."""
_NO_MOVE = {"IsHomed", "GetProp"}


def recognises(text: str) -> bool:
    """Whether a tagged StartSession opens the text."""
    return re.match(r"\s*\d{5} StartSession\(\)", text) is not None


class _Interpreter:
    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.session_ended = self.file_ended = False
        self.data = ""

    def line(self, text: str) -> None:
        """Take one line."""
        if self.file_ended and text != ":":
            self.reader.fail("text after the end of the file", found=repr(text))
        if text == ":":
            self.file_ended = True
        elif set(text) != {"\\"}:
            self._command(text)

    def _command(self, text: str) -> None:
        match = _COMMAND.fullmatch(text)
        if match is None or match[1] == "00000":
            self.reader.fail("not a tagged command", found=repr(text), expected="e.g. 00010 StartSession()")
        if self.session_ended:
            self.reader.fail("command after EndSession()", found=repr(text))
        name, arguments = match[2], match[3]
        self.session_ended = name == "EndSession"
        self.data = ""
        if name in _BEFORE_MOVES and self.reader.moved:
            self.reader.fail("this command belongs before the first move", found=repr(text))
        action = {
            "GoTo": self._go_to,
            "PtMeas": self._pt_meas,
            "SetProp": self._set_prop,
            "SetTool": self._tool,
            "ChangeTool": self._tool,
            "SetCoordSystem": self._coordinates,
        }.get(name)
        if action is not None:
            action(arguments)
        elif name not in _BEFORE_MOVES | _NO_MOVE and not self.session_ended:
            self.reader.fail("command not understood", found=repr(text))
        self.reader.log += [
            text,
            f"{match[1]} &",
            *([f"{match[1]} # {self.data}"] if self.data else []),
            f"{match[1]} %",
        ]

    def _tool(self, arguments: str) -> None:
        name = arguments.strip().strip('"')
        if not name:
            self.reader.fail("the tool has no name", expected='SetTool("name")')
        self.reader.states["tool"] = name

    def _coordinates(self, arguments: str) -> None:
        if arguments.strip() != "MachineCsy":
            self.reader.fail(
                "only coordinates of the machine are read",
                found=f"SetCoordSystem({arguments})",
                expected="SetCoordSystem(MachineCsy)",
            )
        self.reader.states["coordinates"] = "MachineCsy"

    def _fields(self, arguments: str, expected: set[str]) -> dict[str, str]:
        fields = {match[1]: match[2] for match in _FIELD.finditer(arguments)}
        if set(fields) != expected or _FIELD.sub("", arguments).strip():
            self.reader.fail(
                "fields not understood", found=arguments, expected=" ".join(sorted(expected, reverse=True))
            )
        return fields

    def _position(self, fields: dict[str, str]) -> list[float]:
        return [self.reader.number(fields[axis], axis) for axis in "XYZ"]

    def _go_to(self, arguments: str) -> None:
        self.reader.goto(self._position(self._fields(arguments, {"X", "Y", "Z"})))

    def _pt_meas(self, arguments: str) -> None:
        fields = self._fields(arguments, {"X", "Y", "Z", "IJK"})
        normal = self.reader.direction(
            self.reader.numbers([part.strip() for part in fields["IJK"].split(",")], 3, "IJK"), "IJK"
        )
        radius = self.reader.settings.tip_radius_mm
        tip = [surface + radius * n for surface, n in zip(self._position(fields), normal, strict=True)]
        contact = self.reader.touch(tip, [-n for n in normal])
        if not contact.hit:
            self.reader.alarm("Error(3, 1006, PtMeas, Surface not found)")
        self.data = ", ".join(f"{axis}({fixed(v, 7)})" for axis, v in zip("XYZ", contact.position, strict=True))

    def _set_prop(self, arguments: str) -> None:
        match = _PROPERTY.fullmatch(arguments)
        if match is None:
            self.reader.fail("property not understood", found=arguments, expected="e.g. Tool.PtMeasPar.Speed(3)")
        name = _PROPERTIES.get(f"{match[1]}.{match[2]}")
        value = self.reader.number(match[3], arguments.split("(")[0])
        if name is not None:
            self.reader.set(**{name: value})


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    interpreter = _Interpreter(reader)
    for reader.line, raw in enumerate(text.splitlines(), 1):
        if raw.strip():
            interpreter.line(raw.strip())
    if not (interpreter.session_ended and interpreter.file_ended):
        reader.cut_short("EndSession() and a last line ':'")

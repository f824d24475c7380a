"""Reader of DMIS: GOTO and PTMEAS between MEAS and ENDMES, in millimetres, without probe compensation.

PTMEAS names the nominal surface point and the outward normal; the controller goes to the stand-off and back by itself.
A sensor is calibrated by the operator (MODE/MAN, CALIB to ENDMES): nothing moves that is in the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from stepgauge.files.templating import fixed
from stepgauge.programs.reading import Reader

_STATEMENT = re.compile(r"(?:([A-Z]+)\(([\w-]+)\)\s*=\s*)?([A-Z]+)(?:\s*/\s*(.*))?", re.ASCII)
ENCODED = "*"
"""Behind the key of a text ``key: value``: both are percent-encoded, for DMIS holds ASCII only."""
_NO_MOVE = {"DMISMN", "TEXT", "DISPLY"}
_OUTPUT_HEAD = ("UNITS", "PRCOMP")
"""Statements that say in the output what its points are."""
_SPEED_UNITS = {"MPM": 1000.0 / 60.0, "MMPS": 1.0}


def recognises(text: str) -> bool:
    """Whether DMISMN, after comments, opens the text."""
    return re.match(r"(?i)(\s*\$\$[^\n]*\n)*\s*DMISMN\s*/", text) is not None


def statements(text: str, reader: Reader) -> Iterator[str]:
    """Statements with their continuation lines joined; the reader stands at the first line of each."""
    joined, first = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split("$$")[0].rstrip()
        first = first if joined else number
        if line.endswith("$"):
            joined += line[:-1]
            continue
        statement, joined = (joined + line).strip(), ""
        if statement:
            reader.line = first
            yield statement
    if joined:
        reader.line = first
        reader.fail("the text is cut short inside a continued line", found=repr(joined))


class _Interpreter:
    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.sensors: dict[str, tuple[float, tuple[float, float, float] | None]] = {}
        self.spheres: set[str] = set()
        self.calibrated: set[str] = set()
        self.calibrating: str | None = None
        self.label = ""
        self.measured: dict[str, list[str]] = {}
        self.devices: dict[str, bool] = {}
        self.feature: str | None = None
        self.ended = False

    def statement(self, statement: str) -> None:
        """Take one statement."""
        match = _STATEMENT.fullmatch(statement)
        if match is None:
            self.reader.fail("statement not understood", found=repr(statement))
        if self.ended:
            self.reader.fail("statement after ENDFIL", found=repr(statement))
        self.label, major = match[2] or "", match[3]
        arguments = [part.strip() for part in (match[4] or "").split(",")]
        self.ended = major == "ENDFIL"
        if major in _OUTPUT_HEAD:
            self.reader.log.append(statement)
        action = getattr(self, f"_{major.lower()}", None)
        if action is not None:
            action(arguments)
        elif major not in _NO_MOVE:
            self.reader.fail("statement not understood", found=repr(statement))

    def _filnam(self, arguments: list[str]) -> None:
        self.reader.log += [f"DMISMN/{arguments[0]},05.2", f"FILNAM/{arguments[0]},05.2"]

    def _units(self, arguments: list[str]) -> None:
        if arguments[0] != "MM":
            self.reader.fail(
                "only millimetres are read", found=f"UNITS/{','.join(arguments)}", expected="UNITS/MM,ANGDEC"
            )
        self.reader.states["units"] = "MM"

    def _prcomp(self, arguments: list[str]) -> None:
        if arguments != ["OFF"]:
            self.reader.fail(
                "tip centres are wanted", found=f"PRCOMP/{','.join(arguments)}", expected="PRCOMP/OFF (no compensation)"
            )
        self.reader.states["tip compensation"] = "OFF"

    def _datset(self, arguments: list[str]) -> None:
        if arguments != ["MCS"]:
            self.reader.fail(
                "only coordinates of the machine are read",
                found=f"DATSET/{','.join(arguments)}",
                expected="DATSET/MCS",
            )
        self.reader.states["coordinates"] = "MCS"

    def _mode(self, arguments: list[str]) -> None:
        if arguments[0] != "PROG" and arguments != ["MAN"]:
            self.reader.fail(
                "the path is not that of the program", found=f"MODE/{','.join(arguments)}", expected="MODE/PROG,MAN"
            )
        self.reader.states["mode"] = arguments[0]

    def _snsdef(self, arguments: list[str]) -> None:
        if self.label in self.sensors:
            self.reader.fail("the sensor is defined twice", found=f"S({self.label})")
        radius = self.reader.number(arguments[-1], "SNSDEF tip diameter") / 2.0
        self.sensors[self.label] = radius, self._stylus(arguments)

    def _stylus(self, arguments: list[str]) -> tuple[float, float, float] | None:
        """The direction of PROBE,FIXED,CART,dx,dy,dz,i,j,k,diameter; None of other sensors."""
        if arguments[:3] != ["PROBE", "FIXED", "CART"] or len(arguments) != 10:
            return None
        i, j, k = self.reader.direction(self.reader.numbers(arguments[6:9], 3, "SNSDEF"), "the stylus of SNSDEF")
        return i, j, k

    def _snslct(self, arguments: list[str]) -> None:
        known = {f"S({name})": name for name in self.sensors} | {f"SA({name})": name for name in self.calibrated}
        if len(arguments) != 1 or arguments[0] not in known:
            self.reader.fail(
                "the sensor that is selected is not defined here, or SA(..) not calibrated",
                found=f"SNSLCT/{','.join(arguments)}",
                expected="one of " + ", ".join(known) if known else "SNSDEF",
            )
        name = known[arguments[0]]
        radius, self.reader.stylus = self.sensors[name]
        self.reader.set(tip_radius_mm=radius)
        self.reader.states["tool"] = name

    def _feat(self, arguments: list[str]) -> None:
        if arguments[0] != "SPHERE":
            return
        if arguments[1:3] != ["OUTER", "CART"] or self.reader.numbers(arguments[3:], 4, "FEAT/SPHERE")[3] <= 0.0:
            self.reader.fail("not a reference sphere", found=",".join(arguments), expected="SPHERE,OUTER,CART,x,y,z,d")
        self.spheres.add(f"F({self.label})")

    def _calib(self, arguments: list[str]) -> None:
        """By hand on a sphere: where the software moved by itself, it would go a way that the plan does not know."""
        kind, sensor, sphere, hits = arguments if len(arguments) == 4 else [""] * 4
        name = self.reader.states.get("tool", "")
        if kind != "SENS" or sensor != f"S({name})" or sphere not in self.spheres or not hits.isdigit():
            expected = "SENS, the selected sensor, a sphere F(..), number of points"
            self.reader.fail("CALIB not understood", found=",".join(arguments), expected=expected)
        if self.reader.states.get("mode") != "MAN" or self.feature is not None:
            self.reader.fail(
                "a calibration that the software drives itself", expected="MODE/MAN first, outside of MEAS"
            )
        self.calibrating = name

    def _snset(self, arguments: list[str]) -> None:
        names = {"APPRCH": "standoff_mm", "SEARCH": "search_mm", "RETRCT": "retract_mm"}
        if len(arguments) != 2 or arguments[0] not in names:
            self.reader.fail("SNSET not understood", found=",".join(arguments), expected="APPRCH, SEARCH or RETRCT, mm")
        value = self.reader.number(arguments[1], f"SNSET/{arguments[0]}")
        self.reader.set(**{names[arguments[0]]: value})

    def _fedrat(self, arguments: list[str]) -> None:
        names = {"MESVEL": "measuring_speed_mm_s", "POSVEL": "travel_speed_mm_s"}
        if len(arguments) != 3 or arguments[0] not in names or arguments[1] not in _SPEED_UNITS:
            self.reader.fail(
                "FEDRAT not understood", found=",".join(arguments), expected="MESVEL or POSVEL, MPM or MMPS, speed"
            )
        speed = self.reader.number(arguments[2], f"FEDRAT/{arguments[0]}") * _SPEED_UNITS[arguments[1]]
        self.reader.set(**{names[arguments[0]]: speed})

    def _meas(self, arguments: list[str]) -> None:
        if arguments[0] != "POINT" or len(arguments) != 3:
            self.reader.fail(
                "only points are measured", found=f"MEAS/{','.join(arguments)}", expected="MEAS/POINT,F(..),1"
            )
        if self.feature is not None or self.calibrating is not None:
            self.reader.fail("MEAS inside a MEAS or CALIB block", expected="ENDMES first")
        self.feature = arguments[1].removeprefix("F(").removesuffix(")")

    def _endmes(self, _: list[str]) -> None:
        if self.feature is None and self.calibrating is None:
            self.reader.fail("ENDMES without MEAS")
        if self.calibrating is not None:
            self.calibrated.add(self.calibrating)
        self.feature = self.calibrating = None

    def _goto(self, arguments: list[str]) -> None:
        self._check_move()
        self.reader.goto(self.reader.numbers([a for a in arguments if a != "CART"], 3, "GOTO"))

    def _ptmeas(self, arguments: list[str]) -> None:
        self._check_move()
        if self.feature is None:
            self.reader.fail("PTMEAS outside of MEAS and ENDMES")
        values = self.reader.numbers([a for a in arguments if a != "CART"], 6, "PTMEAS")
        normal = self.reader.direction(values[3:], "the normal")
        radius = self.reader.settings.tip_radius_mm
        tip = [surface + radius * n for surface, n in zip(values[:3], normal, strict=True)]
        contact = self.reader.touch(tip, [-n for n in normal], name=self.feature)
        if not contact.hit:
            self.reader.alarm(f"no contact in the search of {self.feature}")
        centre = ",".join(fixed(value, 7) for value in contact.position)
        ijk = ",".join(fixed(value, 10) for value in normal)
        self.measured[self.feature] = [f"FA({self.feature})=FEAT/POINT,CART,{centre},$", ijk]

    def _device(self, arguments: list[str]) -> None:
        self.devices[f"DID({self.label})"] = False

    def _open(self, arguments: list[str]) -> None:
        self._use(arguments[0], False)

    def _close(self, arguments: list[str]) -> None:
        self._use(arguments[0], True)

    def _use(self, device: str, opened: bool) -> None:
        if self.devices.get(device) is not opened:
            state = {None: "not defined", True: "open already", False: "not open"}[self.devices.get(device)]
            self.reader.fail("the device of the results cannot be used", found=f"{device} is {state}")
        self.devices[device] = not opened

    def _output(self, arguments: list[str]) -> None:
        name = arguments[0].removeprefix("FA(").removesuffix(")")
        if name not in self.measured:
            self.reader.fail("a feature that was not measured", found=f"OUTPUT/{arguments[0]}")
        if self.devices and not any(self.devices.values()):
            self.reader.fail("output before a device is open", expected="OPEN/DID(..),FDATA,DMIS,OUTPUT first")
        self.reader.log += self.measured[name]

    def _endfil(self, _: list[str]) -> None:
        self.reader.log.append("ENDFIL")

    def _check_move(self) -> None:
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="UNITS/MM,ANGDEC first")
        if self.reader.states.get("mode") == "MAN" or self.calibrating is not None:
            self.reader.fail("a move that the operator makes by hand", expected="ENDMES and MODE/PROG,MAN first")


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    interpreter = _Interpreter(reader)
    for statement in statements(text, reader):
        interpreter.statement(statement.upper())
    inside = interpreter.feature is not None or interpreter.calibrating is not None
    if not interpreter.ended or inside:
        reader.cut_short("ENDMES and ENDFIL" if inside else "ENDFIL")

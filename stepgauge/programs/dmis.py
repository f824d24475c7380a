"""DMIS as a virtual controller: GOTO and PTMEAS between MEAS and ENDMES, in millimetres, without probe compensation.

PTMEAS names the nominal surface point and the outward normal; the controller goes to the stand-off and back by itself.
A sensor is calibrated by the operator (MODE/MAN, CALIB to ENDMES): nothing moves that is in the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import ClassVar

from stepgauge.files.controls import fixed
from stepgauge.programs.blocks import Block, joined_lines
from stepgauge.programs.dialect import AUTOMATIC, Dialect
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.gcode import end_of_line
from stepgauge.programs.grammar import (
    END,
    ENDS,
    FIRST,
    LAST,
    NOT_CONFIRMED,
    QUIET,
    START,
    DialectGrammar,
    Production,
    Slot,
)
from stepgauge.programs.options import Name, NumberOption, Option
from stepgauge.programs.reading import Reader

ENCODED = "*"
"""Behind the key of a text ``key: value``: both are percent-encoded, for DMIS holds ASCII only."""
NIST = "NIST, IMTS_M_clean.dmi"
SPEED_UNITS = {"MPM": 1000.0 / 60.0, "MMPS": 1.0}
SAME_MM = 1e-5
"""A feature and its measurement are printed from the same numbers."""
DEVICE_NAME, FILE_NAME = r"[A-Za-z][A-Za-z0-9_-]{0,15}", r"[A-Za-z0-9_-]{1,40}(?:\.(?i:DMO|TXT|LOG|OUT))?"
_XYZ, _IJK = "{number},{number},{number}", "{number},{number},{number}"

TABLE = DialectGrammar(
    "dmis",
    forms=(
        Production("header", "DMISMN/'{text}',{version}", "begin of the program", NIST, when=FIRST),
        Production("nothing", "FILNAM/'{text}',{version}", "name of the output", NIST, when=START),
        Production(
            "nothing", "TEXT/OPER,'{text}'", "message to the operator", "PTC's help on operator instructions", QUIET
        ),
        Production("nothing", "TEXT/OUTFIL,'{text}'", "text into the output", NIST, QUIET),
        Production("units", "UNITS/MM,ANGDEC", "mm and degrees", NIST, when=START),
        Production("device", "DID({device})=DEVICE/STOR,'{file}'", "file of the results", NIST, when=START),
        Production("open", "OPEN/DID({device}),FDATA,DMIS,OUTPUT", "opens it", NIST, when=START),
        Production("close", "CLOSE/DID({device})", "closes it", NIST, when=END),
        Production("machine", "D({name})=DATSET/MCS", "coordinates of the machine", NIST, when=START),
        Production(
            "sensor",
            f"S({{name}})=SNSDEF/PROBE,FIXED,CART,{_XYZ},{_IJK},{{positive}}",
            "offset, stylus, tip",
            NIST,
            when=START,
        ),
        Production("select", "SNSLCT/S({name})", "selects a sensor", NIST, when=START),
        Production("select_calibrated", "SNSLCT/SA({name})", "selects it as calibrated", NOT_CONFIRMED, when=START),
        Production("distance", "SNSET/{distance},{positive}", "stand-off, search, retract, mm", NIST),
        Production("speed", "FEDRAT/{speed},{unit},{positive}", "speed between points, of the search", NIST),
        Production("uncompensated", "PRCOMP/OFF", "no compensation of the tip", NIST, when=START),
        Production("mode", "MODE/{mode}", "who moves the machine", NIST, when=START),
        Production("feature", f"F({{name}})=FEAT/POINT,CART,{_XYZ},{_IJK}", "nominal point and normal", NIST, QUIET),
        Production("sphere", f"F({{name}})=FEAT/SPHERE,OUTER,CART,{_XYZ},{{positive}}", "sphere", NOT_CONFIRMED, QUIET),
        Production(
            "calibrate", "CALIB/SENS,S({name}),F({name}),{count}", "by hand, to ENDMES", NOT_CONFIRMED, when=START
        ),
        Production("meas", "MEAS/POINT,F({name}),1", "measurement of a point, to ENDMES", NIST),
        Production("go", f"GOTO/{_XYZ}", "move", NIST),
        Production("go", f"GOTO/CART,{_XYZ}", "move", NIST),
        Production("probe", f"PTMEAS/CART,{_XYZ},{_IJK}", "measures a point", NIST),
        Production("probe", f"PTMEAS/{_XYZ},{_IJK}", "measures a point", NIST),
        Production("end_measurement", "ENDMES", "end of MEAS or CALIB", NIST),
        Production("output", "OUTPUT/FA({name})", "writes what was measured", NIST),
        Production("end_file", "ENDFIL", "end of the program", NIST, ENDS, LAST),
    ),
    comments=(end_of_line("$$", NIST, "()?!<>"),),
    slots={
        "text": Slot(r"[ A-Za-z0-9.,;:?!_/*%+=()-]*", "letters, digits and . , ; : ? ! _ / * % + = ( ) -"),
        "version": Slot(r"\d{1,2}\.\d", "05.2"),
        "name": Slot(r"[A-Za-z0-9_-]{1,32}", "letters, digits, _ and -"),
        "device": Slot(DEVICE_NAME, "a letter, then letters, digits, _ and -"),
        "file": Slot(
            FILE_NAME,
            "the file of the results, one in a program, without a folder: .DMO, .TXT, .LOG, .OUT or no ending",
        ),
        "distance": Slot("APPRCH|SEARCH|RETRCT", "APPRCH, SEARCH or RETRCT"),
        "speed": Slot("MESVEL|POSVEL", "MESVEL or POSVEL"),
        "unit": Slot("MPM|MMPS", "MPM (m/min) or MMPS (mm/s)"),
        "mode": Slot("PROG,MAN|MAN", "PROG,MAN or MAN (by hand, for CALIB)"),
    },
    blanks_ignored=True,
    quote="'",
    last="end_file",
    continued="$",
)


def recognises(text: str) -> bool:
    """Whether DMISMN, after comments, opens the text."""
    return re.match(r"(?i)(\s*\$\$[^\n]*\n)*\s*DMISMN\s*/", text) is not None


def statements(text: str, reader: Reader) -> Iterator[str]:
    """Statements of any DMIS text without comments; the reader stands at the first line of each."""
    for line, raw in joined_lines(text, "$", "$$", reader):
        reader.line = line
        statement = raw.split("$$")[0].strip()
        if statement:
            yield statement


class Dmis(VirtualController):
    """The software between statements."""

    table: ClassVar[DialectGrammar] = TABLE

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.sensors: dict[str, tuple[float, tuple[float, float, float], str]] = {}
        self.spheres: set[str] = set()
        self.calibrated: set[str] = set()
        self.calibrating = self.measuring = self.tool = ""
        self.touched = False
        self.features: dict[str, list[float]] = {}
        self.measured: dict[str, list[str]] = {}
        self.devices: dict[str, bool] = {}

    def header(self, block: Block) -> None:
        """The output begins with the same two statements."""
        title = block.fields[0].upper()
        self.reader.log += [f"DMISMN/'{title}',05.2", f"FILNAM/'{title}',05.2"]

    def units(self, block: Block) -> None:
        """Millimetres."""
        self.reader.log.append(block.text.upper())
        self.reader.states["units"] = "MM"

    def uncompensated(self, block: Block) -> None:
        """Points are tip centres."""
        self.reader.log.append(block.text.upper())
        self.reader.states["tip compensation"] = "OFF"

    def machine(self, block: Block) -> None:
        """Coordinates are those of the machine."""
        self.reader.states["coordinates"] = "MCS"

    def mode(self, block: Block) -> None:
        """Who moves."""
        self.reader.states["mode"] = block.fields[0].upper().split(",")[0]

    def sensor(self, block: Block) -> None:
        """Offset to the tip, direction of the stylus, diameter of the tip."""
        name, values = block.fields[0].upper(), [float(value) for value in block.fields[1:]]
        if name in self.sensors:
            self.reader.fail("the sensor is defined twice", found=f"S({name})")
        i, j, k = self.reader.direction(values[3:6], "the stylus of SNSDEF")
        self.sensors[name] = values[6] / 2.0, (i, j, k), ",".join(f"{value:g}" for value in values[:3])

    def select(self, block: Block) -> None:
        """The sensor that measures from here on."""
        self._select(block, set(self.sensors), "S")

    def select_calibrated(self, block: Block) -> None:
        """The sensor, after its calibration here."""
        self._select(block, self.calibrated, "SA")

    def _select(self, block: Block, known: set[str], kind: str) -> None:
        name = block.fields[0].upper()
        if name not in known:
            expected = "one of " + ", ".join(f"{kind}({one})" for one in sorted(known)) if known else "SNSDEF, or CALIB"
            what = "the sensor that is selected is not defined here, or SA(..) not calibrated"
            self.reader.fail(what, found=block.text, expected=expected)
        self.reader.once("tool", name)
        radius, self.reader.stylus, self.reader.states["sensor offset"] = self.sensors[name]
        self.reader.set(tip_radius_mm=radius)
        self.tool = self.reader.states["tool"] = name

    def sphere(self, block: Block) -> None:
        """A reference sphere."""
        self.spheres.add(block.fields[0].upper())

    def calibrate(self, block: Block) -> None:
        """By hand on a sphere: where the software moved by itself, it would go a way that the plan does not know."""
        sensor, sphere, _ = (one.upper() for one in block.fields)
        if sensor != self.tool or sphere not in self.spheres:
            expected = "the selected sensor and a sphere of the program"
            self.reader.fail("CALIB not understood", found=block.text, expected=expected)
        if self.reader.states.get("mode") != "MAN" or self.measuring:
            expected = "MODE/MAN first, outside of MEAS"
            self.reader.fail("a calibration that the software drives itself", expected=expected)
        self.calibrating = sensor

    def distance(self, block: Block) -> None:
        """Stand-off, search or retract."""
        names = {"APPRCH": "standoff_mm", "SEARCH": "search_mm", "RETRCT": "retract_mm"}
        self.reader.set(**{names[block.fields[0].upper()]: float(block.fields[1])})

    def speed(self, block: Block) -> None:
        """Of the search, or between points."""
        names = {"MESVEL": "measuring_speed_mm_s", "POSVEL": "travel_speed_mm_s"}
        name, unit, value = block.fields
        self.reader.set(**{names[name.upper()]: float(value) * SPEED_UNITS[unit.upper()]})

    def feature(self, block: Block) -> None:
        """A nominal point."""
        self.features[block.fields[0].upper()] = [float(value) for value in block.fields[1:]]

    def meas(self, block: Block) -> None:
        """The measurement of a feature begins."""
        if self.measuring or self.calibrating:
            self.reader.fail("MEAS inside a MEAS or CALIB block", expected="ENDMES first")
        self.measuring, self.touched = block.fields[0].upper(), False
        if self.measuring not in self.features:
            found, expected = block.text, f"F({self.measuring})=FEAT/POINT,CART,.. before"
            self.reader.fail("the feature is not defined", found=found, expected=expected)

    def end_measurement(self, block: Block) -> None:
        """It ends."""
        if not self.measuring and not self.calibrating:
            self.reader.fail("ENDMES without MEAS")
        if self.measuring and not self.touched:
            self.reader.fail("a measurement without PTMEAS, which a software may make by itself", found=block.text)
        self.calibrated |= {self.calibrating} - {""}
        self.measuring = self.calibrating = ""

    def go(self, block: Block) -> None:
        """A move of the tip centre."""
        self._check_move()
        self.reader.goto([float(value) for value in block.fields])

    def probe(self, block: Block) -> None:
        """A surface point: the radius outwards is the tip centre."""
        self._check_move()
        if not self.measuring:
            self.reader.fail("PTMEAS outside of MEAS and ENDMES")
        values = [float(value) for value in block.fields]
        nominal = self.features[self.measuring]
        if any(abs(a - b) > SAME_MM for a, b in zip(values, nominal, strict=True)):
            expected = ",".join(f"{value:g}" for value in nominal)
            self.reader.fail(f"F({self.measuring}) is defined elsewhere", found=block.text, expected=expected)
        normal = self.reader.direction(values[3:], "the normal")
        radius = self.reader.settings.tip_radius_mm
        tip = [surface + radius * n for surface, n in zip(values[:3], normal, strict=True)]
        contact = self.reader.touch(tip, [-n for n in normal], name=self.measuring)
        if not contact.hit:
            self.reader.alarm(f"no contact in the search of {self.measuring}")
        self.touched = True
        centre = ",".join(fixed(value, 7) for value in contact.position)
        ijk = ",".join(fixed(value, 10) for value in normal)
        self.measured[self.measuring] = [f"FA({self.measuring})=FEAT/POINT,CART,{centre},$", ijk]

    def device(self, block: Block) -> None:
        """A file of results."""
        self.reader.once("log", block.fields[1])
        self.devices[block.fields[0].upper()] = False

    def open(self, block: Block) -> None:
        """It takes results from here on."""
        self._use(block.fields[0].upper(), False)

    def close(self, block: Block) -> None:
        """It takes no more."""
        self._use(block.fields[0].upper(), True)

    def _use(self, device: str, opened: bool) -> None:
        if self.devices.get(device) is not opened:
            state = {None: "not defined", True: "open already", False: "not open"}[self.devices.get(device)]
            self.reader.fail("the device of the results cannot be used", found=f"DID({device}) is {state}")
        self.devices[device] = not opened

    def output(self, block: Block) -> None:
        """A measured feature into the output."""
        name = block.fields[0].upper()
        if name not in self.measured:
            self.reader.fail("a feature that was not measured", found=block.text)
        if self.devices and not any(self.devices.values()):
            self.reader.fail("output before a device is open", expected="OPEN/DID(..),FDATA,DMIS,OUTPUT first")
        self.reader.log += self.measured[name]

    def end_file(self, block: Block) -> None:
        """Outside of any measurement."""
        if self.measuring or self.calibrating:
            self.reader.cut_short("ENDMES and ENDFIL")
        self.reader.log.append("ENDFIL")

    def _check_move(self) -> None:
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="UNITS/MM,ANGDEC first")
        if self.reader.states.get("mode") == "MAN" or self.calibrating:
            self.reader.fail("a move that the operator makes by hand", expected="ENDMES and MODE/PROG,MAN first")


DIALECTS = (
    Dialect(
        "dmis",
        "DMIS 5.2 (PC-DMIS, Calypso, ..)",
        ".dmi",
        Dmis,
        recognises,
        6,
        (*AUTOMATIC, "tip_radius_mm"),
        states={
            "units": "MM",
            "coordinates": "MCS",
            "mode": "PROG",
            "tip compensation": "OFF",
            "sensor offset": "0,0,0",
        },
        tool="PROBE",
        comment="$$ {}",
        self_positioning=True,
        options={
            "device": Option("RESULTS", Name(DEVICE_NAME, TABLE.slot("device").what), "label of the file of results"),
            "file": Option(
                "STEPGAUGE.DMO",
                Name(
                    FILE_NAME, "a file name without a folder (.DMO, .TXT, .LOG, .OUT), or nothing", may_be_left_out=True
                ),
                "file of the results; empty: no DID, OPEN, CLOSE",
            ),
            "sphere": Option(
                "",
                NumberOption(1, 100, "mm", may_be_left_out=True),
                "diameter of a reference sphere: the sensor is calibrated first, by hand",
            ),
        },
        once={"log": "{file}"},
    ),
)

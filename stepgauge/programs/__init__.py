"""Program text: rendered from moves by a template, executed by the virtual controller of its dialect.

A dialect is a template and a module here with ``recognises(text) -> bool`` and ``run(text, reader)``, which executes
the text as the controller would: modal state, variables, branches, registers of the probe, lines of the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.files.text import read_text
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.programs.reading import ControllerAlarmError, Probe, Reader

MOST_OPTION = 40
"""Characters of the value of an option; it stands in a block of the text."""


@dataclass(frozen=True)
class Dialect:
    """A programming language of a controller.

    ``decimals``: digits printed after the point of a coordinate; ``carries``: the settings that its text states, and
    that a reader therefore takes from the text; ``newline``: what ends a line; ``states``: what besides must hold at
    every move for the text to mean the planned moves; ``tool``: what the probe is called unless somebody says
    otherwise, empty where the text does not say; ``comment``: the form of a comment, empty where there is none;
    ``self_positioning``: the controller goes to the stand-off and back by itself; ``family``: the dialect that it is a
    variant of; ``options``: what differs from machine to machine, with what is taken unless somebody says otherwise;
    ``log_decimals``: digits of a coordinate in its log, mm (None: its log is not known); ``most_feed_mm_s``:
    fastest search that the control takes, and so the fastest travel; ``beside``: further files that the control needs,
    by name (options put in).
    """

    name: str
    title: str
    suffix: str
    decimals: int
    carries: tuple[str, ...]
    newline: str = "\n"
    states: Mapping[str, str] = field(default_factory=dict)
    tool: str = ""
    comment: str = ""
    self_positioning: bool = False
    family: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    log_decimals: int | None = 7
    most_feed_mm_s: float = math.inf
    beside: Mapping[str, str] = field(default_factory=dict)

    @property
    def template(self) -> str:
        """File name of the template, which dialects of one family share."""
        return f"{self.family or self.name}.j2"

    def with_options(self, said: Mapping[str, str]) -> Dialect:
        """The dialect as a machine needs it; :class:`InputError` for an option that it does not have."""
        for name, value in said.items():
            if name not in self.options:
                known = ", ".join(self.options) or "none"
                raise InputError(naming("set"), f"not an option of {self.name}", found=repr(name), expected=known)
            if len(value) > MOST_OPTION or not value.isprintable() or not value.isascii():
                raise InputError(naming("set"), f"{name} does not fit in a block", found=repr(value))
        return replace(self, options={**self.options, **said})

    def slowed(self, program: Program) -> Program:
        """The program with a travel that this control takes."""
        travel = min(program.settings.travel_speed_mm_s, self.most_feed_mm_s)
        return replace(program, settings=replace(program.settings, travel_speed_mm_s=travel))

    @property
    def required(self) -> dict[str, str]:
        """What must hold at every move, with the options put in."""
        return {name: value.format(**self.options) for name, value in self.states.items()}

    @property
    def files(self) -> dict[str, str]:
        """Further files that the control needs, by name."""
        return {name.format(**self.options): content for name, content in self.beside.items()}

    def _module(self) -> Any:
        return import_module(f"stepgauge.programs.{self.family or self.name}")

    def recognises(self, text: str) -> bool:
        """Whether a text looks like this dialect; a variant is named in the first lines of its programs."""
        named = not self.family or f"CONTROL {self.name.upper()}" in text[:2000]
        return named and bool(self._module().recognises(text))

    def read(self, text: str, path: str | Path, settings: ProbingSettings) -> Program:
        """The moves of a program text; see :func:`read_program`."""
        reader = Reader(str(path), settings, self.self_positioning)
        try:
            self.execute(text, reader)
        except ControllerAlarmError as alarm:
            what = "the program stops itself though every search meets its face"
            raise InputError(f"{path}:{reader.line}", what, found=str(alarm)) from None
        return reader.finish()

    def execute(self, text: str, reader: Reader) -> None:
        """Execute a text as the controller; the reader has its moves and its log."""
        check_lines(text, reader.path)
        run: Callable[[str, Reader], None] = self._module().run
        run(text, reader)

    def log_of(self, text: str, path: str | Path, settings: ProbingSettings, probe: Probe) -> tuple[str, str | None]:
        """What the controller writes while it executes a text with this probe, and the alarm that stopped it."""
        reader, alarm = Reader(str(path), settings, self.self_positioning, probe), None
        try:
            self.execute(text, reader)
        except ControllerAlarmError as stop:
            alarm = str(stop)
        return "".join(line + "\n" for line in reader.log), alarm


def check_lines(text: str, path: str | Path) -> None:
    """:class:`InputError` for a line that is longer than a controller writes or reads one."""
    number, line = max(enumerate(text.split("\n"), 1), key=lambda one: len(one[1]))
    if len(line) > LONGEST_LINE:
        found, expected = f"{len(line)} characters", f"up to {LONGEST_LINE}"
        raise InputError(f"{path}:{number}", "the line is too long for a controller", found=found, expected=expected)


LONGEST_LINE = 4000
_SPEEDS = ("measuring_speed_mm_s", "travel_speed_mm_s")
_SEARCH = ("search_mm", *_SPEEDS)
_AUTOMATIC = ("standoff_mm", "search_mm", "retract_mm", *_SPEEDS)
_MODAL = {"units": "G21", "distances": "G90", "feed": "G94", "tool radius": "G40"}
_FANUC = Dialect(
    "fanuc",
    "Fanuc custom macro B (G31, DPRNT)",
    ".nc",
    4,
    _SEARCH,
    states={**_MODAL, "coordinates": "{offset}", "tool length": "G43"},
    comment="({})",
    options={
        "number": "7000",
        "offset": "G54",
        "probe_on": "",
        "probe_off": "",
        "orient": "M19",
        "length_in_z": "parameter",
        "look_ahead": "G53",
        "digits": "44",
        "open": "POPEN",
    },
    log_decimals=4,
)


def _variant(name: str, title: str, most_feed_mm_s: float = math.inf, **options: str) -> Dialect:
    """A control that reads the macro language of Fanuc, with what differs."""
    known = {**_FANUC.options, **options}
    return replace(_FANUC, name=name, title=title, family="fanuc", options=known, most_feed_mm_s=most_feed_mm_s)


DIALECTS = {
    dialect.name: dialect
    for dialect in (
        Dialect("jinyoung", "Jin Young CNC CMM (Pahk & Kim, Fig 4)", ".jyc", 3, (), log_decimals=None),
        Dialect(
            "dmis",
            "DMIS 5.2",
            ".dmi",
            6,
            (*_AUTOMATIC, "tip_radius_mm"),
            states={"units": "MM", "coordinates": "MCS", "mode": "PROG", "tip compensation": "OFF"},
            tool="PROBE",
            comment="$$ {}",
            self_positioning=True,
            options={"device": "RESULTS", "file": "STEPGAUGE.DMO", "sphere": ""},
        ),
        Dialect(
            "linuxcnc",
            "LinuxCNC 2.9 G-code (G38.2)",
            ".ngc",
            6,
            _SEARCH,
            states={**_MODAL, "coordinates": "G54", "tool length": "G49", "path": "G61"},
            comment="({})",
        ),
        Dialect(
            "ippdme",
            "I++ DME 1.4 command file",
            ".ipp",
            6,
            _AUTOMATIC,
            "\r\n",
            states={"coordinates": "MachineCsy"},
            tool="StepGaugeProbe",
            self_positioning=True,
        ),
        _FANUC,
        _variant(
            "haas", "Haas NGC", 2500.0 / 60.0, probe_on="M59 P1134", probe_off="M69 P1134", length_in_z="yes", open=""
        ),
        _variant("mazak", "Mazak Matrix and Smooth, EIA", length_in_z="yes"),
        _variant("mitsubishi", "Mitsubishi M70 and M80", length_in_z="yes"),
        Dialect(
            "siemens",
            "Siemens SINUMERIK 840D sl, 828D, ONE (MEAS, WRITE)",
            ".mpf",
            4,
            _SEARCH,
            states={
                **_MODAL,
                "units": "G710",
                "coordinates": "{offset}",
                "tool length": "checked",
                "path": "G60",
            },
            comment="; {}",
            options={"offset": "G54", "spindle_deg": "0", "file": "STEPGAUGE_LOG"},
            log_decimals=6,
        ),
        Dialect(
            "heidenhain",
            "HEIDENHAIN klartext, TNC 640 and iTNC 530 (TCH PROBE 4, FN16)",
            ".h",
            4,
            _SEARCH,
            states={"units": "MM"},
            comment="; {}",
            options={
                "folder": "TNC:\\STEPGAUGE\\",
                "mask": "STEPGAUGE.A",
                "file": "STEPGAUGE.TXT",
                "spindle_deg": "+0",
                "length_in_z": "yes",
            },
            beside={"{mask}": '"%s",QS1;\n'},
            log_decimals=4,
        ),
        Dialect(
            "grbl",
            "grbl 1.1, grblHAL, FluidNC (G38.2)",
            ".gcode",
            4,
            _SEARCH,
            states={
                **_MODAL,
                "coordinates": "G59",
                "offset": "G10 L2 P6 X0 Y0 Z0",
                "shift": "G92.1",
                "tool length": "G49",
                "path": "G61",
            },
            comment="({})",
            log_decimals=3,
        ),
        Dialect(
            "rrf",
            "RepRapFirmware 3 (Duet, MillenniumOS)",
            ".g",
            4,
            _SEARCH,
            states={"units": "G21", "distances": "G90", "feed": "G94", "coordinates": "{offset}"},
            comment="; {}",
            options={"offset": "G54", "probe": "0", "file": "0:/sys/stepgauge-log.txt"},
            log_decimals=3,
        ),
    )
}


def recognise(text: str, path: str | Path) -> Dialect:
    """The dialect of a program text; :class:`InputError` where it is none that is known."""
    special_first = sorted(DIALECTS.values(), key=lambda one: (not one.family, one.name == "linuxcnc"))
    for dialect in special_first:  # variants name themselves, and G38.2 alone is in programs of other controls, too
        if dialect.recognises(text):
            return dialect
    raise InputError(
        f"{path}:1",
        "this is not a measuring program in a known dialect",
        found=repr(text.strip().split("\n")[0][:60]),
        expected=", ".join(dialect.title for dialect in DIALECTS.values()),
    )


def read_program(path: str | Path, settings: ProbingSettings, dialect: str | None = None) -> Program:
    """Read a program file back into moves.

    Parameters
    ----------
    path : the program file
    settings : what holds where the text does not say (``Dialect.carries`` lists what it says)
    dialect : name of the dialect; recognised from the text by default

    Raises
    ------
    InputError
        the line of a statement that is not understood, and truncated or foreign programs
    """
    text = read_text(path)
    known = DIALECTS[dialect] if dialect else recognise(text, path)
    return known.read(text, path, settings)

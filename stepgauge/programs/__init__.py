"""Program text: rendered from moves by a template, read back into moves by the reader of its dialect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.text import read_text
from stepgauge.motion.moves import ProbingSettings, Program


@dataclass(frozen=True)
class Dialect:
    """A programming language of a controller.

    ``decimals``: digits printed after the point of a coordinate; ``carries``: the settings that its text states, and
    that a reader therefore takes from the text; ``newline``: what ends a line; ``states``: what besides must hold at
    every move for the text to mean the planned moves; ``tool``: what the probe is called unless somebody says
    otherwise, empty where the text does not say; ``comment``: the form of a comment, empty where there is none.
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

    @property
    def template(self) -> str:
        return f"{self.name}.j2"

    def _reader(self, function: str) -> Callable[..., object]:
        reader: Callable[..., object] = getattr(import_module(f"stepgauge.programs.{self.name}"), function)
        return reader

    def recognises(self, text: str) -> bool:
        """Whether a text looks like this dialect."""
        return bool(self._reader("recognises")(text))

    def read(self, text: str, path: str | Path, settings: ProbingSettings) -> Program:
        """The moves of a program text; see :func:`read_program`."""
        check_lines(text, path)
        program = self._reader("read")(text, str(path), settings)
        assert isinstance(program, Program)
        return program


def check_lines(text: str, path: str | Path) -> None:
    """:class:`InputError` for a line that is longer than a controller writes or reads one."""
    number, line = max(enumerate(text.split("\n"), 1), key=lambda one: len(one[1]))
    if len(line) > LONGEST_LINE:
        found, expected = f"{len(line)} characters", f"up to {LONGEST_LINE}"
        raise InputError(f"{path}:{number}", "the line is too long for a controller", found=found, expected=expected)


LONGEST_LINE = 4000
_SPEEDS = ("measuring_speed_mm_s", "travel_speed_mm_s")
_AUTOMATIC = ("standoff_mm", "search_mm", "retract_mm", *_SPEEDS)
DIALECTS = {
    dialect.name: dialect
    for dialect in (
        Dialect("jinyoung", "Jin Young CNC CMM (Pahk & Kim, Fig 4)", ".jyc", 3, ()),
        Dialect(
            "dmis",
            "DMIS 5.2",
            ".dmi",
            6,
            (*_AUTOMATIC, "tip_radius_mm"),
            states={"units": "MM", "coordinates": "MCS", "mode": "PROG", "tip compensation": "OFF"},
            tool="PROBE",
            comment="$$ {}",
        ),
        Dialect(
            "linuxcnc",
            "LinuxCNC 2.9 G-code (G38.2)",
            ".ngc",
            6,
            ("search_mm", *_SPEEDS),
            states={
                "units": "G21",
                "distances": "G90",
                "feed": "G94",
                "coordinates": "G54",
                "tool length": "G49",
                "tool radius": "G40",
                "path": "G61",
            },
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
        ),
    )
}


def recognise(text: str, path: str | Path) -> Dialect:
    """The dialect of a program text; :class:`InputError` where it is none that is known."""
    for dialect in DIALECTS.values():
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

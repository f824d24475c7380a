"""A dialect: how its text looks, which options it has, and the virtual controller that executes it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.grammar import DialectGrammar
from stepgauge.programs.options import Option, chosen
from stepgauge.programs.reading import ControllerAlarmError, Reader, ReadingProbe

_SPEEDS = ("measuring_speed_mm_s", "travel_speed_mm_s")
SEARCH = ("search_mm", *_SPEEDS)
AUTOMATIC = ("standoff_mm", "search_mm", "retract_mm", *_SPEEDS)
MODAL = {"units": "G21", "distances": "G90", "feed": "G94", "tool radius": "G40"}


@dataclass(frozen=True)
class Dialect:
    """A programming language of a controller.

    ``control``: its virtual controller, with the table; ``recognised``: whether a text looks like it; ``decimals``:
    digits printed after the point of a coordinate; ``carries``: the settings that its text states, and that a reader
    therefore takes from the text; ``newline``: what ends a line; ``states``: what besides must hold at every move for
    the text to mean the planned moves; ``tool``: what the probe is called unless somebody says otherwise, empty where
    the text does not say; ``comment``: the form of a comment, empty where there is none; ``self_positioning``: the
    controller goes to the stand-off and back by itself; ``family``: the dialect that it is a variant of; ``options``:
    what differs from machine to machine; ``said``: their values where they are not the default; ``once``: what its
    text says of one thing only, as its log (options put in); ``log_decimals``: digits of a coordinate in its log, mm
    (None: its log is not known); ``most_feed_mm_s``: fastest search that the control takes, and so the fastest travel;
    ``beside``: further files that the control needs, by name (options put in).
    """

    name: str
    title: str
    suffix: str
    control: type[VirtualController]
    recognised: Callable[[str], bool]
    decimals: int
    carries: tuple[str, ...]
    newline: str = "\n"
    states: Mapping[str, str] = field(default_factory=dict)
    tool: str = ""
    comment: str = ""
    self_positioning: bool = False
    family: str = ""
    options: Mapping[str, Option] = field(default_factory=dict)
    said: Mapping[str, str] = field(default_factory=dict)
    once: Mapping[str, str] = field(default_factory=dict)
    log_decimals: int | None = 7
    most_feed_mm_s: float = math.inf
    beside: Mapping[str, str] = field(default_factory=dict)

    @property
    def template(self) -> str:
        """File name of the template, which dialects of one family share."""
        return f"{self.family or self.name}.j2"

    @property
    def table(self) -> DialectGrammar:
        """What its virtual controller understands."""
        return self.control.table

    @property
    def values(self) -> dict[str, str]:
        """The options with their values."""
        return chosen(self.name, self.options, self.said)

    def apply_options(self, said: Mapping[str, str]) -> Dialect:
        """The dialect as a machine needs it; :class:`InputError` for an option that it does not have, or no value."""
        chosen(self.name, self.options, said)
        return replace(self, said={**self.said, **said})

    def slowed(self, program: Program) -> Program:
        """The program with a travel that this control takes."""
        travel = min(program.settings.travel_speed_mm_s, self.most_feed_mm_s)
        return replace(program, settings=replace(program.settings, travel_speed_mm_s=travel))

    @property
    def required(self) -> dict[str, str]:
        """What must hold at every move, with the options put in."""
        values = self.values
        return {name: value.format(**values) for name, value in self.states.items()}

    @property
    def files(self) -> dict[str, str]:
        """Further files that the control needs, by name."""
        return {name.format(**self.values): content for name, content in self.beside.items()}

    def recognises(self, text: str) -> bool:
        """Whether a text looks like this dialect; a variant is named in the first lines of its programs."""
        named = not self.family or f"CONTROL {self.name.upper()}" in text[:2000]
        return named and self.recognised(text)

    def read(self, text: str, path: str | Path, settings: ProbingSettings, own: bool = False) -> Program:
        """The moves of a program text; see :func:`stepgauge.programs.read_program`.

        ``own``: the options are those that the text was made with.
        """
        reader = Reader(str(path), settings, self.self_positioning)
        if own:
            reader.fixed = {what: value.format(**self.values) for what, value in self.once.items()}
        try:
            self.execute(text, reader)
        except ControllerAlarmError as alarm:
            what = "the program stops itself though every search meets its face"
            raise InputError(f"{path}:{reader.line}", what, found=str(alarm)) from None
        return reader.finish()

    def execute(self, text: str, reader: Reader) -> None:
        """Execute a text as the controller; the reader has its moves and its log."""
        self.control(reader).run(text)

    def log_of(
        self, text: str, path: str | Path, settings: ProbingSettings, probe: ReadingProbe
    ) -> tuple[str, str | None]:
        """What the controller writes while it executes a text with this probe, and the alarm that stopped it."""
        reader, alarm = Reader(str(path), settings, self.self_positioning, probe), None
        try:
            self.execute(text, reader)
        except ControllerAlarmError as stop:
            alarm = str(stop)
        return "".join(line + "\n" for line in reader.log), alarm

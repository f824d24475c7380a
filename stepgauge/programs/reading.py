"""What the readers of all dialects share: a text is executed as its controller would, with a probe that answers.

A text is executed once to know its moves, with every search ending at its nominal contact. After the virtual CMM has
made these moves it is executed again with the readings of that run (:mod:`stepgauge.programs.controller`), so that the
text itself writes the log.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.numerals import number as plain_number
from stepgauge.motion.moves import InForce, ProbingSettings, Program, ProgramBuilder

LONGEST_LINE = 4000


def check_lines(text: str, path: str | Path, longest: int = LONGEST_LINE) -> None:
    """:class:`InputError` for a line that is longer than a controller writes or reads one."""
    number, line = max(enumerate(text.split("\n"), 1), key=lambda one: len(one[1]))
    if len(line) > longest:
        found, expected = f"{len(line)} characters", f"up to {longest}"
        raise InputError(f"{path}:{number}", "the line is too long for a controller", found=found, expected=expected)


class Contact(NamedTuple):
    """Where a move ended, as indicated, whether the probe had triggered, and when (s)."""

    position: Sequence[float]
    hit: bool
    time_s: float = 0.0


class ReadingProbe:
    """The probe of a controller that only reads a text: free on the way, and every search meets its face."""

    def answer(self, move: int, measuring: bool, end: Sequence[float], target: Sequence[float]) -> Contact:
        """What a move ends with: its number, whether it searches, where it ends at the latest, the nominal contact."""
        return Contact(target, True) if measuring else Contact(end, False)


class ControllerAlarmError(Exception):
    """The controller, or the program itself, stopped with an alarm text."""


class MovedOnError(Exception):
    """A text that was to stop goes on to its next move."""


class Reader:
    """Collects the moves and the log of a text, and fails with the line at hand."""

    def __init__(
        self, path: str, settings: ProbingSettings, self_positioning: bool = False, probe: ReadingProbe | None = None
    ) -> None:
        self.path, self.settings = path, settings
        self.probe = probe or ReadingProbe()
        self.log: list[str] = []
        self.states: dict[str, str] = {}
        self.stylus: tuple[float, float, float] | None = None
        self.line = 0
        self.builder = ProgramBuilder(path, settings, self_positioning)
        self._started = False
        self.proves = probe is None
        """Whether the ways that the nominal probe does not take are looked at, too."""
        self.fixed: dict[str, str] = {}
        self.dry = False
        self.closed = False

    def fail(self, what: str, found: object = None, expected: object = None) -> NoReturn:
        """Raise :class:`InputError` for the current line."""
        raise InputError(f"{self.path}:{self.line}", what, found=found, expected=expected)

    def require_number(self, value: float | str) -> float:
        """A value of an expression that must be a number."""
        if isinstance(value, str):
            self.fail("a number is wanted", found=repr(value))
        return value

    def number(self, text: str, what: str) -> float:
        """A finite decimal number."""
        value = plain_number(text.strip())
        if not math.isfinite(value):
            self.fail(f"{what} is not a number", found=repr(text))
        return value

    def numbers(self, texts: Sequence[str], count: int, what: str) -> list[float]:
        """Exactly ``count`` numbers."""
        if len(texts) != count:
            self.fail(f"{what} needs {count} numbers", found=" ".join(texts) or "none")
        return [self.number(text, what) for text in texts]

    def set(self, **settings: float) -> None:
        """Settings that hold from here on."""
        self.settings = replace(self.settings, **settings)

    def once(self, what: str, value: str) -> None:
        """What a program may say of one thing only, and as its options say: its log, its tool, an angle, a state."""
        known = self.fixed.setdefault(what, value)
        if known.upper() != value.upper():
            self.fail(f"another {what} than before, or than planned", found=value, expected=known)

    @property
    def moved(self) -> bool:
        """Whether there was a move yet."""
        return self.builder.last_position is not None

    def goto(self, position: Sequence[float], as_fast_as_it_can: bool = False) -> None:
        """A move of the tip centre, at the travel speed or at one that the text does not state."""
        unstated = replace(self.settings, travel_speed_mm_s=math.inf)
        self._open(False, unstated if as_fast_as_it_can else self.settings)
        self.builder.goto(position, self.line)

    def measure(self, position: Sequence[float], approach: Sequence[float], name: str = "") -> None:
        """A measuring move; what follows belongs to the next point."""
        self._open(True, self.settings)
        self.builder.measure(position, approach, self.line, name)
        self._started = False

    def search(self, end: Sequence[float], what: str) -> Contact:
        """A straight search that ends at ``end`` at the latest, the search distance beyond the nominal contact."""
        approach = self.direction_to(end, what)
        target = [p - self.settings.search_mm * d for p, d in zip(end, approach, strict=True)]
        return self.touch(target, approach, end)

    def touch(
        self, target: Sequence[float], approach: Sequence[float], end: Sequence[float] | None = None, name: str = ""
    ) -> Contact:
        """A measuring move to a nominal tip centre, and where it really ended."""
        self.measure(target, approach, name)
        if end is None:
            end = [p + self.settings.search_mm * d for p, d in zip(target, approach, strict=True)]
        return self.probe.answer(self.builder.size - 1, True, end, target)

    def travel(self, end: Sequence[float]) -> Contact:
        """A move on the way that a trigger would end."""
        self.goto(end)
        return self.probe.answer(self.builder.size - 1, False, end, end)

    def alarm(self, text: str) -> NoReturn:
        """The controller stops with this text."""
        raise ControllerAlarmError(f"{text} (line {self.line})")

    def _open(self, measuring: bool, settings: ProbingSettings) -> None:
        if self.dry:
            raise MovedOnError
        if self.closed:
            self.fail("a move after what belongs behind the last one")
        if not self._started:
            self.builder.open_point()
        self._started = True
        now = InForce(measuring, settings, frozenset(self.states.items()))
        self.builder.in_force.setdefault(now, self.line)

    def direction(self, vector: Sequence[float], what: str) -> Sequence[float]:
        """A vector made a unit vector."""
        size = float(np.linalg.norm(vector))
        if size < 1e-9:
            self.fail(f"{what} has no direction", found=list(vector))
        return [value / size for value in vector]

    def direction_to(self, target: Sequence[float], what: str) -> Sequence[float]:
        """Unit direction from the last position to a target."""
        here = self.builder.last_position
        if here is None:
            self.fail(f"{what} before any position is known", expected="a move to a start position first")
        return self.direction(np.subtract(target, here).tolist(), what)

    def cut_short(self, expected: str) -> NoReturn:
        """The end of the program is missing."""
        self.fail("the program is cut short", expected=expected)

    def finish(self) -> Program:
        """The program; :class:`InputError` where it measures nothing."""
        if not self.moved:
            self.fail("the program has no moves")
        self.builder.settings = self.settings
        program = replace(self.builder.build(), tool=self.states.get("tool", ""), stylus=self.stylus)
        if not program.n_points:
            self.fail("the program measures nothing", expected="at least one measuring move")
        return program

"""What the readers of all dialects share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.numerals import number as plain_number
from stepgauge.motion.moves import InForce, ProbingSettings, Program, ProgramBuilder


class Reader:
    """Collects the moves of a text and fails with the line at hand."""

    def __init__(self, path: str, settings: ProbingSettings, self_positioning: bool = False) -> None:
        self.path, self.settings = path, settings
        self.states: dict[str, str] = {}
        self.stylus: tuple[float, float, float] | None = None
        self.line = 0
        self.builder = ProgramBuilder(path, settings, self_positioning)
        self._started = False

    def fail(self, what: str, found: object = None, expected: object = None) -> NoReturn:
        """Raise :class:`InputError` for the current line."""
        raise InputError(f"{self.path}:{self.line}", what, found=found, expected=expected)

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

    def _open(self, measuring: bool, settings: ProbingSettings) -> None:
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

    def from_here(self, target: Sequence[float], what: str) -> Sequence[float]:
        """Unit direction from the last position to a target."""
        here = self.builder.last_position
        if here is None:
            self.fail(f"{what} before any position is known", expected="a move to a start position first")
        return self.direction(np.subtract(target, here).tolist(), what)

    def finish(self) -> Program:
        """The program; :class:`InputError` where it measures nothing."""
        if not self.moved:
            self.fail("the program has no moves")
        self.builder.settings = self.settings
        program = replace(self.builder.build(), tool=self.states.get("tool", ""), stylus=self.stylus)
        if not program.n_points:
            self.fail("the program measures nothing", expected="at least one measuring move")
        return program

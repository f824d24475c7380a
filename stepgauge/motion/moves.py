"""A measuring program as moves, common to planner, templates, readers and virtual CMM."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array

NO_WAY_MM = 0.01
"""A move shorter than this goes nowhere: no register could tell whether the probe ended it."""


@dataclass(frozen=True)
class ProbingSettings:
    """Settings of a controller for probing.

    ``standoff_mm``: gap between the tip ball and the face where the measuring move starts. ``search_mm``: how far the
    tip centre may travel beyond its nominal contact position. ``retract_mm``: how far a controller that retracts by
    itself goes back. ``tip_radius_mm``: nominal radius of the tip ball.
    """

    standoff_mm: float = 3.0
    search_mm: float = 2.0
    retract_mm: float = 3.0
    measuring_speed_mm_s: float = 3.0
    travel_speed_mm_s: float = 50.0
    tip_radius_mm: float = 2.0


class InForce(NamedTuple):
    """Valid for a move of a text: its settings, and its states (units, coordinates, tool) by name."""

    measuring: bool
    settings: ProbingSettings
    states: frozenset[tuple[str, str]]


@dataclass(frozen=True)
class Move:
    """One move: a goto has no approach; a measuring move has its nominal tip centre at contact as position."""

    position: Array
    approach: Array | None = None
    name: str = ""

    @property
    def is_measure(self) -> bool:
        """Whether the move probes a face."""
        return self.approach is not None


@dataclass(frozen=True)
class Program:
    """A sequence of moves in machine coordinates (mm, tip centre).

    Arrays have one row per move: ``position_mm (n, 3)`` is the target of a goto, or the nominal tip centre at contact
    of a measuring move; ``approach (n, 3)`` the unit direction of a measuring move, NaN for a goto; ``point (n,)``
    counts the measuring points: 0 before the first one, n_points + 1 after the last one; ``line (n,)`` is the line of
    the program text (0 where it was not read from text). ``self_positioning`` says that the controller goes to the
    stand-off of a measuring point by itself and comes back from it (DMIS, I++ DME). ``tool`` is what the controller
    calls the probe; empty for the dialect's own word. ``stylus``: unit vector from the probe's body to the tip, None
    where nothing says it. ``in_force`` is of programs that were read from text: all that held at any move, with the
    first line of it.
    """

    name: str
    settings: ProbingSettings
    position_mm: Array
    approach: Array
    point: NDArray[np.int64]
    line: NDArray[np.int64]
    names: Sequence[str]
    self_positioning: bool = False
    tool: str = ""
    stylus: tuple[float, float, float] | None = None
    in_force: Mapping[InForce, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.position_mm)

    @property
    def is_measure(self) -> NDArray[np.bool_]:
        """Which moves probe a face, (moves,)."""
        return ~np.isnan(self.approach[:, 0])

    @property
    def n_points(self) -> int:
        """Number of measuring points."""
        return int(self.is_measure.sum())

    def moves(self, point: int) -> Iterator[Move]:
        """The moves that belong to one measuring point (0: before the first, n_points + 1: after the last)."""
        first, last = np.searchsorted(self.point, [point, point + 1])
        measure = self.is_measure
        for i in range(first, last):
            yield Move(self.position_mm[i], self.approach[i] if measure[i] else None, self.names[i])


class ProgramBuilder:
    """Collects moves one by one; :meth:`build` gives the program."""

    def __init__(self, name: str, settings: ProbingSettings, self_positioning: bool = False) -> None:
        self.name, self.settings, self.self_positioning = name, settings, self_positioning
        self.in_force: dict[InForce, int] = {}
        self._rows: list[tuple[Sequence[float], Sequence[float], int, int, str]] = []
        self._point = 0

    @property
    def last_position(self) -> Sequence[float] | None:
        """End of the last move so far, x, y, z in mm; None before the first."""
        return self._rows[-1][0] if self._rows else None

    @property
    def size(self) -> int:
        """How many moves there are so far."""
        return len(self._rows)

    def open_point(self) -> None:
        """The moves that follow belong to the next measuring point."""
        self._point += 1

    def goto(self, position: Sequence[float] | Array, line: int = 0, name: str = "") -> None:
        """A move of the tip centre to a position."""
        self._rows.append((tuple(position), (np.nan,) * 3, self._point, line, name))

    def measure(
        self, position: Sequence[float] | Array, approach: Sequence[float] | Array, line: int = 0, name: str = ""
    ) -> None:
        """A measuring move with its nominal tip centre at contact and its unit direction."""
        self._rows.append((tuple(position), tuple(approach), self._point, line, name))

    def build(self) -> Program:
        """The program so far."""
        position, approach, point, line, names = zip(*self._rows, strict=True)
        return Program(
            self.name,
            self.settings,
            np.array(position, float),
            np.array(approach, float),
            np.array(point),
            np.array(line),
            names,
            self.self_positioning,
            in_force=self.in_force,
        )


@dataclass(frozen=True)
class Path:
    """The straight pieces the tip centre travels, in order; arrays have one row per piece.

    ``measuring`` marks the searches; ``move`` is the index of the program's move that a piece belongs to.
    """

    start_mm: Array
    end_mm: Array
    measuring: NDArray[np.bool_]
    move: NDArray[np.int64]

    @property
    def length_mm(self) -> Array:
        """Lengths of the pieces, (pieces,) in mm."""
        return np.linalg.norm(self.end_mm - self.start_mm, axis=1)

    def until(self, stop_piece: int | None) -> Path:
        """The pieces up to and with the one on which the machine stopped; all of them for None."""
        if stop_piece is None:
            return self
        kept = slice(0, stop_piece + 1)
        return Path(self.start_mm[kept], self.end_mm[kept], self.measuring[kept], self.move[kept])


def trace(program: Program, measured_mm: Array | None = None) -> Path:
    """The path of the tip centre from the first move's target on.

    ``measured_mm (n_points, 3)`` is where the searches end (default: at the nominal contact). A self-positioning
    controller adds the piece to the stand-off before a search and the one back after it.
    """
    measure = program.is_measure
    ends = program.position_mm.copy()
    if measured_mm is not None:
        ends[measure] = measured_mm
    order = np.arange(len(program))
    if not program.self_positioning:
        return Path(ends[:-1], ends[1:], measure[1:], order[1:])
    before = program.position_mm[measure] - program.settings.standoff_mm * program.approach[measure]
    after = ends[measure] - program.settings.retract_mm * program.approach[measure]
    stops = np.concatenate([ends, before, after])
    keys = np.concatenate([order, order[measure] - 0.25, order[measure] + 0.25])
    searching = np.concatenate([measure, np.zeros(2 * len(before), bool)])
    rank = np.argsort(keys, kind="stable")
    stops, searching, owner = stops[rank], searching[rank], np.rint(keys[rank]).astype(np.int64)
    return Path(stops[:-1], stops[1:], searching[1:], owner[1:])

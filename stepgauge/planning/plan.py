"""Placement and gauge to the moves of a measuring program (Pahk & Kim, section 3, Figs 3 and 4).

From face to face the tip goes back to the stand-off (retract), out of the gap between the blocks (clear), along the
gauge (advance), into the next gap (enter), and measures. The horizontal path clears around the side of the blocks, the
vertical one over their top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import ProbingSettings, Program, ProgramBuilder

ROUTES = ("side", "over")
ORDERS = ("blocks", "fronts-backs", "up-down")
LIFT_MM = 20.0
"""Extra height of the point above the gauge where a program starts and ends unless a home is given."""
MOST_STANDOFF_MM = 10.0
"""Largest stand-off that nobody asked for: the middle of a wide gap costs travel that a small mill lacks."""
MOST_BEFORE_MM = 25.0
"""How far before the first face a program starts at most: a bar of two blocks far apart has a pitch of its length."""


@dataclass(frozen=True)
class PlanOptions:
    """Choices of the technician.

    ``route``: ``side`` or ``over``; ``around``: +1 or -1, the side (+s or -s) that ``side`` goes around; ``order``:
    ``blocks`` (every block front then back), ``fronts-backs`` (all fronts, then all backs), ``up-down`` (odd cycles
    from the first face to the last, even cycles back); ``clearance_mm``: gap between tip ball and the blocks' side or
    top on the path; ``height_mm``: probing point above the blocks' middle height; ``home_mm``: where the program starts
    and ends, machine coordinates; ``only_blocks``: measure these blocks of the section and pass the others by;
    ``first_again``: touch the first face of every cycle again at its end, so that a drift shows within it
    (``up-down`` comes back by itself).
    """

    first_block: int
    last_block: int
    route: str = "side"
    order: str = "blocks"
    cycles: int = 5
    clearance_mm: float = 5.0
    margin_mm: float = 0.5
    height_mm: float = 0.0
    around: int = 1
    home_mm: tuple[float, float, float] | None = None
    only_blocks: tuple[int, ...] | None = None
    first_again: bool = False

    @property
    def blocks(self) -> NDArray[np.int64]:
        """Numbers of the blocks to measure, rising."""
        every = np.arange(self.first_block, self.last_block + 1)
        return every if self.only_blocks is None else np.array(sorted(self.only_blocks), np.int64)


def middle_standoff_mm(gauge: Gauge, tip_radius_mm: float) -> float:
    """Stand-off that puts the tip ball in the middle of the narrowest gap between two blocks, mm; 10 mm in a wide one.

    :class:`InputError` where the ball does not fit into that gap.
    """
    gap = float((gauge.position_mm[2::2] - gauge.position_mm[1:-1:2]).min())
    if gap <= 2.0 * tip_radius_mm:
        raise InputError(
            gauge.path,
            "the tip ball does not fit between the blocks",
            found=f"ball diameter {2 * tip_radius_mm:g} mm",
            expected=f"less than the gap of {gap:.3f} mm",
        )
    middle = np.floor((gap / 2.0 - tip_radius_mm) * 1e3) / 1e3  # a round number, on the safe side of the middle
    return min(float(middle), MOST_STANDOFF_MM)


def faces_in_order(options: PlanOptions) -> Iterator[tuple[int, int]]:
    """Pairs of (cycle, face) in the order in which they are measured."""
    fronts = 2 * options.blocks - 1
    every = np.sort(np.concatenate([fronts, fronts + 1]))
    for cycle in range(1, options.cycles + 1):
        if options.order == "fronts-backs":
            faces = np.concatenate([fronts, fronts + 1])
        elif options.order == "up-down" and cycle % 2 == 0:
            faces = every[::-1]
        else:
            faces = every
        again = faces[:1] if options.first_again and options.order != "up-down" else faces[:0]
        yield from ((cycle, int(face)) for face in np.concatenate([faces, again]))


def make_program(placement: Placement, gauge: Gauge, options: PlanOptions, settings: ProbingSettings) -> Program:
    """The measuring program; coordinates are not yet checked against anything (:func:`stepgauge.planning.check.check`).

    Parameters
    ----------
    placement, gauge : placement of the gauge, and its certified faces
    options : faces, cycles and the path between them
    settings : stand-off, search, speeds and tip radius

    Raises
    ------
    InputError
        blocks that the gauge does not have, or a probing point that is not on the face
    """
    gauge.check_block(options.first_block, "first block")
    gauge.check_block(options.last_block, "last block")
    _check_height(gauge, options, settings)
    return _Planner(placement, gauge, options, settings).program()


def _check_height(gauge: Gauge, options: PlanOptions, settings: ProbingSettings) -> None:
    room = gauge.table.block_height_mm / 2.0
    if abs(options.height_mm) >= room:
        raise InputError(
            naming("height_mm"),
            "the probing point is not on the faces",
            found=f"{options.height_mm:g} mm from the middle",
            expected=f"less than half the block height, {room:g} mm",
        )


class _Planner:
    """Works in gauge coordinates (a, s, up) and hands machine coordinates to the builder."""

    def __init__(self, placement: Placement, gauge: Gauge, options: PlanOptions, settings: ProbingSettings) -> None:
        self.placement, self.gauge, self.options, self.settings = placement, gauge, options, settings
        self.builder = ProgramBuilder(gauge.table.name, settings)

    def program(self) -> Program:
        """All moves: to the gauge, from face to face in every cycle, and away from it."""
        faces = list(faces_in_order(self.options))
        before = self._before_first(faces[0][1])
        self._goto("home", before + self._lift(before) if self.options.home_mm is None else None)
        here = before
        for cycle, face in faces:
            self.builder.open_point()
            there = self._standoff(face)
            self._travel(here, there)
            self.builder.measure(
                self.placement.to_machine(self.gauge, self._contact(face)),
                _direction(face) * self.placement.axis,
                name=f"C{cycle}F{face}",
            )
            here = there
        self._leave(here)
        return self.builder.build()

    def _travel(self, here: Array, there: Array) -> None:
        self._goto("retract", here)
        self._goto("clear", here + self._aside())
        self._goto("advance", there + self._aside())
        self._goto("enter", there)

    def _leave(self, here: Array) -> None:
        self.builder.open_point()
        out = here + self._aside()
        self._goto("retract", here)
        self._goto("clear", out)
        self._goto("lift", out + self._lift(out))
        if self.options.home_mm is not None:
            self._goto("home", None)

    def _goto(self, name: str, place: Array | None) -> None:
        target = self.options.home_mm if place is None else self.placement.to_machine(self.gauge, place)
        assert target is not None
        self.builder.goto(target, name=name)

    def _contact(self, face: int) -> Array:
        """Tip centre at nominal contact: one tip radius before the certified face."""
        along = self.gauge.position_mm[face - 1] - _direction(face) * self.settings.tip_radius_mm
        return np.array([along, 0.0, self.options.height_mm])

    def _standoff(self, face: int) -> Array:
        return self._contact(face) - np.array([_direction(face) * self.settings.standoff_mm, 0.0, 0.0])

    def _before_first(self, face: int) -> Array:
        """First position above the gauge: one block pitch before the first stand-off, of wide gaps less."""
        front = self.gauge.position_mm[0::2]
        block = (face - 1) // 2
        pitch = front[block] - front[block - 1] if block else front[1] - front[0]
        return self._standoff(face) - np.array([min(pitch, MOST_BEFORE_MM), 0.0, 0.0])

    def _aside(self) -> Array:
        table, ball = self.gauge.table, self.settings.tip_radius_mm + self.options.clearance_mm
        if self.options.route == "over":
            return np.array([0.0, 0.0, table.block_height_mm / 2.0 - self.options.height_mm + ball])
        return np.array([0.0, self.options.around * (table.block_width_mm / 2.0 + ball), 0.0])

    def _lift(self, place: Array) -> Array:
        """From a position vertically to a height above the blocks."""
        ball = self.settings.tip_radius_mm + self.options.clearance_mm
        return np.array([0.0, 0.0, self.gauge.table.block_height_mm / 2.0 - place[2] + ball + LIFT_MM])


def _direction(face: int) -> int:
    """+1 where a face is probed along the axis (fronts), -1 against it (backs)."""
    return 1 if face % 2 else -1


def parse_blocks(text: str, gauge: Gauge) -> tuple[int, int]:
    """``"A:B"`` as two block numbers of the gauge; an empty end means the gauge's first or last block."""
    parts: Sequence[str] = text.split(":")
    try:
        first, last = (
            int(part) if part.strip() else default for part, default in zip(parts, (1, gauge.n_blocks), strict=True)
        )
    except ValueError:
        raise InputError(
            naming("blocks"), "not a range of blocks", found=repr(text), expected="A:B, e.g. 1:21"
        ) from None
    gauge.check_block(first, "first block", "blocks")
    gauge.check_block(last, "last block", "blocks")
    if first > last:
        behind, expected = "its first block is behind its last one", f"{last}:{first}"
        raise InputError(naming("blocks"), behind, found=repr(text), expected=expected)
    if first == last:
        raise InputError(naming("blocks"), "needs at least two blocks", found=repr(text), expected="A:B with A < B")
    return first, last


def parse_section(text: str | None, gauge: Gauge) -> tuple[int, int] | None:
    """The used section as :func:`parse_blocks` reads it; None if not stated."""
    return parse_blocks(text, gauge) if text else None


def parse_block_list(text: str, gauge: Gauge) -> tuple[int, ...]:
    """``"1,2,13"`` as numbers of blocks of the gauge, rising."""
    try:
        blocks = sorted({int(part) for part in text.split(",")})
    except ValueError:
        raise InputError(
            naming("blocks"), "not a list of blocks", found=repr(text), expected="e.g. 1,2,13,25"
        ) from None
    for block in blocks:
        gauge.check_block(block, "block", "blocks")
    if len(blocks) < 2:
        raise InputError(naming("blocks"), "needs at least two blocks", found=repr(text))
    return tuple(blocks)


def parse_position(text: str) -> tuple[float, float, float]:
    """``"X,Y,Z"`` as a position in mm."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            naming("home_mm"), "not a position", found=repr(text), expected="X,Y,Z in mm, e.g. 0,0,400"
        ) from None
    if not np.isfinite([x, y, z]).all():
        raise InputError(naming("home_mm"), "not a position", found=repr(text), expected="finite numbers")
    return x, y, z

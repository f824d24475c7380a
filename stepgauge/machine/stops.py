"""What stops a machine in the middle of a program: a missed face, a collision, a limit of the travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.machine.file import Machine
from stepgauge.motion.collision import Obstacles, Tool, clearance_mm
from stepgauge.motion.moves import Path, Program

TOUCH_MM = 1e-6
"""Overlap that still counts as touching, not as a collision."""
NO_FACE = 0
NO_TRIGGER = -1
"""Instead of the number of the face: the search met none, or the probe does not trigger in that direction."""


@dataclass(frozen=True)
class Stop:
    """Something that stops the machine on a piece of its path."""

    piece: int
    what: str
    found: str
    expected: str


def first_stop(
    program: Program,
    path: Path,
    machine: Machine,
    obstacles: Obstacles,
    tool: Tool,
    row: NDArray[np.intp],
    face: NDArray[np.int64],
) -> Stop | None:
    """The first thing that stops the program, None if it runs through.

    ``path`` ends every search at the contact (before the pre-travel); ``row`` and ``face`` say for every search which
    obstacle was touched (-1: none) and which face that is (``NO_FACE``, ``NO_TRIGGER``).
    """
    stops = (
        _missed(program, path, obstacles, row, face),
        _collision(path, obstacles, tool),
        _beyond_travel(path, machine),
    )
    return min((stop for stop in stops if stop is not None), key=lambda stop: stop.piece, default=None)


def _missed(
    program: Program, path: Path, obstacles: Obstacles, row: NDArray[np.intp], face: NDArray[np.int64]
) -> Stop | None:
    if (face > 0).all():
        return None
    first = int((face <= NO_FACE).argmax())
    piece = int(np.flatnonzero(path.measuring)[first])
    if face[first] == NO_TRIGGER:
        return Stop(piece, "the probe does not trigger in this direction", "a pull out of its seat", "a push")
    if row[first] < 0:
        reach = program.settings.search_mm
        return Stop(piece, "the face was not found", "no contact", f"a face at most {reach:g} mm beyond the target")
    return Stop(piece, "the measuring move meets no face", f"an edge or side of {obstacles.name(row[first])}", "a face")


def _collision(path: Path, obstacles: Obstacles, tool: Tool) -> Stop | None:
    """The first piece on which a part of the tool hits something, other than the tip at the end of a search."""
    hits = []
    for part in tool.parts:
        gap = clearance_mm(path, obstacles, tool, part, 0.0)
        if part is tool.parts[0]:
            gap[path.measuring] = np.inf
        pieces = np.flatnonzero((gap < -TOUCH_MM).any(axis=1))
        if pieces.size:
            piece = int(pieces[0])
            what = f"the {part.name} hits {obstacles.name(int(gap[piece].argmin()))}"
            hits.append(Stop(piece, what, f"an overlap of {-gap[piece].min():.3f} mm", "a free path"))
    return min(hits, key=lambda stop: stop.piece, default=None)


def _beyond_travel(path: Path, machine: Machine) -> Stop | None:
    limits = machine.travel_mm
    places = np.vstack([path.start_mm[:1], path.end_mm])
    outside = (places < limits[:, 0]) | (places > limits[:, 1])
    if not outside.any():
        return None
    place = int(outside.any(axis=1).argmax())
    axis = int(outside[place].argmax())
    return Stop(
        max(place - 1, 0),
        f"the move leaves the travel of {machine.table.name}",
        f"{'xyz'[axis]} = {places[place, axis]:.3f} mm",
        f"{limits[axis, 0]:g} to {limits[axis, 1]:g} mm",
    )

"""Check of the whole path before it is written: tip, shank and body against gauge, rail and travel limits.

The path to the first position (home) is chosen by the machine and is not checked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, Naming, Place, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.motion.collision import Obstacles, Tool, ToolPart, ball_contacts, clearance_mm, make_obstacles
from stepgauge.motion.moves import Path, Program, trace

PROBED_BLOCK_MARGIN_MM = 0.1
"""Least gap of shank and body to the block that is probed; elsewhere the full margin applies."""
LEAST_SEARCH_MM = 0.4
"""Search beyond a face that is known to be off its place."""
FACE_TOLERANCE_MM = 1e-6
LEAST_TURN_COS = math.cos(math.radians(1.0))
"""A stylus that stands square within 1 deg gains nothing by a turn of the head."""
ALONG = 0.5
"""Component of an approach from which its stand-off makes the path longer along a machine axis."""


@dataclass(frozen=True)
class Conflict:
    """A place where a path is refused: the piece of its :func:`~stepgauge.motion.moves.trace`, and why, in words."""

    piece: int
    where: str
    what: str
    found: str
    expected: str


class PathError(InputError):
    """A path that is refused. ``program``: its moves; ``conflicts``: every place where it is, where that is known."""

    program: Program | None = None
    conflicts: tuple[Conflict, ...] = ()


def _refused(
    program: Program, conflicts: Sequence[Conflict], where: Place, what: str, found: str, expected: str | Naming
) -> PathError:
    error = PathError(where, what, found=found, expected=expected)
    error.program, error.conflicts = program, tuple(conflicts)
    return error


def check_program(
    program: Program, faces: Sequence[int], placement: Placement, gauge: Gauge, tool: Tool, margin_mm: float
) -> dict[str, float]:
    """Check every move of a planned program against the gauge.

    Parameters
    ----------
    program : the planned moves
    faces : the face each measuring point is meant for, in order
    placement, gauge : position of the blocks and of the rail
    tool : tip ball, stylus shank and probe body
    margin_mm : smallest gap allowed anywhere but at the face being touched

    Returns
    -------
    The smallest gap found for each part of the tool, mm (infinite where nothing was within the margin).

    Raises
    ------
    PathError
        a measuring move that meets another face than its own first, or a move that comes too close to something
    """
    gaps = check_path(program, [(face - 1) // 2 for face in faces], placement, gauge, tool, margin_mm, "height_mm")
    _check_faces(program, faces, trace(program), make_obstacles(gauge, placement), tool.tip_radius_mm)
    return gaps


def check_path(
    program: Program,
    rows: Sequence[int],
    placement: Placement,
    gauge: Gauge,
    tool: Tool,
    margin_mm: float,
    higher: str | None = None,
) -> dict[str, float]:
    """Check that nothing but what is touched comes too close; ``rows``: of the obstacle each measuring move touches.

    Rows are those of :class:`~stepgauge.motion.collision.Obstacles`; ``higher``: the argument that raises the path,
    where one does; the rest as :func:`check_program`.
    """
    if not np.isfinite(margin_mm):
        raise InputError("margin", "not a finite number", found=margin_mm, expected="mm")
    obstacles = make_obstacles(gauge, placement)
    path = trace(program)
    own = _probed_rows(path, rows)
    judged = {part.name: _judge_part(part, own, margin_mm, program, path, obstacles, tool) for part in tool.parts}
    conflicts = [(name, one) for name, (_, found) in judged.items() for one in found]
    if conflicts:
        name, first = conflicts[0]
        expected = _remedy(name, tool, placement, first.expected, higher)
        raise _refused(program, [one for _, one in conflicts], first.where, first.what, first.found, expected)
    return {name: least for name, (least, _) in judged.items()}


def check_search(off_mm: float, search_mm: float) -> None:
    """:class:`InputError` where a face that is ``off_mm`` away from its place would not be found."""
    if search_mm < off_mm + LEAST_SEARCH_MM * (off_mm > 0.0):
        what = f"the search is too short: by the distance between the blocks, a face may be {off_mm:.2f} mm off"
        least = naming("search_mm", words=f"{{}} {off_mm + LEAST_SEARCH_MM:.1f}")
        raise InputError("path", what, found=f"{search_mm:g} mm", expected=least)


def _check_faces(program: Program, faces: Sequence[int], path: Path, obstacles: Obstacles, radius_mm: float) -> None:
    """The whole search of every measuring move must meet its own face first, at the nominal contact."""
    approach = program.approach[program.is_measure]
    start, target = path.start_mm[path.measuring], path.end_mm[path.measuring]
    end = target + program.settings.search_mm * approach
    search = Path(start, end, np.ones(len(start), bool), path.move[path.measuring])
    t, row = ball_contacts(search, obstacles, radius_mm)
    off = np.linalg.norm(start + t[:, None] * (end - start) - target, axis=1)
    wrong = np.flatnonzero((row != (np.asarray(faces) - 1) // 2) | ~(off < FACE_TOLERANCE_MM))
    conflicts = []
    for point in wrong.tolist():
        met = "nothing" if row[point] < 0 else f"{obstacles.name(row[point])}, {off[point]:.3f} mm from there"
        where = f"point {program.names[search.move[point]]}"
        what, expected = "the measuring move does not meet its own face first", f"face {faces[point]} of block"
        piece = int(np.flatnonzero(path.measuring)[point])
        conflicts.append(Conflict(piece, where, what, met, f"{expected} {(faces[point] + 1) // 2}"))
    if conflicts:
        first = conflicts[0]
        raise _refused(program, conflicts, first.where, first.what, first.found, first.expected)


def _probed_rows(path: Path, touched: Sequence[int]) -> NDArray[np.int64]:
    """Row of what is being touched for a measuring piece and the retract after it, -1 for all others."""
    rows = np.full(len(path.start_mm), -1)
    rows[path.measuring] = touched
    rows[1:] = np.where(path.measuring[:-1], rows[:-1], rows[1:])
    return rows


def _judge_part(
    part: ToolPart,
    own: NDArray[np.int64],
    margin_mm: float,
    program: Program,
    path: Path,
    obstacles: Obstacles,
    tool: Tool,
) -> tuple[float, list[Conflict]]:
    """The smallest gap of a part, mm, and every piece on which it comes too close, with its worst obstacle."""
    gap = clearance_mm(path, obstacles, tool, part, margin_mm)
    pieces = np.arange(len(gap))
    touching = own >= 0
    allowed = np.full_like(gap, margin_mm)
    is_tip = part is tool.parts[0]
    allowed[pieces[touching], own[touching]] = -np.inf if is_tip else PROBED_BLOCK_MARGIN_MM
    short = np.where(gap < allowed - 1e-9, allowed - gap, 0.0)
    conflicts = [
        Conflict(
            piece,
            f"point {_point_name(program, int(path.move[piece]))}, move '{_move_name(program, path, piece)}'",
            f"the {part.name} comes too close to {obstacles.name(box)}",
            f"a gap of {gap[piece, box]:.3f} mm",
            f"at least {allowed[piece, box]:g} mm",
        )
        for piece, box in _worst(short)
    ]
    gap[pieces[touching], own[touching]] = np.inf
    return float(gap.min()), conflicts


def _worst(short: Array) -> Iterator[tuple[int, int]]:
    """Pieces that are short of their gap, each with the obstacle it is most short of."""
    for piece in np.flatnonzero(short.any(axis=1)).tolist():
        yield piece, int(short[piece].argmax())


def _remedy(part: str, tool: Tool, placement: Placement, expected: str, higher: str | None) -> Naming | str:
    """What is expected, and how to reach it."""
    if part == "tip ball":
        words = f"{expected} (another {{}}, {{}} or {{}}, or a smaller tip)"
        return naming("standoff_mm", "clearance_mm", "route", words=words)
    words = f"take a longer stylus, or state the true size: {tool.body} in [probe])"
    if tool.upward @ placement.up < LEAST_TURN_COS:
        square = ", ".join(f"{0.0 - value:.9f}" for value in placement.up)
        words = (
            "take a longer stylus, or turn the head so that the stylus stands square to the gauge:"
            f" stylus_direction = [{square}] in [probe])"
        )
    if higher is None:
        return f"{expected} ({words}"
    return naming(higher, words=f"{expected} (probe higher with {{}}, {words}")


def _move_name(program: Program, path: Path, piece: int) -> str:
    return "measure" if path.measuring[piece] else program.names[path.move[piece]]


def _point_name(program: Program, move: int) -> str:
    """Name of the measuring point that a move leads to (the last one's after it)."""
    measures = np.flatnonzero(program.is_measure)
    return program.names[measures[min(int(np.searchsorted(measures, move)), len(measures) - 1)]]


def check_travel(program: Program, machine: Machine) -> None:
    """Every target, and the end of every search, must lie within the machine's travel (:class:`InputError` if not)."""
    measure = program.is_measure
    reach = program.position_mm.copy()
    reach[measure] += program.settings.search_mm * program.approach[measure]
    limits = machine.travel_mm
    beyond = np.maximum(np.maximum(limits[:, 0] - reach, reach - limits[:, 1]), 0.0)
    outside = np.flatnonzero(beyond.any(axis=1))
    if not outside.size:
        return
    worst = int(beyond.max(axis=1).argmax())
    conflicts = list(_outside(program, reach, limits, beyond))
    axis = int(beyond[worst].argmax())
    raise _refused(
        program,
        conflicts,
        machine.path,
        f"the travel is too small by {beyond[worst, axis]:.3f} mm in {'xyz'[axis]}"
        f" for point {_point_name(program, worst)}, move '{'measure' if measure[worst] else program.names[worst]}'"
        f" ({outside.size} of {len(program)} moves are outside)",
        f"{'xyz'[axis]} = {reach[worst, axis]:.3f} mm",
        _into_travel("xyz"[axis], limits[axis], reach[:, axis], program.approach[measure, axis])
        if not _is_all_outside(reach[measure, axis], limits[axis])
        else f"{limits[axis, 0]:g} to {limits[axis, 1]:g} mm: the whole gauge lies outside; work coordinates instead of"
        " machine coordinates?",
    )


def _is_all_outside(measured: Array, travel: Array) -> bool:
    return bool(measured.max() < travel[0] or measured.min() > travel[1])


def _into_travel(axis: str, travel: Array, reached: Array, approach: Array) -> Naming:
    """The travel along one axis, and how a path that leaves it comes to lie inside, mm: moved, else made shorter.

    Along a search the stand-offs make it long, beside it the way around the blocks.
    """
    reach = reached.min(), reached.max()
    option = "standoff_mm" if np.abs(approach).max() > ALONG else "clearance_mm"
    words, size, way = f"{travel[0]:g} to {travel[1]:g} mm", travel[1] - travel[0], reach[1] - reach[0]
    if way <= size:
        under = bool(reach[0] < travel[0])
        least = travel[0] - reach[0] if under else reach[1] - travel[1]
        least_um, most_um = math.ceil(1e3 * least), math.floor(1e3 * (least + size - way))
        moved = f"{1e-3 * least_um:.3f} to {1e-3 * max(least_um, most_um):.3f}"
        advice = f"{words}: lay the gauge {moved} mm farther towards {'-+'[under]}{axis}, or take a smaller {{}}"
        return naming(option, words=advice)
    return naming(
        option, "blocks", words=f"{words}: the path takes {way:.3f} mm; shorten it with a smaller {{}} or fewer {{}}"
    )


def _outside(program: Program, reach: Array, limits: Array, beyond: Array) -> Iterator[Conflict]:
    """Every move that leaves the travel."""
    path = trace(program)
    for move in np.flatnonzero(beyond.any(axis=1)).tolist():
        axis = int(beyond[move].argmax())
        piece = min(int(np.searchsorted(path.move, move)), len(path.move) - 1)
        name = "measure" if program.is_measure[move] else program.names[move]
        yield Conflict(
            piece,
            f"point {_point_name(program, move)}, move '{name}'",
            "this is outside of the travel",
            f"{'xyz'[axis]} = {reach[move, axis]:.3f} mm",
            f"{limits[axis, 0]:g} to {limits[axis, 1]:g} mm",
        )

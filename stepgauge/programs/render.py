"""Moves to program text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox.

A template sees ``program`` (name, settings), ``start`` (moves before the first point), ``points`` (each with ``name``,
``moves`` and ``measure``) and ``finish`` (moves after the last point). Every move has ``tip`` (x, y, z of the tip
centre); a measuring one also ``contact`` (surface point), ``approach`` and ``normal`` (unit vectors) and
``search_end``. Filters: ``fixed(n)`` prints n decimals and never -0; ``plain`` keeps letters, digits, space, dot, dash
and underscore. A template may extend a shipped one by its file name, and then states only the blocks that differ.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stepgauge import __version__
from stepgauge.moves import Move, Program
from stepgauge.programs import Dialect
from stepgauge.resources import folder
from stepgauge.templating import check_ascii, fill_template


class Xyz(NamedTuple):
    """Three components of a position (mm) or a direction."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class MoveView:
    """A move as a template sees it."""

    name: str
    tip: Xyz
    approach: Xyz | None = None
    normal: Xyz | None = None
    contact: Xyz | None = None
    search_end: Xyz | None = None


@dataclass(frozen=True)
class PointView:
    """A measuring point as a template sees it: the moves that lead to it, and the measuring move."""

    name: str
    moves: list[MoveView]
    measure: MoveView


def render(program: Program, dialect: Dialect, template: str | Path | None = None) -> str:
    """Program text of a dialect, with its shipped template or with the template file given.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids.
    """
    source = Path(template) if template else folder("templates") / "programs" / dialect.template
    text = fill_template(source, "programs", _context(program))
    check_ascii(text, source)
    return text


def _context(program: Program) -> dict[str, object]:
    return {
        "program": program,
        "settings": program.settings,
        "start": [_view(move, program) for move in program.moves(0)],
        "points": list(_points(program)),
        "finish": [_view(move, program) for move in program.moves(program.n_points + 1)],
        "version": __version__,
    }


def _points(program: Program) -> Iterator[PointView]:
    for number in range(1, program.n_points + 1):
        *way, measure = (_view(move, program) for move in program.moves(number))
        yield PointView(measure.name, way, measure)


def _view(move: Move, program: Program) -> MoveView:
    tip = Xyz(*move.position.tolist())
    if move.approach is None:
        return MoveView(move.name, tip)
    settings = program.settings
    return MoveView(
        move.name,
        tip,
        approach=Xyz(*move.approach.tolist()),
        normal=Xyz(*(-move.approach).tolist()),
        contact=Xyz(*(move.position + settings.tip_radius_mm * move.approach).tolist()),
        search_end=Xyz(*(move.position + settings.search_mm * move.approach).tolist()),
    )


def same_moves(one: Program, other: Program, decimals: int) -> bool:
    """Whether two programs make the same moves, to the printed digits of a dialect.

    Positions agree to one unit of the last digit. Directions agree to what rounding the two positions that define them
    can do over the stand-off; a dialect that prints directions does better.
    """
    if len(one) != len(other) or not np.array_equal(one.is_measure, other.is_measure):
        return False
    digit = 10.0**-decimals
    measure = one.is_measure
    turned = np.abs(one.approach[measure] - other.approach[measure])
    return bool(
        (np.abs(one.position_mm - other.position_mm) <= digit).all()
        and (turned <= 2.0 * digit / one.settings.standoff_mm + 1e-9).all()
    )

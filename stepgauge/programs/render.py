"""Moves to program text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox.

A template sees ``program`` (name, settings), ``start`` (moves before the first point), ``points`` (each with ``name``,
``moves`` and ``measure``) and ``finish`` (moves after the last point). Every move has ``tip`` (x, y, z of the tip
centre); a measuring one also ``contact`` (surface point), ``approach`` and ``normal`` (unit vectors) and
``search_end``. Filters: ``fixed(n)`` prints n decimals and never -0; ``plain`` keeps letters, digits, space, dot, dash
and underscore. A template may extend a shipped one by its file name, and then states only the blocks that differ.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import jinja2
import numpy as np
from jinja2.sandbox import ImmutableSandboxedEnvironment

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.files import read_text
from stepgauge.moves import Move, Program
from stepgauge.programs import Dialect
from stepgauge.resources import folder


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
    try:
        text = _environment().from_string(read_text(source)).render(_context(program))
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{source}:{error.lineno}", f"template: {error.message}") from None
    except Exception as error:  # whatever a user's template does is the template's fault: name its line
        raise InputError(f"{source}:{_template_line(error)}", f"template: {error}") from None
    _check_ascii(text, source)
    return text


def _environment() -> jinja2.Environment:
    environment = ImmutableSandboxedEnvironment(
        loader=jinja2.FileSystemLoader(folder("templates") / "programs"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(fixed=fixed, plain=plain)
    return environment


def fixed(value: float, decimals: int) -> str:
    """A number with a fixed count of decimals, without exponent and without a negative zero."""
    text = f"{float(value):.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def plain(text: object) -> str:
    """Text that every controller takes in a comment or a file name."""
    return re.sub(r"[^A-Za-z0-9 ._-]", "_", str(text))


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


def _template_line(error: Exception) -> int:
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == "<template>"]
    return frames[-1].lineno or 0 if frames else 0


def _check_ascii(text: str, source: Path) -> None:
    """Controllers read ASCII; a degree sign in a comment stops some of them."""
    for line, content in enumerate(text.splitlines(), 1):
        if not content.isascii():
            raise InputError(source, f"line {line} of the rendered program is not ASCII", found=repr(content))


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

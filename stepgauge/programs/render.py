"""Moves to program text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox.

A template sees ``program`` (``name``, ``tool``, ``stylus``), ``settings`` (the fields of
:class:`~stepgauge.motion.moves.ProbingSettings`), ``start`` (moves before the first point), ``points`` (each with
``name``, ``moves`` and ``measure``), ``finish`` (moves after the last point), ``version``, and ``checked``: words on
whether the text was read back. Every move has ``name`` and ``tip`` (x, y, z of the tip centre); a measuring one also
``contact`` (surface point), ``approach`` and ``normal`` (unit vectors) and ``search_end``. All of it are copied values:
a template cannot reach the plan. Filters: ``fixed(n)`` prints n decimals and never -0; ``plain`` keeps letters, digits,
space, dot, dash and underscore. A template may extend a shipped one by its file name, and then states only the blocks
that differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.files.resources import folder
from stepgauge.files.templating import check_printable, fill_template
from stepgauge.motion.moves import Move, Program
from stepgauge.programs import Dialect

DOWN = (0.0, 0.0, -1.0)
"""The way a stylus points unless a machine file says otherwise."""
CHECKED = "read back by stepgauge"
NOT_CHECKED = "NOT CHECKED: stepgauge did not read this text back"


def render(program: Program, dialect: Dialect, template: str | Path | None = None, checked: str = CHECKED) -> str:
    """Program text of a dialect, with its shipped template or with the template file given.

    :class:`InputError` names the line of a template that fails: syntax, an unknown name, something the sandbox forbids;
    and a line of the text that a controller may read in another way
    (:func:`stepgauge.files.templating.check_printable`).
    """
    source = Path(template) if template else folder("templates") / "programs" / dialect.template
    text = fill_template(source, "programs", _context(program, dialect, checked))
    check_printable(text, source)
    return text


def _context(program: Program, dialect: Dialect, checked: str) -> dict[str, object]:
    return {
        "program": {"name": program.name, "tool": program.tool or dialect.tool, "stylus": _xyz(program.stylus or DOWN)},
        "settings": program.settings,
        "start": [_seen(move, program) for move in program.moves(0)],
        "points": list(_points(program)),
        "finish": [_seen(move, program) for move in program.moves(program.n_points + 1)],
        "version": __version__,
        "checked": checked,
    }


def _points(program: Program) -> Iterator[dict[str, Any]]:
    for number in range(1, program.n_points + 1):
        *way, measure = (_seen(move, program) for move in program.moves(number))
        yield {"name": measure["name"], "moves": way, "measure": measure}


def _seen(move: Move, program: Program) -> dict[str, Any]:
    """A move as a template sees it."""
    seen: dict[str, Any] = {"name": move.name, "tip": _xyz(move.position.tolist())}
    if move.approach is None:
        return seen
    tip, approach, settings = move.position, move.approach, program.settings
    return seen | {
        "approach": _xyz(approach.tolist()),
        "normal": _xyz((-approach).tolist()),
        "contact": _xyz((tip + settings.tip_radius_mm * approach).tolist()),
        "search_end": _xyz((tip + settings.search_mm * approach).tolist()),
    }


def _xyz(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", values, strict=True))

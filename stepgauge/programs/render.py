"""Moves to program text through a Jinja template, a shipped one or the user's own, in Jinja's sandbox.

A template sees ``program`` (``name``, ``tool``, ``stylus``, ``ends``: the first point and the farthest from it),
``settings`` (the fields of :class:`~stepgauge.motion.moves.ProbingSettings`), ``start`` (moves before the first point),
``points`` (each with ``name``, ``number``, ``moves`` and ``measure``), ``finish`` (moves after the last point),
``control`` (the options of the dialect, and its ``name``), ``version``, and ``checked``: words on whether the text was
read back. Every move has ``name``, ``tip`` (x, y, z of the tip centre), ``free`` (the probe is still deflected from the
touch before, so that no search is possible) and ``still`` (it goes nowhere, and may be left out); a measuring one also
``contact`` (surface point), ``approach`` and ``normal`` (unit vectors) and ``search_end``. All of it are copied values:
a template cannot reach the plan. Filters: ``fixed(n)`` prints n decimals and never -0, ``signed(n)`` also a plus;
``plain`` keeps letters, digits, space, dot, dash and underscore. A template may extend a shipped one by its file name,
and then states only the blocks that differ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.files.resources import folder
from stepgauge.files.templating import check_printable, fill_template
from stepgauge.motion.moves import NO_WAY_MM, Move, Program
from stepgauge.programs.dialect import Dialect

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
    seen = _moves(program)
    points = [group for group in seen if "measure" in group]
    stylus, tool = _xyz(program.stylus or DOWN), program.tool or dialect.tool
    return {
        "program": {"name": program.name, "tool": tool, "stylus": stylus, "ends": _ends(points)},
        "settings": program.settings,
        "start": seen[0]["moves"],
        "points": points,
        "finish": seen[-1]["moves"],
        "control": {**dialect.values, "name": dialect.name, "title": dialect.title},
        "version": __version__,
        "checked": checked,
    }


def _ends(points: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The first point and the farthest from it, by their contacts: where the gauge lies."""
    places = [list(point["measure"]["contact"].values()) for point in points]
    return [points[0], max(zip(points, places, strict=True), key=lambda one: math.dist(one[1], places[0]))[0]]


def _moves(program: Program) -> list[dict[str, Any]]:
    """The moves before, to and after the points, as a template sees them."""
    groups: list[dict[str, Any]] = []
    before: Move | None = None
    for number in range(program.n_points + 2):
        group: dict[str, Any] = {"number": number, "moves": []}
        for move in program.moves(number):
            still = before is not None and float(np.abs(move.position - before.position).max()) <= NO_WAY_MM
            free = before is not None and before.is_measure
            group["moves"].append(_seen(move, program) | {"free": free, "still": still})
            before = move
        if 0 < number <= program.n_points:
            group["measure"] = group["moves"].pop()
            group["name"] = group["measure"]["name"]
        groups.append(group)
    return groups


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

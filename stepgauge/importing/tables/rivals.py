"""The roles that names suggest, compared with one another and with the numbers: what stays open is a question.

A choice by ``--column`` is not judged: it removes its rivals (:func:`.roles.AXIS, read_columns`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.files.numerals import looks_numeric
from stepgauge.importing.tables.cells import Cell
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.columns import (
    AXIS,
    CYCLE,
    DROPPED,
    FROM,
    PLACEMENT,
    READING,
    TARGET,
    TIME,
    VALUE_ROLES,
    VALUES,
    WAY,
    Column,
    is_known,
    read_columns,
    remainder,
)
from stepgauge.importing.tables.consistent import check_consistent
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.labels import LABEL, parse_label, way_of
from stepgauge.importing.tables.questions import Choice, Decisions
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import WORDS, says, split_name, words_of

_COORDINATES = ("x", "y", "z", "height")
MOST_OF_SPOT = 1.0
"""Span, in the unit of a table, of the readings of one spot where other coordinates stand beside them."""
_KINDS_ASKED = "rows are of several kinds"
NEAR = 0.01
"""Of a column that is the same in every row: readings that are as near to it may be those of one target."""
MOST_SHOWN = 4


def settled_roles(table: Table, layout: TableLayout, decisions: Decisions) -> list[Column]:
    """The role of every column; what names and numbers leave open is asked."""
    chosen = layout.columns
    roles = read_columns(table.headers, table.units, chosen, AXIS)
    roles = [_by_content(table, one) for one in roles]
    roles = _without_copies(table, roles, decisions)
    roles = _one_target(table, roles, chosen, decisions)
    roles = _one_coordinate(table, roles, decisions)
    roles = _with_vacant(table, roles, chosen, decisions)
    _check_kinds(table, roles, layout, decisions)
    return check_consistent(table, roles, chosen, decisions)


def is_text(table: Table, place: int) -> bool:
    """Whether a column has text, beside what may be numbers."""
    middle = table.bulk.get(place)
    if middle is not None and middle.dtype.kind in "fi":
        return False
    return any(isinstance(row[place], str) and row[place] and not looks_numeric(str(row[place])) for row in table.rows
               if place < len(row))  # fmt: skip


def _by_content(table: Table, one: Column) -> Column:
    """A column of times or directions by its cells, where its name says nothing."""
    if one.role is not None or one.unit is not None:
        return one
    cells = [cell for cell in table.first_cells(one.place) if cell != ""]
    texts = [cell for cell in cells if isinstance(cell, str)]
    if cells and not any(isinstance(cell, str | float) for cell in cells):
        return replace(one, role=TIME)
    if texts and len(texts) == len(cells):
        if all(way_of(text) for text in texts) and len({way_of(text) for text in texts}) == 2:
            return replace(one, role=WAY)
        if all(is_moment(text) for text in texts):
            return replace(one, role=TIME)
    return one


def _without_copies(table: Table, roles: list[Column], decisions: Decisions) -> list[Column]:
    """Columns of one header and the same numbers are one column."""
    seen: dict[str, Column] = {}
    found = []
    for one in roles:
        first = one if one.role in (None, DROPPED) else seen.setdefault(one.header.casefold(), one)
        numbers = table.numbers(one.place) if first is not one else np.zeros(1)
        if first is not one and not np.array_equal(numbers, table.numbers(first.place)):
            first = one
        if first is not one:
            decisions.reject(f"column {one.place + 1}, {one.header!r}", f"a copy of column {first.place + 1}")
        found.append(one if first is one else replace(one, role=DROPPED))
    return found


def _one_target(table: Table, roles: list[Column], chosen: Mapping[str, str], decisions: Decisions) -> list[Column]:
    """The target: of several the one whose name goes with that of the reading, or whose numbers are the same."""
    targets = [one for one in roles if one.role == TARGET]
    values = [one for one in roles if one.role in VALUES]
    if len(targets) < 2 or TARGET in chosen:
        return roles
    ends = {remainder(one.name) for one in values}
    paired = [one for one in targets if len(ends) == 1 and remainder(one.name) in ends]
    first = paired[0] if len(paired) == 1 and len(targets) > 1 and ends != {frozenset()} else targets[0]
    others = [one for one in targets if one is not first]
    alike = all(np.array_equal(table.numbers(one.place), table.numbers(first.place), equal_nan=True) for one in others)
    if len(paired) == 1 and ends != {frozenset()}:
        why = f"{first.header!r} goes with {values[0].header!r}"
    elif alike:
        why = f"the same numbers as {first.header!r}"
    elif len(ends) > 1 and all(remainder(one.name) in ends for one in targets):
        why = "which one, shows with the reading"
    else:
        why = "asked"
        names = " and ".join(repr(one.header) for one in targets[:MOST_SHOWN])
        ways = [Choice("columns", f"{TARGET}={one.called}") for one in targets]
        decisions.ask(table.path, "several columns may be the target", *ways, found=names)
    for one in others:
        decisions.reject(f"{one.header!r} as the target", why)
    return [replace(one, role=None) if one in others else one for one in roles]


# roles that no name fills


def _one_coordinate(table: Table, roles: list[Column], decisions: Decisions) -> list[Column]:
    """Of coordinates of one spot that was touched again and again, the one that differs is the reading."""
    if any(one.role in (*VALUE_ROLES, TARGET, FROM) for one in roles):
        return roles
    places = [one for one in roles if one.role is None and one.name.casefold() in _COORDINATES]
    spans = {one.place: float(np.ptp(table.numbers(one.place))) for one in places}
    moving = [one for one in places if spans[one.place] != 0.0]
    if len(moving) != 1 or not spans[moving[0].place] < MOST_OF_SPOT:
        return roles
    decisions.take(f"{moving[0].header!r} is taken as the reading: the other coordinates are the same in every row")
    fixed = {one.place for one in places} - {moving[0].place}
    roles = [replace(one, role=READING) if one is moving[0] else one for one in roles]
    return [replace(one, role=DROPPED) if one.place in fixed else one for one in roles]


def _with_vacant(table: Table, roles: list[Column], chosen: Mapping[str, str], decisions: Decisions) -> list[Column]:
    """Columns whose names say nothing, for the roles of target and reading where no name fills them."""
    of_stations = any(one.role == FROM for one in roles)
    values = [one for one in roles if one.role in VALUE_ROLES]
    targets = [one for one in roles if one.role == TARGET]
    readings = table.numbers(values[0].place) if values else np.zeros(1)
    free = [one for one in roles if one.role is None and _may_be_place(table, one, readings)]
    if values and not targets and not of_stations and free and TARGET not in chosen:
        names = ", ".join(repr(one.called) for one in free[:MOST_SHOWN])
        ways = [Choice("columns", f"{TARGET}={one.called}") for one in free]
        ways.insert(1, Choice("columns", f"ignore={free[0].called}", "if it is something else"))
        what = "readings without a target, and a column that may be the target"
        decisions.ask(table.path, what, *ways, found=names)
    return roles


def _may_be_place(table: Table, one: Column, readings: Array) -> bool:
    """Whether a column that nothing names may hold positions: numbers that differ, or one that the readings are near.

    In no other unit, and no row numbers.
    """
    name, unit = split_name(one.header)
    if (
        (unit is not None and unit.quantity not in ("length", "angle"))
        or is_known(name)
        or (name != one.header and unit is None)
    ):
        return False
    if name.endswith(("]", ")")):  # a unit that is none of length
        return False
    values = table.numbers(one.place)
    if not np.isfinite(values).all():
        return False
    if not np.ptp(values):
        return bool(np.abs(readings - values).max() < NEAR * abs(values[0]))
    return not (len(values) > 1 and (np.diff(values) == 1.0).all() and values[0] in (0.0, 1.0))


# what tells rows apart


def _check_kinds(table: Table, roles: Sequence[Column], layout: TableLayout, decisions: Decisions) -> None:
    """A column, or titles of blocks, by which rows are of different kinds: one recording is of one kind."""
    every = {one.removesuffix("=*").strip() for one in layout.rows if one.endswith("=*")}
    target = next((table.numbers(one.place) for one in roles if one.role == TARGET), None)
    for one in roles:
        if one.role not in (None, DROPPED) or one.place in _ignored(roles, layout.columns) or one.called in every:
            continue
        cells = _kinds_in(table, one)
        if cells is not None and not _names_targets(cells, target):
            _ask_rows(table, repr(one.header), sorted(set(cells)), one.called, decisions)
    asked = any(str(one.what).startswith(_KINDS_ASKED) for one in decisions.questions)
    if len(table.titles) > 1 and "title" not in every and not asked:
        _check_titles(table, roles, decisions)


def _check_titles(table: Table, roles: Sequence[Column], decisions: Decisions) -> None:
    """Lines above the blocks that are no runs and no directions say of what kind the rows below them are."""
    numbers, sizes = np.unique(table.block, return_counts=True)
    titles = [table.titles[n] for n in numbers.tolist()]
    labelled = all(parse_label(title) != LABEL for title in titles if title)
    known = any(one.role in (CYCLE, WAY, PLACEMENT) for one in roles)
    if len(set(titles)) > 1 and not labelled and sizes.min() > 1 and not known:
        _ask_rows(table, "the lines above the blocks", list(dict.fromkeys(filter(None, titles))), "title", decisions)


def _ignored(roles: Sequence[Column], chosen: Mapping[str, str]) -> set[int]:
    names = chosen.get("ignore", "").casefold().split("\n")
    return {one.place for one in roles if one.header.casefold() in names or f"#{one.place + 1}" in names}


def _kinds_in(table: Table, one: Column) -> list[str] | None:
    """The cells of a column that says of what kind each row is; None for another."""
    named = bool(says(words_of(one.header), "kind"))
    if says(words_of(one.name), "besides") or not (named or is_text(table, one.place)):
        return None
    cells: list[Cell] = table.cells(one.place)
    texts = [f"{cell:g}" if isinstance(cell, float) else str(cell).strip() for cell in cells]
    filled = {text for text in texts if text}
    remark = 2 * texts.count("") >= len(texts)
    verdict = {text.casefold() for text in filled} <= WORDS["verdict"]
    return None if len(filled) < 2 or len(filled) == len(texts) or remark or verdict else texts


def _names_targets(texts: Sequence[str], target: Array | None) -> bool:
    """Whether a text is a name of the target: each has its own."""
    if target is None:
        return False
    pairs = {(text, value) for text, value in zip(texts, target.tolist(), strict=True)}
    return len(pairs) == len({text for text, _ in pairs}) == len({value for _, value in pairs})


def _ask_rows(table: Table, where: str, texts: Sequence[str], name: str, decisions: Decisions) -> None:
    what = f"{_KINDS_ASKED}, by {where}"
    found = ", ".join(texts[:MOST_SHOWN]) + (f" and {len(texts) - MOST_SHOWN} more" if len(texts) > MOST_SHOWN else "")
    ways = [Choice("rows", text) for text in texts]
    ways.insert(1, Choice("rows", f"{name}=*", "for all of them"))
    decisions.ask(table.path, what, *ways, found=found)

"""Which face of a gauge every row of a table is of, and what follows: its direction of travel.

A face is touched from outside: a front towards +, a back towards -. So a column of two texts that tells fronts from
backs is the side of a block or the direction of travel, whatever its words, and either says the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.importing.axis.faces import faces_along
from stepgauge.importing.axis.long import Long
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.tables.cells import text_of
from stepgauge.importing.tables.columns import AXIS, VALUE_ROLES, Column, Role, read_columns
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.kinds import directions_in
from stepgauge.importing.tables.questions import Decisions, column_answer
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import WORDS, travel_of, words_of


def ways_into(face: NDArray[np.intp]) -> NDArray[np.int64]:
    """The direction in which faces, counted from 0, are touched: fronts towards +, backs towards -."""
    return np.where(face % 2 == 0, 1, -1)


def faces_as_targets(table: Table, roles: Sequence[Column], listed: Targets) -> list[Column]:
    """The columns, with the one that counts the faces as the target where none is named as it."""
    numbered = [one for one in roles if one.role is None and set(words_of(one.name)) & WORDS["face"]]
    if len(numbered) != 1 or any(one.role in (Role.TARGET, Role.DEVIATION, Role.CORRECTION) for one in roles):
        return list(roles)
    counted = listed.counted(table.numbers(numbered[0].place))
    return (
        list(roles)
        if counted is None
        else [replace(one, role=Role.TARGET) if one is numbered[0] else one for one in roles]
    )


def texts_of_fronts(table: Table, layout: TableLayout, listed: Targets, unit_mm: float) -> dict[int, str]:
    """By the place of every column of two texts that tells fronts from backs, its text of the fronts.

    Not where both are words for directions alone, which may contradict the faces.
    """
    roles = faces_as_targets(table, read_columns(table.headers, table.units, layout.columns, AXIS), listed)
    face = _rows_faces(table, roles, listed, unit_mm)
    if face is None or {Role.WAY, Role.IGNORE} & set(layout.columns):
        return {}
    found = {}
    for one in (one for one in roles if one.role in (None, Role.WAY) and one.unit is None):
        texts = np.array([text_of(cell).strip() for cell in table.cells(one.place)], object)
        two = directions_in(texts.tolist())
        fronts = {*texts[face % 2 == 0]}
        if two and len(fronts) == 1 and not fronts & {*texts[face % 2 == 1]} and not all(map(travel_of, two)):
            found[one.place] = str(next(iter(fronts)))
    return found


def _rows_faces(table: Table, roles: Sequence[Column], listed: Targets, unit_mm: float) -> NDArray[np.intp] | None:
    """Which face every row is of, from 0: by its nominal position, its number, or its only reading; None if unknown."""
    face = faces_along(table, listed, unit_mm)
    counts = [one for one in roles if one.role == Role.TARGET]
    if face is None and counts:
        face = listed.counted(table.numbers(counts[0].place))
    values = [one for one in roles if one.role in VALUE_ROLES]
    if face is not None or len(values) != 1:
        return face
    placed = next((one for one in roles if one.role == Role.PLACEMENT), None)
    cells = [] if placed is None else [text_of(cell) for cell in table.cells(placed.place)]
    placement = np.unique(cells, return_inverse=True)[1] if cells else np.zeros(len(table), np.int64)
    factor = unit_mm if values[0].unit is None else values[0].unit.factor
    try:
        return listed.nearest(table.numbers(values[0].place) * factor, placement, table.path)
    except InputError:
        return None


def check_ways(found: Long, face: NDArray[Any], table: Table, decisions: Decisions) -> None:
    """Asks where stated directions contradict the faces; not one that was told by hand."""
    stated, into, column = found.columns["way"], ways_into(face), found.way
    wrong = int((stated != into).sum())
    if not stated.all() or not wrong or (column is not None and column.forward):
        return
    if column is None:
        ways = [column_answer(Role.IGNORE, "title", "to have the faces say it")]
    else:
        texts = directions_in([text_of(cell).strip() for cell in table.cells(column.place)])
        ways = [column_answer(Role.WAY, f"{column.called}={text}", "if it is towards +") for text in texts]
        ways.append(column_answer(Role.IGNORE, column.called, "to have the faces say it"))
    what = "directions contradict the faces, of which fronts are touched towards + and backs towards −"
    decisions.ask(table.path, what, *ways, found=f"{wrong} of {len(into)} readings")
    decisions.settle()

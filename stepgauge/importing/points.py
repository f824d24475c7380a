"""Tables of probed points -> a log: x, y and z, directions, counts, times, temperatures, and what was recorded besides.

Lengths become mm, temperatures deg C, speeds mm/s, times s from the first row. Numeric columns that mean nothing to
stepgauge are kept as covariates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.axis.sensors import SENSORS
from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.axis.faces import check_measured, faces_along, header_answer
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.log_lines import unit_vectors
from stepgauge.importing.tables.clock import is_date
from stepgauge.importing.tables.columns import (
    AXIS,
    DIRECTIONS,
    NORMAL,
    OF_AXIS,
    OF_POINTS,
    POINTS,
    QUANTITY,
    VALUE_ROLES,
    Column,
    Role,
    axis_role,
    check_chosen,
    is_temperature,
    read_columns,
)
from stepgauge.importing.tables.forms import points_of_rows
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer
from stepgauge.importing.tables.read import TableLayout, choose_table, read_file, taken_columns
from stepgauge.importing.tables.rivals import MOST_OF_SPOT, one_of
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.importing.tables.values import beside, clock_of, finite, scaled
from stepgauge.importing.tables.vocabulary import WORDS
from stepgauge.importing.thermal import read_convention, said_lines
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION, comment_lines

_UNIT_LENGTH = 0.01
_SURFACE = {"surface": True, "tip centres": False}


@dataclass(frozen=True)
class _Points:
    """A table with its columns by role; ``free``: those of none; ``units``: by quantity, where a header states none."""

    table: Table
    columns: Mapping[str, Column]
    free: Sequence[Column]
    units: Mapping[str, Unit]

    def unit(self, column: Column) -> Unit:
        stated = column.unit is not None and column.unit.quantity != "none"
        return column.unit if stated and column.unit is not None else self.units[QUANTITY[column.role or ""]]

    def numbers(self, role: str) -> Array:
        """A column that must be numbers, in the unit of a recording."""
        column = self.columns[role]
        return scaled(finite(self.table, column), self.unit(column))

    def vector(self, roles: Sequence[str]) -> Array | None:
        """Three columns, ``(n, 3)``; None where they are not all there."""
        if not set(roles) <= set(self.columns):
            return None
        return np.column_stack(
            [self.numbers(role) if role in QUANTITY else finite(self.table, self.columns[role]) for role in roles]
        )


def read_points(
    given: Given,
    kind: str,
    layout: TableLayout,
    decisions: Decisions | None = None,
    listed: Targets | None = None,
) -> ProbeLog:
    """The points of a table; ``kind`` is ``csv`` or ``xlsx``, ``listed``: the faces of the gauge.

    :class:`InputError` names the row and column of: headers without x, y and z, text and gaps among the numbers, units
    of another quantity, decimal marks and dates that may mean two things.
    """
    source, decisions = read_source(given), decisions or Decisions()
    file = read_file(source, layout, decisions)
    file = replace(file, tables=[one if _names_points(one, layout) else points_of_rows(one) for one in file.tables])
    named = any(_names_points(one, layout) for one in file.tables)

    def fits(one: Table) -> bool:
        if named or listed is None:
            return _names_points(one, layout)
        return faces_along(one, listed, _unit_mm(layout)) is not None

    table = choose_table(file, fits, layout, source.name, decisions)
    columns = read_columns(table.headers, table.units, layout.columns, POINTS)
    decisions.columns = taken_columns(table, [(one.place, one.role, one.unit) for one in columns])
    _check(table, columns, layout, decisions, listed)
    points = _points(table, columns, layout)
    clock = clock_of(table, [one for one in columns if one.role == Role.TIME], layout.time_unit, decisions)
    decisions.settle()
    position = points.vector(POSITION)
    assert position is not None
    approach, words = _approach(points)
    lines = said_lines(source.decoded[0]) if kind == "csv" and source.frame is None else file.comments
    thermal, told = read_convention([*lines, *(f"{key}: {value}" for key, value in table.facts.items())])
    comments = thermal | comment_lines(file.comments)
    if clock is not None and clock.start is not None:
        comments.setdefault("measured_at", clock.start)
    found, kept, left_out = _further(points)
    return ProbeLog(
        source.name,
        "table" if kind == "csv" else "workbook",
        position,
        table.lines,
        approach=approach,
        time_s=None if clock is None else clock.elapsed_s,
        columns=found,
        comments=comments,
        surface=_SURFACE.get(comments.get("points", "")),
        dropped=file.beside,
        mapped=(
            *(*file.notes, *table.left_out, *_mapped(points, columns), *told, *words, *kept),
            *(*decisions.taken, *decisions.rejected),
        ),
        left_out=(*left_out, *(() if clock is None else clock.words)),
        degrees=tuple(one.header for one in columns if one.role is None and is_temperature(one)),
    )


def has_points(given: Given, layout: TableLayout) -> bool:
    """Whether a table names x, y and z, by itself, with constants, or by ``columns`` such as ``x_mm=HEADER``.

    One that compares them with nominal values, point by point, may be of one axis as well.
    """
    if set(layout.columns) & set(OF_AXIS):
        return False
    named = any(
        set(POSITION) <= _roles(columns) and not (_is_one_spot(one, columns) or _is_compared(columns))
        for one, columns in _first_tables(given, layout)
    )
    return named or (bool(layout.columns) and set(layout.columns) <= {*POSITION, *DIRECTIONS})


def names_faces(given: Given, layout: TableLayout, listed: Targets | None, read: bool = False) -> bool:
    """Whether a table says of its rows which faces they are, or where ``listed`` ones are, and has no x, y and z.

    ``read``: and names what was read there.
    """
    along = ((table, _roles(columns)) for table, columns in _first_tables(given, layout))
    along = ((table, roles) for table, roles in along if not set(POSITION) <= roles and (not read or _reads(table)))
    return any(
        "face" in roles or (listed is not None and faces_along(table, listed, _unit_mm(layout)) is not None)
        for table, roles in along
    )


def _reads(table: Table) -> bool:
    return any(one.role in VALUE_ROLES for one in read_columns(table.headers, table.units, {}, AXIS))


def _unit_mm(layout: TableLayout) -> float:
    unit = None if layout.unit is None else find_unit(layout.unit)
    return 1.0 if unit is None else unit.factor


def _first_tables(given: Given, layout: TableLayout) -> list[tuple[Table, list[Column]]]:
    """The tables at the beginning of a file and their columns by their names; none where it is no table."""
    try:
        tables = read_file(read_source(given).beginning, replace(layout, columns={}), Decisions()).tables
    except InputError:
        return []
    return [(one, read_columns(one.headers, one.units, {}, POINTS)) for one in tables]


def _roles(columns: Sequence[Column]) -> set[str | None]:
    return {one.role for one in columns}


def _names_points(table: Table, layout: TableLayout) -> bool:
    chosen = {name: header for name, header in layout.columns.items() if name in (*POSITION, *DIRECTIONS)}
    return set(POSITION) <= _roles(read_columns(table.headers, table.units, chosen, POINTS))


def _is_one_spot(table: Table, columns: Sequence[Column]) -> bool:
    """Whether x, y and z are those of one spot that was touched again and again: one of them differs, by little."""
    spans = [np.ptp(table.numbers(one.place)) for one in columns if one.role in POSITION]
    return sorted(bool(span > 0.0) for span in spans) == [False, False, True] and bool(max(spans) < MOST_OF_SPOT)


def _is_compared(columns: Sequence[Column]) -> bool:
    """Whether a table has nominal beside measured coordinates, and does not say of which faces."""
    targets = [one for one in columns if one.role is None and axis_role(one.name, one.unit) == Role.TARGET]
    return bool(targets) and "face" not in _roles(columns)


def _check(
    table: Table, columns: list[Column], layout: TableLayout, decisions: Decisions, listed: Targets | None
) -> None:
    """x, y and z are there, what was chosen too, every role once (a copy is the same column), units of its quantity."""
    check_chosen(columns, {role: one for role, one in layout.columns.items() if role in OF_POINTS}, table.path)
    if not set(POSITION) <= _roles(columns):
        _ask_points(table, columns, decisions, listed, _unit_mm(layout))
        decisions.settle()
    known = [one for one in columns if one.role not in (None, Role.DROPPED)]
    for role in dict.fromkeys(one.role for one in known):
        rivals = [one for one in known if one.role == role and not (role == Role.TIME and is_date(one.header))]
        if role is not None and len(rivals) > 1:
            one_of(table, role, rivals, decisions)
    for one in known:
        quantity = QUANTITY.get(one.role or "")
        if one.unit and one.unit.quantity not in (quantity, "none"):
            what, expected = f"column {one.header!r} cannot be {one.role}", f"a unit of {quantity}"
            expected = expected if quantity else "no unit"
            raise InputError(table.at(0), what, found=f"unit {one.unit.name}", expected=expected)


def _ask_points(
    table: Table, columns: Sequence[Column], decisions: Decisions, listed: Targets | None, unit_mm: float
) -> None:
    """Which columns are x, y and z, or whether it is a table of one axis."""
    names = ", ".join(one.header for one in columns if one.header)
    axis = QuestionAnswer("sensor", words="for one axis", suggestions=tuple(SENSORS))
    named = any(table.headers)
    if listed is not None:
        check_measured(table, listed)
    if any(one.role == "face" for one in columns) or (
        named and listed and faces_along(table, listed, unit_mm) is not None
    ):
        what = "positions of faces along the gauge, without x, y and z: one axis, or a gauge?"
        gauge = QuestionAnswer("placement", words="with the gauge, for the errors of its faces")
        faces = QuestionAnswer("sensor", "touch", "with the gauge, for one axis with the faces as targets")
        decisions.ask(table.path, what, gauge, faces, *_coordinates(columns), found=names)
    elif named:
        what = "no row names the columns x, y and z, as in X [mm];Y [mm];Z [mm]"
        decisions.ask(table.path, what, *_coordinates(columns), axis, found=names[:200])
    else:
        header = header_answer(table, POSITION, listed)
        decisions.ask(table.path, "no row names the columns x, y and z: numbers only", header, axis)


def _coordinates(columns: Sequence[Column]) -> list[QuestionAnswer]:
    missing = [role for role in POSITION if all(one.role != role for one in columns)]
    headers = tuple(one.header for one in columns if one.header)
    return (
        [QuestionAnswer("columns", f"{missing[0]}=HEADER", f"and so on for {', '.join(missing)}", headers)]
        if missing
        else []
    )


def _points(table: Table, columns: Sequence[Column], layout: TableLayout) -> _Points:
    stated = next(
        (unit for key, text in table.facts.items() if key in WORDS["unit"] and (unit := find_unit(text))), None
    )
    names = {"temperature": layout.temperature_unit, "time": "s", "speed": "mm/s", "length": layout.unit or "mm"}
    units = {quantity: unit for quantity, name in names.items() if (unit := find_unit(name)) is not None}
    if layout.unit is None and stated is not None:
        units["length"] = stated
    by_role: dict[str, Column] = {}
    for one in columns:
        if one.role not in (None, Role.DROPPED):
            by_role.setdefault(one.role, one)
    return _Points(table, by_role, [one for one in columns if one.role is None], units)


def _approach(points: _Points) -> tuple[Array | None, tuple[str, ...]]:
    """Unit approaches, from approaches or from normals."""
    for roles, sign, words in (
        (APPROACH, 1.0, "approaches as they are"),
        (NORMAL, -1.0, "approach = minus normal"),
    ):
        vector = points.vector(roles)
        if vector is None:
            continue
        size = np.linalg.norm(vector, axis=1)
        wrong = np.abs(size - 1.0) > _UNIT_LENGTH
        if wrong.any():
            row = int(wrong.argmax())
            found = f"length {size[row]:.4f}"
            raise InputError(points.table.at(row), "the direction is not a unit vector", found=found, expected="1")
        return sign * unit_vectors(vector) + 0.0, (words,)
    return None, ()


def _further(points: _Points) -> tuple[dict[str, Array], tuple[str, ...], tuple[str, ...]]:
    """Columns of a recording besides position, direction and time; covariates; what was kept and dropped.

    A column without any cell is none.
    """
    found: dict[str, Any] = {}
    for role in [*COUNTS, *OPTIONAL[2:]]:
        column = points.columns.get(role)
        if column is not None and any(cell != "" for cell in points.table.cells(column.place)):
            found[role] = _counts(points.table, column) if role in COUNTS else points.numbers(role)
    nameless = [
        one for one in points.free if not one.header and any(cell != "" for cell in points.table.cells(one.place))
    ]
    named = [one for one in points.free if one.header]
    kept, dropped = beside(points.table, named, (*found, *POSITION, *APPROACH, "time_s"))
    zero = [
        one for role, one in points.columns.items() if role in found and role in COUNTS and _counts_zero(points, one)
    ]
    words = [f"{one.header!r} counts from 0, and the recording from 1" for one in zero]
    words += [f"kept as covariates: {', '.join(kept)}"] if kept else []
    left_out = [f"dropped: columns {', '.join(dropped)} (not numbers in every row)"] if dropped else []
    left_out += [f"dropped: {len(nameless)} columns without a name"] if nameless else []
    return {**found, **kept}, tuple(words), tuple(left_out)


def _counts_zero(points: _Points, column: Column) -> bool:
    return bool(points.table.numbers(column.place).min(initial=1.0) == 0.0)


def _counts(table: Table, column: Column) -> NDArray[np.int64]:
    """A column that counts, from 1; one that counts from 0 has a 0."""
    values = table.numbers(column.place)
    values = values + 1.0 if values.min(initial=1.0) == 0.0 else values
    wrong = ~((values >= 1.0) & (values == np.floor(values)) & (values < 1e7))
    if wrong.any():
        row = int(wrong.argmax())
        found = repr(str(table.cells(column.place)[row]))
        what = f"column {column.header!r} is not a count"
        raise InputError(table.at(row), what, found=found, expected="a whole number from 0 or 1")
    return values.astype(np.int64)


def _mapped(points: _Points, columns: Sequence[Column]) -> list[str]:
    words = []
    for one in columns:
        if one.role in (None, Role.DROPPED) or one.header == one.role:
            continue
        unit = points.unit(one).name if one.role in QUANTITY else ""
        if one.role == "time_s" and not np.isfinite(points.table.numbers(one.place)).all():
            unit = "dates and times"
        words.append(f"{one.header} -> {one.role}{f' (from {unit})' if unit else ''}")
    same = [one.header for one in columns if one.role == one.header]
    return [
        *([f"mapped: {', '.join(words)}"] if words else []),
        *([f"taken as named: {', '.join(same)}"] if same else []),
    ]

"""Tables of probed points -> a log: x, y and z, directions, counts, times, temperatures, and what was recorded besides.

Lengths become mm, temperatures deg C, speeds mm/s, times s from the first row. Numeric columns that mean nothing to
stepgauge are kept as covariates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.log import ProbeLog, unit_vectors
from stepgauge.importing.tables.clock import is_date
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.names import (
    DIRECTIONS,
    NORMAL,
    QUANTITY,
    Column,
    check_columns,
    in_degrees,
    is_named,
    read_header,
)
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.read import TableLayout, choose_table, read_file, taken_columns
from stepgauge.importing.tables.rivals import MOST_OF_SPOT
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.importing.tables.values import beside, clock_of, finite, scaled
from stepgauge.importing.thermal import read_convention, said_lines
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION, comment_lines

Array = NDArray[np.float64]
_UNIT_LENGTH = 0.01


@dataclass(frozen=True)
class _Points:
    """A table with its columns; ``stated``: the unit of lengths that the file states once for all of them."""

    table: Table
    columns: list[Column]
    layout: TableLayout
    stated: Unit | None = None

    def column(self, target: str) -> Column | None:
        return next((column for column in self.columns if column.target == target), None)

    def texts(self, column: Column) -> list[Any]:
        return list(self.table.cells(column.place))

    def values(self, column: Column) -> Array:
        """Numbers of a column, NaN for what is none."""
        return self.table.numbers(column.place)


def read_points(given: Given, kind: str, layout: TableLayout, decisions: Decisions | None = None) -> ProbeLog:
    """The points of a table; ``kind`` is ``csv`` or ``xlsx``.

    :class:`InputError` names the row and column of: headers without x, y and z, text and gaps among the numbers, units
    of another quantity, decimal marks and dates that may mean two things.
    """
    source, decisions = read_source(given), decisions or Decisions()
    file = read_file(source, layout, decisions)
    table = choose_table(file, lambda one: _names_points(one, layout), layout, source.name, decisions)
    points = _points(table, layout, decisions)
    decisions.columns = taken_columns(table, [(one.place, one.target, one.unit) for one in points.columns])
    decisions.settle()
    position = _vector(points, POSITION)
    assert position is not None
    approach, words = _approach(points)
    time = points.column("time_s")
    date = _date(points)
    clock = None if time is None else clock_of(table, [one for one in (date, time) if one is not None])
    lines = said_lines(source.decoded[0]) if kind == "csv" and source.frame is None else file.comments
    thermal, told = read_convention([*lines, *(f"{key}: {value}" for key, value in table.facts.items())])
    comments = thermal | comment_lines(file.comments)
    start = None if clock is None else clock.start
    if start is not None:
        comments.setdefault("measured_at", start)
    columns, kept, left_out = _further(points, None if start is None else date)
    decisions.settle()
    return ProbeLog(
        source.name,
        "table" if kind == "csv" else "workbook",
        position,
        table.lines,
        approach=approach,
        time_s=None if clock is None else clock.elapsed_s,
        columns=columns,
        comments=comments,
        surface={"surface": True, "tip centres": False}.get(comments.get("points", "")),
        dropped=file.beside,
        mapped=(
            *file.notes,
            *table.left_out,
            *_mapped(points),
            *told,
            *words,
            *kept,
            *decisions.taken,
            *decisions.rejected,
        ),
        left_out=(*left_out, *(() if clock is None else clock.words)),
        degrees=tuple(one.header for one in points.columns if one.target is None and in_degrees(one)),
    )


def has_points(given: Given, layout: TableLayout) -> bool:
    """Whether a table names x, y and z, by itself, with constants, or by ``columns`` such as ``x_mm=HEADER``."""
    bare = replace(layout, columns={})
    try:
        tables = read_file(read_source(given), bare, Decisions()).tables
        named = any(_names_points(one, bare) and not _is_one_spot(one) for one in tables)
    except InputError:
        named = False
    return named or (bool(layout.columns) and set(layout.columns) <= {*POSITION, *DIRECTIONS})


def _names_points(table: Table, layout: TableLayout) -> bool:
    chosen = {name: header for name, header in layout.columns.items() if name in (*POSITION, *DIRECTIONS)}
    return set(POSITION) <= {one.target for one in read_header(table.headers, chosen)}


def _is_one_spot(table: Table) -> bool:
    """Whether x, y and z are those of one spot that was touched again and again: one of them differs, by little."""
    spans = [np.ptp(table.numbers(one.place)) for one in read_header(table.headers, {}) if one.target in POSITION]
    return sorted(bool(span > 0.0) for span in spans) == [False, False, True] and bool(max(spans) < MOST_OF_SPOT)


def _points(table: Table, layout: TableLayout, decisions: Decisions) -> _Points:
    """The columns of a table; questions where two may be the same quantity."""
    columns = [
        replace(one, unit=unit or one.unit)
        for one, unit in zip(read_header(table.headers, layout.columns), table.units, strict=True)
    ]
    unknown = [header for header in layout.columns.values() if not any(is_named(one, header) for one in columns)]
    best = ", ".join(header for header in table.headers if header)
    if unknown:
        raise InputError(table.path, f"there is no column {unknown[0]!r}", found=best[:200])
    if not set(POSITION) <= {one.target for one in columns}:
        raise _no_points(table, best)
    check_columns(columns, table.at(0), layout.columns, table.numbers, decisions)
    stated = next((unit for key in ("units", "unit", "einheit") if (unit := find_unit(table.facts.get(key, "")))), None)
    return _Points(table, columns, layout, stated)


def _no_points(table: Table, names: str) -> InputError:
    if any(one.target == "face" for one in read_header(table.headers, {})):
        what = "positions of faces along the gauge, without x, y and z: one axis, or a gauge?"
        words = '{} touch and {} for one axis with the faces as targets; or {} x_mm="HEADER", y_mm and z_mm'
        return InputError(table.path, what, found=names, expected=naming("sensor", "gauge", "columns", words=words))
    what, words = "no row names the columns x, y and z", 'X [mm];Y [mm];Z [mm], or {} x_mm="HEADER" for each'
    if not names:
        words = 'a header, or {} "x_mm,y_mm,z_mm", the names of all columns'
        expected = naming("header", "sensor", words=f"{words}, or of one axis {{}} laser (dial, ..)")
        return InputError(table.path, what, found="numbers only", expected=expected)
    expected = naming("columns", "sensor", words=f"{words}, or of one axis {{}} laser (dial, ..)")
    return InputError(table.path, what, found=names[:200], expected=expected)


def _unit(column: Column, points: _Points) -> Unit:
    """The unit of a column, or the one that holds where it states none."""
    if column.unit is not None and column.unit.quantity != "none":
        return column.unit
    quantity, layout = QUANTITY.get(column.target or "", ""), points.layout
    if quantity == "length" and layout.unit is None and points.stated is not None:
        return points.stated
    defaults = {
        "length": layout.unit or "mm",
        "temperature": layout.temperature_unit,
        "time": "s",
        "speed": "mm/s",
    }
    unit = find_unit(defaults.get(quantity, ""))
    assert unit is not None
    return unit


def _numbers(points: _Points, column: Column) -> Array:
    """A column that must be numbers, in the recording's unit."""
    return scaled(finite(points.table, column), _unit(column, points))


def _vector(points: _Points, names: Sequence[str]) -> Array | None:
    """Three columns, ``(n, 3)``; None where they are not all there."""
    columns = [points.column(name) for name in names]
    if any(column is None for column in columns):
        return None
    return np.column_stack([_numbers(points, column) for column in columns if column is not None])


def _approach(points: _Points) -> tuple[Array | None, tuple[str, ...]]:
    """Unit approaches, from approaches or from normals."""
    for names, sign, words in (
        (APPROACH, 1.0, "approaches as they are"),
        (NORMAL, -1.0, "approach = minus normal"),
    ):
        vector = _vector(points, names)
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


def _date(points: _Points) -> Column | None:
    """The column of dates beside one of times of day."""
    return next((one for one in points.columns if one.target is None and is_date(one.header)), None)


def _further(points: _Points, date: Column | None) -> tuple[dict[str, Array], tuple[str, ...], tuple[str, ...]]:
    """Columns of a recording besides position, direction, time and ``date``; covariates; what was kept and dropped.

    A column without any cell is none.
    """
    columns: dict[str, Any] = {}
    for name in [*COUNTS, *OPTIONAL[2:]]:
        column = points.column(name)
        if column is not None and any(cell != "" for cell in points.texts(column)):
            columns[name] = _counts(points, column) if name in COUNTS else _numbers(points, column)
    free = [one for one in points.columns if one.target is None and one is not date]
    nameless = [one for one in free if not one.header and any(cell != "" for cell in points.texts(one))]
    named = [one for one in free if one.header]
    kept, dropped = beside(points.table, named, (*columns, *POSITION, *APPROACH, "time_s"))
    words = (f"kept as covariates: {', '.join(kept)}",) if kept else ()
    left_out = [f"dropped: columns {', '.join(dropped)} (not numbers in every row)"] if dropped else []
    left_out += [f"dropped: {len(nameless)} columns without a name"] if nameless else []
    return {**columns, **kept}, words, tuple(left_out)


def _counts(points: _Points, column: Column) -> NDArray[np.int64]:
    values = points.values(column)
    wrong = ~((values >= 1.0) & (values == np.floor(values)) & (values < 1e7))
    if wrong.any():
        row = int(wrong.argmax())
        raise InputError(
            points.table.at(row),
            f"column {column.header!r} is not a count",
            found=repr(str(points.texts(column)[row])),
            expected="a whole number from 1",
        )
    return values.astype(np.int64)


def _mapped(points: _Points) -> list[str]:
    words = []
    for column in points.columns:
        if column.target is None or column.header == column.target:
            continue
        quantity = QUANTITY.get(column.target)
        unit = _unit(column, points).name if quantity else ""
        if quantity == "time" and not np.isfinite(points.values(column)).all():
            unit = "dates and times"
        words.append(f"{column.header} -> {column.target}{f' (from {unit})' if unit else ''}")
    same = [column.header for column in points.columns if column.target == column.header]
    return [
        *([f"mapped: {', '.join(words)}"] if words else []),
        *([f"taken as named: {', '.join(same)}"] if same else []),
    ]

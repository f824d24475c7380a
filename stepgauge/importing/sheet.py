"""Tables of probed points in any layout: text with any delimiter and decimal mark, Excel workbooks.

The header is the first row that names x, y and z; a row of units may follow it. Lengths become mm, temperatures deg C,
speeds mm/s, times s from the first row. Numeric columns that mean nothing to stepgauge are kept as covariates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.numerals import Numerals, looks_numeric
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.cells import Cell, Cells, is_units, mark_of, read_text_cells, read_workbook_cells, value_of
from stepgauge.importing.clock import Clock, is_date, joined, read_clock
from stepgauge.importing.headers import (
    DIRECTIONS,
    NORMAL,
    QUANTITY,
    Column,
    check_columns,
    in_degrees,
    joined_headers,
    read_header,
    with_units,
)
from stepgauge.importing.log import ProbeLog, unit_vectors
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION, comment_lines

Array = NDArray[np.float64]
_UNIT_LENGTH = 0.01
DECIMALS = 9
"""Of mm, deg C and mm/s that were turned from other units: a picometre, and no digits of the machine's arithmetic."""
HEADER_WITHIN = 200
"""Rows among which the header is looked for."""


@dataclass(frozen=True)
class TableLayout:
    """How a table is to be read, where it does not show by itself.

    ``delimiter``: the mark between columns; ``decimal``: ``"."`` or ``","``; ``sheet``: of a workbook; ``columns``:
    what of a recording (:data:`stepgauge.importing.headers.TARGETS`) stands under which header; ``length_unit``,
    ``temperature_unit``: of columns that state none (mm and deg C); ``constants``: columns that the table lacks, each
    with the text that holds in every row.
    """

    delimiter: str | None = None
    decimal: str | None = None
    sheet: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    length_unit: str = "mm"
    temperature_unit: str = "C"
    constants: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Table:
    """Header and rows of a table; ``decimal``: the decimal mark of numbers that are text."""

    cells: Cells
    columns: list[Column]
    rows: list[list[Cell]]
    lines: list[int]
    decimal: str

    def at(self, row: int) -> str:
        return f"{self.cells.path}:{self.lines[row]}"

    def column(self, target: str) -> Column | None:
        return next((column for column in self.columns if column.target == target), None)

    def texts(self, column: Column) -> list[Cell]:
        return [row[column.place] if column.place < len(row) else "" for row in self.rows]

    def values(self, column: Column) -> Array:
        """Numbers of a column, NaN for what is none."""
        numerals = Numerals(self.decimal)
        return np.array([value_of(cell, numerals) for cell in self.texts(column)])


def read_sheet(path: str | Path, kind: str, layout: TableLayout) -> ProbeLog:
    """The points of a table; ``kind`` is ``csv`` or ``xlsx``.

    :class:`InputError` names the row and column of: headers without x, y and z, text and gaps among the numbers, units
    of another quantity, decimal marks and dates that may mean two things.
    """
    cells = read_workbook_cells(path, layout.sheet) if kind == "xlsx" else read_text_cells(path, layout.delimiter)
    table = _make_table(cells, layout)
    position = _vector(table, POSITION, layout)
    assert position is not None
    approach, words = _approach(table, layout)
    time = table.column("time_s")
    clock = None if time is None else _clock(table, time)
    comments = comment_lines(cells.comments)
    start = None if clock is None else clock.start
    if start is not None:
        comments.setdefault("measured_at", start)
    columns, kept, left_out = _further(table, layout, None if start is None else _date(table))
    return ProbeLog(
        str(path),
        "table" if kind == "csv" else "workbook",
        position,
        np.array(table.lines),
        approach=approach,
        time_s=None if clock is None else clock.elapsed_s,
        columns=columns,
        comments=comments,
        surface={"surface": True, "tip centres": False}.get(comments.get("points", "")),
        dropped=cells.blank + len(cells.comments),
        mapped=(*table.cells.notes, *_mapped(table, layout), *words, *kept),
        left_out=(*left_out, *(() if clock is None else clock.words)),
        degrees=tuple(one.header for one in table.columns if one.target is None and in_degrees(one)),
    )


def has_points(
    path: str | Path, kind: str, sheet: str | None, constants: Mapping[str, str], columns: Sequence[str]
) -> bool:
    """Whether a table names x, y and z, by itself, with constants, or by ``columns`` such as ``x_mm=HEADER``."""
    chosen = {text.partition("=")[0].strip() for text in columns}
    try:
        cells = read_workbook_cells(path, sheet) if kind == "xlsx" else read_text_cells(path, None)
        return bool(_find_header(cells, TableLayout(constants=constants)))
    except InputError:
        return bool(chosen) and chosen <= {*POSITION, *DIRECTIONS}


def _make_table(cells: Cells, layout: TableLayout) -> _Table:
    at, size, columns = _find_header(cells, layout)
    if above := at - size + 1:
        cells = replace(cells, notes=(*cells.notes, f"dropped: {above} rows above the header"))
    body = list(zip(cells.rows, cells.lines, strict=True))[at + 1 :]
    if body and is_units(body[0][0]):
        columns = with_units(columns, [str(cell) for cell in body[0][0]])
        body = body[1:]
    where = f"{cells.path}:{cells.lines[at]}"
    check_columns(columns, where, layout.columns)
    if not body:
        raise InputError(where, "the table has a header but no rows")
    width = len(columns) - len(layout.constants)
    for row, line in body:
        if len(row) > width and any(cell != "" for cell in row[width:]):
            raise InputError(
                f"{cells.path}:{line}",
                "the row has more cells than the header (a decimal comma in a comma-separated table?)",
                found=len(row),
                expected=width,
            )
    rows = [[*row[:width], *[""] * (width - len(row)), *layout.constants.values()] for row, _ in body]
    texts = [cell for row in rows for cell in row if isinstance(cell, str) and cell]
    return _Table(cells, columns, rows, [line for _, line in body], layout.decimal or mark_of(cells.path, texts))


def _find_header(cells: Cells, layout: TableLayout) -> tuple[int, int, list[Column]]:
    """The first row that names x, y and z, how many rows the header has with one of names above it, and its columns."""
    best: list[str] = []
    for at, row in enumerate(cells.rows[:HEADER_WITHIN]):
        names = [cell if isinstance(cell, str) else "" for cell in row]
        upper = _upper(cells.rows[at - 1], names) if at else []
        joined = read_header([*joined_headers(upper, names), *layout.constants], layout.columns) if upper else []
        if {*POSITION, *layout.columns} <= {column.target for column in joined}:
            return at, 2, joined
        columns = read_header([*names, *layout.constants], layout.columns)
        if set(POSITION) <= {column.target for column in columns}:
            return at, 1, columns
        if sum(bool(name) and not looks_numeric(name) for name in names) > len(best):
            best = [name for name in names if name]
    unknown = [header for header in layout.columns.values() if best and header not in best]
    if unknown:
        raise InputError(cells.path, f"there is no column {unknown[0]!r}", found=", ".join(best)[:200])
    raise InputError(
        cells.path,
        "no row names the columns x, y and z",
        found=", ".join(best)[:200] or "numbers only",
        expected=naming(
            "columns",
            "sensor",
            words='X [mm];Y [mm];Z [mm], or {} x_mm="HEADER" for each, or of one axis {} laser (dial, ..)',
        ),
    )


def _upper(row: Sequence[Cell], names: Sequence[str]) -> list[str]:
    """The texts of a row above a header, where it may name what that leaves without a name or alike; else empty."""
    texts = [cell if isinstance(cell, str) else "" for cell in row[: len(names)]]
    named = [name for name in names if name]
    fills = len(set(named)) < len(named)
    fills |= any(text and (not name or find_unit(name.strip("[]()"))) for text, name in zip(texts, names, strict=False))
    numbers = any(not isinstance(cell, str) or looks_numeric(cell) for cell in row)
    return texts if fills and len({text for text in texts if text}) > 1 and not numbers else []


def _unit(column: Column, layout: TableLayout) -> Unit:
    """The unit of a column, or the one that holds where it states none."""
    if column.unit is not None and column.unit.quantity != "none":
        return column.unit
    defaults = {"length": layout.length_unit, "temperature": layout.temperature_unit, "time": "s", "speed": "mm/s"}
    unit = find_unit(defaults.get(QUANTITY.get(column.target or "", ""), ""))
    assert unit is not None
    return unit


def _numbers(table: _Table, column: Column, layout: TableLayout) -> Array:
    """A column that must be numbers, in the recording's unit."""
    values = table.values(column)
    wrong = ~np.isfinite(values)
    if wrong.any():
        row = int(wrong.argmax())
        cell = table.texts(column)[row]
        raise InputError(
            table.at(row),
            f"column {column.header!r} is not a number",
            found="nothing" if cell == "" else repr(cell if isinstance(cell, str) else str(cell)),
            expected=f"a number with decimal {'comma' if table.decimal == ',' else 'point'}",
        )
    unit = _unit(column, layout)
    if unit.factor == 1.0 and unit.offset == 0.0:
        return values
    return np.round(values * unit.factor + unit.offset, DECIMALS)


def _vector(table: _Table, names: Sequence[str], layout: TableLayout) -> Array | None:
    """Three columns, ``(n, 3)``; None where they are not all there."""
    columns = [table.column(name) for name in names]
    if any(column is None for column in columns):
        return None
    return np.column_stack([_numbers(table, column, layout) for column in columns if column is not None])


def _approach(table: _Table, layout: TableLayout) -> tuple[Array | None, tuple[str, ...]]:
    """Unit approaches, from approaches or from normals."""
    for names, sign, words in (
        (APPROACH, 1.0, "approaches as they are"),
        (NORMAL, -1.0, "approach = minus normal"),
    ):
        vector = _vector(table, names, layout)
        if vector is None:
            continue
        size = np.linalg.norm(vector, axis=1)
        wrong = np.abs(size - 1.0) > _UNIT_LENGTH
        if wrong.any():
            row = int(wrong.argmax())
            raise InputError(
                table.at(row), "the direction is not a unit vector", found=f"length {size[row]:.4f}", expected="1"
            )
        return sign * unit_vectors(vector) + 0.0, (words,)
    return None, ()


def _clock(table: _Table, column: Column) -> Clock:
    """Seconds: numbers in the column's unit, or the time since the first row where they are dates or times of day."""
    values = table.values(column)
    if np.isfinite(values).all():
        return Clock(values * (column.unit.factor if column.unit else 1.0), None, ())
    texts, date = table.texts(column), _date(table)
    if date is not None:
        with suppress(InputError):  # what is no date is left out, and said to be
            return read_clock(joined(table.texts(date), texts), table.at, date.header)
    return read_clock(texts, table.at, column.header)


def _date(table: _Table) -> Column | None:
    """The column of dates beside one of times of day."""
    return next((one for one in table.columns if one.target is None and is_date(one.header)), None)


def _further(
    table: _Table, layout: TableLayout, date: Column | None
) -> tuple[dict[str, Array], tuple[str, ...], tuple[str, ...]]:
    """Columns of a recording besides position, direction, time and ``date``; covariates; what was kept and dropped."""
    columns: dict[str, Any] = {}
    kept, dropped, nameless = [], [], 0
    for name in [*COUNTS, *OPTIONAL[2:]]:
        column = table.column(name)
        if column is not None and any(cell != "" for cell in table.texts(column)):
            columns[name] = _counts(table, column) if name in COUNTS else _numbers(table, column, layout)
    for column in table.columns:
        if column.target is not None or column is date:
            continue
        if not column.header:
            nameless += any(cell != "" for cell in table.texts(column))
            continue
        values = table.values(column)
        name = column.header.replace(",", " ").replace('"', " ").strip()
        if np.isfinite(values).all() and name not in (*columns, *POSITION, *APPROACH, "time_s"):
            columns[name] = values
            kept.append(name)
        else:
            dropped.append(column.header)
    words = (f"kept as covariates: {', '.join(kept)}",) if kept else ()
    left_out = [f"dropped: columns {', '.join(dropped)} (not numbers in every row)"] if dropped else []
    left_out += [f"dropped: {nameless} columns without a name"] if nameless else []
    return columns, words, tuple(left_out)


def _counts(table: _Table, column: Column) -> NDArray[np.int64]:
    values = table.values(column)
    wrong = ~((values >= 1.0) & (values == np.floor(values)) & (values < 1e7))
    if wrong.any():
        row = int(wrong.argmax())
        raise InputError(
            table.at(row),
            f"column {column.header!r} is not a count",
            found=repr(str(table.texts(column)[row])),
            expected="a whole number from 1",
        )
    return values.astype(np.int64)


def _mapped(table: _Table, layout: TableLayout) -> list[str]:
    words = []
    for column in table.columns:
        if column.target is None or column.header == column.target:
            continue
        quantity = QUANTITY.get(column.target)
        unit = _unit(column, layout).name if quantity else ""
        if quantity == "time" and not np.isfinite(table.values(column)).all():
            unit = "dates and times"
        words.append(f"{column.header} -> {column.target}{f' (from {unit})' if unit else ''}")
    decimal = "comma" if table.decimal == "," else "point"
    same = [column.header for column in table.columns if column.target == column.header]
    return [
        f"decimal {decimal}",
        *([f"mapped: {', '.join(words)}"] if words else []),
        *([f"taken as named: {', '.join(same)}"] if same else []),
    ]

"""A file, an open file or a DataFrame -> the tables in it, as its layout says and as it shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from stepgauge.errors import InputError, at_row, naming, reading
from stepgauge.files.units import Unit
from stepgauge.importing.tables.cells import Cell, Cells, read_text_cells, text_of
from stepgauge.importing.tables.console import console_cells
from stepgauge.importing.tables.forms import arrange_columns
from stepgauge.importing.tables.grid import Table, find_tables
from stepgauge.importing.tables.header import split_names
from stepgauge.importing.tables.laserfile import is_laser_file, read_laser_file
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, TakenColumn
from stepgauge.importing.tables.records import frame_cells, is_json, read_json_cells
from stepgauge.importing.tables.source import Source
from stepgauge.importing.tables.workbook import read_workbook_cells

MOST_PREVIEWED = 20
"""Cells of a column that show what is in it."""


DECIMALS = {"point": ".", "comma": ","}
"""Decimal marks by their names."""


@dataclass(frozen=True)
class TableLayout:
    """How a table is to be read, where it does not show by itself.

    ``delimiter``: the mark between columns; ``decimal``: ``"."`` or ``","``; ``sheet``: of a workbook; ``columns``:
    headers by what stands under them (:data:`stepgauge.importing.tables.columns.ROLES`), or ``#3`` for the third
    column; ``unit``, ``temperature_unit``: of columns of points that state none (mm and deg C); ``time_unit``: of
    numbers that count time and state none; ``constants``: columns that the table
    lacks, each with the text that holds in every row; ``header``: names of all columns in place of those of the file;
    ``table``: the number of the table in a file of several; ``rows``: texts (``TEXT``, or ``HEADER=TEXT``) in columns
    that tell rows apart, by which they are chosen.
    """

    delimiter: str | None = None
    decimal: str | None = None
    sheet: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    unit: str | None = None
    temperature_unit: str = "C"
    time_unit: str | None = None
    constants: Mapping[str, str] = field(default_factory=dict)
    header: str | None = None
    table: int | None = None
    rows: Sequence[str] = ()


@dataclass(frozen=True)
class File:
    """The tables of a file, the comments beside them, how many lines are blank or comments, and how it was read."""

    tables: list[Table]
    comments: Sequence[str]
    beside: int
    notes: tuple[str, ...]


def read_file(source: Source, layout: TableLayout, decisions: Decisions) -> File:
    """All tables of a file; :class:`InputError` where there is none, and for what no table is."""
    with reading(source.name, "table"):
        return _read_file(source, layout, decisions)


def _read_file(source: Source, layout: TableLayout, decisions: Decisions) -> File:
    if source.frame is None and source.data[:2] != b"PK" and is_laser_file(source.decoded[0]):
        table = read_laser_file(source, decisions)
        return File([table], (), 0, ("file of laser software with targets and deviations",))
    cells = arrange_columns(_cells(source, layout, decisions))
    tables = find_tables(cells, layout.decimal, layout.header, decisions)
    tables = [one.add_constants(layout.constants) for one in tables]
    mark = f"decimal {'comma' if tables[0].decimal == ',' else 'point'}"
    return File(tables, cells.comments, cells.blank + len(cells.comments), (*cells.notes, mark))


def _cells(source: Source, layout: TableLayout, decisions: Decisions) -> Cells:
    if source.frame is not None:
        return frame_cells(source)
    if source.is_workbook or source.data[:2] == b"PK":
        return read_workbook_cells(source, layout.sheet)
    if is_json(source.decoded[0]):
        return read_json_cells(source)
    columns = None if layout.header is None else len(split_names(layout.header))
    return console_cells(source) or read_text_cells(source, layout.delimiter, decisions, columns)


def choose_table(
    file: File, usable: Callable[[Table], bool], layout: TableLayout, path: str, decisions: Decisions
) -> Table:
    """The table that is asked for, or the only one with what is needed; several are a question."""
    ordered = sorted(file.tables, key=lambda one: int(one.lines[0]))
    if layout.table is not None:
        if not 1 <= layout.table <= len(ordered):
            raise InputError(naming("table"), "there is no such table", found=layout.table, expected=_listed(ordered))
        return _kept(ordered[layout.table - 1], layout.rows)
    fit = [one for one in file.tables if usable(one)]
    if len(fit) > 1:
        ways = [
            QuestionAnswer("table", str(n), f"({len(one)} rows from line {one.lines[0]})")
            for n, one in enumerate(ordered, 1)
            if one in fit
        ]
        decisions.ask(path, "the file has several tables", *ways)
    chosen = fit[0] if fit else file.tables[0]
    for one in file.tables:
        if one is not chosen:
            decisions.reject(f"the table at {one.at(0)}", "it lacks the columns" if one not in fit else "several")
    return _kept(chosen, layout.rows)


def only_table(source: Source, layout: TableLayout = TableLayout()) -> Table:
    """The table of a file, for commands that ask nothing.

    :class:`InputError` for what the file leaves open, for a second table, and for rows of numbers that are none of the
    table: nothing that might change a result is left out unseen.
    """
    decisions = Decisions()
    file = read_file(source, layout, decisions)
    decisions.settle()
    table = file.tables[0]
    others = [one.at(0) for one in file.tables[1:]] + [at_row(source.name, line) for line in table.beside]
    if others:
        expected = "one table in the file, whose rows all have its columns"
        raise InputError(others[0], "a row of numbers is none of the table", found=f"{len(others)}", expected=expected)
    return table


def _listed(tables: Sequence[Table]) -> str:
    return ", ".join(f"{n} ({len(one)} rows from line {one.lines[0]})" for n, one in enumerate(tables, 1))


def _kept(table: Table, chosen: Sequence[str]) -> Table:
    """The rows with a text in the column that is named, else in any; or in the title of their block."""
    for given in chosen:
        if given.endswith("=*"):
            continue
        header, equals, text = given.partition("=")
        places = [place for place, one in enumerate(table.headers) if equals and one.strip() == header.strip()]
        text = text if places or (equals and header.strip() == "title") else given
        keep = np.array([table.titles[n] == text.strip() for n in table.block])
        for place in places or range(len(table.headers)):
            keep |= np.array([_same(cell, text) for cell in table.cells(place)])
        if keep.any():
            table = table.only(keep)
        elif len(table) > 1:
            known = ", ".join(one for one in table.headers if one)
            raise InputError(naming("rows"), f"no row has {text!r}", found=f"columns {known}", expected="a cell of it")
    return table


def taken_columns(table: Table, columns: Iterable[tuple[int, str | None, Unit | None]]) -> list[TakenColumn]:
    """What the columns of a table were taken for: place, role (None: recorded besides) and unit of each.

    Of those without a role a recording keeps what has a name and is a number in every row
    (:func:`stepgauge.importing.tables.values.beside`).
    """
    return [
        TakenColumn(
            place + 1,
            table.headers[place],
            role or ("covariate" if table.headers[place] and is_numeric(table, place) else "dropped"),
            None if unit is None or not unit.name else unit.name,
            tuple(text_of(cell) for cell in table.first_cells(place, MOST_PREVIEWED)),
        )
        for place, role, unit in columns
    ]


def is_numeric(table: Table, place: int) -> bool:
    """Whether a column is a number in every row."""
    return bool(np.isfinite(table.numbers(place)).all())


def _same(cell: Cell, text: str) -> bool:
    return text_of(cell).strip() == text.strip()

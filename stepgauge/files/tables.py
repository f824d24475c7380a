"""CSV tables of our own kinds, checked cell by cell so that an error can name the row and the column.

Tables of any layout, as people hand them over, are read by :mod:`stepgauge.importing.tables`: one whose header is not
ours falls through to it.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.errors import InputError, at_row, reading
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.files.text import GivenTable, is_there, read_bytes, read_text, write_text

if TYPE_CHECKING:
    import pandas as pd

LOOKED_AT = 65_536
"""Bytes by which a table is known to be one of ours."""


@dataclass(frozen=True)
class Rows:
    """A CSV table as text, with the line of the file each row came from."""

    path: str
    header: list[str]
    cells: list[list[str]]
    lines: list[int]

    def at(self, row: int) -> str:
        """``file:line`` of row ``row``, counted from 0."""
        return at_row(self.path, self.lines[row])

    def only(self, names: Sequence[str]) -> Rows:
        """The table with some of its columns."""
        places = [self.header.index(name) for name in names]
        return Rows(self.path, list(names), [[row[place] for place in places] for row in self.cells], self.lines)

    def numbers(self, names: Sequence[str]) -> Array:
        """The named columns as finite numbers, (rows, columns); :class:`InputError` names the cell."""
        places = [self.header.index(name) for name in names]
        return np.array([[self._number(row, place) for place in places] for row in range(len(self.cells))])

    def _number(self, row: int, place: int) -> float:
        value = number(self.cells[row][place])
        if not math.isfinite(value):
            raise InputError(
                self.at(row),
                f"column {self.header[place]} is wrong",
                found=repr(self.cells[row][place]),
                expected="a finite number",
            )
        return value


@dataclass(frozen=True)
class CsvTable:
    """Columns of numbers with the line of the file each row came from."""

    path: str
    columns: Mapping[str, Array]
    lines: Sequence[int]

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def at(self, row: int) -> str:
        """``file:line`` of row ``row`` (counted from 0)."""
        return at_row(self.path, self.lines[row])

    def rising(self, name: str) -> Array:
        """A column whose values rise from row to row; :class:`InputError` names the row that does not."""
        values = self.columns[name]
        wrong = np.flatnonzero(np.diff(values) <= 0)
        if wrong.size:
            row = int(wrong[0]) + 1
            raise InputError(self.at(row), f"{name} must rise from row to row", found=f"{values[row]:g}")
        return values


def flat_frame(frame: pd.DataFrame) -> pd.DataFrame:
    """A DataFrame with one level of columns: what is named, of the index or of several levels of columns, is a column.

    Of levels without a name those count that differ from column to column; values whose levels all have names are the
    column ``value``.
    """
    if frame.columns.nlevels > 1:
        own = [one for one in frame.columns if sum(map(bool, map(str, one))) == 1]  # of an index that was reset
        frame = frame.set_index(own).rename_axis(["".join(map(str, one)) for one in own]) if own else frame
        named = [place for place, name in enumerate(frame.columns.names) if name is not None]
        if named:
            tall: Any = frame.stack(named, future_stack=True)
            frame = (tall.to_frame("value") if tall.ndim == 1 else tall).dropna(how="all")
        else:
            levels = [frame.columns.get_level_values(place) for place in range(frame.columns.nlevels)]
            alike: list[Any] = [place for place, level in enumerate(levels) if level.nunique() == 1]
            frame = frame.droplevel(alike[: len(levels) - 1], axis=1)
    return frame.reset_index() if any(name is not None for name in frame.index.names) else frame


def given_table(given: Any) -> Any:
    """A DataFrame, or a result that is a table (``is_table``), as its CSV file would be read; anything else as it is.

    ``attrs`` of a DataFrame are the comments of the file, and an index with a name is a column.
    """
    found = given.to_frame() if getattr(given, "is_table", False) else given
    if not (hasattr(found, "iloc") and hasattr(found, "columns")):
        return given
    comments = "".join(f"# {key}: {value}\n" for key, value in found.attrs.items())
    text = comments + flat_frame(found).to_csv(index=False)
    return GivenTable(type(given).__name__, text.encode(), found)


def read_rows(
    path: str | Path, required: Sequence[str], others: bool = True, plain: Mapping[str, str] = MappingProxyType({})
) -> Rows:
    """A CSV table with at least the ``required`` columns, in any order; ``#`` lines are comments.

    One that is not UTF-8 with commas, or names no column as ours do, is read as a table of any make, its columns by
    the words and units of their headers; ``plain``: the units, by quantity, in which columns are wanted whose names
    have none. ``others``: whether there may be further columns. :class:`InputError` for missing, repeated or unknown
    columns, rows of another length (decimal commas, cut files), rows of numbers beside the table, and tables without
    rows.
    """
    try:
        return _read_own(path, required, others)
    except InputError as error:
        if not (required and is_there(path) and is_foreign(path, required)):
            raise
        from stepgauge.importing.tables.fixed_columns import foreign_rows  # which reads tables of any make

        try:
            found = foreign_rows(path, required, plain)
        except InputError as why:
            raise (error if "is missing" in why.what else why) from None
        return found if others else found.only(required)


def is_foreign(path: str | Path, required: Sequence[str]) -> str:
    """In what a table is none of ours: its ``encoding``, its ``delimiter``, its ``names`` (one of ours is missing)."""
    data = read_bytes(path)[:LOOKED_AT]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if error.start < len(data) - 4 or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return "encoding"
        text = data[: error.start].decode("utf-8-sig")
    header = next((line for line in text.splitlines() if line.strip() and line[0] != "#"), "")
    if any(mark in header for mark in ";\t|"):
        return "delimiter"
    return "" if not header or set(required) <= {cell.strip() for cell in header.split(",")} else "names"


def _read_own(path: str | Path, required: Sequence[str], others: bool) -> Rows:
    numbered = enumerate(read_text(path).split("\n"), 1)
    lines = [(n, line) for n, line in numbered if line.strip() and line[0] != "#"]
    if not lines:
        raise InputError(path, "the table is empty", expected="a header " + ",".join(required))
    with reading(path, "table"):
        records = [(n, [cell.strip() for cell in next(csv.reader([line]))]) for n, line in lines]
    (at, header), body = records[0], records[1:]
    given = isinstance(path, GivenTable)  # whose rows count from 0
    _check_header(str(path) if given else f"{path}:{at}", header, required, others)
    for n, cells in body:
        if len(cells) != len(header):
            why = "a decimal comma?" if len(cells) > len(header) else "cut short?"
            raise InputError(
                f"{path}:{n}",
                f"the row has another number of cells ({why})",
                found=len(cells),
                expected=f"{len(header)}: {','.join(header)}",
            )
    if not body:
        raise InputError(path, "the table has a header but no rows")
    return Rows(
        path if isinstance(path, str) else str(path),
        header,
        [cells for _, cells in body],
        [n - (at + 1) * given for n, _ in body],
    )


def read_numbers(path: str | Path, columns: Sequence[str], plain: Mapping[str, str] = MappingProxyType({})) -> CsvTable:
    """A CSV file with exactly these columns (in any order), all of them finite numbers; as :func:`read_rows`."""
    rows = read_rows(path, columns, others=False, plain=plain)
    values = rows.numbers(columns)
    return CsvTable(str(path), {name: values[:, i] for i, name in enumerate(columns)}, rows.lines)


def write_table(path: str | Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """A CSV table; floats are written with as many digits as they need to be read back the same."""
    plain = [[float(cell) if isinstance(cell, np.floating) else cell for cell in row] for row in rows]
    write_text(path, csv_text(header, plain))


def csv_text(header: Sequence[str], rows: Iterable[Sequence[object]], delimiter: str = ",") -> str:
    """A table as the text of a CSV file; cells that need it are quoted."""
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def result_cell(value: object, digits: int = 9) -> str:
    """A cell of a result: floats to so many significant digits, what is undefined (None) empty."""
    return "" if value is None else f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _check_header(where: str, header: list[str], required: Sequence[str], others: bool) -> None:
    if len(header) == 1 and any(mark in header[0] for mark in ";\t"):
        raise InputError(where, "columns are not separated by commas", found=repr(header[0]))
    for names, what in (
        ([name for name in required if name not in header], "missing"),
        ([name for name in header if name not in required and not others], "unknown"),
        ([name for name in header if name and header.count(name) > 1], "there twice"),
    ):
        if names:
            unpaired = set(header) - set(required) if what == "missing" else set(required) - set(header)
            near = difflib.get_close_matches(names[0], sorted(unpaired), n=1, cutoff=0.7)
            hint = f" ({near[0]!r} is {'there' if what == 'missing' else 'missing'})" if near else ""
            said = f"column {names[0]} is {what}{hint}"
            expected = "every column once" if what == "there twice" else ",".join(required)
            raise InputError(where, said, found=",".join(header), expected=expected)

"""Where the numbers stand in a table of any make: what is above them, between them and below them.

The rows of numbers are those of the kind of cells that is most frequent. Directly above stands the header, of one row
or several, with or without a row of units; further above a preamble. Lines between blocks of numbers name the run that
follows; what is below the last number (means, limits) is left out.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.numerals import Numerals, looks_numeric
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.cells import Cell, Cells, is_units, mark_of, value_of

Array = NDArray[np.float64]
MOST_HEADERS = 4
"""Rows above the numbers that may be a header."""
FEWEST_ROWS = 2
FEW_SLIPS = 0.02
"""Share of the cells of a column of numbers that may be text by mistake, one in fifty; one cell always may.

It decides only how a cell is told that is no number: as a slip, with its row, and the import is refused; or, among more
of its kind, as a name, and the column is left out. No reading comes out otherwise.
"""


@dataclass(frozen=True)
class Grid:
    """Header and rows of numbers.

    ``headers``, ``units``: by column; ``rows``: the cells; ``lines``: row of the file of each; ``titles``: the line
    above the block that a row is in, empty for the first; ``decimal``: the decimal mark of numbers that are text;
    ``left_out``: what of the file was not used, in words.
    """

    path: str
    headers: list[str]
    units: list[Unit | None]
    rows: list[list[Cell]]
    lines: list[int]
    titles: list[str]
    decimal: str
    left_out: tuple[str, ...] = ()

    def at(self, row: int) -> str:
        """``file:line`` of a row (counted from 0)."""
        return f"{self.path}:{self.lines[row]}"

    def cells(self, place: int) -> list[Cell]:
        """The cells of a column."""
        return [row[place] if place < len(row) else "" for row in self.rows]

    def numbers(self, place: int) -> Array:
        """The numbers of a column, NaN for what is none."""
        numerals = Numerals(self.decimal)
        return np.array([value_of(cell, numerals) for cell in self.cells(place)])

    def with_constants(self, constants: Mapping[str, str]) -> Grid:
        """The table with further columns that are the same in every row."""
        rows = [[*row, *[""] * (len(self.headers) - len(row)), *constants.values()] for row in self.rows]
        headers, units = [*self.headers, *constants], [*self.units, *[None] * len(constants)]
        return replace(self, rows=rows, headers=headers, units=units)


def find_grid(cells: Cells, decimal: str | None, header: str | None = None) -> Grid:
    """The numbers of a table; ``header``: names of the columns in place of those of the file.

    :class:`InputError` where there are no numbers, a number is missing among others, or nothing names the columns.
    """
    kind = _frequent_kind(cells)
    body = [n for n, row in enumerate(cells.rows) if _fits(row, kind)]
    if not body:
        raise _no_table(cells)
    first, last = body[0], body[-1]
    own, unit_row, above = ([], [], first) if header else _header(cells, first, len(kind))
    headers = _split_header(header) if header else own or _commented(cells, len(kind))
    titles, title, inside = [], "", set(body)
    for n in range(first, last + 1):
        if n in inside:
            titles.append(title)
        else:
            title = _title(cells, n, own, kind)
    found = [cells.rows[n] for n in body]
    _check_header(cells, headers, found, cells.lines[first])
    texts = [cell for row in found for cell in row if isinstance(cell, str) and cell]
    mark = decimal or mark_of(cells.path, texts)
    units = [find_unit(text.strip("[]()")) if text else None for text in unit_row] + [None] * len(headers)
    below = len(cells.rows) - last - 1
    said = [f"{n} rows {where} the table" for n, where in ((above, "above"), (below, "below")) if n]
    left_out = (f"dropped: {', '.join(said)}",) if said else ()
    rows, lines = [list(row) for row in found], [cells.lines[n] for n in body]
    return Grid(cells.path, headers, units[: len(headers)], rows, lines, titles, mark, left_out)


def _no_table(cells: Cells) -> InputError:
    return InputError(cells.path, "no table of numbers is found", expected="a row of numbers per reading")


def _is_number(cell: Cell) -> bool:
    return not isinstance(cell, str) or looks_numeric(cell)


def _kind(row: Sequence[Cell]) -> str:
    """``n`` for a number or a time, ``t`` for text, ``e`` for nothing, cell by cell."""
    return "".join("e" if cell == "" else "n" if _is_number(cell) else "t" for cell in row)


def _frequent_kind(cells: Cells) -> str:
    kinds = [_kind(row).rstrip("e") for row in cells.rows]
    counted = Counter(kind for kind in kinds if 2 * kind.count("n") >= len(kind.replace("e", "")) > 0)
    if not counted or max(counted.values()) < FEWEST_ROWS:
        raise _no_table(cells)
    best = max(counted.items(), key=lambda one: (one[1] * one[0].count("n"), one[1]))[0]
    rows = [kind for kind in kinds if len(kind) == len(best) and kind in counted]
    return "".join(_common("".join(kind[place] for kind in rows)) for place in range(len(best)))


def _common(letters: str) -> str:
    """``n`` for a column of numbers, in which a few cells may be slips; else ``t``: names, or names and numbers.

    Text below the last number is that of means and limits.
    """
    above = letters[: letters.rfind("n") + 1]
    return "n" if above and above.count("t") <= max(FEW_SLIPS * len(above), 1) else "t"


def _fits(row: Sequence[Cell], kind: str) -> bool:
    """Whether a row has numbers where the table has them, or nothing."""
    own = _kind(row).rstrip("e")
    if not own or len(own) > len(kind) or 2 * own.count("n") < kind.count("n"):
        return False
    return all(mine in ("n", "e") for mine, his in zip(own, kind, strict=False) if his == "n") and "n" in own


def _header(cells: Cells, first: int, width: int) -> tuple[list[str], list[str], int]:
    """Names, the row of units, and how many rows stand above both."""
    at, units = first - 1, list[str]()
    if at >= 0 and is_units(cells.rows[at]):
        units, at = [str(cell) for cell in cells.rows[at]], at - 1
    if at < 0 or not _may_name(cells.rows[at], width):
        return [], units, at + 1
    names = _texts(cells.rows[at], width)
    for _ in range(MOST_HEADERS):
        if at == 0 or (len(set(names)) == len(names) and "" not in names):
            break
        upper = _filled(_texts(cells.rows[at - 1], width))
        if len({name for name in upper if name}) < 2 or not _may_name(cells.rows[at - 1], 2):
            break
        names, at = [f"{a} {b}".strip() for a, b in zip(upper, names, strict=True)], at - 1
    return names, units, at


def _may_name(row: Sequence[Cell], width: int) -> bool:
    """Whether a row may name columns: as many cells as the table, and not numbers alone."""
    there = [cell for cell in row if cell != ""]
    return len(there) >= max(width / 2.0, 1.0) and any(isinstance(c, str) and not looks_numeric(c) for c in there)


def _texts(row: Sequence[Cell], width: int) -> list[str]:
    texts = [_text(cell) for cell in row[:width]]
    return [*texts, *[""] * (width - len(texts))]


def _text(cell: Cell) -> str:
    return f"{cell:g}" if isinstance(cell, float) else str(cell)


def _filled(names: Sequence[str]) -> list[str]:
    """Names of merged cells, which stand in the first of them, in all of them."""
    found: list[str] = []
    for place, name in enumerate(names):
        found.append(name or (found[-1] if place and found[-1] else ""))
    return found


def _commented(cells: Cells, width: int) -> list[str]:
    """A header in a comment, as numerical programs write it."""
    for line in reversed(cells.comments):
        text = line.lstrip("#/%!$ ")
        for mark in (";", "\t", "|", ",", r"\s{2,}", r"\s+"):
            names = [name.strip() for name in (re.split(mark, text) if "s" in mark else text.split(mark))]
            if len(names) == width and not any(looks_numeric(name) for name in names):
                return names
    return []


def _split_header(text: str) -> list[str]:
    return [name.strip() for name in text.split(";" if ";" in text else ",")]


def _title(cells: Cells, n: int, header: Sequence[str], kind: str) -> str:
    """The line between two blocks; a row with text in place of a number is none."""
    row = cells.rows[n]
    own = _kind(row)
    numbers = [place for place, letter in enumerate(kind) if letter == "n"]
    wrong = [place for place in numbers if place < len(row) and own[place] == "t"]
    if wrong and own.count("n") and len(own.rstrip("e")) == len(kind):
        name = repr(header[wrong[0]]) if wrong[0] < len(header) else str(wrong[0] + 1)
        where = f"{cells.path}:{cells.lines[n]}"
        raise InputError(where, f"column {name} is not a number", found=repr(str(row[wrong[0]])), expected="a number")
    texts = [_text(cell) for cell in row if cell != ""]
    return "" if texts == [name for name in header if name] or is_units(row) else " ".join(texts)


def _check_header(cells: Cells, headers: Sequence[str], rows: Sequence[Sequence[Cell]], line: int) -> None:
    width = max(len(row) for row in rows)
    where = f"{cells.path}:{line}"
    if not headers:
        expected = naming("header", words='{} "target_mm,reading_mm": the names of all columns with their units')
        raise InputError(
            where, "no row above the numbers names the columns", found=f"{width} columns", expected=expected
        )
    if width > len(headers):
        row = next(n for n, one in enumerate(rows) if len(one) == width)
        if any(cell != "" for cell in rows[row][len(headers) :]):
            words = f"{{}} or {{}} that fit, or {len(headers)}: {', '.join(headers)}"
            expected = naming("delimiter", "header", words=words)
            raise InputError(where, "the rows have more cells than the header", found=width, expected=expected)

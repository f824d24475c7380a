"""Rows of cells -> tables: what is above the numbers, between them and below them.

Rows of numbers of one width make a table. Directly above stands the header, of one to three rows, with or without a row
of units; further above a preamble, whose ``key: value`` lines are facts that the file states of itself. Lines between
blocks of numbers name the run that follows; what is below the last number (means, limits) is left out, and told.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, at_row, naming
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import Numerals, looks_numeric
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.tables.cells import Cell, Cells, is_units, mark_of, text_of, value_of
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.header import (
    behind_header,
    commented_header,
    find_header,
    fits_kind,
    frequent_kind,
    row_kind,
    split_names,
)
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.remarks import block_titles, left_out_words, stated_facts

FEWEST_NAMED = 3
"""Rows of names and fewer numbers from which they are a table."""


@dataclass(frozen=True)
class Table:
    """Header and rows of numbers.

    ``headers``, ``units``: by column; ``rows``: the cells; ``lines``: row of the file of each; ``titles``: the lines
    above the blocks, empty for none, and ``block``: which of them is that of a row; ``decimal``: the decimal mark of
    numbers that are text; ``facts``: what the file states of itself; ``left_out``: what of the file was not used;
    ``beside``: lines of rows with as many numbers that are none of its rows; ``bulk``: the middle of a long table, as
    columns, and ``at_row``: the row before which it stands.
    """

    path: str
    headers: list[str]
    units: list[Unit | None]
    rows: list[list[Cell]]
    lines: NDArray[np.int64]
    titles: list[str]
    block: NDArray[np.int64]
    decimal: str
    facts: Mapping[str, str] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    beside: tuple[int, ...] = ()
    bulk: Mapping[int, NDArray[np.generic]] = field(default_factory=dict)
    at_row: int = 0
    known: dict[int, Array] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.lines)

    def at(self, row: int) -> str:
        """``file:line`` of a row (counted from 0)."""
        return at_row(self.path, self.lines[row])

    def cells(self, place: int) -> list[Cell]:
        """The cells of a column."""
        found = [row[place] if place < len(row) else "" for row in self.rows]
        middle = self.bulk.get(place)
        return found if middle is None else [*found[: self.at_row], *middle.tolist(), *found[self.at_row :]]

    def first_cells(self, place: int, most: int = 200) -> list[Cell]:
        """Cells at the beginning of a column, of a long table at most those before its middle."""
        return [row[place] if place < len(row) else "" for row in self.rows[:most]]

    def numbers(self, place: int) -> Array:
        """The numbers of a column, NaN for what is none."""
        if place not in self.known:
            self.known[place] = self._numbers(place)
        return self.known[place]

    def _numbers(self, place: int) -> Array:
        numerals = Numerals(self.decimal)
        found = np.array([value_of(row[place] if place < len(row) else "", numerals) for row in self.rows])
        middle = self.bulk.get(place)
        if middle is None:
            return found
        if middle.dtype.kind not in "fi" and all(is_moment(row[place]) for row in self.rows[:50] if place < len(row)):
            middle = np.full(len(middle), np.nan)
        elif middle.dtype.kind not in "fi":
            middle = np.array([value_of(cell, numerals) for cell in middle.tolist()])
        return np.concatenate([found[: self.at_row], middle.astype(float), found[self.at_row :]])

    def add_constants(self, constants: Mapping[str, str]) -> Table:
        """The table with further columns that are the same in every row."""
        width = len(self.headers)
        rows = [[*row[:width], *[""] * (width - len(row)), *constants.values()] for row in self.rows]
        count = len(self) - len(self.rows)
        more = {width + n: np.full(count, text, object) for n, text in enumerate(constants.values()) if count}
        headers, units = [*self.headers, *constants], [*self.units, *[None] * len(constants)]
        return replace(self, rows=rows, headers=headers, units=units, bulk={**self.bulk, **more})

    def only(self, keep: NDArray[np.bool_]) -> Table:
        """Some of the rows."""
        head, tail = keep[: self.at_row], keep[len(keep) - (len(self.rows) - self.at_row) :]
        of_rows = [*head, *tail] if self.bulk else keep.tolist()
        middle = keep[self.at_row : self.at_row + len(keep) - len(self.rows)]
        rows = [row for row, one in zip(self.rows, of_rows, strict=True) if one]
        bulk = {place: values[middle] for place, values in self.bulk.items()}
        at = int(head.sum()) if self.bulk else 0
        return replace(self, rows=rows, lines=self.lines[keep], block=self.block[keep], bulk=bulk, at_row=at)


def find_tables(cells: Cells, decimal: str | None, header: str | None, decisions: Decisions) -> list[Table]:
    """The tables of a file, the one with the most numbers first; ``header``: names of the columns of all of them.

    :class:`InputError` where there are no numbers, or a number is missing among others.
    """
    found = list[Table]()
    parts = _parts(cells)
    if not parts:
        raise InputError(cells.path, "no table of numbers is found", expected="a row of numbers per reading")
    for part in sorted(parts, key=lambda one: one.first - one.end):
        try:
            found.append(_table(cells, part, decimal, header, decisions if not found else Decisions()))
        except InputError as error:
            if not found:  # else it is a list of other things beside the table
                raise
            decisions.reject(f"what stands at {cells.path}:{cells.lines[part.first]}", error.what)
    return sorted(found, key=lambda one: -len(one) * max(sum(map(bool, one.headers)), 1))


def _parts(cells: Cells) -> list[_Run]:
    """The tables of a file, each from the end of the one before it on."""
    kinds = [row_kind(row) for row in cells.rows]
    rows = {kind for kind in kinds if _is_of_numbers(kind)}
    if not rows:  # names with a number each
        rows = {kind for kind, count in Counter(kinds).items() if "n" in kind and count >= FEWEST_NAMED}
    runs: list[_Run] = []
    for n, kind in enumerate(kinds):
        if kind not in rows:
            continue
        if runs and _goes_on(cells, runs[-1], n, len(kind)):
            runs[-1] = replace(runs[-1], end=n + 1, width=max(runs[-1].width, len(kind)))
        else:
            runs.append(_Run(n, n + 1, len(kind)))
    runs = [one for one in runs if one.end - one.first > 1] or runs[:1]
    starts = [0, *(one.end for one in runs)]
    return [
        replace(one, start=start, kind=frequent_kind(kinds[one.first : one.end], rows))
        for one, start in zip(runs, starts, strict=False)
    ]


@dataclass(frozen=True)
class _Run:
    """Rows of numbers that belong together: the first one, the row behind the last one, and their widest.

    ``start``: from where what stands above them is theirs; ``kind``: what is in their columns (:func:`_kind`).
    """

    first: int
    end: int
    width: int
    start: int = 0
    kind: str = ""


def _goes_on(cells: Cells, run: _Run, n: int, width: int) -> bool:
    """Whether a row of numbers belongs to the table before it: no other header between, and no more cells."""
    between = cells.rows[run.end : n]
    if not between:
        return width <= max(run.width, _filled(cells, run))
    if width > run.width:
        return False
    names = [text_of(cell) for cell in cells.rows[run.first - 1] if cell != ""] if run.first else []
    rows = [row for row in between if len([c for c in row if c != ""]) > max(run.width / 2.0, 1.0)]
    texts = [[text_of(cell) for cell in row if cell != ""] for row in rows if not is_units(row)]
    return not names or names in texts or all(any(map(looks_numeric, text)) for text in texts)


def _filled(cells: Cells, run: _Run) -> int:
    """The cells of the row above a table, which names its columns, also those whose last cells are empty."""
    return len(cells.rows[run.first - 1]) if run.first else 0


def _is_of_numbers(kind: str) -> bool:
    return 2 * kind.count("n") >= len(kind.replace("e", "")) > 0


def _table(cells: Cells, part: _Run, decimal: str | None, header: str | None, decisions: Decisions) -> Table:
    start, kind = part.start, part.kind
    if len(kind) < part.width <= _filled(cells, part):  # the last column is empty in most rows
        kind = kind.ljust(part.width, "t")
    body = [n for n in range(part.first, part.end) if fits_kind(cells.rows[n], kind)]
    if not body:
        raise InputError(cells.path, "no table of numbers is found", expected="a row of numbers per reading")
    first, last = body[0], body[-1]
    _check_left_out(cells, first, last, len(kind))
    named = behind_header(cells, first, len(kind), start)
    names, unit_row, above = ([], [], named) if header else find_header(cells, named, len(kind), start)
    headers = split_names(header) if header else names or commented_header(cells, len(kind))
    titles, block = block_titles(cells, start, body, names, kind, first if named < first else above)
    units = [find_unit(text.strip("[]()")) if text else None for text in unit_row] + [None] * len(headers)
    rows, lines = [list(cells.rows[n]) for n in body], [cells.lines[n] for n in body]
    if headers and not header and _are_numbered(rows, len(headers)):
        headers, units = ["No.", *headers], [None, *units]
    below = cells.rows[last + 1 :]
    texts = [cell for row in rows for cell in row if isinstance(cell, str) and cell and not is_moment(cell)]
    _check_widths(cells, headers, rows, lines)
    if headers and not headers[-1] and above < first and len(cells.rows[above]) < len(headers):  # a name is missing
        _check_widths(cells, headers[:-1], rows, lines)
    numbers = max(kind.count("n") / 2.0, 1.0)
    inside = {*range(start, first), *body}
    beside = [
        n for n in range(start, len(cells.rows)) if n not in inside and row_kind(cells.rows[n]).count("n") >= numbers
    ]
    found = Table(
        cells.path,
        headers or [""] * len(kind),
        units[: len(headers)] if headers else [None] * len(kind),
        rows,
        np.array(lines),
        titles,
        np.array(block),
        decimal or mark_of(cells.path, texts, decisions),
        stated_facts([*cells.rows[:above], *below], cells.comments, titles),
        left_out_words(cells, part.start, body, names, kind, {*range(above, first)}, titles),
        tuple(cells.lines[n] for n in beside),
    )
    return _restore_bulk(found, cells, body)


def _are_numbered(rows: Sequence[Sequence[Cell]], width: int) -> bool:
    """Whether every row has its number before the cells that the header names, as some programs print tables."""
    first = [str(row[0]).removesuffix(".0") for row in rows]
    return all(len(row) == width + 1 for row in rows) and first in (
        [str(n + start) for n in range(len(rows))] for start in (0, 1)
    )


def _restore_bulk(table: Table, cells: Cells, body: Sequence[int]) -> Table:
    """The table with the middle of a long one, where its first and last rows stand around it."""
    bulk = cells.bulk
    if bulk is None or not body[0] < bulk.at <= body[-1]:
        return table
    at = sum(n < bulk.at for n in body)
    lines = np.insert(table.lines, at, bulk.line + np.arange(len(bulk)))
    block = np.insert(table.block, at, np.full(len(bulk), table.block[at - 1]))
    columns = {int(str(place)): bulk.frame[place].to_numpy() for place in bulk.frame}
    return replace(table, lines=lines, block=block, bulk=columns, at_row=at)


def _check_left_out(cells: Cells, first: int, last: int, width: int) -> None:
    """No row of numbers alone stands before, in, or directly behind a table and is none of it: nothing is lost."""
    for n in range(max(first - 1, 0), min(last + 2, len(cells.rows))):
        kind = row_kind(cells.rows[n])
        if "t" not in kind and len(kind) > width and kind.count("n") > 1:
            _refuse_width(at_row(cells.path, cells.lines[n]), len(kind), width)


def _check_widths(cells: Cells, headers: Sequence[str], rows: Sequence[Sequence[Cell]], lines: Sequence[int]) -> None:
    """No row has more numbers or words than the header names; a deviation that is drawn (``--#--``) is none."""
    for line, row in zip(lines, rows, strict=True) if headers else ():
        if any(any(map(str.isalnum, str(cell))) for cell in row[len(headers) :]):
            words = f"{{}} or {{}} that fit, or {len(headers)}: {', '.join(headers)}"
            _refuse_width(at_row(cells.path, line), len(row), naming("delimiter", "header", words=words))


def _refuse_width(where: str, found: int, expected: object) -> NoReturn:
    what = "the row has more cells than the header (a decimal comma in a comma-separated table?)"
    raise InputError(where, what, found=found, expected=expected)

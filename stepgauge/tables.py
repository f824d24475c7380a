"""Small CSV tables, checked cell by cell so that an error can name the row and the column."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files import read_text


@dataclass(frozen=True)
class CsvTable:
    """Columns of numbers with the line of the file each row came from."""

    path: str
    columns: Mapping[str, NDArray[np.float64]]
    lines: Sequence[int]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.columns[name]

    def at(self, row: int) -> str:
        """``file:line`` of row ``row`` (counted from 0)."""
        return f"{self.path}:{self.lines[row]}"


def read_numbers(path: str | Path, columns: Sequence[str]) -> CsvTable:
    """A CSV file with exactly these columns (in any order), all of them finite numbers.

    ``#`` lines are comments. :class:`InputError` for missing or unknown columns, other delimiters, decimal
    commas, text, NaN, short rows and empty tables, each with its line.
    """
    rows = _rows(read_text(path))
    if not rows:
        raise InputError(path, "the table is empty", expected="a header " + ",".join(columns))
    (header_line, header), body = rows[0], rows[1:]
    names = _check_header(path, header_line, header, columns)
    if not body:
        raise InputError(path, "the table has a header but no rows")
    values = np.array([_numbers(path, line, names, cells) for line, cells in body])
    return CsvTable(str(path), {name: values[:, i] for i, name in enumerate(names)}, [line for line, _ in body])


def _rows(text: str) -> list[tuple[int, list[str]]]:
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    return [(n, [cell.strip() for cell in next(csv.reader(io.StringIO(line)))]) for n, line in lines]


def _check_header(path: str | Path, line: int, header: list[str], columns: Sequence[str]) -> list[str]:
    if len(header) == 1 and any(mark in header[0] for mark in ";\t"):
        raise InputError(f"{path}:{line}", "columns are not separated by commas", found=repr(header[0]))
    missing = [name for name in columns if name not in header]
    unknown = [name for name in header if name not in columns]
    twice = [name for name in columns if header.count(name) > 1]
    for names, what in ((missing, "missing"), (unknown, "unknown"), (twice, "repeated")):
        if names:
            raise InputError(
                f"{path}:{line}",
                f"column {names[0]!r} is {what}",
                found=",".join(header),
                expected=",".join(columns),
            )
    return header


def _numbers(path: str | Path, line: int, names: Sequence[str], cells: list[str]) -> list[float]:
    if len(cells) != len(names):
        raise InputError(
            f"{path}:{line}",
            "wrong number of cells (a decimal comma?)" if len(cells) > len(names) else "the row is cut short",
            found=len(cells),
            expected=f"{len(names)}: {','.join(names)}",
        )
    return [_number(f"{path}:{line}", name, cell) for name, cell in zip(names, cells, strict=True)]


def _number(where: str, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(where, f"column {name} is not a number", found=repr(cell), expected="a finite number")
    return value

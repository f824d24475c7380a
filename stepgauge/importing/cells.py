"""Rows of cells from text files of any delimiter and encoding, and from Excel workbooks."""

from __future__ import annotations

import csv
import datetime
import io
import math
import re
import zipfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming, reading
from stepgauge.files.numerals import Numerals, decimal_mark, looks_numeric
from stepgauge.files.text import read_bytes
from stepgauge.files.units import find_unit

Cell = str | float | datetime.datetime | datetime.time | datetime.timedelta
DELIMITERS = {"semicolon": ";", "tab": "\t", "bar": "|", "comma": ","}
"""Names of the delimiters, in the order in which they are tried: a comma may be a decimal mark."""
SPACES = {"spaces": r"\s{2,}", "space": r"\s+"}
"""The same for columns that are set apart by white space, as patterns."""
_DATE_AND_TIME = re.compile(r"(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}) (\d{1,2}:\d\d)")
SAMPLE = 500
"""Lines by which the delimiter is found."""
LARGEST_UNPACKED = 60_000_000
"""Bytes of a workbook when it is unpacked: a sheet of some 100,000 probings."""
MOST_COLUMNS = 300
MOST_BLANK = 50_000
"""Blank rows of a sheet, and its columns; a cell in the last corner would stand for 16 billion cells."""
COMMENT_MARKS = ("#", "//", "%", "$$", "!")


@dataclass(frozen=True)
class Cells:
    """A table before it is known what it means.

    ``rows``: cells of each row, text without the spaces around it; ``lines``: line or row of the file of each;
    ``comments``: lines that are comments; ``blank``: how many lines are blank; ``notes``: how it was read, in words.
    """

    path: str
    rows: Sequence[Sequence[Cell]]
    lines: Sequence[int]
    comments: Sequence[str]
    blank: int
    notes: tuple[str, ...]


def is_units(row: Sequence[Cell]) -> bool:
    """Whether a row has units and nothing else."""
    texts = [cell for cell in row if cell != ""]
    return bool(texts) and all(isinstance(cell, str) and find_unit(cell.strip("[]()")) is not None for cell in texts)


def value_of(cell: Cell, numerals: Numerals) -> float:
    """The number of a cell; NaN where it is none."""
    if isinstance(cell, float):
        return cell
    return numerals.number(cell) if isinstance(cell, str) else math.nan


def is_workbook(path: str | Path) -> bool:
    """Whether a file is an Excel workbook, by its content."""
    try:
        with zipfile.ZipFile(path) as archive:
            return "xl/workbook.xml" in archive.namelist()
    except (OSError, zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, RuntimeError):
        return False


def decode(path: str | Path) -> tuple[str, str]:
    """Text of a file and the name of its encoding: UTF-8, UTF-16 by its mark, else Windows-1252 (western Europe)."""
    raw = read_bytes(path)
    encodings = ("utf-16",) if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" in text:
            break
        return text, {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252", "utf-16": "UTF-16"}[encoding]
    raise InputError(path, "this is not a text file", found=repr(raw[:16]), expected="a table as text (CSV)")


def read_text_cells(path: str | Path, delimiter: str | None) -> Cells:
    """Rows of a text file; the delimiter is the one given, that of a ``sep=`` line, or the one that shows itself."""
    text, encoding = decode(path)
    lines = text.splitlines()
    if lines and lines[0].strip().lower().startswith("sep=") and len(lines[0].strip()) == 5:
        delimiter = delimiter or lines[0].strip()[4]
        lines[0] = ""
    comments = [line for line in lines if _is_remark(line)]
    rows = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not _is_remark(line)]
    if not rows:
        raise InputError(path, "the table is empty", expected="a header with x, y and z, and rows of numbers")
    mark = delimiter or _find_delimiter(path, [line for _, line in rows])
    name = next((name for name, known in DELIMITERS.items() if known == mark), repr(mark))
    return Cells(
        str(path),
        _split([line for _, line in rows], mark),
        [n for n, _ in rows],
        comments,
        len(lines) - len(rows) - len(comments),
        (f"{encoding}, {name}-separated",),
    )


def read_column_cells(path: str | Path, delimiter: str | None) -> Cells:
    """Rows of a text file whose columns may be few, and set apart by white space."""
    text, encoding = decode(path)
    lines = [_DATE_AND_TIME.sub(r"\1_\2", line) for line in text.splitlines()]
    comments = [line for line in lines if _is_remark(line)]
    rows = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not _is_remark(line)]
    rows = [(n, line) for n, line in rows if not (n == 1 and line.lower().startswith("sep="))]
    if not rows:
        raise InputError(path, "the table is empty", expected="a header, and rows of numbers")
    texts = [line for _, line in rows]
    marks = [delimiter] if delimiter else [*DELIMITERS.values(), *SPACES.values()]
    mark = max(marks, key=lambda one: _divides(texts, one))
    name = next((name for name, known in (DELIMITERS | SPACES).items() if known == mark), repr(mark))
    numbers, blank = [n for n, _ in rows], len(lines) - len(rows) - len(comments)
    return Cells(str(path), _split(texts, mark), numbers, comments, blank, (f"{encoding}, {name}-separated",))


def _divides(lines: Sequence[str], mark: str) -> float:
    """How well a mark divides lines: cells that are numbers in rows as wide as most, less what it tears apart."""
    sample = lines[:: max(1, len(lines) // SAMPLE)]
    rows = [row for row in _split(sample, mark) if 2 * sum(map(looks_numeric, row)) >= len(row)]
    if not rows:
        return 0.0
    width = Counter(map(len, rows)).most_common(1)[0][0]
    even = [row for row in rows if len(row) == width]
    numeric = sum(looks_numeric(cell) for row in even for cell in row)
    return float(len(even) * numeric / (len(even) * width)) if width > 1 else 0.5 * len(even)


def _is_remark(line: str) -> bool:
    return line.lstrip().startswith(COMMENT_MARKS)


def _split(lines: Sequence[str], mark: str) -> list[list[str]]:
    """Cells of every line; a quotation mark that is not closed ends with its line."""
    if mark in SPACES.values():
        return [re.split(mark, line.strip()) for line in lines]
    reader = [next(csv.reader([line], delimiter=mark, skipinitialspace=True)) for line in lines]
    return [[cell.strip() for cell in cells] for cells in reader]


def _find_delimiter(path: str | Path, lines: Sequence[str]) -> str:
    """The mark that divides most lines into the same number of cells, at least three."""
    sample = lines[:: max(1, len(lines) // SAMPLE)]
    for mark in DELIMITERS.values():
        rows = _split(sample, mark)
        width, count = Counter(map(len, rows)).most_common(1)[0]
        numeric = sum(looks_numeric(cell) for row in rows for cell in row if cell)
        if width >= 3 and count > len(sample) // 2 and numeric >= 3:
            return mark
    raise InputError(
        path,
        "the delimiter of the table cannot be found",
        found=repr(lines[len(lines) // 2][:60]),
        expected=naming("delimiter", "sensor", words="columns separated by ; , | or tabs, or {}; of one axis {}"),
    )


def read_workbook_cells(path: str | Path, sheet: str | None) -> Cells:
    """Rows of a sheet of an Excel workbook, values as they were last computed."""
    content = read_bytes(path)
    if not is_workbook(path):
        found, expected = repr(content[:12]), "a whole file of Excel (.xlsx)"
        raise InputError(path, "not an Excel workbook", found=found, expected=expected)
    _check_unpacked(path, content)
    with reading(path, "workbook"):
        name, left, rows, blank = _read_grid(path, content, sheet)
    comments = [str(row[0]) for _, row in rows if _is_comment(row)]
    rows = [(n, row) for n, row in rows if not _is_comment(row)]
    if not rows:
        raise InputError(path, f"sheet {name!r} is empty", expected="a header with x, y and z, and rows of numbers")
    notes = (f"sheet {name!r}" + (f" (dropped: sheets {', '.join(left)})" if left else ""),)
    return Cells(str(path), [r for _, r in rows], [n for n, _ in rows], comments, blank + len(comments), notes)


def _check_unpacked(path: str | Path, content: bytes) -> None:
    """A workbook is packed: what it unpacks to is bounded before it is unpacked."""
    with reading(path, "workbook"), zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(part.file_size for part in archive.infolist())
    if size > LARGEST_UNPACKED:
        found, expected = f"{size / 1e6:.0f} MB unpacked", f"at most {LARGEST_UNPACKED / 1e6:.0f} MB"
        raise InputError(path, "the workbook is too large", found=found, expected=f"{expected}; export it as CSV")


def _read_grid(
    path: str | Path, content: bytes, sheet: str | None
) -> tuple[str, list[str], list[tuple[int, list[Cell]]], int]:
    """Name of the sheet, names of the others, its rows that are not blank with their numbers, and how many are."""
    import openpyxl

    book = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
    try:
        name = _choose_sheet(path, book.sheetnames, sheet)
        grid = book[name]
        grid.reset_dimensions()  # what the file says of its size may be wrong, and would cut it
        rows: list[tuple[int, list[Cell]]] = []
        number = 0
        for number, values in enumerate(grid.iter_rows(max_col=MOST_COLUMNS + 1, values_only=True), 1):
            last = max((i for i, value in enumerate(values, 1) if value is not None and value != ""), default=0)
            if last > MOST_COLUMNS:
                raise InputError(
                    path, f"row {number} of sheet {name!r} is too wide", expected=f"{MOST_COLUMNS} columns"
                )
            if last:
                rows.append((number, [_cell(value) for value in values[:last]]))
            if number - len(rows) > MOST_BLANK:
                raise InputError(path, f"sheet {name!r} has rows without an end", found=f"{number - len(rows)} blank")
        return name, [other for other in book.sheetnames if other != name], rows, number - len(rows)
    finally:
        book.close()


def _is_comment(row: Sequence[Cell]) -> bool:
    return isinstance(row[0], str) and row[0].startswith(COMMENT_MARKS) and not any(cell != "" for cell in row[1:])


def _choose_sheet(path: str | Path, names: Sequence[str], wanted: str | None) -> str:
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted in names:
        return str(wanted)
    listed = ", ".join(map(repr, names))
    if wanted is None:
        raise InputError(
            path, "the workbook has several sheets", found=listed, expected=naming("sheet", words="{} NAME")
        )
    raise InputError(
        path, f"the workbook has no sheet {wanted!r}", found=listed, expected=naming("sheet", words="{} NAME")
    )


def _cell(value: Any) -> Cell:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, (datetime.datetime, datetime.time, datetime.timedelta)):
        return value
    if isinstance(value, datetime.date):
        return datetime.datetime.combine(value, datetime.time())
    return str(value).strip()


def mark_of(path: str, cells: Sequence[str]) -> str:
    """The decimal mark that numbers written as text share; :class:`InputError` where it cannot be told."""
    mark = decimal_mark(cells)
    if mark is None:
        example = next((cell for cell in cells if "," in cell), "")
        raise InputError(
            path,
            "a comma may be a decimal mark or group thousands",
            found=repr(example),
            expected=naming("decimal", words="{} comma or point"),
        )
    return mark

"""Excel workbooks -> rows of cells, values as they were last computed."""

from __future__ import annotations

import datetime
import io
import zipfile
from collections.abc import Sequence
from typing import Any

from stepgauge.errors import InputError, naming, reading
from stepgauge.importing.tables.cells import Cell, Cells, is_remark, uncomment_headings
from stepgauge.importing.tables.source import Source

LARGEST_UNPACKED = 60_000_000
"""Bytes of a workbook when it is unpacked: a sheet of some 100,000 probings."""
MOST_COLUMNS = 300
MOST_BLANK = 50_000
"""Blank rows of a sheet, and its columns; a cell in the last corner would stand for 16 billion cells."""


def read_workbook_cells(source: Source, sheet: str | None) -> Cells:
    """Rows of a sheet; :class:`InputError` for a damaged or too large workbook, and where the sheet must be chosen."""
    path, content = source.name, source.data
    if not source.is_workbook:
        found, expected = repr(content[:12]), "a whole file of Excel (.xlsx)"
        raise InputError(path, "not an Excel workbook", found=found, expected=expected)
    _check_unpacked(path, content)
    with reading(path, "workbook"):
        name, left, rows, blank = _read_grid(path, content, sheet)
    lines = uncomment_headings(["\t".join(map(str, row)) for _, row in rows])
    rows = [
        (n, [line.strip('"')] if _is_comment(row) and not is_remark(line) else row)
        for (n, row), line in zip(rows, lines, strict=True)
    ]
    comments = [str(row[0]) for _, row in rows if _is_comment(row)]
    rows = [(n, row) for n, row in rows if not _is_comment(row)]
    if not rows:
        raise InputError(path, f"sheet {name!r} is empty", expected="a header with x, y and z, and rows of numbers")
    notes = (f"sheet {name!r}" + (f" (dropped: sheets {', '.join(left)})" if left else ""),)
    return Cells(str(path), [r for _, r in rows], [n for n, _ in rows], comments, blank + len(comments), notes)


def _check_unpacked(path: str, content: bytes) -> None:
    """A workbook is packed: what it unpacks to is bounded before it is unpacked."""
    with reading(path, "workbook"), zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(part.file_size for part in archive.infolist())
    if size > LARGEST_UNPACKED:
        found, expected = f"{size / 1e6:.0f} MB unpacked", f"at most {LARGEST_UNPACKED / 1e6:.0f} MB"
        raise InputError(path, "the workbook is too large", found=found, expected=f"{expected}; export it as CSV")


def _read_grid(
    path: str, content: bytes, sheet: str | None
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
    return isinstance(row[0], str) and is_remark(row[0]) and not any(cell != "" for cell in row[1:])


def _choose_sheet(path: str, names: Sequence[str], wanted: str | None) -> str:
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

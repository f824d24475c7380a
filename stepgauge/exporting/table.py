"""A recording as a table: text with any delimiter and decimal mark, or an Excel workbook."""

from __future__ import annotations

import io
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.exporting.options import DECIMALS, Export, ExportOptions
from stepgauge.files.controls import fixed
from stepgauge.files.tables import csv_text
from stepgauge.files.units import LENGTH_MM
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION, Recording

SHEET = "recording"


def render(recording: Recording, options: ExportOptions, form: str) -> Export:
    """All columns of a recording; those of coordinates are named after their unit, e.g. ``x_inch``."""
    names = _names(recording)
    header = [name.removesuffix("_mm") + f"_{options.unit}" if name in POSITION else name for name in names]
    comments = [f"# {key}: {line}" for key, value in recording.comments.items() for line in value.split("\n")]
    if form == "xlsx":
        return Export(_workbook(comments, header, _columns(recording, names, options)), ())
    if options.decimal == options.delimiter:
        raise InputError(naming("decimal"), "the decimal mark is the delimiter, too", found=options.decimal)
    columns = [
        [_text(value, name, options) for value in column]
        for name, column in zip(names, _columns(recording, names, options), strict=True)
    ]
    table = csv_text(header, zip(*columns, strict=True), options.delimiter)
    return Export("".join([*(line + "\n" for line in comments), table]).encode(), ())


def _names(recording: Recording) -> list[str]:
    known = [name for name in [*COUNTS, *POSITION, *APPROACH, *OPTIONAL[1:]] if name in recording.frame]
    return [*known, *(name for name in recording.frame.columns if name not in known)]


def _columns(recording: Recording, names: list[str], options: ExportOptions) -> list[list[Any]]:
    factor = 1.0 / LENGTH_MM[options.unit]
    columns = []
    for name in names:
        column = recording.frame[name]
        columns.append((column * factor if name in POSITION else column).tolist())
    return columns


def _text(value: float, name: str, options: ExportOptions) -> str:
    decimals = {**dict.fromkeys(POSITION, DECIMALS[options.unit]), **dict.fromkeys(APPROACH, 10), "time_s": 4}.get(name)
    text = repr(value) if decimals is None else fixed(value, decimals)
    return text.replace(".", options.decimal)


def _workbook(comments: list[str], header: list[str], columns: list[list[Any]]) -> bytes:
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet(SHEET)
    for line in comments:
        sheet.append([line])
    sheet.append(header)
    for row in zip(*columns, strict=True):
        sheet.append(row)
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()

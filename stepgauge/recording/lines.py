"""The lines of a recording: comments above the header, and the lines that say nothing wherever they stand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.text import any_text, is_there, read_bytes

LONGEST_HEADER = 10_000_000
"""Characters of a header, or of the comments above it."""
_EMPTY = ', \t\r\n"'
"""What an empty row is made of, also the cells that a spreadsheet leaves of one."""


def comment_lines(lines: Iterable[str]) -> dict[str, str]:
    """``# key: value`` lines as a dictionary; lines of the same key are one value of several lines."""
    comments: dict[str, str] = {}
    for line in lines:
        key, colon, value = line[1:].partition(":")
        if line.startswith("#") and colon:
            before = [comments[key.strip()]] if key.strip() in comments else []
            comments[key.strip()] = "\n".join([*before, value.strip()])
    return comments


def table_comments(path: str | Path) -> dict[str, str]:
    """The comments of a table in any encoding, wherever they stand; none where there is no such file."""
    return comment_lines(any_text(read_bytes(path), path)[0].splitlines()) if is_there(path) else {}


def is_beside(line: str) -> bool:
    """Whether a line is a comment or blank: no row, and no header."""
    return line.lstrip(_EMPTY)[:1] in ("", "#")


def read_comments(path: str | Path) -> tuple[dict[str, str], int]:
    """``# key: value`` lines before the header, and how many lines stand there, with blank ones."""
    lines, size = list[str](), 0
    with Path(path).open("rb") as raw:
        _refuse_other_kinds(path, raw.read(4))
    with Path(path).open(encoding="utf-8-sig") as file:
        while (line := file.readline(LONGEST_HEADER)) and is_beside(line):
            lines.append(line)
            size += len(line)
            if size > LONGEST_HEADER:
                raise InputError(path, "the comments above the header have no end", expected="# key: value")
    return comment_lines(lines), len(lines)


def lines_beside(path: str | Path, header: int) -> list[int]:
    """Comments and blank lines below the header, which is line ``header``; all lines are counted from 1."""
    empty, beside = _EMPTY.encode(), (b"", b"#")
    odd = empty + b"#"  # how no row begins: a recording may have millions, and few lines are looked at closely
    with Path(path).open("rb") as file:
        return [n for n, one in enumerate(file, 1) if one[0] in odd and n > header and one.lstrip(empty)[:1] in beside]


def row_lines(rows: int, header: int, beside: Sequence[int]) -> Sequence[int]:
    """The line of every row, ``(rows,)``."""
    if not beside:
        return range(header + 1, header + 1 + rows)
    left_out = set(beside)
    return [n for n in range(header + 1, header + 1 + rows + len(beside)) if n not in left_out]


def _refuse_other_kinds(path: str | Path, beginning: bytes) -> None:
    if beginning.startswith(b"PK"):
        expected = "a recording (CSV), which 'stepgauge import' makes of a workbook"
        raise InputError(path, "this is an Excel workbook or another archive", expected=expected)
    if beginning[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError(path, "this is text in UTF-16", expected="a recording (CSV, UTF-8); try 'stepgauge import'")

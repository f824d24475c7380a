"""What a table comes from: a file by its path, an open file, or a DataFrame -> its bytes, text or columns."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import pandas as pd

from stepgauge.errors import InputError
from stepgauge.files.text import read_bytes

LARGEST_BYTES = 400_000_000
"""Of a table: some ten million rows."""
_NAMES = {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252", "utf-16": "UTF-16"}


@dataclass(frozen=True)
class Source:
    """``name``: of the file, for messages; ``data``: its bytes; ``frame``: the table itself, where it is no file."""

    name: str
    data: bytes
    frame: pd.DataFrame | None = None

    @cached_property
    def is_workbook(self) -> bool:
        """Whether it is an Excel workbook, by its content."""
        try:
            with zipfile.ZipFile(io.BytesIO(self.data)) as archive:
                return "xl/workbook.xml" in archive.namelist()
        except (OSError, zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, RuntimeError):
            return False

    @cached_property
    def decoded(self) -> tuple[str, str]:
        """The text and the name of its encoding: UTF-8, UTF-16 by its mark, else Windows-1252 (western Europe).

        :class:`InputError` for what is no text.
        """
        utf16 = self.data[:2] in (b"\xff\xfe", b"\xfe\xff")
        for encoding in ("utf-16",) if utf16 else ("utf-8-sig", "cp1252"):
            try:
                text = self.data.decode(encoding)
            except UnicodeDecodeError:
                continue
            if "\0" in text:
                break
            return text, _NAMES[encoding]
        raise InputError(
            self.name, "this is not a text file", found=repr(self.data[:16]), expected="a table as text (CSV)"
        )


Given = str | Path | IO[Any] | pd.DataFrame | Source
"""What the reader takes."""


def read_source(given: Given) -> Source:
    """The content of what was given; :class:`InputError` where there is none."""
    if isinstance(given, Source):
        return given
    if isinstance(given, pd.DataFrame):
        return Source("DataFrame", b"", given)
    if isinstance(given, str | Path):
        return Source(str(given), read_bytes(given, LARGEST_BYTES))
    content = given.read()
    data = content.encode() if isinstance(content, str) else bytes(content)
    return Source(str(getattr(given, "name", "file")), data)


def decode(given: Given) -> tuple[str, str]:
    """Text of a file and the name of its encoding."""
    return read_source(given).decoded

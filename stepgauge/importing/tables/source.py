"""What a table comes from: a file by its path, an open file, or a DataFrame -> its bytes, text or columns."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeAlias, cast

from stepgauge.errors import FRAME
from stepgauge.files.text import GivenTable, any_text, read_bytes

if TYPE_CHECKING:
    import pandas as pd

LARGEST_BYTES = 400_000_000
"""Of a table: some ten million rows."""
LONG_BYTES = 20_000
"""Of a text of which the beginning shows what it is."""


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
    def beginning(self) -> Source:
        """The first lines of a long text, which show what kind of table it is; anything else whole."""
        if self.frame is not None or self.is_workbook or len(self.data) < LONG_BYTES:
            return self
        text = self.decoded[0][:LONG_BYTES]
        return Source(self.name, text[: text.rfind("\n") + 1].encode())

    @cached_property
    def decoded(self) -> tuple[str, str]:
        """The text and the name of its encoding (:func:`stepgauge.files.text.any_text`)."""
        return any_text(self.data, self.name)


Given: TypeAlias = "str | Path | IO[Any] | pd.DataFrame | Source"
"""What the reader takes."""


def read_source(given: Given) -> Source:
    """The content of what was given; :class:`InputError` where there is none."""
    if isinstance(given, Source):
        return given
    if isinstance(given, GivenTable):
        return Source(given, b"", given.frame)
    if hasattr(given, "iloc"):
        return Source(FRAME, b"", cast("pd.DataFrame", given))
    if isinstance(given, str | Path):
        return Source(str(given), read_bytes(given, LARGEST_BYTES))
    content = given.read()
    data = content.encode() if isinstance(content, str) else bytes(content)
    return Source(str(getattr(given, "name", "file")), data)

"""A result that is read back from its JSON file: what was said of it, and its table.

A :class:`WrittenResult` writes its files inside :meth:`WrittenResult.keeping`; whatever it was, :func:`read_stored`
gives it back with the same lines and the same table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, for_command
from stepgauge.files.display import Summarized
from stepgauge.files.json_types import json_types
from stepgauge.files.outputs import open_set
from stepgauge.files.text import read_json, read_result

if TYPE_CHECKING:
    import pandas as pd

RESULT, SUMMARY, TABLE = "result", "summary", "table"
"""Key in the file of a result, with its lines and its table by column."""


class WrittenResult(Summarized):
    """A result whose JSON file says its lines and its table."""

    def keeping(self) -> AbstractContextManager[None]:
        """The set of its files, of which the result says lines and table."""
        return open_set(lambda: {RESULT: self._stated()})

    def _stated(self) -> dict[str, Any]:
        """In JSON types: undefined numbers as null, dates as text."""
        frame = self.to_frame()
        with for_command():
            lines = self.summary().split("\n")
        table = {str(name): json_types(frame[name].tolist()) for name in frame.columns}
        return {SUMMARY: lines, TABLE: table}


@dataclass(frozen=True, repr=False)
class StoredResult(WrittenResult):
    """A result as its file has it: its ``kind`` and its ``values`` by key; its figures lie beside the file."""

    kind: str
    values: Mapping[str, Any]

    def summary(self) -> str:
        """The lines that were printed when it was made."""
        return "\n".join(self.values[RESULT][SUMMARY])

    def to_frame(self) -> pd.DataFrame:
        """The table that the result had; NaN where a number is undefined."""
        import pandas as pd

        columns = self.values[RESULT][TABLE]
        kinds = {name: {type(one) for one in cells} for name, cells in columns.items()}
        numeric = [name for name, found in kinds.items() if float in found or found == {type(None)}]
        return pd.DataFrame(columns).astype(dict.fromkeys(numeric, float))

    def _stated(self) -> dict[str, Any]:
        return dict(self.values[RESULT])

    def __repr__(self) -> str:
        """As that of every result, with the kind in front."""
        return f"{self.kind}: {super().__repr__()}"


def stored_kind(path: str | Path) -> tuple[str, Path]:
    """The noun of the result that a file, or the only one of a folder, holds (:class:`InputError` if there is none)."""
    place = Path(path)
    files = sorted(place.glob("*.json")) if place.is_dir() else [place]
    known = {file: kind for file in files if (kind := _kind(file))}
    if len(known) != 1:
        found = ", ".join(file.name for file in known) or "none"
        raise InputError(path, "not one result of stepgauge", found=found, expected="a folder with one, or the file")
    ((file, kind),) = known.items()
    return kind, file


def _kind(path: Path) -> str:
    data = read_json(path)
    stated = str(data.get("format", "")) if isinstance(data, dict) else ""
    kind = re.fullmatch(r"stepgauge (.+) \d+", stated)
    return kind[1] if kind else ""


def read_stored(path: str | Path) -> StoredResult:
    """A result from its file or folder; :class:`InputError` for one that was changed, or does not say its table."""
    kind, file = stored_kind(path)
    data = read_result(file, kind)
    if RESULT not in data:
        raise InputError(file, f"this {kind} does not say its table", expected="a result that is read back")
    return StoredResult(kind, data)

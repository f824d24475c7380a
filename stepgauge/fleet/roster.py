"""The roster: a table (CSV) that says whose the recordings are that do not say it themselves.

With a column ``recording`` it has a row for each file, by its path from the roster's folder or by its name; with a
column ``machine`` alone, a row for each machine. An empty cell says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.tables import read_rows

FILES = ("gauge_file", "machine_file", "placement_file")
COLUMNS = ("recording", "machine", "type", "hall", "probe", "gauge", "measured_at", *FILES)


@dataclass(frozen=True)
class Row:
    """What the roster says of a recording; ``where``: the line that says it."""

    cells: Mapping[str, str] = field(default_factory=dict)
    where: str = ""
    folder: Path = Path()

    def get(self, name: str) -> str | None:
        """A cell, None where it is empty or missing."""
        return self.cells.get(name) or None

    def file(self, name: str) -> str | None:
        """The file of a cell: beside the roster, or the name of a shipped one."""
        return next(iter(self.files(name)), None)

    def files(self, name: str) -> list[str]:
        """The files of a cell, ``;`` between them: beside the roster, or names of shipped ones."""
        words = [word.strip() for word in (self.get(name) or "").split(";") if word.strip()]
        return [str(self.folder / word) if (self.folder / word).exists() else word for word in words]


@dataclass(frozen=True)
class Roster:
    """Rows by the file that they name, or by machine."""

    path: str = ""
    by: str = ""
    rows: Mapping[str, Row] = field(default_factory=dict)

    @classmethod
    def read(cls, path: str) -> Roster:
        """From a file; :class:`InputError` names columns that are not known and rows that are there twice."""
        table, folder = read_rows(path, ()), Path(path).parent
        unknown = [name for name in table.header if name not in COLUMNS]
        by = next((name for name in ("recording", "machine") if name in table.header), "")
        if unknown or not by:
            what = f"column {unknown[0]!r} is not known" if unknown else "column 'recording' or 'machine' is missing"
            raise InputError(path, what, found=",".join(table.header), expected=",".join(COLUMNS))
        rows: dict[str, Row] = {}
        for number, cells in enumerate(table.cells):
            row = Row(dict(zip(table.header, cells, strict=True)), table.at(number), folder)
            key = str((folder / row.cells[by]).resolve()) if by == "recording" else row.cells[by]
            if key in rows:
                raise InputError(row.where, f"this {by} is there twice", found=row.cells[by])
            rows[key] = row
        return cls(path, by, rows)

    def of(self, path: str, machine: str | None) -> Row:
        """The row of a recording; :class:`InputError` where each file needs one and has none."""
        if self.by != "recording":
            return self.rows.get(machine or "", Row())
        row = self.rows.get(str(Path(path).resolve()))
        if row is None:
            raise InputError(path, "the roster has no row of this recording", expected=f"one in {self.path}")
        return row

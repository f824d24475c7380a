"""Many small files made into few, while nobody else writes; a kill at any moment loses and doubles nothing.

New files are written first, then one index that takes the place of all before it; what nobody names any more is removed
last, or the next time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from stepgauge.fleet.disk import UNFINISHED, locked
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.rows import read_rows, write_rows
from stepgauge.fleet.schema import PROBINGS, RECORDINGS, SOURCES, arrow_library, arrow_schema
from stepgauge.fleet.store import Fleet

FILE_ROWS = 2_000_000
"""Probings of a file at most."""
SOURCE_BYTES = 128_000_000
"""Files of sources above this are left as they are."""


@dataclass(frozen=True)
class Compacted:
    """How many files the store had before, and has now."""

    before: int
    after: int

    def summary(self) -> str:
        """Both numbers."""
        return f"{self.before} files before, {self.after} now"


def compact(fleet: Fleet) -> Compacted:
    """Make one file of the probings of each machine and month, one index, few files of sources and of results.

    Writers and readers wait meanwhile.
    """
    with locked(fleet.folder, alone=True):
        before = _count(fleet)
        live, frame = fleet.live(), fleet.index().to_pandas()
        moved = _merge_partitions(fleet, frame)
        if moved is not None or len(live) > 1:
            index = frame if moved is None else moved
            index = index.sort_values(["measured_at", "recording"])
            table = arrow_library().Table.from_pandas(index, arrow_schema(RECORDINGS), preserve_index=False)
            fleet.write_index(table, [path.name for path in live])
        merged = _merge_sources(fleet)
        for table in tables_of(fleet):
            table.merge()
        _remove_unnamed(fleet, merged)
        return Compacted(before, _count(fleet))


def _count(fleet: Fleet) -> int:
    return sum(1 for _ in fleet.folder.rglob("*.parquet"))


def _merge_partitions(fleet: Fleet, frame: pd.DataFrame) -> pd.DataFrame | None:
    """The index with recordings where they are now; None where every partition is as it should be."""
    parts, changed = [], False
    for folder, rows in frame.groupby(frame["file"].map(lambda name: str(Path(name).parent)), sort=True):
        full = rows.groupby("file")["rows"].transform("sum") >= FILE_ROWS
        few = rows[~full].sort_values(["measured_at", "recording"])
        parts.append(rows[full])
        if few["file"].nunique() > 1:
            changed = True
            parts += [_merge(fleet, str(folder), some) for some in _slices(few)]
        else:
            parts.append(few)
    return pd.concat(parts) if changed else None


def _slices(rows: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Rows of the index of at most so many probings, at least one."""
    number = (rows["rows"].cumsum() - 1) // FILE_ROWS
    for _, some in rows.groupby(number):
        yield some


def _merge(fleet: Fleet, folder: str, rows: pd.DataFrame) -> pd.DataFrame:
    """One file of the probings of these recordings, in this order."""
    read = {file: read_rows(fleet.folder / file) for file in rows["file"].unique()}
    pieces = (read[row.file].slice(row.first_row, row.rows) for row in rows.itertuples())
    path = write_rows(fleet.folder / folder, pieces, PROBINGS)
    name = path.relative_to(fleet.folder).as_posix()
    return rows.assign(file=name, first_row=rows["rows"].cumsum() - rows["rows"])


def _merge_sources(fleet: Fleet) -> list[Path]:
    """Small files of sources into larger ones; returns those that are not needed any more."""
    files = sorted((fleet.folder / "sources").glob("*.parquet"))
    small = [path for path in files if path.stat().st_size < SOURCE_BYTES // 2]
    merged, some, size = list[Path](), list[Path](), 0
    for path in [*small, None]:
        if some and (path is None or size + path.stat().st_size > SOURCE_BYTES):
            merged += _merged(some)
            some, size = [], 0
        if path is not None:
            some.append(path)
            size += path.stat().st_size
    return merged


def _merged(files: list[Path]) -> list[Path]:
    if len(files) < 2:
        return []
    merged = write_rows(files[0].parent, _once(files), SOURCES)
    return [path for path in files if path != merged]


def _once(files: list[Path]) -> Iterator[Any]:
    """The tables of the files, each recording once: a kill before the last step leaves some in two files."""
    arrow, seen = arrow_library(), set[str]()
    for path in files:
        table = read_rows(path)
        keys = table["recording"].to_pylist()
        yield table.filter(arrow.array([key not in seen for key in keys]))
        seen.update(keys)


def _remove_unnamed(fleet: Fleet, more: list[Path]) -> None:
    """Files that no index names, and what killed writers left."""
    named = {fleet.folder / name for name in fleet.index()["file"].to_pylist()} | set(fleet.live())
    held = [*(fleet.folder / "probings").rglob("*.parquet"), *(fleet.folder / "recordings").glob("*.parquet")]
    left = [path for path in fleet.folder.rglob(f"*{UNFINISHED}") if path.is_file()]
    for path in {*held, *more, *left} - named:
        path.unlink(missing_ok=True)

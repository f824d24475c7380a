"""Rows of recordings as the store has them: one table of probings with the owners in every row, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.errors import InputError, reading
from stepgauge.files.checksum import check_name
from stepgauge.fleet.content import recording_key
from stepgauge.fleet.disk import put_by_content
from stepgauge.fleet.schema import OWN, PROBINGS, StoredColumn, arrow_library, arrow_schema, needed
from stepgauge.recording import Recording

if TYPE_CHECKING:
    from stepgauge.fleet.store import Entry

GROUP_ROWS = 120_000
"""Rows that are compressed together, and that a query skips together."""


def make_probings(key: str, entry: Entry) -> Any:
    """The rows of a recording as an Arrow table, in their order, with the owners in every row."""
    arrow, known = arrow_library(), entry.recording.columns
    schema, n = arrow_schema(PROBINGS), len(entry.recording)
    fixed = {"recording": key, **entry.owners, "measured_at": entry.measured_at}
    columns = []
    for one in schema:
        if one.name in fixed:
            columns.append(arrow.repeat(arrow.scalar(fixed[one.name], one.type), n))
        elif one.name == "covariates":
            columns.append(_covariates(known, n))
        elif one.name in known:
            columns.append(arrow.array(known[one.name], one.type))
        else:
            columns.append(arrow.nulls(n, one.type))
    return arrow.Table.from_arrays(columns, schema=schema)


def _covariates(columns: Mapping[str, Any], n: int) -> Any:
    """Further columns, row by row, as pairs of name and value."""
    arrow = arrow_library()
    names = [name for name in columns if name not in OWN]
    values = np.array([columns[name] for name in names], float).T.ravel()
    starts = np.arange(n + 1, dtype=np.int32) * len(names)
    return arrow.MapArray.from_arrays(
        starts, arrow.array(names * n, arrow.string()), arrow.array(values, arrow.float64())
    )


def write_rows(folder: Path, tables: Iterable[Any], columns: tuple[StoredColumn, ...]) -> Path:
    """Write tables one after the other into one file of a folder, which appears when it is whole; its path."""
    return put_by_content(folder, partial(_write_tables, tables, columns))


def _write_tables(tables: Iterable[Any], columns: tuple[StoredColumn, ...], path: Path) -> None:
    parquet, schema, writer = needed("pyarrow.parquet"), arrow_schema(columns), None
    kept: list[Any] = []
    try:
        for table in tables:
            writer = writer or parquet.ParquetWriter(
                path, schema.with_metadata(table.schema.metadata), compression="zstd"
            )
            kept.append(table)
            if sum(map(len, kept)) >= GROUP_ROWS:
                writer.write_table(arrow_library().concat_tables(kept))
                kept = []
        if kept and writer is not None:
            writer.write_table(arrow_library().concat_tables(kept))
    finally:
        if writer is not None:
            writer.close()


def read_rows(path: Path, **options: Any) -> Any:
    """A file of the store as an Arrow table; ``options``: of ``pyarrow.parquet.read_table``.

    :class:`InputError` where it is not as it was written.
    """
    with reading(path, "file of the store"):
        return needed("pyarrow.parquet").read_table(check_name(path), partitioning=None, **options)


def read_columns(path: Path, rows: Iterable[Mapping[str, Any]]) -> dict[str, Any] | None:
    """The columns that these recordings of a file have, as arrays ``(n,)``, covariates as Arrow has them.

    ``rows``: of the index. None where the file is gone.
    """
    if not path.exists():
        return None
    kinds = {name for text in {row["columns"] for row in rows} for name in json.loads(text)}
    names = [name for name in OWN if name in kinds]
    further = ["covariates"] if kinds - set(OWN) else []
    with reading(path, "file of the store"):
        file = needed("pyarrow.parquet").ParquetFile(check_name(path), memory_map=True)
        table = file.read([*names, *further], use_threads=False)
    columns = {name: table[name].to_numpy() for name in names}
    return columns | {name: table[name].combine_chunks() for name in further}


@dataclass(frozen=True)
class Stored:
    """A recording on its way from the store: what it needs to be made where it is worked on.

    ``columns``: arrays ``(n,)`` in the order and of the types that came in.
    """

    key: str
    columns: dict[str, Any]
    comments: dict[str, str]
    name: str
    certificate: str
    machine_file: str | None
    placement_files: tuple[str, ...]

    def recording(self) -> Recording:
        """As it came in (:class:`InputError` where it is not the one that the key names)."""
        found = Recording(self.columns, self.comments, self.name)
        if recording_key(found) != self.key:
            raise InputError(self.name, "the store has another recording under this key", found=self.key)
        return found


def make_stored(row: Mapping[str, Any], columns: Mapping[str, Any]) -> Stored:
    """A recording from its row of the index and the columns of its file."""
    part = slice(row["first_row"], row["first_row"] + row["rows"])
    kinds: dict[str, str] = json.loads(row["columns"])
    others = [name for name in kinds if name not in OWN]
    further = columns["covariates"][part].items.to_numpy().reshape(-1, len(others)) if others else np.zeros((0, 0))
    made = {
        name: (columns[name][part] if name in OWN else further[:, others.index(name)]).astype(kind)
        for name, kind in kinds.items()
    }
    comments: dict[str, str] = json.loads(row["comments"])
    files = (row["certificate"], row["machine_file"], tuple(row["placement_files"]))
    return Stored(row["recording"], made, comments, row["name"], *files)

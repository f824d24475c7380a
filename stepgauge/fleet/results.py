"""What was worked out from the recordings, kept beside them: tables with a row or more for each recording.

A table belongs to what it was made with (version, options); rows made with anything else are thrown away when the
first new ones come, so that a table never mixes two.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.fleet.disk import locked, put_by_content
from stepgauge.fleet.rows import read_rows
from stepgauge.fleet.schema import arrow_library, needed
from stepgauge.fleet.store import REPLACES, Fleet

MADE_WITH = b"made_with"


@dataclass(frozen=True)
class _Part:
    """With what a file was made, the recordings in it, and the files that it takes the place of."""

    made_with: str
    recordings: frozenset[str]
    replaces: tuple[str, ...]


class Results:
    """The table ``name`` of a store, as made with ``options`` by this version of stepgauge.

    Every row has the key of its ``recording``. The columns are those of the first rows that are put in.
    """

    def __init__(self, fleet: Fleet, name: str, options: Mapping[str, Any] | None = None) -> None:
        self.fleet, self.folder = fleet, fleet.folder / name
        self.made_with = json.dumps({"stepgauge": __version__, **(options or {})}, sort_keys=True)
        self._known: dict[str, _Part] = {}

    def done(self) -> set[str]:
        """The keys of the recordings that have rows."""
        return set().union(*(self._of(path).recordings for path in self.files()))

    def files(self) -> list[Path]:
        """The files of this table that were made as it is asked for, and that no other one takes the place of."""
        parts = {path: self._of(path) for path in sorted(self.folder.glob("*.parquet"))}
        replaced = {name for part in parts.values() for name in part.replaces}
        return [path for path, part in parts.items() if part.made_with == self.made_with and path.name not in replaced]

    def _of(self, path: Path) -> _Part:
        """What is in a file; it never changes, so it is read once."""
        if path.name not in self._known:
            table = read_rows(path, columns=["recording"])
            said = table.schema.metadata or {}
            names = json.loads(said.get(REPLACES, b"[]"))
            made_with = said.get(MADE_WITH, b"").decode()
            self._known[path.name] = _Part(made_with, frozenset(table["recording"].to_pylist()), tuple(names))
        return self._known[path.name]

    def read(self) -> Any:
        """All rows as an Arrow table, in the order in which they were put in; None where there are none."""
        tables = [read_rows(path) for path in self.files()]
        return arrow_library().concat_tables(tables, promote_options="permissive") if tables else None

    def put(self, rows: Sequence[Mapping[str, Any]] | Any) -> None:
        """Add rows (dictionaries, or an Arrow table) on the disk; those of recordings that are there are left out."""
        arrow = arrow_library()
        table = arrow.Table.from_pylist(list(rows)) if isinstance(rows, Sequence) else rows
        with locked(self.fleet.folder, alone=True):
            self._drop_others()
            known = arrow.array(sorted(self.done()), arrow.string())
            table = table.filter(arrow.compute.invert(arrow.compute.is_in(table["recording"], value_set=known)))
            if len(table):
                self._write(table)

    def clear(self) -> None:
        """Throw all rows away."""
        with locked(self.fleet.folder, alone=True):
            for path in self.folder.glob("*.parquet"):
                path.unlink()

    def merge(self) -> int:
        """Make one file of several, while nobody else writes; returns how many there were."""
        files = self.files()
        if len(files) > 1:
            self._write(self.read(), [path.name for path in files])
        self._drop_others()
        return len(files)

    def _drop_others(self) -> None:
        for path in set(self.folder.glob("*.parquet")) - set(self.files()):
            path.unlink()

    def _write(self, table: Any, replaces: Sequence[str] = ()) -> None:
        number = 1 + max((int(path.stem.partition("-")[0]) for path in self.folder.glob("*.parquet")), default=0)
        said = {MADE_WITH: self.made_with.encode(), REPLACES: json.dumps(list(replaces)).encode()}
        write, made = needed("pyarrow.parquet").write_table, table.replace_schema_metadata(said)
        put_by_content(self.folder, lambda path: write(made, path, compression="zstd"), f"{number:08d}-")


def tables_of(fleet: Fleet) -> list[Results]:
    """The tables of results that a store has, each as it was made last."""
    found = []
    folders = {path.parent for path in fleet.folder.glob("*/[0-9]*-*.parquet")}
    for folder in sorted(one for one in folders if one.name.isidentifier()):
        last = max(folder.glob("*.parquet"))
        table = Results(fleet, folder.name)
        table.made_with = table._of(last).made_with
        found.append(table)
    return found

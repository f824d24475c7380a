"""The store of a fleet: a folder of Parquet files, recordings partitioned by machine and month.

``recordings/`` has a row for each recording and says in which file of ``probings/`` its probings are; ``sources/`` has
the files as they came in. A file in ``recordings/`` appears after all that it needs, and so makes all its recordings
appear at once. Files never change, and are called by their content: one that takes the place of others says so, and
these do not count from then on.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from stepgauge.errors import InputError
from stepgauge.fleet.content import keep, main_file, recording_key
from stepgauge.fleet.disk import appearing, locked
from stepgauge.fleet.rows import Stored, make_probings, make_stored, read_columns, read_rows, write_rows
from stepgauge.fleet.schema import (
    FORMAT,
    OWNERS,
    PROBINGS,
    RECORDINGS,
    SOURCES,
    VERSION,
    arrow_library,
    arrow_schema,
    needed,
)
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import Machine, read_machine
from stepgauge.recording import Recording

HEAD = "fleet.json"
_KEY = "[0-9a-f]{32}"
NAMES = {
    "recording": f"^{_KEY}$",
    "certificate": f"^{_KEY}$",
    "machine_file": f"^{_KEY}$",
    "file": rf"^probings/machine=[^/\\]+/month=[0-9]{{4}}-[0-9]{{2}}/{_KEY}\.parquet$",
}
"""What names files, in the index."""
REPLACES = b"replaces"
FIXED = (*OWNERS, "measured_at", "certificate", "machine_file", "placement_files")
"""What belongs to a recording and may not change when it is added again."""


@dataclass(frozen=True)
class Entry:
    """A recording that is to be added.

    ``owners``: by the names of :data:`OWNERS`, None where unknown; ``certificate`` and ``machine_file``: keys of what
    was kept; ``placement_files``: their texts; ``source``: the bytes of its file.
    """

    recording: Recording
    owners: Mapping[str, str | None]
    measured_at: datetime.datetime
    certificate: str
    machine_file: str | None = None
    placement_files: tuple[str, ...] = ()
    source: bytes = b""

    @property
    def month(self) -> str:
        """Month of the measurement, e.g. ``2026-03``: the part of the store it belongs to."""
        return f"{self.measured_at:%Y-%m}"


class Fleet:
    """A store in a folder.

    Parameters
    ----------
    folder : where it is
    create : make one if the folder is empty or missing

    Raises
    ------
    InputError
        no store here, or one of a later version
    """

    def __init__(self, folder: str | Path, create: bool = False) -> None:
        self.folder = Path(folder)
        arrow_library()
        if create and not (self.folder / HEAD).exists():
            _create(self.folder)
        _check_head(self.folder)
        self._tables: dict[str, Any] = {}

    def recordings(self) -> pd.DataFrame:
        """One row per recording, by date: the columns of :data:`~stepgauge.fleet.schema.RECORDINGS`.

        What is unknown (a hall, a probe) is None. ``measured_at`` is a local time without zone.
        """
        frame: pd.DataFrame = self.index().to_pandas()
        frame = frame.astype(object).where(frame.notna(), None).astype({"measured_at": "datetime64[us]"})
        whole = dict.fromkeys(("rows", "cycles", "faces", "placements", "first_row"), "int64")
        return frame.astype(whole).sort_values(["measured_at", "recording"], ignore_index=True)

    def index(self) -> Any:
        """The same as an Arrow table, as the files lie."""
        arrow = arrow_library()
        tables = [self._table(path) for path in self.live()]
        return arrow.concat_tables(tables) if tables else arrow_schema(RECORDINGS).empty_table()

    def live(self) -> list[Path]:
        """The files of ``recordings/`` that count: no other one takes their place."""
        paths = sorted((self.folder / "recordings").glob("*.parquet"))
        replaced = {name for path in paths for name in _replaces(self._table(path))}
        return [path for path in paths if path.name not in replaced]

    def read(self, recording: str) -> Recording:
        """A recording as it came in, by its key (:class:`InputError` where it is not there)."""
        for one in self.stored([recording]):
            return one.recording()
        raise InputError(self.folder, "this recording is not in the fleet", found=recording)

    def read_many(self, recordings: Collection[str]) -> Iterator[tuple[str, Recording]]:
        """Recordings with their keys, in an order of the store's own: one file is in memory at a time."""
        for one in self.stored(recordings):
            yield one.key, one.recording()

    def stored(self, recordings: Collection[str]) -> Iterator[Stored]:
        """The same as they are sent to where they are worked on.

        What another process packs together meanwhile is found where it is then.
        """
        wanted = set(recordings)
        while wanted:
            files = self._rows_by_file(wanted)
            for name, rows in sorted(files.items()):
                with locked(self.folder, alone=False):
                    columns = read_columns(self.folder / name, rows)
                if columns is None:
                    break  # it is elsewhere now: look again
                for row in rows:
                    wanted.discard(row["recording"])
                    yield make_stored(row, columns)
            if not files:
                return

    def order_keys(self, recordings: Collection[str]) -> list[str]:
        """The keys of these recordings in the order in which :meth:`stored` gives them."""
        return [row["recording"] for _, rows in sorted(self._rows_by_file(recordings).items()) for row in rows]

    def _rows_by_file(self, wanted: Collection[str]) -> dict[str, list[dict[str, Any]]]:
        """The rows of the index of these recordings by the file that they are in, in its order."""
        arrow, index = arrow_library(), self.index()
        keys = arrow.array(sorted(wanted), arrow.string())
        rows = index.filter(needed("pyarrow.compute").is_in(index["recording"], value_set=keys)).to_pylist()
        files: dict[str, list[dict[str, Any]]] = {}
        for row in sorted(rows, key=lambda row: row["first_row"]):
            files.setdefault(row["file"], []).append(row)
        return files

    def gauge(self, certificate: str) -> Gauge:
        """The gauge as certified, by the key of its certificate."""
        return _read_gauge(self.folder / "objects" / "gauge", certificate)

    def machine(self, machine_file: str) -> Machine:
        """The machine as its file says, by the key of that."""
        return _read_machine(self.folder / "objects" / "machine", machine_file)

    def keep(self, kind: str, files: Mapping[Path, bytes]) -> str:
        """Keep a certificate (``gauge``) or a machine file (``machine``) with its files; returns the key."""
        return keep(self.folder / "objects" / kind, files)

    def add(self, entries: Sequence[Entry]) -> tuple[list[str], list[str]]:
        """Add recordings: all of them or, after a kill, none; returns the keys of the new ones and of those known.

        :class:`InputError` where one is there already, as of another owner, date, gauge or machine file.
        """
        keyed = {recording_key(entry.recording): entry for entry in entries}
        with locked(self.folder, alone=True):
            known = self._known(keyed)
            new = {key: entry for key, entry in keyed.items() if key not in known}
            if new:
                self._write(new)
        return list(new), [key for key in keyed if key in known]

    def _known(self, keyed: Mapping[str, Entry]) -> set[str]:
        index = self.index()
        there = arrow_library().compute.is_in(index["recording"], value_set=arrow_library().array(list(keyed)))
        known = index.filter(there).select(["recording", *FIXED, "name"]).to_pylist()
        for row in known:
            _check_same(row, keyed[row["recording"]])
        return {row["recording"] for row in known}

    def _write(self, new: Mapping[str, Entry]) -> None:
        parts: dict[tuple[str, str], dict[str, Entry]] = {}
        for key in sorted(new, key=lambda key: (new[key].measured_at, key)):
            parts.setdefault((str(new[key].owners["machine"]), new[key].month), {})[key] = new[key]
        rows: list[dict[str, Any]] = []
        for (machine, month), part in parts.items():
            tables = (make_probings(key, entry) for key, entry in part.items())
            path = write_rows(self._partition(machine, month), tables, PROBINGS)
            rows += _index_rows(part, path.relative_to(self.folder).as_posix())
        sources = [{"recording": key, "source": entry.source} for key, entry in new.items()]
        table = arrow_library().Table.from_pylist(sources, arrow_schema(SOURCES))
        write_rows(self.folder / "sources", [table], SOURCES)
        self.write_index(arrow_library().Table.from_pylist(rows, arrow_schema(RECORDINGS)))

    def _partition(self, machine: str, month: str) -> Path:
        return self.folder / "probings" / f"machine={quote(machine, safe=' ')}" / f"month={month}"

    def write_index(self, table: Any, replaces: Iterable[str] = ()) -> Path:
        """Make recordings appear, whose probings are on the disk, in place of the files named."""
        table = table.replace_schema_metadata({REPLACES: json.dumps(list(replaces)).encode()})
        return write_rows(self.folder / "recordings", [table], RECORDINGS)

    def _table(self, path: Path) -> Any:
        """A file of ``recordings/``; it never changes, so it is read once."""
        if path.name not in self._tables:
            table = read_rows(path)
            for name, pattern in NAMES.items():
                _check_names(path, table[name], pattern)
            self._tables[path.name] = table
        return self._tables[path.name]


def _check_names(path: Path, names: Any, pattern: str) -> None:
    """:class:`InputError` where what names a file in this folder, or one that is made of it, could name another."""
    fits = needed("pyarrow.compute").match_substring_regex(names, pattern)
    if not all(fits.drop_null().to_pylist()):
        wrong = next(name for name, good in zip(names.to_pylist(), fits.to_pylist(), strict=True) if good is False)
        raise InputError(path, "this is no store of stepgauge: a name leads elsewhere", found=repr(wrong))


def _create(folder: Path) -> None:
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(folder, "this is no store of a fleet", expected="one, or an empty or missing folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot write here: {error.strerror or error}") from None
    with locked(folder, alone=True), appearing(folder / HEAD) as beside:
        beside.write_text(json.dumps({"format": FORMAT, "version": VERSION}) + "\n", encoding="ascii")


def _check_head(folder: Path) -> None:
    try:
        head = json.loads((folder / HEAD).read_bytes())
        found = f"{head['format']} {int(head['version'])}"
    except FileNotFoundError:
        raise InputError(
            folder, "there is no fleet here", expected=f"a folder with {HEAD}: 'fleet add' makes one"
        ) from None
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(folder / HEAD, "this is no store of a fleet", expected=f"{FORMAT} {VERSION}") from None
    if head != {"format": FORMAT, "version": VERSION}:
        raise InputError(folder / HEAD, "not a store of this stepgauge", found=found, expected=f"{FORMAT} {VERSION}")


def _check_same(row: Mapping[str, Any], entry: Entry) -> None:
    given = {**entry.owners, **{name: getattr(entry, name) for name in FIXED if name not in OWNERS}}
    for name in FIXED:
        there = tuple(row[name]) if name == "placement_files" else row[name]
        if there != given[name]:
            raise InputError(
                entry.recording.path,
                f"this recording is in the fleet already, as {row['name']}, with another {name.replace('_', ' ')}",
                found=given[name],
                expected=there,
            )


def _index_rows(part: Mapping[str, Entry], file: str) -> list[dict[str, Any]]:
    rows, first = [], 0
    now = datetime.datetime.now(datetime.UTC).replace(tzinfo=None)
    for key, entry in part.items():
        recording = entry.recording
        rows.append(
            {
                "recording": key,
                **entry.owners,
                "measured_at": entry.measured_at,
                "rows": len(recording),
                "cycles": int(recording.columns["cycle"].max()),
                "faces": len(set(recording.columns["face"].tolist())),
                "placements": len(recording.placements),
                "certificate": entry.certificate,
                "machine_file": entry.machine_file,
                "placement_files": list(entry.placement_files),
                "comments": json.dumps(dict(recording.comments)),
                "columns": json.dumps({name: str(values.dtype) for name, values in recording.columns.items()}),
                "name": Path(recording.path).name,
                "added_at": now,
                "file": file,
                "first_row": first,
            }
        )
        first += len(recording)
    return rows


def _replaces(table: Any) -> list[str]:
    said: list[str] = json.loads((table.schema.metadata or {}).get(REPLACES, b"[]"))
    return said


@cache
def _read_gauge(folder: Path, key: str) -> Gauge:
    return read_gauge(main_file(folder, key))


@cache
def _read_machine(folder: Path, key: str) -> Machine:
    return read_machine(main_file(folder, key))

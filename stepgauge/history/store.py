"""The embedded store: SQLite beside the figure, made from the evaluation.json files and from nothing else.

Every call works on a copy, which takes the place of the store when all went well. A checksum of all rows is among them.
"""

from __future__ import annotations

import datetime
import hashlib
import math
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path

from stepgauge.errors import InputError, naming
from stepgauge.files.checksum import file_digest
from stepgauge.files.outputs import place_of, replacing
from stepgauge.history.entries import UNNAMED, DateFrom, HistoryEntry, read_entries

ANOTHER = naming("rebuild", "store", words="{}, or another {}")
SCHEMA = 5
TABLES = {"entry": "path, placement", "file": "path", "origin": "folder"}
"""The tables and the order of their rows."""
SAME = 1e-6
"""Difference of scale errors, um/m, that is rounding: two measurements differ by more."""
NAMES = tuple(field.name for field in fields(HistoryEntry))
_TYPES = {"int": "INTEGER", "float": "REAL"}
_COLUMNS = ", ".join(f"{field.name} {_TYPES.get(str(field.type), 'TEXT')}" for field in fields(HistoryEntry))


@dataclass(frozen=True)
class Refreshed:
    """All entries by date, and what the look at the files brought: counts, and remarks by file."""

    entries: tuple[HistoryEntry, ...]
    read: int
    unchanged: int
    gone: int
    remarks: tuple[str, ...]


def refresh_store(
    store: str | Path,
    root: str | Path,
    date_from: DateFrom = "record",
    rebuild: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Refreshed:
    """Bring the store up to date with the evaluation.json files below ``root``.

    Only new and changed files are read; entries of files that are gone are dropped. The same call again changes
    nothing. ``rebuild`` throws the store away first (what is no readable store is kept as ``.damaged``). ``progress``
    is told how many of how many files are done.

    Raises
    ------
    InputError
        no such folder, no evaluation in it, a store that is damaged, of another folder or not ours
    """
    folder, path = Path(root), Path(store)
    if not folder.is_dir():
        raise InputError(folder, "no such folder", expected="a folder with evaluation.json files below it")
    files = sorted(folder.rglob("evaluation.json"))
    if not files:
        raise InputError(folder, "no evaluation.json in this folder or below it", expected="results of 'evaluate'")
    said = _set_aside(path) if rebuild and path.exists() else []
    with _open(path, anew=rebuild) as connection:
        _check_origin(connection, path, folder)
        found = _refresh(connection, folder, files, date_from, progress)
    return replace(found, remarks=(*said, *found.remarks))


def _set_aside(path: Path) -> list[str]:
    """Our own store may be replaced; anything else under that name is kept under another, for it may be somebody's."""
    if path.is_dir():
        raise InputError(path, "this is a folder", expected="a file to keep the store in")
    try:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("SELECT path, placement, measured_at FROM entry").fetchall()
        return []
    except (sqlite3.Error, UnicodeError):
        aside = path.with_name(path.name + ".damaged")
        path.replace(aside)
        return [f"what was at {path} was no readable store; it is now {aside.name}"]
    except OSError as error:
        raise InputError(path, f"cannot write here: {error.strerror or error}") from None


@contextmanager
def _open(path: Path, anew: bool) -> Iterator[sqlite3.Connection]:
    """The store to be changed: all of it, or nothing where something fails. ``anew``: an empty one."""
    try:
        with replacing(path) as beside:
            there = place_of(path)
            if there.exists() and there != beside and not anew:
                shutil.copyfile(there, beside)
            with closing(sqlite3.connect(beside)) as connection, connection:
                connection.execute("PRAGMA journal_mode = MEMORY")
                _make_tables(connection, path)
                yield connection
                connection.execute("DELETE FROM seal")
                connection.execute("INSERT INTO seal VALUES (?)", (_checksum(connection),))
    except (sqlite3.Error, UnicodeError) as error:
        if getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
            raise InputError(path, f"cannot be written: {error}") from None
        raise InputError(path, f"the store is damaged or no store of stepgauge: {error}", expected=ANOTHER) from None
    except OSError as error:
        raise InputError(path, f"cannot write here: {error.strerror or error}") from None


def _checksum(connection: sqlite3.Connection) -> str:
    """SHA-256 of all rows."""
    digest = hashlib.sha256()
    for table, order in TABLES.items():
        for row in connection.execute(f"SELECT * FROM {table} ORDER BY {order}"):
            digest.update(f"{table} {row!r}\n".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def _make_tables(connection: sqlite3.Connection, path: Path) -> None:
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    known = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if version != (SCHEMA if known else 0) or (known and known != {*TABLES, "seal"}):
        raise InputError(
            path,
            "not a store of this stepgauge",
            found=f"version {version}, tables {', '.join(sorted(known)) or 'none'}",
            expected=ANOTHER,
        )
    if known:
        if connection.execute("SELECT sha256 FROM seal").fetchall() != [(_checksum(connection),)]:
            raise InputError(path, "the store was changed after it was written", expected=ANOTHER)
        return
    connection.execute("CREATE TABLE seal (sha256 TEXT)")
    connection.execute(f"CREATE TABLE entry ({_COLUMNS})")  # no index: all is there once
    connection.execute("CREATE TABLE file (path TEXT, sha256 TEXT, date_from TEXT, remark TEXT)")
    connection.execute("CREATE TABLE origin (folder TEXT)")
    connection.execute(f"PRAGMA user_version = {SCHEMA}")


def _check_origin(connection: sqlite3.Connection, path: Path, folder: Path) -> None:
    row = connection.execute("SELECT folder FROM origin").fetchone()
    here = str(folder.resolve())
    if row is None:
        connection.execute("INSERT INTO origin VALUES (?)", (here,))
    elif row[0] != here:
        raise InputError(
            path, "this store is of another folder", found=row[0], expected=naming("rebuild", words=f"{{}}, or {here}")
        )


def _refresh(
    connection: sqlite3.Connection,
    folder: Path,
    files: list[Path],
    date_from: DateFrom,
    progress: Callable[[int, int], None] | None,
) -> Refreshed:
    known = {name: (sha, how) for name, sha, how in connection.execute("SELECT path, sha256, date_from FROM file")}
    present, read = set(), 0
    for number, path in enumerate(files, 1):
        name, sha256 = path.relative_to(folder).as_posix(), file_digest(path)
        present.add(name)
        if known.get(name) != (sha256, date_from):
            if name in known:
                _forget(connection, name)
            _replace(connection, path, folder, sha256, date_from)
            read += 1
        if progress is not None:
            progress(number, len(files))
    gone = sorted(set(known) - present)
    for name in gone:
        _forget(connection, name)
    entries, twice = _without_copies(_entries(connection))
    remarks = [
        f"left out: {text}"
        for (text,) in connection.execute("SELECT remark FROM file WHERE remark != '' ORDER BY path")
    ]
    return Refreshed(tuple(entries), read, len(files) - read, len(gone), (*remarks, *twice))


def _replace(connection: sqlite3.Connection, path: Path, folder: Path, sha256: str, date_from: DateFrom) -> None:
    """Read one file anew; one that cannot be used is remembered with the reason."""
    name, remark = path.relative_to(folder).as_posix(), ""
    try:
        entries = read_entries(path, folder, sha256, date_from)
    except InputError as error:
        entries, remark = [], error.cli_text()
    marks = ", ".join("?" * len(NAMES))
    connection.executemany(f"INSERT INTO entry VALUES ({marks})", [_row(entry) for entry in entries])
    connection.execute("INSERT INTO file VALUES (?, ?, ?, ?)", (name, sha256, date_from, remark))


def _forget(connection: sqlite3.Connection, name: str) -> None:
    connection.execute("DELETE FROM entry WHERE path = ?", (name,))
    connection.execute("DELETE FROM file WHERE path = ?", (name,))


def _row(entry: HistoryEntry) -> list[object]:
    values = [getattr(entry, name) for name in NAMES]
    return [value.isoformat() if isinstance(value, datetime.datetime) else value for value in values]


def _entries(connection: sqlite3.Connection) -> list[HistoryEntry]:
    rows = connection.execute(f"SELECT {', '.join(NAMES)} FROM entry ORDER BY measured_at, path, placement")
    return [_read_row(row) for row in rows]


def _read_row(row: tuple[object, ...]) -> HistoryEntry:
    """NaN is stored as NULL by SQLite."""
    values = dict(zip(NAMES, row, strict=True))
    values["measured_at"] = datetime.datetime.fromisoformat(str(values["measured_at"]))
    return HistoryEntry(**{name: float("nan") if value is None else value for name, value in values.items()})  # type: ignore[arg-type]


def _without_copies(entries: list[HistoryEntry]) -> tuple[list[HistoryEntry], list[str]]:
    """A measurement counts once, in however many folders it was evaluated, alone or together with others.

    One that names its machine goes first, then one that was evaluated with the fewest others.
    """
    first: dict[int, HistoryEntry] = {}
    known: dict[tuple[str, str], list[HistoryEntry]] = {}
    for entry in sorted(entries, key=lambda one: (one.machine == UNNAMED, len(_measured_in(one)))):
        places = [(sha256, entry.certificate) for sha256 in _measured_in(entry)]
        like = [one for place in places for one in known.get(place, ())]
        first[id(entry)] = next((one for one in like if _is_same(one, entry)), entry)
        for place in places if first[id(entry)] is entry else ():
            known.setdefault(place, []).append(entry)
    kept = [one for one in entries if first[id(one)] is one]
    files = {one.path for one in kept}
    said = {
        f"{one.path}{f', placement {one.placement}' if one.path in files else ''}: the same as {its.path}, counted once"
        for one in entries
        if (its := first[id(one)]).path != one.path
    }
    return kept, sorted(said)


def _measured_in(one: HistoryEntry) -> list[str]:
    """Checksums of the recordings in which a placement may be; of the evaluation where these are not known."""
    return one.recording_sha256.split() or [one.sha256]


def _is_same(one: HistoryEntry, other: HistoryEntry) -> bool:
    """Whether entries with a recording in common are of one placement of it, which numbers on among others."""
    if one.path == other.path:
        return False
    if sorted(_measured_in(one)) == sorted(_measured_in(other)):
        return one.placement == other.placement
    alike = math.isclose(one.scale_ppm, other.scale_ppm, rel_tol=SAME, abs_tol=SAME)
    return alike and (one.direction, one.cycles) == (other.direction, other.cycles)

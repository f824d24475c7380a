"""Recordings in files, with what is known of them, into the store.

Whose a recording is follows from what its file says, from a roster, and from what is stated for all files of a call. A
key that a file and the roster both state must agree.

The roster: a table (CSV) that says whose the recordings are that do not say it themselves.

With a column ``recording`` it has a row for each file, by its path from the roster's folder or by its name; with a
column ``machine`` alone, a row for each machine. An empty cell says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from itertools import islice
from pathlib import Path

from stepgauge.errors import InputError, naming
from stepgauge.files.dates import first_moment, moment_in_path, parse_moment
from stepgauge.files.outputs import one_set
from stepgauge.files.tables import read_rows
from stepgauge.files.text import read_text
from stepgauge.fleet.content import read_with_files
from stepgauge.fleet.store import Entry, Fleet
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import parse_placement
from stepgauge.machine.file import Machine, check_recorded, read_machine
from stepgauge.recording import Recording, read_recording
from stepgauge.recording.identity import check_recording

PORTION_ROWS = 400_000
"""Probings that are held in memory until they are written."""
KEYS = {
    "machine": ("machine_id",),
    "type": ("machine_type", "model_line"),
    "hall": ("hall",),
    "probe": ("probe_id",),
    "gauge": ("gauge_id",),
}
"""Comments of a recording that state its owners."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class StatedIdentity:
    """What is stated for all recordings of a call, None or empty where nothing is.

    ``owners``: by name; ``gauge``, ``machine``: files, or names of shipped ones; ``placements``: files, in the order of
    the placements.
    """

    owners: Mapping[str, str | None] = field(default_factory=dict)
    measured_at: str | None = None
    gauge: str | None = None
    machine: str | None = None
    placements: Sequence[str] = ()
    roster: str | None = None


def add_files(
    fleet: Fleet, paths: Sequence[str], stated: StatedIdentity, progress: Progress | None = None
) -> tuple[list[str], list[str]]:
    """Add recordings; returns the keys of the new ones and of those that were there.

    Every file is checked as ``evaluate`` does, against its gauge, before it is added. What was added stays where a
    later file is wrong; the same call again goes on.

    Parameters
    ----------
    fleet : the store
    paths : recordings, CSV or Parquet
    stated : what is known of them besides what they say
    progress : told how many of how many files are done
    """
    new, known, kept = list[str](), list[str](), _ReadFiles(fleet, stated)
    entries = (kept.entry(path) for path in paths)
    for some in _portions(entries):
        for total, keys in zip((new, known), fleet.add(some), strict=True):
            total += keys
        if progress is not None:
            progress(len(new) + len(known), len(paths))
    return new, known


def _portions(entries: Iterable[Entry]) -> Iterator[list[Entry]]:
    """As many as may be held in memory, at least one."""
    left = iter(entries)
    while some := list(islice(left, 1)):
        while sum(len(one.recording) for one in some) < PORTION_ROWS and (more := list(islice(left, 1))):
            some += more
        yield some


class _ReadFiles:
    """The roster, and the certificates and machine files that were read and kept so far."""

    def __init__(self, fleet: Fleet, stated: StatedIdentity) -> None:
        self.fleet, self.stated = fleet, stated
        self.roster = Roster.read(stated.roster) if stated.roster else Roster()
        self._gauges: dict[str, tuple[Gauge, str]] = {}
        self._machines: dict[str, tuple[Machine, str]] = {}

    def entry(self, path: str) -> Entry:
        """A file with all that belongs to it, checked."""
        with one_set():
            recording = read_recording(path)
        row = self.roster.of(path, _own(recording, "machine", "") or self.stated.owners.get("machine"))
        gauge, certificate = self._gauge(recording, row)
        machine, machine_file = self._machine(row)
        owners = self._owners(recording, row, gauge, machine)
        check_recording(recording, gauge)
        if machine is not None:
            check_recorded(recording.comments, machine)
        placements = tuple(map(read_text, row.files("placement_file") or self.stated.placements))
        self._check_placements(recording, placements, gauge)
        moment = self._moment(recording, row)
        return Entry(recording, owners, moment, certificate, machine_file, placements, Path(path).read_bytes())

    def _owners(self, recording: Recording, row: Row, gauge: Gauge, machine: Machine | None) -> dict[str, str | None]:
        owners = {name: _agreed(name, recording, row, self.stated.owners.get(name)) for name in KEYS}
        owners["gauge"] = owners["gauge"] or gauge.table.serial
        owners["machine"] = owners["machine"] or recording.comments.get("machine")
        if owners["machine"] is None and machine is not None:
            owners["machine"] = machine.table.name
        if not owners["machine"]:
            expected = naming("machine_id", "roster", words="its comment 'machine_id', {} or {}")
            raise InputError(recording.path, "nothing says of which machine this is", expected=expected)
        return owners

    def _gauge(self, recording: Recording, row: Row) -> tuple[Gauge, str]:
        """The gauge of a recording: the one of the roster, else the one of the call."""
        name = row.file("gauge_file") or self.stated.gauge
        if name is None:
            expected = naming("gauge", "roster", words="{} or the gauge_file of a {}")
            raise InputError(recording.path, "nothing says with which gauge this was measured", expected=expected)
        return self._read_gauge(name)

    def _read_gauge(self, name: str) -> tuple[Gauge, str]:
        if name not in self._gauges:
            gauge, files = read_with_files(read_gauge, name)
            self._gauges[name] = gauge, self.fleet.keep("gauge", files)
        return self._gauges[name]

    def _machine(self, row: Row) -> tuple[Machine | None, str | None]:
        """The machine file of a recording, likewise; only a diagnosis needs it."""
        name = row.file("machine_file") or self.stated.machine
        return (None, None) if name is None else self._read_machine(name)

    def _read_machine(self, name: str) -> tuple[Machine, str]:
        if name not in self._machines:
            machine, files = read_with_files(read_machine, name)
            self._machines[name] = machine, self.fleet.keep("machine", files)
        return self._machines[name]

    @staticmethod
    def _check_placements(recording: Recording, texts: Sequence[str], gauge: Gauge) -> None:
        if texts and len(texts) != len(recording.placements):
            found, expected = len(texts), f"{len(recording.placements)} or none"
            raise InputError(recording.path, "one placement file per placement", found=found, expected=expected)
        for text in texts:
            parse_placement(text, recording.path, gauge)

    def _moment(self, recording: Recording, row: Row) -> datetime:
        text = recording.comments.get("measured_at")
        if text is not None:
            return parse_moment(str(first_moment(text, recording.path)), recording.path)
        if said := row.get("measured_at") or self.stated.measured_at:
            return parse_moment(said, row.where or naming("measured_at"))
        if (found := moment_in_path(Path(recording.path))) is not None:
            return found
        expected = naming("measured_at", "roster", words="its comment 'measured_at', {}, {} or a date in its path")
        raise InputError(recording.path, "nothing says when this was measured", expected=expected)


def _own(recording: Recording, name: str, default: str | None = None) -> str | None:
    """What the file itself says of an owner."""
    return next((recording.comments[key].strip() for key in KEYS[name] if key in recording.comments), default)


def _agreed(name: str, recording: Recording, row: Row, for_all: str | None) -> str | None:
    """An owner as the file, the roster or the call states it; what the file says may not be contradicted."""
    own, other = _own(recording, name), row.get(name) or for_all
    if own and other and own != other:
        where = row.where if row.get(name) else recording.path
        raise InputError(
            where, f"the recording {Path(recording.path).name} states another {name}", found=other, expected=own
        )
    return own or other or None


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

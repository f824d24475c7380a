"""The journal of a measurement: one JSON line per point, on the disk before the next one is measured.

The first line says what is measured. A line that a power cut or a kill left unfinished is dropped: its point was never
acknowledged, and is measured again.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from stepgauge.errors import InputError, naming, reading
from stepgauge.files.lines import DurableLines, Read, Row, held, read_lines, sync_folder
from stepgauge.motion.moves import Program
from stepgauge.recording import POSITION

FORMAT = "stepgauge measurement journal 1"
SUFFIX = ".journal"


def journal_of(output: str | Path) -> Path:
    """The journal beside an output."""
    return Path(f"{output}{SUFFIX}")


def fingerprint(program: Program, **others: object) -> str:
    """By which a plan is known again: SHA-256 of its moves, its settings, and what else may not change."""
    arrays = (program.position_mm, program.approach, program.point)
    moves = b"".join(np.ascontiguousarray(np.round(array, 6) + 0.0).tobytes() for array in arrays)
    stated = json.dumps([repr(program.settings), sorted((key, str(value)) for key, value in others.items())])
    return hashlib.sha256(moves + stated.encode()).hexdigest()


@dataclass
class Journal(DurableLines):
    """An open journal; ``rows`` are the points that are on the disk, by their number in the program, from 1."""

    head: Row
    rows: dict[int, Row] = field(default_factory=dict)

    @property
    def began_s(self) -> float:
        """When the measurement was begun, by the clock of the computer (``time.time()``)."""
        try:
            return datetime.datetime.fromisoformat(str(self.head["started"])).timestamp()
        except (KeyError, ValueError):
            raise InputError(self.path, "the journal does not say when it was begun") from None

    def add(self, point: int, row: Row) -> None:
        """Put a point on the disk; when this returns, it is acknowledged."""
        if point in self.rows:
            raise InputError(self.path, f"point {point} is there twice")
        self.write({"point": point, **row})
        self.rows[point] = row

    def finish(self) -> None:
        """The measurement is complete."""
        self.write({"end": len(self.rows)})


def start(path: Path, head: Row) -> Journal:
    """A new journal; :class:`InputError` where an unfinished one, or a file of another kind, is in its place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with held(path) as file:
        if _is_unfinished(path):
            expected = naming("resume", words="{} to go on with it, or delete it to begin anew")
            raise InputError(path, "an unfinished measurement is here", expected=expected)
        file.truncate(0)
    journal = Journal(path, {"format": FORMAT, **head}, _file=file)
    journal.write(journal.head)
    sync_folder(path.parent)
    return journal


def resume(path: Path, head: Row) -> Journal:
    """The journal of a measurement that was broken off, to go on with.

    :class:`InputError` where there is none, and where it is that of another plan, machine, gauge or placement.
    """
    if not path.is_file():
        raise InputError(path, "there is no journal to resume", expected="a measurement that was begun")
    with held(path) as file:
        journal, whole = _read(path)
        if whole:  # else it was broken off before its first line was on the disk
            _check_same(journal, head)
        journal.go_on(file, whole)
    if not whole:
        journal.head = {"format": FORMAT, **head}
        journal.write(journal.head)
    return journal


def _check_same(journal: Journal, head: Row) -> None:
    for key, value in head.items():
        found = journal.head.get(key)
        if key != "started" and found != value:
            what = f"this is the journal of another {key}"
            raise InputError(journal.path, what, found=str(found)[:40], expected=str(value)[:40])


def _read(path: Path) -> tuple[Journal, int]:
    """The journal of a file, and how many of its bytes are whole lines."""
    read = read_lines(path)
    journal = Journal(path, read.lines[0] if read.lines else {}, last=read.last)
    if read.lines and journal.head.get("format") != FORMAT:
        raise InputError(path, "this is no journal of a measurement", expected=FORMAT)
    for number, line in enumerate(read.lines[1:], 2):
        if "end" not in line:
            journal.rows[_point(line, journal, read, number)] = {key: line[key] for key in line if key != "point"}
        elif line != {"end": len(journal.rows)}:
            raise read.damaged(number)
    return journal, read.size


def _point(line: Row, journal: Journal, read: Read, number: int) -> int:
    point = line.get("point")
    values = [value for key, value in line.items() if key != "point"]
    good = all(isinstance(value, int | float) and math.isfinite(value) for value in values)
    good = good and set(POSITION) <= line.keys()
    if not (good and isinstance(point, int) and 1 <= point <= journal.head.get("points", 0)) or point in journal.rows:
        raise read.damaged(number)
    return point


def look(path: Path) -> Journal:
    """What is on the disk of a measurement that goes on, was broken off or is done; nothing is held or written."""
    return _read(path)[0]


def _is_unfinished(path: Path) -> bool:
    """Whether points are in a journal that has no end; one that was refused before its first point is none.

    :class:`InputError` for a file that is no journal: it is somebody's.
    """
    with reading(path, "journal"):
        data = path.read_bytes() if path.exists() else b""
    whole = data.split(b"\n")[:-1]
    if data and FORMAT.encode() not in (whole or [data])[0] and not b'{"format": '.startswith(data[:11]):
        raise InputError(path, "this file is no journal of a measurement", expected="another name")
    return len(whole) > 1 and not whole[-1].startswith(b'{"end"')

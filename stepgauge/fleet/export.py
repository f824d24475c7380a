"""Recordings out of the store: the files that came in, byte for byte, with their certificates and machine files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from stepgauge.errors import InputError
from stepgauge.files.names import safe_name
from stepgauge.files.tables import csv_text
from stepgauge.files.text import replacing, write_text
from stepgauge.fleet.content import kept_files
from stepgauge.fleet.disk import locked
from stepgauge.fleet.query import query
from stepgauge.fleet.roster import COLUMNS
from stepgauge.fleet.rows import read_rows
from stepgauge.fleet.schema import needed
from stepgauge.fleet.store import Fleet

ROSTER = "roster.csv"


def export(fleet: Fleet, folder: str | Path, where: str = "true") -> list[Path]:
    """Write recordings into a folder, with a roster by which 'fleet add' makes the same fleet of them again.

    Parameters
    ----------
    fleet : the store
    folder : for ``recordings/``, ``gauge/``, ``machine/``, ``placement/`` and the roster (made if missing)
    where : which ones: a condition of SQL on the view ``recordings``

    Returns
    -------
    The files of the recordings.
    """
    target = Path(folder)
    chosen = query(fleet, f"SELECT recording FROM recordings WHERE {where}")["recording"].to_pylist()
    frame = fleet.recordings()
    frame = frame[frame["recording"].isin(chosen)]
    if frame.empty:
        raise InputError(fleet.folder, "no recording of the fleet is meant", found=where)
    names = _file_names(frame)
    written = [
        _write(target / "recordings" / names[str(row["recording"])], row["source"])
        for row in _sources(fleet, set(chosen))
    ]
    rows = [_roster_row(row, names, fleet, target) for row in frame.itertuples(index=False)]
    write_text(target / ROSTER, csv_text(COLUMNS, rows))
    return written


def _file_names(frame: pd.DataFrame) -> dict[str, str]:
    """The names that came in, as every system takes them; where several recordings have one, the key is before it."""
    names = frame["name"].map(lambda name: safe_name(str(name)))
    often = names.str.casefold().duplicated(keep=False)
    pairs = zip(frame["recording"], names, often, strict=True)
    return {str(key): f"{key}-{name}" if several else name for key, name, several in pairs}


def _sources(fleet: Fleet, chosen: set[str]) -> Any:
    """Key and source of the chosen recordings, file after file."""
    arrow = needed("pyarrow.compute")
    keys = needed("pyarrow").array(sorted(chosen))
    with locked(fleet.folder, alone=False):
        for path in sorted((fleet.folder / "sources").glob("*.parquet")):
            yield from read_rows(path, filters=arrow.field("recording").isin(keys)).to_pylist()


def _write(path: Path, data: bytes) -> Path:
    with replacing(path) as beside:
        beside.write_bytes(data)
    return path


def _roster_row(row: Any, names: dict[str, str], fleet: Fleet, target: Path) -> list[str]:
    cells = {name: getattr(row, name) for name in ("machine", "type", "hall", "probe", "gauge")}
    cells["recording"] = f"recordings/{names[row.recording]}"
    cells["measured_at"] = row.measured_at.isoformat()
    cells["gauge_file"] = _copied(fleet, "gauge", row.certificate, target)
    cells["machine_file"] = _copied(fleet, "machine", row.machine_file, target)
    placements = [f"placement/{row.recording}-{number}.toml" for number in range(1, len(row.placement_files) + 1)]
    for name, text in zip(placements, row.placement_files, strict=True):
        write_text(target / name, text)
    cells["placement_file"] = ";".join(placements)
    return ["" if cells[name] is None else str(cells[name]) for name in COLUMNS]


def _copied(fleet: Fleet, kind: str, key: str | None, target: Path) -> str | None:
    """The kept files beside the recordings, once; the main one by its way from the target."""
    if key is None:
        return None
    files = kept_files(fleet.folder / "objects" / kind, key)
    for name, data in files.items():
        place = target / kind / key / name
        if not (place.is_file() and place.read_bytes() == data):
            _write(place, data)
    return f"{kind}/{key}/{next(iter(files))}"

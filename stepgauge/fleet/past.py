"""The evaluations of a store as entries of a history, as 'stepgauge history' takes them from a folder of results."""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from stepgauge.errors import InputError
from stepgauge.fleet.results import tables_of
from stepgauge.fleet.store import Fleet
from stepgauge.history.entries import HistoryEntry

_NUMBERS = {field.name for field in fields(HistoryEntry) if field.type == "float"}


def history_entries(fleet: Fleet) -> list[HistoryEntry]:
    """One entry for each placement that was evaluated, by date; the machine and gauge are those of the store.

    :class:`InputError` where nothing was evaluated yet.
    """
    table = next((one for one in tables_of(fleet) if one.folder.name == "evaluations"), None)
    if table is None:
        raise InputError(fleet.folder, "nothing in this fleet was evaluated yet", expected="'fleet evaluate' first")
    identity = {row["recording"]: row for row in fleet.index().to_pylist()}
    rows = [row for row in table.read().to_pylist() if not row["error"]]
    found = [_entry(row, identity[row["recording"]], fleet) for row in rows]
    return sorted(found, key=lambda entry: (entry.measured_at, entry.path, entry.placement))


def _entry(row: Mapping[str, Any], identity: Mapping[str, Any], fleet: Fleet) -> HistoryEntry:
    moment: datetime.datetime = identity["measured_at"]
    known: dict[str, Any] = {name: math.nan if row.get(name) is None else row.get(name) for name in _NUMBERS}
    return HistoryEntry(
        **known,
        path=f"{identity['recording']}/{identity['name']}",
        sha256=identity["recording"],
        measured_at=moment,
        date_source="fleet",
        machine=identity["machine"],
        gauge_serial=identity["gauge"],
        certificate=fleet.gauge(identity["certificate"]).certificate.number,
        placement=row["placement"],
        direction=row["direction"],
        cycles=row["cycles"],
        simulated=row.get("simulated") or 0,
    )

"""Exports of a TwinCAT scope: lists of names and properties, then a pair of columns, ms and value, a channel."""

from __future__ import annotations

from dataclasses import replace

from stepgauge.files.units import find_unit
from stepgauge.importing.tables.grid import Table


def named_by_scope(table: Table) -> Table:
    """The table with names for its columns where the file is such an export; another one as it is."""
    if "starttime of export" not in table.facts:
        return table
    stated = {**table.facts, **dict(zip(table.headers[0::2], table.headers[1::2], strict=False))}
    width = max(len(row) for row in table.rows)
    names = ["time" if place % 2 == 0 else f"reading {place // 2 + 1}" for place in range(width)]
    unit = find_unit(stated.get("Unit", stated.get("unit", "")))
    units = [find_unit("ms") if place % 2 == 0 else unit if unit and unit.name else None for place in range(width)]
    return replace(table, headers=["time", "reading"] if width == 2 else names, units=units)

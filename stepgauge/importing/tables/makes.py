"""Exports whose columns say by position or by a convention of their make what they are."""

from __future__ import annotations

import re
from dataclasses import replace

from stepgauge.files.numerals import number
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.grid import Table

_IN_PIXELS = re.compile(r"d[xy]|(?:RA|DEC)(?:Raw|Guide)Distance")
_SCALE = re.compile(r"([\d.]+) arc-?sec/px")


def named_by_make(table: Table) -> Table:
    """The table with names and units for its columns where it is such an export; another one as it is."""
    if "starttime of export" in table.facts:
        return _read_scope(table)
    scale = _SCALE.search(table.facts.get("pixel scale", ""))
    return _read_guide_log(table, number(scale[1])) if scale else table


def _read_scope(table: Table) -> Table:
    """A TwinCAT scope: lists of names and properties, then a pair of columns, ms and value, a channel."""
    stated = {**table.facts, **dict(zip(table.headers[0::2], table.headers[1::2], strict=False))}
    width = max(len(row) for row in table.rows)
    names = ["time" if place % 2 == 0 else f"reading {place // 2 + 1}" for place in range(width)]
    unit = find_unit(stated.get("Unit", stated.get("unit", "")))
    units = [find_unit("ms") if place % 2 == 0 else unit if unit and unit.name else None for place in range(width)]
    return replace(table, headers=["time", "reading"] if width == 2 else names, units=units)


def _read_guide_log(table: Table, arcsec_per_pixel: float) -> Table:
    """A guide log of PHD2: times in s, distances in pixels, and what a pixel is in the text above."""
    units = list(table.units)
    scaled = replace(table, units=units)
    for place, header in enumerate(table.headers):
        if _IN_PIXELS.fullmatch(header):
            scaled.known[place] = table.numbers(place) * arcsec_per_pixel
            units[place] = find_unit("arcsec")
        elif header == "Time":
            units[place] = find_unit("s")
    return scaled

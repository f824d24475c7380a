"""The cells of columns as numbers, times and what is recorded besides: the same for points and for an axis."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.units import Unit, column_name, find_unit
from stepgauge.importing.tables.clock import Clock, counted_clock, is_date, joined, read_clock
from stepgauge.importing.tables.columns import Column, Role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer
from stepgauge.importing.tables.vocabulary import WORDS, split_name

DECIMALS = 9
"""Of mm, deg C and mm/s that were turned from other units: a picometre, and no digits of the machine's arithmetic."""


def finite(table: Table, column: Column) -> Array:
    """A column that must be numbers; :class:`InputError` names the cell that is none."""
    values = table.numbers(column.place)
    mark = "comma" if table.decimal == "," else "point"
    check_finite(table, column, values, f"a number with decimal {mark}")
    return values


def check_finite(table: Table, column: Column, values: Array, expected: object) -> None:
    """:class:`InputError` for the first cell of a column that is no number."""
    wrong = ~np.isfinite(values)
    if wrong.any():
        row = int(wrong.argmax())
        cell = table.cells(column.place)[row]
        found = "nothing" if cell == "" else repr(str(cell))
        what = "has no number in any row" if wrong.all() else "is not a number"
        raise InputError(table.at(row), f"column {column.header!r} {what}", found=found, expected=expected)


def scaled(values: Array, unit: Unit) -> Array:
    """Numbers in the unit of a recording."""
    same = unit.factor == 1.0 and unit.offset == 0.0
    return values if same else np.round(values * unit.factor + unit.offset, DECIMALS)


def clock_of(table: Table, columns: Sequence[Column], time_unit: str | None, decisions: Decisions) -> Clock | None:
    """Seconds: numbers in the column's unit, also hours, minutes and seconds apart; or dates and times of day.

    None for columns without cells. A column of dates beside one of times of day is left out where it has none. Numbers
    of which nothing states the unit are asked for.
    """
    columns = [one for one in columns if any(cell != "" for cell in table.first_cells(one.place))]
    if not columns:
        return None
    values = {one.place: table.numbers(one.place) for one in columns}
    counted = [one for one in columns if np.isfinite(values[one.place]).all() and _part_of_time(one) is not None]
    if counted and len(counted) == len(columns):
        finest = min(counted, key=lambda one: _part_of_time(one) or 0.0)
        parts = [values[one.place] * (_part_of_time(one) or 0.0) for one in counted]
        apart = len(counted) > 1 and float(values[finest.place].max()) < 60.0
        seconds = np.sum(parts, axis=0) if apart else parts[counted.index(finest)]
        if finest.unit is None and (_part_of_time(finest) or 0.0) > 1.0 and not np.diff(seconds).all():
            decisions.reject(f"{finest.header!r} as the time", "several rows have the same, and no column has the rest")
            return None
        return Clock(_past_midnight(seconds) if apart else seconds, None, ())
    if len(columns) == 1 and np.isfinite(values[columns[0].place]).all():
        return _unstated(table, columns[0], time_unit, decisions)
    columns = [one for one in columns if one not in counted or len(columns) == 1]
    columns = sorted(columns, key=lambda one: not is_date(one.header))[:2]
    cells = [table.cells(one.place) for one in columns]
    if len(columns) == 2:
        with suppress(InputError):
            return read_clock(joined(*cells), table.at, columns[0].header)
    return read_clock(cells[-1], table.at, columns[-1].header)


def _unstated(table: Table, column: Column, time_unit: str | None, decisions: Decisions) -> Clock:
    """Numbers without a unit: counts since a known moment, or in the unit that is stated by hand; else a question."""
    seconds, words = counted_clock(table.numbers(column.place))
    unit = None if time_unit is None else find_unit(time_unit)
    if words is None and unit is None and np.ptp(seconds):
        ways = [QuestionAnswer("time_unit", name) for name in ("s", "ms", "min", "h")]
        ignored = QuestionAnswer("columns", f"{Role.IGNORE}={column.called}", "to leave it out")
        found = f"{seconds.min():g} to {seconds.max():g}"
        decisions.ask(table.path, f"the unit of the times {column.called!r} is not stated", *ways, ignored, found=found)
    factor = unit.factor if unit is not None and words is None else 1.0
    return Clock(seconds * factor, None, () if words is None else (words,))


def _part_of_time(one: Column) -> float | None:
    """Seconds of one of a column of time: by its unit, or by its name."""
    if one.unit is not None and one.unit.quantity == "time" and "epoch" not in one.header.casefold():
        return one.unit.factor
    parts = {"hour": 3600.0, "minute": 60.0, "second": 1.0}
    return next((seconds for part, seconds in parts.items() if one.name.casefold() in WORDS[part]), None)


def _past_midnight(seconds: Array) -> Array:
    """Times of day in hours, minutes and seconds, from the first one on."""
    found = seconds + 86400.0 * np.cumsum(np.r_[0, np.diff(seconds) < -43200.0])
    return np.asarray(found - found[0])


def beside(table: Table, columns: Sequence[Column], taken: Collection[str] = ()) -> tuple[dict[str, Array], list[str]]:
    """Numbers in every row that were recorded besides, by name, and the headers of columns that are none.

    A temperature is in deg C, under a name that says so: the laws know it by that. ``taken``: names that are used.
    """
    kept: dict[str, Array] = {}
    dropped = []
    for one in columns:
        values, unit = table.numbers(one.place), one.unit or split_name(one.header)[1]
        unit = unit or (find_unit(one.header.strip("[]()")) if one.header[0] in "[(" else None)
        name = column_name(one.header)
        if unit is not None and unit.quantity == "temperature":
            values, name = scaled(values, unit), _temperature_name(one.header)
        gaps = int((~np.isfinite(values)).sum())
        if not gaps and name not in kept and name not in taken:
            kept[name] = values
        else:
            some = f" (no number in {gaps} of {len(values)} rows)" if 0 < gaps < len(values) else ""
            dropped.append(f"{one.header}{some}")
    return kept, dropped


def _temperature_name(header: str) -> str:
    """The name of a column of temperatures in a recording: ``Material_C`` for ``Material [degC]``."""
    name = split_name(header)[0].strip(" []()")
    return f"{'temperature' if find_unit(name) else column_name(name)}_C"

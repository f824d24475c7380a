"""Tables of positions along the gauge, without x, y and z: known by the nominal positions of its faces.

Whatever a report calls its faces (``Feature``, ``Merkmal``, ``ID``, the title of a block), and also where it names
nothing, positions that are all those of the gauge say which face a row is of.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.units import LENGTH_MM
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.tables.cells import text_of
from stepgauge.importing.tables.columns import VALUE_ROLES, Column, Role, axis_role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, shown
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import says, split_name, words_of
from stepgauge.recording.identity import exchanged

MOST_OFF_MM = 0.5
"""Readings are nearer to the nominal positions of their faces."""
SAME_MM = 6e-5
"""Certified positions with four digits behind the point, rounded, are as near to those of the gauge."""
_NUMBER_BEHIND = re.compile(r"\D*?(\d{1,6})(?:\.0+)?\s*")


def faces_along(table: Table, listed: Targets, unit_mm: float = 1.0) -> NDArray[np.intp] | None:
    """Which face every row is of, from 0, where a column holds nominal positions of the gauge; None where none does.

    They are in the unit of the column, else in ``unit_mm``. One that is named as the target, or not at all, may hold
    them in any unit, also in another one than it states: it will be asked.
    """
    for place, header in enumerate(table.headers):
        name, unit = split_name(header)
        unit = table.units[place] or unit
        values = table.numbers(place)
        told = values * (unit_mm if unit is None else unit.factor)
        open_ = (unit is None or unit.quantity == "length") and (not name or axis_role(name) == Role.TARGET)
        other = listed.unit_of(values) if open_ and not listed.lists(told) else None
        if other is not None or listed.lists(told):
            told = told if other is None else values * LENGTH_MM[other]
            return np.abs(told[:, None] - listed.nominal).argmin(axis=1)
    return None


def header_answer(table: Table, first: Sequence[str], listed: Targets | None) -> QuestionAnswer:
    """The names of all columns of a table without a header: those that fit the gauge, else ``first``, to be typed."""
    fitting = "" if listed is None else _fitting_header(table, listed)
    if fitting:
        return QuestionAnswer("header", fitting)
    names = [*first, *(f"column {place + 1}" for place in range(len(first), _width(table)))]
    return QuestionAnswer("header", words="for the names of all columns", suggestions=(f'"{",".join(names)}"',))


def _width(table: Table) -> int:
    return max(map(len, table.rows))


def numbers_behind(table: Table, place: int) -> Array:
    """The whole number at the end of every cell of a column (7 of ``FACE_07``), NaN for none."""
    matches = [_NUMBER_BEHIND.fullmatch(text_of(cell)) for cell in table.cells(place)]
    return np.array([np.nan if match is None else float(match[1]) for match in matches])


def check_names(table: Table, nominal: int, listed: Targets) -> None:
    """Where a column counts the faces, as most of its cells do, no two of them are exchanged.

    ``nominal``: the column of their nominal positions, ``listed``: in its unit.
    """
    values = table.numbers(nominal)
    face = 1.0 + np.abs(values[:, None] - listed.nominal).argmin(axis=1)
    for place in range(len(table.headers)):
        named = numbers_behind(table, place)
        wrong = np.flatnonzero(named != face)
        faces = exchanged(named[wrong], face[wrong]) if 0 < 2 * len(wrong) < len(named) else ""
        if faces and np.isfinite(values).all():
            row = int(wrong[0])
            found = f"{text_of(table.cells(place)[row])} at {values[row]:g}"
            expected = f"{listed.nominal[int(named[row]) - 1]:g}, as the gauge has it"
            raise InputError(table.at(row), f"faces {faces} look exchanged", found=found, expected=expected)


def check_measured(table: Table, listed: Targets) -> None:
    """A table of nominal and certified positions with their uncertainty is no measurement of the gauge."""
    roles = [axis_role(split_name(header)[0]) for header in table.headers]
    words = [words_of(split_name(header)[0]) for header in table.headers]
    face = faces_along(table, listed)
    if face is None or not any(one[:1] == ("u",) or says(one, "uncertainty") for one in words):
        return
    values = [place for place, role in enumerate(roles) if role in VALUE_ROLES]
    copied = [place for place in values if _are_certified(table, place, listed, face)]
    if values == copied and (copied or roles.count(Role.TARGET) > 1):
        what = f"this looks like a certificate of {listed.name} (nominal and certified positions, U), no measurement"
        expected = "columns of readings, such as Actual or Run 1"
        raise InputError(table.path, what, found=", ".join(filter(None, table.headers))[:200], expected=expected)


def check_placements(table: Table, roles: Sequence[Column], layout: TableLayout, decisions: Decisions) -> None:
    """Asks which placement of a gauge is meant where there are several: each is a recording of its own."""
    column = next((one for one in roles if one.role == Role.PLACEMENT), None)
    texts = [] if column is None else sorted({text_of(cell).strip() for cell in table.cells(column.place)})
    if column is None or len(texts) < 2 or f"{column.called}=*" in layout.rows:
        return
    ways = [QuestionAnswer("rows", f"{column.called}={text}") for text in texts]
    ways.insert(1, QuestionAnswer("placement", words="of each one in turn, for the errors of the machine"))
    ways.insert(2, QuestionAnswer("rows", f"{column.called}=*", "where it lay along the same axis"))
    what = "the gauge was placed several times, and each placement is a recording of its own"
    decisions.ask(table.path, what, *ways, found=f"{column.called!r}, {shown(texts)}")


def _are_certified(table: Table, place: int, listed: Targets, face: NDArray[np.intp]) -> bool:
    """Whether numbers are certified positions, or their deviations from the nominal ones, digit by digit."""
    unit = table.units[place] or split_name(table.headers[place])[1]
    factors = [LENGTH_MM["mm"], LENGTH_MM["um"]] if unit is None else [unit.factor]
    off = [table.numbers(place) * factor - listed.certified[face] for factor in factors]
    return any((np.abs(one) < SAME_MM).all() or (np.abs(one + listed.nominal[face]) < SAME_MM).all() for one in off)


def _fitting_header(table: Table, listed: Targets) -> str:
    """Names for the columns of a table without a header, of which one holds nominal positions; empty for none."""
    numbers = [table.numbers(place) for place in range(_width(table))]
    units = [unit for unit in map(listed.unit_of, numbers) if unit is not None]
    unit = "mm" if "mm" in units or not units else units[0]
    numbers = [values * LENGTH_MM[unit] for values in numbers]
    on_list = [place for place, values in enumerate(numbers) if listed.lists(values)]
    if not on_list:
        return ""
    nominal = min(on_list, key=lambda place: listed.off_list(numbers[place]))
    face = 1.0 + np.abs(numbers[nominal][:, None] - listed.nominal).argmin(axis=1)
    counts = [p for p in range(len(numbers)) if p != nominal and np.array_equal(numbers_behind(table, p), face)]
    near = [p for p in range(len(numbers)) if p not in (nominal, *counts) and _follows(numbers[p], numbers[nominal])]
    names = [f"column {place + 1}" for place in range(len(numbers))]
    names[nominal] = f"nominal_{unit}"
    for run, place in enumerate(near, 1):
        names[place] = f"run {run}_{unit}" if len(near) > 1 else f"reading_{unit}"
    for place in counts[:1]:
        names[place] = "face"
    return ",".join(names)


def _follows(values: Array, nominal: Array) -> bool:
    """Whether numbers are readings of positions, each near to its own."""
    there = np.isfinite(values)
    return bool(there.any() and (np.abs(values - nominal)[there] < MOST_OFF_MM).all())

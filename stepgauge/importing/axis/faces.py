"""Tables of positions along the gauge, without x, y and z: known by the nominal positions of its faces.

Whatever a report calls its faces (``Feature``, ``Merkmal``, ``ID``, the title of a block), and also where it names
nothing, positions that are all those of the gauge say which face a row is of.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.tables.columns import VALUE_ROLES, Role, axis_role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.header import text_of
from stepgauge.importing.tables.questions import QuestionAnswer
from stepgauge.importing.tables.vocabulary import says, split_name, words_of
from stepgauge.recording.identity import exchanged

MOST_OFF_MM = 0.5
"""Readings are nearer to the nominal positions of their faces."""
SAME_MM = 6e-5
"""Certified positions with four digits behind the point, rounded, are as near to those of the gauge."""
_NUMBER_BEHIND = re.compile(r"\D*?(\d{1,6})(?:\.0+)?\s*")


def lists_faces(table: Table, listed: Targets, unit_mm: float = 1.0) -> bool:
    """Whether a column of a table holds nominal positions of the gauge, in its unit or ``unit_mm``.

    One that is named as the target may hold them in any unit, also in another one than it states: it will be asked.
    """
    for place, header in enumerate(table.headers):
        name, unit = split_name(header)
        unit = table.units[place] or unit
        values = table.numbers(place)
        if listed.lists(values * (unit_mm if unit is None else unit.factor)):
            return True
        length = unit is None or unit.quantity == "length"
        if length and axis_role(name) == Role.TARGET and listed.unit_of(values) is not None:
            return True
    return False


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
    certain = any(one[:1] == ("u",) or says(one, "uncertainty") for one in words)
    values = [place for place, role in enumerate(roles) if role in VALUE_ROLES]
    copied = [place for place in values if _are_certified(table.numbers(place), listed)]
    if certain and lists_faces(table, listed) and values == copied and (copied or roles.count(Role.TARGET) > 1):
        what = f"this looks like a certificate of {listed.name} (nominal and certified positions, U), no measurement"
        expected = "columns of readings, such as Actual or Run 1"
        raise InputError(table.path, what, found=", ".join(filter(None, table.headers))[:200], expected=expected)


def _are_certified(values: Array, listed: Targets) -> bool:
    """Whether numbers are certified positions in mm, digit by digit."""
    return bool((np.abs(values[:, None] - listed.certified).min(axis=1) < SAME_MM).all())


def _fitting_header(table: Table, listed: Targets) -> str:
    """Names for the columns of a table without a header, of which one holds nominal positions in mm; empty for none."""
    numbers = [table.numbers(place) for place in range(_width(table))]
    on_list = [place for place, values in enumerate(numbers) if listed.lists(values)]
    if not on_list:
        return ""
    nominal = min(on_list, key=lambda place: listed.off_list(numbers[place]))
    face = 1.0 + np.abs(numbers[nominal][:, None] - listed.nominal).argmin(axis=1)
    counts = [p for p in range(len(numbers)) if p != nominal and np.array_equal(numbers_behind(table, p), face)]
    near = [p for p in range(len(numbers)) if p not in (nominal, *counts) and _follows(numbers[p], numbers[nominal])]
    names = [f"column {place + 1}" for place in range(len(numbers))]
    names[nominal] = "nominal_mm"
    for run, place in enumerate(near, 1):
        names[place] = f"run {run}_mm" if len(near) > 1 else "reading_mm"
    for place in counts[:1]:
        names[place] = "face"
    return ",".join(names)


def _follows(values: Array, nominal: Array) -> bool:
    """Whether numbers are readings of positions, each near to its own."""
    there = np.isfinite(values)
    return bool(there.any() and (np.abs(values - nominal)[there] < MOST_OFF_MM).all())

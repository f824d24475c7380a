"""Tables of any make for the readers of fixed columns: spheres, maps, benches, drift tests, faces of a certificate.

They want columns of known names, whose ends are their units (``x_mm``, ``pretravel_um``). Here a foreign table becomes
one: a column by the words of its name, in the unit of the end. What such a command cannot ask is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.tables import Rows
from stepgauge.files.units import Unit, find_unit
from stepgauge.importing.tables.columns import NORMAL, POINTS, Column, Role, axis_role, point_role, read_columns
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.read import only_table
from stepgauge.importing.tables.source import read_source
from stepgauge.importing.tables.vocabulary import says, signs_of, split_name, words_of
from stepgauge.recording import APPROACH

NOMINAL, CERTIFIED, UNCERTAINTY = "nominal_mm", "position_mm", "uncertainty_um"


def foreign_rows(path: str | Path, required: Sequence[str], plain: Mapping[str, str]) -> Rows:
    """The table with the ``required`` columns, and the others under their names with the unit of their quantity.

    ``plain``: the unit of columns without one in their name, by quantity (``{"length": "um"}``). :class:`InputError`
    where a column is not there or there twice, where the file leaves something open, and for rows of numbers that are
    none of the table.
    """
    table = only_table(read_source(path))
    columns = read_columns(table.headers, table.units, {}, POINTS)
    found: dict[str, NDArray[np.float64]] = {}
    taken = set[int]()
    for name in required:
        one, sign = _column(table, columns, name, plain), 1.0
        if one is None and name in APPROACH:  # a normal points out of the material
            one, sign = _column(table, columns, NORMAL[APPROACH.index(name)], plain), -1.0
        if one is not None:
            stated = None if name in APPROACH else split_name(name)[1]
            found[name] = _convert_unit(table, one, stated or _plain_unit(one, plain)) * sign + 0.0
            taken.add(one.place)
    if CERTIFIED in required and CERTIFIED not in found and NOMINAL in found:
        found[CERTIFIED] = found[NOMINAL] + _deviation_mm(table, columns, str(path))
    missing = [name for name in required if name not in found]
    if missing:
        names = ", ".join(header for header in table.headers if header)
        raise InputError(path, f"column {missing[0]} is missing", found=names[:200], expected=",".join(required))
    for one in columns:
        if one.place not in taken and one.header:
            unit = _plain_unit(one, plain)
            stem = "_".join(one.name.split())
            found[f"{stem}_{unit.name}" if unit is not None and unit.name else stem] = _convert_unit(table, one, unit)
    cells = [["" if np.isnan(value) else f"{value:.12g}" for value in row] for row in zip(*found.values(), strict=True)]
    return Rows(str(path), list(found), cells, table.lines.tolist())


def _plain_unit(one: Column, plain: Mapping[str, str]) -> Unit | None:
    return find_unit(plain.get(one.unit.quantity, "")) if one.unit is not None else None


def _column(table: Table, columns: Sequence[Column], name: str, plain: Mapping[str, str]) -> Column | None:
    """The column of a name: the same words, or a word that says the same; in a unit of the same quantity."""
    stem, unit = (name, None) if name in (*APPROACH, *NORMAL) else split_name(name)
    quantities = {None, _quantity(unit), *(plain if unit is None else ())}
    fit = [one for one in columns if _quantity(one.unit) in quantities]
    alike = [
        one for one in fit if words_of(one.name) == words_of(stem) or one.role == name or _is_of_certificate(one, name)
    ]
    first = table.numbers(alike[0].place) if alike else np.empty(0)
    if any(not np.array_equal(table.numbers(one.place), first, equal_nan=True) for one in alike[1:]):
        found = " and ".join(repr(one.header) for one in alike)
        raise InputError(table.path, f"two columns may be {name}", found=found, expected=f"one column {name}")
    if alike and unit is not None and alike[0].unit is None and point_role(stem, unit) is None:
        found, expected = repr(alike[0].header), f"the unit in its header, or the name {name}"
        raise InputError(table.path, f"the unit of the column for {name} is not stated", found=found, expected=expected)
    return alike[0] if alike else None


def _is_of_certificate(one: Column, name: str) -> bool:
    words = words_of(one.name)
    certified = bool(says(words, "certified")) and not says(words, Role.TARGET)
    role = axis_role(one.name, one.unit)
    if name == UNCERTAINTY:
        return role == Role.U_TARGET or bool(says(words, "uncertainty"))
    return {NOMINAL: role == Role.TARGET and not certified, CERTIFIED: certified or role == Role.READING}.get(
        name, False
    )


def _deviation_mm(table: Table, columns: Sequence[Column], path: str) -> NDArray[np.float64]:
    """Deviations from the nominal positions, measured minus nominal by the words of their name."""
    found = [one for one in columns if signs_of(one.name)]
    signs = signs_of(found[0].name) if len(found) == 1 else set()
    if len(signs) != 1 or found[0].unit is None:
        expected = "positions, or deviations with their unit, whose name says their sign"
        raise InputError(path, "column position_mm is missing", found=table.headers, expected=expected)
    return _convert_unit(table, found[0], find_unit("mm")) * signs.pop()


def _quantity(unit: Unit | None) -> str | None:
    return None if unit is None or unit.quantity == "none" else unit.quantity


def _convert_unit(table: Table, one: Column, wanted: Unit | None) -> NDArray[np.float64]:
    """Numbers of a column in a unit; digits of the file are kept where it is the same."""
    values = table.numbers(one.place)
    if one.unit is None or wanted is None or one.unit.factor == wanted.factor:
        return values
    scaled = (values * one.unit.factor + one.unit.offset - wanted.offset) / wanted.factor
    return np.asarray(np.round(scaled, 12))

"""A table of one axis as one reading per row, whether it has a row or a column per cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.axis.recording import places_of
from stepgauge.errors import InputError, naming
from stepgauge.files.units import Unit
from stepgauge.importing.axis.grid import Grid
from stepgauge.importing.axis.labels import LABEL, Label, parse_label, way_of
from stepgauge.importing.axis.roles import (
    CYCLE,
    DEVIATIONS,
    FROM,
    PLACEMENT,
    READING,
    TARGET,
    TIME,
    TO,
    U_TARGET,
    UNSIGNED,
    VALUE_ROLES,
    WAY,
    Role,
)
from stepgauge.importing.axis.travel import cycles_of_repeats
from stepgauge.importing.clock import Clock, is_date, joined, read_clock

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True)
class Long:
    """Readings in the order in which they were taken, ``n`` of them.

    ``row (n,)``: row of the grid of each; ``target``, ``value``, ``u_target``: in the units of their columns;
    ``value_role``: what the value is (reading, deviation, correction, or unknown); ``way``, ``cycle``: nought where
    nothing states them;
    ``clock``: of the rows of the grid; ``stations``: names of both;
    ``others``: numbers recorded besides; ``dropped``: columns that were not.
    """

    row: Whole
    value: Array
    value_role: str
    value_unit: Unit | None
    value_header: str
    target: Array | None
    target_unit: Unit | None
    u_target: Array | None
    way: Whole
    cycle: Whole
    placement: Whole
    time_s: Array | None
    clock: Clock | None
    stations: tuple[list[str], list[str]] | None
    others: dict[str, Array]
    dropped: list[str]


def to_long(grid: Grid, roles: Sequence[Role], missing: bool) -> Long:
    """One reading per row; ``missing``: whether cells of readings may be empty.

    :class:`InputError` names the row and column of what is no number, and the option that settles what is ambiguous.
    """
    columns = _value_columns(grid, roles)
    roles = [replace(one, role=READING) if one.role is None and one in columns else one for one in roles]
    row, value, way, cycle = _taken(grid, roles, columns, missing)
    target = _only(roles, TARGET)
    u_target = _only(roles, U_TARGET)
    others, dropped = _others(grid, roles)
    clock = _clock(grid, roles)
    return Long(
        row,
        value,
        columns[0].role or READING,
        columns[0].unit,
        columns[0].header,
        None if target is None else _numbers(grid, target)[row],
        None if target is None else target.unit,
        None if u_target is None else _numbers(grid, u_target)[row],
        way,
        cycle,
        np.maximum(_of_rows(grid, roles, PLACEMENT, [LABEL] * len(grid.rows))[row], 1),
        None if clock is None or clock.stands else clock.elapsed_s[row],
        clock,
        _stations(grid, roles, row),
        {name: values[row] for name, values in others.items()},
        dropped,
    )


def _taken(
    grid: Grid, roles: Sequence[Role], columns: Sequence[Role], missing: bool
) -> tuple[Whole, Array, Whole, Whole]:
    """Row, value, direction and cycle of every reading, sweep after sweep and in each column after column."""
    titles = [parse_label(title) for title in grid.titles]
    of_rows = _of_rows(grid, roles, CYCLE, titles) if len(columns) == 1 else _sweeps(grid, roles, columns, titles)
    first = _rank(of_rows)
    picked = [_picked(grid, column, _rising(grid, roles, first == 0), missing) for column in columns]
    row = np.concatenate([rows for rows, _ in picked]).astype(np.int64)
    own = np.repeat(np.arange(len(columns)), [len(rows) for rows, _ in picked])
    stated = np.array([column.label.way for column in columns])[own]
    way = np.where(stated != 0, stated, _of_rows(grid, roles, WAY, titles)[row])
    cycle, value = of_rows[row], np.concatenate([values for _, values in picked])
    if len(columns) == 1:
        return row, value, way, cycle
    of_columns = np.array(_column_cycles(columns))
    cycle = np.where(cycle > 0, (cycle - 1) * of_columns.max() + of_columns[own], 0)
    order = np.argsort(first[row], kind="stable")
    return row[order], value[order], way[order], cycle[order]


def _sweeps(grid: Grid, roles: Sequence[Role], columns: Sequence[Role], titles: Sequence[Label]) -> Whole:
    """Of every row of a table with a column per direction or cycle, how often the targets have begun again, from 1.

    A column of cycles, or lines between the blocks, say it; else a target that comes again, unless the headers count
    the cycles. Nought where only a list of targets can tell.
    """
    stated = _of_rows(grid, roles, CYCLE, titles)
    if stated.all():
        return stated
    target = _only(roles, TARGET)
    if any(one.label.cycle for one in columns):
        return np.ones(len(grid.rows), np.int64)
    if target is None:
        return np.full(len(grid.rows), int(max(_column_cycles(columns)) > 1))
    return cycles_of_repeats(places_of(_numbers(grid, target)), _of_rows(grid, roles, PLACEMENT, titles))


def _rank(values: Whole) -> Whole:
    """Every value as its place among the different ones, in the order in which they first appear, from 0."""
    _, at, which = np.unique(values, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(at))[which.ravel()]


def _value_columns(grid: Grid, roles: Sequence[Role]) -> list[Role]:
    """The columns of readings: those of a wide table, or one; readings go before deviations, which follow from them."""
    found: list[Role] = []
    for wanted in (READING, *VALUE_ROLES):
        found = [one for one in roles if one.role == wanted]
        if found:
            break
    found = found or _only_length(grid, roles)
    if not found:
        names = ", ".join(one.header for one in roles if one.header)
        expected = naming("columns", words='{} reading="HEADER" (or deviation="HEADER")')
        raise InputError(grid.path, "no column is named as the reading", found=names, expected=expected)
    if len(found) > 1 and any(one.label == LABEL for one in found):
        names = " and ".join(repr(one.header) for one in found[:3])
        expected = naming("columns", words=f'{{}} {found[0].role}="HEADER" for the right one')
        raise InputError(grid.path, f"several columns may be the {found[0].role}", found=names, expected=expected)
    _check_sign(grid, found[0])
    _check_labels(grid, found)
    return sorted(found, key=lambda one: (one.label.cycle, one.place))


def _check_sign(grid: Grid, column: Role) -> None:
    """The words of a name agree on the sign of its values."""
    if column.role == UNSIGNED:
        words = '{} deviation="HEADER" (reading minus target) or {} correction="HEADER" (target minus reading)'
        expected = naming("columns", "columns", words=words)
        raise InputError(grid.path, "the name of a column contradicts itself", found=column.header, expected=expected)


def _check_labels(grid: Grid, columns: Sequence[Role]) -> None:
    """Every column of a wide table is a cycle and a direction of its own."""
    seen: dict[Label, Role] = {}
    for one in columns:
        other = seen.setdefault(one.label, one)
        if one.label.cycle and other is not one:
            found = f"{other.header!r} and {one.header!r}"
            expected = "cycle and direction in the name of every column, as +1 and -1, or 'Run 1 fwd' and 'Run 1 back'"
            raise InputError(grid.path, "two columns are the same cycle and direction", found=found, expected=expected)


def _only_length(grid: Grid, roles: Sequence[Role]) -> list[Role]:
    """The one column in a unit of length or angle, where none is named as a reading; else the only number besides."""
    free = [one for one in roles if one.role is None and np.isfinite(grid.numbers(one.place)).all()]
    lengths = [one for one in free if one.unit is not None and one.unit.quantity in ("length", "angle")]
    return lengths if len(lengths) == 1 else free if len(free) == 1 and not lengths else []


def _column_cycles(columns: Sequence[Role]) -> list[int]:
    """The cycle of every column: as its name says, else counted among those of its direction."""
    if all(one.label.cycle for one in columns):
        return [one.label.cycle for one in columns]
    counts: dict[int, int] = {}
    found = []
    for one in columns:
        counts[one.label.way] = counts.get(one.label.way, 0) + 1
        found.append(counts[one.label.way])
    return found


def _picked(grid: Grid, column: Role, rising: bool, missing: bool) -> tuple[Whole, Array]:
    """Rows and values of one column in the order of travel: upwards in the table for a column of the way back."""
    values = grid.numbers(column.place)
    empty = np.array([cell in ("", "-", "--") for cell in grid.cells(column.place)])
    if not missing:
        _check_numbers(grid, column, values, naming("accept", words="a number (empty: {} missing)"))
    rows = np.flatnonzero(~empty & np.isfinite(values)) if missing else np.arange(len(values))
    _check_numbers(grid, column, np.where(empty, 0.0, values), "a number")
    if column.label.way < 0 and rising:
        rows = rows[::-1]
    return rows, values[rows]


def _rising(grid: Grid, roles: Sequence[Role], sweep: NDArray[np.bool_]) -> bool:
    target = _only(roles, TARGET)
    values = np.zeros(2) if target is None else grid.numbers(target.place)[sweep]
    return bool(values[-1] > values[0])


def _numbers(grid: Grid, column: Role) -> Array:
    values = grid.numbers(column.place)
    _check_numbers(grid, column, values, f"a number with decimal {'comma' if grid.decimal == ',' else 'point'}")
    return values


def _check_numbers(grid: Grid, column: Role, values: Array, expected: object) -> None:
    wrong = ~np.isfinite(values)
    if wrong.any():
        row = int(wrong.argmax())
        cell = grid.cells(column.place)[row]
        found = "nothing" if cell == "" else repr(str(cell))
        raise InputError(grid.at(row), f"column {column.header!r} is not a number", found=found, expected=expected)


def _only(roles: Sequence[Role], role: str) -> Role | None:
    return next((one for one in roles if one.role == role), None)


def _of_rows(grid: Grid, roles: Sequence[Role], role: str, titles: Sequence[Label]) -> Whole:
    """Cycle, placement or way of every row of the grid: from its column, else from the line above the block."""
    column = _only(roles, role)
    if column is None:
        return np.array([one.way if role == WAY else one.cycle for one in titles])
    cells = grid.cells(column.place)
    if role != WAY:
        labels = [parse_label(str(int(c)) if isinstance(c, float) else str(c)).cycle for c in cells]
        return np.array(labels if all(labels) else np.unique([str(c) for c in cells], return_inverse=True)[1] + 1)
    ways = [(int(np.sign(c)) if abs(c) == 1.0 else 0) if isinstance(c, float) else _way(str(c)) for c in cells]
    if not all(ways):
        row = ways.index(0)
        expected = naming("constants", words="+, -, forward or backward; or {} direction=+ for all")
        what = f"column {column.header!r} is no direction of travel"
        raise InputError(grid.at(row), what, found=repr(str(cells[row])), expected=expected)
    return np.array(ways)


def _way(text: str) -> int:
    plain = {"1": 1, "1.0": 1, "-1.0": -1}
    return plain.get(text.strip()) or way_of(text) or parse_label(text).way


def _clock(grid: Grid, roles: Sequence[Role]) -> Clock | None:
    """Seconds: numbers in the column's unit, or dates and times of day, in one column or two."""
    columns = [one for one in roles if one.role == TIME]
    columns = [one for one in columns if any(cell != "" for cell in grid.cells(one.place))]
    if not columns:
        return None
    values = grid.numbers(columns[0].place)
    if len(columns) == 1 and np.isfinite(values).all():
        unit = columns[0].unit
        return Clock(values * (unit.factor if unit is not None and unit.quantity == "time" else 1.0), None, ())
    columns = sorted(columns, key=lambda one: not is_date(one.header))[:2]
    cells = [grid.cells(one.place) for one in columns]
    return read_clock(cells[0] if len(columns) == 1 else joined(*cells), grid.at, columns[0].header)


def _stations(grid: Grid, roles: Sequence[Role], row: Whole) -> tuple[list[str], list[str]] | None:
    near, far = _only(roles, FROM), _only(roles, TO)
    if near is None or far is None:
        return None
    names = [[f"{c:g}" if isinstance(c, float) else str(c) for c in grid.cells(one.place)] for one in (near, far)]
    return [names[0][n] for n in row], [names[1][n] for n in row]


def _others(grid: Grid, roles: Sequence[Role]) -> tuple[dict[str, Array], list[str]]:
    """Numbers in every row that were recorded besides, and the columns that were not kept."""
    kept: dict[str, Array] = {}
    dropped = []
    for one in roles:
        if one.role is not None or not one.header:
            dropped += [one.header] if one.role == "dropped" and one.header else []
            continue
        values = grid.numbers(one.place)
        name = one.header.replace(",", " ").replace('"', " ").strip()
        if np.isfinite(values).all() and name not in kept:
            kept[name] = values
        else:
            dropped.append(one.header)
    unused = [one.header for one in roles if one.role in DEVIATIONS and any(r.role == READING for r in roles)]
    return kept, dropped + unused

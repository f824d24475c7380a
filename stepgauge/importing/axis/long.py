"""A table of one axis as one reading per row, whether it has a row or a column per cycle."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.recording import STATIONS, places_of
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.units import Unit
from stepgauge.importing.axis.travel import cycles_of_repeats
from stepgauge.importing.tables.cells import is_empty, text_of
from stepgauge.importing.tables.clock import Clock
from stepgauge.importing.tables.columns import DEVIATIONS, VALUE_ROLES, Column, Role, axis_role, called, is_known
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.kinds import directions_in
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, column_answer, shown
from stepgauge.importing.tables.rivals import one_of
from stepgauge.importing.tables.values import beside, check_finite, clock_of, finite
from stepgauge.importing.tables.vocabulary import LABEL, WORDS, Label, parse_label, title_label, way_of, words_of

Whole = NDArray[np.int64]


@dataclass(frozen=True)
class Long:
    """Readings in the order in which they were taken.

    ``columns``: a reading per row, with placement, cycle and way (nought where nothing states them), value, and where
    they are known target, u_target, time_s and both stations, in the units of their columns; ``column``: of the
    values, ``target``: of the targets, ``way``: of the directions;
    ``others``: numbers recorded besides; ``clock``: of the rows of the table;
    ``dropped``: columns that were not recorded.
    """

    columns: dict[str, NDArray[Any]]
    column: Column
    target: Column | None
    way: Column | None
    others: dict[str, Array]
    clock: Clock | None
    dropped: list[str]

    @property
    def target_unit(self) -> Unit | None:
        return None if self.target is None else self.target.unit

    def numbers(self, name: str) -> Array | None:
        """A column of the frame; None where it is not there."""
        return self.columns.get(name)

    @property
    def value(self) -> Array:
        return self.columns["value"]

    @property
    def has_stations(self) -> bool:
        return STATIONS[0] in self.columns


def to_long(
    table: Table, roles: Sequence[Column], missing: bool, ordered: bool, time_unit: str | None, decisions: Decisions
) -> Long:
    """One reading per row; ``missing``: whether cells of readings may be empty; ``ordered``: whether columns are in the
    order of the runs, whatever it is; ``time_unit``: of counts of time.

    :class:`InputError` names the row and column of what is no number, and the option that settles what is ambiguous.
    """
    columns = _value_columns(table, roles, missing, decisions)
    roles = [replace(one, role=Role.READING) if one.role is None and one in columns else one for one in roles]
    row, value, way, cycle = _taken(table, roles, columns, missing, ordered, decisions)
    target, u_target, near, far = (_only(roles, role) for role in (Role.TARGET, Role.U_TARGET, Role.FROM, Role.TO))
    others, dropped = beside(table, [one for one in roles if one.role is None and one.header])
    dropped += [one.header for one in roles if one.role == Role.DROPPED and one.header]
    dropped += [one.header for one in roles if one.role in DEVIATIONS and any(r.role == Role.READING for r in roles)]
    clock = clock_of(table, [one for one in roles if one.role == Role.TIME], time_unit, decisions)
    placement = np.maximum(_row_numbers(table, roles, Role.PLACEMENT, [LABEL] * len(table.titles))[row], 1)
    found = {"placement": placement, "cycle": cycle, "way": way, "value": value}
    if target is not None:
        found["target"] = _targets(table, target)[row]
    if u_target is not None:
        found["u_target"] = finite(table, u_target)[row]
    if clock is not None and not clock.stands:
        found["time_s"] = clock.elapsed_s[row]
    if near is not None and far is not None:
        for name, one in zip(STATIONS, (near, far), strict=True):
            found[name] = np.array([text_of(cell) for cell in table.cells(one.place)], object)[row]
    others = {name: values[row] for name, values in others.items()}
    column = replace(columns[0], role=columns[0].role or Role.READING)
    return Long(found, column, target, _only(roles, Role.WAY), others, clock, dropped)


def _taken(
    table: Table, roles: Sequence[Column], columns: Sequence[Column], missing: bool, ordered: bool, decisions: Decisions
) -> tuple[Whole, Array, Whole, Whole]:
    """Row, value, direction and cycle of every reading, sweep after sweep and in each column after column."""
    titles = [title_label(title) for title in table.titles]
    of_rows = (
        _row_numbers(table, roles, Role.CYCLE, titles) if len(columns) == 1 else _sweeps(table, roles, columns, titles)
    )
    if len(columns) == 1 and columns[0].label.way == 0:
        row, value = _picked(table, columns[0], False, missing, decisions)
        return row.astype(np.int64), value, _ways(table, roles, titles, decisions)[row], of_rows[row]
    first = _rank(of_rows)
    picked = [_picked(table, column, _rising(table, roles, first == 0), missing, decisions) for column in columns]
    row = np.concatenate([rows for rows, _ in picked]).astype(np.int64)
    own = np.repeat(np.arange(len(columns)), [len(rows) for rows, _ in picked])
    stated = np.array([column.label.way for column in columns])[own]
    way = np.where(stated != 0, stated, _ways(table, roles, titles, decisions)[row])
    cycle, value = (
        of_rows[row],
        np.concatenate(
            [values * _to_first(table, column, columns[0]) for column, (_, values) in zip(columns, picked, strict=True)]
        ),
    )
    if len(columns) == 1:
        return row, value, way, cycle
    of_columns = np.array(_column_cycles(columns))
    cycle = np.where(cycle > 0, (cycle - 1) * of_columns.max() + of_columns[own], 0)
    order = np.argsort(first[row] if ordered or _forward_first(columns) else row, kind="stable")
    return row[order], value[order], way[order], cycle[order]


def _forward_first(columns: Sequence[Column]) -> bool:
    """Whether columns stand as a test is run: in no cycle the way back before the way there.

    Columns that are sorted by their names, ``bwd`` before ``fwd``, show no order of the readings.
    """
    first: dict[int, int] = {}
    for column in columns:
        first.setdefault(column.label.cycle, column.label.way)
    return {one.label.way for one in columns} != {1, -1} or all(way > 0 for way in first.values())


def _to_first(table: Table, column: Column, first: Column) -> float:
    """What turns numbers of a column into the unit of the first one of a wide table."""
    if column.unit == first.unit:
        return 1.0
    if column.unit is None or first.unit is None or column.unit.quantity != first.unit.quantity:
        found, expected = f"{first.header!r} and {column.header!r}", "the unit in the name of every column, or of none"
        raise InputError(table.path, "columns of readings have other units, or none", found=found, expected=expected)
    return column.unit.factor / first.unit.factor


def _sweeps(table: Table, roles: Sequence[Column], columns: Sequence[Column], titles: Sequence[Label]) -> Whole:
    """Of every row of a table with a column per direction or cycle, how often the targets have begun again, from 1.

    A column of cycles, or lines between the blocks, say it; else a target that comes again, unless the headers count
    the cycles. Nought where only a list of targets can tell.
    """
    stated = _row_numbers(table, roles, Role.CYCLE, titles)
    if stated.all():
        return stated
    target = _only(roles, Role.TARGET)
    if any(one.label.cycle for one in columns):
        return np.ones(len(table.lines), np.int64)
    if target is None:
        return np.full(len(table.lines), int(max(_column_cycles(columns)) > 1))
    return cycles_of_repeats(places_of(_targets(table, target)), _row_numbers(table, roles, Role.PLACEMENT, titles))


def _rank(values: Whole) -> Whole:
    """Every value as its place among the different ones, in the order in which they first appear, from 0."""
    return np.asarray(pd.factorize(values)[0]).astype(np.int64)


def _value_columns(table: Table, roles: Sequence[Column], missing: bool, decisions: Decisions) -> list[Column]:
    """The columns of readings: those of a wide table, or one; readings go before deviations, which follow from them."""
    by_role = ([one for one in roles if one.role == wanted] for wanted in (Role.READING, *VALUE_ROLES))
    found = next(filter(None, by_role), None) or _only_length(table, roles)
    if not found:
        named = [one for one in roles if one.header]
        free = [one for one in named if one.role is None and np.isfinite(table.numbers(one.place)).all()]
        places = [one for one in free if set(words_of(one.name)) <= WORDS["place"]]
        read = [one for one in free if one not in places] or free or named
        ways = [column_answer(role, one.header) for one in read for role in (Role.READING, DEVIATIONS[0])]
        ways[2:2] = [column_answer(Role.TARGET, one.header) for one in places if one not in read]
        alike = Counter(re.sub(r"\d+", "*", one.header) for one in free).most_common(1)
        ways = [column_answer(Role.READING, name, "if all are runs") for name, n in alike if n > 1] + ways
        names = ", ".join(one.header for one in named)
        decisions.ask(table.path, "no column is named as the reading", *ways, found=names)
        decisions.settle()
    if len(found) > 1 and any(one.label == LABEL for one in found):
        found = [one_of(table, found[0].role or Role.READING, found, decisions)]
    _check_sign(table, found[0], decisions)
    if len(found) > 1:
        _check_whole(table, found, missing, decisions)
    return sorted(found, key=lambda one: (one.label.cycle, one.place))


def _check_sign(table: Table, column: Column, decisions: Decisions) -> None:
    """The words of a name agree on the sign of its values."""
    if column.role == Role.UNSIGNED:
        ways = [
            column_answer("deviation", column.header, "(reading minus target)"),
            column_answer("correction", column.header, "(target minus reading)"),
        ]
        decisions.ask(table.path, "the name of a column contradicts itself", *ways, found=column.header)


def _check_whole(table: Table, columns: Sequence[Column], missing: bool, decisions: Decisions) -> None:
    """Every column of a wide table is a cycle and a direction of its own, and every direction has as many cycles."""
    labels, ways = Counter(one.label for one in columns), Counter(one.label.way for one in columns)
    twice = [one for one in columns if one.label.cycle and labels[one.label] > 1]
    counted = all(one.label.cycle for one in columns)
    even = not any(one.label.cycle for one in columns) and len(ways) == 2 and len(set(ways.values())) == 1
    if twice or not (counted or even or missing):
        rivals = twice or [one for one in columns if ways[one.label.way] == max(ways.values())]
        settled = [column_answer(Role.IGNORE, called(one, columns)) for one in rivals]
        settled += [] if twice else [QuestionAnswer("accept", "missing", "where all are runs")]
        what = "columns are the same cycle and direction" if twice else "the columns are no whole runs there and back"
        decisions.ask(table.path, what, *settled, found=shown([repr(one.header) for one in rivals], " and "))


def _only_length(table: Table, roles: Sequence[Column]) -> list[Column]:
    """The one column in a unit of length or angle, where none is named as a reading; else the only number besides."""
    free = [one for one in roles if one.role is None and (_is_run(one) or not is_known(one.name))]
    free = [one for one in free if _has_numbers(table, one.place)]
    lengths = [one for one in free if one.unit is not None and one.unit.quantity in ("length", "angle")]
    if (
        len(free) > 1 and lengths and set(words_of(lengths[0].name)) <= WORDS["place"]
    ):  # the other one may be read there
        return []
    return lengths if len(lengths) == 1 else free if len(free) == 1 and not lengths else []


def _is_run(one: Column) -> bool:
    """Whether a column is named as one run: ``Run 1``, with its readings below."""
    return one.label != LABEL and axis_role(one.name) in (Role.CYCLE, Role.WAY)


def _has_numbers(table: Table, place: int) -> bool:
    """Whether a column has numbers and cells without a value alone."""
    wrong = np.flatnonzero(~np.isfinite(table.numbers(place)))
    cells = table.cells(place) if len(wrong) else []
    return len(wrong) < len(table) and all(is_empty(cells[row]) for row in wrong)


def _column_cycles(columns: Sequence[Column]) -> list[int]:
    """The cycle of every column: as its name says, else counted among those of its direction."""
    if all(one.label.cycle for one in columns):
        return [one.label.cycle for one in columns]
    counts: dict[int, int] = {}
    found = []
    for one in columns:
        counts[one.label.way] = counts.get(one.label.way, 0) + 1
        found.append(counts[one.label.way])
    return found


def _picked(table: Table, column: Column, rising: bool, missing: bool, decisions: Decisions) -> tuple[Whole, Array]:
    """Rows and values of one column in the order of travel: upwards in the table for a column of the way back.

    Rows without a reading are left out, where that is accepted; else it is asked.
    """
    values = table.numbers(column.place) * column.sign
    rows = np.arange(len(values))
    if not np.isfinite(values).all():
        empty = np.array([is_empty(cell) for cell in table.cells(column.place)])
        check_finite(table, column, np.where(empty, 0.0, values), "a number")
        _leave_out(table, column, np.flatnonzero(empty), missing, decisions)
        rows = np.flatnonzero(~empty)
    rows = rows[::-1] if column.label.way < 0 and rising else rows
    return rows, values[rows]


def _leave_out(table: Table, column: Column, rows: Whole, missing: bool, decisions: Decisions) -> None:
    """Tells which rows have no reading, or asks whether they may have none."""
    numbers = shown([str(table.lines[row]) for row in rows])
    if len(rows) == len(table):
        check_finite(table, column, np.full(len(table), np.nan), "a number")
    if missing:
        decisions.reject(f"rows {numbers} of {column.called!r}", "no reading")
    else:
        found = f"{column.called!r}, rows {numbers}"
        decisions.ask(table.at(rows[0]), "readings are missing", QuestionAnswer("accept", "missing"), found=found)


def _rising(table: Table, roles: Sequence[Column], sweep: NDArray[np.bool_]) -> bool:
    target = _only(roles, Role.TARGET)
    values = np.zeros(2) if target is None else table.numbers(target.place)[sweep]
    return bool(values[-1] > values[0])


def _targets(table: Table, column: Column) -> Array:
    """The targets of all rows: one that stands once for several rows of equal number, in merged cells, is theirs."""
    values = table.numbers(column.place)
    there = np.flatnonzero(np.isfinite(values))
    empty = np.array([cell == "" for cell in table.cells(column.place)]) if len(there) < len(values) else None
    if empty is None or not len(there) or not empty[~np.isfinite(values)].all():
        return finite(table, column)
    each = len(values) / len(there)
    if there[0] or each != int(each) or not (np.diff(np.r_[there, len(values)]) == each).all():
        return finite(table, column)
    return np.repeat(values[there], int(each))


def _only(roles: Sequence[Column], role: str) -> Column | None:
    return next((one for one in roles if one.role == role), None)


def _row_numbers(table: Table, roles: Sequence[Column], role: str, titles: Sequence[Label]) -> Whole:
    """Cycle or placement of every row of the table: from its column, else from the line above the block."""
    column = _only(roles, role)
    if column is None:
        return np.array([one.cycle for one in titles])[table.block]
    cells = table.cells(column.place)
    labels = [parse_label(str(int(c)) if isinstance(c, float) else str(c)).cycle for c in cells]
    numbers = np.array(labels if all(labels) else np.unique([str(c) for c in cells], return_inverse=True)[1] + 1)
    return numbers if np.ptp(numbers) else np.ones(len(cells), np.int64)


def _ways(table: Table, roles: Sequence[Column], titles: Sequence[Label], decisions: Decisions) -> Whole:
    """The direction of every row, nought where nothing states it; asks what texts mean that are no words for one."""
    column, runs = _only(roles, Role.WAY), _only(roles, Role.CYCLE)
    told = [] if column or not runs else [parse_label(str(cell)).way for cell in table.cells(runs.place)]
    if told and all(told):
        return np.array(told)  # as in "2 back"
    if column is None:
        return np.array([one.way for one in titles])[table.block]
    texts = [text_of(cell).strip() for cell in table.cells(column.place)]
    if column.forward:
        ways = [0 if is_empty(text) else 1 if text == column.forward else -1 for text in texts]
    else:
        ways = [_way(text) for text in texts]
    if all(ways):
        return np.array(ways)
    _ask_ways(table, column, np.array(texts), np.array(ways), decisions)
    return np.ones(len(texts), np.int64)  # what follows is asked with it


def _ask_ways(table: Table, column: Column, texts: NDArray[Any], ways: Whole, decisions: Decisions) -> None:
    """Asks which of two texts is the direction +, and names a text or rows that state none."""
    unknown = np.flatnonzero(ways == 0)
    strange = [text for text in texts[unknown].tolist() if not is_empty(text)]
    two = directions_in(texts.tolist()) if strange else []
    choices = [column_answer(Role.WAY, f"{column.called}={kind}", "if it is towards +") for kind in two]
    choices.append(column_answer(Role.IGNORE, column.called, "to have the order of the targets say it"))
    rows = f"nothing, rows {shown([str(table.lines[row]) for row in unknown])}"
    found = " and ".join(map(repr, two or strange[:1])) or rows
    decisions.ask(
        table.at(int(unknown[0])), f"column {column.called!r} is no direction of travel", *choices, found=found
    )


def _way(text: str) -> int:
    plain = {"1": 1, "1.0": 1, "-1.0": -1}
    return plain.get(text) or way_of(text) or parse_label(text).way

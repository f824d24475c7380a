"""The roles that names suggest, compared with one another and with the numbers: what stays open is a question.

Every column is a hypothesis of its name. A rival is excluded by a reason (a copy, a name that goes with that of the
reading, a choice by ``--column``), which is told, or it is asked. A table with targets, readings and deviations states
every deviation twice; targets are set, so they are rounder than readings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.importing.tables.cells import text_of
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.columns import (
    AXIS,
    DEVIATIONS,
    VALUE_ROLES,
    VALUES,
    Column,
    Role,
    called,
    is_known,
    read_columns,
    remainder,
)
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.kinds import check_kinds
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, column_answer, shown
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import LABEL, WORDS, split_name, travel_of, words_of

Chosen = Mapping[str, str]
_COORDINATES = ("x", "y", "z", "height")
MOST_OF_SPOT = 1.0
"""Span, in the unit of a table, of the readings of one spot where other coordinates stand beside them."""
NEAR = 0.01
"""Of a column that is the same in every row: readings that are as near to it may be those of one target."""
FOLLOWS = 0.2
"""Readings follow their targets with slope 1, within this in any unit of the same size."""
AGREES = 0.02
"""Of the span of the deviations, beside their last digits: what is told twice may differ by as much."""
FEWEST_AGAIN = 4
"""Different numbers of a column, each as often as the others, from which that is no chance."""
TEMPERATURES_C = (-80.0, 400.0)
"""What a column of temperatures beside a measurement may hold."""


def settled_roles(
    table: Table, layout: TableLayout, decisions: Decisions, fronts: Mapping[int, str] | None = None
) -> list[Column]:
    """The role of every column; what names and numbers leave open is asked. A choice by hand is not judged.

    ``fronts``: by the place of a column that tells fronts from backs of a gauge, its text of the fronts.
    """
    chosen = layout.columns
    roles = [_recognise_content(table, one) for one in read_columns(table.headers, table.units, chosen, AXIS)]
    for place, text in (fronts or {}).items():
        roles[place] = replace(roles[place], role=Role.WAY, forward=text)
    roles = _without_copies(table, roles, decisions)
    if Role.TARGET not in chosen:
        roles = _one_target(table, roles, decisions)
    roles = _one_coordinate(table, roles, decisions)
    _check_vacant(table, roles, chosen, decisions)
    check_kinds(table, roles, layout, decisions)
    if not chosen:
        _check_told_twice(table, roles, decisions)
    for one in (one for one in roles if one.role is None):
        _check_unnamed(table, one, roles, chosen, decisions)
    return roles


def one_of(
    table: Table, role: str, rivals: Sequence[Column], decisions: Decisions, goes_with: Column | None = None
) -> Column:
    """The column of a role: the one whose name goes with another's, or the first where the others are its copies.

    Any other rival is asked for.
    """
    paired = [] if goes_with is None else [one for one in rivals if remainder(one.name) == remainder(goes_with.name)]
    first, why = (rivals[0], "") if len(paired) != 1 else (paired[0], f"{paired[0].header!r} goes with it by its name")
    values = table.numbers(first.place)
    others = [one for one in rivals if one is not first]
    open_ = [one for one in others if not np.array_equal(table.numbers(one.place), values, equal_nan=True)]
    if open_ and not why:
        ways = [column_answer(role, called(one, rivals)) for one in rivals]
        found = shown([repr(one.header) for one in rivals], " and ")
        decisions.ask(table.path, f"several columns may be the {role}", *ways, found=found)
    for one in others:
        decisions.reject(
            f"column {one.place + 1}, {one.header!r}, as the {role}",
            (why or "asked") if one in open_ else f"a copy of column {first.place + 1}",
        )
    return first


def _recognise_content(table: Table, one: Column) -> Column:
    """A column of times or directions by its cells, where its name says nothing."""
    cells = [cell for cell in table.first_cells(one.place) if cell != ""]
    if one.role is not None or one.unit is not None or not cells:
        return one
    texts = [cell for cell in cells if isinstance(cell, str)]
    if not any(isinstance(cell, str | float) for cell in cells):
        return replace(one, role=Role.TIME)
    if len(texts) == len(cells):
        if {travel_of(text) for text in texts} == {1, -1}:
            return replace(one, role=Role.WAY)
        if all(map(is_moment, texts)):
            return replace(one, role=Role.TIME)
    return one


def _without_copies(table: Table, roles: list[Column], decisions: Decisions) -> list[Column]:
    """Columns of one header and the same numbers are one column."""
    seen: dict[tuple[str, bytes], Column] = {}
    found = []
    for one in roles:
        again = one.role not in (None, Role.DROPPED) and sum(other.header == one.header for other in roles) > 1
        numbers = table.numbers(one.place) if again else np.empty(0)
        key = (one.header.casefold(), numbers.tobytes() if np.isfinite(numbers).any() else one.place.to_bytes(4))
        first = seen.setdefault(key, one)
        if first is not one:
            decisions.reject(f"column {one.place + 1}, {one.header!r}", f"a copy of column {first.place + 1}")
        found.append(one if first is one else replace(one, role=Role.DROPPED))
    return found


def _one_target(table: Table, roles: list[Column], decisions: Decisions) -> list[Column]:
    """The target: by its name, else a place that the readings follow, or whose unit is theirs."""
    targets = [one for one in roles if one.role == Role.TARGET]
    values = [one for one in roles if one.role in VALUES]
    if not targets:
        return _place_as_target(table, roles)
    if len(targets) < 2:
        return roles
    ends = {remainder(one.name) for one in values}
    if len(ends) > 1 and all(remainder(one.name) in ends for one in targets):  # which one, shows with the reading
        first = targets[0]
    else:
        with_name = values[0] if len(ends) == 1 and ends != {frozenset()} else None
        first = one_of(table, Role.TARGET, targets, decisions, with_name)
    return [replace(one, role=None) if one in targets and one is not first else one for one in roles]


def _place_as_target(table: Table, roles: list[Column]) -> list[Column]:
    """A place is the target, where no other column is one and its unit, or its readings, say so."""
    values = [one for one in roles if one.role in VALUE_ROLES]
    labelled = [one for one in roles if one.label != LABEL]
    places = [
        one
        for one in roles
        if one.role is None and words_of(one.name) and set(words_of(one.name)) <= WORDS["place"]
        if one.label == LABEL or (words_of(one.name) == ("pos",) and all(o is one or o.label.cycle for o in labelled))
    ]
    if len(places) != 1 or not values or any(one.role == Role.FROM for one in roles):
        return roles
    if places[0].unit is None and all(one.role == Role.READING for one in values):  # the name alone is not enough
        numbers = table.numbers(places[0].place)
        clocks = [table.numbers(one.place) for one in roles if one.role == Role.TIME]
        again = 2 * len(np.unique(numbers)) <= len(numbers) and not any(_may_be_minutes(numbers, one) for one in clocks)
        if not again and not _follow(table.numbers(values[0].place), numbers):
            return roles
    return [replace(one, role=Role.TARGET, label=LABEL) if one is places[0] else one for one in roles]


def _follow(readings: Array, places: Array) -> bool:
    """Whether readings go with places, one for one, or lie near to the only one."""
    there = np.isfinite(readings) & np.isfinite(places)
    if not there.any():
        return False
    readings, travel = readings[there], places[there] - places[there].mean()
    if not np.ptp(travel):
        return _are_near(readings, float(places[there][0]))
    return abs(float(travel @ readings / (travel @ travel)) - 1.0) < FOLLOWS


def _are_near(readings: Array, place: float) -> bool:
    return bool(np.abs(readings - place).max() < NEAR * abs(place))


def _may_be_minutes(numbers: Array, hours: Array) -> bool:
    """Whether whole numbers below 60 may be the finer part of times that are told in whole numbers below 60."""
    both = np.concatenate([numbers, hours])
    return bool((both == np.floor(both)).all() and both.min() >= 0.0 and both.max() < 60.0)


# roles that no name fills


def _one_coordinate(table: Table, roles: list[Column], decisions: Decisions) -> list[Column]:
    """Of coordinates of one spot that was touched again and again, the one that differs is the reading."""
    if any(one.role in (*VALUE_ROLES, Role.TARGET, Role.FROM) for one in roles):
        return roles
    places = [one for one in roles if one.role is None and one.name.casefold() in _COORDINATES]
    spans = {one.place: float(np.ptp(table.numbers(one.place))) for one in places}
    moving = [one for one in places if spans[one.place] != 0.0]
    if len(moving) != 1 or not spans[moving[0].place] < MOST_OF_SPOT:
        return roles
    decisions.take(f"{moving[0].header!r} is taken as the reading: the other coordinates are the same in every row")
    taken = {one.place: Role.READING if one is moving[0] else Role.DROPPED for one in places}
    return [replace(one, role=taken.get(one.place, one.role)) for one in roles]


def _check_vacant(table: Table, roles: Sequence[Column], chosen: Chosen, decisions: Decisions) -> None:
    """Readings without a target, beside a column that may be it: one that nothing names, or one beside deviations."""
    values = [one for one in roles if one.role in VALUE_ROLES]
    if not values or Role.TARGET in chosen or any(one.role in (Role.TARGET, Role.FROM) for one in roles):
        return
    alone = next((one for one in values if one.label == LABEL), None)
    if alone is not None and sum(one.label != LABEL for one in values) > 1:
        ways = [column_answer(Role.TARGET, alone.called), column_answer(Role.IGNORE, alone.called)]
        what = "columns of runs, another column of values beside them, and no target"
        decisions.ask(table.path, what, *ways, found=repr(alone.header))
        return
    deviation = next((one for one in values if one.role in DEVIATIONS), None)
    reading = next((one for one in values if one.role == Role.READING), None)
    if deviation is not None and reading is not None:
        ways = [
            column_answer(Role.TARGET, reading.called),
            column_answer(Role.IGNORE, deviation.called, "to have the readings alone"),
        ]
        found = f"{reading.header!r} and {deviation.header!r}"
        decisions.ask(table.path, "readings and deviations, and no target", *ways, found=found)
        return
    readings = table.numbers(values[0].place)
    free = [one for one in roles if one.role is None and _may_be_place(table, one, readings)]
    if free:
        ways = [column_answer(Role.TARGET, one.called) for one in free]
        ways.insert(1, column_answer(Role.IGNORE, free[0].called, "if it is something else"))
        what = "readings without a target, and a column that may be the target"
        decisions.ask(table.path, what, *ways, found=shown([repr(one.called) for one in free]))


def _may_be_place(table: Table, one: Column, readings: Array) -> bool:
    """Whether a column that nothing names may hold positions: numbers that differ, or one that the readings are near.

    In no other unit, and no row numbers.
    """
    name, unit = split_name(one.header)
    other = unit is not None and unit.quantity not in ("length", "angle")
    if other or is_known(name) or (name != one.header and unit is None) or name.endswith(("]", ")")):
        return False
    values = table.numbers(one.place)
    if not np.isfinite(values).all():
        return False
    if not np.ptp(values):
        return _are_near(readings, float(values[0]))
    return not (len(values) > 1 and (np.diff(values) == 1.0).all() and values[0] in (0.0, 1.0))


def _check_unnamed(table: Table, one: Column, roles: Sequence[Column], chosen: Chosen, decisions: Decisions) -> None:
    """Of what is recorded besides: temperatures can be some, and both ways alone may be the direction."""
    ignored, values = column_answer(Role.IGNORE, one.called), table.numbers(one.place)
    if one.unit is not None and one.unit.quantity == "temperature":
        celsius = values[np.isfinite(values)] * one.unit.factor + one.unit.offset
        if len(celsius) and not (TEMPERATURES_C[0] <= celsius.min() and celsius.max() <= TEMPERATURES_C[1]):
            what, found = f"{one.header!r} cannot be temperatures", f"{celsius.min():g} to {celsius.max():g} deg C"
            decisions.ask(table.path, what, ignored, found=found)
    there = {other.role for other in roles}
    if Role.WAY in there or Role.WAY in chosen or not there & set(VALUES) or split_name(one.header)[1] is not None:
        return
    ways = {travel_of(text_of(cell)) for cell in table.cells(one.place)} if np.isnan(values).all() else {*values}
    if ways == {1, -1}:
        what, own = f"{one.header!r} holds both directions, and may be the direction of travel", one.called
        decisions.ask(table.path, what, column_answer(Role.WAY, own), ignored)


# what a table says twice


def _check_told_twice(table: Table, roles: list[Column], decisions: Decisions) -> None:
    """Targets, readings and deviations beside one another agree, and targets are the rounder ones."""
    import pandas as pd

    target, reading, deviation = (
        _only(roles, *names) for names in ((Role.TARGET,), (Role.READING,), (Role.DEVIATION, Role.CORRECTION))
    )
    if target is not None and deviation is not None and reading is None:
        _check_rival(table, target, deviation, roles, decisions)
        _check_exchanged(table, target, deviation, decisions)
    if target is None or reading is None:
        return
    _check_exchanged(table, target, reading, decisions)
    places, values = table.numbers(target.place), table.numbers(reading.place)
    if not (np.isfinite(places).all() and np.isfinite(values).all()):
        return
    if deviation is not None and np.isfinite(table.numbers(deviation.place)).all():
        _check_difference(table, target, reading, deviation, decisions)
    if _last_digit(places) >= 0.5 * _last_digit(values):
        return
    different = np.sort(pd.unique(values))
    steps, fewer = np.diff(different), len(different) < len(pd.unique(places))
    even = len(values) == len(different) > 2 and np.allclose(steps, steps[0], rtol=1e-9)
    if fewer or even:
        what = f"{target.header!r} has more digits than {reading.header!r}: are they exchanged?"
        ways = (
            column_answer(Role.TARGET, target.header, "if not"),
            column_answer(Role.TARGET, reading.header, "if so"),
        )
        decisions.ask(table.path, what, *ways)


def _check_exchanged(table: Table, target: Column, value: Column, decisions: Decisions) -> None:
    """Targets come again in every run, each as often, and what is read there does not: else the names are exchanged."""
    often = np.unique(table.numbers(value.place), return_counts=True)[1]
    seldom = 2 * len(np.unique(table.numbers(target.place))) > len(table)
    if len(often) < FEWEST_AGAIN or np.ptp(often) or often[0] < 2 or not seldom:
        return
    names = list(table.headers)
    names[target.place], names[value.place] = value.header, target.header
    what = f"{value.header!r} comes again and again, and {target.header!r} does not: are they exchanged?"
    ways = (QuestionAnswer("header", ";".join(names), "if so"), column_answer(Role.TARGET, target.header, "if not"))
    decisions.ask(table.path, what, *ways)
    decisions.settle()  # all that follows would be of the wrong column


def _check_rival(table: Table, target: Column, deviation: Column, roles: list[Column], decisions: Decisions) -> None:
    """Deviations that are the target minus another column: the other one is the target by them."""
    unit = target.unit or deviation.unit
    per = 1.0 if unit is None else (deviation.unit or unit).factor / unit.factor
    stated = table.numbers(deviation.place) * (-per if deviation.role == Role.CORRECTION else per)
    for other in (one for one in roles if one.role is None and (one.unit or unit) == unit):
        if stated.any() and np.allclose(table.numbers(target.place) - table.numbers(other.place), stated, rtol=1e-6):
            ways = [column_answer(Role.TARGET, one.called) for one in (other, target)]
            what = f"{deviation.header!r} is {target.header!r} minus {other.header!r}: which one is the target?"
            decisions.ask(table.path, what, *ways)


def _only(roles: Sequence[Column], *names: str) -> Column | None:
    found = [one for one in roles if one.role in names]
    return found[0] if len(found) == 1 and found[0].label == LABEL else None


def _check_difference(table: Table, target: Column, reading: Column, deviation: Column, decisions: Decisions) -> None:
    """Deviations are reading minus target, or as their name says the other way round."""
    columns = (target, reading, deviation)
    places, values, stated = (table.numbers(one.place) for one in columns)
    per = [None if one.unit is None else one.unit.factor for one in columns]
    of_target = per[0] or per[1] or 1.0
    told = values * (per[1] or of_target) - places * of_target
    size = float(np.abs(stated).max(initial=0.0))
    ratio = max(float(np.abs(told).max()), 1e-12) / (size or 1.0)
    factor = per[2] or min((1.0, 1e-3, 1e3, 25.4e-3), key=lambda one: abs(np.log(ratio / one)))
    if not size and not per[2]:
        return
    digits = _last_digit(values) * (per[1] or of_target)  # a target is as it is set
    allowed = 2.0 * (digits + _last_digit(stated) * factor) + AGREES * float(np.ptp(told))
    signed = stated * factor * (-1.0 if deviation.role == Role.CORRECTION else 1.0)
    off = np.abs(told - signed)
    if (off <= allowed).all():
        return
    row = int(off.argmax())
    what = f"{deviation.header!r} is not {reading.header!r} minus {target.header!r}"
    what += ": its sign is the other one" if (np.abs(told + signed) <= allowed).all() else ""
    found = f"{stated[row]:g} beside {values[row]:g} and {places[row]:g}"
    ways = (column_answer(Role.READING, reading.header), column_answer(Role.DEVIATION, deviation.header))
    decisions.ask(table.at(row), what, *ways, found=found)


def _last_digit(values: Array) -> float:
    """One of the last decimal that numbers are written with."""
    few = values[:: max(1, len(values) // 200)]
    digits = next((n for n in range(10) if np.allclose(few, np.round(few, n), rtol=0.0, atol=1e-12)), 10)
    return float(10.0**-digits)

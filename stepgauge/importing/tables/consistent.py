"""Columns that say the same thing twice, and numbers that cannot be what their names say: what does not agree is asked.

A table with targets, readings and deviations states every deviation twice. Targets are set, so they are rounder than
readings, and come again. Deviations are a small part of the travel, unless their unit is another one.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from stepgauge.files.arrays import Array
from stepgauge.importing.tables.columns import CORRECTION, DEVIATION, READING, TARGET, VALUES, WAY, Column
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.labels import LABEL
from stepgauge.importing.tables.questions import Choice, Decisions
from stepgauge.importing.tables.vocabulary import split_name

Chosen = Mapping[str, str]
AGREES = 0.02
"""Of the span of the deviations, beside their last digits: what is told twice may differ by as much."""
TEMPERATURES_C = (-80.0, 400.0)
"""What a column of temperatures beside a measurement may hold."""


def check_consistent(
    table: Table, roles: list[Column], chosen: Mapping[str, str], decisions: Decisions
) -> list[Column]:
    """The roles, whose numbers agree with one another; a choice by hand is not judged."""
    target, reading, deviation = (_only(roles, *names) for names in ((TARGET,), (READING,), (DEVIATION, CORRECTION)))
    if not chosen and target is not None and reading is not None:
        if deviation is not None:
            _check_difference(table, target, reading, deviation, decisions)
        _check_rounder(table, target, reading, decisions)
    for one in roles:
        if one.role is None and one.unit is not None and one.unit.quantity == "temperature":
            _check_temperature(table, one, decisions)
    return [_as_counted(table, one, roles, chosen, decisions) for one in roles]


def _only(roles: list[Column], *names: str) -> Column | None:
    found = [one for one in roles if one.role in names]
    return found[0] if len(found) == 1 and found[0].label == LABEL else None


def _check_difference(table: Table, target: Column, reading: Column, deviation: Column, decisions: Decisions) -> None:
    """Deviations are reading minus target, or as their name says the other way round."""
    values = [table.numbers(one.place) for one in (target, reading, deviation)]
    if not all(np.isfinite(one).all() for one in values):
        return
    per = [None if one.unit is None else one.unit.factor for one in (target, reading, deviation)]
    of_target = per[0] or per[1] or 1.0
    told = values[1] * (per[1] or of_target) - values[0] * of_target
    factor = per[2] or _scale(told, values[2])
    if factor is None:
        return
    digits = _last_digit(values[1]) * (per[1] or of_target)  # a target is as it is set
    allowed = 2.0 * (digits + _last_digit(values[2]) * factor) + AGREES * float(np.ptp(told))
    stated = values[2] * factor * (-1.0 if deviation.role == CORRECTION else 1.0)
    if (np.abs(told - stated) <= allowed).all():
        return
    row = int(np.abs(told - stated).argmax())
    turned = (np.abs(told + stated) <= allowed).all()
    what = f"{deviation.header!r} is not {reading.header!r} minus {target.header!r}"
    what += ": its sign is the other one" if turned else ""
    found = f"{values[2][row]:g} beside {values[1][row]:g} and {values[0][row]:g}"
    ways = [Choice("columns", f"{READING}={reading.header}"), Choice("columns", f"{DEVIATION}={deviation.header}")]
    decisions.ask(table.at(row), what, *ways, found=found)


def _scale(told: Array, stated: Array) -> float | None:
    """The unit of deviations that state none, by those that follow; None where that does not show."""
    size = float(np.abs(stated).max(initial=0.0))
    if not size:
        return None
    ratio = float(np.abs(told).max()) / size
    return min((1.0, 1e-3, 1e3, 25.4e-3), key=lambda one: abs(np.log(max(ratio, 1e-12) / one)))


def _last_digit(values: Array) -> float:
    """One of the last decimal that numbers are written with."""
    few = values[:: max(1, len(values) // 200)]
    digits = next((n for n in range(10) if np.allclose(few, np.round(few, n), rtol=0.0, atol=1e-12)), 10)
    return float(10.0**-digits)


def _check_rounder(table: Table, target: Column, reading: Column, decisions: Decisions) -> None:
    """Targets that are all different, with readings that come again with fewer digits, look exchanged."""
    places, values = table.numbers(target.place), table.numbers(reading.place)
    if not (np.isfinite(places).all() and np.isfinite(values).all()):
        return
    if _last_digit(places) >= 0.5 * _last_digit(values):
        return
    different = np.sort(pd.unique(values))
    steps, fewer = np.diff(different), len(different) < len(pd.unique(places))
    even = len(values) == len(different) > 2 and np.allclose(steps, steps[0], rtol=1e-9)
    if fewer or even:
        what = f"{target.header!r} has more digits than {reading.header!r}: are they exchanged?"
        ways = [
            Choice("columns", f"{TARGET}={target.header}", "if not"),
            Choice("columns", f"{TARGET}={reading.header}", "if so"),
        ]
        decisions.ask(table.path, what, *ways)


def _check_temperature(table: Table, one: Column, decisions: Decisions) -> None:
    values, unit = table.numbers(one.place), one.unit
    values = values[np.isfinite(values)]
    assert unit is not None
    celsius = values * unit.factor + unit.offset
    if len(celsius) and not (TEMPERATURES_C[0] <= celsius.min() and celsius.max() <= TEMPERATURES_C[1]):
        what = f"{one.header!r} cannot be temperatures"
        found = f"{celsius.min():g} to {celsius.max():g} deg C"
        decisions.ask(table.path, what, Choice("columns", f"ignore={one.header}"), found=found)


def _as_counted(
    table: Table, one: Column, roles: list[Column], chosen: Mapping[str, str], decisions: Decisions
) -> Column:
    """A column that nothing names and that holds 1 and -1 alone: it may be the direction."""
    if one.role is not None or any(other.role == WAY for other in roles) or not any(r.role in VALUES for r in roles):
        return one
    if split_name(one.header)[1] is not None or not np.isin(values := table.numbers(one.place), (-1.0, 1.0)).all():
        return one
    if len(np.unique(values)) == 2 and WAY not in chosen:
        name = one.header or f"#{one.place + 1}"
        what = f"{one.header!r} holds 1 and -1, and may be the direction of travel"
        decisions.ask(table.path, what, Choice("columns", f"{WAY}={name}"), Choice("columns", f"ignore={name}"))
    return one

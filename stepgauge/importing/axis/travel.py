"""Direction of travel and cycle of every reading, where the table states neither: from the order of the targets.

What it states, in lines above blocks and as cycles, is compared with the targets before.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.recording import places_of
from stepgauge.importing.tables.columns import Column, Role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, column_answer, shown
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import WORDS, title_label, words_of

Whole = NDArray[np.int64]
MOST_WHOLE = 0.9
"""Share of the targets and runs that have as many readings as the others, from which a column counts the runs."""
MOST_ODD = 0.1
"""Share of the steps that no travel makes, up to which rows are in the order of one: single targets are repeated."""


@dataclass(frozen=True)
class ReadingOrder:
    """``way (n,)``: +1 or -1, the sense of travel to every reading; ``order (n,)``: rows in the order of reading;
    ``source``: where the ways are from, in words."""

    way: NDArray[Any]
    order: NDArray[np.intp]
    source: str


def numbered_runs(table: Table, roles: Sequence[Column], decisions: Decisions) -> list[Column]:
    """The columns, with the one that counts the runs where none is named so: each target has each of its numbers.

    They are counted from 0 or 1, as often at every target, but for a few that are missing or there twice.
    """
    target = next((one for one in roles if one.role == Role.TARGET), None)
    if target is None or any(one.role == Role.CYCLE or one.label.cycle for one in roles):
        return list(roles)
    place = places_of(table.numbers(target.place))
    found = [one for one in roles if _may_count(one) and _counts_runs(table.numbers(one.place), place)]
    if len(found) != 1:
        return list(roles)
    decisions.take(f"{found[0].header!r} is taken as the number of the run: every target has each of its numbers")
    return [replace(one, role=Role.CYCLE) if one is found[0] else one for one in roles]


def _may_count(one: Column) -> bool:
    return bool(one.header) and one.unit is None and (one.role is None or set(words_of(one.name)) <= WORDS["count"])


def _counts_runs(values: NDArray[Any], place: NDArray[np.intp]) -> bool:
    numbers = np.unique(values)
    if (
        len(numbers) < 2
        or not np.array_equal(numbers, np.arange(len(numbers)) + numbers[0])
        or numbers[0] not in (0, 1)
    ):
        return False
    _, count = np.unique(np.column_stack([place, values]), axis=0, return_counts=True)
    whole = len(count) == len(numbers) * len(np.unique(place)) and len(np.unique(place)) > 1
    of_runs = np.median(count) <= 2  # there and back
    return bool(whole and of_runs and (count == np.median(count)).mean() > MOST_WHOLE)


def check_stated_travel(table: Table, roles: Sequence[Column], layout: TableLayout, decisions: Decisions) -> None:
    """Asks where directions above blocks, or numbers of cycles, are none by the targets; not what was told by hand."""
    column = {one.role: one.place for one in roles if one.role in (Role.TARGET, Role.CYCLE, Role.WAY)}
    place = places_of(table.numbers(column[Role.TARGET])) if Role.TARGET in column else np.zeros(len(table), np.intp)
    if "title=*" not in layout.rows and not {Role.CYCLE, Role.WAY} & set(column):
        _check_titles(table, place, decisions)
    if {Role.TARGET, Role.CYCLE} <= set(column) and Role.CYCLE not in layout.columns:
        _check_cycles(table, place, column[Role.CYCLE], decisions)


def _check_titles(table: Table, place: NDArray[np.intp], decisions: Decisions) -> None:
    """The lines above the blocks say the direction of all rows or of none, and the order of the targets fits them.

    Tables often list the way back with rising targets; falling ones on the way up, or both ways in one block, do not.
    """
    said = np.array([title_label(one).way for one in table.titles])
    order = [ways_of_order(place[table.block == n]) for n in range(len(said))]
    fits = all(way and ((one == 1).all() or (one == way).all()) for way, one in zip(said, order, strict=True))
    if said.any() and not fits:
        ways = (
            QuestionAnswer("rows", "title=*", "to take the lines"),
            column_answer(Role.IGNORE, "title", "to take the order"),
        )
        what = "the lines above the blocks say other directions than the order of the targets, or not all of them"
        decisions.ask(table.path, what, *ways, found=shown([repr(one) for one in table.titles]))


def _check_cycles(table: Table, place: NDArray[np.intp], cycle: int, decisions: Decisions) -> None:
    """A column of cycles lists one after the other, or has its numbers as often at each target that has them.

    One after the other a run may have been broken off; other counts are not those of cycles.
    """
    texts = [str(cell) for cell in table.cells(cycle)]
    counts = Counter(zip(place.tolist(), texts, strict=True))
    uneven = len(set(counts.values())) > 1 and len(counts) < len(set(place.tolist())) * len(set(texts))
    if uneven and len(list(groupby(texts))) > len(set(texts)):
        name = table.headers[cycle] or f"#{cycle + 1}"
        ways = column_answer(Role.CYCLE, name, "if it is"), column_answer(Role.IGNORE, name)
        what = "a column of cycles has numbers that some targets lack and others repeat"
        decisions.ask(table.path, what, *ways, found=repr(name))


def travel_of_order(
    path: str, place: NDArray[np.intp], by_time: NDArray[np.intp] | None, ordered: bool, decisions: Decisions
) -> ReadingOrder:
    """The ways in the order of the rows, or of their times where rows are in no order of a travel; else it is asked.

    ``by_time``: the rows in the order of their times; ``ordered``: whether rows are said to be in the order of reading.
    """
    as_listed = ordered or is_travel(place)
    if not as_listed and by_time is None:
        what = "no column states the direction, and the order of the targets is that of no travel"
        ways = (
            QuestionAnswer("columns", "way=HEADER"),
            QuestionAnswer("constants", "direction=+", "where all were approached from one side"),
            QuestionAnswer("accept", "order", "where the rows are in the order of reading"),
        )
        decisions.ask(path, what, *ways)
        decisions.settle()
    order = np.arange(len(place)) if as_listed or by_time is None else by_time
    way = np.empty(len(place), np.int64)
    way[order] = ways_of_order(place[order])
    return ReadingOrder(
        way, order, "from the order of the targets" if as_listed else "from the order of the targets in time"
    )


def is_travel(place: NDArray[np.intp]) -> bool:
    """Whether an axis may have come to these places one after the other.

    It goes on from place to place, or begins anew at an end or where it began; it does not jump over others into the
    midst to turn there.
    """
    steps = np.diff(place)
    sense = np.sign(steps)
    turns = np.r_[False, sense[1:] != sense[:-1]] | np.r_[sense[1:] != sense[:-1], False]
    anew = np.isin(place[1:], (0, place.max(initial=0), place[0]))
    odd = (np.abs(steps) > 1) & turns & ~anew
    return not len(odd) or float(odd.mean()) <= MOST_ODD


def ways_of_order(place: NDArray[np.intp]) -> Whole:
    """+1 or -1, the sense in which the axis came to each place (counted along the axis), ``(n,)``.

    A target comes from the side of the one before it. Where the axis jumps over others to begin anew, or repeats a
    target to turn round there, it is the sense in which it goes on.
    """
    steps = np.diff(place)
    if not steps.any():
        return np.ones(len(place), np.int64)
    sense = np.sign(steps)
    came, goes = np.r_[0, sense], np.r_[sense, 0]
    jumped = np.abs(np.r_[0, steps]) > 1
    way = np.asarray(np.where((came == 0) | (jumped & (goes != 0)), goes, came))
    return _filled(way)


def _filled(way: NDArray[Any]) -> Whole:
    """Standstill counts as what follows, at the end as what went before."""
    if way.all():
        return way.astype(np.int64)
    found = pd.Series(np.where(way == 0, np.nan, way)).bfill().ffill()
    return found.fillna(1).to_numpy().astype(np.int64)


def cycles_of_repeats(*keys: NDArray[np.integer[Any]]) -> Whole:
    """How often each reading's keys (target, direction, placement) have been there before, counted from 1."""
    same = np.zeros(len(keys[0]), np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        least = key.min()
        same = same * int(key.max() - least + 1) + (key - least)
    return pd.Series(same).groupby(same, sort=False).cumcount().to_numpy().astype(np.int64) + 1

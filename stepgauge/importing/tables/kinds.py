"""What tells rows of a table apart: kinds, of which a recording has one, or the directions of travel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.files.numerals import looks_numeric
from stepgauge.importing.tables.cells import is_empty, text_of
from stepgauge.importing.tables.columns import Column, Role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer, column_answer, shown
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.vocabulary import LABEL, WORDS, says, title_label, words_of

LEAST_OF_WAY = 0.25
"""Share of the rows that each of two texts has, from which they may be the directions, and none is a slip."""


def is_text(table: Table, place: int) -> bool:
    """Whether a column has text, beside what may be numbers."""
    middle = table.bulk.get(place)
    if middle is not None and middle.dtype.kind in "fi":
        return False
    cells = (row[place] for row in table.rows if place < len(row))
    return any(isinstance(cell, str) and not is_empty(cell) and not looks_numeric(cell) for cell in cells)


def check_kinds(table: Table, roles: Sequence[Column], layout: TableLayout, decisions: Decisions) -> None:
    """A column, or titles of blocks, by which rows are of different kinds: one recording is of one kind."""
    every = {one.removesuffix("=*").strip() for one in layout.rows if one.endswith("=*")}
    ignored = layout.columns.get(Role.IGNORE, "").casefold().split("\n")
    target = next((table.numbers(one.place) for one in roles if one.role == Role.TARGET), None)
    asked = False
    for one in roles:
        taken = {one.header.casefold(), f"#{one.place + 1}"} & set(ignored) or one.called in every
        cells = None if taken or one.role not in (None, Role.DROPPED) else _kinds_in(table, one)
        if cells is not None and not _names_targets(cells, target):
            stated = any(other.role == Role.WAY for other in roles) or says(words_of(one.header), "kind")
            ways = [] if stated else directions_in(cells)
            _ask_rows(table, repr(one.header), sorted(set(cells)), one.called, decisions, ways)
            asked = True
    numbers, sizes = np.unique(table.block, return_counts=True)
    titles = [table.titles[n] for n in numbers.tolist()]
    labelled = all(title_label(title) != LABEL for title in titles if title)
    known = asked or "title" in every or any(one.role in (Role.CYCLE, Role.WAY, Role.PLACEMENT) for one in roles)
    if len(set(titles)) > 1 and not labelled and sizes.min() > 1 and not known:
        _ask_rows(table, "the lines above the blocks", list(dict.fromkeys(filter(None, titles))), "title", decisions)


def _kinds_in(table: Table, one: Column) -> list[str] | None:
    """The cells of a column that says of what kind each row is; None for another."""
    named = bool(says(words_of(one.header), "kind"))
    if says(words_of(one.name), "besides") or not (named or is_text(table, one.place)):
        return None
    texts = [text_of(cell).strip() for cell in table.cells(one.place)]
    filled = {text for text in texts if text}
    remark = 2 * texts.count("") >= len(texts)
    verdict = {text.casefold() for text in filled} <= WORDS["verdict"]
    return None if len(filled) < 2 or len(filled) == len(texts) or remark or verdict else texts


def _names_targets(texts: Sequence[str], target: Array | None) -> bool:
    """Whether a text is a name of the target: each has its own."""
    if target is None:
        return False
    pairs = set(zip(texts, target.tolist(), strict=True))
    return len(pairs) == len({text for text, _ in pairs}) == len({value for _, value in pairs})


def directions_in(texts: Sequence[str]) -> list[str]:
    """The two texts that may be the directions of travel: none other is there, and neither is a slip."""
    count = Counter(text for text in texts if not is_empty(text))
    return sorted(count) if len(count) == 2 and min(count.values()) >= LEAST_OF_WAY * len(texts) else []


def _ask_rows(
    table: Table, where: str, texts: Sequence[str], name: str, decisions: Decisions, forward: Sequence[str] = ()
) -> None:
    """Asks which rows are read; ``forward``: texts of which one may be the direction +."""
    ways = [QuestionAnswer("rows", text) for text in texts]
    ways.insert(0 if forward else 1, QuestionAnswer("rows", f"{name}=*", "for all of them"))
    ways[:0] = [column_answer(Role.WAY, f"{name}={text}", "if it is towards +") for text in forward]
    decisions.ask(table.path, f"rows are of several kinds, by {where}", *ways, found=shown(texts))

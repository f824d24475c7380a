"""Forms that say in their rows what others say in their columns: targets side by side, a unit behind every number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from stepgauge.files.numerals import looks_numeric
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.cells import MEASURE, Cell, Cells
from stepgauge.importing.tables.columns import VALUE_ROLES, Role, axis_role
from stepgauge.importing.tables.vocabulary import LABEL, parse_label, split_name

FEWEST = 3
"""Numbers beside one another from which a row of targets is one."""


def turned(cells: Cells) -> Cells:
    """The cells with rows and columns exchanged, where a row begins with the word for targets and goes on in numbers.

    What stands above that row, and rows of means and limits, are left out.
    """
    at = next((n for n, row in enumerate(cells.rows) if _is_row_of_targets(row)), None)
    if at is None:
        return cells
    width = len(_numbers(cells.rows[at]))
    rows = [row for row in cells.rows[at:] if _is_text(row[0]) and len(_numbers(row)) == width]
    runs = [row for row in rows[1:] if _names_run(str(row[0]))]
    if not runs:
        return cells
    table: list[list[Cell]] = [list(row) for row in zip(cells.rows[at], *runs, strict=False)]
    return replace(cells, rows=table, lines=[cells.lines[at]] * len(table))


def units_of_cells(cells: Cells) -> Cells:
    """The cells of columns that write their unit behind every number without it; it goes to the header above."""
    rows = [list(row) for row in cells.rows]
    for place in range(max(map(len, rows), default=0)):
        texts = {n: row[place] for n, row in enumerate(rows) if place < len(row) and isinstance(row[place], str)}
        found = {n: match for n, text in texts.items() if (match := MEASURE.fullmatch(str(text)))}
        units = {match[2] for match in found.values()}
        unit = find_unit(next(iter(units))) if len(units) == 1 else None
        first = min(found, default=0)
        if len(found) < FEWEST or unit is None or unit.quantity == "none" or first == 0:
            continue
        for n, match in found.items():
            rows[n][place] = match[1]
        above = rows[first - 1]
        if place < len(above) and _is_text(above[place]):
            above[place] = f"{above[place]} [{unit.name}]"
    return replace(cells, rows=rows)


def _is_text(cell: Cell) -> bool:
    return isinstance(cell, str) and bool(cell) and not looks_numeric(cell)


def _numbers(row: Sequence[Cell]) -> list[Cell]:
    return [cell for cell in row[1:] if not isinstance(cell, str) or looks_numeric(cell)]


def _is_row_of_targets(row: Sequence[Cell]) -> bool:
    """Whether a row is the word for targets, and numbers."""
    named = len(row) > FEWEST and _is_text(row[0]) and axis_role(split_name(str(row[0]))[0]) == Role.TARGET
    return named and len(_numbers(row)) == len(row) - 1


def _names_run(name: str) -> bool:
    """Whether a row's name is that of a run, and not that of a mean or a limit."""
    role, label = axis_role(split_name(name)[0]), parse_label(name)
    return role in (*VALUE_ROLES, Role.CYCLE, Role.WAY) or (role is None and label != LABEL)

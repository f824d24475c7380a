"""Forms that say in their rows or cells what others say in their columns -> columns of plain numbers.

Targets side by side, in a row of their own or as the names of the columns; a unit behind every number; angles in
degrees, minutes and seconds, in one cell or in three; the coordinates of a point below one another.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stepgauge.files.numerals import looks_numeric
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.cells import DEGREES, Cell, Cells, any_number, text_of
from stepgauge.importing.tables.columns import VALUE_ROLES, Role, axis_role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.vocabulary import LABEL, MEASURE, WORDS, parse_label, split_name, words_of

FEWEST = 3
"""Numbers beside one another, or below one another, from which they are of such a form."""
_RUNS = WORDS["cycle"] | WORDS["way"]
_OF_RUNS = _RUNS | WORDS["cycle beside"] | WORDS["number of"] | WORDS["count"]
_PARTS = ("degree", "arcminute", "arcsecond")


def arrange_columns(cells: Cells) -> Cells:
    """The cells of a file with a column for each quantity, and numbers in plain digits."""
    return _plain_numbers(_turned(_side_by_side(cells)))


# targets side by side


def _side_by_side(cells: Cells) -> Cells:
    """Targets that are the names of columns, behind that of the run, as a row of targets above rows of runs.

    Alone, or behind a number of the row, they are names where they state their unit, and the numbers below do not.
    """
    for n, row in enumerate(cells.rows[:-1]):
        first = next((place for place, cell in enumerate(row) if _target(cell) is not None), 0)
        names, targets = row[:first], [_target(cell) for cell in row[first:]]
        words, below = frozenset(words_of(str(names[0]))) if names else _OF_RUNS, cells.rows[n + 1]
        stated = all(map(_measured, row[first:])) and len(below) == len(row) and not any(map(_measured, below))
        run = (words <= _OF_RUNS if stated else words <= _RUNS) and all(map(_is_text, names))
        units = {target[1] for target in targets if target is not None}
        if run and len(targets) >= FEWEST and None not in targets and len(units) == 1:
            unit = units.pop()
            head: list[Cell] = [f"target [{unit}]" if unit else "target", *(one[0] for one in targets if one)]
            rows: list[list[Cell]] = [[_joined(names, one) if words <= _RUNS else f"run {k}", *one[first:]]
                for k, one in enumerate(cells.rows[n + 1 :], 1) if len(one) == len(row)]  # fmt: skip
            lines = [line for line, one in zip(cells.lines[n + 1 :], cells.rows[n + 1 :], strict=True)
                     if len(one) == len(row)]  # fmt: skip
            return replace(cells, rows=[*cells.rows[:n], head, *rows], lines=[*cells.lines[: n + 1], *lines])
    return cells


def _measured(cell: Cell) -> bool:
    return isinstance(cell, str) and MEASURE.fullmatch(cell) is not None


def _target(cell: Cell) -> tuple[str, str] | None:
    """Number and unit of a cell that names a column as a target does, the unit empty for none; else None."""
    if isinstance(cell, float):
        return text_of(cell), ""
    if not isinstance(cell, str):
        return None
    match = MEASURE.fullmatch(cell)
    return (match[1], match[2]) if match else (cell, "") if looks_numeric(cell) else None


def _joined(names: Sequence[Cell], row: Sequence[Cell]) -> str:
    """``Run 2 Dir +``: what the cells of a run say, behind the names of their columns."""
    texts = [text_of(cell) for cell in row[: len(names)]]
    return " ".join(f"{name} {text}" for name, text in zip(names, texts, strict=True))


def _turned(cells: Cells) -> Cells:
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
    left = len(cells.rows) - len(runs) - 1
    notes = (*cells.notes, f"turned: a row of {width} targets and {len(runs)} rows of runs", *(
        (f"dropped: {left} other lines (texts, means, limits)",) if left else ()))  # fmt: skip
    return replace(cells, rows=table, lines=[cells.lines[at]] * len(table), notes=notes)


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


# numbers with their units, angles in parts


def _plain_numbers(cells: Cells) -> Cells:
    """The cells of columns that write a unit behind every number, or angles in parts, without it."""
    rows = [list(row) for row in cells.rows]
    _join_angles(rows)
    for place in range(max(map(len, rows), default=0)):
        texts = {n: str(row[place]) for n, row in enumerate(rows) if place < len(row) and isinstance(row[place], str)}
        angles = {n: _degrees(match) for n, text in texts.items() if (match := DEGREES.fullmatch(text))}
        found = {n: match for n, text in texts.items() if (match := MEASURE.fullmatch(text))}
        units = {"deg"} if angles else {match[2] for match in found.values()}
        numbers: dict[int, Cell] = {**angles} if angles else {n: match[1] for n, match in found.items()}
        unit = find_unit(next(iter(units))) if len(units) == 1 else None
        first = min(numbers, default=0)
        if len(numbers) < FEWEST or unit is None or unit.quantity == "none" or first == 0:
            continue
        for n, value in numbers.items():
            rows[n][place] = value
        above = rows[first - 1]
        if place < len(above) and _is_text(above[place]):
            name = split_name(str(above[place]))[0] if angles else above[place]
            above[place] = f"{name} [{unit.name}]"
    return replace(cells, rows=rows)


def _degrees(match: re.Match[str]) -> float:
    """Of ``-12°34'56.7"``."""
    sign, *parts = match.groups()
    sizes = [float((part or "0").replace(",", ".")) / per for part, per in zip(parts, (1.0, 60.0, 3600.0), strict=True)]
    return float(f"{(-1.0 if sign == '-' else 1.0) * sum(sizes):.12g}")


def _join_angles(rows: list[list[Cell]]) -> None:
    """Three columns ``deg, min, sec`` as one, in place: the first holds degrees, the others are gone."""
    for n, row in enumerate(rows[:-1]):
        names = [str(cell).strip("[]() ").casefold() for cell in row]
        at = next((p for p in range(len(row) - 2) if all(names[p + k] in WORDS[_PARTS[k]] for k in range(3))), None)
        if at is not None:
            row[at : at + 3] = ["angle [deg]"]
            for one in rows[n + 1 :]:
                one[at : at + 3] = [_join_parts(one[at : at + 3])]
            for one in rows[max(n - 1, 0) : n]:
                one[at : at + 3] = one[at : at + 1]


def _join_parts(cells: Sequence[Cell]) -> Cell:
    values = [any_number(cell) for cell in cells]
    if len(values) < FEWEST or not np.isfinite(values).all():
        return cells[0] if cells else ""
    size = abs(values[0]) + values[1] / 60.0 + values[2] / 3600.0
    return float(f"{-size if str(cells[0]).lstrip().startswith('-') else size:.12g}")


# coordinates below one another


def points_of_rows(table: Table) -> Table:
    """A table whose rows are the coordinates X, Y and Z of points in turn with a row per point; another as it is.

    The coordinate is the one that is named as measured, or the only number.
    """
    width = max(map(len, table.rows), default=0)
    named = [p for p in range(width) if _are_coordinates([str(cell).strip().upper() for cell in table.cells(p)])]
    numbers = [p for p in range(width) if p not in named and np.isfinite(table.numbers(p)).all()]
    read = [p for p in numbers if axis_role(split_name(table.headers[p])[0]) == Role.READING] or numbers
    if len(named) != 1 or len(read) != 1:
        return table
    points = table.numbers(read[0]).reshape(-1, 3)
    unit = table.units[read[0]] or split_name(table.headers[read[0]])[1]
    rows: list[list[Cell]] = [list(point) for point in points.tolist()]
    said = (*table.left_out, f"coordinates below one another: {len(rows)} points")
    return replace(table, headers=list("XYZ"), units=[unit] * 3, rows=rows, lines=table.lines[::3],
                   titles=[""], block=np.zeros(len(rows), np.int64), left_out=said)  # fmt: skip


def _are_coordinates(names: Sequence[str]) -> bool:
    return len(names) >= 3 * FEWEST and list(names) == list("XYZ") * (len(names) // 3)

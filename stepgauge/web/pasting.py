"""Sixteen rows as somebody pastes them, from a table calculation or a screen, as the file that the reader reads."""

from __future__ import annotations

import re

HEADER = "point,x_mm,y_mm,z_mm"
APART = (r"\t+", r"\s*;\s*", r"\s+", r"\s*,\s*")
_NUMBER = re.compile(r"[+-]?\d+([.,]\d+)?([eE][+-]?\d+)?")


def complete_points_text(text: str) -> str:
    """Rows of three or four numbers without a header get one, and numbers in order where they have none.

    Cells are apart by tabs, semicolons, blanks, or commas; a comma is a decimal mark where the cells are apart by
    something else. A cell that is no number stays in its row among such rows, for the reader of points to name it.
    Anything else is given to that reader as it is, which says what is wrong with it.
    """
    lines = [line.strip() for line in text.strip().splitlines() if line.strip()]
    rows = [_cells(line) for line in lines]
    if lines and rows[0] is not None and rows.count(None) < len(rows) / 2:
        rows = [row or _divided(line, len(rows[0])) for line, row in zip(lines, rows, strict=True)]
    if not rows or any(row is None for row in rows) or len({len(row or ()) for row in rows}) != 1:
        return text
    cells = [row for row in rows if row is not None]
    if len(cells[0]) == 3:
        cells = [[str(number), *row] for number, row in enumerate(cells, 1)]
    return "\n".join([HEADER, *(",".join(row) for row in cells)]) + "\n"


def _divided(line: str, count: int) -> list[str] | None:
    """So many cells, whatever is in them."""
    divided = ([one for one in re.split(apart, line) if one] for apart in APART)
    return next((cells for cells in divided if len(cells) == count and not any("," in cell for cell in cells)), None)


def _cells(line: str) -> list[str] | None:
    """Three or four numbers with a decimal point, None where the line has anything else."""
    for apart in APART:
        cells = [one for one in re.split(apart, line) if one]
        if len(cells) in (3, 4) and all(_NUMBER.fullmatch(one) for one in cells):
            return [one.replace(",", ".") for one in cells]
    return None

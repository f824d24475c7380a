"""Kinds of rows, and the rows above the numbers that name the columns: one to three, merged names, and one of units."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Sequence

from stepgauge.errors import InputError, at_row
from stepgauge.files.numerals import looks_numeric
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.cells import Cell, Cells, is_empty, is_units, text_of
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.columns import DIRECTIONS, point_role
from stepgauge.importing.tables.vocabulary import split_name

MOST_HEADERS = 3
"""Rows above the numbers that may be a header, beside one of units."""
FEW_SLIPS = 0.02
"""Share of the cells of a column of numbers that may be text by mistake, one in fifty; one cell always may.

It decides only how a cell is told that is no number: as a slip, with its row, and the import is refused; or, among more
of its kind, as a name, and the column is one of text. No reading comes out otherwise.
"""


def is_number(cell: Cell) -> bool:
    """Whether a cell is a number or a time."""
    return not isinstance(cell, str) or looks_numeric(cell) or is_moment(cell)


def row_kind(row: Sequence[Cell]) -> str:
    """``n`` for a number or a time, ``t`` for text, ``e`` for nothing, cell by cell."""
    return "".join("e" if is_empty(cell) else "n" if is_number(cell) else "t" for cell in row).rstrip("e")


def frequent_kind(kinds: Sequence[str], rows: Container[str]) -> str:
    """What the rows of the commonest width have in common, a letter per column; empty where none is among ``rows``."""
    counted = Counter(kind for kind in kinds if kind in rows)
    if not counted:
        return ""
    width = max((len(kind) for kind in counted), key=lambda w: sum(n for kind, n in counted.items() if len(kind) == w))
    rows = [kind for kind in kinds if len(kind) == width and kind in counted]
    return "".join(_common("".join(kind[place] for kind in rows)) for place in range(width))


def _common(letters: str) -> str:
    """``n`` for a column of numbers, in which a few cells may be slips; else ``t``: names, or names and numbers.

    Text above the first number is that of a preamble, below the last one that of means and limits.
    """
    above = letters[max(letters.find("n"), 0) : letters.rfind("n") + 1]
    return "n" if above and above.count("t") <= max(FEW_SLIPS * len(above), 1) else "t"


def fits_kind(row: Sequence[Cell], kind: str) -> bool:
    """Whether a row has numbers where the table has them, or nothing."""
    own = row_kind(row)
    if not own or len(own) > len(kind) or 2 * own.count("n") < kind.count("n"):
        return False
    return all(mine in ("n", "e") for mine, his in zip(own, kind, strict=False) if his == "n") and "n" in own


def behind_header(cells: Cells, first: int, width: int, start: int) -> int:
    """The row behind the header: the first row of numbers, or a line between both that names the block."""
    at = first - 1
    alone = at > start and width > 1 and sum(cell != "" for cell in cells.rows[at]) == 1
    return at if alone and not is_units(cells.rows[at]) and _may_name(cells.rows[at - 1], width) else first


def find_header(cells: Cells, first: int, width: int, start: int) -> tuple[list[str], list[str], int]:
    """Names, the row of units, and the first row of both."""
    at, units = first - 1, list[str]()
    if at > start and is_units(cells.rows[at]):
        units, at = [str(cell) for cell in cells.rows[at]], at - 1
    if at > start and _is_slip(cells.rows[at], cells.rows[at - 1], width):
        texts = [place for place, cell in enumerate(cells.rows[at]) if not is_empty(cell) and not is_number(cell)]
        if texts:
            refuse_slip(cells, at, _texts(cells.rows[at - 1], width), texts[0])
    if at < start or not _may_name(cells.rows[at], width):
        return [], units, at + 1
    names = [text_of(cell) for cell in cells.rows[at]]
    for _ in range(MOST_HEADERS - 1):
        if at > start and not units and is_units(cells.rows[at - 1]):
            units, at = [str(cell) for cell in cells.rows[at - 1]], at - 1
        upper = _upper(cells.rows[at - 1], names) if at > start else []
        if not upper:
            break
        names, at = joined_headers(upper, names), at - 1
    return names, units, at


def _upper(row: Sequence[Cell], names: Sequence[str]) -> list[str]:
    """The texts of a row above a header, where it may name what that leaves without a name or alike; else empty."""
    texts = _texts(row, len(names))
    named = [name for name in names if name]
    fills = len(set(named)) < len(named)
    fills |= any(text and (not name or find_unit(name.strip("[]()"))) for text, name in zip(texts, names, strict=True))
    numbers = any(cell != "" and (not isinstance(cell, str) or looks_numeric(cell)) for cell in row)
    return texts if fills and len({text for text in texts if text}) > 1 and not numbers else []


def _is_slip(row: Sequence[Cell], above: Sequence[Cell], width: int) -> bool:
    """Whether a row is one of the table in which a number is none, below the header and not the header itself."""
    parts = [cell for cell in row if cell != "" and not (isinstance(cell, str) and not is_number(cell))]
    fractions = any(not str(cell).strip("+- ").removesuffix(".0").isdigit() for cell in parts)
    return (
        bool(parts)
        and fractions
        and _may_name(above, width)
        and not any(is_number(cell) for cell in above if cell != "")
    )


def refuse_slip(cells: Cells, n: int, header: Sequence[str], wrong: int) -> None:
    """:class:`InputError` for a row in which a number is none, in the column ``wrong``."""
    row = cells.rows[n]
    name = repr(header[wrong]) if wrong < len(header) else str(wrong + 1)
    where = at_row(cells.path, cells.lines[n])
    what, expected = f"column {name} is not a number", "a number, or an empty cell"
    raise InputError(where, what, found=repr(str(row[wrong])), expected=expected)


def _may_name(row: Sequence[Cell], width: int) -> bool:
    """Whether a row may name columns: as many cells as the table, not numbers alone, and none but numbers of runs."""
    there = [cell for cell in row if cell != ""]
    numbers = [text_of(cell).lstrip("+-") for cell in there if is_number(cell) and not is_moment(cell)]
    if any(not text.isdigit() or len(text) > 4 for text in numbers):
        return False
    return len(there) > (width - 1) / 2.0 and any(isinstance(c, str) and not is_number(c) for c in there)


def _texts(row: Sequence[Cell], width: int) -> list[str]:
    texts = [text_of(cell) for cell in row[:width]]
    return [*texts, *[""] * (width - len(texts))]


def commented_header(cells: Cells, width: int) -> list[str]:
    """A header in a comment, as numerical programs write it."""
    every = (names for line in reversed(cells.comments) for names in divided(line) if len(names) == width)
    return next((names for names in every if not any(map(looks_numeric, names))), [])


def divided(comment: str) -> list[list[str]]:
    """The cells of a comment, by each mark that may divide them."""
    text = comment.lstrip("#/%!$ ")
    return [[one.strip() for one in re.split(mark, text)] for mark in (";", "\t", "[|]", ",", r"\s{2,}", r"\s+")]


def split_names(text: str) -> list[str]:
    """The names of columns in one text, divided by semicolons or commas."""
    return [name.strip() for name in text.split(";" if ";" in text else ",")]


def joined_headers(upper: Sequence[str], lower: Sequence[str]) -> list[str]:
    """Headers of two rows as those of one: names above, in merged cells, and parts or units of them below.

    A merged cell stands in its first column; it is carried to the right over columns that the lower row names.
    """
    joined, group = list[str](), ""
    for place, part in enumerate(lower):
        own = upper[place] if place < len(upper) else ""
        group = own or (group if part else "")
        joined.append(_joined(group, part, own=bool(own)))
    return joined


def _joined(group: str, part: str, *, own: bool) -> str:
    """One header of ``group`` above and ``part`` below; under an ``own`` cell above, a unit is its unit."""
    if not group or not part:
        return group or part
    unit = find_unit(part.strip("[]()"))
    unit = None if unit is None or unit.quantity == "none" else unit  # a minus is a direction
    if own and unit is not None and point_role(f"{group} {part}") not in DIRECTIONS:
        return f"{group} [{unit.name}]"
    (name, whole), (low, narrow) = split_name(group), split_name(part)
    known = narrow or whole
    return f"{name} {low} [{known.name}]" if known is not None else f"{group} {part}"

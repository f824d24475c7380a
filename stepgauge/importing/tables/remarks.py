"""What stands beside the rows of a table: titles of blocks, facts that a file states of itself, what is left out."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence

from stepgauge.importing.tables.cells import Cell, Cells, is_units, text_of
from stepgauge.importing.tables.header import divided, fits_kind, refuse_slip, row_kind
from stepgauge.importing.tables.vocabulary import LABEL, says, title_label, words_of

_FACT = re.compile(r"\s*([^:=;]{2,60}?)\s*(?:::?|=)\s*(\S.*?)\s*")
_SEVERAL = re.compile(r"([A-Za-z]\w*)\s*[:=]\s*(\S+)")


def block_titles(
    cells: Cells, start: int, body: Sequence[int], header: Sequence[str], kind: str, above: int
) -> tuple[list[str], list[int]]:
    """The lines above the blocks of numbers, and the number of the block of every row."""
    over = [text for n in range(start, above) if (text := _text(cells.rows[n]))]
    titles, block, inside = [_telling(over)], [], set(body)
    fresh = False
    for n in range(body[0], body[-1] + 1):
        if n in inside:
            block.append(len(titles) - 1)
            fresh = False
            continue
        title = _title(cells, n, header, kind)
        if title and fresh:
            titles[-1] = _telling([titles[-1], title])
        elif title:
            titles.append(title)
            fresh = True
    return (titles, block) if len(titles) > 1 else ([""], block)


def _telling(lines: Sequence[str]) -> str:
    """Of lines above a block the last that says a run, else the last."""
    return next((line for line in reversed(lines) if title_label(line) != LABEL), lines[-1] if lines else "")


def _text(row: Sequence[Cell]) -> str:
    return " ".join(text_of(cell) for cell in row if cell != "")


def _title(cells: Cells, n: int, header: Sequence[str], kind: str) -> str:
    """The line between two blocks; a row with text in place of a number is none."""
    row = cells.rows[n]
    own = row_kind(row)
    numbers = [place for place, letter in enumerate(kind) if letter == "n"]
    wrong = [place for place in numbers if place < len(own) and own[place] == "t"]
    summary = is_summary(cells, n, kind)
    if wrong and own.count("n") and len(own) == len(kind) and not summary:
        refuse_slip(cells, n, header, wrong[0])
    texts = [text_of(cell) for cell in row if cell != ""]
    title = _text(row)
    none = summary or texts == [name for name in header if name] or is_units(row) or says(words_of(title), "page")
    return "" if none else title


def is_summary(cells: Cells, n: int, kind: str) -> bool:
    """Whether a row below a block sums it up: a name, then fewer than half of the numbers, and nothing in between."""
    own = row_kind(cells.rows[n])
    ends = n + 1 == len(cells.rows) or not fits_kind(cells.rows[n + 1], kind)
    few = 0 < 2 * own.count("n") < kind.count("n")
    return ends and few and own[0] == "t" and own.count("t") == 1 and "e" in own


def left_out_words(
    cells: Cells,
    start: int,
    body: Sequence[int],
    header: Sequence[str],
    kind: str,
    named: Container[int],
    titles: Container[str],
) -> tuple[str, ...]:
    """What a file has beside the rows of a table and their header, in words: how much, and what first.

    Lines between blocks that say a run are used; a row that is a comment is told, for it may have been taken out.
    """
    inside, used = set(body), [name for name in header if name]
    left = list[int]()
    for n in (n for n in range(start, len(cells.rows)) if n not in inside and n not in named):
        texts = [text_of(cell) for cell in cells.rows[n] if cell != ""]
        title = _text(cells.rows[n]) in titles and title_label(_text(cells.rows[n])) != LABEL
        if texts != used and not is_units(cells.rows[n]) and not title:
            left.append(n)
    every = (parts for line in cells.comments for parts in divided(line))
    rows = [parts for parts in every if len(parts) == len(kind) and fits_kind(parts, kind)]
    told = list[str]()
    if left:
        first, line = _shown(cells.rows[left[0]]), cells.lines[left[0]]
        told.append(f"dropped: {len(left)} lines that are no rows of the table, the first in line {line}: {first!r}")
    told += [f"left out: line {cells.lines[n]}, a summary: {_shown(cells.rows[n])!r}"
             for n in left if n > body[0] and is_summary(cells, n, kind)]  # fmt: skip
    if rows:
        told.append(f"dropped: {len(rows)} comments that hold a row of numbers, the first: {_shown(rows[0])!r}")
    return tuple(told)


def _shown(row: Sequence[Cell]) -> str:
    return _text(row)[:60]


def stated_facts(rows: Sequence[Sequence[Cell]], comments: Sequence[str], titles: Sequence[str]) -> dict[str, str]:
    """What a file states of itself beside its numbers: ``key: value``, or a key and its value in two cells."""
    found: dict[str, str] = {}
    lines = [[text_of(cell) for cell in row if cell != ""] for row in rows]
    lines += [[line.lstrip("#/%!$ ")] for line in comments]
    for parts in lines:
        match = _FACT.fullmatch(" ".join(parts))
        pair = (parts[0].rstrip(" :="), parts[1]) if len(parts) == 2 else match.groups() if match else None
        if pair is not None and len(pair[1]) < 200:
            found.setdefault(pair[0].casefold(), pair[1])
    stated = [dict(_SEVERAL.findall(title)) for title in titles if title]
    for key in set.intersection(*map(set, stated)) if stated else ():
        if len({one[key] for one in stated}) == 1:
            found.setdefault(key.casefold(), stated[0][key])
    return found

"""Text of any delimiter -> rows of cells; the marks that might divide it are hypotheses, rated by what they divide."""

from __future__ import annotations

import csv
import datetime
import io
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.numerals import Numerals, decimal_mark, looks_numeric
from stepgauge.files.text import margins
from stepgauge.files.units import find_unit
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer
from stepgauge.importing.tables.source import Source
from stepgauge.importing.tables.vocabulary import MEASURE, says_run

if TYPE_CHECKING:
    import pandas as pd

Cell = str | float | datetime.datetime | datetime.time | datetime.timedelta
DELIMITERS = {"semicolon": ";", "tab": "\t", "bar": "|", "comma": ","}
"""Names of the delimiters, in the order in which they are tried: a comma may be a decimal mark."""
SPACES = {"spaces": r"\s{2,}", "space": r"\s+", "every space": r"\s+(?#)"}
"""The same for columns that are set apart by white space, as patterns: in the last, date and time of day are two."""
FIXED = "fixed width"
_CELL = re.compile(r'"([^"]*)"')
_DATE_AND_TIME = re.compile(r"(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}) +(\d{1,2}:\d\d)")
_OPENS = re.compile(r'(?:^|[;,|\t]) *"[^"]*$')
"""A cell that begins with a quotation mark and does not end."""
_RULE = re.compile(r"[\s|:+=_-]*[-=_]{3}[\s|:+=_-]*|[\s|:-]*(?:--|[|][\s:]*-)[\s|:-]*")
"""A line that is drawn, as below the header of a markdown table."""
_NO_VALUE_WORDS = (
    "- -- --- n/a na nan #n/a null none ol over overflow err ***** -fffffff fffffff out_of_range no_signal no_echo"
)
_NO_VALUE = frozenset(["", *(word.replace("_", " ") for word in _NO_VALUE_WORDS.split())])
COMMENT_MARKS = ("#", "//", "%", "$$", "!")
_NUMBERS = re.compile(r"[\s|\"']*[-+]?[.,]?\d")
DEGREES = re.compile(r"([-+]?)(\d{1,3}) ?° ?(\d{1,2}) ?['′] ?(?:(\d{1,2}(?:[.,]\d+)?) ?(?:\"|″|''))?")
"""An angle in degrees, minutes and seconds."""
SAMPLE = 200
"""Lines by which the delimiter is found."""
LONG, MARGIN = 20_000, 100
"""Lines from which a text is long, and those at both ends that are read cell by cell."""
HEADED = 0.5
"""Share of the best rating from which a mark that divides the header like the rows is preferred."""
CLOSE = 0.9
"""Share of the best rating from which another mark is a rival that is told."""


@dataclass(frozen=True)
class Bulk:
    """The middle of a long table, read as columns: before row ``at`` of the others; ``line``: of its first row."""

    frame: pd.DataFrame
    at: int
    line: int

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True)
class Cells:
    """A table before it is known what it means.

    ``rows``: cells of each row, text without the spaces around it; ``lines``: line or row of the file of each;
    ``comments``: lines that are comments; ``blank``: how many lines are blank; ``notes``: how it was read, in words;
    ``bulk``: the middle of a long table.
    """

    path: str
    rows: Sequence[Sequence[Cell]]
    lines: Sequence[int]
    comments: Sequence[str]
    blank: int
    notes: tuple[str, ...]
    bulk: Bulk | None = None


def text_of(cell: Cell) -> str:
    """The text of a cell: a number with the digits that it has, not those of binary arithmetic."""
    return f"{cell:.12g}" if isinstance(cell, float) else str(cell)


def is_empty(cell: Cell) -> bool:
    """Whether a cell has no value: nothing, or what instruments write where they have none."""
    return isinstance(cell, str) and cell.casefold() in _NO_VALUE


def is_units(row: Sequence[Cell]) -> bool:
    """Whether a row has units and nothing else."""
    texts = [cell for cell in row if cell != ""]
    return bool(texts) and all(isinstance(cell, str) and find_unit(cell.strip("[]()")) is not None for cell in texts)


def value_of(cell: Cell, numerals: Numerals) -> float:
    """The number of a cell; NaN where it is none."""
    if isinstance(cell, float):
        return cell
    return numerals.number(cell) if isinstance(cell, str) else math.nan


def any_number(cell: Cell) -> float:
    """The number of a cell in either way of writing; NaN where it is none."""
    return next((v for mark in ".," if math.isfinite(v := value_of(cell, Numerals(mark)))), math.nan)


def is_remark(line: str) -> bool:
    """Whether a line is a comment."""
    return line.lstrip().startswith(COMMENT_MARKS)


def uncomment_headings(lines: Sequence[str]) -> list[str]:
    """Lines, those of comments that name the run, direction or placement of a block as text: ``# Forward``.

    A file has blocks where such a comment stands below its first numbers; what stands directly above those, with no
    line of names between, may be the header.
    """
    plain = [n for n, line in enumerate(lines) if line.strip() and not is_remark(line) and not _RULE.fullmatch(line)]
    numbers = next((n for n in plain if _NUMBERS.match(lines[n])), len(lines))
    said = {n for n, line in enumerate(lines) if is_remark(line) and says_run(line.lstrip("#/%!$ \t"))}
    blocks = {n for n in said if numbers < n < plain[-1]}
    above = {n for n in said if plain and plain[0] < numbers and n < numbers} if blocks else set[int]()
    text = [line.lstrip("#/%!$ \t").replace('"', "'") for line in lines]
    return [f'"{text[n]}"' if n in blocks | above else line for n, line in enumerate(lines)]


def read_text_cells(
    source: Source, delimiter: str | None, decisions: Decisions, columns: int | None = None, whole: bool = False
) -> Cells:
    """Rows of a text; the delimiter is the one given, that of a ``sep=`` line, or the one that divides it best.

    ``columns``: how many there are, where that is known; ``whole``: whether all is read cell by cell.
    :class:`InputError` for a text without rows.
    """
    text, encoding = source.decoded
    head, middle, tail = (text.splitlines(), "", list[str]()) if whole else _parted(text)
    lines = uncomment_headings([*(head := _rejoined(head)), *tail])
    if lines and re.fullmatch(r"(?i)sep=.", lines[0].strip()):
        delimiter = delimiter or lines[0].strip()[4]
        lines[0] = head[0] = ""
    rows = [n for n, line in enumerate(lines) if line.strip() and not is_remark(line) and not _RULE.fullmatch(line)]
    if not rows:
        raise InputError(source.name, "the table is empty", expected="a header, and rows of numbers")
    split = _splitter([lines[n] for n in rows], delimiter, columns, decisions)
    cells = _join_words([lines[n] for n in rows], split)
    in_head = sum(n < len(head) for n in rows)
    bulk = _bulk(middle, split.mark, cells, in_head, len(head) + 1) if middle else None
    if middle and bulk is None:  # not numbers alone: cell by cell
        return read_text_cells(source, delimiter, decisions, columns, whole=True)
    comments = [line for line in lines if is_remark(line)]
    between = len(bulk) if bulk is not None else 0
    numbers = [n + 1 + (between if n >= len(head) else 0) for n in rows]
    blank, notes = len(lines) - len(rows) - len(comments), (f"{encoding}, {split.name}-separated",)
    return Cells(source.name, cells, numbers, comments, blank, notes, bulk)


def _join_words(lines: Sequence[str], split: Splitter) -> list[list[Cell]]:
    """Rows that white space divides, with the words of one name, or of a remark behind the numbers, as one cell."""
    rows = split(lines)
    if split.mark not in SPACES.values():
        return rows
    common = Counter(len(row) for row in rows if all(map(_tells, row))).most_common(1)
    if not common:
        return rows
    width = common[0][0]
    return [_join_remark(_set_apart(line, row, width), width) for line, row in zip(lines, rows, strict=True)]


def _set_apart(line: str, row: list[Cell], width: int) -> list[Cell]:
    """Names of several words above numbers that single blanks divide stand farther from each other than their words."""
    if len(row) == width or any(map(_tells, row)):
        return row
    wide = ([*map(str.strip, re.split(r"\s{2,}|\t", one))] for one in (line.rstrip(), line.strip()))
    return next((list[Cell](cells) for cells in wide if len(cells) == width), row)


def _join_remark(row: list[Cell], width: int) -> list[Cell]:
    numbers, words = row[:width], row[width:]
    is_one = len(words) > 1 and all(map(_tells, numbers)) and not any(map(_tells, words))
    return [*numbers, " ".join(map(str, words))] if is_one else row


def _rejoined(lines: list[str]) -> list[str]:
    """Lines of which a cell in quotation marks goes over several, as one; those that it took are left blank."""
    found = list(lines)
    for n, line in enumerate(found[:-1]):
        if _OPENS.search(line) and line.count('"') % 2:
            end = next((m for m in range(n + 1, min(n + 4, len(found))) if found[m].count('"') % 2), None)
            if end is not None:
                found[n] = " ".join(found[n : end + 1])
                found[n + 1 : end + 1] = [""] * (end - n)
    return found


def _parted(text: str) -> tuple[list[str], str, list[str]]:
    """The lines of a text; of a long one those at both ends, and what is between them."""
    if text.count("\n") < LONG:
        return text.splitlines(), "", []
    start, end = margins(text, MARGIN)
    return text[:start].splitlines(), text[start:end], text[end:].splitlines()


def _bulk(middle: str, mark: str, cells: Sequence[Sequence[Cell]], at: int, line: int) -> Bulk | None:
    """The middle as columns of numbers; None where it is something else as well."""
    import pandas as pd

    width = Counter(map(len, cells)).most_common(1)[0][0]
    if mark in (FIXED, SPACES["spaces"]) or "|" in mark:
        return None
    decimal = decimal_mark([cell for row in cells for cell in row if isinstance(cell, str)])
    if decimal is None:
        return None
    try:
        frame = pd.read_csv(
            io.BytesIO(middle.encode()),
            sep=mark,
            header=None,
            decimal=decimal,
            skipinitialspace=True,
            keep_default_na=False,
        )
    except (pd.errors.ParserError, ValueError):
        return None
    whole = frame.shape == (middle.count("\n"), width)
    return Bulk(frame, at, line) if whole and any(kind.kind in "fi" for kind in frame.dtypes) else None


# how a text is divided


@dataclass(frozen=True)
class Splitter:
    """A way to divide lines; ``edges``: where columns of fixed width begin."""

    mark: str
    name: str
    edges: tuple[int, ...] = ()

    def __call__(self, lines: Sequence[str]) -> list[list[Cell]]:
        """Cells of every line; a quotation mark that is not closed ends with its line."""
        if self.mark == FIXED:
            spans = list(zip(self.edges, [*self.edges[1:], None], strict=True))
            return [[line.expandtabs()[a:b].strip() for a, b in spans] for line in lines]
        if self.mark in SPACES.values():
            joined = _joined if self.mark != SPACES["every space"] else str.strip
            return [
                [one[1]]
                if (one := _CELL.fullmatch(line))
                else [
                    cell.replace("_", " ") if is_moment(cell) else cell.strip('"')
                    for cell in re.split(self.mark, joined(line))
                ]
                for line in lines
            ]
        if self.mark == "|":
            lines = [line.strip().removeprefix("|").removesuffix("|") if _is_ruled(line) else line for line in lines]
        reader = [next(csv.reader([line], delimiter=self.mark, skipinitialspace=True)) for line in lines]
        return [[cell.strip() for cell in cells] for cells in reader]


def _joined(line: str) -> str:
    """A line whose dates and times of day are one word."""
    return _DATE_AND_TIME.sub(r"\1_\2", line.strip())


def _is_ruled(line: str) -> bool:
    """Whether a line begins and ends with a bar, as that of a markdown table."""
    return line.strip().startswith("|") and line.strip().endswith("|")


def _splitter(lines: Sequence[str], delimiter: str | None, columns: int | None, decisions: Decisions) -> Splitter:
    """The mark that divides best, and those that divide nearly as well."""
    if delimiter is not None:
        name = next((name for name, mark in DELIMITERS.items() if mark == delimiter), repr(delimiter))
        return Splitter(delimiter, name)
    sample = lines[:: max(1, len(lines) // SAMPLE)]
    known = [Splitter(mark, name) for name, mark in (DELIMITERS | SPACES).items()]
    edges = _edges(sample)
    known += [Splitter(FIXED, FIXED, edges)] if len(edges) > 1 else []
    rated = [(*_rating(one, lines, sample, columns), -n) for n, one in enumerate(known)]
    most = max(rated)[0]
    best = max(range(len(known)), key=lambda n: (rated[n][1] and rated[n][0] >= HEADED * most, *rated[n]))
    body = sample[len(sample) // 2 :]
    divided = known[best](body)
    white = known[best].name in (*SPACES, FIXED)
    for n, one in enumerate(known):
        if white and one.name in (*SPACES, FIXED):
            continue
        if n != best and rated[n][0] >= CLOSE * rated[best][0] > 0.0 and one(body) != divided:
            decisions.reject(f"{one.name} between columns", f"{known[best].name} divides more rows alike")
    return known[best]


def _rating(split: Splitter, lines: Sequence[str], sample: Sequence[str], columns: int | None) -> tuple[float, bool]:
    """How many rows a mark makes alike and of numbers, and whether it divides the header alike.

    A mark that makes another number of ``columns`` than there are is rated low.
    """
    rows = [row for row in split(sample) if any(map(_tells, row))]
    if not rows:
        return 0.0, False
    width = Counter(map(len, rows)).most_common(1)[0][0]
    even = [row for row in rows if len(row) == width]
    filled = [cell for row in even for cell in row if cell != ""]
    rating = len(even) * sum(map(_tells, filled)) / max(len(filled), 1) * (0.1 if columns not in (None, width) else 1.0)
    head = split(lines[:SAMPLE])
    first = next((n for n, row in enumerate(head) if len(row) == width and any(map(_tells, row))), 0)
    heads = split(lines[max(first - 3, 0) : first])
    return round(rating if width > 1 else 0.5 * rating, 6), any(len(one) == width for one in heads)


def _tells(cell: Cell) -> bool:
    """Whether a cell is a number, also with its unit, or a time."""
    plain = not isinstance(cell, str) or looks_numeric(cell) or is_moment(cell)
    return plain or any(form.fullmatch(str(cell)) for form in (MEASURE, DEGREES))


def _edges(sample: Sequence[str]) -> tuple[int, ...]:
    """Where columns begin whose rows have nothing between them, and some of whose cells are empty."""
    words = [re.split(r"\s{2,}", line.strip()) for line in sample]
    width = max(map(len, words))
    lines = [line.expandtabs() for line, row in zip(sample, words, strict=True) if len(row) > width / 2]
    if len(lines) < 2 or width < 2 or any(";" in line for line in lines[:1]):
        return ()
    longest = max(map(len, lines))
    used: NDArray[np.bool_] = np.any([[c != " " for c in line.ljust(longest)] for line in lines], axis=0)
    free = ~used & np.r_[~used[1:], False]
    starts = [n for n in range(longest) if used[n] and (n == 0 or (free[n - 2] if n > 1 else not used[n - 1]))]
    return tuple(starts)


def mark_of(path: str, cells: Sequence[str], decisions: Decisions) -> str:
    """The decimal mark that numbers written as text share; a question where it cannot be told."""
    mark = decimal_mark(cells)
    if mark is None:
        example = next((cell for cell in cells if "," in cell), "")
        what = "a comma may be a decimal mark or group thousands"
        decisions.ask(
            path, what, QuestionAnswer("decimal", "comma"), QuestionAnswer("decimal", "point"), found=repr(example)
        )
    return mark or ","

"""Dates and times of day in a table or before the lines of a log -> when it began, and seconds since then."""

from __future__ import annotations

import calendar
import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.importing.tables.vocabulary import WORDS

_ZONE = r"(?:Z|[+-]\d\d:?\d\d)$"
_OF_DAY = re.compile(r"(?<![\d:+-])\d{1,2}:\d\d(:\d\d(\.\d+)?)?(?: ?([AP]M))?(?![\d:]|[ _]\d{1,2}:)", re.IGNORECASE)
_WORD = re.compile(r"(?<![%A-Za-z])(?!T%)[A-Za-z]+|\d+")
"""Of a format in the making: what is no directive yet."""
_ORDERS = {"Y--": "Ymd", "--Y": "dmY mdY", "---": "dmy mdy", "-bY": "dbY", "b-Y": "bdY", "-b-": "dby", "Yb-": "Ybd"}
"""Orders of day, month and year: four digits are a year, a word is a month."""
_STAMP = re.compile(
    r"(?<![\d.:])(?:\d{1,4}([-/.:])\d{1,2}\1\d{1,4}[T_ -]+)?"
    r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d{1,6})?)?(?!\d|:\d)(?: ?[AP]M)?",
    re.ASCII,
)
_ENGLISH = frozenset(month.lower() for month in calendar.month_abbr[1:])
_MONTHS = {"mär": "mar", "mrz": "mar", "mai": "may", "okt": "oct", "dez": "dec", "juni": "jun", "juli": "jul"}
_NO_DAY = datetime.datetime(1900, 1, 1)
_EARLIEST = datetime.datetime(1980, 1, 2)
"""Clocks that were never set count from 1904, 1970 or 1980."""
LONGEST = 40
"""Characters of a moment."""


@dataclass(frozen=True)
class Clock:
    """The times of all rows.

    ``elapsed_s (n,)``: since the first row; ``start``: date and time of the first row, ISO 8601, None where they have
    no date or one that is not certain; ``words``: what is not as a clock tells it.
    """

    elapsed_s: Array
    start: str | None
    words: tuple[str, ...]

    @property
    def stands(self) -> bool:
        """Whether all rows have the same time, as where they have a date alone."""
        return len(self.elapsed_s) > 1 and not np.ptp(self.elapsed_s)


@dataclass(frozen=True)
class _Reading:
    """All cells in one style: seconds since the first one, the first one, and whether any has a date."""

    elapsed_s: Array
    first: datetime.datetime
    dated: bool


@lru_cache(20_000)
def is_moment(cell: object) -> bool:
    """Whether a cell looks like a date or a time of day; digits alone are a number."""
    if not isinstance(cell, str) or len(cell) > LONGEST or not any(map(str.isdigit, cell)) or cell.isdigit():
        return False
    return bool(_formats(_plain(cell)))


def read_clock(cells: Sequence[object], at: Callable[[int], str], header: str) -> Clock:
    """The times of all rows; ``at``: the place of a row, ``header``: the name of the column, for messages.

    Times of day without a date pass midnight where they fall. :class:`InputError` for cells that are no time, and for
    dates that may be day/month or month/day with different results.
    """
    if any(isinstance(cell, str) for cell in cells):
        readings = _readings(cells, at, header)
    else:
        readings = [_taken([_moment(cell) for cell in cells])]
    if any(not np.allclose(one.elapsed_s, readings[0].elapsed_s) for one in readings):
        raise InputError(
            at(0),
            f"the dates of column {header!r} may be day/month or month/day",
            found=repr(str(cells[0])),
            expected="dates like 2026-03-02",
        )
    start, doubt = _start(readings, cells[0])
    return Clock(readings[0].elapsed_s, start, (*doubt, *_set_back(readings[0].elapsed_s, cells, at)))


def counted_clock(values: Array) -> tuple[Array, str | None]:
    """Numbers without a unit as seconds: counts since 1970 in s, ms, us or ns, or since 1601 in 100 ns; else seconds.

    With the words on what was taken.
    """
    largest = float(np.abs(values).max(initial=0.0))
    if 1e17 <= largest < 4e17:
        return (values - values[0]) * 1e-7, "times are taken as 100 ns since 1601"
    for factor, words in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")):
        if 5e8 <= largest * factor < 4e9:
            return (values - values[0]) * factor, f"times are taken as {words} since 1970"
    return values, None


def is_date(header: str) -> bool:
    """Whether a column is named as that of dates, beside one of times of day."""
    return header.strip().casefold() in WORDS["day"]


def joined(dates: Sequence[object], times: Sequence[object]) -> list[str]:
    """Dates in one column and times of day in another, as one text for each row."""
    days = [f"{day:%Y-%m-%d}" if isinstance(day, datetime.datetime) else str(day) for day in dates]
    return [f"{day} {time}".strip() for day, time in zip(days, times, strict=True)]


def stamp_in(text: str) -> str | None:
    """The date and time of day that stands in a text, as it stands there; None where there is none."""
    match = _STAMP.search(text)
    return None if match is None else match[0]


def _readings(cells: Sequence[object], at: Callable[[int], str], header: str) -> list[_Reading]:
    """The moments of all cells in every format in which all of them are moments."""
    texts = list(map(str, cells))
    readings = [one for style in _formats(texts[0]) if (one := _parsed(texts, style)) is not None]
    if readings:
        return readings
    texts = list(map(_plain, texts))
    if any(re.search(r":\d\d\.\d", text) for text in texts):  # some clocks leave out a fraction that is 0
        texts = [re.sub(r"(:\d\d:\d\d)(?![.\d])", r"\1.0", text) for text in texts]
    styles = _formats(texts[0])
    readings = [one for style in styles if (one := _parsed(texts, style)) is not None]
    if not readings:
        row = next((n for n, text in enumerate(texts) if all(_parsed([text], style) is None for style in styles)), 0)
        found, expected = repr(str(cells[row])), "e.g. 2026-03-02 10:11:12"
        raise InputError(at(row), f"column {header!r} is no time", found=found, expected=expected)
    return readings


@lru_cache(20_000)
def _formats(text: str) -> list[str]:
    """The formats of strptime that a text may have: a time of day, a day in a usual order, or both; else none."""
    if re.fullmatch(r"\d{8}( \d{6}Z?)?", text):
        return ["%Y%m%d %H%M%S%z"[: {8: 6, 15: 13}.get(len(text))]]
    style, timed = _OF_DAY.subn(_time_format, text)
    style = re.sub(f"(?<=[Sfp])(?:{_ZONE})", "%z", style) if timed else style
    words = _WORD.findall(style) if timed < 2 else ["?"]
    lengths = {4: "Y", 1: "-", 2: "-"}
    kind = "".join(lengths.get(len(one), "?") if one.isdigit() else "b?"[one not in _ENGLISH] for one in words)
    orders = _ORDERS.get(kind, "").split() if words else [""] * timed
    if kind == "---" and ":" in text[:3]:
        orders = ["ymd"]
    orders = [order for order in orders if order[-1:] != "y" or len(words[-1]) == 2]
    orders = orders[:1] if re.match(r"\d+\.\d+\.", text) else orders
    between = _WORD.split(style)
    return ["".join(a + b for a, b in zip(between, [*(f"%{c}" for c in order), ""], strict=True)) for order in orders]


def _time_format(clock: re.Match[str]) -> str:
    seconds, fraction, half = clock.groups()
    style = f"{'%I' if half else '%H'}:%M{':%S' if seconds else ''}{'.%f' if fraction else ''}"
    return f"{style} %p" if half else style


def _plain(text: str) -> str:
    """A blank between date and time, none before the zone, a point and six decimals, months as in English."""
    text = text.strip()
    if any(map(str.isalpha, text)):
        text = re.sub(r"(?i)^(?:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)\w{0,6},? +", "", text)
        text = re.sub(r"(?i)[a-zä]{3,9}", _month, text)
        text = re.sub(r"(?<=[a-z]{3})( +\d{1,2}),", r"\1", text).replace(". ", " ")
    text = re.sub(r"(?<=\d)(?:T|_|-|, ?| )+(?=\d{1,2}:\d\d|\d{6}Z?$)", " ", text).replace("_", " ").replace(",", ".")
    text = re.sub(f"(?<=\\d) +(?={_ZONE})", "", text)
    return re.sub(r"(\.\d{6})\d+", r"\1", re.sub(r"(?<=\d)(?=[AP]M$)", " ", text, flags=re.IGNORECASE))


def _month(match: re.Match[str]) -> str:
    name = match[0].casefold()
    return _MONTHS.get(name, _MONTHS.get(name[:3], name[:3] if len(name) != 3 else name))


def _start(readings: Sequence[_Reading], cell: object) -> tuple[str | None, tuple[str, ...]]:
    """When the first row was taken, and words where its date is not kept."""
    if all(one.first.date() == _NO_DAY.date() for one in readings):
        return None, ()
    found, first = f"warning: the date of the measurement is not kept: {cell}", readings[0].first
    if len({one.first for one in readings}) > 1:
        return None, (f"{found} may be day/month or month/day",)
    if not _EARLIEST < first.replace(tzinfo=None) < datetime.datetime.now() + datetime.timedelta(days=1):
        return None, (f"{found} cannot be (is the clock set?)",)
    return first.isoformat(timespec="seconds"), ()


def _set_back(elapsed_s: Array, cells: Sequence[object], at: Callable[[int], str]) -> tuple[str, ...]:
    """The warning where the times run back, as where summer time ends in the middle of a run."""
    back = np.flatnonzero(np.diff(elapsed_s) < 0.0) + 1
    if not len(back):
        return ()
    row, more = int(back[0]), f", and {len(back) - 1} times more" if len(back) > 1 else ""
    by_s = elapsed_s[row - 1] - elapsed_s[row]
    return (
        f"warning: {at(row)}: the time runs back by {by_s:g} s, from {cells[row - 1]} to {cells[row]}{more}; time_s is"
        " as the file has it, and drift and order in time are not known from there on (was the clock set?)",
    )


def _parsed(texts: Sequence[str], style: str) -> _Reading | None:
    import pandas as pd

    moments = pd.to_datetime(list(texts), format=style, errors="coerce", utc="%z" in style)
    if moments.hasnans:
        return None
    seconds = (moments - moments[0]).total_seconds().to_numpy(float)
    first = datetime.datetime.strptime(re.sub(r"(\.\d{6})\d+", r"\1", texts[0]), style)
    return _Reading(_past_midnight(seconds, dated="%d" in style), first, "%d" in style)


def _taken(moments: Sequence[datetime.datetime]) -> _Reading:
    dated = any(moment.date() != _NO_DAY.date() for moment in moments)
    seconds = np.array([(moment - moments[0]).total_seconds() for moment in moments])
    return _Reading(_past_midnight(seconds, dated=dated), moments[0], dated)


def _past_midnight(seconds: NDArray[Any], *, dated: bool) -> Array:
    return seconds.astype(float) if dated else seconds + 86400.0 * np.cumsum(np.r_[0, np.diff(seconds) < -43200.0])


def _moment(cell: object) -> datetime.datetime:
    if isinstance(cell, datetime.datetime):
        return cell
    if isinstance(cell, datetime.time):
        return datetime.datetime.combine(_NO_DAY, cell)
    if isinstance(cell, datetime.timedelta):
        return _NO_DAY + cell
    return _NO_DAY + datetime.timedelta(days=float(str(cell)))

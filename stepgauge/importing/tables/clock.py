"""Dates and times of day in a table or before the lines of a log -> when it began, and seconds since then."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array

_NUMBERED = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%Y%m%d")
_NAMED = ("%d-%b-%Y", "%d %b %Y", "%b %d %Y", "%d-%b-%y", "%Y-%b-%d")
_DAYS = (*_NUMBERED, *_NAMED, "%y:%m:%d", "%Y:%m:%d")
_DATES = tuple(day for day in _DAYS if ":" not in day)
"""Of rows without a time of day, which numbers with colons are."""
_ZONED = tuple(f"%Y-%m-%d {time}%z" for time in ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M"))
"""With the offset from UTC, as in RFC 3339."""
_ZONE = r"(Z|[+-]\d\d:?\d\d)?$"
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
_BEHIND = (*(f"{time} {day}" for day in _NUMBERED for time in _TIMES[:3]), *(f"%b %d {t} %Y" for t in _TIMES[:2]))
"""The day behind the time of day, or around it."""
_STYLES = (
    *_ZONED,
    "%Y%m%d %H%M%S%z",
    *(f"{day} {time}" for day in _DAYS for time in _TIMES),
    *_TIMES,
    *_DATES,
    *_BEHIND,
    "%Y%m%d %H%M%S",
)
_STAMP = re.compile(
    r"(?<![\d.:])(?:\d{1,4}([-/.:])\d{1,2}\1\d{1,4}[T_ -]+)?"
    r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d{1,6})?)?(?!\d|:\d)(?: ?[AP]M)?",
    re.ASCII,
)
_MOMENT = re.compile(
    r"(?:\w{2,3},? )?(?:\d{1,4}([-/.])(?:\d{1,2}|[A-Za-zä]{3,9})\1\d{1,4}|\d{1,2}\.? [A-Za-zä]{3,9} \d{4})"
    r"(?:[T_ -]+\d{1,2}:\d\d\S*(?: ?[AP]M)?(?: ?[+-]\d\d:?\d\d)?)?|\d{1,2}:\d\d(?::\d\d\S*)?(?: ?[AP]M)?"
    r"(?:[ _]\d{1,4}([-/.])\d{1,2}\2\d{1,4})?|\d{8}[T_]\d{6}Z?|(?:\w{3} )?[A-Za-z]{3} +\d{1,2},? [\d:., ]+(?:[AP]M)?",
    re.IGNORECASE,
)
"""What looks like a date, a time of day, or both."""
_MONTHS = {"mär": "mar", "mrz": "mar", "mai": "may", "okt": "oct", "dez": "dec", "juni": "jun", "juli": "jul"}
_NO_DAY = datetime.datetime(1900, 1, 1)
_EARLIEST = datetime.datetime(1980, 1, 2)
"""Clocks that were never set count from 1904, 1970 or 1980."""
MANY = 5_000
"""Texts from which pandas parses them; it knows fewer years, and is ten times as fast."""


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


def is_moment(cell: object) -> bool:
    """Whether a cell looks like a date or a time of day."""
    return isinstance(cell, str) and len(cell) < 40 and _MOMENT.fullmatch(cell) is not None


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
    return header.strip().casefold() in ("date", "datum", "jour", "day", "tag")


def joined(dates: Sequence[object], times: Sequence[object]) -> list[str]:
    """Dates in one column and times of day in another, as one text for each row."""
    days = [f"{day:%Y-%m-%d}" if isinstance(day, datetime.datetime) else str(day) for day in dates]
    return [f"{day} {time}".strip() for day, time in zip(days, times, strict=True)]


def stamp_in(text: str) -> str | None:
    """The date and time of day that stands in a text, as it stands there; None where there is none."""
    match = _STAMP.search(text)
    return None if match is None else match[0]


def _readings(cells: Sequence[object], at: Callable[[int], str], header: str) -> list[_Reading]:
    """The moments of all cells in every style in which all of them are moments."""
    if len(cells) > MANY and (plain := _read_many(cells)) is not None:
        return plain
    texts = [_plain(str(cell)) for cell in cells]
    if any(re.search(r":\d\d\.\d+" + _ZONE, text) for text in texts):  # some clocks leave out a fraction that is 0
        texts = [re.sub(r"(:\d\d:\d\d)" + _ZONE, r"\1.0\2", text) for text in texts]
    few = texts[:: max(1, len(texts) // 50)]
    styles = [style for style in _STYLES if _parse_all(few, style) is not None]
    readings = [one for style in styles if (one := _parse_all(texts, style)) is not None]
    if not readings:
        row = next((i for i, text in enumerate(texts) if all(_parse_all([text], s) is None for s in _STYLES)), 0)
        raise InputError(
            at(row), f"column {header!r} is no time", found=repr(str(cells[row])), expected="e.g. 2026-03-02 10:11:12"
        )
    return readings


def _read_many(cells: Sequence[object]) -> list[_Reading] | None:
    """The same of many cells that are written as a style has them; None where they are not, or not all."""
    few = [str(cell) for cell in cells[:: len(cells) // 50]]
    if [_plain(text) for text in few] != few:
        return None
    styles = [style for style in _STYLES if _parse_all(few, style) is not None]
    readings = [_parse_all(cells, style) for style in styles]
    return [one for one in readings if one is not None] or None


def _plain(text: str) -> str:
    """A blank between date and time, none before the zone, a point and six decimals, months as in English."""
    text = text.strip()
    if any(letter.isalpha() for letter in text):
        text = re.sub(
            r"^(?:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)\w{0,6},? +", "", text, flags=re.IGNORECASE
        )
        text = re.sub(r"[a-zä]{3,9}", _month, text, flags=re.IGNORECASE)
        text = re.sub(r"(?<=[a-z]{3})( +\d{1,2}),", r"\1", text, flags=re.IGNORECASE).replace(". ", " ")
    text = re.sub(r"(?<=\d)(?:T|_|-|, ?| )+(?=\d{1,2}:\d\d|\d{6}Z?$)", " ", text).replace("_", " ").replace(",", ".")
    text = re.sub(r"(?<=\d) +" + _ZONE, r"\1", text)
    return re.sub(r"(\.\d{6})\d+" + _ZONE, r"\1\2", text)


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


def _parse_all(texts: Sequence[Any], style: str) -> _Reading | None:
    if len(texts) > MANY:
        moments = pd.to_datetime(pd.Series(texts, dtype=object), format=style, errors="coerce", utc="%z" in style)
        if moments.isna().any():
            return None
        seconds = (moments - moments.iloc[0]).dt.total_seconds().to_numpy(float)
        return _Reading(_past_midnight(seconds, dated="%d" in style), moments.iloc[0].to_pydatetime(), "%d" in style)
    try:
        return _taken([datetime.datetime.strptime(text, style) for text in texts])
    except ValueError:
        return None


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

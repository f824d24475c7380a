"""Dates and times of day in a table or before the lines of a log -> when it began, and seconds since then."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError

Array = NDArray[np.float64]
_DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%y:%m:%d", "%Y:%m:%d")
_DATES = tuple(day for day in _DAYS if ":" not in day)
"""Of rows without a time of day, which numbers with colons are."""
_ZONED = tuple(f"%Y-%m-%d {time}%z" for time in ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M"))
"""With the offset from UTC, as in RFC 3339."""
_ZONE = r"(Z|[+-]\d\d:?\d\d)?$"
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
_STAMP = re.compile(
    r"(?<![\d.:])(?:\d{1,4}([-/.:])\d{1,2}\1\d{1,4}[T_ ]+)?"
    r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d{1,6})?)?(?!\d|:\d)(?: ?[AP]M)?",
    re.ASCII,
)
_NO_DAY = datetime.datetime(1900, 1, 1)
_EARLIEST = datetime.datetime(1980, 1, 2)
"""Clocks that were never set count from 1904, 1970 or 1980."""


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


def read_clock(cells: Sequence[object], at: Callable[[int], str], header: str) -> Clock:
    """The times of all rows; ``at``: the place of a row, ``header``: the name of the column, for messages.

    Times of day without a date pass midnight where they fall. :class:`InputError` for cells that are no time, and for
    dates that may be day/month or month/day with different results.
    """
    if any(isinstance(cell, str) for cell in cells):
        readings = _readings(cells, at, header)
    else:
        readings = [[_moment(cell) for cell in cells]]
    elapsed = [_elapsed(reading) for reading in readings]
    if any(not np.allclose(one, elapsed[0]) for one in elapsed):
        raise InputError(
            at(0),
            f"the dates of column {header!r} may be day/month or month/day",
            found=repr(str(cells[0])),
            expected="dates like 2026-03-02",
        )
    start, doubt = _start([reading[0] for reading in readings], cells[0])
    return Clock(elapsed[0], start, (*doubt, *_set_back(elapsed[0], cells, at)))


def is_date(header: str) -> bool:
    """Whether a column is named as that of dates, beside one of times of day."""
    return header.strip().casefold() in ("date", "datum", "jour", "day", "tag")


def joined(dates: Sequence[object], times: Sequence[object]) -> list[str]:
    """Dates in one column and times of day in another, as one text for each row."""
    days = [f"{day:%Y-%m-%d}" if isinstance(day, datetime.datetime) else str(day) for day in dates]
    return [f"{day} {time}".strip() for day, time in zip(days, times, strict=True)]


def _readings(cells: Sequence[object], at: Callable[[int], str], header: str) -> list[list[datetime.datetime]]:
    """The moments of all cells in every style in which all of them are moments."""
    texts = [_plain(cell) for cell in cells]
    if any(re.search(r":\d\d\.\d+" + _ZONE, text) for text in texts):  # some clocks leave out a fraction that is 0
        texts = [re.sub(r"(:\d\d:\d\d)" + _ZONE, r"\1.0\2", text) for text in texts]
    readings = [reading for style in _styles() if (reading := _parse_all(texts, style)) is not None]
    if not readings:
        row = next((i for i, text in enumerate(texts) if all(_parse_all([text], s) is None for s in _styles())), 0)
        raise InputError(
            at(row), f"column {header!r} is no time", found=repr(str(cells[row])), expected="e.g. 2026-03-02 10:11:12"
        )
    return readings


def _plain(cell: object) -> str:
    """The text of a time: a blank between date and time, none before the zone, a point and six decimals."""
    text = str(cell).strip().replace("T", " ").replace("_", " ").replace(",", ".")
    text = re.sub(r"(?<=\d) +" + _ZONE, r"\1", text)
    return re.sub(r"(\.\d{6})\d+" + _ZONE, r"\1\2", text)


def _start(firsts: Sequence[datetime.datetime], cell: object) -> tuple[str | None, tuple[str, ...]]:
    """When the first row was taken, and words where its date is not kept."""
    if all(first.date() == _NO_DAY.date() for first in firsts):
        return None, ()
    found = f"warning: the date of the measurement is not kept: {cell}"
    if len(set(firsts)) > 1:
        return None, (f"{found} may be day/month or month/day",)
    if not _EARLIEST < firsts[0].replace(tzinfo=None) < datetime.datetime.now() + datetime.timedelta(days=1):
        return None, (f"{found} cannot be (is the clock set?)",)
    return firsts[0].isoformat(timespec="seconds"), ()


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


def stamp_in(text: str) -> str | None:
    """The date and time of day that stands in a text, as it stands there; None where there is none."""
    match = _STAMP.search(text)
    return None if match is None else match[0]


def _styles() -> list[str]:
    return [*_ZONED, *(f"{day} {time}" for day in _DAYS for time in _TIMES), *_TIMES, *_DATES]


def _parse_all(texts: Sequence[str], style: str) -> list[datetime.datetime] | None:
    try:
        return [datetime.datetime.strptime(text, style) for text in texts]
    except ValueError:
        return None


def _moment(cell: object) -> datetime.datetime:
    if isinstance(cell, datetime.datetime):
        return cell
    if isinstance(cell, datetime.time):
        return datetime.datetime.combine(_NO_DAY, cell)
    if isinstance(cell, datetime.timedelta):
        return _NO_DAY + cell
    return _NO_DAY + datetime.timedelta(days=float(str(cell)))


def _elapsed(moments: Sequence[datetime.datetime]) -> Array:
    seconds = np.array([(moment - moments[0]).total_seconds() for moment in moments])
    if all(moment.date() == _NO_DAY.date() for moment in moments):
        seconds += 86400.0 * np.cumsum(np.r_[0, np.diff(seconds) < -43200.0])
    return seconds

"""Dates and times of day in a table or before the lines of a log -> seconds since its first row."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError

Array = NDArray[np.float64]
_DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%y:%m:%d", "%Y:%m:%d")
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
_STAMP = re.compile(
    r"(?<![\d.:])(?:\d{1,4}([-/.:])\d{1,2}\1\d{1,4}[T_ ]+)?"
    r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d{1,6})?)?(?!\d|:\d)(?: ?[AP]M)?",
    re.ASCII,
)
_NO_DAY = datetime.datetime(1900, 1, 1)


def seconds_of(cells: Sequence[object], at: Callable[[int], str], header: str) -> Array:
    """Seconds since the first row, shape ``(n,)``.

    Times of day without a date pass midnight where they fall. :class:`InputError` for cells that are no time, and for
    dates that may be day/month or month/day with different results.
    """
    if not any(isinstance(cell, str) for cell in cells):
        return _elapsed([_moment(cell) for cell in cells])
    texts = [str(cell).strip().replace("T", " ").replace("_", " ").replace(",", ".") for cell in cells]
    if any(re.search(r":\d\d\.\d+$", text) for text in texts):  # some clocks leave out a fraction that is 0
        texts = [re.sub(r"(:\d\d:\d\d)$", r"\1.0", text) for text in texts]
    readings = [reading for style in _styles() if (reading := _parse_all(texts, style)) is not None]
    if not readings:
        row = next((i for i, text in enumerate(texts) if all(_parse_all([text], s) is None for s in _styles())), 0)
        raise InputError(
            at(row), f"column {header!r} is no time", found=repr(str(cells[row])), expected="e.g. 2026-03-02 10:11:12"
        )
    elapsed = [_elapsed(reading) for reading in readings]
    if any(not np.allclose(one, elapsed[0]) for one in elapsed):
        raise InputError(
            at(0),
            f"the dates of column {header!r} may be day/month or month/day",
            found=repr(str(cells[0])),
            expected="dates like 2026-03-02",
        )
    return elapsed[0]


def stamp_in(text: str) -> str | None:
    """The date and time of day that stands in a text, as it stands there; None where there is none."""
    match = _STAMP.search(text)
    return None if match is None else match[0]


def _styles() -> list[str]:
    return [*(f"{day} {time}" for day in _DAYS for time in _TIMES), *_TIMES]


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

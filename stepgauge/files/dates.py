"""When something was measured: ISO 8601 dates and times, as files carry them."""

from __future__ import annotations

import datetime
import re
from pathlib import Path

from stepgauge.errors import InputError, Place

YEAR_DAYS = 365.25
EARLIEST = 1970
"""Year before which nothing was measured that is still of use; clocks of controllers begin there when they are lost."""
_IN_PATH = re.compile(r"(?<!\d)(\d{4})-(\d{2})-(\d{2})(?!\d)")


def parse_moment(text: str, where: Place) -> datetime.datetime:
    """A date or a date with time as local time without zone.

    :class:`InputError` where it is none, before :data:`EARLIEST`, or in the future.
    """
    try:
        moment = datetime.datetime.fromisoformat(text.strip())
    except ValueError:
        raise InputError(
            where,
            "measured_at is no date",
            found=repr(text),
            expected=f"{_iso_of(text)}, with time 2026-03-02T14:30",
        ) from None
    if moment.year < EARLIEST:
        raise InputError(where, "measured_at is too long ago", found=text, expected=f"a date from {EARLIEST} on")
    if moment.tzinfo is not None:
        moment = moment.astimezone().replace(tzinfo=None)
    if moment > datetime.datetime.now() + datetime.timedelta(days=1):
        raise InputError(where, "measured_at lies in the future", found=text)
    return moment


def moment_now() -> str:
    """The time of the computer's clock, to the second and with its zone, as recordings carry it."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def check_past(day: datetime.date, where: Place, what: str) -> None:
    """:class:`InputError` for a day that has not come yet, or is before :data:`EARLIEST`."""
    if day.year < EARLIEST:
        raise InputError(where, f"{what} is too long ago", found=day, expected=f"a date from {EARLIEST} on")
    if day > datetime.date.today():
        raise InputError(where, f"{what} lies in the future", found=day, expected="today or a day before")


def _iso_of(text: str) -> str:
    """The date that was meant, year first, where that can be told; else an example."""
    match = re.fullmatch(r"(\d{1,2})\.(\d{1,2})\.(\d{4})", text.strip())
    return f"{match[3]}-{match[2]:0>2}-{match[1]:0>2}" if match else "2026-03-02"


def first_moment(text: str | None, where: Place) -> str | None:
    """The earliest of the dates that joined recordings carry (``"; "`` between them), as it was written."""
    if text is None:
        return None
    return min(moments(text), key=lambda one: parse_moment(one, where))


def moments(text: str) -> list[str]:
    """The dates that joined recordings carry, as they were written."""
    return [one.strip() for one in text.split(";")]


def moment_in_path(path: Path) -> datetime.datetime | None:
    """The last date (2026-03-02) in the names of folders and file, None where there is none."""
    for part in reversed(path.parts):
        for match in reversed(list(_IN_PATH.finditer(part))):
            try:
                moment = datetime.datetime(*map(int, match.groups()))  # type: ignore[arg-type]
            except ValueError:
                continue
            if moment.year >= EARLIEST:
                return moment
    return None

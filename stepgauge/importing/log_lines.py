"""The lines of a log: one loop for the readers of all formats."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.importing.tables.clock import read_clock, stamp_in


class LogLines:
    """The one loop over the lines of a log: where it stands, the points that it finds, and what becomes of the rest.

    Iterating gives every line that is not blank, without white space at its ends; ``blank``: further characters that
    make no line.
    """

    def __init__(self, text: str, path: str, blank: str = "") -> None:
        self.path, self.line, self._whole, self._blank = path, 0, text, " \t" + blank
        self.at: list[int] = []
        self.points: list[list[float]] = []
        self.failures: list[tuple[int, str]] = []
        self.alarms: list[tuple[int, str]] = []
        self.dropped: Counter[str] = Counter()
        self.notes: list[str] = []

    def __iter__(self) -> Iterator[str]:
        for number, line in enumerate(self._whole.splitlines(), 1):
            if line.strip(self._blank):
                self.line = number
                yield line.strip()

    def add(self, values: Sequence[float]) -> None:
        """A point that stands in this line."""
        self.at.append(self.line)
        self.points.append(list(values))

    def fail(self, what: str, found: object = None, expected: object = None, line: int | None = None) -> NoReturn:
        """:class:`InputError` for this line, or another one; 0 is the whole file."""
        number = self.line if line is None else line
        raise InputError(f"{self.path}:{number}" if number else self.path, what, found=found, expected=expected)

    def values(self, what: str, expected: str) -> Array:
        """All points, ``(n, m)``; :class:`InputError` where there are none."""
        if not self.points:
            self.fail(what, expected=expected, line=0)
        return np.array(self.points)

    def check_other_axes(self, values: ArrayLike) -> None:
        """Probed is with x, y and z alone: a turned table makes coordinates of other places (``values (n, m)``)."""
        other = np.asarray(values, dtype=float).reshape(len(self.at), -1)
        moved = (other != 0.0).any(axis=1)
        if moved.any():
            row = int(moved.argmax())
            found, expected = " ".join(f"{value:g}" for value in other[row]), "0 in all other axes (a b c u v w)"
            self.fail("an axis other than x, y, z was moved", found, expected, self.at[row])

    def clock_s(self) -> Array | None:
        """Seconds since the first point by the clock before the lines of all points; None where not all have one.

        A clock that does not go on, or is not understood, is left out with a note.
        """
        every = self._whole.splitlines()
        stamps = [stamp_in(every[line - 1].rpartition("[")[0]) for line in self.at]
        if None in stamps:
            return None
        try:
            elapsed_s = read_clock(stamps, lambda _: self.path, "time").elapsed_s
        except InputError as error:
            elapsed_s = np.array([np.nan])
            self.notes.append(f"dropped: times that are not understood ({error.found})")
        goes_on = bool((np.diff(elapsed_s) >= 0.0).all()) and float(np.ptp(elapsed_s)) > 0.0
        return elapsed_s.round(6) if goes_on else None

    def log(self, form: str, position_mm: Array, **known: Any) -> ProbeLog:
        """The log of these lines; ``known``: further fields of :class:`ProbeLog`."""
        words = [f"{count} {name}" for name, count in sorted(self.dropped.items())]
        left_out = (*([f"dropped: {', '.join(words)}"] if words else []), *self.notes)
        failures = tuple(sorted([*self.failures, *self.alarms]))
        told = {"failures": failures, "alarms": tuple(self.alarms), "left_out": left_out}
        return ProbeLog(self.path, form, position_mm, np.array(self.at), **{**told, **known})


def unit_vectors(vectors: Array) -> Array:
    """Rows scaled to length 1; rows whose printed digits are those of a unit vector are left as they are."""
    size = np.linalg.norm(vectors, axis=1)
    return np.where(np.abs(size - 1.0)[:, None] < 1e-9, vectors, vectors / size[:, None])

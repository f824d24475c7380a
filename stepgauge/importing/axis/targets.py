"""The artefact of an axis: a gauge file, a list of targets in words or in a file, or none."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.axis.units import NAMES
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number, tidy
from stepgauge.files.units import LENGTH_MM
from stepgauge.gauge.certified import Gauge
from stepgauge.importing.tables.cells import any_number, read_text_cells
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.source import read_source

MOST_TARGETS = 100_000
ON_LIST, FEWEST_ON_LIST = 0.02, 3
"""Numbers are nominal positions where as many different ones are met, each as near as this in its unit; or as a
tenth of its least step. Rounded positions in inch, and readings of them, are."""


@dataclass(frozen=True)
class Targets:
    """``nominal``, ``certified (m,)``: positions in the unit of the table's targets, rising; ``u (m,)``: standard
    uncertainties in um, nought where none are stated; ``name``: what it is called; ``gauge``: whether they are mm."""

    nominal: Array
    certified: Array
    u: Array
    name: str
    gauge: bool = False

    def matched(self, target: Array, at: str) -> NDArray[np.intp]:
        """Index of the target of every row: by its nominal position, else by its number in the list."""
        near = np.abs(target[:, None] - self.nominal).argmin(axis=1)
        off, counted = np.abs(target - self.nominal[near]), self.counted(target)
        told_apart = len(np.unique(near)) == len(np.unique(target))
        if (off <= self.reach).all() and (told_apart or counted is None):
            return near
        if counted is not None:
            return counted
        row = int(off.argmax())
        expected = f"one of the {len(self.nominal)} of {self.name}"
        raise InputError(at, "a target is not in the list", found=f"{target[row]:g}", expected=expected)

    def counted(self, numbers: Array) -> NDArray[np.intp] | None:
        """Index of every target by its number, from 1, or from 0 where one is 0; None for what counts none of them."""
        first = 0 if numbers.min(initial=1) == 0 else 1
        whole = (numbers == np.floor(numbers)) & (numbers >= first) & (numbers < len(self.nominal) + first)
        return numbers.astype(np.intp) - first if whole.all() else None

    @property
    def reach(self) -> float:
        """How far from a target what belongs to it may lie: a quarter of the least step."""
        return float(np.diff(np.sort(self.nominal)).min(initial=np.inf)) / 4.0 if len(self.nominal) > 1 else np.inf

    def lists(self, values: Array) -> bool:
        """Whether all numbers of a column are nominal positions, and not one or two alone."""
        there = values[np.isfinite(values)]
        found = np.unique(np.abs(there[:, None] - self.nominal).argmin(axis=1))
        enough = len(found) >= min(FEWEST_ON_LIST, len(self.nominal))
        return enough and self.off_list(there) <= min(ON_LIST, 0.4 * self.reach)

    def off_list(self, values: Array) -> float:
        """How far from the list the number lies that is the farthest from it."""
        there = values[np.isfinite(values)]
        return float(np.abs(there[:, None] - self.nominal).min(axis=1).max(initial=0.0))

    def unit_of(self, values: Array) -> str | None:
        """The unit of length in which numbers are nominal positions, and do not count them; None for none."""
        counts = (values == np.floor(values)).all() and 0 <= values.min(initial=0) <= values.max() <= len(self.nominal)
        known = ["mm"] if counts else ["mm", *(name for name in NAMES if name in LENGTH_MM)]
        return next((name for name in known if self.lists(values * LENGTH_MM[name])), None)

    def nearest(self, reading: Array, placement: NDArray[np.integer[Any]], at: str) -> NDArray[np.intp]:
        """Index of the target that each reading belongs to, where the table names none.

        Every placement has an origin: nought, where its readings are near to the targets, else any.
        """
        found = np.empty(len(reading), np.intp)
        for one in np.unique(placement):
            rows = placement == one
            found[rows] = self._nearest(reading[rows], at)
        return found

    def _nearest(self, reading: Array, at: str) -> NDArray[np.intp]:
        """The same of one placement; :class:`InputError` where no origin, or more than one, brings all near."""
        ends = np.concatenate([reading.min() - self.nominal, reading.max() - self.nominal])
        origins = [0.0] if (self._off(reading) <= self.reach).all() else ends.tolist()
        far = [int((self._off(reading - origin) > self.reach).sum()) for origin in origins]
        best = origins[int(np.argmin(far))]
        fitting = [one for one, off in zip(origins, far, strict=True) if not off]
        columns = "a column of targets, or of the numbers of the faces"
        if not fitting:
            what, value = "a reading belongs to no target", reading[int(self._off(reading - best).argmax())]
            expected = f"readings nearer to their target than to the next one, from any origin, or {columns}"
            raise InputError(at, what, found=f"{value:g}", expected=expected)
        if np.ptp(fitting) > self.reach:
            what, found = "readings fit the targets from several origins", f"{min(fitting):g} and {max(fitting):g}"
            raise InputError(at, what, found=found, expected=columns)
        return np.abs((reading - best)[:, None] - self.nominal).argmin(axis=1)

    def _off(self, reading: Array) -> Array:
        """How far every reading is from the nearest target."""
        return np.abs(reading[:, None] - self.nominal).min(axis=1)


def gauge_targets(gauge: Gauge) -> Targets:
    """The faces of a gauge, at its reference temperature."""
    return Targets(gauge.nominal_mm, gauge.position_mm, gauge.u_um, gauge.table.name, gauge=True)


def parse_targets(text: str) -> Targets:
    """``0:500:25`` (first:last:step), ``0,50,100``, or a file with a column of targets, one of certified positions, and
    one of standard uncertainties in um; the later ones may be missing.

    :class:`InputError` where it is none of these, or targets are there twice.
    """
    if Path(text).is_file():
        return _checked(_read_targets(text), text)
    parts = text.split(":")
    if len(parts) == 3:
        first, last, step = [number(part.strip()) for part in parts]
        if np.isfinite([first, last, step]).all() and step and 0 <= (last - first) / step <= MOST_TARGETS:
            return _checked(
                _plain(np.array([first + step * n for n in range(round((last - first) / step) + 1)]), text), text
            )
    values: Array = np.array([number(tidy(part)) for part in text.replace(";", ",").split(",")])
    if np.isfinite(values).all() and len(values) > 1:
        return _checked(_plain(values, text), text)
    expected = "FIRST:LAST:STEP, a list such as 0,50,100, or a file"
    raise InputError(naming("targets"), "not understood", found=repr(text), expected=expected)


def _plain(values: Array, name: str) -> Targets:
    return Targets(values, values, np.zeros(len(values)), name)


def _read_targets(path: str) -> Targets:
    """Columns of numbers in a file, rows of text left out."""
    cells = read_text_cells(read_source(path), None, Decisions()).rows
    rows = [row for one in cells if (row := list(filter(np.isfinite, map(any_number, one))))]
    width = max((len(row) for row in rows), default=0)
    if not 1 <= width <= 3 or any(len(row) != width for row in rows):
        expected = "one to three numbers in every row: target, certified position, standard uncertainty in um"
        raise InputError(path, "no list of targets", found=f"up to {width} numbers in a row", expected=expected)
    table = np.array(rows)
    u = table[:, 2] if width == 3 else np.zeros(len(table))
    return Targets(table[:, 0], table[:, min(1, width - 1)], u, Path(path).name)


def _checked(found: Targets, where: str) -> Targets:
    if len(np.unique(found.nominal)) < len(found.nominal):
        raise InputError(naming("targets"), "a target is there twice", found=where, expected="every target once")
    return found

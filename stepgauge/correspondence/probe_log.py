"""A controller's log before it is known what its points are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import at_row
from stepgauge.files.arrays import Array
from stepgauge.files.units import LENGTH_MM

NO_CONTACT = "no contact within the search"
"""What an alarm says where a face was not found."""


@dataclass(frozen=True)
class ProbeLog:
    """Rows of a log in the order in which they stand there.

    Parameters
    ----------
    path : the file, for messages
    form : what kind of log it is, in words
    position_mm : tip centres at the trigger, or surface points (see ``surface``), shape ``(n, 3)``
    line : line of the file of each row, shape ``(n,)``
    number : the point's number in the program, counted from 1, shape ``(n,)``; None where the log does not state it
    success : whether the controller saw a contact, shape ``(n,)``; None where the log does not state it
    skips_repeats : the controller leaves out a point that is identical to the one before
    time_s : when the points were logged, by the controller's clock, shape ``(n,)``; None where the log has no time
    dropped : how many lines were no points (blank lines and comments)
    approach : unit directions towards the surface, shape ``(n, 3)``; None where the log has no directions
    label : the point's name, one a row; None where the log has none
    columns : what else a recording keeps, by the name of its column, each ``(n,)``
    comments : what the log says of the whole run; names of a recording's columns hold for every row
    surface : True for points compensated by the tip radius, False for tip centres, None where the log does not say
    tip_radius_mm : what the log says of it
    cut : what is missing at the end of a file that ought to have an end mark; empty where nothing is
    failures : line and text of what the controller reported as failed
    alarms : those of them after which the position may be lost
    units : the unit of lengths that the log states; several where it leaves a choice, none where it says nothing
    mapped, left_out : what became of the parts of the file, in words
    degrees : headers of columns in degrees of temperature of which nothing says whose they are
    """

    path: str
    form: str
    position_mm: Array
    line: NDArray[np.int64]
    number: NDArray[np.int64] | None = None
    success: NDArray[np.bool_] | None = None
    skips_repeats: bool = False
    time_s: Array | None = None
    dropped: int = 0
    approach: Array | None = None
    label: Sequence[str] | None = None
    columns: Mapping[str, Array] = field(default_factory=dict)
    comments: Mapping[str, str] = field(default_factory=dict)
    surface: bool | None = False
    tip_radius_mm: float | None = None
    cut: str = ""
    failures: Sequence[tuple[int, str]] = ()
    alarms: Sequence[tuple[int, str]] = ()
    units: tuple[str, ...] = ()
    mapped: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    degrees: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.position_mm)

    def at(self, row: int) -> str:
        """``file:line`` of a row (counted from 0)."""
        return at_row(self.path, self.line[row])

    def taken(self, rows: NDArray[np.bool_]) -> ProbeLog:
        """The log with some of its rows."""
        optional = {"number": self.number, "success": self.success, "time_s": self.time_s, "approach": self.approach}
        arrays = {name: values[rows] for name, values in optional.items() if values is not None}
        label = None if self.label is None else [one for one, keep in zip(self.label, rows, strict=True) if keep]
        columns = {name: values[rows] for name, values in self.columns.items()}
        own = {"position_mm": self.position_mm[rows], "line": self.line[rows], "label": label, "columns": columns}
        return replace(self, **own, **arrays)  # type: ignore[arg-type]

    def convert_unit(self, name: str) -> ProbeLog:
        """The log whose lengths were printed in a unit of length other than mm."""
        radius = None if self.tip_radius_mm is None else self.tip_radius_mm * LENGTH_MM[name]
        words = (*self.mapped, f"lengths in {name}")
        scaled = self.position_mm * LENGTH_MM[name]
        return replace(self, position_mm=scaled, tip_radius_mm=radius, units=("mm",), mapped=words)

"""The recording: one row per probing, the table that every later step reads; how it is written."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.numerals import number
from stepgauge.files.parquet import is_parquet, write_parquet
from stepgauge.files.text import replacing
from stepgauge.recording.columns import APPROACH, COUNTS, OPTIONAL, POSITION, SCALE_TEMPERATURES, SCALES_C, TEMPERATURES
from stepgauge.recording.corrected import share_radius

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, NDArray[Any]]
_DECIMALS = {**dict.fromkeys(POSITION, 7), **dict.fromkeys(APPROACH, 10), "time_s": 4}
PIECE_ROWS = 100_000
"""Rows written at a time."""
PROBINGS = "probings"
"""Comment with the number of rows, by which a file that was cut is known."""


class TableField:
    """Field of a dataclass that takes a table as DataFrame or as columns, and gives a DataFrame.

    The one is made of the other when it is first asked for: pandas takes longer to load than most verbs work. Whoever
    has the DataFrame may change it, so that the columns are read from it anew.
    """

    def __set__(self, owner: Any, table: pd.DataFrame | Mapping[str, NDArray[Any]]) -> None:
        if isinstance(table, Mapping):
            owner.__dict__["columns"] = {name: np.asarray(values) for name, values in table.items()}
        else:
            owner.__dict__["_frame"] = table

    def __get__(self, owner: Any, kind: type) -> pd.DataFrame:
        if owner is None:
            raise AttributeError  # the field has no default
        if "_frame" not in owner.__dict__:
            import pandas as pd

            owner.__dict__["_frame"] = pd.DataFrame(owner.__dict__["columns"])
        owner.__dict__.pop("columns", None)
        return cast("pd.DataFrame", owner.__dict__["_frame"])


@dataclass(frozen=True, repr=False)
class Recording(Plotted):
    """Indicated tip centres at the trigger.

    ``frame`` has the columns of ``REQUIRED`` plus ``placement`` (1 where the file has none), any of ``OPTIONAL``, and
    further numeric columns as they were found; it may be given as a mapping of arrays ``(n,)``. ``comments`` are the
    ``# key: value`` lines before the header.
    """

    drawn_by: ClassVar[str] = "recording.draw_recording"
    frame: TableField = TableField()
    comments: Mapping[str, str] = field(default_factory=dict)
    path: str = ""

    def __len__(self) -> int:
        return len(self.columns["face"])

    def summary(self) -> str:
        """How much was measured, and what the recording says of itself."""
        cycles, faces = int(self.columns["cycle"].max()), len(np.unique(self.columns["face"]))
        first = f"{len(self)} probings of {faces} faces, {cycles} cycles, placements {self.placements}"
        return join_lines(first, *(f"{key}: {value}" for key, value in self.comments.items()))

    def to_frame(self) -> pd.DataFrame:
        """One row per probing, a copy of ``frame``: coordinates in mm, time in s, temperatures in deg C.

        ``attrs`` has the comments, so that it is the same recording wherever a DataFrame is taken for one.
        """
        found = self.frame.copy()
        found.attrs.update(self.comments)
        return found

    def write(self, path: str | Path) -> None:
        """Write the recording, CSV or (by the extension) Parquet, coordinates to 1e-7 mm."""
        write_recording(path, self)

    def _stated(self) -> Any:
        names = columns_in_order(self)
        return dict(self.comments), {name: rounded_column(name, self.columns[name]) for name in names}

    @cached_property
    def columns(self) -> Columns:
        """The columns of ``frame`` as arrays ``(n,)``, which are not to be changed."""
        return {str(name): np.ascontiguousarray(values.to_numpy()) for name, values in self.frame.items()}

    def numbers(self, names: Sequence[str]) -> list[Array]:
        """The named columns as floats, each ``(n,)``."""
        return [self.columns[name].astype(float, copy=False) for name in names]

    @property
    def position_mm(self) -> Array:
        """Tip centres, shape ``(n, 3)``."""
        return np.stack(self.numbers(POSITION), axis=1)

    @property
    def approach(self) -> Array:
        """Unit directions of travel towards the surface, shape ``(n, 3)``."""
        return np.stack(self.numbers(APPROACH), axis=1)

    @property
    def placements(self) -> list[int]:
        """Numbers of the placements, rising."""
        column = self.columns["placement"]
        lowest, highest = int(column.min()), int(column.max())  # mostly one: no need to sort every row
        return [lowest] if lowest == highest else [int(p) for p in np.unique(column)]

    def select_placement(self, placement: int) -> Recording:
        """The rows of one placement."""
        return self.select_rows(self.columns["placement"] == placement)

    def select_rows(self, rows: NDArray[Any]) -> Recording:
        """Some of the rows, by their indices or a mask."""
        return Recording({name: values[rows] for name, values in self.columns.items()}, self.comments, self.path)

    def assign_columns(self, **columns: Any) -> Recording:
        """The recording with further or other columns, each ``(n,)`` or one value for all rows."""
        made = {name: np.full(len(self), one) if np.ndim(one) == 0 else one for name, one in columns.items()}
        return Recording({**self.columns, **made}, self.comments, self.path)

    def assign_comments(self, **comments: str | None) -> Recording:
        """The recording with comments set; None leaves one as it is."""
        given = {key: value for key, value in comments.items() if value is not None}
        return Recording(self._table, {**self.comments, **given}, self.path)

    @property
    def _table(self) -> Any:
        """The table in the form that is there."""
        return self.__dict__.get("_frame", self.__dict__.get("columns"))


def write_recording(path: str | Path, recording: Recording, at_once: bool = False) -> None:
    """Write a recording as CSV, comments first, or (by the extension) as Parquet; coordinates to 1e-7 mm.

    It is rounded and written piece by piece, so that a large one needs no second copy in memory. ``at_once`` (CSV):
    now, whatever else the verb still has to write.
    """
    names = columns_in_order(recording)
    if is_parquet(path):
        import pandas as pd

        write_parquet(path, (pd.DataFrame(piece) for piece in _rounded_pieces(recording, names)), recording.comments)
        return
    with replacing(path, at_once) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        for key, value in recording.comments.items():
            file.writelines(f"# {key}: {line}\n" for line in value.split("\n"))
        file.write(f"# {PROBINGS}: {len(recording)}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for piece in _rounded_pieces(recording, names):
            writer.writerows(zip(*(_cells(column) for column in piece.values()), strict=True))


def columns_in_order(recording: Recording) -> list[str]:
    """Names of the columns as they are written: the known ones in their order, then the others."""
    known = [name for name in [*COUNTS, *POSITION, *APPROACH, *OPTIONAL[1:]] if name in recording.columns]
    return [*known, *(name for name in recording.columns if name not in known)]


def _rounded_pieces(recording: Recording, names: Sequence[str]) -> Iterator[Columns]:
    for first in range(0, max(len(recording), 1), PIECE_ROWS):
        rows = slice(first, first + PIECE_ROWS)
        yield {name: rounded_column(name, recording.columns[name][rows]) for name in names}


def rounded_column(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """The values of a column as they are written."""
    return np.round(values, _DECIMALS[name]) if name in _DECIMALS else values


def _cells(column: NDArray[Any]) -> list[Any]:
    """Values as they are written: NaN is an empty cell."""
    values: list[Any] = column.tolist()
    if column.dtype.kind != "f" or not np.isnan(column).any():
        return values
    return ["" if value != value else value for value in values]


def join_recordings(recordings: Sequence[Recording]) -> Recording:
    """Several recordings as one; placements that carry the same number in two of them are numbered on.

    Scales whose temperature only some recorded have, in the others, that of the comment from the machine file.
    :class:`InputError` where only some of them state a temperature: nobody knows how warm the others were; or where
    only some had been corrected for the tip.
    """
    recordings = share_radius(_share_temperatures(recordings))
    parts, taken = list[Recording](), 0
    for recording in recordings:
        own = recording.columns["placement"]
        least = int(own.min(initial=taken + 1))  # a run may have ended before its first touch
        on = own - least + taken + 1
        parts.append(recording.assign_columns(placement=on) if least <= taken else recording)
        taken = int(parts[-1].columns["placement"].max(initial=taken))
    comments: dict[str, str] = {}
    for recording in recordings:
        for key, value in recording.comments.items():
            said = comments.get(key, value)
            comments[key] = said if value in said.split("; ") else f"{said}; {value}"
    path = ", ".join(recording.path for recording in recordings if recording.path)
    names = dict.fromkeys(name for part in parts for name in part.columns)
    return Recording({name: np.concatenate([_column(part, name) for part in parts]) for name in names}, comments, path)


def _share_temperatures(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with all temperatures that any of them has."""
    there = [name for name in TEMPERATURES if any(name in one.columns for one in recordings)]
    return [_complete_temperatures(one, [name for name in there if name not in one.columns]) for one in recordings]


def _complete_temperatures(recording: Recording, lacking: Sequence[str]) -> Recording:
    scales_C = number(recording.comments.get(SCALES_C, ""))
    unknown = next((one for one in lacking if one not in SCALE_TEMPERATURES or np.isnan(scales_C)), None)
    if unknown in SCALE_TEMPERATURES:
        raise InputError(
            recording.path,
            "the temperature of its scales is neither recorded nor stated, that of the others is",
            expected=naming("machine", words="{}, whose temperature counts where none is recorded"),
        )
    if unknown is not None:
        raise InputError(
            recording.path,
            "the temperature of the gauge is not recorded, in the others it is",
            expected="it in all of them: import this one again and state it",
        )
    return recording.assign_columns(**dict.fromkeys(lacking, scales_C)) if lacking else recording


def _column(recording: Recording, name: str) -> NDArray[Any]:
    """A column, NaN where a recording has none of that name."""
    return recording.columns[name] if name in recording.columns else np.full(len(recording), np.nan)

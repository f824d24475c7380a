"""The recording: one row per probing, the table that every later step reads."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.errors import InputError, reader
from stepgauge.files.arrays import Array
from stepgauge.files.outputs import was_read
from stepgauge.files.parquet import is_parquet, read_parquet, write_parquet
from stepgauge.files.shown import Plotted, as_lines
from stepgauge.files.tables import is_foreign
from stepgauge.files.text import replacing
from stepgauge.recording.columns import APPROACH, COUNTS, KNOWN, OPTIONAL, POSITION, REQUIRED, near_miss
from stepgauge.recording.lines import LONGEST_HEADER, lines_beside, read_comments, row_lines
from stepgauge.recording.temperatures import no_temperature

_DECIMALS = {**dict.fromkeys(POSITION, 7), **dict.fromkeys(APPROACH, 10), "time_s": 4}
PIECE_ROWS = 100_000
"""Rows written at a time."""
PROBINGS = "probings"
"""Comment with the number of rows, by which a file that was cut is known."""
MOST_COUNT = 10_000_000
"""Larger numbers of cycles, faces or placements are no counts."""
LARGEST_MM = 100_000.0
"""No machine of this kind has coordinates of 100 m."""


@dataclass(frozen=True, repr=False)
class Recording(Plotted):
    """Indicated tip centres at the trigger.

    ``frame`` has the columns of ``REQUIRED`` plus ``placement`` (1 where the file has none), any of ``OPTIONAL``, and
    further numeric columns as they were found. ``comments`` are the ``# key: value`` lines before the header.
    """

    drawn_by: ClassVar[str] = "recording.draw_recording"
    frame: pd.DataFrame
    comments: Mapping[str, str] = field(default_factory=dict)
    path: str = ""

    def __len__(self) -> int:
        return len(self.frame)

    def summary(self) -> str:
        """How much was measured, and what the recording says of itself."""
        cycles, faces = int(self.frame["cycle"].max()), self.frame["face"].nunique()
        first = f"{len(self)} probings of {faces} faces, {cycles} cycles, placements {self.placements}"
        return as_lines(first, *(f"{key}: {value}" for key, value in self.comments.items()))

    def to_frame(self) -> pd.DataFrame:
        """One row per probing, a copy of ``frame``: coordinates in mm, time in s, temperatures in deg C."""
        return self.frame.copy()

    def write(self, path: str | Path) -> None:
        """Write the recording, CSV or (by the extension) Parquet, coordinates to 1e-7 mm."""
        write_recording(path, self)

    @classmethod
    def of_columns(cls, columns: Mapping[str, NDArray[Any]], comments: Mapping[str, str], path: str = "") -> Recording:
        """From checked columns ``(n,)``, as :attr:`columns` of another one."""
        made = cls(pd.DataFrame(dict(columns), copy=False), comments, path)
        made.__dict__["columns"] = dict(columns)
        return made

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
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

    def of_placement(self, placement: int) -> Recording:
        """The rows of one placement."""
        return Recording(self.frame[self.frame["placement"] == placement], self.comments, self.path)

    def with_comments(self, **comments: str | None) -> Recording:
        """The recording with comments set; None leaves one as it is."""
        given = {key: value for key, value in comments.items() if value is not None}
        return Recording(self.frame, {**self.comments, **given}, self.path)


@reader("recording")
def read_recording(path: str | Path) -> Recording:
    """Read and check a recording, CSV or (by its extension) Parquet.

    :class:`InputError` names the line or column of: missing columns, names that are nearly a known one, text or NaN in
    a number column, counts that are not whole numbers from 1, coordinates beyond 100 m, approaches that are not unit
    vectors, temperatures that are not deg C, speeds below 0.
    """
    if Path(path).exists() and not Path(path).is_file():
        kind = "a folder" if Path(path).is_dir() else "a device or a pipe"
        raise InputError(path, "this is no file", found=kind, expected="a recording (CSV)")
    was_read(path)
    if is_parquet(path):
        frame, comments = read_parquet(path)
        header, beside = 0, list[int]()  # rows are counted from 1
    elif Path(path).is_file() and (found := _of_any_make(path)) is not None:
        return found
    else:
        comments, skipped = read_comments(path)
        if "recording" in comments and "sensor" in comments:
            form, expected = comments["recording"], "a recording of a gauge; 'diagnose' and 'iso230' read this one"
            raise InputError(path, "this is no recording of a gauge", found=form, expected=expected)
        header = skipped + 1
        beside = lines_beside(path, header)
        frame = _read_csv(path, skipped, beside)
        _check_complete(comments.pop(PROBINGS, None), len(frame), path)
    lines = row_lines(len(frame), header, beside)
    _check_columns(frame, path, header)
    frame = _check_numbers(frame, path, lines)
    _check_values(frame, path, lines)
    return Recording(frame, comments, str(path))


def _of_any_make(path: str | Path) -> Recording | None:
    """A recording in another encoding, or with other marks or names, that states cycle, face and approach of every row.

    None for one that is written as ours are, or is none at all.
    """
    foreign = is_foreign(path, REQUIRED)
    if not foreign:
        return None
    from stepgauge.importing import import_log  # which makes recordings of what others write

    try:
        found = import_log(path, "csv").settled()
    except InputError as error:
        if foreign == "names":
            return None
        expected = "a recording as stepgauge writes it; 'stepgauge import' makes one"
        raise InputError(path, error.what, found=error.found, expected=expected) from None
    assert isinstance(found, Recording)
    return found


def _check_complete(stated: str | None, rows: int, path: str | Path) -> None:
    if stated is not None and stated != str(rows):
        raise InputError(
            path,
            "the recording is cut, or rows were added",
            found=f"{rows} rows",
            expected=f"{stated}, by its comment '# {PROBINGS}' (take that line out where it was done on purpose)",
        )


def is_recording_file(path: str | Path) -> bool:
    """Whether the extension is that of a recording, rather than of a measuring program."""
    return is_parquet(path) or Path(path).suffix.lower() == ".csv"


def _read_csv(path: str | Path, skipped: int, beside: Sequence[int]) -> pd.DataFrame:
    """The table below the ``skipped`` lines, without those ``beside`` it (counted from 1)."""
    over = [*range(skipped), *(line - 1 for line in beside)] if beside else skipped
    try:
        _check_header(path, skipped)
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas would drop what has no column
            return pd.read_csv(path, skiprows=over, skip_blank_lines=False, index_col=False)
    except pd.errors.ParserWarning:
        where = f"{path}:{skipped + 1}"
        raise InputError(where, "the rows have more cells than the header", expected=",".join(REQUIRED)) from None
    except pd.errors.EmptyDataError:
        raise InputError(path, "the recording is empty", expected="a header " + ",".join(REQUIRED)) from None
    except (pd.errors.ParserError, UnicodeDecodeError) as error:
        line = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if line:
            where = f"{path}:{int(line[2])}"
            raise InputError(where, "wrong number of cells", found=line[3], expected=line[1]) from None
        raise InputError(path, f"not a CSV table: {error}") from None


def _check_header(path: str | Path, skipped: int) -> None:
    """Every column once (pandas would rename the second), and separated by commas."""
    where = f"{path}:{skipped + 1}"
    with Path(path).open(encoding="utf-8-sig") as file:
        for _ in range(skipped):
            file.readline()
        line = file.readline(LONGEST_HEADER)
    header = [name.strip() for name in line.split(",")]
    if len(header) == 1 and any(mark in line for mark in ";\t|"):
        what = "the columns are not separated by commas"
        raise InputError(where, what, found=line, expected="a recording, which 'stepgauge import' makes of any table")
    twice = [name for name in header if header.count(name) > 1]
    if twice:
        raise InputError(where, f"column {twice[0]!r} is there twice", found=line)


def _check_columns(frame: pd.DataFrame, path: str | Path, line: int) -> None:
    frame.columns = frame.columns.astype(str).str.strip()
    absent = [name for name in KNOWN if name not in frame.columns]
    near = {near_miss(name, absent): name for name in frame.columns if name not in KNOWN}
    missing = [name for name in REQUIRED if name in absent]
    for name in (missing[:1], absent)[not missing]:
        if name in near:
            raise InputError(
                f"{path}:{line}",
                f"column {near[name]!r} is not known, and {name!r} is missing",
                found=near[name],
                expected=f"{name}, or a name that is less like it for what is something else",
            )
    if missing:
        found = ",".join(frame.columns)
        what = f"column {missing[0]!r} is missing"
        raise InputError(f"{path}:{line}", what, found=found, expected=",".join(REQUIRED))
    if frame.empty:
        raise InputError(path, "the recording has a header but no rows")


def _check_numbers(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> pd.DataFrame:
    """All columns as numbers; further columns of text are refused with the rest, for a diagnosis could not use them.

    A column that may be missing and has no cell is missing.
    """
    empty = [
        name for name in OPTIONAL if name in frame and frame[name].iloc[:1].isna().all() and frame[name].isna().all()
    ]
    frame = frame.drop(columns=empty) if empty else frame
    for name in frame.columns:
        values = frame[name]
        if not (pd.api.types.is_numeric_dtype(values) and not pd.api.types.is_bool_dtype(values)):
            numbers = pd.to_numeric(values, errors="coerce")
            _refuse(numbers.isna().to_numpy(), frame, path, lines, name, "is not a number")
        column = values.to_numpy()
        if name in REQUIRED + OPTIONAL and column.dtype.kind != "i":
            _refuse(~np.isfinite(column.astype(float, copy=False)), frame, path, lines, name, "is not a finite number")
    if "placement" not in frame:
        frame.insert(0, "placement", 1)
    return frame


def _refuse(
    bad: NDArray[np.bool_],
    frame: pd.DataFrame,
    path: str | Path,
    lines: Sequence[int],
    name: str,
    what: str,
    expected: str = "",
) -> None:
    if bad.any():
        row = int(bad.argmax())
        value = frame[name].iloc[row]
        found = _written(path, lines[row], frame.columns.get_loc(name)) if pd.isna(value) else str(value)
        raise InputError(f"{path}:{lines[row]}", f"column {name} {what}", found=found, expected=expected or "a number")


def _written(path: str | Path, line: int, place: Any) -> str:
    """What stands in the file where no number was read: ``nan`` is something else than an empty cell."""
    if is_parquet(path) or not Path(path).is_file():
        return "nothing"
    with Path(path).open(encoding="utf-8-sig") as file:
        cells = next(csv.reader([next(islice(file, line - 1, None), "")]), [])
    text = cells[place].strip() if isinstance(place, int) and place < len(cells) else ""
    return repr(text) if text else "nothing"


def _check_values(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> None:
    _check_counts(frame, path, lines)
    _check_positions(frame, path, lines)
    _check_approach(frame, path, lines)
    _check_temperatures(frame, path, lines)
    if "speed_mm_s" in frame:
        stands = frame["speed_mm_s"].to_numpy(float) <= 0
        _refuse(stands, frame, path, lines, "speed_mm_s", "must be positive", "mm/s")


def _check_counts(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> None:
    """Counts are whole numbers, and from here on they are kept as such."""
    for name in COUNTS:
        counts = frame[name].to_numpy()
        wrong = (counts < 1) | (counts > MOST_COUNT)
        if counts.dtype != np.int64:
            wrong |= counts != np.floor(counts)
        _refuse(wrong, frame, path, lines, name, "is not a count", "a whole number from 1")
        if counts.dtype != np.int64:
            frame[name] = counts.astype(np.int64)


def _check_positions(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> None:
    for name in POSITION:
        column = frame[name].to_numpy(float)
        if max(column.max(), -column.min()) > LARGEST_MM:
            beyond = np.abs(column) > LARGEST_MM
            _refuse(beyond, frame, path, lines, name, "is no coordinate of a machine", "within 100 m (unit?)")


def _check_approach(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> None:
    """In place, for a recording may have millions of rows."""
    i, j, k = (frame[name].to_numpy(float) for name in APPROACH)
    size = i * i
    size += j * j
    size += k * k
    np.sqrt(size, out=size)
    if max(size.max() - 1.0, 1.0 - size.min()) > 1e-3:
        row = int((np.abs(size - 1.0) > 1e-3).argmax())
        raise InputError(
            f"{path}:{lines[row]}",
            "the approach is not a unit vector",
            found=f"length {size[row]:.4f}",
            expected="1",
        )


def _check_temperatures(frame: pd.DataFrame, path: str | Path, lines: Sequence[int]) -> None:
    for name in OPTIONAL:
        if name.endswith("_C") and name in frame:
            wrong = no_temperature(frame[name].to_numpy(float), frame["placement"].to_numpy())
            if wrong is not None:
                where, what = f"{path}:{lines[wrong.row]}", f"column {name} {wrong.why}"
                raise InputError(where, what, found=wrong.found, expected=wrong.expected)


def write_recording(path: str | Path, recording: Recording, at_once: bool = False) -> None:
    """Write a recording as CSV, comments first, or (by the extension) as Parquet; coordinates to 1e-7 mm.

    It is rounded and written piece by piece, so that a large one needs no second copy in memory. ``at_once`` (CSV):
    now, whatever else the verb still has to write.
    """
    known = [name for name in [*COUNTS, *POSITION, *APPROACH, *OPTIONAL[1:]] if name in recording.frame]
    others = [name for name in recording.frame.columns if name not in known]
    pieces = _rounded_pieces(recording.frame, known + others)
    if is_parquet(path):
        write_parquet(path, pieces, recording.comments)
        return
    with replacing(path, at_once) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        for key, value in recording.comments.items():
            file.writelines(f"# {key}: {line}\n" for line in value.split("\n"))
        file.write(f"# {PROBINGS}: {len(recording)}\n")
        for number, piece in enumerate(pieces):
            piece.to_csv(file, index=False, header=number == 0, lineterminator="\n")


def _rounded_pieces(frame: pd.DataFrame, columns: list[str]) -> Iterator[pd.DataFrame]:
    for first in range(0, max(len(frame), 1), PIECE_ROWS):
        yield frame.iloc[first : first + PIECE_ROWS][columns].round(_DECIMALS)


def recording_of_frame(frame: pd.DataFrame, name: str = "recording") -> Recording:
    """The recording of a table with the columns of a recording's file; errors as :func:`read_recording`.

    What stands in the comments of a file stands in ``frame.attrs``.
    """
    table = frame.reset_index(drop=True)
    _check_columns(table, name, 0)
    lines = range(1, len(table) + 1)
    table = _check_numbers(table, name, lines)
    _check_values(table, name, lines)
    return Recording(table, {str(key): str(value) for key, value in frame.attrs.items()}, name)


def join_recordings(recordings: Sequence[Recording]) -> Recording:
    """Several recordings as one; placements that carry the same number in two of them are numbered on."""
    frames, taken = [], 0
    for recording in recordings:
        frame = recording.frame
        if taken and frame["placement"].min() <= taken:
            frame = frame.assign(placement=frame["placement"] + taken)
        taken = int(frame["placement"].max())
        frames.append(frame)
    comments: dict[str, str] = {}
    for recording in recordings:
        for key, value in recording.comments.items():
            known = comments.get(key, value)
            comments[key] = known if value in known.split("; ") else f"{known}; {value}"
    path = ", ".join(recording.path for recording in recordings)
    return Recording(pd.concat(frames, ignore_index=True), comments, path)


def read_recordings(paths: Sequence[str | Path]) -> Recording:
    """One or more recordings, read and joined as :func:`join_recordings` does."""
    tables = [read_recording(path) for path in paths]
    return tables[0] if len(tables) == 1 else join_recordings(tables)

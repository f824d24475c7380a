"""A recording is read and checked: its file, or a DataFrame that stands for one."""

from __future__ import annotations

import csv
import re
import warnings
from collections import Counter
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import FRAME, InputError, at_row, reader
from stepgauge.files.outputs import was_read
from stepgauge.files.parquet import is_parquet, read_parquet
from stepgauge.files.tables import is_foreign
from stepgauge.files.units import column_name
from stepgauge.recording.columns import APPROACH, COUNTS, KNOWN, OPTIONAL, POSITION, REQUIRED, near_miss
from stepgauge.recording.lines import LONGEST_HEADER, lines_beside, read_comments, row_lines
from stepgauge.recording.table import PROBINGS, Columns, Recording, join_recordings
from stepgauge.recording.temperatures import no_temperature

if TYPE_CHECKING:
    import pandas as pd

MOST_COUNT = 10_000_000
"""Larger numbers of cycles, faces or placements are no counts."""
LARGEST_MM = 100_000.0
"""No machine of this kind has coordinates of 100 m."""
PLAIN_BYTES = 4_000_000
"""A smaller table is read without pandas, which takes longer to load than to read it."""
_WHOLE = re.compile(r"\s*[+-]?\d{1,15}\s*")


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
        columns = columns_of(frame)
        header, beside = 0, list[int]()  # rows are counted from 1
    elif Path(path).is_file() and (found := _read_foreign(path)) is not None:
        return found
    else:
        comments, skipped = read_comments(path)
        if "recording" in comments and "sensor" in comments:
            raise no_gauge(path, comments["recording"])
        header = skipped + 1
        beside = lines_beside(path, header)
        columns = _read_csv(path, skipped, beside)
        _check_complete(comments.pop(PROBINGS, None), rows_of(columns), path)
    lines = row_lines(rows_of(columns), header, beside)
    return Recording(_checked(columns, path, header, lines), comments, str(path))


def no_gauge(path: str | Path, form: str) -> InputError:
    """What is said of a recording of an axis, a spot or distances in place of one of a gauge."""
    expected = (
        "a recording of a gauge; of this one 'stepgauge test iso230' gives mean and u at every target,"
        " 'stepgauge diagnose' the causes"
    )
    return InputError(path, "this is no recording of a gauge", found=form, expected=expected)


def columns_of(frame: pd.DataFrame) -> Columns:
    """The columns of a DataFrame by their names, without blanks at the ends of these."""
    return {str(name).strip(): values.to_numpy() for name, values in frame.items()}


def rows_of(columns: Columns) -> int:
    """How many rows columns have."""
    return len(next(iter(columns.values()), ()))


def _checked(columns: Columns, path: str | Path, header: int, lines: Sequence[int]) -> Columns:
    """All that :func:`read_recording` checks; counts as whole numbers."""
    _check_columns(columns, path, header)
    columns = _check_numbers(_named_for_laws(columns), path, lines)
    _check_values(columns, path, lines)
    return columns


def _read_foreign(path: str | Path) -> Recording | None:
    """A recording in another encoding, or with other marks or names, that states cycle, face and approach of every row.

    None for one that is written as ours are, or is none at all.
    """
    foreign = is_foreign(path, REQUIRED)
    if not foreign:
        return None
    from stepgauge.importing.logs import import_log  # which makes recordings of what others write

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


def _read_csv(path: str | Path, skipped: int, beside: Sequence[int]) -> Columns:
    """The table below the ``skipped`` lines, without those ``beside`` it (counted from 1)."""
    try:
        _check_header(path, skipped)
        plain = None if beside or Path(path).stat().st_size > PLAIN_BYTES else _plain_columns(path, skipped)
    except UnicodeDecodeError as error:
        raise InputError(path, f"not a CSV table: {error}") from None
    return columns_of(_csv_frame(path, skipped, beside)) if plain is None else plain


def _plain_columns(path: str | Path, skipped: int) -> Columns | None:
    """The columns of a table whose cells all are plain finite numbers; None for any other."""
    with Path(path).open(encoding="utf-8-sig") as file:
        header, *rows = file.readlines()[skipped:] or [""]
    names = [name.strip() for name in header.split(",")]
    if not rows or '"' in header or "" in names:
        return None
    try:
        table = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    if table.shape != (len(rows), len(names)) or not np.isfinite(table).all():
        return None
    counted = [
        _WHOLE.fullmatch(cell) is not None and bool((column == np.round(column)).all() and abs(column).max() < 1e15)
        for cell, column in zip(rows[0].split(","), table.T, strict=True)
    ]
    return {
        name: column.astype(np.int64) if is_count else np.ascontiguousarray(column)
        for name, column, is_count in zip(names, table.T, counted, strict=True)
    }


def _csv_frame(path: str | Path, skipped: int, beside: Sequence[int]) -> pd.DataFrame:
    import pandas as pd

    over = [*range(skipped), *(line - 1 for line in beside)] if beside else skipped
    try:
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
    if line.strip() and not any(name in KNOWN or near_miss(name, KNOWN) for name in header):
        expected = "a recording, which 'stepgauge import' makes of the log of a controller"
        raise InputError(where, "this is no recording: no column has a name of one", found=line, expected=expected)
    twice = [name for name in header if header.count(name) > 1]
    if twice:
        raise InputError(where, f"column {twice[0]!r} is there twice", found=line)


def _named_for_laws(columns: Columns) -> Columns:
    """Columns besides those that are known, by names that a formula can have; none takes the name of another."""
    names = {name: name if name in KNOWN else column_name(name) for name in columns}
    told = Counter(names.values())
    return {names[name] if told[names[name]] == 1 else name: values for name, values in columns.items()}


def _check_columns(columns: Columns, path: str | Path, line: int) -> None:
    where = f"{path}:{line}" if line else path
    absent = [name for name in KNOWN if name not in columns]
    near = {near_miss(name, absent): name for name in columns if name not in KNOWN}
    missing = [name for name in REQUIRED if name in absent]
    for name in (missing[:1], absent)[not missing]:
        if name in near:
            raise InputError(
                where,
                f"column {near[name]!r} is not known, and {name!r} is missing",
                found=near[name],
                expected=f"{name}, or a name that is less like it for what is something else",
            )
    if missing:
        what = f"column {missing[0]!r} is missing"
        raise InputError(where, what, found=",".join(columns), expected=",".join(REQUIRED))
    if not rows_of(columns):
        raise InputError(path, "the recording has a header but no rows")


def _check_numbers(columns: Columns, path: str | Path, lines: Sequence[int]) -> Columns:
    """All columns as numbers; further columns of text are refused with the rest, for a diagnosis could not use them.

    A column that may be missing and has no cell is missing.
    """
    kept = {name: column for name, column in columns.items() if not (name in OPTIONAL and _is_empty(column))}
    for name, column in kept.items():
        if column.dtype.kind not in "iuf":
            _refuse(_no_number(column), kept, path, lines, name, "is not a number")
        if name in REQUIRED + OPTIONAL and column.dtype.kind != "i":
            _refuse(~np.isfinite(column.astype(float, copy=False)), kept, path, lines, name, "is not a finite number")
    rows = rows_of(kept)
    return kept if "placement" in kept else {"placement": np.ones(rows, np.int64), **kept}


def _is_empty(column: NDArray[Any]) -> bool:
    """Whether no row has a cell."""
    if column.dtype.kind == "f":
        return bool(np.isnan(column[:1]).all() and np.isnan(column).all())
    return column.dtype == object and all(one is None or one != one for one in column)


def _no_number(column: NDArray[Any]) -> NDArray[np.bool_]:
    """Which cells of a column of text or of another kind are no numbers."""
    import pandas as pd

    return np.asarray(pd.to_numeric(pd.Series(column), errors="coerce").isna())


def _refuse(
    bad: NDArray[np.bool_],
    columns: Columns,
    path: str | Path,
    lines: Sequence[int],
    name: str,
    what: str,
    expected: str = "",
) -> None:
    if bad.any():
        row = int(bad.argmax())
        value = columns[name][row]
        absent = value is None or value != value
        found = _written(path, lines[row], list(columns).index(name)) if absent else str(value)
        raise InputError(
            at_row(path, lines[row]), f"column {name} {what}", found=found, expected=expected or "a number"
        )


def _written(path: str | Path, line: int, place: Any) -> str:
    """What stands in the file where no number was read: ``nan`` is something else than an empty cell."""
    if is_parquet(path) or not Path(path).is_file():
        return "nothing"
    with Path(path).open(encoding="utf-8-sig") as file:
        cells = next(csv.reader([next(islice(file, line - 1, None), "")]), [])
    text = cells[place].strip() if isinstance(place, int) and place < len(cells) else ""
    return repr(text) if text else "nothing"


def _check_values(columns: Columns, path: str | Path, lines: Sequence[int]) -> None:
    _check_counts(columns, path, lines)
    _check_positions(columns, path, lines)
    _check_approach(columns, path, lines)
    _check_temperatures(columns, path, lines)
    if "speed_mm_s" in columns:
        stands = columns["speed_mm_s"].astype(float) <= 0
        _refuse(stands, columns, path, lines, "speed_mm_s", "must be positive", "mm/s")


def _check_counts(columns: Columns, path: str | Path, lines: Sequence[int]) -> None:
    """Counts are whole numbers, and from here on they are kept as such."""
    for name in COUNTS:
        counts = columns[name]
        wrong = (counts < 1) | (counts > MOST_COUNT)
        if counts.dtype != np.int64:
            wrong |= counts != np.floor(counts)
        _refuse(wrong, columns, path, lines, name, "is not a count", "a whole number from 1")
        if counts.dtype != np.int64:
            columns[name] = counts.astype(np.int64)


def _check_positions(columns: Columns, path: str | Path, lines: Sequence[int]) -> None:
    for name in POSITION:
        column = columns[name].astype(float, copy=False)
        if max(column.max(), -column.min()) > LARGEST_MM:
            beyond = np.abs(column) > LARGEST_MM
            _refuse(beyond, columns, path, lines, name, "is no coordinate of a machine", "within 100 m (unit?)")


def _check_approach(columns: Columns, path: str | Path, lines: Sequence[int]) -> None:
    """In place, for a recording may have millions of rows."""
    i, j, k = (columns[name].astype(float, copy=False) for name in APPROACH)
    size = i * i
    size += j * j
    size += k * k
    np.sqrt(size, out=size)
    if max(size.max() - 1.0, 1.0 - size.min()) > 1e-3:
        row = int((np.abs(size - 1.0) > 1e-3).argmax())
        raise InputError(
            at_row(path, lines[row]),
            "the approach is not a unit vector",
            found=f"length {size[row]:.4f}",
            expected="1",
        )


def _check_temperatures(columns: Columns, path: str | Path, lines: Sequence[int]) -> None:
    for name in OPTIONAL:
        if name.endswith("_C") and name in columns:
            wrong = no_temperature(columns[name].astype(float, copy=False), columns["placement"])
            if wrong is not None:
                where, what = at_row(path, lines[wrong.row]), f"column {name} {wrong.why}"
                raise InputError(where, what, found=wrong.found, expected=wrong.expected)


def recording_of_frame(frame: pd.DataFrame) -> Recording:
    """The recording of a table with the columns of a recording's file; errors as :func:`read_recording`.

    What stands in the comments of a file stands in ``frame.attrs``. One that lacks such a column, or has others than
    numbers, is read as a table of any make.
    """
    columns = columns_of(frame)
    if not {*REQUIRED} <= columns.keys() or any(values.dtype.kind not in "iufb" for values in columns.values()):
        from stepgauge.importing.logs import import_log

        try:
            found = import_log(frame, "csv").settled()
        except InputError as error:  # what it asks for is no argument of the verb that was given the table
            if not error.namings:
                raise
            expected = "what import_recording(table, gauge=.., placement=..) makes of it"
            raise InputError(error.where, error.what, found=error.found, expected=expected) from None
        assert isinstance(found, Recording)
        return found
    checked = _checked(columns, FRAME, 0, range(len(frame)))
    return Recording(checked, {str(key): str(value) for key, value in frame.attrs.items()}, FRAME)


def read_recordings(paths: Sequence[str | Path]) -> Recording:
    """One or more recordings, read and joined as :func:`join_recordings` does."""
    tables = [read_recording(path) for path in paths]
    return tables[0] if len(tables) == 1 else join_recordings(tables)

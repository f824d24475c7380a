"""Records in JSON, and DataFrames, as a table: a list of objects, of lists, or an object of equally long lists."""

from __future__ import annotations

import datetime
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.tables import flat_frame
from stepgauge.importing.tables.cells import LONG, Bulk, Cell, Cells
from stepgauge.importing.tables.source import Source

if TYPE_CHECKING:
    import pandas as pd

MOST_DEEP = 3
"""Objects inside one another within which the records are looked for."""
MOST_ROWS = 1_000_000


def is_json(text: str) -> bool:
    """Whether a text begins as JSON does, or has one object per line."""
    return text.lstrip()[:1] in ("{", "[") and not text.lstrip().startswith("[[effect")


def read_json_cells(source: Source) -> Cells:
    """The records of a JSON file as rows below a header; :class:`InputError` where there are none."""
    path, (text, encoding) = source.name, source.decoded
    comments = list[str]()
    frame = _records(_parse(path, text), comments)
    if frame is None or frame.empty:
        raise InputError(path, "no records are found", expected="a list of objects, or an object of equally long lists")
    if len(frame) > MOST_ROWS:
        raise InputError(path, "too many records", found=len(frame), expected=f"at most {MOST_ROWS}")
    cells = frame_cells(Source(path, b"", frame))
    lines = [0, *(number + 1 for number in cells.lines[1:])]
    return replace(cells, lines=lines, comments=comments, notes=(f"{encoding}, {len(frame)} records",))


def frame_cells(source: Source) -> Cells:
    """The rows of a DataFrame below its header, numbered from 0; an index with a name is a column.

    Labels without any text are counts and no header.
    """
    import pandas as pd

    frame = source.frame
    assert frame is not None
    frame = flat_frame(frame)
    if frame.empty:
        raise InputError(source.name, "the table is empty", expected="a header, and rows of numbers")
    names = [" ".join(map(str, one)) if isinstance(one, tuple) else str(one) for one in frame.columns]
    header: list[list[Cell]] = [[*names]] if any(isinstance(one, str | tuple) for one in frame.columns) else []
    middle, first = None, 100 + len(header)
    if len(frame) > LONG:  # all but the ends as columns
        middle = Bulk(frame.iloc[100:-100].set_axis(range(len(names)), axis=1), first, 100)
        frame = pd.concat([frame.iloc[:100], frame.iloc[-100:]])
    kinds = [[_cell(value) for value in frame.iloc[:, place].tolist()] for place in range(len(names))]
    rows: list[list[Cell]] = [*header, *(list(row) for row in zip(*kinds, strict=True))]
    numbers = np.r_[[0] * len(header), np.arange(len(frame))]
    if middle is not None:
        numbers[first:] += len(middle)
    return Cells(source.name, rows, numbers.tolist(), [], 0, (f"DataFrame, {len(names)} columns",), middle)


def _parse(path: str, text: str) -> Any:
    """One value, or one per line."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) > 1 and all(line.lstrip().startswith("{") for line in lines):
            try:
                return [json.loads(line) for line in lines]
            except json.JSONDecodeError:
                pass
        raise InputError(f"{path}:{error.lineno}", f"not valid JSON: {error.msg}") from None


def _records(value: Any, comments: list[str], deep: int = 0) -> pd.DataFrame | None:
    """The first list of records in a value; plain values beside it go to the comments.

    Values of objects inside a record are columns by their names one after the other; lists inside it are none.
    """
    import pandas as pd

    if isinstance(value, list):
        return _list_frame(value)
    if not isinstance(value, dict) or deep > MOST_DEEP:
        return None
    names, data = value.get("columns"), value.get("data")
    if isinstance(names, list) and isinstance(data, list) and _is_plain(names):  # pandas, orient="split"
        return _list_frame([names, *data])
    columns = {name: one for name, one in value.items() if isinstance(one, list) and _is_plain(one)}
    found = None
    sizes = {len(one) for one in columns.values()}
    if len(sizes) == 1 and max(sizes) > 1:
        found = pd.DataFrame(columns)
    for name, one in value.items():
        if isinstance(one, dict | list) and found is None:
            found = _records(one, comments, deep + 1)
        elif isinstance(one, str | int | float):
            comments.append(f"# {name}: {one}")
    return found


def _list_frame(value: list[Any]) -> pd.DataFrame | None:
    import pandas as pd

    if value and all(isinstance(one, dict) for one in value):
        frame = pd.json_normalize(value, sep=" ")
        return frame.loc[:, [not frame[name].map(lambda one: isinstance(one, list)).any() for name in frame]]
    if len(value) > 1 and all(isinstance(one, list) and _is_plain(one) for one in value):
        return pd.DataFrame(value[1:], columns=[str(name) for name in value[0]])
    return None


def _is_plain(values: list[Any]) -> bool:
    return not any(isinstance(one, list | dict) for one in values)


def _cell(value: Any) -> Cell:
    import pandas as pd

    if value is None or value is pd.NaT or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return ""
    if isinstance(value, pd.Timestamp):
        return value.to_pydatetime()
    if isinstance(value, pd.Timedelta | datetime.time | datetime.datetime | datetime.timedelta):
        return value.to_pytimedelta() if isinstance(value, pd.Timedelta) else value
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else str(value).strip()

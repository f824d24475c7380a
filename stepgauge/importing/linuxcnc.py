"""Reader of LinuxCNC's probe logs, in the forms that the controller writes.

``(LOG,%d#<_n> %.7f#5061 %.7f#5062 %.7f#5063 %d#5070)`` after every G38.2 gives five columns: number, x, y, z, success.
G-code has no clock; a program that reads one from HAL (``M66 E0 L0``, then ``#5399`` in the LOG) adds its seconds as a
sixth. ``(PROBEOPEN file)`` gives nine: x, y, z, a, b, c, u, v, w, without number and success flag, and leaves out a
point identical to the one before. Positions are #5061.., where the probe changed state, in work coordinates and in the
unit of the program, which a comment may state: ``# unit: inch`` or ``# G20``.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.files.units import LENGTH_MM
from stepgauge.importing.log import ProbeLog, check_other_axes, numbered
from stepgauge.recording import comment_lines

_COLUMNS = {5: "n x y z success", 6: "n x y z success seconds", 9: "x y z a b c u v w"}
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?", re.ASCII)
_UNIT = re.compile(r"(?m)^[ \t]*#.*\b(G20|G21)\b")
MOST_POINTS = 1e9


def recognises(text: str) -> bool:
    """Whether the first row is of five, six or nine numbers."""
    first = next(iter(_rows(text)), (0, ""))[1].split()
    return len(first) in _COLUMNS and all(map(_NUMBER.fullmatch, first))


def read(text: str, path: str) -> ProbeLog:
    """The rows of a log; :class:`stepgauge.errors.InputError` names the line that is cut short or not numbers."""
    rows = _rows(text)
    width = len(rows[0][1].split())
    values = np.array([_values(row.split(), width, f"{path}:{place}") for place, row in rows])
    line = np.array([place for place, _ in rows])
    lines = text.splitlines()
    comments, dropped = comment_lines(lines), len(lines) - len(rows)
    units = _units(text, comments.get("unit", ""))
    if width == 9:
        check_other_axes(values[:, 3:], path, line)
        form = "LinuxCNC PROBEOPEN"
        return ProbeLog(
            path, form, values[:, :3], line, skips_repeats=True, dropped=dropped, comments=comments, units=units
        )
    point, success = values[:, 0], values[:, 4]
    time_s: Array = values[:, 5] if width == 6 else np.arange(float(len(rows)))
    whole = (point >= 1) & (point <= MOST_POINTS) & (point == np.floor(point))
    flag, clock = "1 (contact) or 0 (none), from #5070", "a clock on motion.analog-in-00, connected in HAL"
    _check("the point's number is wrong", point, whole, "a whole number from 1", path, line)
    _check("the success flag is wrong", success, np.isin(success, (0.0, 1.0)), flag, path, line)
    _check("the clock does not go on", time_s, np.r_[True, np.diff(time_s) > 0.0], clock, path, line)
    return ProbeLog(
        path,
        "LinuxCNC LOG",
        values[:, 1:4],
        line,
        point.astype(np.int64),
        success == 1.0,
        time_s=time_s if width == 6 else None,
        dropped=dropped,
        comments=comments,
        units=units,
    )


def _units(text: str, stated: str) -> tuple[str, ...]:
    code = _UNIT.search(text)
    name = stated or ({"G20": "inch", "G21": "mm"}[code[1]] if code else "")
    return (name,) if name in LENGTH_MM else ()


def _rows(text: str) -> list[tuple[int, str]]:
    """Line and text of everything but blank lines and ``#`` comments."""
    return [one for one in numbered(text) if not one[1].startswith("#")]


def _values(cells: list[str], width: int, where: str) -> list[float]:
    if len(cells) != width:
        raise InputError(
            where,
            "the row is cut short" if len(cells) < width else "the row is too long",
            found=f"{len(cells)} columns: {' '.join(cells)[:60]!r}",
            expected=f"{width}: {_COLUMNS[width]}",
        )
    wrong = next((cell for cell in cells if not (_NUMBER.fullmatch(cell) and np.isfinite(number(cell)))), None)
    if wrong is not None:
        raise InputError(where, "not a number", found=repr(wrong), expected=_COLUMNS[width])
    return [number(cell) for cell in cells]


def _check(
    what: str, value: Array, right: NDArray[np.bool_], expected: str, path: str, line: NDArray[np.int64]
) -> None:
    if not right.all():
        row = int(right.argmin())
        raise InputError(f"{path}:{line[row]}", what, found=f"{value[row]:g}", expected=expected)

"""Reader of LinuxCNC's probe logs, in the forms that the controller writes.

``(LOG,%d#<_n> %.7f#5061 %.7f#5062 %.7f#5063 %d#5070)`` after every G38.2 gives five columns: number, x, y, z, success.
G-code has no clock; a program that reads one from HAL (``M66 E0 L0``, then ``#5399`` in the LOG) adds its seconds as a
sixth.
``(PROBEOPEN file)`` gives nine: x, y, z, a, b, c, u, v, w. That form has no number and no success flag, and leaves out
a point identical to the one before. Positions are #5061.., where the probe changed state, in work coordinates.
"""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.numerals import number
from stepgauge.files.units import LENGTH_MM
from stepgauge.importing.log import ProbeLog, check_other_axes, numbered
from stepgauge.recording import comment_lines

Array = NDArray[np.float64]
_COLUMNS = {5: "n x y z success", 6: "n x y z success seconds", 9: "x y z a b c u v w"}
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?", re.ASCII)
MOST_POINTS = 1e9


def recognises(text: str) -> bool:
    """Whether the first row is of five, six or nine numbers."""
    rows = _rows(text)
    return bool(rows) and len(rows[0][1]) in _COLUMNS and all(_NUMBER.fullmatch(cell) for cell in rows[0][1])


def read(text: str, path: str) -> ProbeLog:
    """The rows of a log; :class:`stepgauge.errors.InputError` names the line that is cut short or not numbers."""
    rows = _rows(text)
    width = len(rows[0][1])
    values = np.array([_values(cells, width, f"{path}:{line}") for line, cells in rows])
    line = np.array([place for place, _ in rows])
    comments = comment_lines(text.splitlines())
    units = _units(text, comments.get("unit", ""))
    dropped = len(text.splitlines()) - len(rows)
    if width == 9:
        form = "LinuxCNC PROBEOPEN"
        check_other_axes(values[:, 3:], path, line)
        return ProbeLog(
            path, form, values[:, :3], line, skips_repeats=True, dropped=dropped, comments=comments, units=units
        )
    _check_flags(values, path, line)
    time_s = values[:, 5] if width == 6 else None
    if time_s is not None:
        _check_clock(time_s, path, line)
    return ProbeLog(
        path,
        "LinuxCNC LOG",
        values[:, 1:4],
        line,
        values[:, 0].astype(np.int64),
        values[:, 4] == 1.0,
        time_s=time_s,
        dropped=dropped,
        comments=comments,
        units=units,
    )


def _units(text: str, stated: str) -> tuple[str, ...]:
    """Parameters #5061.. are in the unit of the program, which a comment may state: ``# unit: inch``, ``# G20``."""
    code = re.search(r"(?m)^\s*#.*\b(G20|G21)\b", text)
    name = stated or ({"G20": "inch", "G21": "mm"}[code[1]] if code else "")
    return (name,) if name in LENGTH_MM else ()


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Line and cells of everything but blank lines and ``#`` comments."""
    return [(place, line.split()) for place, line in numbered(text) if not line.startswith("#")]


def _values(cells: list[str], width: int, where: str) -> list[float]:
    if len(cells) != width:
        raise InputError(
            where,
            "the row is cut short" if len(cells) < width else "the row is too long",
            found=f"{len(cells)} columns: {' '.join(cells)[:60]!r}",
            expected=f"{width}: {_COLUMNS[width]}",
        )
    values = [number(cell) if _NUMBER.fullmatch(cell) else math.nan for cell in cells]
    if not all(map(math.isfinite, values)):
        wrong = next(cell for cell, value in zip(cells, values, strict=True) if not math.isfinite(value))
        raise InputError(where, "not a number", found=repr(wrong), expected=_COLUMNS[width])
    return values


def _check_flags(values: Array, path: str, line: NDArray[np.int64]) -> None:
    point, success = values[:, 0], values[:, 4]
    for what, value, wrong, expected in (
        (
            "the point's number",
            point,
            (point < 1) | (point > MOST_POINTS) | (point != np.floor(point)),
            "a whole number from 1",
        ),
        ("the success flag", success, (success != 0) & (success != 1), "1 (contact) or 0 (none), from #5070"),
    ):
        if wrong.any():
            row = int(wrong.argmax())
            raise InputError(f"{path}:{line[row]}", f"{what} is wrong", found=f"{value[row]:g}", expected=expected)


def _check_clock(time_s: Array, path: str, line: NDArray[np.int64]) -> None:
    """A clock goes on from point to point; one that stands was not connected in HAL."""
    stands = np.diff(time_s) <= 0.0
    if stands.any():
        row = int(stands.argmax()) + 1
        raise InputError(
            f"{path}:{line[row]}",
            "the clock does not go on",
            found=f"{time_s[row]:g} s after {time_s[row - 1]:g} s",
            expected="seconds that rise from row to row, from a clock on motion.analog-in-00",
        )

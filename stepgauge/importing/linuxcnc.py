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

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.files.units import LENGTH_MM
from stepgauge.importing.log_lines import LogLines
from stepgauge.recording import comment_lines

_COLUMNS = {5: "n x y z success", 6: "n x y z success seconds", 9: "x y z a b c u v w"}
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?", re.ASCII)
_UNIT = re.compile(r"(?m)^[ \t]*#.*\b(G20|G21)\b")
MOST_POINTS = 1e9


def recognises(text: str) -> bool:
    """Whether the first row is of five, six or nine numbers."""
    first = next((line.split() for line in LogLines(text, "") if not line.startswith("#")), [])
    return len(first) in _COLUMNS and all(map(_NUMBER.fullmatch, first))


def read(text: str, path: str) -> ProbeLog:
    """The rows of a log; :class:`stepgauge.errors.InputError` names the line that is cut short or not numbers."""
    lines, width = LogLines(text, path), 0
    for line in lines:
        if not line.startswith("#"):
            cells = line.split()
            width = width or len(cells)
            lines.add(_values(lines, cells, width))
    values, every = np.array(lines.points), text.splitlines()
    comments = comment_lines(every)
    code = _UNIT.search(text)
    unit = comments.get("unit", "") or ({"G20": "inch", "G21": "mm"}[code[1]] if code else "")
    known = {
        "comments": comments,
        "dropped": len(every) - len(values),
        "units": (unit,) if unit in LENGTH_MM else (),
    }
    if width == 9:
        lines.check_other_axes(values[:, 3:])
        return lines.log("LinuxCNC PROBEOPEN", values[:, :3], skips_repeats=True, **known)
    point, success = values[:, 0], values[:, 4]
    time_s: Array = values[:, 5] if width == 6 else np.arange(float(len(values)))
    whole = (point >= 1) & (point <= MOST_POINTS) & (point == np.floor(point))
    clock = "a clock on motion.analog-in-00, connected in HAL"
    for what, value, right, expected in (
        ("the point's number is wrong", point, whole, "a whole number from 1"),
        ("the success flag is wrong", success, np.isin(success, (0.0, 1.0)), "1 (contact) or 0 (none), from #5070"),
        ("the clock does not go on", time_s, np.r_[True, np.diff(time_s) > 0.0], clock),
    ):
        if not right.all():
            row = int(right.argmin())
            lines.fail(what, f"{value[row]:g}", expected, lines.at[row])
    return lines.log(
        "LinuxCNC LOG",
        values[:, 1:4],
        number=point.astype(np.int64),
        success=success == 1.0,
        time_s=time_s if width == 6 else None,
        **known,
    )


def _values(lines: LogLines, cells: list[str], width: int) -> list[float]:
    if len(cells) != width:
        what = "the row is cut short" if len(cells) < width else "the row is too long"
        lines.fail(what, f"{len(cells)} columns: {' '.join(cells)[:60]!r}", f"{width}: {_COLUMNS[width]}")
    wrong = next((cell for cell in cells if not (_NUMBER.fullmatch(cell) and np.isfinite(number(cell)))), None)
    if wrong is not None:
        lines.fail("not a number", repr(wrong), _COLUMNS[width])
    return [number(cell) for cell in cells]

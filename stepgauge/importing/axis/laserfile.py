"""Files of laser software in sections (``TARGETS``, ``DEVIATIONS``): targets in a list, readings by run and target."""

from __future__ import annotations

import re
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.numerals import number
from stepgauge.files.units import find_unit
from stepgauge.importing.axis.grid import Grid
from stepgauge.importing.cells import Cell, decode

_BEGINS = re.compile(r"^\s*Run Target Data\s*:", re.MULTILINE | re.IGNORECASE)
_TARGETS = re.compile(r"^\s*Targets\s*:+", re.MULTILINE | re.IGNORECASE)
_LINEAR = re.compile(r"^\s*File\s*Type\s*:\s*Linear", re.MULTILINE | re.IGNORECASE)
HEADERS = ["target", "deviation"]


def is_laser_file(text: str) -> bool:
    """Whether a text has both sections."""
    return bool(_BEGINS.search(text) and _TARGETS.search(text))


def read_laser_file(path: str | Path) -> Grid:
    """Target and deviation of every reading; of a linear axis in mm and um, as that software writes them.

    :class:`InputError` for rows that are not three numbers, and targets that are not in the list.
    """
    text = decode(path)[0]
    targets_at, data_at = _TARGETS.search(text), _BEGINS.search(text)
    assert targets_at is not None
    assert data_at is not None
    targets = _leading_numbers(text[targets_at.end() :])
    first = text.count("\n", 0, data_at.end())
    rows: list[list[Cell]] = []
    lines: list[int] = []
    for line, row in enumerate(text.splitlines()[first + 1 :], first + 2):
        if not row.strip():
            continue
        values = [number(cell) for cell in row.split()]
        if len(values) != 3 or not all(value == value for value in values):
            break
        if not 1 <= values[1] <= len(targets):
            expected = f"1 to {len(targets)}"
            raise InputError(f"{path}:{line}", "no such target in the list", found=f"{values[1]:g}", expected=expected)
        rows.append([targets[int(values[1]) - 1], values[2]])  # runs are counted anew, there and back being one cycle
        lines.append(line)
    if not rows:
        raise InputError(f"{path}:{first + 1}", "no readings follow", expected="rows of run, target and deviation")
    linear = bool(_LINEAR.search(text))
    units = [find_unit(name) if linear else None for name in ("mm", "um")]
    return Grid(str(path), HEADERS, units, rows, lines, [""] * len(rows), ".")


def _leading_numbers(text: str) -> list[float]:
    """Numbers at the beginning of a text, over as many lines as they take."""
    found: list[float] = []
    for word in text.split():
        value = number(word)
        if value != value:
            break
        found.append(value)
    return found

"""Lines in which numbers stand beside their names, as consoles and measuring logs have them -> rows of cells.

``Bed X: 110.00 Y: 110.00 Z: 1.234``, ``// probe at 150.0,150.0 is z=2.457``, ``Stopped at height 2.5 mm``: lines that
are alike but for their numbers are rows, and the word before a number names its column. Lines ``ACTUAL VALUE : 10.002``
whose names come again in the same order are the cells of one row.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass

from stepgauge.errors import InputError
from stepgauge.importing.tables.cells import Cell, Cells
from stepgauge.importing.tables.clock import stamp_in
from stepgauge.importing.tables.source import Source

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NAMED = re.compile(rf"(?<!\w)[A-Za-z][\w ]{{0,60}}?\s*[:=]\s*{_NUMBER}(?=\s|,|;|$|[a-zµ%°\])])")
_ALONE = re.compile(rf"(\s*[A-Za-z][A-Za-z ]+?) {_NUMBER}( (?:mm|um|in))?\s*")
_ONE = re.compile(rf"\s*([A-Za-z][\w .()/]*?)\s*[:=]\s*({_NUMBER})\s*(?:mm|um|in)?\s*")
_ANY = re.compile(rf"(?<![\w.+-])({_NUMBER})(?![\w.])|(?<=[:=])({_NUMBER})(?![\w.])")
_POSITION = re.compile(r"\bCount [XA]:")
"""A report of where a machine stands, which is no reading."""
FEWEST = 3
"""Lines alike from which they are rows."""
LOOKED_AT = 50_000
"""Characters among which they are looked for first."""


@dataclass(frozen=True)
class _Lines:
    """Lines that are alike: the names of their numbers; number, values and time of each row; ``used``: their lines."""

    names: tuple[str, ...]
    rows: list[tuple[int, list[str], str | None]]
    used: frozenset[int] = frozenset()


def console_cells(source: Source) -> Cells | None:
    """The rows of such lines; None for a text that has none, or more of other numbers."""
    text, encoding = source.decoded
    first = text[:LOOKED_AT].split("\n")
    numbers = sum(bool(_ANY.search(_bare(line))) and not _POSITION.search(line) for line in first)
    for find in (_blocks, _alike):
        found = find(first, source.name)
        count = len(found.rows) * (len(found.names) if find is _blocks else 1)
        differ = len({tuple(values) for _, values, _ in found.rows}) > 1  # else settings, beside other numbers
        if len(found.rows) >= FEWEST and 2 * count >= numbers and (differ or count == numbers):
            lines = text.splitlines()
            return _make_cells(source.name, find(lines, source.name), encoding, lines)
    return None


def _make_cells(path: str, found: _Lines, encoding: str, text: list[str]) -> Cells:
    timed = all(stamp for _, _, stamp in found.rows)
    rows: list[list[Cell]] = [[*found.names, *["time"] * timed]]
    rows += [[*values, *([stamp] if timed and stamp else [])] for _, values, stamp in found.rows]
    lines = [found.rows[0][0], *(line for line, _, _ in found.rows)]
    notes = [f"{encoding}, lines of a console with {', '.join(found.names)}"]
    left = [n for n, line in enumerate(text, 1) if line.strip() and n not in found.used]
    if left:
        first = text[left[0] - 1].strip()[:60]
        notes.append(f"dropped: {len(left)} lines without such numbers, the first in line {left[0]}: {first!r}")
    return Cells(path, rows, lines, [], len(text) - len(found.used) - len(left), tuple(notes))


def _blocks(lines: list[str], path: str) -> _Lines:
    """Rows of names that stand below one another, and come again in the same order."""
    found = [(n, match) for n, line in enumerate(lines, 1) if (match := _ONE.fullmatch(line))]
    count = Counter(match[1] for _, match in found)
    found = [(n, match) for n, match in found if 2 * count[match[1]] >= max(count.values())]
    names = [match[1] for _, match in found]
    width = len(set(names))
    if width < 2 or len(names) < FEWEST * width:
        return _Lines((), [])
    whole = names[:width] * (len(names) // width + 1)
    wrong = next((n for n, (one, other) in enumerate(zip(names, whole, strict=False)) if one != other), None)
    if wrong is not None or len(names) % width:
        line = found[-1 if wrong is None else wrong][0]
        raise InputError(f"{path}:{line}", "a block of the log is not whole", expected=", ".join(names[:width]))
    starts = range(0, len(found), width)
    return _Lines(
        tuple(names[:width]),
        [(found[n][0], [match[2] for _, match in found[n : n + width]], None) for n in starts],
        frozenset(n for n, _ in found),
    )


def _alike(lines: list[str], path: str) -> _Lines:
    """The most frequent lines that are alike but for their numbers."""
    shapes: dict[tuple[str, tuple[str, ...]], list[tuple[int, list[str], str | None]]] = defaultdict(list)
    for number, line in enumerate(lines, 1):
        bare, stamp = _bare(line), stamp_in(line)
        if not (_NAMED.search(bare) or _ALONE.fullmatch(bare)) or _POSITION.search(bare):
            continue
        names, values = list[str](), list[str]()
        for match in _ANY.finditer(bare):
            before = re.findall(r"[A-Za-z]\w*", bare[: match.start()])
            names.append(before[-1] if before else "")
            values.append(match[0])
        shapes[_ANY.sub("#", bare).strip(), tuple(_numbered(names))].append((number, values, stamp))
    counted = [shape for shape, rows in shapes.items() if _is_count([values for _, values, _ in rows])]
    ordered = sorted(((s, rows) for s, rows in shapes.items() if s not in counted), key=lambda one: -len(one[1]))
    if not ordered or (len(ordered) > 1 and 2 * len(ordered[1][1]) > len(ordered[0][1])):  # rivals: which one is it?
        return _Lines((), [])
    rows = ordered[0][1]
    return _Lines(_places(ordered[0][0][1]), rows, frozenset(n for n, _, _ in rows))


def _is_count(values: list[list[str]]) -> bool:
    """Whether lines only number what follows each: ``MEASURING POINT 1``, ``MEASURING POINT 2``."""
    steps = [float(one[0]) - n for n, one in enumerate(values) if len(one) == 1]
    return len(steps) == len(values) > 1 and len(set(steps)) == 1


def _bare(line: str) -> str:
    """A line without its time."""
    stamp = stamp_in(line)
    return line if stamp is None else line.replace(stamp, " ")


def _numbered(names: list[str]) -> list[str]:
    """Names of which those that come again carry a number."""
    return [f"{name} {names[:n].count(name) + 1}" if name in names[:n] else name for n, name in enumerate(names)]


def _places(names: tuple[str, ...]) -> tuple[str, ...]:
    """The two numbers behind ``at`` are coordinates."""
    return tuple({"at": "x", "at 2": "y"}.get(name, name) if "at 2" in names else name for name in names)

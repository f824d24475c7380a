"""Lines in which numbers stand beside their names, as consoles of machines print them -> rows of cells.

``Bed X: 110.00 Y: 110.00 Z: 1.234``, ``// probe at 150.0,150.0 is z=2.457``: lines that are alike but for their numbers
are rows, and the word before a number names its column.
"""

from __future__ import annotations

import re
from collections import defaultdict
from itertools import islice

from stepgauge.importing.tables.cells import Cell, Cells
from stepgauge.importing.tables.clock import stamp_in
from stepgauge.importing.tables.source import Source

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NAMED = re.compile(rf"([A-Za-z][A-Za-z_]*)\s*[:=]\s*({_NUMBER})(?=\s|,|;|$|[a-zµ%°\])])")
_ANY = re.compile(rf"(?<![\w.])({_NUMBER})(?![\w.])")
FEWEST = 3
"""Lines alike from which they are rows."""
LOOKED_AT = 5_000
"""Lines among which they are looked for first."""


def console_cells(source: Source) -> Cells | None:
    """The rows of such lines; None for a text that has none, or more of other numbers."""
    text, encoding = source.decoded
    first = list(islice(text.split("\n"), LOOKED_AT))
    alike = _alike(first)
    if len(alike[1]) < FEWEST or 2 * len(alike[1]) < sum(bool(_ANY.search(_bare(line))) for line in first):
        return None
    shape, rows = _alike(text.splitlines())
    found: list[list[Cell]] = [[*shape, "time"] if all(stamp for _, _, stamp in rows) else [*shape]]
    for _, values, stamp in rows:
        found.append([*values, *([stamp] if "time" in found[0] and stamp else [])])
    lines = [rows[0][0], *(line for line, _, _ in rows)]
    note = f"{encoding}, lines of a console like {', '.join(shape)}"
    return Cells(source.name, found, lines, [], text.count("\n") + 1 - len(rows), (note,))


def _alike(lines: list[str]) -> tuple[tuple[str, ...], list[tuple[int, list[str], str | None]]]:
    """The names in the most frequent lines, and number, values and time of each of these."""
    shapes: dict[tuple[str, ...], list[tuple[int, list[str], str | None]]] = defaultdict(list)
    for number, line in enumerate(lines, 1):
        bare, stamp = _bare(line), stamp_in(line)
        if not _NAMED.search(bare):
            continue
        names, values = list[str](), list[str]()
        for match in _ANY.finditer(bare):
            before = re.findall(r"[A-Za-z]\w*", bare[: match.start()])
            names.append(before[-1] if before else "")
            values.append(match[1])
        shapes[tuple(_numbered(names))].append((number, values, stamp))
    return max(shapes.items(), key=lambda one: len(one[1]), default=((), []))


def _bare(line: str) -> str:
    """A line without its time."""
    stamp = stamp_in(line)
    return line if stamp is None else line.replace(stamp, " ")


def _numbered(names: list[str]) -> list[str]:
    """Names of which those that come again carry a number."""
    return [f"{name} {names[:n].count(name) + 1}" if name in names[:n] else name for n, name in enumerate(names)]

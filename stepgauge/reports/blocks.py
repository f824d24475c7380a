"""Blocks of a written page, in plain containers, which ``story.md.j2``, ``story.html.j2`` and ``story.typ`` print.

A page is a title, a verdict and parts; a part is a title and blocks. All text is data, and never markup.
"""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.figures.style import STYLE
from stepgauge.files.notation import clean
from stepgauge.files.text import read_bytes, read_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Block = dict[str, Any]
PAGE_PT = 174.0 / 25.4 * 72.0
"""Width of the text on paper."""


def words(text: str, strong: bool = False) -> Block:
    """A paragraph."""
    return {"kind": "words", "text": clean(text), "strong": strong}


def heading(text: str) -> Block:
    """A heading inside a part."""
    return {"kind": "heading", "text": clean(text)}


def bullets(items: Sequence[str], title: str = "", ordered: bool = False) -> Block:
    """A list, with a title that belongs to it."""
    return {"kind": "bullets", "title": title, "items": [clean(item) for item in items], "ordered": ordered}


def code(*lines: str, language: str = "") -> Block:
    """Lines to copy, as they are."""
    return {"kind": "code", "lines": [clean(line) for line in lines], "language": language}


def table(
    columns: Sequence[str],
    rows: Sequence[Sequence[object]],
    shares: Sequence[float] = (),
    inner: Sequence[int] = (),
    note: str = "",
) -> Block:
    """A table of words: ``shares`` of the width (0: as wide as its words), ``inner`` rows belong to the one above."""
    return {
        "kind": "table",
        "columns": list(columns),
        "rows": [[clean(cell) for cell in row] for row in rows],
        "shares": list(shares) or [0.0] * (len(columns) - 1) + [1.0],
        "inner": list(inner),
        "note": note,
    }


def figure(name: str, caption: str, drawn: Figure | str = "") -> Block:
    """A picture by the name of its file: a figure, which is put into the language of its page, or SVG.

    ``share`` of the width of the page: its own width, at most the whole.
    """
    if isinstance(drawn, str):
        found = re.search(r'\bwidth="([\d.]+)pt"', drawn[:1000])
        width = float(found[1]) if found else PAGE_PT
    else:
        width = 72.0 * drawn.get_figwidth()
    share = min(width / PAGE_PT, 1.0)
    return {"kind": "figure", "name": name, "svg": drawn, "caption": clean(caption), "share": share}


def part(title: str, *blocks: Block | None) -> dict[str, Any]:
    """A part of a page; blocks that are None are left out."""
    return {"title": title, "blocks": [one for one in blocks if one is not None]}


def pictures(folder: str | Path, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Names and contents (SVG) of the pictures of a folder that are there and can stand in a page."""
    for name in names:
        path = Path(folder) / name
        if path.is_file() and path.suffix == ".svg":
            yield name, read_text(path)
        elif path.is_file() and path.suffix == ".png":
            yield name, _svg_of_png(read_bytes(path))


def _svg_of_png(data: bytes) -> str:
    """A PNG of our resolution as the only element of an SVG, so that a page has one kind of picture."""
    width, height = struct.unpack(">II", data[16:24])
    address = "data:image/png;base64," + base64.b64encode(data).decode("ascii")
    points = [one * 72.0 / STYLE["savefig.dpi"] for one in (width, height)]
    size = f'width="{points[0]:.1f}pt" height="{points[1]:.1f}pt"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" {size}>'
    return f'{head}<image width="{width}" height="{height}" href="{address}"/></svg>'

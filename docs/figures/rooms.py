"""The rooms of the package and the arrows between them, drawn from the imports: ``python docs/figures/rooms.py``.

An arrow from a room to another: a module of the first imports one of the second when it is loaded. An arrow that
follows from others is left out.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "stepgauge"
GROUPS = {
    "doors": ("cli", "web", "verbs", "demonstration", "project"),
    "documents": ("reports", "dcc", "figures", "exporting"),
    "results": (
        *("fleet", "history", "investigation", "diagnosis", "standards"),
        *("montecarlo", "compensation", "evaluation"),
    ),
    "readings": (
        *("live", "importing", "correspondence", "programs", "planning"),
        *("alignment", "conditions", "recording", "axis", "gauge"),
    ),
    "physics": ("machine", "probes", "effects", "motion", "physics"),
    "tools": ("inference", "executors", "ippdme", "files"),
}
"""Rooms by what they hold, from the doors down."""


def imports() -> dict[str, set[str]]:
    """Each room with those that it imports."""
    found: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [one.name for one in node.names] if isinstance(node, ast.Import) else []
            for name in names:
                parts = name.split(".")
                if parts[0] == "stepgauge" and len(parts) > 1 and parts[1] != room:
                    found.setdefault(room, set()).add(parts[1])
    return found


def direct(graph: dict[str, set[str]]) -> list[tuple[str, str]]:
    """The arrows that do not follow from others."""

    def reached(room: str, seen: set[str]) -> set[str]:
        for other in graph.get(room, set()) - seen:
            seen.add(other)
            reached(other, seen)
        return seen

    known = {room for rooms in GROUPS.values() for room in rooms}
    arrows = []
    for room in sorted(known & set(graph)):
        others = graph[room] & known
        for other in sorted(others):
            if not any(other in reached(between, set()) for between in others - {other}):
                arrows.append((room, other))
    return arrows


def rooms_figure() -> Figure:
    """The rooms in rows by their groups, with the arrows between them."""
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    axes = figure.subplots()
    place = {}
    for row, (group, rooms) in enumerate(GROUPS.items()):
        axes.text(-0.4, -row, group, ha="right", va="center", fontweight="bold")
        for column, room in enumerate(rooms):
            place[room] = ((column + 0.5) * 9.0 / len(rooms), -float(row))
    for one, other in direct(imports()):
        style = {"arrowstyle": "->", "color": "0.6", "lw": 0.8, "shrinkA": 10, "shrinkB": 10}
        axes.annotate("", place[other], place[one], arrowprops={**style, "connectionstyle": "arc3,rad=0.08"})
    for room, (x, y) in place.items():
        axes.text(x, y, room, ha="center", va="center", bbox={"boxstyle": "round", "fc": "white", "ec": "0.3"})
    axes.set(xlim=(-1.6, 9.2), ylim=(-len(GROUPS) + 0.4, 0.6))
    axes.axis("off")
    return figure


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "docs" / "images" / "rooms.svg")
    rooms_figure().savefig(target, metadata={"Date": None})
    print(target)

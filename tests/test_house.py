"""The package's rooms: no module lies loose beside them, and imports between them point one way."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import stepgauge

PACKAGE = Path(stepgauge.__file__).parent
BESIDE = {"__init__", "__main__", "errors"}
"""The public surface, the command, and what every room raises."""
MODULES = {path: path.relative_to(PACKAGE).with_suffix("").parts for path in sorted(PACKAGE.rglob("*.py"))}

NAMES = {parts[:-1] if parts[-1] == "__init__" else parts for parts in MODULES.values()}


def imported(path: Path) -> set[tuple[str, ...]]:
    """Modules of the package, as parts below it, that a file names in imports that run when it is loaded."""
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("stepgauge."):
            place = tuple(str(node.module).split(".")[1:])
            modules = {(*place, one.name) for one in node.names} & NAMES
            found |= modules if len(modules) == len(node.names) else {place, *modules}
        if isinstance(node, ast.Import):
            found |= {tuple(one.name.split(".")[1:]) for one in node.names if one.name.startswith("stepgauge.")}
    return found


def rooms() -> dict[str, set[str]]:
    """Each room with those that it imports from."""
    graph: dict[str, set[str]] = {}
    for path, parts in MODULES.items():
        graph.setdefault(parts[0], set()).update(one[0] for one in imported(path) if one[0] != parts[0])
    return graph


def test_no_module_lies_loose_beside_the_rooms() -> None:
    assert {path.stem for path in PACKAGE.glob("*.py")} == BESIDE


def test_the_arrows_between_rooms_point_one_way() -> None:
    graph = rooms()
    assert len(graph) > 15
    try:
        order = list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"rooms import each other in a circle: {' <- '.join(error.args[1])}")
    assert order.index("files") < order.index("gauge") < order.index("evaluation") < order.index("diagnosis")
    assert not [room for room, others in graph.items() if "cli" in others and room != "__main__"]


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = {
        parts[:-1] if parts[-1] == "__init__" else parts: imported(path) & NAMES for path, parts in MODULES.items()
    }
    assert len(list(TopologicalSorter(graph).static_order())) == len(NAMES)


def test_physics_imports_nothing_of_ours_but_errors() -> None:
    assert rooms()["physics"] <= {"errors", "files"}
    assert not {"evaluation", "diagnosis", "reports"} & rooms()["effects"]

"""The package's rooms: no module lies loose beside them, and imports between them point one way."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import stepgauge

PACKAGE = Path(stepgauge.__file__).parent
BESIDE = {"__init__", "__main__", "errors"}
"""The public surface, the command, and what every room raises."""
MODULES = {path: path.relative_to(PACKAGE).with_suffix("").parts for path in sorted(PACKAGE.rglob("*.py"))}

TREES = {path: ast.parse(path.read_text(encoding="utf-8")) for path in MODULES}
NAMES = {parts[:-1] if parts[-1] == "__init__" else parts for parts in MODULES.values()}


def imported(path: Path, inner: bool = False) -> set[tuple[str, ...]]:
    """Modules of the package, as parts below it, that a file names in imports that run when it is loaded; ``inner``:
    also in those that run when a function is called."""
    found = set()
    for node in _run(TREES[path]) if inner else TREES[path].body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("stepgauge."):
            place = tuple(str(node.module).split(".")[1:])
            modules = {(*place, one.name) for one in node.names} & NAMES
            found |= modules if len(modules) == len(node.names) else {place, *modules}
        if isinstance(node, ast.Import):
            found |= {tuple(one.name.split(".")[1:]) for one in node.names if one.name.startswith("stepgauge.")}
    return found


def _run(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those that only a type checker looks at."""
    for child in ast.iter_child_nodes(node):
        if not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
            yield child
            yield from _run(child)


def rooms(inner: bool = False) -> dict[str, set[str]]:
    """Each room with those that it imports from."""
    graph: dict[str, set[str]] = {}
    for path, parts in MODULES.items():
        graph.setdefault(parts[0], set()).update(one[0] for one in imported(path, inner) if one[0] != parts[0])
    return graph


UPWARD = {
    ("files", "importing"): "a table of any make goes in where one of ours does",
    ("recording", "importing"): "so does a recording",
    ("planning", "importing"): "the log of a program is read back before the program is written",
    ("diagnosis", "figures"): "a result draws itself",
    ("diagnosis", "reports"): "a result writes its report",
    ("fleet", "reports"): "a result writes its report",
    ("errors", "verbs"): "a message names arguments as the verbs declare them",
    ("verbs", "web"): "the verb 'web' opens that door",
}
"""Arrows of imports inside functions that lead back up, and why; there may be no further one."""


def test_imports_inside_functions_point_the_same_way_but_for_a_closed_list() -> None:
    whole = rooms(True)
    graph = {room: others - {above for low, above in UPWARD if low == room} for room, others in whole.items()}
    try:
        list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"rooms import each other inside functions: {' <- '.join(error.args[1])}")
    assert [(low, above) for low, above in UPWARD if above not in whole[low]] == []


CLASSES = [
    (node.name, path.relative_to(PACKAGE))
    for path in MODULES
    for node in ast.walk(TREES[path])
    if isinstance(node, ast.ClassDef)
]
DIALECT = {
    *(
        "Said",
        "Told",
        "Untold",
        "Shown",
        "Kept",
        "Asked",
        "Wanted",
        "Learnt",
        "Made",
        "Found",
        "Place",
        "Ways",
        "Works",
    ),
    *("Wandering", "Wishes", "Teller", "Facets", "Look", "Looks", "Looker", "Sizes", "Scatters", "LeftOut", "Knob"),
    *("Courses", "Lengthened", "ExtraRun", "Spy", "Jet", "Person", "Ladder", "Even", "Day", "Push", "Leg"),
}
OPAQUE = {
    "told",
    "untold",
    "looks",
    "facets",
    "practice",
    "matters",
    "reach",
    "asked",
    "of",
    "crossed",
    "engines",
    "ways",
}
"""Names of classes and modules that nobody of the field would look up."""


def test_no_class_has_the_name_of_another() -> None:
    names = Counter(name for name, _ in CLASSES if not name.startswith("_"))
    assert {name for name, count in names.items() if count > 1} == set()


def test_classes_and_modules_have_names_of_the_field() -> None:
    assert sorted(name for name, _ in CLASSES if name in DIALECT) == []
    assert sorted(parts[-1] for parts in NAMES if parts and parts[-1] in OPAQUE) == []


def test_a_function_is_named_by_what_it_does_or_what_comes_back() -> None:
    """Not by how it reads behind the word before it (``of_face``, ``with_options``): nobody looks that up."""
    begins = tuple(f"{word}_" for word in ("of", "in", "with", "by", "as", "from", "beside"))
    functions = [
        f"{path.relative_to(PACKAGE)}: {node.name}"
        for path in MODULES
        for node in ast.walk(TREES[path])
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.lstrip("_").startswith(begins)
    ]
    assert len(functions) == 0, functions


def test_no_module_has_more_than_400_lines() -> None:
    lines = {path.relative_to(PACKAGE): path.read_text(encoding="utf-8").count("\n") for path in MODULES}
    assert {str(path): count for path, count in lines.items() if count > 400} == {}


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

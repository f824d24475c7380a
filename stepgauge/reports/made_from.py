"""The files of an evaluation, found from its ``evaluation.json``: those that it was made from, and its budget."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import read_gauge
from stepgauge.project.find import NAME
from stepgauge.reports.reading import check_gauge, find_evaluation
from stepgauge.standards.budget_files import StoredBudget, check_budget, read_budget

BUDGET = "budget.json"
MOST_BUDGETS = 50


def recordings_of(evaluation: dict[str, Any], path: str | Path) -> list[Path]:
    """The recordings of an evaluation: by their way from its folder, else as they were typed.

    :class:`InputError` where one is not there. That they have not changed since was checked when it was read.
    """
    near = {one.name: one for one in _near(evaluation, path)}
    found = []
    for typed in str(evaluation["recording"]).split(", "):
        place = near.get(Path(typed).name, Path(typed))
        if not typed or not place.is_file():
            what = "a recording of this evaluation is not there"
            raise InputError(
                path, what, found=typed or "not in a file", expected=naming("recordings", words="it, given with {}")
            )
        found.append(place)
    return found


def gauge_of(evaluation: dict[str, Any], path: str | Path) -> Path | str:
    """The gauge file of an evaluation, or its shipped name; :class:`InputError` where it is not there."""
    names = [str(one["name"]) for one in evaluation.get("inputs", []) if "name" in one]
    candidates: list[Path | str] = [*_near(evaluation, path), *names]
    for one in candidates:
        if str(one).endswith(".toml"):
            try:
                check_gauge(evaluation, read_gauge(one))
            except InputError:
                continue
            return one
    raise InputError(
        path, "the gauge of this evaluation is not there", expected=naming("gauge", words="it, given with {}")
    )


def budget_of(evaluation: dict[str, Any], path: str | Path) -> Path | None:
    """The budget of an evaluation: beside it, and in a project also in the folders of the other results.

    It is one of this evaluation (:func:`~stepgauge.standards.budget_files.check_budget`); of several the one that lacks
    least, and of these the newest. None where there is none; one beside it that is of another evaluation is returned
    too, for whoever reads it refuses it by its reason.
    """
    folder = find_evaluation(path).absolute().parent
    beside = folder / BUDGET
    found = [(one, own) for one in _budgets(folder) if (own := _budget_for(evaluation, one)) is not None]
    best = min(found, key=lambda one: (len(one[1].not_included), -one[0].stat().st_mtime), default=None)
    return best[0] if best is not None else beside if beside.is_file() else None


def _budgets(folder: Path) -> list[Path]:
    """Where budgets of the evaluation in ``folder`` may be."""
    there = [folder / BUDGET]
    if any((one / NAME).is_file() for one in folder.parents):
        there += sorted(one for one in folder.parent.glob(f"*/{BUDGET}") if one != there[0])[:MOST_BUDGETS]
    return [one for one in there if one.is_file()]


def _budget_for(evaluation: dict[str, Any], path: Path) -> StoredBudget | None:
    try:
        found = read_budget(path)
        check_budget(found, evaluation, path)
    except InputError:
        return None
    return found


def _near(evaluation: dict[str, Any], path: str | Path) -> Iterator[Path]:
    """Files that it was made from, which lie where they lay."""
    folder = find_evaluation(path).parent
    for one in evaluation.get("inputs", []):
        if "file" in one and (folder / str(one["file"])).is_file():
            yield folder / str(one["file"])

"""Uncertainty budgets of a store's recordings: those of each recording alone, worked out on any engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from stepgauge.executors.task import Engine
from stepgauge.fleet.batches import Batch, StoredBatch, opened
from stepgauge.fleet.results import Results
from stepgauge.fleet.schema import BUDGETS
from stepgauge.fleet.store import Fleet
from stepgauge.fleet.working import Progress, work_one_by_one
from stepgauge.standards.budget_files import COLUMNS, StoredBudget, StoredLine
from stepgauge.standards.budgeting import BudgetChoices, whole_budget

MONTE_CARLO = ("u_um", "low_95_um", "high_95_um")


def budget_fleet(
    fleet: Fleet, engine: Engine, choice: BudgetChoices | None = None, progress: Progress | None = None
) -> list[str]:
    """Make the budgets, each with its Monte Carlo, of the recordings that have none with this choice.

    The numbers are those of :func:`stepgauge.standards.budgeting.whole_budget` of each recording alone, with the same
    seed for all. Every budget is on the disk as it is made, so that a stop costs none of them.

    Parameters
    ----------
    fleet, engine : the store, and who does the work
    choice : what is chosen beside the files that were added
    progress : told how many of how many recordings are done

    Returns
    -------
    Why some have no budget, a line each.
    """
    choice = choice or BudgetChoices()
    function = partial(budget_batch, choice=choice)
    made_with = asdict(choice) | {"contributions": [one.model_dump() for one in choice.contributions]}
    return work_one_by_one(Results(fleet, "budgets", made_with), engine, function, _rows, BUDGETS, progress)


def budget_batch(given: Batch | StoredBatch, choice: BudgetChoices) -> list[dict[str, Any]]:
    """The rows of the budget of a batch of one recording, but for its key, in JSON types."""
    batch = opened(given)
    (one,) = batch.stored
    found = whole_budget([one.recording()], batch.machine(one), batch.gauge(one), batch.placements(one), choice)
    return [_row(line, found) for line in found.quantities]


def _row(line: StoredLine, found: StoredBudget) -> dict[str, Any]:
    runs = line.monte_carlo
    return {
        **{name: getattr(line, name) for name in COLUMNS},
        "coverage_percent": found.coverage_percent,
        "through_r_eff_um": line.through_r_eff_um,
        "same_terms_u_um": line.same_terms_u_um,
        **{f"monte_carlo_{name}": None if runs is None else getattr(runs, name) for name in MONTE_CARLO},
        "contributions_um": line.contributions_um,
        "not_included": [gap.what for gap in found.not_included],
    }


def _rows(key: str, value: Sequence[Mapping[str, Any]] | None, error: str) -> list[dict[str, Any]]:
    if value is None:
        return [{"recording": key, "placement": 0, "error": error, "contributions_um": [], "not_included": []}]
    return [{"recording": key, **row, "contributions_um": list(row["contributions_um"].items())} for row in value]

"""A whole budget as it is stated: the model of the files, the Monte Carlo of it, and the GUM's sums."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.contribution import Contribution
from stepgauge.machine.file import Machine
from stepgauge.montecarlo import ModelOptions, MonteCarloModel, Summary, read_model, run_monte_carlo
from stepgauge.recording import Recording
from stepgauge.standards.budget import BudgetOptions, Progress, make_budget
from stepgauge.standards.budget_files import StoredBudget, stored_budget
from stepgauge.standards.budget_given import stated_with
from stepgauge.standards.budget_sources import Repeats

COVERAGE_PERCENT = (50.0, 99.99)
Shown = Callable[[str], Progress]
"""Given ``"Monte Carlo"`` or ``"budget"``, what is told (done, total)."""


@dataclass(frozen=True)
class BudgetChoices:
    """What is chosen for a budget beside the files (:class:`InputError` for what is out of range).

    ``correlation``: of any two certified positions, 0 to 1, None: the gauge file's; ``repeats``: ``"pooled"`` over all
    faces or by ``"face"``; ``percent``: coverage probability; ``runs``, ``seed``: of the Monte Carlo, 0 runs: none;
    ``contributions``: one's own, beside those of the machine file; ``measured_at``: where no recording says it.
    """

    model: ModelOptions = field(default_factory=ModelOptions)
    correlation: float | None = None
    repeats: Repeats = "pooled"
    percent: float = 95.45
    runs: int = 10_000
    seed: int = 0
    contributions: tuple[Contribution, ...] = ()
    measured_at: str | None = None

    def __post_init__(self) -> None:
        if self.correlation is not None and not 0.0 <= self.correlation <= 1.0:
            where = naming("certificate_correlation")
            raise InputError(where, "out of range", found=self.correlation, expected="0 to 1")
        if not COVERAGE_PERCENT[0] <= self.percent <= COVERAGE_PERCENT[1]:
            raise InputError(naming("coverage_percent"), "out of range", found=self.percent, expected="50 to 99.99")
        if self.runs != 0 and self.runs < 2:
            raise InputError(naming("runs"), "too few runs", found=self.runs, expected="0 or at least 2")


def whole_budget(
    sources: Sequence[str | Path | Recording],
    machine: Machine,
    gauge: Gauge,
    placements: Sequence[Placement] = (),
    choice: BudgetChoices | None = None,
    shown: Shown | None = None,
) -> StoredBudget:
    """The budget of recordings or of a program, with the Monte Carlo beside it, lengths in um."""
    choice, shown = choice or BudgetChoices(), shown or _silent
    model = read_model(sources, machine, _correlated(gauge, choice.correlation), placements, choice.model)
    simulated = _simulated(model, choice, shown) if choice.runs else None
    asked = BudgetOptions(placements, choice.repeats, choice.percent, choice.contributions, choice.measured_at)
    made = stored_budget(model, make_budget(model, asked, simulated, shown("budget")), choice.runs)
    return made.model_copy(update={"given": stated_with(gauge, machine, placements)})


def _silent(_: str) -> Progress:
    """Nobody watches."""
    return lambda done, total: None


def _correlated(gauge: Gauge, correlation: float | None) -> Gauge:
    """The gauge with the correlation of its certified positions as asked."""
    if correlation is None:
        return gauge
    return replace(gauge, certificate=gauge.certificate.model_copy(update={"correlation": correlation}))


def _simulated(model: MonteCarloModel, choice: BudgetChoices, shown: Shown) -> Summary | None:
    if not model.inputs.names:
        return None
    return run_monte_carlo(model, choice.runs, choice.seed, progress=shown("Monte Carlo"))

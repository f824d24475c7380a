"""A Monte Carlo as a result: its lines, its table, its figure, its files."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from stepgauge import __version__
from stepgauge.files.display import Plotted, figures, join_lines
from stepgauge.files.json_types import defined
from stepgauge.files.stored import WrittenResult
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.run import Progress, run_monte_carlo
from stepgauge.montecarlo.summary import COVERAGE, Summary

if TYPE_CHECKING:
    import pandas as pd


MAIN = (
    ("r_eff_mm", "R_eff", "mm", 5),
    ("band_um", "range of the mean error XM", "um", 3),
    ("worst_two_sigma_um", "largest 2s", "um", 3),
)
LEAST_RUNS = 40
"""Of fewer runs none lies beyond either end of an interval of 95 %: it would be the smallest and the largest value."""


@dataclass(frozen=True, repr=False)
class MonteCarloBudget(WrittenResult, Plotted):
    """Distributions of the numbers of an evaluation (JCGM 101), and the model that they are of."""

    drawn_by: ClassVar[str] = "uncertainty.draw_distribution"
    model: MonteCarloModel
    distributions: Summary

    def summary(self) -> str:
        """Notes, and by placement R_eff, the range of XM and the largest 2s with their intervals."""
        notes = [f"note: {note}" for note in self.model.conditions.notes]
        return join_lines(*notes, *(line for part in self.model.parts for line in self._main(part.placement)))

    def _main(self, placement: int) -> list[str]:
        return [self._line(placement, *one) for one in MAIN]

    def _line(self, placement: int, name: str, words: str, unit: str, digits: int) -> str:
        found = self.distributions
        i = found.index(name, None, placement)
        within = f"95 % from {found.low[i]:.{digits}f} to {found.high[i]:.{digits}f} {unit}"
        if found.runs < LEAST_RUNS:
            within = f"too few runs for an interval of 95 % ({LEAST_RUNS} at least)"
        return f"placement {placement}: {words} {found.mean[i]:.{digits}f} {unit}, u {found.u[i]:.2g} {unit}, {within}"

    def to_frame(self) -> pd.DataFrame:
        """One row per quantity: value, mean, u and interval in the unit of its name, and the contributions."""
        import pandas as pd

        rows = summary_to_dict(self.model, self.distributions)["quantities"]
        table = pd.DataFrame(rows).drop(columns="contributions")
        return table.join(pd.DataFrame([row["contributions"] for row in rows]).add_prefix("u_"))

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``uncertainty.json``, ``uncertainty.csv`` and a figure per placement; returns the paths."""
        with self.keeping():
            drawn = figures("uncertainty").draw_uncertainty(folder, self.model, self.distributions, figure)
            return [*write_summary(folder, self.model, self.distributions), *drawn]


def monte_carlo_budget(
    model: MonteCarloModel, runs: int, seed: int, jobs: int | None, kept_in: Path | None, progress: Progress | None
) -> MonteCarloBudget:
    """Run it; ``jobs`` None: as many processes as there are processors."""
    found = run_monte_carlo(model, runs, seed, jobs or os.cpu_count() or 1, None, kept_in, progress)
    return MonteCarloBudget(model, found)


COLUMNS = ("quantity", "placement", "face", "value", "mean", "u", "low_95", "high_95")


def write_summary(folder: str | Path, model: MonteCarloModel, summary: Summary) -> list[Path]:
    """Write ``uncertainty.json`` and ``uncertainty.csv`` into a folder (made if missing); returns their paths."""
    said = {"uncertainty.json": summary_to_dict(model, summary), "uncertainty.csv": summary_csv(summary)}
    return write_files(folder, said)


def summary_to_dict(model: MonteCarloModel, summary: Summary) -> dict[str, Any]:
    """Everything as JSON types; what ``evaluate`` leaves undefined is left out."""
    return {
        "format": "stepgauge uncertainty 1",
        "stepgauge": __version__,
        "method": "JCGM 101:2008, propagation of distributions; contributions: one input varied at a time (B.1)",
        "of": "a program on the virtual CMM" if model.sign > 0 else "a recording",
        "source": model.nominal.path,
        "machine": model.machine.table.name,
        "gauge": f"{model.gauge.table.name}, serial {model.gauge.table.serial}",
        "runs": summary.runs,
        "contribution_runs": summary.contribution_runs,
        "probings_per_run": model.n_rows,
        "seed": summary.seed,
        "coverage": COVERAGE,
        "conditions": model.conditions.to_dicts(),
        "inputs": _inputs(model),
        "quantities": _rows(summary),
    }


def _inputs(model: MonteCarloModel) -> list[dict[str, Any]]:
    scalars: list[dict[str, Any]] = [
        {"name": x.key, "value": x.value, "u": x.u, "distribution": x.distribution, "dof": x.dof}
        for x in model.inputs.scalars
    ]
    groups: list[dict[str, Any]] = [
        {"name": "certificate", "u_um": [float(u) for u in model.gauge.u_um], "distribution": "normal"},
        {"name": "repeatability", "u_um": model.machine.table.repeatability_um, "distribution": "normal"},
    ]
    return scalars + [group for group in groups if group["name"] in model.inputs.names]


def _rows(summary: Summary) -> list[dict[str, Any]]:
    rows = []
    for i, quantity in enumerate(summary.quantities):
        if math.isnan(summary.mean[i]):
            continue
        numbers = (float(column[i]) for column in (summary.value, summary.mean, summary.u, summary.low, summary.high))
        identity = (quantity.name, quantity.placement, quantity.face)
        row: dict[str, Any] = dict(zip(COLUMNS, (*identity, *numbers), strict=True))
        row["value"] = defined(row["value"])
        row["contributions"] = {name: float(u[i]) for name, u in summary.contribution.items()}
        rows.append(row)
    return rows


def summary_csv(summary: Summary) -> str:
    """One row per quantity; the contribution of an input is the column ``u: INPUT``, in the unit of the quantity."""
    names = list(summary.contribution)
    rows = [
        [*(row[name] for name in COLUMNS), *(row["contributions"][name] for name in names)] for row in _rows(summary)
    ]
    return csv_text(
        [*COLUMNS, *(f"u: {name}" for name in names)], [[result_cell(cell) for cell in row] for row in rows]
    )

"""A Monte Carlo as a result: its lines, its table, its figure, its files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from stepgauge.files.display import Plotted, figures, join_lines
from stepgauge.files.stored import WrittenResult
from stepgauge.montecarlo.files import summary_to_dict, write_summary
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.run import Progress, run_monte_carlo
from stepgauge.montecarlo.summary import Summary

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

"""Distributions of the results: mean, standard uncertainty, 95 % interval and what each input contributes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.montecarlo.model import ModelQuantity, MonteCarloModel

COVERAGE = 0.95
COLUMNS_AT_A_TIME = 32
"""Quantities sorted at a time, so that memory does not grow with their number."""


@dataclass(frozen=True)
class Summary:
    """One entry per quantity, in the unit of its name.

    ``value``: at the best estimates; ``mean``, ``u``: average and standard deviation over the runs (JCGM 101, 7.6);
    ``low``, ``high``: ends of the probabilistically symmetric 95 % interval (7.7); ``contribution``: by input, the
    standard deviation with this input alone varied (Annex B.1). NaN where ``evaluate`` defines nothing.
    """

    quantities: tuple[ModelQuantity, ...]
    runs: int
    contribution_runs: int
    seed: int
    value: Array
    mean: Array
    u: Array
    low: Array
    high: Array
    contribution: dict[str, Array]

    def index(self, name: str, face: int | None = None, placement: int | None = None) -> int:
        """Where a quantity stands; of the first placement unless one is named."""
        wanted = self.quantities[0].placement if placement is None else placement
        return self.quantities.index(ModelQuantity(name, wanted, face))


def summarise(model: MonteCarloModel, values: Array, runs: int, contribution_runs: int, seed: int) -> Summary:
    """The summary of ``values``: ``runs`` rows with all inputs drawn, then ``contribution_runs`` for each input."""
    count = len(model.quantities)
    mean, u, low, high = (np.empty(count) for _ in range(4))
    contribution = {name: np.empty(count) for name in model.inputs.names}
    for columns in _groups(count):
        drawn = np.ascontiguousarray(values[:runs, columns].T)
        mean[columns], u[columns] = drawn.mean(axis=1), drawn.std(axis=1, ddof=1)
        low[columns], high[columns] = symmetric_interval(drawn)
        for number, name in enumerate(model.inputs.names):
            first = runs + number * contribution_runs
            alone = np.array(values[first : first + contribution_runs, columns])
            contribution[name][columns] = alone.std(axis=0, ddof=1)
    quantities = model.quantities
    return Summary(quantities, runs, contribution_runs, seed, model.best(), mean, u, low, high, contribution)


def symmetric_interval(values: Array) -> tuple[Array, Array]:
    """Ends of the 95 % interval of values ``(k, runs)``: q = p M of them, as many left out below as above.

    JCGM 101:2008, 7.7.2.
    """
    count = values.shape[-1]
    inside = min(int(COVERAGE * count + 0.5), count - 1)
    first = max(int((count - inside) / 2.0 + 0.5) - 1, 0)
    last = min(first + inside, count - 1)
    ordered = np.partition(values, (first, last), axis=-1)
    return ordered[..., first], ordered[..., last]


def _groups(count: int) -> Iterator[slice]:
    return (slice(first, first + COLUMNS_AT_A_TIME) for first in range(0, count, COLUMNS_AT_A_TIME))

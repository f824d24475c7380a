"""Other models of the scatter for the terms that a hypothesis has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.noise_models import HEAVY, NORMAL, OUTLYING, NoiseModel
from stepgauge.inference.priors import NoisePriors
from stepgauge.inference.problem import Problem

Array = NDArray[np.float64]
WEIGHING = 3
"""Rounds in which rows are weighted anew by their residuals."""
FARTHER = 4.0
"""Difference to the best hypothesis up to which another is gone on with, nats."""
NEAR_OUTLYING = 9.0
"""Squared residual over the variance from which a row may be an outlier."""
EDGES, FEWEST_IN_A_BURST, MOST_IN_A_BURST = 48, 8, 0.75
"""Places of a record between which the scatter may be larger, and how many readings: fewer are outliers, and of more
what is left is the exception."""
MEDIAN_SQUARE = 0.4549
"""Median of chi-square with one degree of freedom."""


class NoiseProposals:
    """A hypothesis with one property of its scatter changed at a time."""

    def __init__(self, evidence: Evidence, problem: Problem, priors: NoisePriors) -> None:
        self.evidence, self.scatters, self.problem, self.priors = evidence, evidence.scatters, problem, priors

    def __call__(self, state: Hypothesis) -> Iterator[Hypothesis]:
        """The same terms with other models of the scatter."""
        prior, scatter, change = self.priors, state.scatter, self.scatters.changed

        def tried(other: NoiseModel) -> Hypothesis:
            return self.evidence(state.terms, other, state.sigma_um)

        if scatter.growth is not None:
            yield tried(change(scatter, growth=None))
        else:
            yield tried(change(scatter, growth=self._likeliest_growth(state)))
        if scatter.burst is not None:
            yield tried(change(scatter, burst=None))
        elif (burst := self._likeliest_burst(state)) is not None:
            yield tried(change(scatter, burst=burst))
        yield from self._correlated(state, tried)
        yield from (tried(change(scatter, certificate=f)) for f in (1.0, *prior.certificate_factors))
        if self.problem.rounded_um.any():
            yield tried(change(scatter, rounded=not scatter.rounded))
        yield from self._tails(state, tried)

    def _likeliest_growth(self, state: Hypothesis) -> tuple[str, float]:
        """The covariate and rate with which the squared residuals grow, by their likelihood."""
        square = self.evidence.squares(state)
        n, stated = len(square), self.scatters.ordinary(state.scatter)

        def gain(name: str, rate: float) -> float:
            grown = self.scatters.ordinary(replace(state.scatter, growth=(name, rate))) / stated
            return -0.5 * float(np.log(grown).sum() + n * np.log((square / grown).mean()))

        every = [(name, rate) for name in self.problem.growing for rate in self.priors.growth_rates]
        return max(every, key=lambda one: gain(*one))

    def _likeliest_burst(self, state: Hypothesis) -> tuple[int, int, float] | None:
        """The stretch of the record with the largest scatter, by the likelihood; None where none is near probable.

        Where rows have no order of reading there is none.
        """
        if not np.isfinite(self.problem.gap).any():
            return None
        total = np.r_[0.0, np.cumsum(self.evidence.squares(state)[self.problem.order])]
        n, factor = len(total) - 1, np.array(self.priors.burst_factors)
        edges = np.unique(np.linspace(0, n, EDGES + 1).astype(int))
        best, gain = _loudest(total, edges, edges, factor)
        firsts, ends = (np.arange(max(at - n // EDGES, 0), min(at + n // EDGES, n) + 1) for at in best[:2])
        finer, more = _loudest(total, firsts, ends, factor)
        return max((gain, best), (more, finer))[1] if max(gain, more) + self.scatters.log_burst > -FARTHER else None

    def _correlated(self, state: Hypothesis, tried: Callable[[NoiseModel], Hypothesis]) -> Iterator[Hypothesis]:
        """Correlations about the present one, farther as long as they are more probable; 1/f noise if one is near."""
        every = [0.0, *self.priors.correlations]
        here, near = every.index(state.scatter.correlation), state.scatter.correlated
        for step in (1, -1):
            last, place = state, here + step
            while 0 <= place < len(every):
                found = tried(self.scatters.changed(state.scatter, correlation=every[place], flicker=0.0))
                near = near or found.log_posterior > state.log_posterior - FARTHER
                yield found
                if found.log_posterior < last.log_posterior - (FARTHER if last is state else 0.0):
                    break
                last, place = found, place + step
        if here > 1 or state.scatter.flicker:
            yield tried(self.scatters.changed(state.scatter, correlation=0.0, flicker=0.0))
        shares = [one for one in self.priors.flicker_shares if near and one != state.scatter.flicker]
        yield from (tried(self.scatters.changed(state.scatter, correlation=0.0, flicker=one)) for one in shares)

    def _tails(self, state: Hypothesis, tried: Callable[[NoiseModel], Hypothesis]) -> Iterator[Hypothesis]:
        """Outliers and heavy tails, weighted by the residuals of the state; normal tails if these are more probable."""
        normal = self.scatters.without_tails(state.scatter)
        if state.scatter.tails != NORMAL:
            yield tried(normal)
        first = self._robust(state)
        if state.scatter.tails == OUTLYING or (first.max() > NEAR_OUTLYING and first.max() > 0.0):
            yield self._weighed(tried, first, partial(self.scatters.outlying, normal))
        if state.scatter.tails == HEAVY or _kurtosis(first) > 0.0:
            for freedom in self.priors.heavy_freedoms:
                yield self._weighed(tried, first, partial(self.scatters.heavy, normal, freedom))

    def _robust(self, state: Hypothesis) -> Array:
        """Squared residuals over the variance of the middle half of the rows: outliers do not mask one another."""
        square = self.evidence.squares(state)
        return square / min(float(np.median(square)) / MEDIAN_SQUARE, 1.0)

    def _weighed(
        self, tried: Callable[[NoiseModel], Hypothesis], square: Array, weigh: Callable[[Array], NoiseModel]
    ) -> Hypothesis:
        best = None
        for _ in range(WEIGHING):
            state = tried(weigh(square))
            best = state if best is None else max(best, state, key=log_posterior)
            square = self.evidence.squares(state)
        assert best is not None
        return best


def _loudest(
    total: Array, firsts: NDArray[np.intp], ends: NDArray[np.intp], factors: Array
) -> tuple[tuple[int, int, float], float]:
    """The most probable stretch with a scatter larger by a factor, and the log likelihood that it gains.

    ``total``: sums of the squared residuals of the rows before each row, and of all.
    """
    n = len(total) - 1
    first, end, factor = (one.ravel() for one in np.meshgrid(firsts, ends, factors, indexing="ij"))
    count = end - first
    inside = np.where(count > 0, total[end] - total[first], 0.0)
    left = total[-1] - inside * (1.0 - factor**-2.0)
    gain = -count * np.log(factor) - 0.5 * n * np.log(left / total[-1])
    gain = np.where((count >= FEWEST_IN_A_BURST) & (count <= MOST_IN_A_BURST * n), gain, -np.inf)
    at = int(gain.argmax())
    return (int(first[at]), int(end[at]), float(factor[at])), float(gain[at])


def _kurtosis(square: Array) -> float:
    """Excess of the fourth moment, in its standard deviations for normal scatter."""
    excess = float((square**2).mean() / square.mean() ** 2) - 3.0
    return excess / float(np.sqrt(24.0 / len(square)))

"""Other models of the scatter for the terms that a hypothesis has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.posterior.evidence import Evidence
from stepgauge.diagnosis.posterior.priors import ScatterPriors
from stepgauge.diagnosis.posterior.problem import Problem
from stepgauge.diagnosis.posterior.scatter import HEAVY, NORMAL, OUTLYING, Scatter
from stepgauge.diagnosis.posterior.state import State, worth

Array = NDArray[np.float64]
WEIGHING = 3
"""Rounds in which rows are weighted anew by their residuals."""
FARTHER = 4.0
"""Difference to the best hypothesis up to which another is gone on with, nats."""
NEAR_OUTLYING = 9.0
"""Squared residual over the variance from which a row may be an outlier."""
MEDIAN_SQUARE = 0.4549
"""Median of chi-square with one degree of freedom."""


class Facets:
    """A hypothesis with one property of its scatter changed at a time."""

    def __init__(self, evidence: Evidence, problem: Problem, priors: ScatterPriors) -> None:
        self.evidence, self.scatters, self.problem, self.priors = evidence, evidence.scatters, problem, priors

    def __call__(self, state: State) -> Iterator[State]:
        """The same terms with other models of the scatter."""
        prior, scatter, change = self.priors, state.scatter, self.scatters.changed

        def tried(other: Scatter) -> State:
            return self.evidence(state.terms, other, state.sigma_um)

        if scatter.growth is not None:
            yield tried(change(scatter, growth=None))
        else:
            yield tried(change(scatter, growth=self._likeliest_growth(state)))
        yield from self._correlated(state, tried)
        yield from (tried(change(scatter, certificate=f)) for f in (1.0, *prior.certificate_factors))
        if self.problem.rounded_um.any():
            yield tried(change(scatter, rounded=not scatter.rounded))
        yield from self._tails(state, tried)

    def _likeliest_growth(self, state: State) -> tuple[str, float]:
        """The covariate and rate with which the squared residuals grow, by their likelihood."""
        square = self.evidence.squares(state)
        n, stated = len(square), self.scatters.ordinary(state.scatter)

        def gain(name: str, rate: float) -> float:
            grown = self.scatters.ordinary(replace(state.scatter, growth=(name, rate))) / stated
            return -0.5 * float(np.log(grown).sum() + n * np.log((square / grown).mean()))

        every = [(name, rate) for name in self.problem.growing for rate in self.priors.growth_rates]
        return max(every, key=lambda one: gain(*one))

    def _correlated(self, state: State, tried: Callable[[Scatter], State]) -> Iterator[State]:
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

    def _tails(self, state: State, tried: Callable[[Scatter], State]) -> Iterator[State]:
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

    def _robust(self, state: State) -> Array:
        """Squared residuals over the variance of the middle half of the rows: outliers do not mask one another."""
        square = self.evidence.squares(state)
        return square / min(float(np.median(square)) / MEDIAN_SQUARE, 1.0)

    def _weighed(self, tried: Callable[[Scatter], State], square: Array, weigh: Callable[[Array], Scatter]) -> State:
        best = None
        for _ in range(WEIGHING):
            state = tried(weigh(square))
            best = state if best is None else max(best, state, key=worth)
            square = self.evidence.squares(state)
        assert best is not None
        return best


def _kurtosis(square: Array) -> float:
    """Excess of the fourth moment, in its standard deviations for normal scatter."""
    excess = float((square**2).mean() / square.mean() ** 2) - 3.0
    return excess / float(np.sqrt(24.0 / len(square)))

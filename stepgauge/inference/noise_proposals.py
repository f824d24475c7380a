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
from stepgauge.inference.noise_priors import NoisePriors
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
        self.evidence, self.noise_models, self.problem, self.priors = evidence, evidence.noise_models, problem, priors

    def __call__(self, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
        """The same terms with other models of the scatter."""
        prior, noise, change = self.priors, hypothesis.noise, self.noise_models.changed

        def tried(other: NoiseModel) -> Hypothesis:
            return self.evidence(hypothesis.terms, other, hypothesis.sigma_um)

        if noise.growth is not None:
            yield tried(change(noise, growth=None))
        elif self.problem.growing:
            yield tried(change(noise, growth=self._likeliest_growth(hypothesis)))
        if noise.burst is not None:
            yield tried(change(noise, burst=None))
        elif (burst := self._likeliest_burst(hypothesis)) is not None:
            yield tried(change(noise, burst=burst))
        yield from self._correlated(hypothesis, tried)
        if len(self.problem.certified):
            yield from (tried(change(noise, certificate=f)) for f in (1.0, *prior.certificate_factors))
        if self.problem.rounded_um.any():
            yield tried(change(noise, rounded=not noise.rounded))
        yield from self._tails(hypothesis, tried)

    def rated(self, hypothesis: Hypothesis) -> Iterator[tuple[NoiseModel, float]]:
        """All models with one property other than the present, with their log posteriors.

        Growing scatter is computed for its likeliest covariate and rate, and rated for all others by what these explain
        of the squared residuals.
        """
        present, gains = hypothesis.noise, dict(self._growth_gains(hypothesis))
        known = hypothesis
        for other in self(hypothesis):
            if other.current:
                yield other.noise, other.log_posterior
            if present.growth is None and other.noise.growth is not None:
                known = other
        own = known.noise.growth
        for growth in gains:
            if own is not None and growth != own and growth != present.growth:
                changed = self.noise_models.changed(present, growth=growth)
                yield changed, known.log_posterior + gains[growth] - gains[own]

    def _likeliest_growth(self, hypothesis: Hypothesis) -> tuple[str, float]:
        """The covariate and rate with which the squared residuals grow, by their likelihood."""
        return max(self._growth_gains(hypothesis), key=lambda one: one[1])[0]

    def _growth_gains(self, hypothesis: Hypothesis) -> Iterator[tuple[tuple[str, float], float]]:
        """Every covariate and rate with what it explains of the squared residuals, nats."""
        square = self.evidence.squares(hypothesis)
        n, stated = len(square), self.noise_models.ordinary(hypothesis.noise)

        def gain(name: str, rate: float) -> float:
            grown = self.noise_models.ordinary(replace(hypothesis.noise, growth=(name, rate))) / stated
            return -0.5 * float(np.log(grown).sum() + n * np.log((square / grown).mean()))

        for name in self.problem.growing:
            yield from (((name, rate), gain(name, rate)) for rate in self.priors.growth_rates)

    def _likeliest_burst(self, hypothesis: Hypothesis) -> tuple[int, int, float] | None:
        """The stretch of the record with the largest scatter, by the likelihood; None where none is near probable.

        Where rows have no order of reading there is none.
        """
        if not np.isfinite(self.problem.gap).any():
            return None
        total = np.r_[0.0, np.cumsum(self.evidence.squares(hypothesis)[self.problem.order])]
        n, factor = len(total) - 1, np.array(self.priors.burst_factors)
        edges = np.unique(np.linspace(0, n, EDGES + 1).astype(int))
        best, gain = _loudest(total, edges, edges, factor)
        firsts, ends = (np.arange(max(at - n // EDGES, 0), min(at + n // EDGES, n) + 1) for at in best[:2])
        finer, more = _loudest(total, firsts, ends, factor)
        return max((gain, best), (more, finer))[1] if max(gain, more) + self.noise_models.log_burst > -FARTHER else None

    def _correlated(self, hypothesis: Hypothesis, tried: Callable[[NoiseModel], Hypothesis]) -> Iterator[Hypothesis]:
        """Correlations about the present one, farther as long as they are more probable; 1/f noise if one is near."""
        every = [0.0, *self.priors.correlations]
        here, near = every.index(hypothesis.noise.correlation), hypothesis.noise.correlated
        for step in (1, -1):
            last, place = hypothesis, here + step
            while 0 <= place < len(every):
                found = tried(self.noise_models.changed(hypothesis.noise, correlation=every[place], flicker=0.0))
                near = near or found.log_posterior > hypothesis.log_posterior - FARTHER
                yield found
                if found.log_posterior < last.log_posterior - (FARTHER if last is hypothesis else 0.0):
                    break
                last, place = found, place + step
        if here > 1 or hypothesis.noise.flicker:
            yield tried(self.noise_models.changed(hypothesis.noise, correlation=0.0, flicker=0.0))
        shares = [one for one in self.priors.flicker_shares if near and one != hypothesis.noise.flicker]
        yield from (tried(self.noise_models.changed(hypothesis.noise, correlation=0.0, flicker=one)) for one in shares)

    def _tails(self, hypothesis: Hypothesis, tried: Callable[[NoiseModel], Hypothesis]) -> Iterator[Hypothesis]:
        """Outliers and heavy tails, weighted by the residuals of the state; normal tails if these are more probable."""
        normal = self.noise_models.without_tails(hypothesis.noise)
        if hypothesis.noise.tails != NORMAL:
            yield tried(normal)
        first = self._robust(hypothesis)
        if hypothesis.noise.tails == OUTLYING or (first.max() > NEAR_OUTLYING and first.max() > 0.0):
            yield self._weighed(tried, first, partial(self.noise_models.outlying, normal))
        if hypothesis.noise.tails == HEAVY or _kurtosis(first) > 0.0:
            for freedom in self.priors.heavy_freedoms:
                yield self._weighed(tried, first, partial(self.noise_models.heavy, normal, freedom))

    def _robust(self, hypothesis: Hypothesis) -> Array:
        """Squared residuals over the variance of the middle half of the rows: outliers do not mask one another."""
        square = self.evidence.squares(hypothesis)
        return square / min(float(np.median(square)) / MEDIAN_SQUARE, 1.0)

    def _weighed(
        self, tried: Callable[[NoiseModel], Hypothesis], square: Array, weigh: Callable[[Array], NoiseModel]
    ) -> Hypothesis:
        best = None
        for _ in range(WEIGHING):
            hypothesis = tried(weigh(square))
            best = hypothesis if best is None else max(best, hypothesis, key=log_posterior)
            square = self.evidence.squares(hypothesis)
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

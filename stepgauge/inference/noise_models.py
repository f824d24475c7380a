"""Models of the scatter: its size in every row, its correlation, and the prior of each model.

Outlying rows and heavy tails are scale mixtures: the precision of a row is a latent variable, and the marginal
likelihood is replaced by its variational bound, exact in the latent variables for given residuals (Bishop, Pattern
Recognition and Machine Learning, 2006, section 10.2). The bound is a Gaussian likelihood with fixed weights times a
constant, so that hypotheses with different scatter can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import Problem

Array = NDArray[np.float64]
NORMAL, OUTLYING, HEAVY = "normal", "outlying", "heavy"


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """A model of the scatter.

    ``weight (n,)``: expected precision of a row over that of an ordinary one; ``growth``: covariate and rate of growing
    scatter beyond the stated; ``burst``: first row in the order of reading, the one after the last, and the factor by
    which the scatter between them is larger; ``correlation``: from one reading to the next; ``flicker``: share of 1/f
    noise; ``certificate``: factor on the stated uncertainties; ``rounded``: whether the errors of display and latch are
    the same in all repeats; ``tails``: see the module; ``outlying (n,)``: probability of a row being an outlier;
    ``log_prior``: logarithm of the prior with the constants of the bound.
    """

    weight: Array
    log_prior: float
    growth: tuple[str, float] | None = None
    correlation: float = 0.0
    flicker: float = 0.0
    burst: tuple[int, int, float] | None = None
    certificate: float = 1.0
    rounded: bool = False
    tails: str = NORMAL
    freedom: float = np.inf
    outlying: Array | None = None
    bound: float = 0.0

    @property
    def model(self) -> tuple[object, ...]:
        """Which of all models it is; the weights of the rows are part of how the same one is computed."""
        related = self.correlation, self.flicker
        return self.growth, self.burst, *related, self.certificate, self.rounded, self.tails, self.freedom

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Identity of a model with its weights."""
        return *self.model, round(self.bound, 6), round(float(self.weight.sum()), 6)

    @cached_property
    def approximate_key(self) -> tuple[object, ...]:
        """Approximate identity of a model: the weights of the rows by their mean."""
        return *self.model, round(float(self.weight.mean()) * 50.0)

    @property
    def correlated(self) -> bool:
        """Whether a reading tells of the next one."""
        return self.correlation > 0.0 or self.flicker > 0.0

    @property
    def is_plain(self) -> bool:
        """Whether it is the simplest model: the same for all rows, independent, no outliers."""
        return self.growth is None and self.burst is None and not self.correlated and self.tails != OUTLYING


class NoiseModels:
    """All models of the scatter that a problem may have, with their priors."""

    def __init__(self, problem: Problem, priors: NoisePriors) -> None:
        self.problem, self.priors = problem, priors
        self.ones = np.ones(len(problem))

    def plain(self) -> NoiseModel:
        """The same for every row, independent."""
        return self._priced(NoiseModel(self.ones, 0.0))

    def variance(self, noise: NoiseModel) -> Array:
        """Variance of every row over that of an ordinary one, ``(n,)``."""
        return self.ordinary(noise) / noise.weight

    def ordinary(self, noise: NoiseModel) -> Array:
        """The same without outliers and tails: as it is stated, and what grows beyond that in quadrature."""
        stated = self.problem.stated * self.ones
        if noise.rounded:
            stated = stated - (self.problem.latched_um / self.problem.scale_um) ** 2
        if noise.growth is not None:
            name, rate = noise.growth
            stated = stated + (rate * self.problem.typical * self.problem.growing[name]) ** 2
        if noise.burst is not None:
            first, end, factor = noise.burst
            stated = stated * np.where(self._inside(first, end), factor**2, 1.0)
        return stated

    def _inside(self, first: int, end: int) -> NDArray[np.bool_]:
        inside = np.zeros(len(self.problem), bool)
        inside[self.problem.order[first:end]] = True
        return inside

    @cached_property
    def log_burst(self) -> float:
        """Logarithm of the prior of larger scatter by one of the factors in one stretch of the record."""
        prior, n = self.priors, len(self.problem)
        return float(np.log(prior.burst / len(prior.burst_factors) / (0.5 * n**2)))

    def changed(self, noise: NoiseModel, **facets: object) -> NoiseModel:
        """A model with some properties changed, and its new prior."""
        return self._priced(replace(noise, **facets))  # type: ignore[arg-type]

    def without_tails(self, noise: NoiseModel) -> NoiseModel:
        """The same with normal tails."""
        return self.changed(noise, weight=self.ones, tails=NORMAL, freedom=np.inf, outlying=None, bound=0.0)

    def outlying(self, noise: NoiseModel, square: Array) -> NoiseModel:
        """The same where each row may be an outlier; ``square (n,)``: expected squared residuals over the variance."""
        prior, n = self.priors, len(self.problem)
        wide = np.array([1.0, *prior.outlier_sizes])
        share = np.log(np.r_[1.0, np.full(len(wide) - 1, 1.0 / (len(wide) - 1))])
        rate = 1.0 / prior.outlier_share
        chance = np.full(n, 1.0 / rate)
        for _ in range(3):
            some = float(chance.sum())
            odds = special.digamma([rate + n - some, *[1.0 + some] * (len(wide) - 1)]) - special.digamma(1 + rate + n)
            log = odds + share - np.log(wide) - 0.5 * square[:, None] / wide**2
            p = special.softmax(log, axis=1)
            chance = 1.0 - p[:, 0]
        some = float(chance.sum())
        weight = p @ (1.0 / wide**2)
        bound = float((p * (share - np.log(wide))).sum() + special.entr(p).sum() - 0.5 * np.log(weight).sum())
        bound += float(special.betaln(1.0 + some, rate + n - some) - special.betaln(1.0, rate))
        return self.changed(noise, weight=weight, tails=OUTLYING, freedom=np.inf, outlying=chance, bound=bound)

    def heavy(self, noise: NoiseModel, freedom: float, square: Array) -> NoiseModel:
        """The same with tails of Student's distribution with ``freedom`` degrees of freedom."""
        a0 = b0 = freedom / 2.0
        a, b = a0 + 0.5, b0 + 0.5 * square
        weight, log = a / b, special.digamma(a) - np.log(b)
        divergence = (a - a0) * special.digamma(a) - special.gammaln(a) + special.gammaln(a0)
        divergence = divergence + a0 * (np.log(b) - np.log(b0)) + a * (b0 - b) / b
        bound = float((0.5 * log - 0.5 * np.log(weight) - divergence).sum())
        return self.changed(noise, weight=weight, tails=HEAVY, freedom=freedom, outlying=None, bound=bound)

    def _priced(self, noise: NoiseModel) -> NoiseModel:
        prior, log_prior = self.priors, noise.bound
        if noise.growth is not None:
            log_prior += np.log(prior.growth / len(self.problem.growing) / len(prior.growth_rates))
        if noise.burst is not None:
            log_prior += self.log_burst
        if noise.correlation:
            log_prior += np.log(prior.correlation / len(prior.correlations))
        if noise.flicker:
            log_prior += np.log(prior.flicker / len(prior.flicker_shares))
        if noise.certificate > 1.0:
            log_prior += np.log(prior.certificate / len(prior.certificate_factors))
        if noise.rounded:
            log_prior += np.log(prior.rounded)
        if noise.tails == OUTLYING:
            log_prior += np.log(prior.outliers)
        if noise.tails == HEAVY:
            log_prior += np.log(prior.heavy / len(prior.heavy_freedoms))
        return replace(noise, log_prior=float(log_prior))

"""The log posterior of one hypothesis: log prior plus log marginal likelihood.

Amplitudes and nuisance parameters are integrated exactly (they are linear with normal priors), the scatter sigma by
Laplace's approximation in its logarithm (MacKay, Neural Computation 4, 1992: 415). The sizes of each term are summed at
the most probable sizes of the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.amplitudes import (
    discrepancy_resized,
    log_inside,
    resized,
    size_log_evidence,
    summed_sizes_gain,
)
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.likelihood import Likelihood, SigmaPrior
from stepgauge.inference.metric import RowMetric, nuisances
from stepgauge.inference.noise_models import NoiseModel, NoiseModels
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import Candidate, Law, Problem, Term, company_log_prior, slices

Array = NDArray[np.float64]
RESIZED = 60
"""Most changes of a size on the way to the most probable ones: a few, but for laws that are nearly the same."""


@dataclass(frozen=True)
class _Base:
    """Common to all hypotheses with one scatter: rows, mapped residual and nuisance columns, and their products.

    ``sigma``: prior of the size of the scatter; ``turn (k, k)``, ``value (k,)``: eigenvectors and eigenvalues of the
    products of the nuisance columns in units of their prior ``sd``.
    """

    rows: RowMetric
    sigma: SigmaPrior
    raw: Array
    mapped: Array
    gram: Array
    sd: Array
    turn: Array
    value: Array


class Evidence:
    """Log posteriors of hypotheses, each computed once."""

    def __init__(self, problem: Problem, priors: NoisePriors) -> None:
        self.problem, self.noise_models = problem, NoiseModels(problem, priors)
        self.sigma = SigmaPrior(problem.scale_um, priors.sigma_factor, problem.least_um)
        self.visited: dict[tuple[object, ...], Hypothesis] = {}
        self._bases: dict[tuple[object, ...], _Base] = {}
        self._columns: dict[tuple[object, ...], Array] = {}
        self._products: dict[tuple[object, ...], Array] = {}
        self._squares: dict[int, Array] = {}

    @property
    def current(self) -> Iterator[Hypothesis]:
        """All hypotheses that were computed with the volumes that hold for their scatter."""
        return (hypothesis for hypothesis in self.visited.values() if hypothesis.current)

    @property
    def best_by_labels(self) -> dict[frozenset[str], Hypothesis]:
        """The most probable one of :attr:`current` for each set of terms."""
        found: dict[frozenset[str], Hypothesis] = {}
        for hypothesis in self.current:
            found[hypothesis.labels] = max(found.get(hypothesis.labels, hypothesis), hypothesis, key=log_posterior)
        return found

    def __call__(self, terms: tuple[Term, ...], noise: NoiseModel, near_um: float | None = None) -> Hypothesis:
        """The hypothesis of some terms and a scatter; ``near_um``: a first guess of the scatter."""
        key = _key(terms, noise)
        if key not in self.visited:
            self.visited[key] = self._state(terms, noise, near_um or self.problem.within_um)
        return self.visited[key]

    def apart(self, terms: tuple[Term, ...], noise: NoiseModel, near_um: float) -> Hypothesis:
        """The same as a call, of what is not to be found again among all."""
        return self._state(terms, noise, near_um)

    def narrowed(self, hypothesis: Hypothesis, candidate: Candidate, by: float) -> Hypothesis:
        """A hypothesis in place of the same with a volume of one term that is too large, by so many nats."""
        place = hypothesis.index(candidate)
        narrow = replace(hypothesis.terms[place], log_prior=hypothesis.terms[place].log_prior - by)
        terms = (*hypothesis.terms[:place], narrow, *hypothesis.terms[place + 1 :])
        self.visited.pop(_key(hypothesis.terms, hypothesis.noise), None)
        return self.visited.setdefault(
            _key(terms, hypothesis.noise), replace(hypothesis, terms=terms, log_posterior=hypothesis.log_posterior - by)
        )

    def _base(self, noise: NoiseModel) -> _Base:
        if noise.key not in self._bases:
            rows = RowMetric(self.problem, noise, self.noise_models)
            columns, sd = nuisances(self.problem, noise)
            raw = np.vstack([self.problem.residual_um, columns])
            mapped = rows(raw)
            gram = mapped @ mapped.T
            value, turn = np.linalg.eigh(sd[:, None] * gram[1:, 1:] * sd)
            sigma = replace(self.sigma, least_um=rows.least_um)
            self._bases[noise.key] = _Base(rows, sigma, columns, mapped, gram, sd, turn, np.maximum(value, 0.0))
        return self._bases[noise.key]

    def _mapped(self, term: Term, noise: NoiseModel, base: _Base) -> Array:
        key = (term.key, noise.key)
        if key not in self._columns:
            self._columns[key] = base.rows(term.columns)
        return self._columns[key]

    def _gram(self, terms: tuple[Term, ...], noise: NoiseModel, base: _Base) -> Array:
        """Products of the residual and all columns; those of two terms are computed once."""
        first, *own = slices([len(base.gram), *(len(term.columns) for term in terms)])
        size = own[-1].stop if own else first.stop
        gram = np.empty((size, size))
        gram[first, first] = base.gram
        for i, (one, term) in enumerate(zip(own, terms, strict=True)):
            beside = self._product(term, None, noise, base)
            gram[first, one], gram[one, first] = beside, beside.T
            for other, another in zip(own[: i + 1], terms, strict=False):
                product = self._product(term, another, noise, base)
                gram[one, other], gram[other, one] = product, product.T
        return gram

    def _product(self, term: Term, other: Term | None, noise: NoiseModel, base: _Base) -> Array:
        """Products ``(d, e)`` of a term's columns with another's; ``(k, d)`` with residual and nuisance columns."""
        key = (term.key, None if other is None else other.key, noise.key)
        if key not in self._products:
            mapped = self._mapped(term, noise, base)
            beside = base.mapped @ mapped.T if other is None else mapped @ self._mapped(other, noise, base).T
            self._products[key] = beside
        return self._products[key]

    def _state(self, terms: tuple[Term, ...], noise: NoiseModel, near_um: float) -> Hypothesis:
        """The hypothesis with the most probable size of every term, and all sizes summed."""
        hypothesis = self._optimise_sizes(terms, noise, near_um)
        hypothesis = self._within_bounds(replace(hypothesis, log_posterior=_summed(hypothesis)))
        return hypothesis if np.isfinite(hypothesis.log_posterior) else replace(hypothesis, log_posterior=-np.inf)

    def _optimise_sizes(self, terms: tuple[Term, ...], noise: NoiseModel, near_um: float) -> Hypothesis:
        """One size is changed at a time: of two laws alike that are large together one is enough.

        What a law moves beside its signature is in proportion to the amplitude that it has, and not to a larger one
        that it might have had. Sizes and scatter depend on each other, so that the changes may go round.
        """
        hypothesis = self._hypothesis_at_sizes(terms, noise, near_um)
        found = {_sizes(terms): hypothesis}
        for _ in range(RESIZED):
            term = resized(hypothesis) or discrepancy_resized(hypothesis)
            if term is None:
                break
            terms = tuple(term if one.candidate is term.candidate else one for one in hypothesis.terms)
            if (sizes := _sizes(terms)) in found:
                every = list(found)
                return max((found[one] for one in every[every.index(sizes) :]), key=_summed)
            hypothesis = found[sizes] = self._hypothesis_at_sizes(terms, noise, hypothesis.sigma_um)
        return hypothesis

    def _hypothesis_at_sizes(self, terms: tuple[Term, ...], noise: NoiseModel, near_um: float) -> Hypothesis:
        """The hypothesis with the sizes that its terms have; their prior is that of their sizes summed."""
        base = self._base(noise)
        gram = self._gram(terms, noise, base)
        sd = np.concatenate([base.sd, *(term.sds for term in terms)])
        likelihood = Likelihood(gram, sd, base.turn, base.value, len(self.problem), base.sigma)
        log_evidence, log_sigma = likelihood.integrated(near_um)
        factor, amplitudes = likelihood.solved(log_sigma)
        mean, first = sd * amplitudes, len(base.sd)
        left_um = self.problem.residual_um - mean[:first] @ base.raw
        for term in terms:
            left_um -= mean[first : (first := first + len(term.columns))] @ term.columns
        log_posterior = log_evidence + base.rows.log_determinant + noise.log_prior
        log_posterior += sum(term.log_prior for term in terms) + company_log_prior(terms)
        sigma_um, square = float(np.exp(log_sigma)), likelihood.square(amplitudes, log_sigma)
        hypothesis = Hypothesis(terms, noise, log_posterior, sigma_um, left_um, factor, sd, mean, len(base.sd), square)
        try:
            return replace(hypothesis, size_log_evidence=tuple(size_log_evidence(hypothesis)))
        except np.linalg.LinAlgError:  # no number is left of amplitudes beyond all rounding: nobody chooses this
            weights = tuple(term.candidate.sizes.log_weight for term in terms)
            return replace(hypothesis, log_posterior=-np.inf, size_log_evidence=weights)

    def _within_bounds(self, hypothesis: Hypothesis) -> Hypothesis:
        """The state with the priors of amplitudes that cannot be negative, or small, cut there."""
        gain = 0.0
        for place, term in enumerate(hypothesis.terms):
            law = term.candidate
            if isinstance(law, Law) and law.bounded:
                mean, covariance = hypothesis.amplitudes(place)
                u = np.sqrt(covariance[0, 0])
                gain += float(log_inside(mean[0], u, term.sd, law.least, law.positive))
        return replace(hypothesis, log_posterior=hypothesis.log_posterior + gain) if gain else hypothesis

    def squares(self, hypothesis: Hypothesis) -> Array:
        """Expected squared residual of each row over its variance, given the other rows, ``(n,)``; computed once."""
        if id(hypothesis) not in self._squares:
            self._squares[id(hypothesis)] = self._expected_squares(hypothesis)
        return self._squares[id(hypothesis)]

    def _expected_squares(self, hypothesis: Hypothesis) -> Array:
        base = self._base(hypothesis.noise)
        columns = np.vstack([base.raw, *(term.columns for term in hypothesis.terms)])
        own = np.einsum("kn,kn->n", columns, hypothesis.covariance @ columns)
        rows, variance = base.rows, self.noise_models.ordinary(hypothesis.noise) * hypothesis.sigma_um**2
        if not rows.correlated:
            return cast(Array, (hypothesis.residual_um**2 + own) / variance)
        conditional = rows.adjoint(rows(hypothesis.residual_um)[:, None])[:, 0] / rows.precision
        return cast(Array, (conditional**2 + own) * rows.precision / rows.scale**2 / variance)


def _sizes(terms: tuple[Term, ...]) -> tuple[object, ...]:
    return tuple((term.sd, term.discrepancy_sd) for term in terms)


def _summed(hypothesis: Hypothesis) -> float:
    """The log posterior with all sizes of every term."""
    return hypothesis.log_posterior + summed_sizes_gain(hypothesis)


def _key(terms: tuple[Term, ...], noise: NoiseModel) -> tuple[object, ...]:
    return frozenset(term.key for term in terms), noise.key

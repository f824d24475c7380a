"""A hypothesis with what was computed of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.likelihood import inverse
from stepgauge.inference.noise_models import NoiseModel
from stepgauge.inference.problem import Candidate, Term, slices

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A hypothesis: its terms and scatter, and the quantities that follow from them.

    ``log_posterior``: up to a constant of the problem; ``sigma_um``: standard deviation of an ordinary row;
    ``residual_um (n,)``: residuals after terms and nuisance parameters; ``mean (k,)``: posterior mean of the amplitudes
    of ``count`` nuisance parameters and of the terms, ``prior_sd`` their prior standard deviations, ``factor`` that of
    their precision in units of these; ``square``: sum of squares at the most probable sigma, over its variance, with
    that of the amplitudes over theirs; ``size_log_evidence``: of each term, log evidence of its sizes over that of its
    present one.
    """

    terms: tuple[Term, ...]
    noise: NoiseModel
    log_posterior: float
    sigma_um: float
    residual_um: Array
    factor: Array
    prior_sd: Array
    mean: Array
    count: int
    square: float
    size_log_evidence: tuple[Array, ...] = ()

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance of nuisance parameters and amplitudes at the most probable sigma."""
        return np.asarray(self.prior_sd[:, None] * inverse(self.factor) * self.prior_sd)

    @property
    def labels(self) -> frozenset[str]:
        """Labels of the terms, without their shapes."""
        return frozenset(term.candidate.label for term in self.terms)

    @property
    def named(self) -> bool:
        """Whether all terms are laws."""
        return all(term.candidate.named for term in self.terms)

    @property
    def log_fit(self) -> float:
        """Log likelihood at the most probable amplitudes and sigma, up to a constant of the scatter."""
        return -len(self.residual_um) * float(np.log(self.sigma_um)) - 0.5 * self.square

    @property
    def current(self) -> bool:
        """Whether no term has the volume of correlated scatter where the scatter is independent."""
        return self.noise.correlated or not any(term.correlated for term in self.terms)

    def index(self, candidate: Candidate) -> int:
        """The place of a candidate among the terms, whose order is that of whoever asked for them first."""
        return next(i for i, term in enumerate(self.terms) if term.candidate is candidate)

    def index_of(self, term: Term) -> int | None:
        """The place of this very term; None for one that the hypothesis has otherwise or not at all."""
        return next((i for i, own in enumerate(self.terms) if own is term), None)

    def place_of(self, label: str) -> int | None:
        """The place of the term with this label; None where there is none."""
        return next((i for i, own in enumerate(self.terms) if own.candidate.label == label), None)

    def amplitudes(self, place: int) -> tuple[Array, Array]:
        """Posterior mean ``(d,)`` and covariance ``(d, d)`` of the amplitudes of one term, without its discrepancy."""
        own = self._slice(place)
        return self.mean[own], self.covariance[own, own]

    def significance(self, place: int) -> float:
        """Square of the amplitudes of a term over their standard uncertainties, for each of them."""
        mean, covariance = self.amplitudes(place)
        return float(mean @ np.linalg.pinv(covariance) @ mean) / len(mean)

    def contribution_um(self, place: int) -> Array:
        """Mean of what one term moves by its signature, ``(n,)``."""
        term = self.terms[place]
        return np.asarray(self.mean[self._slice(place)] @ term.columns[: term.n_amplitudes])

    def discrepancy_um(self, place: int) -> Array:
        """Mean of what one term moves beside its signature, ``(n,)``."""
        first, term = self._slice(place).stop, self.terms[place]
        return np.asarray(self.mean[first : first + len(term.discrepancy)] @ term.discrepancy)

    def size(self, place: int) -> float:
        """Length of the mean amplitudes of one term."""
        return float(np.linalg.norm(self.mean[self._slice(place)]))

    def _slice(self, place: int) -> slice:
        first = self.count + self.parts[place].start
        return slice(first, first + self.terms[place].n_amplitudes)

    @property
    def parts(self) -> list[slice]:
        """Where the amplitudes of each term are among those of all terms."""
        return slices(len(term.columns) for term in self.terms)

    @property
    def term_posterior(self) -> tuple[Array, Array]:
        """Posterior mean and covariance of the amplitudes of all terms: the last corner of the precision's factor."""
        count, sd = self.count, self.prior_sd[self.count :]
        return self.mean[count:], sd[:, None] * inverse(self.factor[count:, count:].copy()) * sd


def log_posterior(hypothesis: Hypothesis) -> float:
    """The log posterior of a hypothesis, as a key of ``max`` and ``sorted``."""
    return hypothesis.log_posterior

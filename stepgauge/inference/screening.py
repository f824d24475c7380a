"""Rating of all candidates for addition to a hypothesis in one pass: the approximate gain in the log posterior.

The scatter is integrated as in a Student distribution with the remaining degrees of freedom, shapes are summed over
their grids and sizes over their mixtures. A look proposes candidates; :mod:`evidence` computes those proposed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.features import Features, Kernels
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.inference.patterns import Patterns, grouped, loss_products, residual_products
from stepgauge.inference.problem import GaussianProcess, Law, Problem, Term
from stepgauge.inference.proposal import UNLOST, HypothesisResidual, Proposal
from stepgauge.inference.tables import Dots, SignatureTable, tables

Array = NDArray[np.float64]
LIKE_SIGMA = 0.5
"""Difference of log sigma within which looks use the same metric."""


@dataclass(frozen=True)
class Vectors:
    """Mapped vectors ``(d, n)``: the residual, or the columns of a term; and their products, each computed once.

    ``sd (d,)``: prior standard deviations of their amplitudes; ``patterns``: products with all shapes ``(atoms, depth,
    r, d)``; ``features (m, d)``: with those of random functions.
    """

    mapped: Array
    sd: Array
    patterns: list[NDArray[np.float32]]
    features: Array


class MetricScreening:
    """Looks with one metric."""

    def __init__(self, problem: Problem, metric: Metric, kernels: Kernels) -> None:
        self.metric, self.patterns = metric, list[Patterns]()
        self.least = metric.dof * (metric.rows.least_um / metric.sigma_um) ** 2
        self.tables: list[SignatureTable] = []
        self.smooth = Features(kernels, metric)
        self._of_terms: dict[tuple[object, ...], Vectors] = {}
        self._of_residual = self._vectors(metric(problem.residual_um[None]), np.ones(1))

    def admit(self, patterns: Sequence[Patterns]) -> None:
        """All of ``patterns`` that are not known yet; tables are added, none is changed."""
        more = patterns[len(self.patterns) :]
        self.tables += tables(more, self.metric, len(self.patterns))
        self.patterns += more
        self.__dict__.pop("plain", None)

    def proposals(self, hypothesis: Hypothesis, known: int = 0) -> list[Proposal]:
        """All candidates for addition to a hypothesis, but for the first ``known`` tables."""
        vectors, tables = self.vectors_of(hypothesis), self.tables[known:]
        beside = self.beside(vectors)
        dots = self._dots(beside, vectors, dict.fromkeys(place for table in tables for place, _ in table.sets))
        found = [proposal for table in tables for proposal in table.proposals(dots, beside)]
        kinds = _kinds(hypothesis)
        found = [proposal.beside(kinds) for proposal in found]
        if known:
            return found
        return [*found, *self.smooth.proposals(beside, np.hstack([one.features for one in vectors]) @ beside.turn)]

    def _dots(self, beside: HypothesisResidual, vectors: Sequence[Vectors], places: Iterable[int]) -> Dots:
        """Products of patterns with the residual and what the loss takes of their own, by their place."""
        turn, dots = beside.turn.astype(np.float32), Dots()
        for place in places:
            every = np.concatenate([self._products(one, place) for one in vectors], axis=-1)
            products = (every.reshape(-1, len(turn)) @ turn).reshape(*every.shape[:3], -1)
            dots[place] = residual_products(products), loss_products(products) if turn.shape[1] > 1 else None
        return dots

    def _products(self, vectors: Vectors, place: int) -> NDArray[np.float32]:
        if place >= len(vectors.patterns):
            columns = self.metric.adjoint(vectors.mapped.T)
            vectors.patterns.extend(one.dots(columns) for one in self.patterns[len(vectors.patterns) :])
        return vectors.patterns[place]

    def _vectors(self, mapped: Array, sd: Array) -> Vectors:
        return Vectors(mapped, sd, [], self.smooth.white @ mapped.T)

    def vectors_of(self, hypothesis: Hypothesis) -> list[Vectors]:
        """Those of the residual and of all terms."""
        return [self._of_residual, *(self._vectors_of_term(term) for term in hypothesis.terms)]

    def _vectors_of_term(self, term: Term) -> Vectors:
        """Of a random function those combinations of its columns of which it takes something with its size."""
        if isinstance(term.candidate, Law):
            if term.key not in self._of_terms:
                self._of_terms[term.key] = self._vectors(self.metric(term.columns), term.sds)
            return replace(self._of_terms[term.key], sd=term.sds)
        key = (*term.key, term.sd)
        if key not in self._of_terms:
            scaled = term.sd * self.metric(term.columns)
            value, axes = np.linalg.eigh(scaled @ scaled.T)
            seen = axes[:, value > UNLOST].T @ scaled
            self._of_terms[key] = self._vectors(seen, np.ones(len(seen)))
        return self._of_terms[key]

    def pairs(self, hypothesis: Hypothesis, most: int, without: frozenset[str]) -> list[tuple[Proposal, Proposal]]:
        """The most probable pairs of laws of one shape and one amplitude each.

        Two laws may explain together what neither does alone; all pairs are rated, at each step of the sizes. A law
        that cannot be so large has its largest size.
        """
        keep = [i for i, law in enumerate(self.plain[0]) if law.label not in without]
        if len(keep) < 2:
            return []
        vectors, laws, white = self.vectors_of(hypothesis), [self.plain[0][i] for i in keep], self.plain[1][keep]
        beside = self.beside(vectors)
        products = white @ np.vstack([one.mapped for one in vectors]).T @ beside.turn
        dot, lost = products[:, 0], products[:, 1:]
        gram = white @ white.T - lost @ lost.T
        first, second = np.triu_indices(len(laws), 1)
        kind, again = np.array([law.kind for law in laws]), np.array([law.again for law in laws])
        there = np.isin(kind, list(_kinds(hypothesis)))
        odds = np.array([law.log_odds for law in laws]) + np.where(there, again, 0.0)
        alike = (kind[first] == kind[second]) & (again[first] != 0.0) & (again[second] != 0.0) & ~there[first]
        alike = np.where(alike, again[first], 0.0)
        found: list[tuple[float, int, int, int]] = []
        sizes = [law.sizes for law in laws]
        for k in range(max(len(one.sd) for one in sizes)):
            sd = np.array([one.sd[min(k, len(one.sd) - 1)] for one in sizes])
            weight = odds + np.array([one.log_weight[min(k, len(one.sd) - 1)] for one in sizes])
            ridge = beside.noise / sd**2
            a, b, c = gram[first, first] + ridge[first], gram[first, second], gram[second, second] + ridge[second]
            det = np.maximum(a * c - b**2, ridge[first] * ridge[second])
            square = (c * dot[first] ** 2 - 2.0 * b * dot[first] * dot[second] + a * dot[second] ** 2) / det
            price = 0.5 * (np.log(det) - np.log(ridge[first] * ridge[second]))
            gain = beside.student(square) - price + weight[first] + weight[second] + alike
            best = np.argpartition(-gain, most)[:most] if len(gain) > most else range(len(gain))
            found += [(float(gain[i]), int(first[i]), int(second[i]), k) for i in best]
        best_size: dict[tuple[int, int], tuple[float, int]] = {}
        for gain, i, j, k in sorted(found, reverse=True):
            best_size.setdefault((i, j), (gain, k))
        ranked = list(best_size.items())[:most]
        return [(_alone(laws[i], k, gain), _alone(laws[j], k, gain)) for (i, j), (gain, k) in ranked]

    @cached_property
    def plain(self) -> tuple[list[Law], Array]:
        """Laws of one shape and one amplitude, and their mapped signatures ``(m, n)``."""
        laws = [law for table in self.tables for law in table.laws if law.atoms == law.dimension == 1]
        laws = [law for law in laws if law.named and not law.positive and len(law.sizes.sd) > 1]
        columns = np.array([law.columns(0)[0] for law in laws]).reshape(len(laws), self._of_residual.mapped.shape[1])
        return laws, self.metric(columns)

    def beside(self, vectors: Sequence[Vectors]) -> HypothesisResidual:
        """What a hypothesis leaves for further candidates; ``vectors``: the residual and its terms, mapped."""
        sd = np.concatenate([one.sd for one in vectors])
        mapped = np.vstack([one.mapped for one in vectors])
        gram = sd[:, None] * (mapped @ mapped.T) * sd
        value, axes = np.linalg.eigh(gram[1:, 1:])
        inside = 1.0 + np.maximum(value, 0.0)
        amplitudes = axes @ ((axes.T @ gram[1:, 0]) / inside)
        seen = value > UNLOST * inside
        turn = np.zeros((len(sd), 1 + int(seen.sum())))
        turn[0, 0], turn[1:, 0] = 1.0, -sd[1:] * amplitudes
        turn[1:, 1:] = sd[1:, None] * axes[:, seen] / np.sqrt(inside[seen])
        total = float(gram[0, 0] - gram[0, 1:] @ amplitudes)
        return HypothesisResidual(turn, max(total, self.least), self.metric.dof)


def _kinds(hypothesis: Hypothesis) -> set[str]:
    """Kinds of which another law is likelier where one is; a law of all axes at once is none of these."""
    return {term.candidate.kind for term in hypothesis.terms if term.candidate.again}


def _alone(law: Law, size: int, gain: float) -> Proposal:
    """The look of a law of one shape with one of its sizes."""
    return Proposal(law, gain, float(law.log_weight[0]), 0, float(law.sizes.sd[min(size, len(law.sizes.sd) - 1)]))


class Screening:
    """Looks of all candidates, with a metric for every model of the scatter that hypotheses have.

    ``metrics``: those that another one made of the same residuals.
    """

    def __init__(self, problem: Problem, metrics: dict[tuple[object, ...], Metric] | None = None) -> None:
        self.problem, self.metrics = problem, {} if metrics is None else metrics
        self.patterns = list(grouped([one for one in problem.candidates if isinstance(one, Law)]))
        self.kernels = Kernels([one for one in problem.candidates if isinstance(one, GaussianProcess)])
        self._by_metric: dict[tuple[object, ...], MetricScreening] = {}
        self._looks: dict[tuple[object, ...], tuple[int, list[Proposal]]] = {}

    def admit(self, laws: Sequence[Law]) -> None:
        """Further laws; what was computed of the others stays."""
        self.patterns += grouped(laws)

    def __call__(self, hypothesis: Hypothesis, noise_models: NoiseModels) -> list[Proposal]:
        """All candidates for addition to a hypothesis, the best first; computed once."""
        key = (frozenset(term.key for term in hypothesis.terms), hypothesis.noise.key)
        known, proposals = self._looks.get(key, (0, []))
        looker = self.metric_screening(hypothesis, noise_models)
        if not proposals or known < len(looker.tables):
            proposals = sorted([*proposals, *looker.proposals(hypothesis, known)], key=lambda proposal: -proposal.gain)
            self._looks[key] = len(looker.tables), proposals
        return proposals

    def pairs(
        self, hypothesis: Hypothesis, noise_models: NoiseModels, most: int, without: frozenset[str]
    ) -> list[tuple[Proposal, Proposal]]:
        """The most probable pairs of laws of one shape and one amplitude, without those of the given labels."""
        return self.metric_screening(hypothesis, noise_models).pairs(hypothesis, most, without)

    def metric_screening(self, hypothesis: Hypothesis, noise_models: NoiseModels) -> MetricScreening:
        """The looks with the metric of a hypothesis, made once for all of nearly the same scatter."""
        sigma_um = (
            hypothesis.sigma_um if hypothesis.noise.correlated else min(hypothesis.sigma_um, self.problem.within_um)
        )
        steps = round(float(np.log(sigma_um / self.problem.within_um)) / LIKE_SIGMA)
        key = (*hypothesis.noise.approximate_key, steps)
        if key not in self.metrics:
            self.metrics[key] = Metric(self.problem, hypothesis.noise, noise_models, sigma_um)
        if key not in self._by_metric:
            self._by_metric[key] = MetricScreening(self.problem, self.metrics[key], self.kernels)
        if len(self._by_metric[key].patterns) < len(self.patterns):
            self._by_metric[key].admit(self.patterns)
        return self._by_metric[key]

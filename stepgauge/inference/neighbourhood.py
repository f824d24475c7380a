"""The hypotheses that are averaged: the probable ones, and every one with a term more, less or other than these.

Hypotheses differ by the labels of their terms and by the model of the noise; shapes and sizes are summed. The most
probable ones that a search found are *expanded*, one after the other, until none with more than a small probability
(:data:`EXPANDED`) is left: its neighbours are all hypotheses with one term more (any candidate), less, or other; of the
best one also those with two other laws in place of two. Those that are probable are computed, all others count as they
are rated (:mod:`screening`), on the scale of those that were computed. A neighbour has the mixture of noise models that
was computed for its head. What a search happened to visit beyond that does not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.moves import MOST_TERMS
from stepgauge.inference.noise_models import NoiseModel
from stepgauge.inference.problem import Candidate, Law, Term, renumbered
from stepgauge.inference.proposal import Proposal
from stepgauge.inference.search import Search

Array = NDArray[np.float64]
EXPANDED, MOST_EXPANDED = (0.002, 0.01), (300, 24)
"""Probability from which a hypothesis is expanded, and how many are at most: of a small problem, and of a large one."""
SMALL = 1e6
"""Numbers in all signatures of a problem up to which it is small."""
COMPUTED, NOT_FAR = (12.0, 4.0), 8.0
"""Neighbours that are rated less probable than the best hypothesis by more than the first are not computed, nats, of a
small problem and of a large one: two that nearly cancel are rated at the size that the first has alone, and may be ten
nats better. The second: up to which the noise of one with a term less is chosen anew."""
MOST_PAIRS = 12
"""Pairs of laws that are computed in place of two."""
NEGLIGIBLE = 20.0
"""Neighbours that are rated less probable than the best hypothesis by more than this do not count, nats."""
PROBABLE_SHAPE, MOST_SHAPES = 7.0, 64
"""Shapes on a grid that are less probable than the best one by more than this are not summed, nats, where those of all
terms have more than so many combinations; nor are more combinations than these."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Models of the noise with their log posteriors over that of the one they are computed for."""

    models: tuple[tuple[NoiseModel, float], ...]

    @cached_property
    def log_sum(self) -> float:
        """Logarithm of the sum of all over the one."""
        return float(special.logsumexp([log for _, log in self.models]))

    def share(self, has: Callable[[NoiseModel], bool]) -> float:
        """Probability of the models that have a property."""
        return float(sum(np.exp(log - self.log_sum) for noise, log in self.models if has(noise)))


@dataclass(frozen=True)
class WeightedHypothesis:
    """The candidates of a hypothesis, its models of the noise, and its log posterior over all of these."""

    candidates: tuple[Candidate, ...]
    mixture: Mixture
    log_posterior: float

    @cached_property
    def labels(self) -> frozenset[str]:
        """Labels of the candidates."""
        return frozenset(one.label for one in self.candidates)


@dataclass(frozen=True)
class _Entry:
    """One set of terms: ``log_posterior`` with its most probable noise; ``hypothesis``: None where it is rated only.

    ``shapes``: what the log posterior rises by if the shapes on the grids of its terms are summed one by one.
    """

    candidates: tuple[Candidate, ...]
    log_posterior: float
    mixture: Mixture
    base: Hypothesis
    proposal: Proposal | None = None
    hypothesis: Hypothesis | None = None
    expanded: bool = False
    neighbour: bool = False
    shapes: float = 0.0

    @property
    def total(self) -> float:
        """Log posterior, all shapes and models of the noise summed."""
        return self.log_posterior + self.shapes + self.mixture.log_sum


class Neighbourhood:
    """The neighbourhood of what a search found."""

    def __init__(self, search: Search, best: Hypothesis) -> None:
        self.search, self.best = search, best
        self.entries: dict[frozenset[str], _Entry] = {}
        self.noises: dict[tuple[object, ...], NoiseModel] = {}
        for found in search.evidence.best_by_labels.values():
            self._enter(_computed(found))
        self._enter(_computed(best))
        for one in self._two_others():
            self._enter(replace(_computed(one), neighbour=True))
        numbers = len(search.problem) * sum(one.atoms for one in search.problem.candidates)
        large = numbers > SMALL
        self.least, most, self.computed = EXPANDED[large], MOST_EXPANDED[large], COMPUTED[large]
        for _ in range(most):
            labels = self._next()
            if labels is None:
                break
            self._expand(labels)
        self.entries = {labels: one for labels, one in self.entries.items() if one.neighbour or one.expanded}

    def weighted(self) -> list[WeightedHypothesis]:
        """All of them, one for each set of terms."""
        return [WeightedHypothesis(one.candidates, one.mixture, one.total) for one in self.entries.values()]

    @property
    def log_posterior(self) -> dict[frozenset[str], float]:
        """Log posterior of each set of terms, all models of the noise summed."""
        return {labels: one.total for labels, one in self.entries.items()}

    def _enter(self, entry: _Entry) -> None:
        """Take the better known of two of the same terms, or both with all their models of the noise."""
        labels = frozenset(one.label for one in entry.candidates)
        old = self.entries.get(labels)
        if old is None:
            self.entries[labels] = entry
            return
        neighbour = entry.neighbour or old.neighbour
        shapes = old.shapes if old.neighbour else entry.shapes  # the first head that has it is the most probable
        if old.expanded or entry.hypothesis is None:
            entry = old if old.hypothesis is not None or old.log_posterior >= entry.log_posterior else entry
        elif old.hypothesis is not None:
            entry = _united(old, entry)
        self.entries[labels] = replace(entry, neighbour=neighbour, shapes=shapes)

    def _next(self) -> frozenset[str] | None:
        """The most probable set of terms that is not expanded yet, if it is probable."""
        total = special.logsumexp([one.total for one in self.entries.values()])
        waiting = [labels for labels, one in self.entries.items() if not one.expanded]
        first = max(waiting, key=lambda labels: self.entries[labels].total, default=None)
        least = total + float(np.log(self.least))
        return None if first is None or self.entries[first].total < least else first

    def _expand(self, labels: frozenset[str]) -> None:
        entry = self.entries[labels]
        found = entry.hypothesis
        if found is None:
            assert entry.proposal is not None
            found = self.search.added(entry.base, entry.proposal)
        found = self.search.reshaped(found)
        mixture = self._mixture(found)
        gain, each = self._shapes_gain(found)
        own = _Entry(entry.candidates, found.log_posterior, mixture, found, None, found, shapes=gain)
        self.entries[labels] = replace(own, expanded=True, neighbour=True)
        bases = [found, *(self._without(found, place) for place in range(len(found.terms)))]
        self.noises[found.noise.model] = found.noise
        for base in bases:
            shapes = gain if base is found else sum(each.get(label, 0.0) for label in base.labels)
            if base is not found:
                self._enter(replace(self._fewer(base, mixture), shapes=shapes))
            if len(base.terms) < MOST_TERMS and (base is found or not self._is_more(labels)):
                self._neighbours(base, mixture, shapes)

    def _neighbours(self, base: Hypothesis, mixture: Mixture, shapes: float) -> None:
        """All hypotheses with one term more than a base; ``shapes``: of its terms."""
        top = max(one.log_posterior for one in self.entries.values())
        near, lower, rated = top - self.computed, list[float](), list[tuple[Proposal, float]]()
        for one in self.search.screen(base):
            worth = base.log_posterior + one.gain
            if worth < near - (0.0 if lower else self.computed):
                rated.append((one, worth))
                continue
            found = self.search.added(base, one)
            lower.append(found.log_posterior - worth)
            self._enter(replace(self._neighbour(found, mixture), shapes=shapes))
        less = float(np.median(lower)) if lower else 0.0
        own = tuple(term.candidate for term in base.terms)
        for one, worth in rated:
            if worth + less > top - NEGLIGIBLE:
                more = _Entry((*own, one.candidate), worth + less, mixture, base, one, neighbour=True, shapes=shapes)
                self._enter(more)

    def _without(self, found: Hypothesis, place: int) -> Hypothesis:
        """The hypothesis without a term; a second law of a kind is the first one without that."""
        base = self.search.without(found, place)
        return self.search.evidence(renumbered(base.terms), base.noise, base.sigma_um)

    def _two_others(self) -> Iterator[Hypothesis]:
        """The best hypothesis with two other laws in place of two: pairs may be the same where no single law is."""
        for places in combinations(range(len(self.best.terms)), 2):
            yield from self.search.paired(self.search.without(self.best, *places), self.best.labels, MOST_PAIRS)

    def _is_more(self, labels: frozenset[str]) -> bool:
        """Whether it is one that is expanded with something more: what is other than it is more than what is other."""
        return any(own < labels for own, one in self.entries.items() if one.expanded)

    def _fewer(self, base: Hypothesis, mixture: Mixture) -> _Entry:
        """A neighbour with a term less: noise may stand for that, so that it has its own if it is not far."""
        if base.log_posterior < max(one.log_posterior for one in self.entries.values()) - NOT_FAR:
            return self._neighbour(base, mixture)
        own = self.search.reshaped(base)
        return replace(_computed(own), mixture=self._mixture(own), neighbour=True)

    def _neighbour(self, found: Hypothesis, mixture: Mixture) -> _Entry:
        """A computed neighbour with the mixture of its head, or with a noise of another head that suits it better."""
        own = replace(_computed(found), mixture=mixture, neighbour=True)
        others = (noise for key, noise in self.noises.items() if key != found.noise.model)
        every = (self.search.evidence(found.terms, noise, found.sigma_um) for noise in others)
        best = max((one for one in every if one.current), key=log_posterior, default=found)
        return own if best.log_posterior <= own.log_posterior else _united(own, _computed(best))

    def _mixture(self, head: Hypothesis) -> Mixture:
        """The models of the noise with one property other than that of a hypothesis, each kind and value once."""
        every = {head.noise.model: (head.noise, 0.0)}
        for noise, worth in self.search.noise_proposals.rated(head):
            log = worth - head.log_posterior
            if noise.model not in every or every[noise.model][1] < log:
                every[noise.model] = (noise, log)
        return Mixture(tuple(every.values()))

    def _shapes_gain(self, head: Hypothesis) -> tuple[float, dict[str, float]]:
        """What the log posterior rises by if shapes on the grids of all terms are summed, and of each term alone.

        All combinations are computed where they are few, else the sum of what each term has by itself.
        """
        gridded = [term.candidate.atoms for term in head.terms if term.candidate.named and term.shape is None]
        few = math.prod(gridded) <= MOST_SHAPES
        choices = [self._shapes(head, place, few) for place in range(len(head.terms))]
        each = {}
        for place, (term, own) in enumerate(zip(head.terms, choices, strict=True)):
            if own != [term]:
                alone = [[one] for one in head.terms]
                alone[place] = own
                each[term.candidate.label] = self._summed(head, alone)
        if len(each) > 1 and math.prod(len(one) for one in choices) <= MOST_SHAPES:
            return self._summed(head, choices), each
        return sum(each.values()), each

    def _summed(self, head: Hypothesis, choices: Sequence[Sequence[Term]]) -> float:
        """Log posterior of all combinations of some shapes together, over that of a hypothesis."""
        every = (self.search.evidence.apart(terms, head.noise, head.sigma_um) for terms in product(*choices))
        return float(special.logsumexp([one.log_posterior for one in every])) - head.log_posterior

    def _shapes(self, head: Hypothesis, place: int, every: bool) -> list[Term]:
        """A term with each of its shapes, or the probable ones; as it is where it has one, or is no point of the grid.

        What is improbable beside the present shapes of other terms may be probable beside others of theirs.
        """
        term = head.terms[place]
        law = term.candidate
        if not isinstance(law, Law) or law.atoms == 1 or term.shape is not None:
            return [term]
        near = np.arange(law.atoms)
        if not every:
            rated = self.search.proposal_of(law, self.search.without(head, place)).by_atom
            assert rated is not None
            near = np.flatnonzero(rated > rated.max() - PROBABLE_SHAPE)
        if len(near) > MOST_SHAPES:
            return [term]
        odds = law.log_odds
        return [
            replace(term, atom=int(i), columns=law.columns(int(i)), log_prior=odds + float(law.log_weight[i]))
            for i in near
        ]


def _computed(found: Hypothesis) -> _Entry:
    candidates = tuple(term.candidate for term in found.terms)
    return _Entry(candidates, found.log_posterior, Mixture(((found.noise, 0.0),)), found, None, found)


def _united(one: _Entry, other: _Entry) -> _Entry:
    """The more probable of two computed entries of the same terms, with the models of the noise of both."""
    best = max(one, other, key=lambda entry: entry.log_posterior)
    every: dict[tuple[object, ...], tuple[NoiseModel, float]] = {}
    for entry in (one, other):
        for noise, log in entry.mixture.models:
            log += entry.log_posterior - best.log_posterior
            if noise.model not in every or every[noise.model][1] < log:
                every[noise.model] = noise, log
    return replace(best, mixture=Mixture(tuple(every.values())), neighbour=one.neighbour or other.neighbour)

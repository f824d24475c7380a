"""Changes of a hypothesis by one step: a term more, less, with another shape, in a part of the record; noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.noise_proposals import NoiseProposals
from stepgauge.inference.problem import Candidate, Law, OfSize, Problem, Term
from stepgauge.inference.proposal import Proposal, limit_per_kind
from stepgauge.inference.screening import Screening

Array = NDArray[np.float64]
MOST_TERMS = 8
PROPOSED, PROPOSED_FORMS, PROPOSED_PAIRS = 4, 2, 3
"""Laws, random functions and pairs of laws of one shape and one amplitude that are tried for addition."""
COARSE, PEAKS = 5.0, 4
"""Gain of a fitted shape over that of the grid from which the grid is too coarse, nats; peaks that are tried then."""
HOPELESS = -6.0
"""Gain of a proposal below which a candidate is not tried, nats."""
HALF = 0.5
"""Share of the best gain from which others are tried: shapes fitted between those of the grid may gain much more."""
ROUNDS = 4
SETTLED = 0.5
"""Gain of the log posterior from which a change is one, nats."""


class Moves:
    """All changes of hypotheses of one problem by one step; ``evidence`` holds every one that was computed."""

    def __init__(self, problem: Problem, priors: NoisePriors) -> None:
        self.problem, self.priors = problem, priors
        self.evidence, self.screening = Evidence(problem, priors), Screening(problem)
        self.noise_models = self.evidence.noise_models
        self.noise_proposals = NoiseProposals(self.evidence, problem, priors)
        self.start = self.evidence((), self.noise_models.plain())
        self._added: dict[tuple[object, ...], Hypothesis] = {}
        self._own: dict[str, Screening] = {}
        self._parts: dict[str, Law] = {}

    def screen(self, hypothesis: Hypothesis) -> list[Proposal]:
        """All candidates that a hypothesis may have in addition, rated, the best first."""
        kinds = {term.candidate.kind for term in hypothesis.terms}
        every = self.screening(hypothesis, self.noise_models)
        every = [one for one in every if one.candidate.label not in hypothesis.labels]
        return [one for one in every if not (one.candidate.once and one.candidate.kind in kinds)]

    def proposed(
        self, hypothesis: Hypothesis, forbidden: frozenset[str] = frozenset(), share: float = HALF
    ) -> Iterator[Proposal]:
        """Those worth trying: the best laws, at most two of a kind, and the best random functions.

        ``share``: of the best gain, that others must have.
        """
        every = [one for one in self.screen(hypothesis) if one.candidate.label not in forbidden]
        least = max(HOPELESS, share * every[0].gain + HOPELESS) if every else 0.0
        every = [one for one in every if one.gain > least]
        yield from islice(limit_per_kind(one for one in every if one.candidate.named), PROPOSED)
        yield from islice(limit_per_kind(one for one in every if not one.candidate.named), PROPOSED_FORMS)

    def paired(
        self, hypothesis: Hypothesis, forbidden: frozenset[str] = frozenset(), most: int = PROPOSED_PAIRS
    ) -> Iterator[Hypothesis]:
        """The hypothesis with two more laws that explain together what neither does alone."""
        without = forbidden | hypothesis.labels
        for one, other in self.screening.pairs(hypothesis, self.noise_models, most, without):
            yield self._with(self._with(hypothesis, one.term()), other.term())

    def added(self, hypothesis: Hypothesis, proposal: Proposal) -> Hypothesis:
        """The hypothesis with one term more; with a shape on the grid or near it, whichever is more probable."""
        key = (id(hypothesis), proposal.candidate.label, proposal.atom, proposal.sd)
        if key not in self._added:
            self._added[key] = self._shaped(hypothesis, proposal)
        return self._added[key]

    def without(self, hypothesis: Hypothesis, *places: int) -> Hypothesis:
        """The hypothesis without some of its terms, by index."""
        terms = tuple(term for i, term in enumerate(hypothesis.terms) if i not in places)
        return self.evidence(terms, hypothesis.noise, hypothesis.sigma_um)

    def reshaped(self, hypothesis: Hypothesis) -> Hypothesis:
        """The most probable model of the noise for the same terms, changing one property after the other."""
        for _ in range(ROUNDS):
            best = self._current(max(self.noise_proposals(hypothesis), key=log_posterior, default=hypothesis))
            if best.log_posterior <= hypothesis.log_posterior + SETTLED:
                return hypothesis  # every further model needs all products of all signatures anew
            hypothesis = best
        return hypothesis

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        """The shape of each term fitted again beside the others."""
        for candidate in [term.candidate for term in hypothesis.terms if term.candidate.atoms > 1]:
            hypothesis = max(hypothesis, self._anew(hypothesis, candidate), key=log_posterior)
        return hypothesis

    def part_moves(self, best: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis with a law in a part of the record in place of a term: the same law, or one of those near.

        Over the whole record an alias may be better than the shape that holds in a part, so that several are tried.
        """
        for place, term in enumerate(best.terms):
            base = self.without(best, place)
            near = [(term.candidate, term.atom)]
            for one in self.proposed(base, share=0.0):
                if one.candidate is not term.candidate:
                    near += [(one.candidate, atom) for atom in (one.atom, *one.peaks(PEAKS))]
            asked = [law for one, atom in near if isinstance(one, Law) for law in self._asked(one, atom)]
            yield from self._part_hypotheses(base, list(dict.fromkeys(asked)))

    def _part_hypotheses(self, base: Hypothesis, asked: Sequence[Law]) -> Iterator[Hypothesis]:
        """A hypothesis with one of some laws more, the most probable ones, of each label that with the best shape."""
        if not asked:
            return
        proposals: dict[str, Proposal] = {}
        asked_of = Screening(replace(self.problem, candidates=asked), self.screening.metrics)
        for one in asked_of(base, self.noise_models):
            proposals.setdefault(one.candidate.label, one)
        for one in islice(proposals.values(), PROPOSED):
            if one.gain > HOPELESS and isinstance(one.candidate, Law):
                self._parts[one.candidate.label] = one.candidate
                yield self._with(base, one.term())

    def admit(self, candidates: Iterable[Candidate]) -> None:
        """Candidates that are not among those of the problem yet."""
        known = {one.label for one in self.problem.candidates}
        new = {one.label: one for one in candidates if one.label not in known}
        self.problem = replace(self.problem, candidates=(*self.problem.candidates, *new.values()))
        self.screening.admit([one for one in new.values() if isinstance(one, Law)])

    def _asked(self, law: Law, atom: int) -> Sequence[Law]:
        """The law in parts of the record, those apart that are candidates already."""
        if self.problem.in_part is None or not law.named:
            return ()
        known = {one.label for one in self.problem.candidates}
        asked = [one for one in self.problem.in_part(law, atom) if one.label not in known]
        return [self._parts.get(one.label, one) for one in asked]  # one law, from whichever place it is asked

    def _with(self, hypothesis: Hypothesis, term: Term) -> Hypothesis:
        term = replace(term, correlated=hypothesis.noise.correlated and term.candidate.atoms > 1)
        return self.evidence((*hypothesis.terms, term), hypothesis.noise, hypothesis.sigma_um)

    def _shaped(self, hypothesis: Hypothesis, proposal: Proposal) -> Hypothesis:
        grid = self._with(hypothesis, proposal.term())
        law = proposal.candidate
        if isinstance(law, Law) and law.of_size is not None:
            return self._fit_size(hypothesis, proposal, law.of_size)
        best = max(grid, self._between(hypothesis, proposal, proposal.atom, grid), key=log_posterior)
        if best.log_posterior > grid.log_posterior + COARSE:
            others = (self._between(hypothesis, proposal, atom, grid) for atom in proposal.peaks(PEAKS))
            best = max((best, *others), key=log_posterior)
        return best

    def _between(self, hypothesis: Hypothesis, proposal: Proposal, atom: int, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a shape fitted near a point of the grid; that of the grid if the fit fails."""
        law, found, beside = proposal.candidate, grid, hypothesis
        if not isinstance(law, Law) or law.refine is None:
            return grid
        for _ in range(ROUNDS):  # other terms are as large as without the law at first, and then as beside it
            refined = law.refine(atom, self._unexplained(hypothesis, beside))
            if refined is None:
                return found
            log_prior = law.log_odds + proposal.volume_of(atom) + refined.gain
            own = Term(law, atom, refined.columns, proposal.sd, log_prior, refined.shape)
            last, found = found, max(found, self._narrowed(hypothesis, own, grid), key=log_posterior)
            if not hypothesis.terms or found.log_posterior <= last.log_posterior + SETTLED:
                return found
            beside = found
        return found

    def _fit_size(self, hypothesis: Hypothesis, proposal: Proposal, of_size: OfSize) -> Hypothesis:
        """The hypothesis with a law that is not linear in its size, with the signature of the size that fits best."""
        grid, beside = self._with(hypothesis, proposal.term()), [term.nuisance for term in hypothesis.terms]
        metric = Metric(self.problem, hypothesis.noise, self.noise_models, hypothesis.sigma_um, beside)
        exact = of_size(proposal.atom, self.problem.residual_um, metric)
        if exact is None:
            return grid
        log_prior = proposal.candidate.log_odds
        own = Term(proposal.candidate, proposal.atom, exact.columns, proposal.sd, log_prior, exact.shape)
        return max(grid, self._with(hypothesis, own), key=log_posterior)

    def _unexplained(self, hypothesis: Hypothesis, beside: Hypothesis) -> Array:
        """Residuals without the terms of a hypothesis, as large as they are in another one that begins with them.

        What nuisance parameters took of them is left in.
        """
        if not hypothesis.terms:
            return self.problem.residual_um
        columns = np.vstack([term.columns for term in hypothesis.terms])
        amplitudes = beside.mean[beside.count :][: len(columns)]
        return np.asarray(self.problem.residual_um - amplitudes @ columns)

    def _narrowed(self, hypothesis: Hypothesis, term: Term, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a fitted shape, whose peak may be narrower than the step of the grid.

        For a peak that is higher by d at a distance x from the nearest point, the standard deviation is x / sqrt(2 d);
        on average x is a quarter of a step.
        """
        found = self._with(hypothesis, term)
        higher = found.log_posterior - grid.log_posterior
        narrow = 0.5 * float(np.log(2.0 * max(higher, 1e-9))) - float(np.log(0.25 * np.sqrt(2.0 * np.pi)))
        return self.evidence.narrowed(found, term.candidate, narrow) if narrow > 0.0 else found

    def _current(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis with volumes of shapes that hold for its noise."""
        if hypothesis.current:
            return hypothesis
        for candidate in [term.candidate for term in hypothesis.terms if term.correlated]:
            hypothesis = self._anew(hypothesis, candidate)
        return hypothesis

    def _anew(self, hypothesis: Hypothesis, candidate: Candidate) -> Hypothesis:
        """The hypothesis with the shape and size of one term as they are found beside the others."""
        place = hypothesis.index(candidate)
        base = self.without(hypothesis, place)
        return self.added(base, self.proposal_of(candidate, base))

    def proposal_of(self, candidate: Candidate, base: Hypothesis) -> Proposal:
        """One candidate rated for addition, which it may be or not."""
        if candidate.label not in self._own:
            alone = replace(self.problem, candidates=[candidate])
            self._own[candidate.label] = Screening(alone, self.screening.metrics)
        (own,) = self._own[candidate.label](base, self.noise_models)
        return own

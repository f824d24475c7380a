"""The search: forward with a beam, models of the scatter, exchanges until no hypothesis is more probable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.amplitudes import needed_terms
from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.noise_models import NORMAL
from stepgauge.inference.noise_proposals import FARTHER, NoiseProposals
from stepgauge.inference.priors import NoisePriors
from stepgauge.inference.problem import Candidate, Law, Problem, Term
from stepgauge.inference.proposal import Proposal, is_plain, limit_per_kind
from stepgauge.inference.screening import Screening

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """A step of the search: the change, its term, and the gain in the log posterior."""

    action: str
    label: str
    gain: float


Progress = Callable[[Sequence[str]], None]
"""Told the labels of the terms whenever a more probable hypothesis is found."""

BEAM = 2
MOST_TERMS = 8
PROPOSED, PROPOSED_FORMS = 4, 2
"""Laws and forms that are tried for addition to a hypothesis."""
PROPOSED_PAIRS, MOST_SHARED = 3, 6
"""Pairs of laws of one shape and one amplitude that are; laws that may share what one of many shapes explains."""
COARSE, PEAKS = 5.0, 4
"""Gain of a fitted shape over that of the grid from which the grid is too coarse, nats; peaks that are tried then."""
HOPELESS = -6.0
"""Gain of a look below which a candidate is not tried, nats."""
NEEDED = 25.0
"""Loss of the log posterior from which a hypothesis with fewer terms, or with others, is not gone on with, nats."""
MOST_PLAIN, THREE_AXES, LEAST = 24, 3, 3
"""Laws of one shape that are tried all at once, and of a kind; terms of which the one that is needed least may go."""
ROUNDS = 4
SETTLED = 0.5


class Search:
    """The search of one problem; ``evidence.visited`` holds every hypothesis that it computed."""

    def __init__(self, problem: Problem, priors: NoisePriors, progress: Progress | None = None) -> None:
        self.problem, self.priors, self.progress = problem, priors, progress
        self.evidence, self.screening = Evidence(problem, priors), Screening(problem)
        self.noise_models, self._noise_proposals = (
            self.evidence.noise_models,
            NoiseProposals(self.evidence, problem, priors),
        )
        self.start = self.evidence((), self.noise_models.plain())
        self.trail: list[Step] = []
        self._added: dict[tuple[object, ...], Hypothesis] = {}
        self._parts: dict[str, Law] = {}

    def run(self) -> Hypothesis:
        """The best hypothesis found."""
        best = beam = laws = self.reshaped(self.start)
        heads = [self.start] if beam is self.start else [self.start, beam]
        for depth in range(MOST_TERMS):
            heads = self._forward(heads)
            if depth and heads and heads[0].log_posterior > best.log_posterior:
                heads = sorted([*heads, self._of_plain(heads[0])], key=log_posterior, reverse=True)
            if not heads or heads[0].log_posterior < best.log_posterior - (FARTHER if depth < 2 else 0.0):
                # a form may stand for several laws that are more probable together, each of them less
                heads = [one for one in heads if one.named and one.log_posterior > laws.log_posterior + FARTHER]
            if not heads:
                break
            best = self._better(best, heads[0])
            heads = [one for one in heads if len(one.terms) < MOST_TERMS]
            laws = max((one for one in heads if one.named), key=log_posterior, default=laws)
        found = self._of_a_kind(self._one_by_one(self._in_parts(self._exchanged(best))))
        return self._independent(found) if found.noise.correlated else found

    def _one_by_one(self, best: Hypothesis) -> Hypothesis:
        """The best also from single laws in place of a combination of many."""
        for term in [one for one in best.terms if one.candidate.combined]:
            other = self._of_plain(self.without(best, best.index(term.candidate)))
            if other.log_posterior > best.log_posterior - NEEDED:
                best = self._from_another(best, self.polished(other))
        return best

    def _of_a_kind(self, best: Hypothesis) -> Hypothesis:
        """The best also from all laws of a kind that axes, or placements, have together, in place of one or two laws.

        Each of them alone may be worse than the first one of another kind, which stands for a part of several.
        """
        plain = [i for i, term in enumerate(best.terms) if is_plain(term.candidate)]
        for places in (*((i,) for i in plain), *combinations(plain, 2)):
            base, kinds = self.without(best, *places), dict[str, list[Proposal]]()
            for proposal in self.screen(base):
                if is_plain(proposal.candidate) and proposal.candidate.again:
                    kinds.setdefault(proposal.candidate.kind, []).append(proposal)
            for proposals in (some for some in kinds.values() if len(some) > 1):
                terms = (*base.terms, *(proposal.term() for proposal in proposals))
                every = self.evidence(terms[:MOST_TERMS], best.noise, best.sigma_um)
                if every.log_posterior > best.log_posterior - NEEDED:
                    best = self._better(best, self._needed(every))
        return best

    def _of_plain(self, base: Hypothesis) -> Hypothesis:
        """A hypothesis with those that are needed of all likely laws of one shape, and of any sign, besides."""
        plain = (
            proposal
            for proposal in self.screen(base)
            if proposal.gain > HOPELESS and is_plain(proposal.candidate, signed=True)
        )
        proposals = islice(limit_per_kind(plain, THREE_AXES), MOST_PLAIN)
        every = self.evidence((*base.terms, *(proposal.term() for proposal in proposals)), base.noise, base.sigma_um)
        return self._needed(self.evidence(needed_terms(every, MOST_TERMS), base.noise, base.sigma_um))

    def _needed(self, hypothesis: Hypothesis) -> Hypothesis:
        """Without the terms that matter least, one after the other, until all are needed."""
        while len(hypothesis.terms) > 1:
            least = sorted(range(len(hypothesis.terms)), key=hypothesis.significance)[:LEAST]
            fewer = max((self.without(hypothesis, place) for place in least), key=log_posterior)
            if fewer.log_posterior <= hypothesis.log_posterior and len(hypothesis.terms) <= MOST_TERMS:
                return hypothesis
            hypothesis = fewer
        return hypothesis

    def _independent(self, best: Hypothesis) -> Hypothesis:
        """The best also from the best terms with independent scatter, for which correlated scatter may stand."""
        every = (one for one in self.evidence.visited.values() if one.terms and not one.noise.correlated)
        first = max(every, key=log_posterior, default=None)
        return best if first is None else self._from_another(best, self._current(first))

    def _from_another(self, best: Hypothesis, start: Hypothesis) -> Hypothesis:
        """The better one of the best and what another start leads to; its own steps are not recorded."""
        trail = list(self.trail)
        other = self._in_parts(self._exchanged(start))
        self.trail = trail
        return self._better(best, other)

    def _better(self, best: Hypothesis, other: Hypothesis) -> Hypothesis:
        """The more probable one; the change is recorded."""
        if other.log_posterior <= best.log_posterior:
            return best
        gain = other.log_posterior - best.log_posterior
        come, gone = other.labels - best.labels, best.labels - other.labels
        words = "exchanged" if come and gone else "added" if come else "dropped" if gone else "scatter"
        what = ", ".join(sorted(come)) or ", ".join(sorted(gone)) or "model of the scatter or shapes"
        self.trail.append(Step(words, f"{', '.join(sorted(gone))} for {what}" if come and gone else what, gain))
        if self.progress is not None:
            self.progress([term.candidate.label for term in other.terms])
        return other

    def screen(self, hypothesis: Hypothesis) -> list[Proposal]:
        """Looks of all candidates that a hypothesis may have in addition, the best first."""
        kinds = {term.candidate.kind for term in hypothesis.terms}
        proposals = (
            proposal
            for proposal in self.screening(hypothesis, self.noise_models)
            if proposal.candidate.label not in hypothesis.labels
        )
        return [
            proposal for proposal in proposals if not (proposal.candidate.once and proposal.candidate.kind in kinds)
        ]

    def added(self, hypothesis: Hypothesis, proposal: Proposal) -> Hypothesis:
        """The hypothesis with one term more; with a shape on the grid or near it, whichever is more probable."""
        key = (id(hypothesis), proposal.candidate.label, proposal.atom, proposal.sd)
        if key not in self._added:
            self._added[key] = self._shaped(hypothesis, proposal)
        return self._added[key]

    def _shaped(self, hypothesis: Hypothesis, proposal: Proposal) -> Hypothesis:
        grid = self._with(hypothesis, proposal.term())
        best = max(grid, self._between(hypothesis, proposal, proposal.atom, grid), key=log_posterior)
        if best.log_posterior > grid.log_posterior + COARSE:
            others = (self._between(hypothesis, proposal, atom, grid) for atom in proposal.peaks(PEAKS))
            best = max((best, *others), key=log_posterior)
        return best

    def _between(self, hypothesis: Hypothesis, proposal: Proposal, atom: int, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a shape fitted near a point of the grid; that of the grid if the fit fails."""
        law = proposal.candidate
        if not isinstance(law, Law) or law.refine is None:
            return grid
        refined = law.refine(atom, self._unexplained(hypothesis))
        if refined is None:
            return grid
        log_prior = law.log_odds + proposal.volume_of(atom) + refined.gain
        return self._narrowed(hypothesis, Term(law, atom, refined.columns, proposal.sd, log_prior, refined.shape), grid)

    def _unexplained(self, hypothesis: Hypothesis) -> Array:
        """Residuals without the terms of a hypothesis; what nuisance parameters took of them is left in."""
        if not hypothesis.terms:
            return self.problem.residual_um
        return self.problem.residual_um - hypothesis.mean[hypothesis.count :] @ np.vstack(
            [term.columns for term in hypothesis.terms]
        )

    def _narrowed(self, hypothesis: Hypothesis, term: Term, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a fitted shape, whose peak may be narrower than the step of the grid.

        For a peak that is higher by d at a distance x from the nearest point, the standard deviation is x / sqrt(2 d);
        on average x is a quarter of a step.
        """
        found = self._with(hypothesis, term)
        higher = found.log_posterior - grid.log_posterior
        narrow = 0.5 * float(np.log(2.0 * max(higher, 1e-9))) - float(np.log(0.25 * np.sqrt(2.0 * np.pi)))
        return self.evidence.narrowed(found, term.candidate, narrow) if narrow > 0.0 else found

    def _with(self, hypothesis: Hypothesis, term: Term) -> Hypothesis:
        term = replace(term, correlated=hypothesis.noise.correlated and term.candidate.atoms > 1)
        return self.evidence((*hypothesis.terms, term), hypothesis.noise, hypothesis.sigma_um)

    def _forward(self, heads: list[Hypothesis]) -> list[Hypothesis]:
        """The most probable hypotheses with one term more: of laws alone, and of all."""
        weeded = [self._weeded(hypothesis, head.labels) for head in heads for hypothesis in self._with_one_more(head)]
        ranked = sorted({id(hypothesis): hypothesis for hypothesis in weeded}.values(), key=log_posterior, reverse=True)
        laws = [hypothesis for hypothesis in ranked if hypothesis.named][:BEAM]
        chosen = laws + [hypothesis for hypothesis in ranked[:1] if hypothesis not in laws]
        shaped = {id(hypothesis): hypothesis for hypothesis in map(self.reshaped, chosen)}
        return sorted(shaped.values(), key=log_posterior, reverse=True)

    def _with_one_more(self, head: Hypothesis) -> Iterator[Hypothesis]:
        yield from (self.added(head, proposal) for proposal in self._proposed(head))
        yield from self._paired(head)

    def _proposed(
        self, hypothesis: Hypothesis, most: int = PROPOSED, without: frozenset[str] = frozenset()
    ) -> Iterator[Proposal]:
        """Looks worth trying: the best laws, at most two of a kind, and the best forms."""
        proposals = [
            one for one in self.screen(hypothesis) if one.gain > HOPELESS and one.candidate.label not in without
        ]
        yield from islice(limit_per_kind(proposal for proposal in proposals if proposal.candidate.named), most)
        yield from islice(
            limit_per_kind(proposal for proposal in proposals if not proposal.candidate.named), PROPOSED_FORMS
        )

    def _paired(self, hypothesis: Hypothesis, without: frozenset[str] = frozenset()) -> Iterator[Hypothesis]:
        """The hypothesis with two more laws that explain together what neither does alone."""
        for one, other in self.screening.pairs(
            hypothesis, self.noise_models, PROPOSED_PAIRS, without | hypothesis.labels
        ):
            yield self._with(self._with(hypothesis, one.term()), other.term())

    def _weeded(self, hypothesis: Hypothesis, old: frozenset[str]) -> Hypothesis:
        """The hypothesis without ``old`` terms whose removal makes it more probable; what is new stays."""
        for place in (i for i, term in enumerate(hypothesis.terms) if term.candidate.label in old):
            if self.evidence.bound_without(hypothesis, place) < hypothesis.log_posterior - NEEDED:
                continue
            fewer = self.without(hypothesis, place)
            if fewer.log_posterior > hypothesis.log_posterior:
                return self._weeded(fewer, old)
        return hypothesis

    def without(self, hypothesis: Hypothesis, *places: int) -> Hypothesis:
        """The hypothesis without some of its terms, by index."""
        terms = tuple(term for i, term in enumerate(hypothesis.terms) if i not in places)
        return self.evidence(terms, hypothesis.noise, hypothesis.sigma_um)

    def reshaped(self, hypothesis: Hypothesis) -> Hypothesis:
        """The most probable model of the scatter for the same terms, changing one property after the other."""
        for _ in range(ROUNDS):
            best = self._current(max(self._noise_proposals(hypothesis), key=log_posterior, default=hypothesis))
            if best.log_posterior <= hypothesis.log_posterior + SETTLED:
                return max(hypothesis, best, key=log_posterior)
            hypothesis = best
        return hypothesis

    def _current(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis with volumes of shapes that hold for its scatter."""
        if hypothesis.current:
            return hypothesis
        for candidate in [term.candidate for term in hypothesis.terms if term.correlated]:
            hypothesis = self._anew(hypothesis, candidate)
        return hypothesis

    def _anew(self, hypothesis: Hypothesis, candidate: Candidate) -> Hypothesis:
        """The hypothesis with the shape and size of one term as they are found beside the others."""
        place = hypothesis.index(candidate)
        base = self.without(hypothesis, place)
        own = next((proposal for proposal in self.screen(base) if proposal.candidate is candidate), None)
        return self._with(base, hypothesis.terms[place]) if own is None else self.added(base, own)

    def _exchanged(self, best: Hypothesis) -> Hypothesis:
        """Exchanges of one term for one, one for two, two for one, until nothing improves; two at once if one fails."""
        for _ in range(ROUNDS):
            old = best
            for hypothesis in self._plainer(old):
                best = max(
                    (best, *(self._instead(hypothesis, place) for place in range(len(old.terms)))), key=log_posterior
                )
                if len(old.terms) < MOST_TERMS:
                    best = max(
                        (best, *(self.added(hypothesis, proposal) for proposal in self._proposed(hypothesis, 2))),
                        key=log_posterior,
                    )
            if best.log_posterior <= old.log_posterior + SETTLED:
                pairs = combinations(range(len(old.terms)), 2)
                best = max((best, *(one for places in pairs for one in self._ones(old, *places))), key=log_posterior)
                best = max((best, *self._shared(old)), key=log_posterior)
            best = self._better(old, self.polished(self.reshaped(best)))
            if best.log_posterior <= old.log_posterior + SETTLED:
                break
        return best

    def _shared(self, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis with a law of one shape that stands for a part of what a law of many shapes explains.

        At the shape that explains most alone the other law adds nothing: the shape is found anew beside it. Forms are
        left out, since they may stand for what the shape of the law alone does not explain.
        """
        forms = [i for i, term in enumerate(hypothesis.terms) if not term.candidate.named]
        for place, term in enumerate(hypothesis.terms):
            if not isinstance(term.candidate, Law) or place in forms or term.candidate.atoms == 1:
                continue
            base, own = (
                self.without(hypothesis, place, *forms),
                Screening(replace(self.problem, candidates=[term.candidate])),
            )
            plain = (one for one in self.screen(base) if one.gain > 0.0 and is_plain(one.candidate))
            for proposal in islice(limit_per_kind(plain), MOST_SHARED if len(base.terms) < MOST_TERMS - 1 else 0):
                one = self._with(base, proposal.term())
                found = (self.added(one, shape) for shape in own(one, self.noise_models))
                yield from (self._weeded(both, base.labels) for both in found)

    def _in_parts(self, best: Hypothesis) -> Hypothesis:
        """The same with laws that hold in a part of the record only, as long as these are more probable.

        The best ones join the candidates, so that they are rivals of each other like any.
        """
        for _ in range(ROUNDS):
            every = sorted(self._with_parts(best), key=log_posterior, reverse=True)
            first = self.reshaped(every[0]) if every else best
            if first.log_posterior <= best.log_posterior + SETTLED:
                break
            near = (one for one in every if one.log_posterior > every[0].log_posterior - FARTHER)
            self._admit(term.candidate for one in near for term in one.terms)
            best = self._exchanged(self._better(best, first))
        return best

    def _with_parts(self, best: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis with a law in a part of the record in place of a term: the same law, or one of those near."""
        for place, term in enumerate(best.terms):
            base = self.without(best, place)
            near = [(term.candidate, term.atom)]
            near += [(one.candidate, one.atom) for one in self._proposed(base) if one.candidate is not term.candidate]
            asked = [law for one, atom in near if isinstance(one, Law) for law in self._asked(one, atom)]
            if asked:
                proposals = Screening(replace(self.problem, candidates=asked))(base, self.noise_models)
                yield from (
                    self._with(base, proposal.term()) for proposal in proposals[:PROPOSED] if proposal.gain > HOPELESS
                )

    def _asked(self, law: Law, atom: int) -> Sequence[Law]:
        """The law in parts of the record, those apart that are candidates already."""
        if self.problem.in_part is None or not law.named:
            return ()
        known = {one.label for one in self.problem.candidates}
        asked = [one for one in self.problem.in_part(law, atom) if one.label not in known]
        return [self._parts.setdefault(one.label, one) for one in asked]  # one law, from whichever place it is asked

    def _admit(self, candidates: Iterable[Candidate]) -> None:
        """Candidates that are not among those of the problem yet."""
        known = {one.label for one in self.problem.candidates}
        new = {one.label: one for one in candidates if one.label not in known}
        self.problem = replace(self.problem, candidates=(*self.problem.candidates, *new.values()))
        self.screening.admit([one for one in new.values() if isinstance(one, Law)])

    def _plainer(self, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis, and the same without what its scatter may have in place of a term that is missing.

        Rows are weighted by the residuals of its own terms, and faces that are off by more than the certificate states
        may be one face alone.
        """
        yield hypothesis
        if hypothesis.noise.tails != NORMAL:
            yield self.evidence(
                hypothesis.terms, self.noise_models.without_tails(hypothesis.noise), hypothesis.sigma_um
            )
        if hypothesis.noise.certificate != 1.0:
            stated = self.noise_models.changed(hypothesis.noise, certificate=1.0)
            yield self.evidence(hypothesis.terms, stated, hypothesis.sigma_um)

    def _ones(self, hypothesis: Hypothesis, *places: int) -> list[Hypothesis]:
        """The hypothesis with one other term, or a pair of laws, in place of some; first without these.

        What is left alone has its shape fitted anew: it was that beside the others.
        """
        base = self.without(hypothesis, *places)
        base = self.polished(base) if len(base.terms) == 1 else base
        proposals = self._proposed(base, 3)
        return [base, *(self.added(base, proposal) for proposal in proposals), *self._paired(base, hypothesis.labels)]

    def _instead(self, hypothesis: Hypothesis, place: int) -> Hypothesis:
        """The best with one or two other terms in place of one; terms that become superfluous are dropped."""
        base, *ones = self._ones(hypothesis, place)
        others = sorted((one for one in ones if one.labels != hypothesis.labels), key=log_posterior, reverse=True)
        # what is nearly as likely stands there by itself; beside what is not, something else may be missing
        near = (one for one in others if one.log_posterior > hypothesis.log_posterior - FARTHER)
        members = [one for one in near if len(one.terms) == len(hypothesis.terms)]
        alone = hypothesis.labels.union(*(one.labels for one in members)) - base.labels
        lesser = [one for one in others if not one.labels & alone]
        # a form may stand for several laws, of which the first alone is less probable than another form
        laws = [one for one in others if one.named] if not hypothesis.terms[place].candidate.named else []
        firsts = {id(one): one for one in (*others[:1], *lesser[:1], *laws[:1])}.values()
        twos = [(self.added(one, proposal), one.labels) for one in firsts for proposal in self._proposed(one, 1, alone)]
        more = [*((other, base.labels) for other in others), *twos]
        weeded = (self._weeded(*one) for one in more if one[0].log_posterior > hypothesis.log_posterior - NEEDED)
        return max((base, *ones, *weeded), key=log_posterior)

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        """Shape and size of each term fitted again with the others."""
        for candidate in [term.candidate for term in hypothesis.terms]:
            hypothesis = max(hypothesis, self._anew(hypothesis, candidate), key=log_posterior)
        return hypothesis

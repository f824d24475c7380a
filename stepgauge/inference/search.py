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
        self.evidence, self.looks = Evidence(problem, priors), Screening(problem)
        self.scatters, self._facets = self.evidence.scatters, NoiseProposals(self.evidence, problem, priors)
        self.start = self.evidence((), self.scatters.plain())
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
        return self._independent(found) if found.scatter.correlated else found

    def _one_by_one(self, best: Hypothesis) -> Hypothesis:
        """The best also from single laws in place of a combination of many."""
        for term in [one for one in best.terms if one.candidate.combined]:
            other = self._of_plain(self.without(best, best.place(term.candidate)))
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
            for look in self.beside(base):
                if is_plain(look.candidate) and look.candidate.again:
                    kinds.setdefault(look.candidate.kind, []).append(look)
            for looks in (some for some in kinds.values() if len(some) > 1):
                terms = (*base.terms, *(look.term() for look in looks))
                every = self.evidence(terms[:MOST_TERMS], best.scatter, best.sigma_um)
                if every.log_posterior > best.log_posterior - NEEDED:
                    best = self._better(best, self._needed(every))
        return best

    def _of_plain(self, base: Hypothesis) -> Hypothesis:
        """A hypothesis with those that are needed of all likely laws of one shape, and of any sign, besides."""
        plain = (look for look in self.beside(base) if look.gain > HOPELESS and is_plain(look.candidate, signed=True))
        looks = islice(limit_per_kind(plain, THREE_AXES), MOST_PLAIN)
        every = self.evidence((*base.terms, *(look.term() for look in looks)), base.scatter, base.sigma_um)
        return self._needed(self.evidence(needed_terms(every, MOST_TERMS), base.scatter, base.sigma_um))

    def _needed(self, state: Hypothesis) -> Hypothesis:
        """Without the terms that matter least, one after the other, until all are needed."""
        while len(state.terms) > 1:
            least = sorted(range(len(state.terms)), key=state.significance)[:LEAST]
            fewer = max((self.without(state, place) for place in least), key=log_posterior)
            if fewer.log_posterior <= state.log_posterior and len(state.terms) <= MOST_TERMS:
                return state
            state = fewer
        return state

    def _independent(self, best: Hypothesis) -> Hypothesis:
        """The best also from the best terms with independent scatter, for which correlated scatter may stand."""
        every = (one for one in self.evidence.visited.values() if one.terms and not one.scatter.correlated)
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

    def beside(self, state: Hypothesis) -> list[Proposal]:
        """Looks of all candidates that a hypothesis may have in addition, the best first."""
        kinds = {term.candidate.kind for term in state.terms}
        looks = (look for look in self.looks(state, self.scatters) if look.candidate.label not in state.labels)
        return [look for look in looks if not (look.candidate.once and look.candidate.kind in kinds)]

    def added(self, state: Hypothesis, look: Proposal) -> Hypothesis:
        """The hypothesis with one term more; with a shape on the grid or near it, whichever is more probable."""
        key = (id(state), look.candidate.label, look.atom, look.sd)
        if key not in self._added:
            self._added[key] = self._shaped(state, look)
        return self._added[key]

    def _shaped(self, state: Hypothesis, look: Proposal) -> Hypothesis:
        grid = self._with(state, look.term())
        best = max(grid, self._between(state, look, look.atom, grid), key=log_posterior)
        if best.log_posterior > grid.log_posterior + COARSE:
            others = (self._between(state, look, atom, grid) for atom in look.peaks(PEAKS))
            best = max((best, *others), key=log_posterior)
        return best

    def _between(self, state: Hypothesis, look: Proposal, atom: int, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a shape fitted near a point of the grid; that of the grid if the fit fails."""
        law = look.candidate
        if not isinstance(law, Law) or law.refine is None:
            return grid
        refined = law.refine(atom, self._unexplained(state))
        if refined is None:
            return grid
        log_prior = law.log_odds + look.volume_of(atom) + refined.gain
        return self._narrowed(state, Term(law, atom, refined.columns, look.sd, log_prior, refined.shape), grid)

    def _unexplained(self, state: Hypothesis) -> Array:
        """Residuals without the terms of a hypothesis; what nuisance parameters took of them is left in."""
        if not state.terms:
            return self.problem.um
        return self.problem.um - state.mean[state.count :] @ np.vstack([term.columns for term in state.terms])

    def _narrowed(self, state: Hypothesis, term: Term, grid: Hypothesis) -> Hypothesis:
        """The hypothesis with a fitted shape, whose peak may be narrower than the step of the grid.

        For a peak that is higher by d at a distance x from the nearest point, the standard deviation is x / sqrt(2 d);
        on average x is a quarter of a step.
        """
        found = self._with(state, term)
        higher = found.log_posterior - grid.log_posterior
        narrow = 0.5 * float(np.log(2.0 * max(higher, 1e-9))) - float(np.log(0.25 * np.sqrt(2.0 * np.pi)))
        return self.evidence.narrowed(found, term.candidate, narrow) if narrow > 0.0 else found

    def _with(self, state: Hypothesis, term: Term) -> Hypothesis:
        term = replace(term, correlated=state.scatter.correlated and term.candidate.atoms > 1)
        return self.evidence((*state.terms, term), state.scatter, state.sigma_um)

    def _forward(self, heads: list[Hypothesis]) -> list[Hypothesis]:
        """The most probable hypotheses with one term more: of laws alone, and of all."""
        weeded = [self._weeded(state, head.labels) for head in heads for state in self._with_one_more(head)]
        ranked = sorted({id(state): state for state in weeded}.values(), key=log_posterior, reverse=True)
        laws = [state for state in ranked if state.named][:BEAM]
        chosen = laws + [state for state in ranked[:1] if state not in laws]
        shaped = {id(state): state for state in map(self.reshaped, chosen)}
        return sorted(shaped.values(), key=log_posterior, reverse=True)

    def _with_one_more(self, head: Hypothesis) -> Iterator[Hypothesis]:
        yield from (self.added(head, look) for look in self._proposed(head))
        yield from self._paired(head)

    def _proposed(
        self, state: Hypothesis, most: int = PROPOSED, without: frozenset[str] = frozenset()
    ) -> Iterator[Proposal]:
        """Looks worth trying: the best laws, at most two of a kind, and the best forms."""
        looks = [one for one in self.beside(state) if one.gain > HOPELESS and one.candidate.label not in without]
        yield from islice(limit_per_kind(look for look in looks if look.candidate.named), most)
        yield from islice(limit_per_kind(look for look in looks if not look.candidate.named), PROPOSED_FORMS)

    def _paired(self, state: Hypothesis, without: frozenset[str] = frozenset()) -> Iterator[Hypothesis]:
        """The hypothesis with two more laws that explain together what neither does alone."""
        for one, other in self.looks.pairs(state, self.scatters, PROPOSED_PAIRS, without | state.labels):
            yield self._with(self._with(state, one.term()), other.term())

    def _weeded(self, state: Hypothesis, old: frozenset[str]) -> Hypothesis:
        """The hypothesis without ``old`` terms whose removal makes it more probable; what is new stays."""
        for place in (i for i, term in enumerate(state.terms) if term.candidate.label in old):
            if self.evidence.most_without(state, place) < state.log_posterior - NEEDED:
                continue
            fewer = self.without(state, place)
            if fewer.log_posterior > state.log_posterior:
                return self._weeded(fewer, old)
        return state

    def without(self, state: Hypothesis, *places: int) -> Hypothesis:
        """The hypothesis without some of its terms, by index."""
        terms = tuple(term for i, term in enumerate(state.terms) if i not in places)
        return self.evidence(terms, state.scatter, state.sigma_um)

    def reshaped(self, state: Hypothesis) -> Hypothesis:
        """The most probable model of the scatter for the same terms, changing one property after the other."""
        for _ in range(ROUNDS):
            best = self._current(max(self._facets(state), key=log_posterior, default=state))
            if best.log_posterior <= state.log_posterior + SETTLED:
                return max(state, best, key=log_posterior)
            state = best
        return state

    def _current(self, state: Hypothesis) -> Hypothesis:
        """The hypothesis with volumes of shapes that hold for its scatter."""
        if state.current:
            return state
        for candidate in [term.candidate for term in state.terms if term.correlated]:
            state = self._anew(state, candidate)
        return state

    def _anew(self, state: Hypothesis, candidate: Candidate) -> Hypothesis:
        """The hypothesis with the shape and size of one term as they are found beside the others."""
        place = state.place(candidate)
        base = self.without(state, place)
        own = next((look for look in self.beside(base) if look.candidate is candidate), None)
        return self._with(base, state.terms[place]) if own is None else self.added(base, own)

    def _exchanged(self, best: Hypothesis) -> Hypothesis:
        """Exchanges of one term for one, one for two, two for one, until nothing improves; two at once if one fails."""
        for _ in range(ROUNDS):
            old = best
            for state in self._plainer(old):
                best = max((best, *(self._instead(state, place) for place in range(len(old.terms)))), key=log_posterior)
                if len(old.terms) < MOST_TERMS:
                    best = max(
                        (best, *(self.added(state, look) for look in self._proposed(state, 2))), key=log_posterior
                    )
            if best.log_posterior <= old.log_posterior + SETTLED:
                pairs = combinations(range(len(old.terms)), 2)
                best = max((best, *(one for places in pairs for one in self._ones(old, *places))), key=log_posterior)
                best = max((best, *self._shared(old)), key=log_posterior)
            best = self._better(old, self.polished(self.reshaped(best)))
            if best.log_posterior <= old.log_posterior + SETTLED:
                break
        return best

    def _shared(self, state: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis with a law of one shape that stands for a part of what a law of many shapes explains.

        At the shape that explains most alone the other law adds nothing: the shape is found anew beside it. Forms are
        left out, since they may stand for what the shape of the law alone does not explain.
        """
        forms = [i for i, term in enumerate(state.terms) if not term.candidate.named]
        for place, term in enumerate(state.terms):
            if not isinstance(term.candidate, Law) or place in forms or term.candidate.atoms == 1:
                continue
            base, own = (
                self.without(state, place, *forms),
                Screening(replace(self.problem, candidates=[term.candidate])),
            )
            plain = (one for one in self.beside(base) if one.gain > 0.0 and is_plain(one.candidate))
            for look in islice(limit_per_kind(plain), MOST_SHARED if len(base.terms) < MOST_TERMS - 1 else 0):
                one = self._with(base, look.term())
                found = (self.added(one, shape) for shape in own(one, self.scatters))
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
                looks = Screening(replace(self.problem, candidates=asked))(base, self.scatters)
                yield from (self._with(base, look.term()) for look in looks[:PROPOSED] if look.gain > HOPELESS)

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
        self.looks.admit([one for one in new.values() if isinstance(one, Law)])

    def _plainer(self, state: Hypothesis) -> Iterator[Hypothesis]:
        """The hypothesis, and the same without what its scatter may have in place of a term that is missing.

        Rows are weighted by the residuals of its own terms, and faces that are off by more than the certificate states
        may be one face alone.
        """
        yield state
        if state.scatter.tails != NORMAL:
            yield self.evidence(state.terms, self.scatters.without_tails(state.scatter), state.sigma_um)
        if state.scatter.certificate != 1.0:
            stated = self.scatters.changed(state.scatter, certificate=1.0)
            yield self.evidence(state.terms, stated, state.sigma_um)

    def _ones(self, state: Hypothesis, *places: int) -> list[Hypothesis]:
        """The hypothesis with one other term, or a pair of laws, in place of some; first without these.

        What is left alone has its shape fitted anew: it was that beside the others.
        """
        base = self.without(state, *places)
        base = self.polished(base) if len(base.terms) == 1 else base
        looks = self._proposed(base, 3)
        return [base, *(self.added(base, look) for look in looks), *self._paired(base, state.labels)]

    def _instead(self, state: Hypothesis, place: int) -> Hypothesis:
        """The best with one or two other terms in place of one; terms that become superfluous are dropped."""
        base, *ones = self._ones(state, place)
        others = sorted((one for one in ones if one.labels != state.labels), key=log_posterior, reverse=True)
        # what is nearly as likely stands there by itself; beside what is not, something else may be missing
        near = (one for one in others if one.log_posterior > state.log_posterior - FARTHER)
        rivals = [one for one in near if len(one.terms) == len(state.terms)]
        alone = state.labels.union(*(one.labels for one in rivals)) - base.labels
        lesser = [one for one in others if not one.labels & alone]
        # a form may stand for several laws, of which the first alone is less probable than another form
        laws = [one for one in others if one.named] if not state.terms[place].candidate.named else []
        firsts = {id(one): one for one in (*others[:1], *lesser[:1], *laws[:1])}.values()
        twos = [(self.added(one, look), one.labels) for one in firsts for look in self._proposed(one, 1, alone)]
        more = [*((other, base.labels) for other in others), *twos]
        weeded = (self._weeded(*one) for one in more if one[0].log_posterior > state.log_posterior - NEEDED)
        return max((base, *ones, *weeded), key=log_posterior)

    def polished(self, state: Hypothesis) -> Hypothesis:
        """Shape and size of each term fitted again with the others."""
        for candidate in [term.candidate for term in state.terms]:
            state = max(state, self._anew(state, candidate), key=log_posterior)
        return state

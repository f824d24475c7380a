"""The search: grow and kick (iterated local search; Lourenço, Martin and Stützle 2003).

*Grow*: of all hypotheses with one term more, two more or one less the most probable one, with shapes fitted anew and
the model of the noise that suits it, until nothing improves. *Kick*: one term is taken out and forbidden, what is left
grows, the term is allowed again, and it grows on; what is more probable is kept. A law that holds in a part of the
record only is proposed from the terms that are there. What each of these is worth: ``benchmarks/search_ablation.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.moves import MOST_TERMS, SETTLED, Moves
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import Problem

NEAR = 8.0
"""Loss of the log posterior up to which the noise of a hypothesis with other terms is chosen anew, nats."""
POLISHED = 3
"""Neighbours whose shapes are fitted anew before none of them counts as better."""
UNPOLISHED = 1.0
"""Loss up to which shapes that are fitted anew may make a hypothesis the better one, nats."""
RIVALLED = 25.0
"""Loss from which what stands for a term is not gone on with, nats."""


@dataclass(frozen=True)
class Step:
    """A step of the search: the change, its term, and the gain in the log posterior."""

    action: str
    label: str
    gain: float


Progress = Callable[[Sequence[str]], None]
"""Told the labels of the terms whenever a more probable hypothesis is found."""


class Search(Moves):
    """The search of one problem; ``trail`` has the steps that led to its result."""

    def __init__(self, problem: Problem, priors: NoisePriors, progress: Progress | None = None) -> None:
        super().__init__(problem, priors)
        self.progress, self.trail = progress, list[Step]()
        self._kicked: set[tuple[frozenset[str], frozenset[str]]] = set()

    def run(self) -> Hypothesis:
        """The best hypothesis found."""
        best = self.start
        for found in self._grown_from_nothing():
            best = self._better(best, found)
        return self.climbed(best)

    def climbed(self, best: Hypothesis) -> Hypothesis:
        """The best that kicks lead to from a hypothesis, and laws in parts of the record."""
        while True:
            found = next((one for one in self._further(best) if _is_better(one, best)), None)
            if found is None:
                return best
            best = self._better(best, found)

    def _grown_from_nothing(self) -> Iterator[Hypothesis]:
        """Correlated noise may stand for a cause, and a cause for noise: one is chosen first once, and once last.

        A random function may stand for several laws at once: it comes when no law is left. Noise that
        comes last comes after it, too: a few readings that a function explains are no outliers.
        """
        functions = frozenset(one.label for one in self.problem.candidates if not one.named)
        laws = self.grow(self.start, functions, with_noise=False)
        found = self.grow(self.reshaped(self.grow(laws, with_noise=False)))
        yield found
        if any(term.candidate.label in functions for term in found.terms):  # laws that came first may be parts of it
            yield self.grow(self.reshaped(self.grow(self.start, with_noise=False)))
        noisy = self.reshaped(self.start)
        if noisy is not self.start:
            yield self.grow(noisy)

    def _further(self, best: Hypothesis) -> Iterator[Hypothesis]:
        for place in sorted(range(len(best.terms)), key=best.significance):
            yield from self._kick(best, place)
        yield from self._part_candidates(best)

    def grow(
        self, hypothesis: Hypothesis, forbidden: frozenset[str] = frozenset(), with_noise: bool = True
    ) -> Hypothesis:
        """The most probable neighbour, and so on; without terms that are forbidden."""
        while True:
            every = sorted(self._neighbours(hypothesis, forbidden), key=log_posterior, reverse=True)
            best = next(
                filter(lambda one: _is_better(one, hypothesis), self._settled(hypothesis, every, with_noise)), None
            )
            if best is None:
                return hypothesis
            hypothesis = best

    def _settled(self, hypothesis: Hypothesis, every: Sequence[Hypothesis], with_noise: bool) -> Iterator[Hypothesis]:
        """The most probable neighbours with shapes and noise that suit them: with the old ones none may be better."""
        for one in every[:POLISHED]:
            if one.log_posterior > hypothesis.log_posterior - NEAR:
                found = self.reshaped(one) if with_noise else one
                yield self.polished(found) if found.log_posterior > hypothesis.log_posterior - UNPOLISHED else found

    def _neighbours(self, hypothesis: Hypothesis, forbidden: frozenset[str]) -> Iterator[Hypothesis]:
        yield from self._dropped(hypothesis)
        if len(hypothesis.terms) < MOST_TERMS:
            yield from (self.added(hypothesis, proposal) for proposal in self.proposed(hypothesis, forbidden))
        if len(hypothesis.terms) < MOST_TERMS - 1:
            yield from self.paired(hypothesis, forbidden)

    def _dropped(self, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
        """One term less."""
        yield from (self.without(hypothesis, place) for place in range(len(hypothesis.terms)))

    def _kick(self, best: Hypothesis, place: int, never: frozenset[str] = frozenset()) -> Iterator[Hypothesis]:
        """What grows without a term that others may stand for, and what grows from there with it.

        Once without the term alone, and once without all that stand for it alone, so that several together may.
        ``never``: labels that are not allowed again.
        """
        base, own = self.without(best, place), best.terms[place].candidate
        for forbidden in dict.fromkeys((frozenset({own.label}), self._rivals(best, base) | {own.label})):
            if (best.labels, forbidden | never) not in self._kicked:
                self._kicked.add((best.labels, forbidden | never))
                alone = self.grow(base, forbidden | never, with_noise=False)
                if alone.log_posterior > best.log_posterior - RIVALLED:
                    if own.combined:
                        alone = self._climbed_apart(alone, forbidden)
                    yield self.grow(alone, never)

    def _climbed_apart(self, alone: Hypothesis, never: frozenset[str]) -> Hypothesis:
        """The best that kicks lead to without a law that is many at once: of these several, none is found at once."""
        while True:
            kicks = (self._kick(alone, place, never) for place in range(len(alone.terms)))
            found = next((one for some in kicks for one in some if _is_better(one, alone)), None)
            if found is None:
                return alone
            alone = found

    def _rivals(self, best: Hypothesis, base: Hypothesis) -> frozenset[str]:
        """Labels of all that are nearly as probable as a term in its place."""
        least = best.log_posterior - base.log_posterior - NEAR
        return frozenset(one.candidate.label for one in self.screen(base) if one.gain > least)

    def _part_candidates(self, best: Hypothesis) -> Iterator[Hypothesis]:
        """With a law that holds in a part of the record; the best of these join the candidates, as rivals like any."""
        every = sorted(self.part_moves(best), key=log_posterior, reverse=True)
        if every and _is_better(first := self.reshaped(every[0]), best):
            near = [one for one in every if one.log_posterior > every[0].log_posterior - NEAR]
            self.admit(term.candidate for one in near for term in one.terms)
            yield self.grow(first)

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


def _is_better(one: Hypothesis, other: Hypothesis) -> bool:
    return one.log_posterior > other.log_posterior + SETTLED

"""Probabilities of statements, averaged over the neighbourhood of what a search found (:mod:`neighbourhood`)."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from stepgauge.inference.grids import locate_shape
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.neighbourhood import Mixture, Neighbourhood, WeightedHypothesis
from stepgauge.inference.noise_models import NoiseModel
from stepgauge.inference.problem import Candidate, GaussianProcess, Law, Term, renumbered, residual_columns
from stepgauge.inference.proposal import Proposal
from stepgauge.inference.search import Search
from stepgauge.inference.twins import law_of, place_of_same

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
NEAR = 9.0
"""Rivals of a term that are less probable by more than this are not computed, nats."""
BETWEEN = 0.3
"""Share of a term's gain that a rival must have at a shape of its grid to be computed between these shapes."""
HAS: dict[str, Callable[[NoiseModel], bool]] = {
    "growth": lambda noise: noise.growth is not None,
    "burst": lambda noise: noise.burst is not None,
    "correlation": lambda noise: noise.correlated,
    "certificate": lambda noise: noise.certificate > 1.0,
    "outlying": lambda noise: noise.tails == "outlying",
    "heavy": lambda noise: noise.tails == "heavy",
}
TOLD = 0.05
"""Probability from which a candidate that is no term of the best hypothesis is told."""
COMPUTED = 6
"""Rivals of a term that are computed exactly."""


@dataclass(frozen=True)
class Member:
    """A candidate that may replace a term: its share of the probability of this place, and its state or look."""

    candidate: Candidate
    probability: float
    proposal: Proposal
    hypothesis: Hypothesis | None = None


@dataclass(frozen=True, repr=False)
class CredibleSet:
    """One term of the best hypothesis with its rivals.

    ``members``: the term's own candidate first; ``nothing``: share of the hypothesis without any of them, and of
    what the readings do not speak for.
    """

    term: int
    members: tuple[Member, ...]
    nothing: float

    def __repr__(self) -> str:
        shares = ", ".join(f"{one.candidate.label} {one.probability:.3g}" for one in self.members)
        return f"<CredibleSet {shares}, nothing {self.nothing:.3g}>"

    @property
    def law_probability(self) -> float:
        """Share of all laws."""
        return sum(one.probability for one in self.members if one.candidate.named)

    @property
    def form_probability(self) -> float:
        """Share of all forms."""
        return sum(one.probability for one in self.members if not one.candidate.named)


@dataclass(frozen=True)
class AlternativeHypothesis:
    """A hypothesis with other terms than the best: terms that go, terms that come, and its odds against the best."""

    gone: tuple[str, ...]
    come: tuple[Candidate, ...]
    odds: float
    hypothesis: Hypothesis


def _one_each(rivals: Sequence[Collection[str]], labels: Sequence[str]) -> bool:
    """Whether every label can be taken from another one of the collections."""
    if not labels:
        return True
    first, rest = labels[0], labels[1:]
    return any(first in one and _one_each([*rivals[:i], *rivals[i + 1 :]], rest) for i, one in enumerate(rivals))


class Posterior:
    """Probabilities over the neighbourhood of the best hypothesis of a search, and credible sets of its terms."""

    def __init__(self, search: Search, best: Hypothesis) -> None:
        self.search, self.best = search, best
        self.sets = tuple(credible_set(search, best, place) for place in range(len(best.terms)))

    @cached_property
    def neighbourhood(self) -> Neighbourhood:
        """What is averaged over."""
        return Neighbourhood(self.search, self.best)

    @property
    def log_posterior(self) -> dict[frozenset[str], float]:
        """Log posterior of each set of terms, all models of the noise summed."""
        return self.neighbourhood.log_posterior

    @cached_property
    def hypotheses(self) -> list[WeightedHypothesis]:
        """All hypotheses that are averaged over, one for each set of terms."""
        return self.neighbourhood.weighted()

    @cached_property
    def weights(self) -> Array:
        """Posterior probability of each hypothesis, normalised over the neighbourhood."""
        return np.asarray(special.softmax([one.log_posterior for one in self.hypotheses]))

    def probability(self, labels: Iterable[str]) -> float:
        """Probability that any candidate with one of these labels is a term; one label may stand alone.

        Raises
        ------
        ValueError
            a label that no candidate has: a probability of nought would say that it was tested
        """
        wanted = [labels] if isinstance(labels, str) else list(labels)
        known = {one.label for one in self.search.problem.candidates}.union(*self._labels)
        for label in wanted:
            if label not in known:
                near = difflib.get_close_matches(str(label), known, 3) or sorted(known)[:10]
                raise ValueError(f"no candidate has the label {label!r}; expected {', '.join(near)}")
        return self.probability_of_any(frozenset({label}) for label in wanted)

    def shape(self, label: str) -> tuple[float, float]:
        """Posterior mean and standard uncertainty of a shape (a period, a time constant, the correlation length of a
        Gaussian process), in the unit of its values.

        Beside the other terms and the noise of the best hypothesis, over all shapes of the grid, and about the
        likeliest over shapes between them; each stands for those about it (rectangular, GUM 4.3.7).

        Raises
        ------
        ValueError
            a label that is no term of the best hypothesis, or a law whose ``values`` were not stated
        """
        place = self.best.place_of(label)
        law = None if place is None else self.best.terms[place].candidate
        if place is None or not isinstance(law, Law | GaussianProcess) or law.values is None:
            raise ValueError(
                f"{label!r} has no shape here; expected a term of the best hypothesis, of a law with values"
            )
        weight = law.log_weight if isinstance(law, Law) else np.zeros(law.atoms)
        log = [self._log_with(place, law.columns(atom)) + weight[atom] for atom in range(law.atoms)]
        shape_at = law.shape_at if isinstance(law, Law) else None
        return locate_shape(law.values, np.array(log), shape_at, lambda columns: self._log_with(place, columns))

    def _log_with(self, place: int, columns: Array) -> float:
        """Log posterior of the best hypothesis with other columns of one term."""
        terms = list(self.best.terms)
        terms[place] = replace(terms[place], columns=columns, shape=None)
        return float(self.search.evidence(tuple(terms), self.best.noise, self.best.sigma_um).log_posterior)

    def write(self, path: str | Path) -> None:
        """Write the table of :meth:`to_frame` (CSV)."""
        self.to_frame().to_csv(path, index=False)

    def plot(self, axes: Axes | None = None, x: ArrayLike | None = None) -> Axes:
        """Residuals, and the sum of the terms of the best hypothesis, on ``axes`` or new ones of pyplot.

        ``x (n,)``: what they are drawn against, labelled by its name where it is a Series of pandas; by default the
        covariate of a Gaussian process where there is one, else the rows.
        """
        from stepgauge.inference.drawing import draw_posterior

        return draw_posterior(self, axes, x)

    def to_frame(self) -> pd.DataFrame:
        """A row per candidate: its label, its probability, whether the best hypothesis has it as a term, and if so its
        amplitude (of several coefficients their root sum of squares) and shape (a period, an onset, a correlation
        length), each with its standard uncertainty; NaN where there is none.
        """
        from stepgauge.inference.table import posterior_table

        return posterior_table(self)

    def summary(self) -> str:
        """The terms of the best hypothesis with their probabilities and rivals, a line each."""
        lines = []
        for one in self.sets:
            first, *rivals = one.members
            others = "".join(f", or {rival.candidate.label} {rival.probability:.3g}" for rival in rivals)
            lines.append(f"{first.candidate.label} {first.probability:.3g}{others}")
        named = {member.candidate.label for one in self.sets for member in one.members}
        rest = [
            (one.label, self.probability_of_any([frozenset({one.label})])) for one in self.search.problem.candidates
        ]
        lines = lines or ["no term: nothing is more probable than scatter alone"]
        besides = sorted(((label, p) for label, p in rest if p >= TOLD and label not in named), key=lambda one: -one[1])
        return "\n".join([*lines, *(f"not in the best: {label} {p:.3g}" for label, p in besides)])

    def __repr__(self) -> str:
        return (
            f"<Posterior of {len(self.search.problem.candidates)} candidates: {'; '.join(self.summary().splitlines())}>"
        )

    def probability_of_any(self, sets: Iterable[frozenset[str]]) -> float:
        """Probability that all candidates with the labels of one of these sets are terms."""
        wanted = list(sets)
        pairs = zip(self.weights, self._labels, strict=True)
        return float(sum(w for w, labels in pairs if any(own <= labels for own in wanted)))

    @cached_property
    def _labels(self) -> list[frozenset[str]]:
        return [one.labels for one in self.hypotheses]

    def probability_of_scatter(self, has: str) -> float:
        """Of a property of the scatter: ``growth``, ``correlation``, ``certificate``, ``outlying`` or ``heavy``."""
        return sum(weight * mixture.share(HAS[has]) for mixture, weight in self._mixtures)

    def likeliest_scatter(self, has: str) -> NoiseModel | None:
        """The most probable model of the noise with a property, whatever the terms; None where none has it."""
        every = (
            (weight * float(np.exp(log - mixture.log_sum)), noise)
            for mixture, weight in self._mixtures
            for noise, log in mixture.models
            if HAS[has](noise)
        )
        return max(every, key=lambda one: one[0], default=(0.0, None))[1]

    @cached_property
    def _mixtures(self) -> list[tuple[Mixture, float]]:
        """Every mixture of models of the noise, and the probability of all hypotheses that have it."""
        found: dict[int, tuple[Mixture, float]] = {}
        for one, weight in zip(self.hypotheses, self.weights, strict=True):
            before = found.get(id(one.mixture), (one.mixture, 0.0))[1]
            found[id(one.mixture)] = one.mixture, before + float(weight)
        return list(found.values())

    def probability_of_nothing(self, negligible: Collection[str] = ()) -> float:
        """Probability of neither terms nor noise that is of other sizes in some rows, or correlated.

        Tails that are heavier than normal, and a certificate that is worse than it states, are no causes.
        ``negligible``: labels of terms that count as nothing.
        """
        found = 0.0
        for weight, one in zip(self.weights, self.hypotheses, strict=True):
            if one.labels <= {*negligible}:
                found += float(weight) * one.mixture.share(lambda noise: noise.is_plain)
        return found

    def alternatives(self, least_odds: float) -> list[AlternativeHypothesis]:
        """Hypotheses with several terms in place of terms of the best, with odds of at least ``least_odds``.

        Each of these terms must be needed: if the hypothesis is as probable without one, that is the alternative. Terms
        that are each replaced by a rival of their own are no further one.
        """
        assert self.neighbourhood  # what is not computed yet is computed for it
        likeliest = self._likeliest
        mine = {term.candidate.label: term.candidate for term in self.best.terms}
        found = []
        for labels, hypothesis in likeliest.items():
            theirs = {term.candidate.label: term.candidate for term in hypothesis.terms}
            gone = tuple(label for label in mine if label not in theirs)
            come = tuple(c for label, c in theirs.items() if label not in mine)
            odds = float(np.exp(hypothesis.log_posterior - self.best.log_posterior))
            if odds < least_odds or not come or not gone or self._each_replaced(gone, come, odds):
                continue
            fewer = [likeliest[labels - {one.label}] for one in come if labels - {one.label} in likeliest]
            if all(one.log_posterior < hypothesis.log_posterior for one in fewer):
                found.append(AlternativeHypothesis(gone, come, odds, hypothesis))
        return sorted(found, key=lambda one: -one.odds)

    def _each_replaced(self, gone: Sequence[str], come: Sequence[Candidate], odds: float) -> bool:
        """Whether the terms that come are rivals, one by one, of those that go, and each at least as probable alone."""
        if len(gone) != len(come) or len(gone) == 1:
            return len(gone) == len(come)
        of = {self.best.terms[one.term].candidate.label: one.members for one in self.sets}
        near = [{m.candidate.label for m in of[g] if m.probability >= odds * of[g][0].probability} for g in gone]
        return _one_each(near, [one.label for one in come])

    def _shown(self, term: Term) -> float:
        """Size of a term's signature beside what nothing is known of."""
        return float(np.linalg.norm(residual_columns(term.columns, self.search.problem.free)))

    @cached_property
    def _likeliest(self) -> dict[frozenset[str], Hypothesis]:
        """The most probable state that was computed for each set of terms."""
        return self.search.evidence.best_by_labels

    def spread(self, label: str, least: float, without: Collection[str] = ()) -> tuple[Array, Array] | None:
        """Posterior mean ``(d,)`` and covariance of the amplitudes of a term over the hypotheses that contain it.

        ``without``: labels that none of these contains. None if the best hypothesis does not contain the term.
        """
        held = self._held(label, least, without)
        if held is None:
            return None
        weight, means, covariances = held
        mean = np.einsum("h,hd->d", weight, means)
        off = means - mean
        return mean, np.einsum("h,hde->de", weight, covariances) + np.einsum("h,hd,he->de", weight, off, off)

    def signed(self, label: str, least: float, wider: float, without: Collection[str]) -> float | None:
        """Probability that the amplitudes of a term are not of the opposite sign, over the hypotheses that contain it.

        ``wider``: factor on their standard deviations; ``without``: labels that none of these contains. None as of
        :meth:`spread`.
        """
        held = self._held(label, least, without)
        if held is None:
            return None
        weight, means, covariances = held
        far = np.sqrt([mean @ np.linalg.pinv(own) @ mean for mean, own in zip(means, covariances, strict=True)])
        along = np.sign(means @ (weight @ means))
        return float(weight @ special.ndtr(along * far / wider))

    def _held(self, label: str, least: float, without: Collection[str] = ()) -> tuple[Array, Array, Array] | None:
        """Weights, means ``(h, d)`` and covariances of a term's amplitudes in the hypotheses that contain it.

        Only those with odds of at least ``least`` against the best one count, since less probable ones do not change
        the coverage interval. Of several amplitudes, as of a wave, those of another shape of the grid are others.
        Of two steps or waves that stand together either may have either label: it is the one that is more like it.
        """
        own = next((t for t in self.best.terms if t.candidate.label == label), None)
        if own is None:
            return None
        near = self.best.log_posterior + float(np.log(least))
        every = (one for one in self.search.evidence.current if one.log_posterior >= near)
        every = (one for one in every if not one.labels & set(without))
        twins = [term for term in self.best.terms if law_of(term) == law_of(own)]
        held = [(one, place) for one in every if (place := place_of_same(own, twins, one)) is not None]
        if not held:
            return None
        # a shape fitted between the grid's may be so much larger that the amplitude is that much smaller
        as_own = np.array([self._shown(hypothesis.terms[place]) for hypothesis, place in held]) / self._shown(own)
        means, covariances = zip(*(hypothesis.amplitudes(place) for hypothesis, place in held), strict=True)
        weight = np.asarray(special.softmax([hypothesis.log_posterior for hypothesis, _ in held]))
        return weight, as_own[:, None] * means, as_own[:, None, None] ** 2 * covariances


def credible_set(search: Search, best: Hypothesis, place: int) -> CredibleSet:
    """A term of a hypothesis with its rivals; those that only were rated count with their looks.

    What the readings do not make more probable than it was explains nothing of the place: it counts as nothing there.
    """
    mine, base = best.terms[place].candidate, search.without(best, place)
    base = search.evidence(renumbered(base.terms), base.noise, base.sigma_um)
    proposals = search.screen(base)
    same = next(one for one in proposals if one.candidate is mine or one.candidate.first is mine)
    own, others = replace(same, candidate=mine), [one for one in proposals if one is not same]
    near = [proposal for proposal in others if proposal.gain >= own.gain - NEAR]
    # a look at a rival does not tell that it is more probable
    computed = [proposal for i, proposal in enumerate(near) if i < COMPUTED or proposal.gain > own.gain]
    between = [proposal for proposal in others if proposal not in near and _reaches(proposal, own)]
    hypotheses = [
        (own, best),
        *((proposal, search.added(base, proposal)) for proposal in [*computed, *between[:COMPUTED]]),
    ]
    worth: list[tuple[Proposal, float, Hypothesis | None]] = [
        (one, s.log_posterior - base.log_posterior, s) for one, s in hypotheses
    ]
    # of a signature that nearly vanishes beside the origins a look in single precision sees less than there is
    lower = float(np.median([value - proposal.gain for proposal, value, _ in worth]))
    worth += [(proposal, proposal.gain + lower, None) for proposal in near[len(computed) :]]
    nothing, *shares = special.softmax([0.0, *(value for _, value, _ in worth)]).tolist()
    members = []
    for (proposal, value, found), share in zip(worth, shares, strict=True):
        spoken_for = value > proposal.log_odds
        if proposal is own or spoken_for:
            members.append(Member(proposal.candidate, share, proposal, found))
        if not spoken_for:
            nothing += share
    return CredibleSet(place, (members[0], *sorted(members[1:], key=lambda one: -one.probability)), nothing)


def _reaches(proposal: Proposal, own: Proposal) -> bool:
    """Whether a rival may be as good as a term between the shapes of its grid, or at another size, than was rated."""
    candidate = proposal.candidate
    fitted = isinstance(candidate, Law) and (candidate.refine is not None or candidate.of_size is not None)
    return fitted and proposal.gain > BETWEEN * own.gain

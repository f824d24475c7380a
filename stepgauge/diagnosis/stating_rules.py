"""The rules by which results are stated; they use probabilities and sizes only.

The hypothesis that is stated is the most probable one; of single laws, if those together are more probable than those
with forms or combinations. Each of its terms explains one structure of the residuals. Other candidates
that the readings make more probable there are its rivals.

1. Of a structure nothing is stated if the probability that there is no structure is larger than ``1 - stated``.
2. A law is stated if its laws together are more probable than its forms: the most probable law, and as
   its set the laws that have more than ``in_set`` of its probability, without those that are ``excluded``
   times less probable, by readings alone (a Bayes factor) and at their best, too. Otherwise the most probable form is
   stated.
3. A law is not named, however likely, if its size may be of either sign: if that is less sure than at ``determined``
   standard uncertainties from zero. Nor is a law, besides a form over the covariate that the law depends on, for the
   form may contain the law.
4. Outliers, growing and correlated scatter are stated if their probability is at least ``stated``. Correlated scatter
   makes the verdict ``unknown``, as forms do: laws that are named as well stay.

These are the rules of docs/diagnosis.md. What rules 3 and 4 need of covariates and rows is in the two modules that use
this one, for recordings and for probe maps.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from stepgauge.diagnosis.priors import Decision
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.moves import HOPELESS, MOST_TERMS
from stepgauge.inference.posterior import AlternativeHypothesis, CredibleSet, Member, Posterior, credible_set
from stepgauge.inference.problem import Term
from stepgauge.inference.proposal import Proposal
from stepgauge.inference.search import Search

SURE_OUTLIER = 0.5
"""Probability from which a row is listed as an outlier."""
LEAST_ODDS = 1e-4
"""Least odds against the best hypothesis at which several laws in place of one are listed."""
WIDER = 2.0
"""Factor on U from which it is told what widens it."""
MOST_LOCATED = 4
"""Largest number of covariates that are listed for systematic residuals."""


@dataclass(frozen=True)
class StatedTerm:
    """The statement for one structure: its rivals, the most probable first, and the term of the one that is stated."""

    credible_set: CredibleSet
    lead: Member
    term: Term

    @property
    def label(self) -> str:
        """Of the candidate that is stated."""
        return self.lead.candidate.label

    @property
    def source(self) -> Any:
        """The object behind the candidate: the law with its choices, or the form."""
        return self.lead.candidate.source

    @property
    def named(self) -> bool:
        """Whether a law is stated."""
        return self.lead.candidate.named


def answer_of(search: Search, decision: Decision, best: Hypothesis | None = None) -> Posterior:
    """The answer of a search, with all that is likelier than not; ``best``: what it found, where it was run before."""
    return Posterior(search, _completed(search, _prefer_single_laws(search, best or search.run()), decision))


def _prefer_single_laws(search: Search, best: Hypothesis) -> Hypothesis:
    """The best hypothesis of single laws, if those are together more probable than those with forms or combinations.

    A form may stand for several laws, of which many combinations are each a little less probable. What a hypothesis has
    besides that is less probable than nothing does not count: whose neighbours were computed would have more of it.
    """
    least = best.log_posterior + float(np.log(LEAST_ODDS))
    near = [one for one in search.evidence.best_by_labels.values() if one.log_posterior > least]
    every = [
        one for one in near if not any(o.labels < one.labels and o.log_posterior > one.log_posterior for o in near)
    ]
    single = [state for state in every if state.terms and _single(state)]
    others = [state.log_posterior for state in every if not _single(state)]
    if (
        _single(best)
        or not single
        or special.logsumexp([log_posterior(one) for one in single]) < special.logsumexp(others)
    ):
        return best
    return max(single, key=log_posterior)


def _single(state: Hypothesis) -> bool:
    return all(term.candidate.named and not term.candidate.combined for term in state.terms)


def _completed(search: Search, best: Hypothesis, decision: Decision) -> Hypothesis:
    """A hypothesis with one more term as long as what would be said of it is more probable than ``stated``.

    Several laws may explain what none of them has alone, so that the most probable hypothesis has none of them. A law
    whose size is not determined would not be said (rule 3).
    """
    while len(best.terms) < MOST_TERMS:
        look = next((look for look in search.screen(best) if look.gain > HOPELESS), None)
        if look is None:
            return best
        more = search.added(best, look)
        found = credible_set(search, more, more.index(look.candidate))
        statement = StatedTerm(found, _lead(found), more.terms[found.term])
        if _stated_probability(statement, decision) < decision.stated:
            return best
        if statement.named and not is_determined(more, statement.term, decision.determined):
            return best
        best = more
    return best


def _stated_probability(statement: StatedTerm, decision: Decision) -> float:
    """Probability of what is stated of a structure: of a law with its set, or of all forms over one covariate."""
    if statement.named:
        return sum(one.probability for one in credible_laws(statement, decision))
    kind = statement.lead.candidate.kind
    return sum(
        one.probability
        for one in statement.credible_set.members
        if not one.candidate.named and one.candidate.kind == kind
    )


def stated_terms(search: Search, answer: Posterior, stated: float) -> tuple[Hypothesis, list[StatedTerm]]:
    """The hypothesis that is stated, and its statements, by rules 1 and 2."""
    sets = [one for one in answer.sets if one.nothing <= 1.0 - stated]
    leads = [(one, _lead(one)) for one in sets]
    state = _stated_hypothesis(search, answer.best, leads)
    terms = {term.candidate.label: term for term in state.terms}
    known = [(one, lead) for one, lead in leads if lead.candidate.label in terms]
    return state, [StatedTerm(one, lead, terms[lead.candidate.label]) for one, lead in known]


def _lead(found: CredibleSet) -> Member:
    """The rival that is stated: the most probable law, or the most probable form over the most probable covariate."""
    own = found.members[0].candidate.named  # where nothing is as good as certain both are 0
    named = own if found.law_probability == found.form_probability else found.law_probability > found.form_probability
    rivals = [one for one in found.members if one.candidate.named is named]
    if named:
        return max(rivals, key=lambda one: one.probability)
    probability: dict[str, float] = defaultdict(float)
    for one in rivals:
        probability[one.candidate.kind] += one.probability
    kind = max(probability, key=lambda k: probability[k])
    return max((one for one in rivals if one.candidate.kind == kind), key=lambda one: one.probability)


def _stated_hypothesis(search: Search, best: Hypothesis, leads: list[tuple[CredibleSet, Member]]) -> Hypothesis:
    """The best hypothesis with the rivals that are stated as its terms, without those of which nothing is stated."""
    terms = [best.terms[one.term] for one, _ in leads]
    state = search.evidence(tuple(terms), best.noise, best.sigma_um)
    for one, lead in leads:
        own = best.terms[one.term]
        if lead.candidate is own.candidate or lead.candidate.label in state.labels:
            continue
        base = search.without(state, state.index(own.candidate))
        state = search.added(base, lead.proposal)
    return state


def is_determined(state: Hypothesis, term: Term, least: float) -> bool:
    """Whether the size of a term is more than ``least`` standard uncertainties (rule 3), for a fixed shape."""
    index = state.index_of(term)
    if index is None:
        return True
    mean, covariance = state.amplitudes(index)
    return float(mean @ np.linalg.pinv(covariance) @ mean) >= least**2


def sign_is_sure(statement: StatedTerm, state: Hypothesis, answer: Posterior, decision: Decision, wider: float) -> bool:
    """Whether the sign of a law's size is as probable as beyond ``determined`` standard uncertainties (rule 3).

    Over all hypotheses that contain the law, and no other rival of its place, law or form, that is not stated, which
    would leave open how much each explains, however improbable it is; ``wider``: factor on their uncertainties.
    """
    label = statement.lead.candidate.label
    forms = {one.label for one in answer.search.problem.candidates if not one.named}
    rivals = forms | {one.candidate.label for one in statement.credible_set.members}
    signed = answer.signed(label, decision.in_set, wider, rivals - state.labels - {label})
    if signed is None:
        return is_determined(state, statement.term, decision.determined * wider)
    return signed >= float(special.ndtr(decision.determined))


def credible_laws(statement: StatedTerm, decision: Decision) -> list[Member]:
    """The laws of a structure that are stated together, the stated one first and then the most probable.

    A law that is less probable by more than ``excluded`` is not stated with it if the readings exclude it. What a law
    pays for the range of its shapes says how rare these are, and nothing of the readings: a law that fits as well at
    its best is not excluded. Several laws at once always fit as well, so that they count as :func:`instead`.
    """
    far, lead = float(np.log(decision.excluded)), statement.lead
    least, fit = _log_evidence(lead) - far, _fit(lead) - far

    def excluded(one: Member) -> bool:
        if one.probability * decision.excluded >= lead.probability:
            return False
        return one.candidate.combined or (_log_evidence(one) <= least and _fit(one) <= fit)

    ranked = sorted(statement.credible_set.members, key=lambda one: -one.probability)
    others = (one for one in ranked if one.candidate.named and one is not lead)
    return [lead, *(one for one in others if one.probability > decision.in_set and not excluded(one))]


def _log_evidence(rival: Member) -> float:
    """Log marginal likelihood of a rival, up to a constant of its set: its probability without its prior odds."""
    return float(np.log(max(rival.probability, 1e-300))) - rival.proposal.log_odds


def _fit(rival: Member) -> float:
    """Log likelihood of a rival at its best; of one that was not computed nothing is known."""
    return -np.inf if rival.hypothesis is None else rival.hypothesis.log_fit


def replacements(
    several: Sequence[AlternativeHypothesis], label: str, kind: str, decision: Decision
) -> list[AlternativeHypothesis]:
    """Combinations of laws that may replace one law, with others or alone.

    More laws fit as well as fewer, so that readings do not exclude them: they must not be ``excluded`` times less
    probable, prior odds included. Those with its own kind are left out: in them it is a cause as well, with another
    one beside it.
    """
    near = (one for one in several if label in one.gone and one.odds * decision.excluded >= 1.0)
    return [one for one in near if all(c.named and c.kind != kind for c in one.come)]


def joined_kinds(several: Sequence[AlternativeHypothesis]) -> tuple[str, ...]:
    """Combinations of laws as their kinds: ``scale_error + squareness``."""
    return tuple(dict.fromkeys(" + ".join(sorted(c.kind for c in one.come)) for one in several))


def set_probability(answer: Posterior, rivals: Sequence[Member], several: Sequence[AlternativeHypothesis]) -> float:
    """Probability that a law or another one of its set is a cause, averaged over all hypotheses.

    It is at most that of the set in its structure: where two laws may be replaced together, neither shows it.
    """
    every = [frozenset({one.candidate.label}) for one in rivals]
    every += [frozenset(c.label for c in one.come) for one in several]
    return min(sum(one.probability for one in rivals), answer.probability_of_any(every), 1.0)


def law_probability(
    statement: StatedTerm, answer: Posterior, several: Sequence[AlternativeHypothesis], decision: Decision
) -> float:
    """Probability that a stated law, or another one of its set, is a cause."""
    kind = statement.lead.candidate.kind
    combined = replacements(several, statement.lead.candidate.label, kind, decision)
    return set_probability(answer, credible_laws(statement, decision), combined)


def presence_probability(statement: StatedTerm, answer: Posterior) -> float:
    """Probability that there is something where a term is stated, whatever it is."""
    return answer.probability_of_any(frozenset({one.candidate.label}) for one in statement.credible_set.members)


def widening(answer: Posterior, state: Hypothesis, label: str, least: float) -> tuple[str, ...]:
    """The laws any of which by itself, beside a stated one or in the place of another, more than doubles its U."""
    if spread_factor(answer, state, label, least) <= WIDER:
        return ()
    every = {c.label: c for one in answer.hypotheses for c in one.candidates if c.label not in state.labels}
    near = (name for name in every if answer.probability_of_any([frozenset({name})]) >= least)
    laws = [name for name in near if every[name].named and not every[name].combined]
    alone = spread_factor(answer, state, label, least, every.keys())  # with other sizes, shapes and scatter
    factor = {one: spread_factor(answer, state, label, least, every.keys() - {one}) for one in laws}
    return tuple(one for one in laws if factor[one] > WIDER * alone)


def spread_factor(
    answer: Posterior, state: Hypothesis, label: str, least: float, without: Collection[str] = ()
) -> float:
    """Factor on the uncertainty of a size: that over all hypotheses that contain it, over that in the stated one.

    Both are about the value of the stated one, which is what is told: where others say another, they widen it by that.
    ``without``: labels that none of these hypotheses contains.
    """
    spread = answer.spread(label, least, without)
    index = state.place_of(label)
    if spread is None or index is None:
        return 1.0
    told, own = state.amplitudes(index)
    mean_square = np.trace(spread[1]) + np.sum((spread[0] - told) ** 2)
    return max(float(np.sqrt(mean_square / max(float(np.trace(own)), 1e-300))), 1.0)


def structure_alone(
    search: Search, state: Hypothesis, known: Collection[str], least: float
) -> Iterator[tuple[Proposal, float, float]]:
    """Forms of the residuals before any law is named, one to a kind, with their probability and what they explain.

    They are rivals for one structure: those with odds below ``least`` against the most probable one are left out.
    ``state``: the scatter to judge by; ``known``: kinds that are stated already.
    """
    start, known_kinds = search.evidence((), state.noise, state.sigma_um), set(known)
    total = max(float(np.var(search.problem.residual_um)) - start.sigma_um**2, 1e-300)
    looks = [look for look in search.screen(start) if not look.candidate.named and look.gain > 0.0]
    near = max((look.gain for look in looks), default=0.0) + float(np.log(least))
    for look in looks:
        if look.gain < near or look.candidate.kind in known_kinds or len(known_kinds) >= MOST_LOCATED:
            continue
        known_kinds.add(look.candidate.kind)
        with_form = search.added(start, look)
        explained = float(np.clip((start.sigma_um**2 - with_form.sigma_um**2) / total, 0.0, 1.0))
        yield look, float(1.0 / (1.0 + np.exp(-look.gain))), explained

"""What of an answer is told: the rules that know probabilities and sizes alone, not what the laws are about.

1. In every place of the best hypothesis, nothing is said if nothing being there is likelier than ``1 - stated``.
2. What is said is a law if the laws of the place are likelier together than its forms: the likeliest kind, with all
   other laws that have more than ``in_set`` of the place's probability as its set. Otherwise it is the likeliest form.
3. A law whose size is less than ``determined`` standard uncertainties is not named, however likely. Nor is a law beside
   a form over the covariate that the law depends on, for the form may contain the law.
4. Outliers, growing and correlated scatter are said if their probability is at least ``stated``. Correlated scatter
   makes the verdict ``unknown``, as forms do: laws that are named beside it stay.

These are the rules of docs/diagnosis.md. What rules 3 and 4 need of covariates and rows is in the two modules that use
this one, for recordings and for probe maps.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stepgauge.diagnose.posterior.answer import Alternative, Answer, Place, Rival
from stepgauge.diagnose.posterior.evidence import State
from stepgauge.diagnose.posterior.looks import Look
from stepgauge.diagnose.posterior.priors import Decision
from stepgauge.diagnose.posterior.problem import Term
from stepgauge.diagnose.posterior.search import Search

SURE_OUTLIER = 0.5
"""Probability from which a row is listed as an outlier."""
LEAST_ODDS = 1e-4
"""Odds against the best hypothesis from which several laws in place of one are listed, with their odds."""
MOST_LOCATED = 4
"""Covariates at most that are listed for systematic residuals."""


@dataclass(frozen=True)
class Said:
    """What is said in one place: its rivals, likeliest first, and the term of the one that is told."""

    place: Place
    lead: Rival
    term: Term

    @property
    def source(self) -> Any:
        """What the candidate was made from: the law with its choices, or the form."""
        return self.lead.candidate.source

    @property
    def named(self) -> bool:
        """Whether a law is told."""
        return self.lead.candidate.named


def told(search: Search, answer: Answer, stated: float) -> tuple[State, list[Said]]:
    """The hypothesis that is told and what it says, by rules 1 and 2."""
    places = [place for place in answer.places if place.nothing <= 1.0 - stated]
    leads = [(place, _lead(place)) for place in places]
    state = _told_state(search, answer.best, leads)
    terms = {term.candidate.label: term for term in state.terms}
    known = [(place, lead) for place, lead in leads if lead.candidate.label in terms]
    return state, [Said(place, lead, terms[lead.candidate.label]) for place, lead in known]


def _lead(place: Place) -> Rival:
    """The rival that is told: of the likelier of laws and forms the likeliest kind, of that the likeliest one."""
    named = place.named >= place.nameless
    rivals = [one for one in place.rivals if one.candidate.named is named]
    share: dict[str, float] = defaultdict(float)
    for one in rivals:
        share[one.candidate.kind] += one.share
    kind = max(share, key=lambda k: share[k])
    return max((one for one in rivals if one.candidate.kind == kind), key=lambda one: one.share)


def _told_state(search: Search, best: State, said: list[tuple[Place, Rival]]) -> State:
    """The best hypothesis with the rivals that are told in their places, less the places that are not."""
    terms = [best.terms[place.term] for place, _ in said]
    state = search.evidence(tuple(terms), best.scatter, best.sigma_um)
    for place, lead in said:
        own = best.terms[place.term]
        if lead.candidate is own.candidate or lead.candidate.label in state.labels:
            continue
        base = search.without(state, next(i for i, t in enumerate(state.terms) if t.candidate is own.candidate))
        state = search.added(base, lead.look)
    return state


def determined(state: State, term: Term, least: float) -> bool:
    """Whether the size of a term is more than ``least`` standard uncertainties (rule 3), its shape being what it is."""
    place = next((i for i, other in enumerate(state.terms) if other is term), None)
    if place is None:
        return True
    mean, covariance = state.amplitudes(place)
    return float(mean @ np.linalg.pinv(covariance) @ mean) >= least**2


def sure(said: Said, state: State, answer: Answer, decision: Decision, wider: float) -> bool:
    """Whether a law is determined once its uncertainty is as wide as all hypotheses make it, times ``wider``."""
    factor = spread_factor(answer, state, said.lead.candidate.label, decision.in_set) * wider
    return determined(state, said.term, decision.determined * factor)


def rival_laws(said: Said, least: float) -> list[Rival]:
    """The laws that may stand in a place, the one that is told first."""
    others = [one for one in said.place.rivals if one.candidate.named and one.share > least and one is not said.lead]
    return [said.lead, *others]


def together(several: Sequence[Alternative], label: str, least: float) -> tuple[str, ...]:
    """Several laws that may well stand in place of one, as their kinds: ``scale_error + squareness``."""
    near = [one for one in several if one.gone == (label,) and one.odds >= least]
    instead = [one.come for one in near if all(c.named for c in one.come)]
    return tuple(dict.fromkeys(" + ".join(sorted(c.kind for c in come)) for come in instead))


def spread_factor(answer: Answer, state: State, label: str, least: float) -> float:
    """By how much a size is less certain over all hypotheses that hold it than in the one that is told."""
    spread = answer.spread(label, least)
    place = next((i for i, term in enumerate(state.terms) if term.candidate.label == label), None)
    if spread is None or place is None:
        return 1.0
    own = float(np.trace(state.amplitudes(place)[1]))
    return max(float(np.sqrt(np.trace(spread[1]) / max(own, 1e-300))), 1.0)


def one_of_each_kind(place: Place, named: bool) -> Iterator[Rival]:
    """The likeliest law or form of each kind in a place, the likeliest first."""
    first: dict[str, Rival] = {}
    for one in sorted(place.rivals, key=lambda one: -one.share):
        if one.candidate.named is named:
            first.setdefault(one.candidate.kind, one)
    yield from first.values()


def systematic(
    search: Search, state: State, known: Collection[str], least: float
) -> Iterator[tuple[Look, float, float]]:
    """Forms that stand out before anything is named, one to a kind, with their probability alone and their share.

    They are rivals for one structure: those whose odds against the likeliest are below ``least`` are not where it
    lives. ``state``: the scatter to judge by; ``known``: kinds that are told already.
    """
    start, told_kinds = search.evidence((), state.scatter, state.sigma_um), set(known)
    total = max(float(np.var(search.problem.um)) - start.sigma_um**2, 1e-300)
    looks = [look for look in search.beside(start) if not look.candidate.named and look.gain > 0.0]
    near = max((look.gain for look in looks), default=0.0) + float(np.log(least))
    for look in looks:
        if look.gain < near or look.candidate.kind in told_kinds or len(told_kinds) >= MOST_LOCATED:
            continue
        told_kinds.add(look.candidate.kind)
        beside = search.added(start, look)
        share = float(np.clip((start.sigma_um**2 - beside.sigma_um**2) / total, 0.0, 1.0))
        yield look, float(1.0 / (1.0 + np.exp(-look.gain))), share

"""From an answer's probabilities to what is said of a recording, by stated rules.

1. In every place of the best hypothesis, nothing is said if nothing being there is likelier than ``1 - stated``.
2. What is said is a law if the laws of the place are likelier together than its forms: the likeliest kind, with all
   other laws that have more than ``in_set`` of the place's probability as its set. Otherwise it is the likeliest form.
3. A law whose size is less than ``determined`` standard uncertainties is not named, however likely; nor is one beside a
   form that is told over the covariate that it lives in, for a free function of time may hold a step or a drift in it.
4. Outliers, growing and correlated scatter are said if their probability is at least ``stated``. Correlated scatter
   makes the verdict ``unknown`` where nothing has a name beside it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.covariates import covariates, mask
from stepgauge.diagnose.forms import SMOOTH, Form
from stepgauge.diagnose.library import Family
from stepgauge.diagnose.located import UNDETERMINED, located, regime
from stepgauge.diagnose.posterior.answer import Alternative, Answer, Place, Rival
from stepgauge.diagnose.posterior.evidence import State
from stepgauge.diagnose.posterior.metric import Metric
from stepgauge.diagnose.posterior.priors import Priors
from stepgauge.diagnose.posterior.problem import Term
from stepgauge.diagnose.posterior.search import Search
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.result import Finding, Located, Member
from stepgauge.diagnose.solve import Estimate, Fitted, Solved, solve

Array = NDArray[np.float64]
FAINT = 0.3
"""Share of its largest weight below which a reading says too little of a form."""
LEAST_ODDS = 1e-4
"""Odds against the best hypothesis from which several laws in place of one are listed, with their odds."""
MOST_FORMS = 3
"""Covariates that a place without a law is told with."""


@dataclass(frozen=True)
class Said:
    """What is said in one place: its rivals, likeliest first, and the term of the one that is told."""

    place: Place
    lead: Rival
    term: Term

    @property
    def family(self) -> Family:
        """The law with its choices."""
        found: Family = self.lead.candidate.source
        return found


@dataclass(frozen=True)
class Model:
    """The hypothesis that is told: laws by name, forms, and the laws' fit beside the forms."""

    state: State
    laws: tuple[Said, ...]
    forms: tuple[Said, ...]
    fitted: Fitted
    metric: Metric


def make_model(search: Search, answer: Answer, data: Residuals, priors: Priors) -> Model:
    """The hypothesis told, by rules 1 to 3."""
    told = [place for place in answer.places if place.nothing <= 1.0 - priors.decision.stated]
    said = [(place, _lead(place)) for place in told]
    state = _told_state(search, answer.best, said)
    terms = {term.candidate.label: term for term in state.terms}
    every = [Said(place, lead, terms[lead.candidate.label]) for place, lead in said if lead.candidate.label in terms]
    laws, forms = ([one for one in every if one.lead.candidate.named is named] for named in (True, False))
    model = _fitted(search, state, laws, forms, data)
    vague = [*_undetermined(state, laws, priors.decision.determined), *_within_forms(laws, forms)]
    if vague:
        kept = [one for one in laws if one not in vague]
        model = _fitted(search, state, kept, [*forms, *vague], data)
    return model


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


def _fitted(search: Search, state: State, laws: list[Said], forms: list[Said], data: Residuals) -> Model:
    beside = tuple(one.term for one in forms)
    metric = Metric(search.problem, state.scatter, search.scatters, state.sigma_um, beside)
    fitted = solve([one.family for one in laws], [one.term.atom for one in laws], data, metric)
    return Model(state, tuple(laws), tuple(forms), fitted, metric)


def _undetermined(state: State, laws: list[Said], least: float) -> list[Said]:
    """The laws whose sizes the recording does not determine (rule 3), their shapes being what they are."""
    return [one for one in laws if not _determined(state, one.term, least)]


def _determined(state: State, term: Term, least: float) -> bool:
    place = next((i for i, other in enumerate(state.terms) if other is term), None)
    if place is None:
        return True
    mean, covariance = state.amplitudes(place)
    return float(mean @ np.linalg.pinv(covariance) @ mean) >= least**2


def _within_forms(laws: list[Said], forms: list[Said]) -> list[Said]:
    """The laws that a form over their own covariate may hold (rule 3)."""
    told = {one.lead.candidate.kind for one in forms}
    return [one for one in laws if told & _lives_in(one.family) and not _oscillates(one.family)]


def _oscillates(family: Family) -> bool:
    return family.law is not None and "phase_deg" in family.law.model_fields


def _lives_in(family: Family) -> set[str]:
    """The covariates whose free function may hold a law."""
    assert family.law is not None
    first = family.law.covariates[0]
    if first == "time":
        return {"time", "order"}
    if first == "coordinate":
        axes = [value for value in family.choices.values() if value in ("x", "y", "z")]
        return {"position", *(f"machine {axis}" for axis in axes)}
    return {first}


def findings(model: Model, answer: Answer, data: Residuals, priors: Priors, wider: float) -> Iterator[Finding]:
    """The laws that are told; ``wider``: factor on uncertainties for what the predictive check has found."""
    several = answer.alternatives(LEAST_ODDS)
    for said, solved in zip(model.laws, model.fitted.solved, strict=True):
        rivals = _set(said, priors.decision.in_set)
        label = said.lead.candidate.label
        kinds = tuple(dict.fromkeys(one.candidate.kind for one in rivals if one.candidate.kind != solved.family.kind))
        same = tuple(
            dict.fromkeys(
                one.candidate.source.label
                for one in rivals
                if one.candidate.kind == solved.family.kind and one.candidate.source.label != solved.family.label
            )
        )
        widened = _widened(solved, _spread_factor(answer, model.state, label, priors) * wider)
        yield Finding(
            solved.family.kind,
            solved.family.label,
            solved.effect,
            choices_of(solved),
            widened,
            min(sum(one.share for one in rivals), 1.0),
            solved.displacement_um(data),
            own=answer.probability([label]),
            confounded_with=(*kinds, *_together(several, label, priors.decision.in_set)),
            alternatives=same,
            members=tuple(_members(said, rivals, widened, model, data)),
            several=tuple(
                (tuple(c.source.label for c in one.come if c.named), one.odds)
                for one in several
                if label in one.gone and all(c.named for c in one.come)
            ),
        )


def _together(several: list[Alternative], label: str, least: float) -> tuple[str, ...]:
    """Several laws that may well stand in place of one, as their kinds: ``scale_error + squareness``."""
    near = [one for one in several if one.gone == (label,) and one.odds >= least]
    instead = [one.come for one in near if all(c.named for c in one.come)]
    return tuple(dict.fromkeys(" + ".join(sorted(c.kind for c in come)) for come in instead))


def _set(said: Said, least: float) -> list[Rival]:
    """The laws that may stand in a place: the one that is told first."""
    others = [one for one in said.place.rivals if one.candidate.named and one.share > least and one is not said.lead]
    return [said.lead, *others]


def _members(
    said: Said, rivals: list[Rival], own: dict[str, Estimate], model: Model, data: Residuals
) -> Iterator[Member]:
    """All laws of a set, each with its own values: one set alone takes them from the fit in its place."""
    if len(rivals) < 2:
        return
    total = sum(one.share for one in rivals)
    place = model.laws.index(said)
    for one in rivals:
        solved = model.fitted.solved[place] if one is said.lead else _in_place(one, place, model, data)
        parameters = own if one is said.lead else solved.parameters
        chosen = choices_of(solved)
        yield Member(solved.family.kind, solved.family.label, one.share / total, solved.effect, chosen, parameters)


def _in_place(rival: Rival, place: int, model: Model, data: Residuals) -> Solved:
    families = [one.family for one in model.laws]
    atoms = [one.term.atom for one in model.laws]
    families[place], atoms[place] = rival.candidate.source, rival.look.atom
    return solve(families, atoms, data, model.metric).solved[place]


def choices_of(solved: Solved) -> dict[str, object]:
    """Axis, face, ... of an effect, and the direction that was found for it."""
    if solved.family.directions is None:
        return dict(solved.family.choices)
    return {**solved.family.choices, "direction": getattr(solved.effect, "direction", None)}


def _spread_factor(answer: Answer, state: State, label: str, priors: Priors) -> float:
    """By how much a size is less certain over all hypotheses that hold it than in the one that is told."""
    spread = answer.spread(label, priors.decision.in_set)
    place = next((i for i, term in enumerate(state.terms) if term.candidate.label == label), None)
    if spread is None or place is None:
        return 1.0
    own = float(np.trace(state.amplitudes(place)[1]))
    return max(float(np.sqrt(np.trace(spread[1]) / max(own, 1e-300))), 1.0)


def _widened(solved: Solved, factor: float) -> dict[str, Estimate]:
    return {name: one if one.u is None else replace(one, u=one.u * factor) for name, one in solved.parameters.items()}


def _vague(said: Said, answer: Answer) -> Located:
    """A place where a law would fit, but with a size that is not determined: something is there, and has no name."""
    where = sorted(_lives_in(said.family))[0]
    words = f"looks like {said.family.label}, whose size this recording does not determine"
    return Located(where, "both", UNDETERMINED, words, 1.0, answer.probability([said.lead.candidate.label]))


def unexplained(model: Model, answer: Answer, data: Residuals, priors: Priors) -> Iterator[Located]:
    """The forms that are told, one to a covariate, the likeliest first."""
    for said in model.forms:
        if said.lead.candidate.named:
            if not _determined(model.state, said.term, priors.decision.determined):
                yield _vague(said, answer)
            continue
        first: dict[str, Rival] = {}
        for one in sorted(said.place.rivals, key=lambda one: -one.share):
            if not one.candidate.named:
                first.setdefault(one.candidate.kind, one)
        for one in list(first.values())[:MOST_FORMS]:
            labels = [r.candidate.label for r in said.place.rivals if r.candidate.kind == one.candidate.kind]
            told = located(one.candidate, one.look.atom, answer.probability(labels))
            part = _regime(said, model, data) if one is said.lead else ""
            yield replace(told, where=f"{told.where}, {part}") if part else told


def _regime(said: Said, model: Model, data: Residuals) -> str:
    """The part of the record in which a smooth form is not what it is elsewhere, in words; empty for all of it."""
    form: Form = said.lead.candidate.source
    place = next((i for i, term in enumerate(model.state.terms) if term is said.term), None)
    x = next((one.values for one in covariates(data) if one.name == form.covariate), None)
    if form.shape != SMOOTH or form.beside or place is None or x is None:
        return ""
    mean, covariance = model.state.amplitudes(place)
    share = mask(data, form.side)
    seen = np.abs(share) > FAINT * np.abs(share).max()
    columns = said.term.columns[:, seen] / share[seen]
    spread = np.sqrt(np.maximum(np.einsum("dn,dn->n", columns, covariance @ columns), 0.0))
    return regime(x[seen], mean @ columns, spread, f" {form.unit}".rstrip())


def nearest_laws(model: Model) -> Iterator[str]:
    """What speaks against the law that comes nearest to a form that is told."""
    for said in model.forms:
        named = [one for one in said.place.rivals if one.candidate.named]
        if said.lead.candidate.named or not named:
            continue
        law = max(named, key=lambda one: one.share)
        odds = said.lead.share / max(law.share, 1e-300)
        yield f"{law.candidate.source.label} comes nearest and is {_times(odds)} times less likely than the form"


def _times(odds: float) -> str:
    return f"{odds:.2g}" if odds < 1e4 else f"10^{np.log10(odds):.0f}"

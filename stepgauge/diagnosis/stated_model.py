"""The hypothesis that is stated: its laws, its forms, and the fit of the laws beside the forms.

The part of rule 3 of :mod:`stepgauge.diagnosis.stating_rules` that needs covariates is here: a free function of time
may contain a step or a drift.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stepgauge.diagnosis.checks import predictive_checks, widening
from stepgauge.diagnosis.fits.marginals import marginalise
from stepgauge.diagnosis.fits.solve import Fitted, Solved, solve
from stepgauge.diagnosis.laws.geometry import Geometry
from stepgauge.diagnosis.laws.library import PLACE, Family
from stepgauge.diagnosis.laws.usual import size_of_shape
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Check, rms
from stepgauge.diagnosis.stating_rules import (
    LEAST_ODDS,
    StatedTerm,
    is_determined,
    law_probability,
    sign_is_sure,
    stated_terms,
)
from stepgauge.files.arrays import Array
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.search import Search

SPANNED = 0.05
"""Share of a law's signature, left by a form, below which the form may contain the law."""

UNRESOLVED = 0.8
"""Periods over the travel or the duration by which two waves differ at least: closer ones beat, and are one wave whose
amplitude changes. Those that a whole travel or turn contains differ by one."""
MISFIT = 2.0
"""Chi-square per reading from which a fit leaves structure."""


@dataclass(frozen=True)
class Model:
    """The hypothesis that is stated: laws, forms, and the fit of the laws beside the forms.

    ``doubts``: of those of the forms that are laws which fit and are not stated, by their labels, how a phrase says
    why: their size is not determined (``similar``) or none that they can have (``impossible``), they are less probable
    than what is stated (``weak``), or waves whose amplitude changes (``modulated``); ``geometry``: all geometric errors
    at once, if they are stated: none of them has a fit of its own; ``checks``: the posterior predictive checks, and
    ``wider``: the factor on uncertainties that follows from them.
    """

    state: Hypothesis
    laws: tuple[StatedTerm, ...]
    forms: tuple[StatedTerm, ...]
    fitted: Fitted
    metric: Metric
    geometry: tuple[StatedTerm, ...]
    checks: tuple[Check, ...]
    wider: float
    doubts: Mapping[str, str] = field(default_factory=dict)

    @property
    def remainder_um(self) -> Array:
        """What the stated laws move beside their signatures, along the approach, ``(n,)``."""
        places = (self.state.index(one.term.candidate) for one in self.laws)
        return sum((self.state.discrepancy_um(place) for place in places), np.zeros(len(self.state.residual_um)))


def make_model(search: Search, answer: Posterior, data: Residuals, priors: Priors) -> Model:
    """The hypothesis that is stated, by rules 1 to 3: with the laws that are determined, possible and probable."""
    state, every = stated_terms(search, answer, priors.decision.stated)
    laws, forms = ([one for one in every if one.named is named] for named in (True, False))
    vague = [one for one in laws if not is_determined(state, one.term, priors.decision.determined)]
    within = _within_forms(laws, forms, state)
    apart = [one for one in laws if one in vague or one in within]
    kept = [one for one in laws if one not in apart]
    plain = Metric(search.problem, state.noise, search.noise_models, state.sigma_um)
    checks = predictive_checks(search.problem, state, plain)
    wider = widening(checks, search.problem, state, plain)
    model = _fit_laws(search, state, kept, [*forms, *apart], data, checks, wider)
    doubts = dict(_doubts(model, search, answer, data, priors))
    if doubts:
        fewer = [one for one in kept if one.label not in doubts]
        apart += [one for one in kept if one.label in doubts]
        model = _fit_laws(search, state, fewer, [*forms, *apart], data, checks, wider)
    return replace(model, doubts={one.label: "similar" for one in vague} | doubts)


def _fit_laws(
    search: Search,
    state: Hypothesis,
    every: Sequence[StatedTerm],
    forms: Sequence[StatedTerm],
    data: Residuals,
    checks: tuple[Check, ...],
    wider: float,
) -> Model:
    """All stated laws fitted together, beside the ``forms`` and what is combined, which are nuisances of that fit."""
    geometry = [one for one in every if one.lead.candidate.combined]
    laws = [one for one in every if one not in geometry]
    beside = [one.term.nuisance for one in (*forms, *geometry)]
    beside += [(one.term.discrepancy, one.term.sds[one.term.n_amplitudes :]) for one in laws]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    fitted = solve([law_of_expected_size(one, state) for one in laws], [one.term.atom for one in laws], data, metric)
    fitted = marginalise(fitted, data, metric)
    return Model(state, tuple(laws), tuple(forms), fitted, metric, tuple(geometry), checks, wider)


def law_of_expected_size(said: StatedTerm, state: Hypothesis) -> Family:
    """A law with the size that is expected of it in the hypothesis that is stated.

    Where no reading tells a component of a free direction, it is as large as such a law is usually, and not as it can
    be at most.
    """
    candidate = said.lead.candidate
    place = state.index_of(said.term)
    sd = said.term.sd if place is None else candidate.sizes.expected(state.size_log_evidence[place])
    return law_of_size(candidate.source, said.term.atom, sd)


def law_of_size(family: Family, atom: int, sd: float) -> Family:
    return replace(family, prior=sd * size_of_shape(family.kind, family.atoms[atom], family.atoms))


def _doubts(
    model: Model, search: Search, answer: Posterior, data: Residuals, priors: Priors
) -> Iterator[tuple[str, str]]:
    """The laws that are not possible, not determined, or less probable than ``stated`` (rule 3), and why."""
    pairs, decision = list(zip(model.laws, model.fitted.solved, strict=True)), priors.decision
    modulated, lost = list(_modulated(pairs, data)), _misfits(model, search, data)
    several = answer.alternatives(LEAST_ODDS)

    def why(one: StatedTerm, solved: Solved | None) -> str:
        """The doubt about a law, empty where there is none."""
        if solved is not None and not solved.is_possible:
            return "impossible"
        if one in modulated:
            return "modulated"
        sure = sign_is_sure(one, model.state, answer, decision, model.wider)
        if not sure or (solved is not None and not _has_size(solved, decision.determined * model.wider, lost)):
            return "similar"
        return "weak" if law_probability(one, answer, several, decision) < decision.stated else ""

    known = [*pairs, *((one, None) for one in model.geometry)]
    yield from ((one.label, doubt) for one, solved in known if (doubt := why(one, solved)))


def _modulated(pairs: Sequence[tuple[StatedTerm, Solved]], data: Residuals) -> Iterator[StatedTerm]:
    """Waves that the recording is too short to tell from another one: a wave that fades or wanders is none of them."""
    found = [(said, *_waves(solved, data)) for said, solved in pairs if _oscillates(solved.family)]
    for said, along, waves in found:
        others = (more for one, other, more in found if one is not said and other == along)
        if any(abs(waves - more) < UNRESOLVED for more in others):
            yield said


def _waves(solved: Solved, data: Residuals) -> tuple[str, float]:
    """What a sine depends on, and its periods over the span of that."""
    assert solved.family.law is not None
    name, is_frequency = solved.family.law.rhythm()
    own = float(getattr(solved.effect, name))
    in_time = solved.family.covariate == "time"
    x = data.probings.time_s if in_time else data.probings.certified_mm()
    choices = "" if in_time else str(sorted(solved.family.choices.items()))
    return choices, float(np.ptp(x)) * (own if is_frequency else 1.0 / own)


def _misfits(model: Model, search: Search, data: Residuals) -> bool:
    """Whether the laws as they were fitted leave more than the scatter, with what they move beside their signatures.

    That is of the hypothesis, in whose shapes a law may move more beside its signature than by it.
    """
    state, beside = model.state, [one.term.nuisance for one in (*model.forms, *model.geometry)]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    shares = (one.displacement_um(data) for one in model.fitted.solved)
    left = metric(data.um - sum(shares, model.remainder_um))
    return float(left @ left) * model.wider**2 > MISFIT * len(left)


def _has_size(solved: Solved, least: float, lost: bool) -> bool:
    """Whether the size of a law as it was fitted is more than ``least`` standard uncertainties from none.

    Where its size is its only parameter; and where the fit is bad (``lost``), since its probability is that of other
    shapes then, which the fit has left.
    """
    known = [one for one in solved.parameters.values() if one.u is not None]
    sizes = [one for one in solved.sizes if one.u is not None] if lost else []
    if len(known) == 1 and solved.family.directions is None:
        sizes = known
    return not sizes or any(abs(one.value) >= least * (one.u or 0.0) for one in sizes)


def _within_forms(laws: list[StatedTerm], forms: list[StatedTerm], state: Hypothesis) -> list[StatedTerm]:
    """The laws that a form may contain (rule 3).

    Over their own covariate, or with nearly all of their signature. Of the latter, and of oscillations, those that are
    smaller than the form: one that stands out of it is no part of it.
    """

    def contains(form: StatedTerm, one: StatedTerm) -> bool:
        """Whether what a law makes can as well be a part of the structure."""
        own = form.lead.candidate.kind in law_covariates(one.source)
        if own and not _oscillates(one.source):
            return True
        columns, others = one.term.columns, form.term.columns
        left = columns - np.linalg.lstsq(others.T, columns.T, rcond=None)[0].T @ others
        spanned = bool(np.linalg.norm(left) < SPANNED * np.linalg.norm(columns))
        return term_rms_um(one, state) < term_rms_um(form, state) and (own or spanned)

    return [one for one in laws if any(contains(form, one) for form in forms)]


def _oscillates(family: Family) -> bool:
    return family.law.phase() is not None


def term_rms_um(said: StatedTerm, state: Hypothesis) -> float:
    """Root mean square of the displacement of a term."""
    return rms(state.contribution_um(state.index(said.term.candidate)))


def law_covariates(family: Family | Geometry) -> set[str]:
    """The covariates whose free function may contain a law; none for errors of all axes."""
    if isinstance(family, Geometry):
        return set()
    first = family.covariate
    if first == PLACE:
        return {"position", "machine x", "face"}
    if first == "time":
        return {"time", "order"}
    if first == "coordinate":
        axes = [value for value in family.choices.values() if value in ("x", "y", "z")]
        return {"position", *(f"machine {axis}" for axis in axes)}
    return {first}

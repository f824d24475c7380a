"""The hypothesis that is stated: its laws, its forms, and the fit of the laws beside the forms.

The part of rule 3 of :mod:`stepgauge.diagnosis.stating_rules` that needs covariates is here: a free function of time
may contain a step or a drift.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepgauge.diagnosis.fits.marginals import marginalise
from stepgauge.diagnosis.fits.solve import Fitted, Solved, solve
from stepgauge.diagnosis.laws.geometry import Geometry
from stepgauge.diagnosis.laws.library import PLACE, Family
from stepgauge.diagnosis.laws.usual import size_of_shape
from stepgauge.diagnosis.priors import Decision, Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import rms
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

    ``vague``: those of the forms that are laws whose size is not determined, or is none that they can have
    (``impossible``), or that are less probable than what is stated (``weak``), or waves whose amplitude changes
    (``modulated``); ``geometry``: all geometric errors at
    once, if they are stated: none of them has a fit of its own.
    """

    state: Hypothesis
    laws: tuple[StatedTerm, ...]
    forms: tuple[StatedTerm, ...]
    fitted: Fitted
    metric: Metric
    vague: tuple[StatedTerm, ...] = ()
    geometry: tuple[StatedTerm, ...] = ()
    impossible: tuple[StatedTerm, ...] = ()
    weak: tuple[StatedTerm, ...] = ()
    modulated: tuple[StatedTerm, ...] = ()

    @property
    def remainder_um(self) -> Array:
        """What the stated laws move beside their signatures, along the approach, ``(n,)``."""
        places = (self.state.index(one.term.candidate) for one in self.laws)
        return sum((self.state.discrepancy_um(place) for place in places), np.zeros(len(self.state.residual_um)))


def make_model(search: Search, answer: Posterior, data: Residuals, priors: Priors) -> Model:
    """The hypothesis that is stated, by rules 1 to 3."""
    state, every = stated_terms(search, answer, priors.decision.stated)
    laws, forms = ([one for one in every if one.named is named] for named in (True, False))
    model = fit_laws(search, state, laws, forms, data)
    vague = [one for one in laws if not is_determined(state, one.term, priors.decision.determined)]
    apart = [*vague, *_within_forms(laws, forms, state)]
    if apart:
        kept = [one for one in laws if one not in apart]
        model = fit_laws(search, state, kept, [*forms, *apart], data)
    return replace(model, vague=tuple(vague))


def fit_laws(
    search: Search, state: Hypothesis, every: list[StatedTerm], forms: list[StatedTerm], data: Residuals
) -> Model:
    """All stated laws fitted together, beside the ``forms`` and what is combined, which are nuisances of that fit."""
    geometry = [one for one in every if one.lead.candidate.combined]
    laws = [one for one in every if one not in geometry]
    beside = [one.term.nuisance for one in (*forms, *geometry)]
    beside += [(one.term.discrepancy, one.term.sds[one.term.n_amplitudes :]) for one in laws]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    fitted = solve([law_of_expected_size(one, state) for one in laws], [one.term.atom for one in laws], data, metric)
    told_laws = marginalise(fitted, data, metric)
    return Model(state, tuple(laws), tuple(forms), told_laws, metric, geometry=tuple(geometry))


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


def drop_doubtful(
    model: Model, search: Search, answer: Posterior, data: Residuals, priors: Priors, wider: float
) -> Model:
    """The model without laws that are less probable than ``stated``, not possible or not determined (rule 3).

    ``wider``: factor on the uncertainties.
    """
    pairs = list(zip(model.laws, model.fitted.solved, strict=True))
    impossible = tuple(said for said, solved in pairs if not solved.is_possible)
    modulated = tuple(_modulated(pairs, data))
    lost = _misfits(model, search, data, wider)
    vague = [said for said, solved in pairs if not _is_sure(said, solved, model.state, answer, priors, wider)]
    vague += [
        said for said, solved in pairs if lost and said not in vague and not _stands(solved, priors.decision, wider)
    ]
    vague += [one for one in (*impossible, *modulated) if one not in vague]
    vague += [one for one in model.geometry if not sign_is_sure(one, model.state, answer, priors.decision, wider)]
    several = answer.alternatives(LEAST_ODDS)
    known = [one for one in (*model.laws, *model.geometry) if one not in vague]
    weak = [one for one in known if law_probability(one, answer, several, priors.decision) < priors.decision.stated]
    vague += weak
    if not vague:
        return model
    kept = [one for one in (*model.laws, *model.geometry) if one not in vague]
    fewer = fit_laws(search, model.state, kept, [*model.forms, *vague], data)
    every = (*model.vague, *vague)
    return replace(fewer, vague=every, impossible=impossible, weak=tuple(weak), modulated=modulated)


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


def _misfits(model: Model, search: Search, data: Residuals, wider: float) -> bool:
    """Whether the laws as they were fitted leave more than the scatter, with what they move beside their signatures.

    That is of the hypothesis, in whose shapes a law may move more beside its signature than by it.
    """
    state, beside = model.state, [one.term.nuisance for one in (*model.forms, *model.geometry)]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    shares = (one.displacement_um(data) for one in model.fitted.solved)
    left = metric(data.um - sum(shares, model.remainder_um))
    return float(left @ left) * wider**2 > MISFIT * len(left)


def _stands(solved: Solved, decision: Decision, wider: float) -> bool:
    """Whether the size of a law as it was fitted is told from none, as that must be where the fit is bad.

    Its probability is that of other shapes then, which the fit has left.
    """
    linear = {p.name for p in type(solved.effect).parameters() if p.role == "linear"}
    sizes = [one for name, one in solved.parameters.items() if name in linear and one.u is not None]
    return not sizes or any(abs(one.value) > decision.determined * (one.u or 0.0) * wider for one in sizes)


def _is_sure(
    said: StatedTerm, solved: Solved, state: Hypothesis, answer: Posterior, priors: Priors, wider: float
) -> bool:
    """Whether a law is determined, also beside all shapes of the others where its size is its only parameter."""
    known = [(one.value, one.u) for one in solved.parameters.values() if one.u is not None]
    if len(known) == 1 and solved.family.directions is None:
        value, u = known[0]
        if abs(value) < priors.decision.determined * u * wider:
            return False
    return sign_is_sure(said, state, answer, priors.decision, wider)


def _within_forms(laws: list[StatedTerm], forms: list[StatedTerm], state: Hypothesis) -> list[StatedTerm]:
    """The laws that a form may contain (rule 3).

    Over their own covariate, or with nearly all of their signature. Of the latter, and of oscillations, those that are
    smaller than the form: one that stands out of it is no part of it.
    """

    def contains(form: StatedTerm, one: StatedTerm) -> bool:
        own = form.lead.candidate.kind in law_covariates(one.source)
        if own and not _oscillates(one.source):
            return True
        return term_rms_um(one, state) < term_rms_um(form, state) and (
            own or _spanned(one.term.columns, form.term.columns)
        )

    return [one for one in laws if any(contains(form, one) for form in forms)]


def _spanned(columns: Array, others: Array) -> bool:
    """Whether columns ``(d, n)`` are nearly sums of others ``(m, n)``."""
    left = columns - np.linalg.lstsq(others.T, columns.T, rcond=None)[0].T @ others
    return bool(np.linalg.norm(left) < SPANNED * np.linalg.norm(columns))


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

"""From probabilities to the statements on a recording, by rules 1 to 3 of :mod:`stepgauge.diagnosis.statements`.

The part of rule 3 that needs covariates is here: a free function of time may contain a step or a drift.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import covariates, mask
from stepgauge.diagnosis.fits.marginals import with_marginals
from stepgauge.diagnosis.fits.solve import Estimate, Fitted, Solved, solve, widened
from stepgauge.diagnosis.forms.form import SMOOTH, Form
from stepgauge.diagnosis.forms.words import UNDETERMINED, located, regime
from stepgauge.diagnosis.laws.beside import follows_with_lag
from stepgauge.diagnosis.laws.geometry import Geometry, moved_um
from stepgauge.diagnosis.laws.library import Family
from stepgauge.diagnosis.laws.usual import size_of_shape
from stepgauge.diagnosis.output.words import listed, name_of
from stepgauge.diagnosis.priors import Decision, Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, FindingMember, Located, Replacement, rms
from stepgauge.diagnosis.statements import (
    LEAST_ODDS,
    Said,
    determined,
    instead,
    one_of_each_kind,
    rival_laws,
    set_probability,
    spread_factor,
    sure,
    together,
    told,
)
from stepgauge.files.notation import rounded
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import Alternative, Member, Posterior
from stepgauge.inference.problem import Candidate
from stepgauge.inference.search import Search

Array = NDArray[np.float64]
FAINT = 0.3
"""Share of the largest weight below which a reading has too little information on a form."""
TOLD_BESIDE = 0.3
"""Share of the scatter from which what a law moves beside its signature is remarked on."""
SPANNED = 0.05
"""Share of a law's signature, left by a form, below which the form may contain the law."""
MOST_FORMS = 3
"""Largest number of covariates that are stated for a place without a law."""


@dataclass(frozen=True)
class Model:
    """The hypothesis that is stated: laws, forms, and the fit of the laws beside the forms.

    ``vague``: those of the forms that are laws whose size is not determined, or is none that they can have
    (``impossible``); ``geometry``: all geometric errors at once, if they are stated: none of them has a fit of its own.
    """

    state: Hypothesis
    laws: tuple[Said, ...]
    forms: tuple[Said, ...]
    fitted: Fitted
    metric: Metric
    vague: tuple[Said, ...] = ()
    geometry: tuple[Said, ...] = ()
    impossible: tuple[Said, ...] = ()

    @property
    def beside_um(self) -> Array:
        """What the stated laws move beside their signatures, along the approach, ``(n,)``."""
        places = (self.state.index(one.term.candidate) for one in self.laws)
        return sum((self.state.discrepancy_um(place) for place in places), np.zeros(len(self.state.residual_um)))


def make_model(search: Search, answer: Posterior, data: Residuals, priors: Priors) -> Model:
    """The hypothesis that is stated, by rules 1 to 3."""
    state, every = told(search, answer, priors.decision.stated)
    laws, forms = ([one for one in every if one.named is named] for named in (True, False))
    model = _fitted(search, state, laws, forms, data)
    vague = [one for one in laws if not determined(state, one.term, priors.decision.determined)]
    apart = [*vague, *_within_forms(laws, forms, state)]
    if apart:
        kept = [one for one in laws if one not in apart]
        model = _fitted(search, state, kept, [*forms, *apart], data)
    return replace(model, vague=tuple(vague))


def _fitted(search: Search, state: Hypothesis, every: list[Said], forms: list[Said], data: Residuals) -> Model:
    geometry = [one for one in every if one.lead.candidate.combined]
    laws = [one for one in every if one not in geometry]
    beside = [one.term.nuisance for one in (*forms, *geometry)]
    beside += [(one.term.discrepancy, one.term.sds[one.term.n_amplitudes :]) for one in laws]
    metric = Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)
    fitted = solve([_expected(one, state) for one in laws], [one.term.atom for one in laws], data, metric)
    told_laws = with_marginals(fitted, data, metric)
    return Model(state, tuple(laws), tuple(forms), told_laws, metric, geometry=tuple(geometry))


def _expected(said: Said, state: Hypothesis) -> Family:
    """A law with the size that is expected of it in the hypothesis that is stated.

    Where no reading tells a component of a free direction, it is as large as such a law is usually, and not as it can
    be at most.
    """
    candidate = said.lead.candidate
    place = state.index_of(said.term)
    sd = said.term.sd if place is None else candidate.sizes.expected(state.size_log_evidence[place])
    return _of_size(candidate.source, said.term.atom, sd)


def _of_size(family: Family, atom: int, sd: float) -> Family:
    return replace(family, prior=sd * size_of_shape(family.kind, family.atoms[atom], family.atoms))


def with_doubts(
    model: Model, search: Search, answer: Posterior, data: Residuals, priors: Priors, wider: float
) -> Model:
    """The model without laws that are not determined (rule 3) with uncertainties times ``wider``, or not possible."""
    pairs = list(zip(model.laws, model.fitted.solved, strict=True))
    impossible = tuple(said for said, solved in pairs if not solved.is_possible)
    vague = [said for said, solved in pairs if not _is_sure(said, solved, model.state, answer, priors, wider)]
    vague += [one for one in impossible if one not in vague]
    vague += [one for one in model.geometry if not sure(one, model.state, answer, priors.decision, wider)]
    if not vague:
        return model
    kept = [one for one in (*model.laws, *model.geometry) if one not in vague]
    fewer = _fitted(search, model.state, kept, [*model.forms, *vague], data)
    return replace(fewer, vague=(*model.vague, *vague), impossible=impossible)


def _is_sure(said: Said, solved: Solved, state: Hypothesis, answer: Posterior, priors: Priors, wider: float) -> bool:
    """Whether a law is determined, also beside all shapes of the others where its size is its only parameter."""
    known = [(one.value, one.u) for one in solved.parameters.values() if one.u is not None]
    if len(known) == 1 and solved.family.directions is None:
        value, u = known[0]
        if abs(value) < priors.decision.determined * u * wider:
            return False
    return sure(said, state, answer, priors.decision, wider)


def _within_forms(laws: list[Said], forms: list[Said], state: Hypothesis) -> list[Said]:
    """The laws that a form may contain (rule 3).

    Over their own covariate, or with nearly all of their signature. Of the latter, and of oscillations, those that are
    smaller than the form: one that stands out of it is no part of it.
    """

    def contains(form: Said, one: Said) -> bool:
        own = form.lead.candidate.kind in _lives_in(one.source)
        if own and not _oscillates(one.source):
            return True
        return _rms_um(one, state) < _rms_um(form, state) and (own or _spanned(one.term.columns, form.term.columns))

    return [one for one in laws if any(contains(form, one) for form in forms)]


def _spanned(columns: Array, others: Array) -> bool:
    """Whether columns ``(d, n)`` are nearly sums of others ``(m, n)``."""
    left = columns - np.linalg.lstsq(others.T, columns.T, rcond=None)[0].T @ others
    return bool(np.linalg.norm(left) < SPANNED * np.linalg.norm(columns))


def _oscillates(family: Family) -> bool:
    return family.law is not None and family.law.phase() is not None


def _rms_um(said: Said, state: Hypothesis) -> float:
    """Root mean square of the displacement of a term."""
    return rms(state.contribution_um(state.index(said.term.candidate)))


def _lives_in(family: Family | Geometry) -> set[str]:
    """The covariates whose free function may contain a law; none for errors of all axes."""
    if isinstance(family, Geometry):
        return set()
    assert family.law is not None
    first = family.law.covariates[0]
    if first == "time":
        return {"time", "order"}
    if first == "coordinate":
        axes = [value for value in family.choices.values() if value in ("x", "y", "z")]
        return {"position", *(f"machine {axis}" for axis in axes)}
    return {first}


def findings(model: Model, answer: Posterior, data: Residuals, priors: Priors, wider: float) -> Iterator[Finding]:
    """The laws that are stated; ``wider``: factor on uncertainties from the predictive check."""
    several = answer.alternatives(LEAST_ODDS)
    for said, solved in zip(model.laws, model.fitted.solved, strict=True):
        every = rival_laws(said, priors.decision)
        fits = {one.candidate.label: _in_place(one, said, model, data) for one in every if not one.candidate.combined}
        # the stated one was possible when the others were told, and stays
        rivals = [
            one for one in every if one is said.lead or one.candidate.combined or fits[one.candidate.label].is_possible
        ]
        label = said.lead.candidate.label
        combined = instead(several, label, solved.family.kind, priors.decision)
        probability = set_probability(answer, every, combined)
        alone = set_probability(answer, every, []) / max(probability, 1e-300)
        possible = sum(one.probability for one in rivals) / sum(one.probability for one in every)
        kinds = tuple(dict.fromkeys(one.candidate.kind for one in rivals if one.candidate.kind != solved.family.kind))
        same = tuple(
            dict.fromkeys(
                one.candidate.source.label
                for one in rivals
                if one.candidate.kind == solved.family.kind and one.candidate.source.label != solved.family.label
            )
        )
        wide = widened(solved.parameters, spread_factor(answer, model.state, label, priors.decision.in_set) * wider)
        yield Finding(
            solved.family.kind,
            solved.family.label,
            solved.effect,
            choices_of(solved),
            wide,
            probability,
            solved.displacement_um(data),
            own=min(answer.probability([label]) / possible, probability),
            confounded_with=tuple(dict.fromkeys((*kinds, *together(combined)))),
            alternatives=same,
            members=tuple(_members(rivals, fits, alone, wide)),
            several=_replacements(several, label),
            where=solved.effect.when or "",
        )
    yield from (_of_geometry(one, several, model, answer, data, priors, wider) for one in model.geometry)


def _replacements(several: list[Alternative], label: str) -> tuple[Replacement, ...]:
    """Combinations of laws in place of one and perhaps of others, the most probable first."""
    found: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = {}
    for one in several:
        if label in one.gone and all(c.named for c in one.come):
            come = tuple(sorted(c.source.label for c in one.come))
            others = tuple(sorted(other.partition(" #")[0] for other in one.gone if other != label))
            found[come, others] = max(found.get((come, others), 0.0), one.odds)
    return tuple(Replacement(*key, odds) for key, odds in sorted(found.items(), key=lambda item: -item[1]))


def _of_geometry(
    said: Said,
    several: list[Alternative],
    model: Model,
    answer: Posterior,
    data: Residuals,
    priors: Priors,
    wider: float,
) -> Finding:
    """All geometric errors at once, as the readings without the other laws tell them."""
    term, state, geometry, decision = said.term, model.state, said.source, priors.decision
    place = state.index(term.candidate)
    left_um = data.um - sum((solved.displacement_um(data) for solved in model.fitted.solved), np.zeros(len(data)))
    mean = term.sd**2 * (model.metric(term.columns) @ model.metric(left_um))
    effects = geometry.effects(mean)
    estimates = geometry.estimates(mean, state.amplitudes(place)[1], term.sd)
    label, rivals = term.candidate.label, rival_laws(said, decision)
    combined = instead(several, label, label, decision)
    return Finding(
        geometry.kind,
        label,
        None,
        {},
        widened(estimates, spread_factor(answer, state, label, decision.in_set) * wider),
        set_probability(answer, rivals, combined),
        moved_um(effects, data),
        own=answer.probability([label]),
        confounded_with=tuple(dict.fromkeys((*(one.candidate.kind for one in rivals[1:]), *together(combined)))),
        effects=effects,
    )


def _members(
    rivals: list[Member], fits: dict[str, Solved], alone: float, own: dict[str, Estimate]
) -> Iterator[FindingMember]:
    """All laws of a set, each with its own values from a fit in its place; none for a set of one.

    The stated one is first and has its ``own`` values; ``alone``: their share of the probability of the finding, of
    which combinations have the rest.
    """
    if len(rivals) < 2:
        return
    total = sum(one.probability for one in rivals)
    for one in (one for one in rivals if not one.candidate.combined):
        solved = fits[one.candidate.label]
        parameters, share = own if one is rivals[0] else solved.parameters, alone * one.probability / total
        yield FindingMember(
            solved.family.kind, solved.family.label, share, solved.effect, choices_of(solved), parameters
        )


def _in_place(rival: Member, said: Said, model: Model, data: Residuals) -> Solved:
    """A law as it is fitted in the place of a stated one, beside the other laws."""
    place = model.laws.index(said)
    if rival is said.lead:
        return model.fitted.solved[place]
    families = [_expected(one, model.state) for one in model.laws]
    atoms = [one.term.atom for one in model.laws]
    families[place], atoms[place] = (
        _of_size(rival.candidate.source, rival.proposal.atom, rival.proposal.sd),
        rival.proposal.atom,
    )
    return solve(families, atoms, data, model.metric).solved[place]


def choices_of(solved: Solved) -> dict[str, object]:
    """Axis, face, ... of an effect, and its fitted direction."""
    if solved.family.directions is None:
        return dict(solved.family.choices)
    return {**solved.family.choices, "direction": getattr(solved.effect, "direction", None)}


def _vague(said: Said, model: Model, answer: Posterior, data: Residuals) -> Located:
    """A place in which a law fits with a size that is not determined, or not possible: structure without a name."""
    where = covariate_of(said.source, data)
    why = "but larger than that can be" if said in model.impossible else "whose size this recording does not determine"
    words = f"similar to {name_of(said.source.label)}, {why}"
    return Located(where, "both", UNDETERMINED, words, 1.0, answer.probability([said.lead.candidate.label]))


def covariate_of(family: Family | Geometry, data: Residuals) -> str:
    """What a law depends on, of what this recording varies; the position where it varies nothing of that."""
    varied = {one.name for one in covariates(data)} | {"azimuth"}
    return min(_lives_in(family) & varied, default="position")


def unexplained(model: Model, answer: Posterior, data: Residuals, priors: Priors, wider: float) -> Iterator[Located]:
    """The forms that are stated, one to a covariate, the most probable first; ``wider``: see :func:`findings`."""
    doubtful = [
        one
        for one in model.forms
        if one.named and (one in model.vague or not sure(one, model.state, answer, priors.decision, wider))
    ]
    expected = _by_another(doubtful, model, answer, priors.decision)
    yield from (_vague(one, model, answer, data) for one in doubtful if one not in expected)
    for said in (one for one in model.forms if not one.named):
        least = max(priors.decision.in_set, said.lead.probability / priors.decision.excluded)
        likely = (one for one in one_of_each_kind(said.place, False) if one.probability >= least)
        for one in islice(likely, MOST_FORMS):
            labels = [r.candidate.label for r in said.place.members if r.candidate.kind == one.candidate.kind]
            form = located(one.candidate, one.proposal.atom, answer.probability(labels), fitted=_fitted_shape(one))
            part = _regime(said, model, data) if one is said.lead else ""
            yield replace(form, where=f"{form.where}, {part}") if part else form


def _by_another(doubtful: Sequence[Said], model: Model, answer: Posterior, decision: Decision) -> list[Said]:
    """Laws that are there since another axis has them, and not by the readings: without a size they are no findings."""
    found = [one for one in doubtful if one.lead.proposal.company > 0.0]
    without = answer.search.without(model.state, *(model.state.index(one.term.candidate) for one in found))
    needed = model.state.log_posterior - without.log_posterior > float(np.log(decision.excluded))
    return [] if needed else found


def _fitted_shape(rival: Member) -> Any:
    """The shape of a form that was fitted between those of the grid, None if it is one of the grid."""
    return None if rival.hypothesis is None else rival.hypothesis.terms[rival.hypothesis.index(rival.candidate)].shape


def _regime(said: Said, model: Model, data: Residuals) -> str:
    """The part of the record in which a smooth form differs from the rest, in words; empty for all of it."""
    form: Form = said.lead.candidate.source
    place = model.state.index_of(said.term)
    covariate = next((one for one in covariates(data) if one.name == form.covariate), None)
    if form.shape != SMOOTH or form.beside or place is None or covariate is None:
        return ""
    x, unit = covariate.values, form.unit or "as recorded" * covariate.further
    mean, covariance = model.state.amplitudes(place)
    share = mask(data, form.side)
    seen = np.abs(share) > FAINT * np.abs(share).max()
    columns = said.term.columns[:, seen] / share[seen]
    return regime(x[seen], columns, mean, covariance, f" {unit}".rstrip())


def nearest_laws(model: Model, answer: Posterior) -> Iterator[str]:
    """The odds against what is nearest to a stated form, a law or several together, in words."""
    several = answer.alternatives(LEAST_ODDS)
    for said in model.forms:
        own, rivals = said.lead.candidate.label, said.place.members
        laws: list[tuple[float, tuple[Candidate, ...]]] = []
        laws += [(one.probability / said.lead.probability, (one.candidate,)) for one in rivals if one.candidate.named]
        laws += [(one.odds, one.come) for one in several if own in one.gone and all(c.named for c in one.come)]
        if said.named or not laws:
            continue
        odds, nearest = max(laws, key=lambda one: one[0])
        names = listed([name_of(one.source.label) for one in nearest])
        what = f"{names} is the nearest law" if len(nearest) == 1 else f"{names} together are nearest"
        yield f"{what}; the form is {_times(1.0 / max(odds, 1e-300))} times as probable"


def inexact_laws(model: Model) -> Iterator[str]:
    """What stated laws move beside their signatures, where it is seen, in words."""
    for one in model.laws:
        beside_um = rms(model.state.discrepancy_um(model.state.index(one.term.candidate)))
        if beside_um > TOLD_BESIDE * model.state.sigma_um:
            percent = 100.0 * beside_um / _rms_um(one, model.state)
            share = f"{rounded(beside_um, 2)} um rms, {rounded(percent, 1)} % of it"
            why = ", or to what its temperature did in pauses: record it all the time"
            yield (
                f"{name_of(one.source.label)} is not exactly of this shape: {share}, are put down to that"
                f"{why * follows_with_lag(one.source)}"
            )


def _times(odds: float) -> str:
    return rounded(odds, 2) if odds < 1e4 else f"10^{np.log10(odds):.0f}"

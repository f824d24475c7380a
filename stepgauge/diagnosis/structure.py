"""Structure for which no law is stated: where it is, in its best description, and what is nearest to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from stepgauge.diagnosis.covariates import covariates, mask
from stepgauge.diagnosis.gaussian_processes.random_function import BEAT, LEVELS, PERIODIC, SMOOTH, WAVE, RandomFunction
from stepgauge.diagnosis.laws.discrepancy import follows_with_lag
from stepgauge.diagnosis.laws.geometry import Geometry
from stepgauge.diagnosis.laws.grids import finest_period_mm
from stepgauge.diagnosis.laws.library import Family
from stepgauge.diagnosis.priors import Decision, Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Located, Replacement, rms
from stepgauge.diagnosis.stated_model import Model, law_covariates, term_rms_um
from stepgauge.diagnosis.stating_rules import (
    LEAST_ODDS,
    StatedTerm,
    presence_probability,
    sign_is_sure,
)
from stepgauge.diagnosis.wording.phrases import Phrase, number
from stepgauge.diagnosis.wording.structure import UNDETERMINED, located, regime
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.inference.posterior import AlternativeHypothesis, Posterior
from stepgauge.inference.problem import Candidate

FAINT = 0.3
"""Share of the largest weight below which a reading has too little information on a form."""
NOTED_DISCREPANCY = 0.3
"""Share of the scatter from which what a law moves that its signature does not is remarked on."""
SEEN_HARMONIC = 16.0
"""Chi-square (two degrees of freedom) from which a harmonic of a wave is there."""
WHOLE = 0.05
"""Largest difference of a number of periods from a whole number."""
INDICES = ("order", "cycle")
"""Covariates that only count the rows of a file."""
MOST_NEAREST = 3
"""Largest number of laws, or of several together, that are named in place of a form."""


def _undetermined(statement: StatedTerm, model: Model, answer: Posterior, data: Residuals) -> Located:
    """A law that fits and is not stated: structure without a name."""
    phrase = {"say": model.doubts.get(statement.label, "similar"), "law": statement.source.label}
    if phrase["say"] == "weak":
        phrase["probability"] = number(answer.probability_of_any([frozenset({statement.label})]))
    where = covariate_of(statement.source, data)
    return Located(where, "both", UNDETERMINED, [phrase], 1.0, presence_probability(statement, answer))


def covariate_of(family: Family | Geometry, data: Residuals) -> str:
    """What a law depends on, of what this recording varies; the position where it varies nothing of that."""
    varied = {one.name for one in covariates(data)} | {"azimuth"}
    return min(law_covariates(family) & varied, default="position")


def structure(model: Model, answer: Posterior, data: Residuals, priors: Priors) -> Iterator[Located]:
    """The structure that no stated law explains, one description to each."""

    def is_doubtful(one: StatedTerm) -> bool:
        return one.label in model.doubts or not sign_is_sure(one, model.state, answer, priors.decision, model.wider)

    doubtful = [one for one in model.forms if one.named and is_doubtful(one)]
    expected = _terms_of_another_axis(doubtful, model, answer, priors.decision)
    yield from (_undetermined(one, model, answer, data) for one in doubtful if one not in expected)
    several = answer.alternatives(LEAST_ODDS)
    within = [one for one in model.forms if one.named and one not in doubtful]
    for statement in (one for one in model.forms if not one.named):
        moved_um = _expected_um([statement, *within], model, data)
        within = []  # the laws that structure may contain (rule 3) are told in its first curve, and nowhere else
        form = _described(statement, model, answer, data, priors)
        yield replace(form, laws=_nearest(statement, several), share_um=moved_um)


def _expected_um(statements: Sequence[StatedTerm], model: Model, data: Residuals) -> Array:
    """What terms move together, by their expectation in the search ``(n,)``; empty where they have none there."""
    places = [place for one in statements if (place := model.state.index_of(one.term)) is not None]
    if not places:
        return np.zeros(0)
    return data.without_origins(np.sum([model.state.contribution_um(place) for place in places], axis=0))


def _described(statement: StatedTerm, model: Model, answer: Posterior, data: Residuals, priors: Priors) -> Located:
    """A form in its best description, with the probability of all forms over its covariate.

    Where that is less than ``stated``, the probability is that of all forms there, and the other covariates are
    named.
    """
    lead, others = statement.lead, [one for one in statement.credible_set.members if not one.candidate.named]
    own = answer.probability_of_any(
        frozenset({one.candidate.label}) for one in others if one.candidate.kind == lead.candidate.kind
    )
    there = lead.hypothesis  # with its shape, if that was fitted between those of the grid
    fitted = None if there is None else there.terms[there.index(lead.candidate)].shape
    form = _reduce_harmonics(statement, model, located(lead.candidate, lead.proposal.atom, own, fitted=fitted))
    form = _told_by_target(form, data)
    phrases = [*_without_index(form), *_regime(statement, model, data), *_finer_periods(form, data)]
    if own >= priors.decision.stated:
        return replace(form, phrases=phrases)
    near = [one for one in others if one.probability >= priors.decision.in_set]
    names = dict.fromkeys(one.candidate.source.covariate for one in near)
    rest = [name for name in names if name != form.covariate]
    if rest:
        phrases.append({"say": "or_function", "covariates": rest})
    probability = answer.probability_of_any(frozenset({one.candidate.label}) for one in others)
    return replace(form, phrases=phrases, probability=probability)


def _reduce_harmonics(statement: StatedTerm, model: Model, form: Located) -> Located:
    """A wave with the period that it has, where a multiple of that was fitted and has overtones only.

    What repeats after a period repeats after two of them: its fundamental and odd overtones are not there.
    """
    index = model.state.index_of(statement.term)
    if form.form != WAVE or index is None or not isinstance(form.numbers, float):
        return form
    mean, covariance = model.state.amplitudes(index)
    count = len(mean) // 2
    pairs = [[k, k + count] for k in range(count)]
    far = [mean[k] @ np.linalg.pinv(covariance[np.ix_(k, k)]) @ mean[k] for k in pairs]
    there = [number for number, one in enumerate(far, 1) if one > SEEN_HARMONIC]
    order = int(np.gcd.reduce(there)) if there else 1
    if order == 1:
        return form
    period, (first, *others) = form.numbers / order, form.phrases
    phrases = [{**first, "period": {**first["period"], "value": period}}, *others]
    return replace(form, numbers=period, phrases=phrases)


def _told_by_target(form: Located, data: Residuals) -> Located:
    """A wave in the order of rows that repeats from cycle to cycle, along an axis, as what each target has by itself.

    Where every cycle visits the same targets in the same order, both are one column.
    """
    if data.probings.setting.recording == "gauge" or form.covariate != "order" or form.form != WAVE:
        return form
    cycles = [rows["face"].tolist() for _, rows in data.frame.groupby(["placement", "cycle"], sort=False)]
    count = len(cycles[0]) / form.numbers if isinstance(form.numbers, float) else 0.5
    if any(one != cycles[0] for one in cycles) or abs(count - round(count)) > WHOLE:
        return form
    phrases = ({"say": "levels", "covariate": "face"}, {"say": "approach"})
    return replace(form, covariate="face", side="approach", form=LEVELS, numbers=None, phrases=phrases)


def _finer_periods(form: Located, data: Residuals) -> Iterator[Phrase]:
    """That what is alike in both directions at each place may be a period too short to be told."""
    finest_mm = finest_period_mm(data)
    alike = any(one["say"] == "gauge" for one in form.phrases)
    if finest_mm is not None and alike and form.covariate in ("face", "position") and form.form not in PERIODIC:
        yield {"say": "finer", "period": number(finest_mm, "mm")}


def _without_index(form: Located) -> Sequence[Phrase]:
    """The phrases of a form; a period in numbers of readings or cycles is an index of a table, and is not told."""
    if form.covariate not in INDICES or form.form not in (*PERIODIC, BEAT):
        return form.phrases
    return [{"say": "index", "covariate": form.covariate}, *form.phrases[1:]]


def _terms_of_another_axis(
    doubtful: Sequence[StatedTerm], model: Model, answer: Posterior, decision: Decision
) -> list[StatedTerm]:
    """Laws that are there since another axis has them, and not by the readings: without a size they are no findings."""
    found = [one for one in doubtful if one.lead.proposal.company > 0.0]
    without = answer.search.without(model.state, *(model.state.index(one.term.candidate) for one in found))
    needed = model.state.log_posterior - without.log_posterior > float(np.log(decision.excluded))
    return [] if needed else found


def _regime(statement: StatedTerm, model: Model, data: Residuals) -> list[Phrase]:
    """The part of the record in which a smooth form differs from the rest, as a phrase; none for all of it."""
    form: RandomFunction = statement.lead.candidate.source
    index = model.state.index_of(statement.term)
    covariate = next((one for one in covariates(data) if one.name == form.covariate), None)
    if form.shape != SMOOTH or form.beside or index is None or covariate is None:
        return []
    x, unit = covariate.values, form.unit or "as recorded" * covariate.further
    mean, covariance = model.state.amplitudes(index)
    weight = mask(data, form.side)
    seen = np.abs(weight) > FAINT * np.abs(weight).max()
    columns = statement.term.columns[:, seen] / weight[seen]
    return regime(x[seen], columns, mean, covariance, unit)


def _nearest(statement: StatedTerm, several: Sequence[AlternativeHypothesis]) -> tuple[Replacement, ...]:
    """Laws, one or several together, that may be in the place of a form, the most probable first."""
    own, lead = statement.lead.candidate.label, statement.lead.probability
    laws: list[tuple[tuple[Candidate, ...], float]] = []
    laws += [
        ((one.candidate,), one.probability / lead) for one in statement.credible_set.members if one.candidate.named
    ]
    laws += [(one.come, one.odds) for one in several if own in one.gone and all(c.named for c in one.come)]
    found: dict[tuple[str, ...], float] = {}
    for come, odds in laws:
        names = tuple(sorted(one.source.label for one in come))
        found[names] = max(found.get(names, 0.0), odds)
    return tuple(Replacement(*one) for one in sorted(found.items(), key=lambda item: -item[1])[:MOST_NEAREST])


def inexact_laws(model: Model) -> Iterator[Phrase]:
    """What stated laws move that their signatures do not, where it is seen."""
    for one in model.laws:
        discrepancy_um = rms(model.state.discrepancy_um(model.state.index(one.term.candidate)))
        if discrepancy_um > NOTED_DISCREPANCY * model.state.sigma_um:
            percent = 100.0 * discrepancy_um / term_rms_um(one, model.state)
            sizes = {"size": number(discrepancy_um, "um"), "percent": rounded(percent, 1)}
            shape = {"lag": follows_with_lag(one.source), "wave": bool(one.source.law.phase())}
            yield {"say": "inexact", "law": one.source.label, **sizes, **{k: str(v or "") for k, v in shape.items()}}

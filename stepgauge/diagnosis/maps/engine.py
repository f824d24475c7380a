"""From a map and a probe file to the statements: the search, and the same rules as for recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.credible import (
    LEAST_ODDS,
    SURE_OUTLIER,
    StatedTerm,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
    spread_factor,
    structure_alone,
)
from stepgauge.diagnosis.fits.solve import Estimate, widened
from stepgauge.diagnosis.maps.candidates import EMPIRICAL, GAUGE_KINDS, ProbeChange, candidates_for, empirical
from stepgauge.diagnosis.maps.fit import FittedChanges
from stepgauge.diagnosis.maps.forms import DIRECTION, DirectionForm, quantity_words
from stepgauge.diagnosis.maps.holdout import Stage, fits_of
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel, Terms, changed_table, check_model
from stepgauge.diagnosis.maps.parameters import estimates
from stepgauge.diagnosis.maps.problem import MapRows, lacking
from stepgauge.diagnosis.maps.result import OUTLIERS, EmpiricalMapLaw, MapDiagnosis, MapFinding, MapRival
from stepgauge.diagnosis.maps.scatter import MapScatter, estimate_scatter
from stepgauge.diagnosis.maps.search import SearchedMap, form_of, searched
from stepgauge.diagnosis.maps.separate import reason, separate
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.result import Located, Verdict
from stepgauge.diagnosis.statements import conclude
from stepgauge.diagnosis.wording.notation import name_of
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.files.arrays import Array
from stepgauge.inference.noise_models import OUTLYING
from stepgauge.inference.posterior import AlternativeHypothesis

HALF_A_DIGIT = 0.5 + 1e-6
SIX_DIGITS = 5.1e-6
"""Relative resolution of six printed digits."""


def diagnose_map(
    model: MapModel, candidates: Sequence[ProbeChange] | None = None, priors: Priors | None = None
) -> MapDiagnosis:
    """The diagnosis of a map; without ``candidates`` all possible changes of the model of the probe are tried.

    Raises :class:`InputError` for a probe file that does not give the measured quantities.
    """
    check_model(model)
    scatter = estimate_scatter(model.data, model.residuals(()))
    missing = lacking(model.data)
    if missing:
        return _as_it_is("insufficient", model, scatter, missing)
    if _reproduced(model):
        return _as_it_is("adequate", model, scatter)
    if candidates is None:
        candidates = candidates_for(model.table, [m.name for m in model.data.measured])
    return _told(searched(model, candidates, scatter, priors or shipped_priors()), scatter)


def _reproduced(model: MapModel) -> bool:
    """Whether the probe file gives every printed value: the residuals are rounding and no scatter."""
    pairs = zip(model.data.measured, model.residuals(()), strict=True)
    return all((np.abs(r) <= np.maximum(HALF_A_DIGIT * m.quantum, SIX_DIGITS * m.values)).all() for m, r in pairs)


def _as_it_is(verdict: Verdict, model: MapModel, scatter: MapScatter, missing: tuple[str, ...] = ()) -> MapDiagnosis:
    """The unchanged residuals; the scatter is known from repeats or not at all."""
    kept, rows = np.ones(len(model.data), bool), MapRows(model, scatter.sigma)
    known = scatter.repeats or not missing
    none = np.zeros((0, len(rows.um)))
    by_row = [np.full(len(kept), s if known else np.nan) for s in scatter.sigma]
    fits = fits_of(rows, [(rows.um, none)] * 3, kept, by_row)
    chi2 = float(np.mean(rows.um**2)) if known else np.nan
    return MapDiagnosis(verdict, fits, chi2, chi2, scatter, model.data, kept, model.table, model.table, lacking=missing)


def _told(found: SearchedMap, scatter: MapScatter) -> MapDiagnosis:
    model, kept, by_row = found.rows.model, _kept(found), _by_row(found, scatter)
    findings = [*_findings(found, by_row), *_outliers(found, kept)]
    laws, columns = _laws(found)
    left = [*_unexplained(found), *_vague(found)]
    slight = [one.lead.candidate.label for one in found.slight]
    concluded = conclude(found.answer, findings, left, found.priors.decision, slight)
    terms: Terms = (*found.fitted.terms, *(term for term, _ in laws))
    stages = _stages(found, terms, columns)
    return MapDiagnosis(
        concluded.verdict,
        fits_of(found.rows, stages, kept, by_row),
        _chi2_dof(found, stages[0], kept, by_row),
        _chi2_dof(found, stages[1], kept, by_row),
        _grown(found, scatter),
        model.data,
        kept,
        model.table,
        changed_table(model.table, terms),
        terms,
        concluded.findings,
        tuple(_where(found, concluded.structure)),
        concluded.structure,
        tuple(law for _, law in laws),
        tuple(found.search.trail),
        tuple(_remarks(found)),
        odds=concluded.table,
        checks=found.checks,
    )


def _stages(found: SearchedMap, terms: Terms, columns: Array) -> list[Stage]:
    """Residuals without changes, with the named changes, and with the forms ``columns (k, m)`` in addition."""
    rows, slopes = found.rows, found.fitted.slopes
    named = rows.um - rows.moved(found.fitted.terms)
    return [(rows.um, slopes[:0]), (named, slopes), (rows.um - rows.moved(terms), np.vstack([slopes, columns]))]


def _chi2_dof(found: SearchedMap, stage: Stage, kept: NDArray[np.bool_], by_row: Sequence[Array]) -> float:
    um, slopes = stage
    white = um * np.repeat(found.rows.sigma, len(kept)) / np.concatenate(by_row)
    used = np.tile(kept, len(found.rows.sigma))
    return float((white[used] ** 2).sum()) / max(int(used.sum()) - len(slopes), 1)


# -- the scatter -------------------------------------------------------------------------------------------------------


def _kept(found: SearchedMap) -> NDArray[np.bool_]:
    """Rows ``(n,)`` that are not outliers."""
    outlying, stated = found.state.noise.outlying, found.priors.decision.stated
    if outlying is None or found.answer.probability_of_scatter(OUTLYING) < stated:
        return np.ones(len(found.rows.data), bool)
    off = np.array(np.split(outlying, len(found.rows.sigma))) > SURE_OUTLIER
    return np.asarray(~off.any(axis=0))


def _grown(found: SearchedMap, scatter: MapScatter) -> MapScatter:
    grows = found.answer.probability_of_scatter("growth") >= found.priors.decision.stated
    return replace(scatter, grows=grows and found.state.noise.growth is not None)


def _by_row(found: SearchedMap, scatter: MapScatter) -> list[Array]:
    """Standard deviation of every ordinary row of each quantity: the mean over repeats, else that of the model."""
    state = found.state
    relative = np.sqrt(found.search.noise_models.variance(state.noise) * state.noise.weight)
    found_by = [part * s for part, s in zip(np.split(relative, len(found.rows.sigma)), found.rows.sigma, strict=True)]
    if not scatter.repeats:
        return [one * state.sigma_um for one in found_by]
    return [one * s / float(np.sqrt(np.mean(one**2))) for one, s in zip(found_by, scatter.sigma, strict=True)]


# -- what has a name ---------------------------------------------------------------------------------------------------


def _findings(found: SearchedMap, by_row: Sequence[Array]) -> Iterator[MapFinding]:
    several = found.answer.alternatives(LEAST_ODDS)
    known = estimates(found.rows.model.table, found.fitted)
    for place, parameters in enumerate(known):
        candidate, decision = found.laws[place].lead.candidate, found.priors.decision
        spread = spread_factor(found.answer, found.state, candidate.label, decision.in_set)
        factor = max(spread, float(found.moved_by_slight[place])) * found.wider
        combined = replacements(several, candidate.label, candidate.kind, decision)
        yield _finding(found, place, widened(parameters, factor), combined, by_row)


def _finding(
    found: SearchedMap,
    place: int,
    parameters: dict[str, Estimate],
    combined: Sequence[AlternativeHypothesis],
    by_row: Sequence[Array],
) -> MapFinding:
    said, term = found.laws[place], found.fitted.terms[place]
    candidate, rivals = term.candidate, credible_laws(said, found.priors.decision)
    same = [one for one in rivals if one.candidate.kind == candidate.kind]
    fitted = [(one, found.replacements(place, one)) for one in rivals if one is not said.lead]
    others = [(one.candidate.kind, fit) for one, fit in fitted if one not in same]
    kinds = list(dict.fromkeys(kind for kind, _ in others))
    words, commands = separate(found.rows.model, by_row, [found.fitted, *(fit for _, fit in others)])
    share = _moved(found, term)
    return MapFinding(
        candidate.kind,
        candidate.label,
        None,
        {},
        parameters,
        set_probability(found.answer, rivals, combined),
        found.rows.stacked(list(share.values())),
        own=found.answer.probability([said.lead.candidate.label]),
        confounded_with=(*kinds, *joined_kinds(combined)),
        alternatives=tuple(one.candidate.label for one in same if one is not said.lead),
        reason="; ".join(dict.fromkeys(reason(candidate.kind, kind) for kind in kinds)),
        separate_by=words,
        choice=candidate.choice,
        share=share,
        rivals=tuple(_rival(found, one.probability, fit, place) for one, fit in fitted),
        commands=commands,
    )


def _rival(found: SearchedMap, share: float, fitted: FittedChanges, place: int) -> MapRival:
    changed, parameters = fitted.terms[place].candidate, estimates(found.rows.model.table, fitted)[place]
    return MapRival(changed.kind, changed.label, changed.choice, share, parameters)


def _moved(found: SearchedMap, term: ChangeTerm) -> dict[str, Array]:
    """Influence of a change on each quantity beside the other changes, (n,) by name."""
    rows, without = found.rows, tuple(one for one in found.fitted.terms if one is not term)
    share = rows.parts(rows.moved(found.fitted.terms) - rows.moved(without))
    return {m.name: each for m, each in zip(rows.data.measured, share, strict=True)}


def _outliers(found: SearchedMap, kept: NDArray[np.bool_]) -> Iterator[MapFinding]:
    rows = tuple(map(int, np.flatnonzero(~kept)))
    if rows:
        p = found.answer.probability_of_scatter(OUTLYING)
        yield MapFinding(OUTLIERS, OUTLIERS, None, {}, {}, p, np.zeros(len(found.rows.um)), own=p, rows=rows)


# -- what has none -----------------------------------------------------------------------------------------------------


def _located(form: DirectionForm, shape: int, found: SearchedMap, probability: float, share: float = 1.0) -> Located:
    words = f"{quantity_words(found.rows.data.measured[form.quantity].name)}: {form.words[shape]}"
    return Located(form.covariate, "both", form.name, words, round(share, 4), probability)


def _unexplained(found: SearchedMap) -> Iterator[Located]:
    for said in found.forms:
        same = [one.candidate.label for one in said.place.members if one.candidate.kind == said.lead.candidate.kind]
        yield _located(*form_of(said), found, found.answer.probability(same))


def _vague(found: SearchedMap) -> Iterator[Located]:
    """Places in which a law fits with a size that is not determined."""
    for said in found.vague:
        label = said.lead.candidate.label
        words = f"similar to {name_of(label)}, whose size this map does not determine"
        yield Located(DIRECTION, "both", UNDETERMINED, words, 1.0, found.answer.probability([label]))


def _where(found: SearchedMap, left: Sequence[Located]) -> Iterator[Located]:
    """Forms of the systematic residuals: those that remain, and those before any law is named."""
    yield from left
    known = [said.lead.candidate.kind for said in found.forms]
    least = found.priors.decision.in_set
    for look, probability, share in structure_alone(found.search, found.state, known, least):
        yield _located(look.candidate.source, look.atom, found, probability, share)


def _laws(found: SearchedMap) -> tuple[list[tuple[ChangeTerm, EmpiricalMapLaw]], Array]:
    """The forms as laws of the probe file, with the derivatives ``(k, m)`` by their coefficients."""
    forms = [said for said in found.forms if form_of(said)[0].terms[form_of(said)[1]]]
    if not forms:
        return [], np.zeros((0, len(found.rows.um)))
    columns = np.vstack([said.term.columns for said in forms])
    sd = np.concatenate([np.full(len(said.term.columns), said.term.sd) for said in forms])
    white = found.metric(columns)
    covariance = np.linalg.inv(white @ white.T + np.diag(sd**-2.0))
    left = found.metric(found.rows.um - found.rows.moved(found.fitted.terms))
    amplitudes = covariance @ white @ left
    laws, first = [], 0
    for said in forms:
        own = slice(first, first + len(said.term.columns))
        laws.append(_law(found, said, amplitudes[own], np.sqrt(np.diag(covariance)[own])))
        first = own.stop
    return laws, columns


def _law(found: SearchedMap, said: StatedTerm, amplitudes: Array, u: Array) -> tuple[ChangeTerm, EmpiricalMapLaw]:
    form, shape = form_of(said)
    measured, sigma = found.rows.data.measured[form.quantity], found.rows.sigma[form.quantity]
    weight = sigma * (np.array(form.weight) if form.weight else np.ones(len(amplitudes)))
    candidate = empirical(measured.name, measured.unit, form.terms[shape], form.name)
    term = ChangeTerm(candidate, tuple(map(float, amplitudes * weight)))
    share = found.rows.parts(amplitudes @ said.term.columns)[form.quantity]
    table: dict[str, Any] = candidate.applied({}, term.values)[EMPIRICAL][-1]
    coefficients = {
        knob.name: Estimate(value, float(s), measured.unit)
        for knob, value, s in zip(candidate.knobs, term.values, u * weight, strict=True)
    }
    located = _located(form, shape, found, said.lead.probability)
    return term, EmpiricalMapLaw(located, measured.name, measured.unit, table["formula"], coefficients, share)


def _remarks(found: SearchedMap) -> Iterator[str]:
    gauge = [name_of(t.candidate.label) for t in found.fitted.terms if t.candidate.kind in GAUGE_KINDS]
    if gauge:
        yield f"An error of the force gauge ({', '.join(gauge)}) is no property of the probe and not in its file."
    if found.slight:
        words = ", ".join(name_of(one.lead.candidate.label) for one in found.slight)
        yield (
            f"What explains less than {found.priors.maps.slight:g} of the squared residuals is not named, since no"
            f" statics are exact ({words}); the uncertainties of the parameters allow for it."
        )
    if found.state.noise.tails == "heavy":
        yield "Single readings scatter with heavier tails than a normal distribution: they were weighted accordingly."

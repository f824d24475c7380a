"""The changes of a probe that are stated, with their sets; and structure over the directions without a law."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.credible_finding import credible_finding
from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS, empirical
from stepgauge.diagnosis.maps.direction_functions import DIRECTION, DirectionFunction, quantity_words
from stepgauge.diagnosis.maps.further_measurements import best_measurement, reason
from stepgauge.diagnosis.maps.model import ChangeTerm
from stepgauge.diagnosis.maps.parameters import estimates
from stepgauge.diagnosis.maps.result import OUTLIERS, EmpiricalMapLaw
from stepgauge.diagnosis.maps.stated_map import FittedChanges, StatedMap, function_of
from stepgauge.diagnosis.result import Finding, Located
from stepgauge.diagnosis.stating_rules import SURE_OUTLIER, credible_laws, structure_alone
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.files.arrays import Array
from stepgauge.inference.noise_models import OUTLYING


def map_findings(found: StatedMap, by_row: Sequence[Array]) -> Iterator[Finding]:
    """The changes that are stated, then the outliers; ``by_row (n,)``: scatter of the rows of each quantity."""
    for place, said in enumerate(found.laws):
        every = credible_laws(said, found.priors.decision)
        fits = [found.fitted, *(found.substitute_rival(place, one) for one in every[1:])]
        causes = [_cause(found, fitted, place) for fitted in fits]
        by_label = {one.candidate.label: cause for one, cause in zip(every, causes, strict=True)}
        slight = float(found.moved_by_slight[place])
        one = credible_finding(
            said, by_label, every, found.answer, found.state, found.priors.decision, found.wider, slight
        )
        kinds = [cause.kind for cause in causes]
        why, further = _why_and_next(found, kinds, fits, [member.probability for member in every], by_row)
        yield replace(one, reason=why, separate_by=further)
    yield from _outliers(found)


def _cause(found: StatedMap, fitted: FittedChanges, place: int) -> Finding:
    term = fitted.terms[place]
    values = estimates(found.rows.model.table, fitted)[place]
    return Finding(term.candidate.kind, term.candidate.label, None, {}, values, 0.0, moved_by(found, fitted, term))


def _why_and_next(
    found: StatedMap,
    kinds: Sequence[str],
    fits: Sequence[FittedChanges],
    probability: Sequence[float],
    by_row: Sequence[Array],
) -> tuple[str, str]:
    """Why the kinds of a set are not separated, and the measurement that does."""
    others = [i for i, kind in enumerate(kinds) if i == 0 or kind != kinds[0]]
    why = dict.fromkeys(reason(kinds[0], kinds[i]) for i in others[1:])
    rivals, weights = [fits[i] for i in others], [probability[i] for i in others]
    return "; ".join(why), best_measurement(found.rows.model, by_row, rivals, weights)


def moved_by(found: StatedMap, fitted: FittedChanges, term: ChangeTerm) -> Array:
    """What a change does beside the others, in the units of the quantities, one after the other ``(m,)``."""
    rows, without = found.rows, tuple(one for one in fitted.terms if one is not term)
    return np.concatenate(rows.parts(rows.moved(fitted.terms) - rows.moved(without)))


def kept_rows(found: StatedMap) -> NDArray[np.bool_]:
    """Rows ``(n,)`` that are not outliers."""
    outlying, stated = found.state.noise.outlying, found.priors.decision.stated
    if outlying is None or found.answer.probability_of_scatter(OUTLYING) < stated:
        return np.ones(len(found.rows.data), bool)
    off = np.array(np.split(outlying, len(found.rows.sigma))) > SURE_OUTLIER
    return np.asarray(~off.any(axis=0))


def _outliers(found: StatedMap) -> Iterator[Finding]:
    rows = found.rows.data.row_numbers[~kept_rows(found)]
    if rows.size:
        p = found.answer.probability_of_scatter(OUTLYING)
        count = {"rows": Estimate(float(rows.size), None, "count")}
        none = np.zeros(len(found.rows.um))
        yield Finding(OUTLIERS, OUTLIERS, None, {"rows": tuple(map(int, rows))}, count, p, none, own=p)


# -- structure without a law -------------------------------------------------------------------------------------------


def _located(function: DirectionFunction, shape: int, found: StatedMap, p: float, share: float = 1.0) -> Located:
    words = f"{quantity_words(found.rows.data.measured[function.quantity].name)}: {function.words[shape]}"
    return Located(function.covariate, "both", function.name, words, round(share, 4), p)


def map_structure(found: StatedMap) -> Iterator[Located]:
    """Structure that is stated, and places in which a law fits with a size that is not determined."""
    for said in found.forms:
        same = [
            one.candidate.label for one in said.credible_set.members if one.candidate.kind == said.lead.candidate.kind
        ]
        yield _located(*function_of(said), found, found.answer.probability_of_any(frozenset({one}) for one in same))
    for said in found.vague:
        label = said.lead.candidate.label
        words = f"similar to {name_of(label)}, whose size this map does not determine"
        yield Located(
            DIRECTION, "both", UNDETERMINED, words, 1.0, found.answer.probability_of_any([frozenset({label})])
        )


def located_alone(found: StatedMap, left: Sequence[Located]) -> Iterator[Located]:
    """Structure of the residuals: that which remains, and that before any law is named."""
    yield from left
    known = [said.lead.candidate.kind for said in found.forms]
    least = found.priors.decision.in_set
    for proposal, probability, share in structure_alone(found.search, found.state, known, least):
        yield _located(proposal.candidate.source, proposal.atom, found, probability, share)


def empirical_map_laws(found: StatedMap) -> list[tuple[ChangeTerm, EmpiricalMapLaw]]:
    """The structure as laws of the probe file."""
    forms = [said for said in found.forms if function_of(said)[0].terms[function_of(said)[1]]]
    if not forms:
        return []
    columns = np.vstack([said.term.columns for said in forms])
    sd = np.concatenate([np.full(len(said.term.columns), said.term.sd) for said in forms])
    metric = found.metric_beside()
    white = metric(columns)
    covariance = np.linalg.inv(white @ white.T + np.diag(sd**-2.0))
    amplitudes = covariance @ white @ metric(found.rows.um - found.rows.moved(found.fitted.terms))
    laws, first = [], 0
    for said in forms:
        own = slice(first, first + len(said.term.columns))
        laws.append(
            _empirical(found, *function_of(said), amplitudes[own], np.sqrt(np.diag(covariance)[own]), said.term.columns)
        )
        first = own.stop
    return laws


def _empirical(
    found: StatedMap, function: DirectionFunction, shape: int, amplitudes: Array, u: Array, columns: Array
) -> tuple[ChangeTerm, EmpiricalMapLaw]:
    measured, sigma = found.rows.data.measured[function.quantity], found.rows.sigma[function.quantity]
    weight = sigma * (np.array(function.weight) if function.weight else np.ones(len(amplitudes)))
    candidate = empirical(measured.name, measured.unit, function.terms[shape], function.name)
    term = ChangeTerm(candidate, tuple(map(float, amplitudes * weight)))
    share = found.rows.parts(amplitudes @ columns)[function.quantity]
    coefficients = {
        knob.name: Estimate(value, float(s), measured.unit)
        for knob, value, s in zip(candidate.knobs, term.values, u * weight, strict=True)
    }
    located = _located(function, shape, found, 1.0)
    return term, EmpiricalMapLaw(located, measured.name, measured.unit, candidate.formula, coefficients, share)


def map_remarks(found: StatedMap) -> Iterator[str]:
    """What the reader of the result needs to know besides."""
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

"""The changes of a probe that are stated, with their sets; and structure over the directions without a law."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.credible import (
    LEAST_ODDS,
    SURE_OUTLIER,
    credible_laws,
    joined_kinds,
    replacements,
    set_probability,
    spread_factor,
    structure_alone,
)
from stepgauge.diagnosis.fits.solve import Estimate, widened
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS, empirical
from stepgauge.diagnosis.maps.direction_functions import DIRECTION, DirectionFunction, quantity_words
from stepgauge.diagnosis.maps.further_measurements import best_measurement, reason
from stepgauge.diagnosis.maps.model import ChangeTerm
from stepgauge.diagnosis.maps.parameters import estimates
from stepgauge.diagnosis.maps.result import OUTLIERS, EmpiricalMapLaw
from stepgauge.diagnosis.maps.stated_map import FittedChanges, StatedMap, function_of
from stepgauge.diagnosis.result import Finding, FindingMember, Located, Replacement
from stepgauge.diagnosis.wording.notation import name_of
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.files.arrays import Array
from stepgauge.inference.noise_models import OUTLYING
from stepgauge.inference.posterior import AlternativeHypothesis, Member


def map_findings(found: StatedMap, by_row: Sequence[Array]) -> Iterator[Finding]:
    """The changes that are stated, then the outliers; ``by_row (n,)``: scatter of the rows of each quantity."""
    several, decision = found.answer.alternatives(LEAST_ODDS), found.priors.decision
    for place, said in enumerate(found.laws):
        label = said.lead.candidate.label
        spread = spread_factor(found.answer, found.state, label, decision.in_set)
        wider = max(spread, float(found.moved_by_slight[place])) * found.wider
        own = widened(estimates(found.rows.model.table, found.fitted)[place], wider)
        kind = found.fitted.terms[place].candidate.kind
        yield _finding(found, place, own, replacements(several, label, kind, decision), by_row)
    yield from _outliers(found)


def _finding(
    found: StatedMap,
    place: int,
    own: dict[str, Estimate],
    combined: Sequence[AlternativeHypothesis],
    by_row: Sequence[Array],
) -> Finding:
    said, term = found.laws[place], found.fitted.terms[place]
    every = credible_laws(said, found.priors.decision)
    fits = [found.fitted, *(found.in_place(place, one) for one in every[1:])]
    changes = [one.terms[place].candidate for one in fits]
    kinds = tuple(dict.fromkeys(one.kind for one in changes if one.kind != term.candidate.kind))
    same = tuple(one.label for one in changes[1:] if one.kind == term.candidate.kind)
    others = [one for one, change in zip(fits, changes, strict=True) if change.kind != term.candidate.kind]
    weights = [1.0, *(one.probability / every[0].probability for one in every if one.candidate.kind in kinds)]
    probability = set_probability(found.answer, every, combined)
    return Finding(
        term.candidate.kind,
        term.candidate.label,
        None,
        {},
        own,
        probability,
        moved_by(found, term),
        own=found.answer.probability([said.lead.candidate.label]),
        confounded_with=(*kinds, *joined_kinds(combined)),
        alternatives=same,
        members=tuple(_members(found, place, every, fits, own)),
        several=tuple(_replacement(one, said.lead.candidate.label) for one in combined),
        reason="; ".join(dict.fromkeys(reason(term.candidate.kind, kind) for kind in kinds)),
        separate_by=best_measurement(found.rows.model, by_row, [found.fitted, *others], weights),
    )


def _replacement(one: AlternativeHypothesis, label: str) -> Replacement:
    come = tuple(sorted(candidate.label for candidate in one.come))
    return Replacement(come, one.odds, tuple(other for other in one.gone if other != label))


def _members(
    found: StatedMap, place: int, every: Sequence[Member], fits: Sequence[FittedChanges], own: dict[str, Estimate]
) -> Iterator[FindingMember]:
    """All changes of a set, each with its own values from a fit in its place; none for a set of one."""
    total = sum(one.probability for one in every)
    for one, fitted in zip(every, fits, strict=True) if len(every) > 1 else ():
        change = fitted.terms[place].candidate
        values = own if fitted is found.fitted else estimates(found.rows.model.table, fitted)[place]
        yield FindingMember(change.kind, change.label, one.probability / total, None, {}, values)


def moved_by(found: StatedMap, term: ChangeTerm) -> Array:
    """What a change does beside the others, in the units of the quantities, one after the other ``(m,)``."""
    rows, without = found.rows, tuple(one for one in found.fitted.terms if one is not term)
    return np.concatenate(rows.parts(rows.moved(found.fitted.terms) - rows.moved(without)))


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
        same = [one.candidate.label for one in said.place.members if one.candidate.kind == said.lead.candidate.kind]
        yield _located(*function_of(said), found, found.answer.probability(same))
    for said in found.vague:
        label = said.lead.candidate.label
        words = f"similar to {name_of(label)}, whose size this map does not determine"
        yield Located(DIRECTION, "both", UNDETERMINED, words, 1.0, found.answer.probability([label]))


def located_alone(found: StatedMap, left: Sequence[Located]) -> Iterator[Located]:
    """Structure of the residuals: that which remains, and that before any law is named."""
    yield from left
    known = [said.lead.candidate.kind for said in found.forms]
    least = found.priors.decision.in_set
    for proposal, probability, share in structure_alone(found.search, found.state, known, least):
        yield _located(proposal.candidate.source, proposal.atom, found, probability, share)


def empirical_map_laws(found: StatedMap) -> tuple[list[tuple[ChangeTerm, EmpiricalMapLaw]], Array]:
    """The structure as laws of the probe file, with the derivatives ``(k, m)`` by their coefficients."""
    forms = [said for said in found.forms if function_of(said)[0].terms[function_of(said)[1]]]
    if not forms:
        return [], np.zeros((0, len(found.rows.um)))
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
    return laws, columns


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

"""The changes of a probe that are stated, with their sets; and structure over the directions without a law."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.credible_finding import credible_finding
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS
from stepgauge.diagnosis.maps.direction_functions import DIRECTION, HARMONIC, DirectionFunction
from stepgauge.diagnosis.maps.further_measurements import best_measurement
from stepgauge.diagnosis.maps.model import Terms
from stepgauge.diagnosis.maps.stated_map import StatedMap
from stepgauge.diagnosis.noise import outlier_finding
from stepgauge.diagnosis.result import Finding, Located
from stepgauge.diagnosis.stating_rules import SURE_OUTLIER, StatedTerm, credible_laws, structure_alone
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.notation import significant
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.files.arrays import Array
from stepgauge.inference.noise_models import OUTLYING


def map_findings(found: StatedMap, by_row: Sequence[Array]) -> Iterator[Finding]:
    """The changes that are stated, then the outliers; ``by_row (n,)``: scatter of the rows of each quantity."""
    for place, said in enumerate(found.laws):
        lead, *others = credible_laws(said, found.priors.decision)
        instead = [(one, found.substitute_rival(place, one)) for one in others]
        # lobes without height are another mean pre-travel by another name
        real = [(one, fitted) for one, fitted in instead if fitted[place].has_size]
        every, fits = [lead, *(one for one, _ in real)], [found.fitted, *(fitted for _, fitted in real)]
        causes = [_cause(found, fitted, place) for fitted in fits]
        by_label = {one.candidate.label: cause for one, cause in zip(every, causes, strict=True)}
        slight = float(found.moved_by_slight[place])
        one = credible_finding(
            said, by_label, every, found.answer, found.state, found.priors.decision, found.wider, slight
        )
        kinds = [cause.kind for cause in causes]
        why, further = _why_and_next(found, kinds, fits, [member.probability for member in every], by_row)
        yield replace(one, reason=why, separate_by=further)
    if not kept_rows(found).all():
        rows, p = found.rows.data.row_numbers[~kept_rows(found)], found.answer.probability_of_scatter(OUTLYING)
        yield outlier_finding(rows, p, len(found.rows.um))


def _cause(found: StatedMap, fitted: Terms, place: int) -> Finding:
    """A change with what it does beside the others, in the units of the quantities, one after the other ``(m,)``."""
    rows, term = found.rows, fitted[place]
    moved = rows.moved(fitted) - rows.moved((*fitted[:place], *fitted[place + 1 :]))
    share = np.concatenate(rows.parts(moved))
    return Finding(term.candidate.kind, term.candidate.label, None, {}, term.estimates, 0.0, share)


def _why_and_next(
    found: StatedMap,
    kinds: Sequence[str],
    fits: Sequence[Terms],
    probability: Sequence[float],
    by_row: Sequence[Array],
) -> tuple[str, str]:
    """Why the kinds of a set are not separated, and the measurement that does; both empty for one kind."""
    others = [i for i, kind in enumerate(kinds) if i == 0 or kind != kinds[0]]
    if len(others) < 2:
        return "", ""
    own, *names = dict.fromkeys(name_of(kinds[i], "map") for i in others)
    why = f"in the directions of this map {own} and {listed(names)} have the same signature"
    rivals, weights = [fits[i] for i in others], [probability[i] for i in others]
    return why, best_measurement(found.rows.model, by_row, rivals, weights)


def kept_rows(found: StatedMap) -> NDArray[np.bool_]:
    """Rows ``(n,)`` that are not outliers."""
    outlying, stated = found.state.noise.outlying, found.priors.decision.stated
    if outlying is None or found.answer.probability_of_scatter(OUTLYING) < stated:
        return np.ones(len(found.rows.data), bool)
    off = np.array(np.split(outlying, len(found.rows.sigma))) > SURE_OUTLIER
    return np.asarray(~off.any(axis=0))


# -- structure without a law -------------------------------------------------------------------------------------------


def _located(
    function: DirectionFunction, shape: int, found: StatedMap, p: float, share: float = 1.0, size: str = ""
) -> Located:
    words = f"{say(found.rows.data.measured[function.quantity].name)}: {function.words[shape]}{size}"
    return Located(function.covariate, "both", function.name, words, round(share, 4), p)


def map_structure(found: StatedMap) -> Iterator[Located]:
    """Structure that is stated, and places in which a law fits with a size that is not determined."""
    for said in found.forms:
        same = [
            one.candidate.label for one in said.credible_set.members if one.candidate.kind == said.lead.candidate.kind
        ]
        p = found.answer.probability_of_any(frozenset({one}) for one in same)
        yield _form(said, found, p)
    for said in found.vague:
        label = said.lead.candidate.label
        words = f"similar to {name_of(label)}, whose size this map does not determine"
        yield Located(
            DIRECTION, "both", UNDETERMINED, words, 1.0, found.answer.probability_of_any([frozenset({label})])
        )


def _form(said: StatedTerm, found: StatedMap, p: float) -> Located:
    """A form with what it moves; of lobes the words have the amplitude, too, and the azimuth of the first maximum."""
    function: DirectionFunction = said.source
    place, (name, _, order) = found.state.index(said.term.candidate), function.name.partition(" ")
    size, numbers = "", None
    if name == HARMONIC:
        measured = found.rows.data.measured[function.quantity]
        c, s = found.state.amplitudes(place)[0] * found.rows.sigma[function.quantity]
        numbers = float(np.hypot(c, s)), float(np.degrees(np.arctan2(s, c)) % 360.0) / int(order)
        height, place_deg = map(significant, numbers)
        size = f", of {height} {measured.unit}, the first maximum at {place_deg} deg"
    moved = np.concatenate(found.rows.parts(found.state.contribution_um(place)))
    return replace(_located(function, said.term.atom, found, p, size=size), numbers=numbers, share_um=moved)


def located_alone(found: StatedMap, left: Sequence[Located]) -> Iterator[Located]:
    """Structure of the residuals: that which remains, and that before any law is named."""
    yield from left
    known = [said.lead.candidate.kind for said in found.forms]
    least = found.priors.decision.in_set
    for proposal, probability, share in structure_alone(found.search, found.state, known, least):
        yield _located(proposal.candidate.source, proposal.atom, found, probability, share)


def map_remarks(found: StatedMap) -> Iterator[str]:
    """What the reader of the result needs to know besides."""
    gauge = [name_of(t.candidate.label) for t in found.fitted if t.candidate.kind in GAUGE_KINDS]
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

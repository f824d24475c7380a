"""From a map and a probe file to the statements: the search, and the same rules as for recordings.

These are changes of the probe with their sets, and structure over the directions without a law.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.findings import credible_finding
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS, ProbeChange, candidates_for
from stepgauge.diagnosis.maps.data import MapData, MapScatter, estimate_scatter, lacking
from stepgauge.diagnosis.maps.direction_functions import DIRECTION, HARMONIC, DirectionFunction
from stepgauge.diagnosis.maps.further_measurements import best_measurement
from stepgauge.diagnosis.maps.model import MapModel, Terms, changed_table, check_model, without_force_gauge
from stepgauge.diagnosis.maps.result import MapDiagnosis, QuantityFit
from stepgauge.diagnosis.maps.signatures import MapRows
from stepgauge.diagnosis.maps.stated_map import StatedMap, stated_map
from stepgauge.diagnosis.noise import outlier_finding
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.result import Finding, Located, Verdict, rms
from stepgauge.diagnosis.statements import conclude
from stepgauge.diagnosis.stating_rules import StatedTerm, credible_laws, structure_alone
from stepgauge.diagnosis.wording.catalogue import listed, say
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.structure import UNDETERMINED
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.config import read_toml
from stepgauge.files.notation import significant
from stepgauge.files.resources import find_data
from stepgauge.inference.noise_models import OUTLYING
from stepgauge.inference.search import Progress
from stepgauge.probes.read import probe_table

HALF_A_DIGIT = 0.5 + 1e-6
SIX_DIGITS = 5.1e-6
"""Relative resolution of six printed digits."""


def judged_map(
    data: MapData, probe_path: str | Path, priors: Priors | None = None, progress: Progress | None = None
) -> MapDiagnosis:
    """The diagnosis of a map against a probe file, or the shipped one of that name."""
    table, where = read_probe_table(probe_path)
    return replace(diagnose_map(MapModel(table, where, data), priors=priors, progress=progress), probe_path=where)


def read_probe_table(probe_path: str | Path) -> tuple[dict[str, Any], str]:
    """The ``[probe]`` table of a probe file as written there, and the path of the file."""
    path = find_data(probe_path, "probe", "probes")
    checked, where = probe_table(read_toml(path).get("probe"), path)
    table = checked.model_dump(exclude_unset=True)
    if table.get("model") == "table":
        expected = "a probe file of its construction (kinematic, piezo) or of a law (constant, lobed)"
        raise InputError(where, "a probe known by its map has no construction to diagnose", expected=expected)
    return table, str(where)


def diagnose_map(
    model: MapModel,
    candidates: Sequence[ProbeChange] | None = None,
    priors: Priors | None = None,
    progress: Progress | None = None,
) -> MapDiagnosis:
    """The diagnosis of a map; without ``candidates`` all possible changes of the model of the probe are tried.

    Raises :class:`InputError` for a probe file that does not give the measured quantities.
    """
    check_model(model)
    scatter = estimate_scatter(model.data, model.residuals(()))
    missing = lacking(model.data)
    if missing:
        return _unchanged("insufficient", model, scatter, missing)
    if _reproduced(model):
        return _unchanged("adequate", model, scatter)
    if candidates is None:
        candidates = candidates_for(model.table, [m.name for m in model.data.measured])
    return _diagnosis_of(stated_map(model, candidates, scatter, priors or shipped_priors(), progress), scatter)


def _reproduced(model: MapModel) -> bool:
    """Whether the probe file gives every printed value: the residuals are rounding and no scatter."""
    pairs = zip(model.data.measured, model.residuals(()), strict=True)
    return all((np.abs(r) <= np.maximum(HALF_A_DIGIT * m.quantum, SIX_DIGITS * m.values)).all() for m, r in pairs)


def _unchanged(verdict: Verdict, model: MapModel, scatter: MapScatter, missing: tuple[str, ...] = ()) -> MapDiagnosis:
    """The unchanged residuals; the scatter is known from repeats or not at all."""
    kept, rows = np.ones(len(model.data), bool), MapRows(model, scatter.sigma)
    known = scatter.repeats or not missing
    by_row = [np.full(len(kept), s if known else np.nan) for s in scatter.sigma]
    fits = quantity_fits(rows, [rows.um] * 3, kept, by_row)
    chi2 = float(np.mean(rows.um**2)) if known else np.nan
    return MapDiagnosis(
        verdict=verdict,
        fits=fits,
        chi2_dof_before=chi2,
        chi2_dof_after=chi2,
        noise=scatter,
        data=model.data,
        kept=kept,
        probe=model.table,
        table=model.table,
        lacking=missing,
    )


def _diagnosis_of(found: StatedMap, scatter: MapScatter) -> MapDiagnosis:
    model, kept, by_row = found.rows.model, found.kept, _row_deviations(found, scatter)
    slight = [one.label for one in found.slight]
    findings, left = list(map_findings(found, by_row)), list(map_structure(found))
    concluded = conclude(found.answer, findings, left, found.priors.decision, slight)
    terms, named = found.fitted, found.rows.um - found.rows.moved(found.fitted)
    forms = [one.share_um for one in concluded.structure if len(one.share_um)]
    described = named - sum((found.rows.stacked(np.split(one, len(scatter.sigma))) for one in forms), 0.0 * named)
    return MapDiagnosis(
        verdict=concluded.verdict,
        findings=concluded.findings,
        located=tuple(located_alone(found, concluded.structure)),
        unexplained=concluded.structure,
        fits=quantity_fits(found.rows, (found.rows.um, named, described), kept, by_row),
        chi2_dof_before=_chi2_dof(found, found.rows.um, 0, kept, by_row),
        chi2_dof_after=_chi2_dof(found, named, sum(len(term.values) for term in terms), kept, by_row),
        noise=replace(scatter, grows=found.grows),
        data=model.data,
        kept=kept,
        probe=model.table,
        table=without_force_gauge(changed_table(model.table, terms)),
        terms=terms,
        trail=tuple(found.search.trail),
        remarks=tuple(map_remarks(found)),
        probabilities=concluded.table,
        checks=found.checks,
    )


def quantity_fits(
    rows: MapRows, stages: Sequence[Array], kept: NDArray[np.bool_], by_row: Sequence[Array]
) -> tuple[QuantityFit, ...]:
    """Every quantity with its residuals ``(m,)`` before, without the named changes, and without the structure.

    ``kept (n,)``: rows that are not outliers; ``by_row (n,)``: scatter of each row of each quantity.
    """
    before, after, described = map(rows.parts, stages)
    each = zip(rows.data.measured, by_row, before, after, described, strict=True)
    return tuple(QuantityFit(measured, rms(sigma), a, b, c, kept) for measured, sigma, a, b, c in each)


def _chi2_dof(found: StatedMap, um: Array, fitted: int, kept: NDArray[np.bool_], by_row: Sequence[Array]) -> float:
    white = um * np.repeat(found.rows.sigma, len(kept)) / np.concatenate(by_row)
    used = np.tile(kept, len(found.rows.sigma))
    return float((white[used] ** 2).sum()) / max(int(used.sum()) - fitted, 1)


def _row_deviations(found: StatedMap, scatter: MapScatter) -> list[Array]:
    """Standard deviation of every ordinary row of each quantity: the mean over repeats, else that of the model."""
    state, sigma = found.state, found.rows.sigma
    relative = np.sqrt(found.search.noise_models.variance(state.noise) * state.noise.weight)
    found_by = [part * s for part, s in zip(np.split(relative, len(sigma)), sigma, strict=True)]
    if not scatter.repeats:
        return [one * state.sigma_um for one in found_by]
    return [one * s / float(np.sqrt(np.mean(one**2))) for one, s in zip(found_by, scatter.sigma, strict=True)]


def map_findings(found: StatedMap, by_row: Sequence[Array]) -> Iterator[Finding]:
    """The changes that are stated, then the outliers; ``by_row (n,)``: scatter of the rows of each quantity."""
    for place, said in enumerate(found.laws):
        lead, *others = credible_laws(said, found.priors.decision)
        instead = [(one, found.substitute_rival(place, one)) for one in others]
        # lobes without height are another mean pre-travel by another name
        real = [(lead, found.fitted), *((one, fitted) for one, fitted in instead if fitted[place].has_size)]
        causes = {one.candidate.label: _cause(found, fitted, place) for one, fitted in real}
        every, slight = [one for one, _ in real], float(found.moved_by_slight[place])
        one = credible_finding(
            said, causes, every, found.answer, found.state, found.priors.decision, found.wider, slight
        )
        differ = [rival for rival in real if rival[0] is lead or causes[rival[0].candidate.label].kind != one.kind]
        if len(differ) > 1:
            own, *names = dict.fromkeys(name_of(causes[rival.candidate.label].kind, "map") for rival, _ in differ)
            why = f"in the directions of this map {own} and {listed(names)} have the same signature"
            fits, weights = [fitted for _, fitted in differ], [rival.probability for rival, _ in differ]
            one = replace(one, reason=why, separate_by=best_measurement(found.rows.model, by_row, fits, weights))
        yield one
    if not found.kept.all():
        p = found.answer.probability_of_scatter(OUTLYING)
        yield outlier_finding(found.rows.data.row_numbers[~found.kept], p, len(found.rows.um))


def _cause(found: StatedMap, fitted: Terms, place: int) -> Finding:
    """A change with what it does beside the others, in the units of the quantities, one after the other ``(m,)``."""
    rows, term = found.rows, fitted[place]
    moved = rows.moved(fitted) - rows.moved((*fitted[:place], *fitted[place + 1 :]))
    share = np.concatenate(rows.parts(moved))
    return Finding(term.candidate.kind, term.candidate.label, None, {}, term.estimates, 0.0, share)


def _located(
    function: DirectionFunction, shape: int, found: StatedMap, p: float, share: float = 1.0, size: str = ""
) -> Located:
    words = f"{say(found.rows.data.measured[function.quantity].name)}: {function.words[shape]}{size}"
    return Located(function.covariate, "both", function.name, words, round(share, 4), p)


def map_structure(found: StatedMap) -> Iterator[Located]:
    """Structure that is stated, and places in which a law fits with a size that is not determined."""
    for said in found.forms:
        same = (one.candidate for one in said.credible_set.members if one.candidate.kind == said.lead.candidate.kind)
        yield _form(said, found, found.answer.probability_of_any(frozenset({one.label}) for one in same))
    for said in found.vague:
        words = f"similar to {name_of(said.label)}, whose size this map does not determine"
        p = found.answer.probability_of_any([frozenset({said.label})])
        yield Located(DIRECTION, "both", UNDETERMINED, words, 1.0, p)


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
        words = ", ".join(name_of(one.label) for one in found.slight)
        yield (
            f"What explains less than {found.priors.maps.slight:g} of the squared residuals is not named, since no"
            f" statics are exact ({words}); the uncertainties of the parameters allow for it."
        )
    if found.state.noise.tails == "heavy":
        yield "Single readings scatter with heavier tails than a normal distribution: they were weighted accordingly."

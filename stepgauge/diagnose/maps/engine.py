"""Noise, locate, propose, select and prove, for a map and a probe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.candidates import GAUGE_KINDS, Candidate, candidates_for
from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.empirical import EMPIRICAL
from stepgauge.diagnose.maps.explain import Explained, explain
from stepgauge.diagnose.maps.fit import Fitted, Fitter
from stepgauge.diagnose.maps.holdout import held_out
from stepgauge.diagnose.maps.locate import quantity_words
from stepgauge.diagnose.maps.model import MapModel, Term, changed_table, check_model
from stepgauge.diagnose.maps.noise import OUTLIER_P, MapNoise, estimate_noise, without_outliers
from stepgauge.diagnose.maps.outliers import outliers
from stepgauge.diagnose.maps.parameters import estimates
from stepgauge.diagnose.maps.result import OUTLIERS, Law, MapDiagnosis, MapFinding, QuantityFit, rms
from stepgauge.diagnose.maps.select import Rivals
from stepgauge.diagnose.maps.separate import reason, separate
from stepgauge.diagnose.result import Verdict
from stepgauge.diagnose.solve import Estimate

Array = NDArray[np.float64]
FEWEST_ROWS = 8
FEWEST_DIRECTIONS = 6
FEWEST_AZIMUTHS = 3
PASSES = 4
"""How often a map is looked at anew after single readings were set aside."""


def diagnose_map(model: MapModel, candidates: Sequence[Candidate] | None = None) -> MapDiagnosis:
    """The diagnosis of a map; without ``candidates`` all changes that the probe's model can have are tried.

    Raises :class:`InputError` for a probe file that says nothing of what was measured.
    """
    check_model(model)
    missing = lacking(model.data)
    noise = estimate_noise(model.data)
    if missing:
        return _insufficient(model, noise, missing)
    if candidates is None:
        candidates = candidates_for(model.table, [m.name for m in model.data.measured])
    kept, found = _explained(model, noise, candidates)
    return _answer(model, kept, noise, found)


def lacking(data: MapData) -> tuple[str, ...]:
    """What a map that cannot tell should have had; empty if nothing is missing."""
    directions, azimuths = int(data.direction.max()) + 1, int(data.spokes.max()) + 1
    found = []
    if len(data) < FEWEST_ROWS or directions < FEWEST_DIRECTIONS:
        found.append(
            f"at least {FEWEST_ROWS} rows in {FEWEST_DIRECTIONS} directions, better several polar angles and azimuths:"
            f" the map has {len(data)} rows in {directions} directions"
        )
    if azimuths < FEWEST_AZIMUTHS:
        found.append(
            f"at least {FEWEST_AZIMUTHS} azimuths, better a full turn: the map has {azimuths}, and what changes about"
            " the stylus (lobes, their phase, eccentricity) passes for what is the same all around"
        )
    if all(np.ptp(m.values) == 0.0 for m in data.measured):
        found.append(
            "values that differ: all are the same to the last digit, so they are printed too coarsely, copied or"
            " simulated, and their scatter cannot be judged"
        )
    return tuple(found)


def _explained(
    model: MapModel, noise: MapNoise, candidates: Sequence[Candidate]
) -> tuple[NDArray[np.bool_], Explained]:
    """The rows that are no outliers, and what they say."""
    off = noise.outliers
    for _ in range(PASSES):
        kept = ~off
        found = explain(model.subset(kept), without_outliers(noise, int(kept.sum())), candidates)
        now = outliers(model, found.described, noise)
        if (now == off).all():
            break
        off = now
    return kept, found


def _insufficient(model: MapModel, noise: MapNoise, missing: tuple[str, ...]) -> MapDiagnosis:
    """Residuals as they are, and what is missing; the scatter is known from repeats or not at all."""
    fitter, kept = Fitter(model, noise), np.ones(len(model.data), bool)
    nothing = fitter.fit(())
    fits = _fits(model, fitter, nothing, nothing, nothing, kept)
    chi2 = nothing.rss / max(nothing.dof, 1) if noise.repeats else np.nan
    return MapDiagnosis(
        "insufficient",
        (),
        (),
        (),
        (),
        fits if noise.repeats else tuple(replace(fit, noise=np.nan) for fit in fits),
        chi2,
        chi2,
        noise,
        model.data,
        kept,
        (),
        model.table,
        model.table,
        (),
        (),
        missing,
    )


def _answer(model: MapModel, kept: NDArray[np.bool_], noise: MapNoise, found: Explained) -> MapDiagnosis:
    whole, named = found.described, found.selection.fitted
    unknown = found.locator.located(list(found.unknown), found.nothing)
    findings = [*_findings(model, found), *_outlier_finding(kept)]
    verdict: Verdict = "unknown" if unknown else "effects" if findings else "adequate"
    return MapDiagnosis(
        verdict,
        tuple(findings),
        found.locator.located(list(found.before), found.nothing),
        unknown,
        tuple(_laws(model, found)),
        _fits(model, found.fitter, found.nothing, named, whole, kept),
        found.nothing.rss / max(found.nothing.dof, 1),
        found.fitter.left(named.terms, whole.rest) / max(named.dof, 1),
        found.fitter.noise,
        model.data,
        kept,
        whole.terms,
        model.table,
        changed_table(model.table, whole.terms),
        found.selection.trail,
        tuple(_remarks(model.data, found)),
    )


def _findings(model: MapModel, found: Explained) -> list[MapFinding]:
    whole = found.described
    by_candidate = dict(
        zip((t.candidate for t in whole.terms), estimates(model, whole, found.selection.minor), strict=True)
    )
    terms = found.selection.fitted.terms
    return [
        _finding(model, found, term, by_candidate[term.candidate], rivals)
        for term, rivals in zip(terms, found.selection.rivals, strict=True)
    ]


def _finding(
    model: MapModel, found: Explained, term: Term, parameters: dict[str, Estimate], rivals: Rivals
) -> MapFinding:
    candidate = term.candidate
    others = [each for each in rivals.tried if each.candidate.kind != candidate.kind]
    instead = {
        each.candidate.kind: {k.name: v for k, v in zip(each.candidate.knobs, each.values, strict=True)}
        for each in others
    }
    pairs = zip(rivals.tried, rivals.weights, strict=True)
    probability = sum(weight for each, weight in pairs if each.candidate.kind == candidate.kind)
    own = next(each for each in rivals.tried if each.candidate == candidate)
    words, commands = separate(model, found.described.sigma, [own.fitted, *(each.fitted for each in others)])
    return MapFinding(
        candidate.kind,
        candidate.label,
        candidate.choice,
        parameters,
        min(probability, 1.0 - float(np.exp(own.log_p))),
        _moved(model, found.described, candidate),
        instead,
        tuple(e.candidate.label for e in rivals.tried if e.candidate.kind == candidate.kind and e is not own),
        "; ".join(dict.fromkeys(reason(candidate.kind, kind) for kind in instead)),
        words,
        commands,
    )


def _moved(model: MapModel, whole: Fitted, candidate: Candidate) -> dict[str, Array]:
    """How far a term moves each quantity, (n,)."""
    without = tuple(term for term in whole.terms if term.candidate != candidate)
    pairs = zip(model.predict(whole.terms), model.predict(without), strict=True)
    return {m.name: new - old for m, (new, old) in zip(model.data.measured, pairs, strict=True)}


def _outlier_finding(kept: NDArray[np.bool_]) -> list[MapFinding]:
    rows = tuple(map(int, np.flatnonzero(~kept)))
    return [MapFinding(OUTLIERS, OUTLIERS, "", {}, 1.0 - OUTLIER_P, {}, {}, rows=rows)] if rows else []


def _laws(model: MapModel, found: Explained) -> list[Law]:
    whole = found.described
    located = found.locator.located(list(found.unknown), found.nothing)
    parts = dict(zip((t.candidate for t in whole.terms), estimates(model, whole, ()), strict=True))
    terms = [term for term in whole.terms if term.candidate.kind == EMPIRICAL]
    laws = []
    for one, where, term in zip(found.unknown, located, terms, strict=False):
        measured = model.data.measured[one.quantity]
        law = term.candidate.applied({}, term.values)["empirical"][0]
        share = _moved(model, whole, term.candidate)[measured.name]
        laws.append(Law(where, measured.name, measured.unit, law["formula"], parts[term.candidate], share))
    return laws


def _fits(
    model: MapModel, fitter: Fitter, nothing: Fitted, named: Fitted, whole: Fitted, kept: NDArray[np.bool_]
) -> tuple[QuantityFit, ...]:
    """``named`` and ``whole``: without and with the laws that have no name."""
    stages = [model.residuals(terms) for terms in ((), named.terms, whole.terms)]
    held = held_out(fitter, nothing, named)
    described = held_out(fitter, nothing, whole) if whole is not named else held
    fits = []
    for i, m in enumerate(model.data.measured):
        before, after, rest = (stage[i] for stage in stages)
        fits.append(
            QuantityFit(
                m.name,
                m.unit,
                rms(whole.sigma[i]),
                m.quantum,
                rms(before[kept]),
                rms(after[kept]),
                rms(rest[kept]),
                _worst(before[kept], m.values[kept]),
                _worst(after[kept], m.values[kept]),
                {h.by: (h.before[i], h.after[i]) for h in held},
                {h.by: h.after[i] for h in described},
                before,
                after,
                rest,
            )
        )
    return tuple(fits)


def _worst(residual: Array, values: Array) -> float:
    """Largest residual as a share of the measured value."""
    positive = values > 0.0
    return float(np.max(np.abs(residual[positive]) / values[positive], initial=0.0))


def _remarks(data: MapData, found: Explained) -> list[str]:
    remarks = []
    slight = [each.candidate.label.replace("_", " ") for each in found.selection.minor]
    if slight:
        remarks.append(
            f"Slight departures of the laws are significant but too small to name ({', '.join(slight)} would take them"
            " up). The uncertainties of the parameters allow for them."
        )
    if found.slight:
        words = "; ".join(f"{quantity_words(data.measured[f.quantity].name)}: {f.shape.words}" for f in found.slight)
        remarks.append(f"Forms that stand out but take less than a thousandth of the disagreement: {words}.")
    gauge = [
        term.candidate.label.replace("_", " ")
        for term in found.selection.fitted.terms
        if term.candidate.kind in GAUGE_KINDS
    ]
    if gauge:
        remarks.append(
            f"What was found of the gauge ({', '.join(gauge)}) is no property of the probe and not in its file."
        )
    return remarks

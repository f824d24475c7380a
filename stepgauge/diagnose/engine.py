"""From a recording to a diagnosis: noise, locate, propose, select, prove."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.clock import clock_start_s, counted_from, told_by_clock
from stepgauge.diagnose.confounded import Rivals, rivals
from stepgauge.diagnose.explain import Explained, all_forms, displaced_um, explain
from stepgauge.diagnose.forms import AXES, GROWING, ISOLATED
from stepgauge.diagnose.holdout import holdout_rms, make_folds
from stepgauge.diagnose.library import carried
from stepgauge.diagnose.locate import most_telling
from stepgauge.diagnose.noise import Noise, estimate_noise
from stepgauge.diagnose.residuals import Residuals, make_residuals
from stepgauge.diagnose.result import Diagnosis, Finding, Fit, Located, Verdict
from stepgauge.diagnose.select import Term
from stepgauge.diagnose.separate import lengthened, separate
from stepgauge.diagnose.solve import Estimate, Fitted, Solved, solve
from stepgauge.diagnose.whitening import Whitening, make_whitening
from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError
from stepgauge.gauge import Gauge
from stepgauge.machine_file import Machine
from stepgauge.recording import Recording

Array = NDArray[np.float64]
FEWEST_DOF = 8
MOST_SEARCHED = 3000
"""Rows that are searched; the laws found are fitted to all."""
FEWEST_RUNS = 6
SURE = 4.0
"""Standard uncertainties by which all rows must see a law that was found in some."""
SMALLEST_SIGMA_UM = 1e-5
"""Recordings that repeat better than this do so by construction, and give no scale to judge anything by."""
GROWTH_UNITS = {"time": "um/h", "speed": "um/(mm/s)"}
"""Units of what scatter grows by; of a length otherwise."""
NO_SEPARATION = "the same in every placement and at every speed within this travel; log the temperatures"


def diagnose(recording: Recording, gauge: Gauge, machine: Machine, without: Collection[str] = ()) -> Diagnosis:
    """Find where recording and simulation disagree, and the physics that explains it.

    Parameters
    ----------
    recording : one or more placements, joined
    gauge : the certificate
    machine : the model to be judged, with the effects it already knows
    without : kinds of effects that are no candidates, because they are known not to be there

    Raises
    ------
    InputError
        recordings that are not this gauge's, or too small to say anything about; kinds that do not exist
    """
    for kind in without:
        if kind not in effect_kinds():
            raise InputError(
                "without", "no such kind of effect", found=kind, expected=", ".join(sorted(effect_kinds()))
            )
    recorded = make_residuals(recording, gauge, machine)
    start_s = clock_start_s(recorded)
    data = counted_from(recorded, start_s)
    searched = _some(recorded, recording)
    some = counted_from(searched, start_s)
    noise = estimate_noise(some)
    if noise.dof < FEWEST_DOF or noise.sigma_um < SMALLEST_SIGMA_UM:
        return _insufficient(searched, noise)
    found = explain(some, noise, without)
    noise, whitening, fitted = found.noise, found.selector.whitening, found.selector.fit(found.terms)
    if len(some) < len(data):
        noise, whitening, fitted = _on_all_rows(fitted, data)
        sure = _confirmed(found.terms, fitted)
        if sure != found.terms:
            found = replace(found, terms=sure)
            noise, whitening, fitted = _on_all_rows(found.selector.fit(sure), data)
    ranked = [rivals(found.selector, found.terms, place) for place in range(len(found.terms))]
    findings = [_finding(s, r, data) for s, r in zip(fitted.solved, ranked, strict=True)]
    findings, placements = _with_separations(findings, found.selector.fit(found.terms).solved, ranked, some, noise)
    scatter = _scatter_findings(noise, data)
    found = replace(
        found, unexplained=(*found.unexplained, *(_nameless(one) for one in scatter if one.kind in without))
    )
    findings += [one for one in scatter if one.kind not in without]
    fit = _fit(data, noise, whitening, findings, fitted)
    told = [told_by_clock(one, start_s) for one in findings]
    return _diagnosis(found, told, fit, noise, recorded, placements)


def _confirmed(terms: tuple[Term, ...], fitted: Fitted) -> tuple[Term, ...]:
    """The laws that all rows confirm, of those found in some of them."""

    def sure(one: Solved) -> bool:
        sizes = [p.name for p in type(one.effect).parameters() if p.role == "linear"]
        known = [one.parameters[name] for name in sizes if name in one.parameters]
        return all(p.u is None or abs(p.value) > SURE * p.u for p in known)

    return tuple(term for term, one in zip(terms, fitted.solved, strict=True) if sure(one))


def _some(data: Residuals, recording: Recording) -> Residuals:
    """All rows, or whole cycles spread over a recording that is too long to be searched row by row."""
    if len(data) <= MOST_SEARCHED:
        return data
    run = np.unique(data.frame[["placement", "cycle"]].to_numpy(), axis=0, return_inverse=True)[1].ravel()
    runs = int(run.max()) + 1
    few = max(round(runs * MOST_SEARCHED / len(data)), FEWEST_RUNS)
    # one after the other for what is quick, spread over all for what is slow
    chosen = np.union1d(np.arange(few * 2 // 3), np.linspace(0, runs - 1, few - few * 2 // 3).astype(int))
    rows = np.isin(run, chosen)
    return make_residuals(
        replace(recording, frame=recording.frame.reset_index(drop=True)[rows]), data.gauge, data.machine
    )


def _on_all_rows(found: Fitted, data: Residuals) -> tuple[Noise, Whitening, Fitted]:
    """The scatter and the laws' parameters from all rows of a recording of which some were searched."""
    noise = estimate_noise(replace(data, um=data.um - displaced_um(found.solved, data)))
    whitening = make_whitening(data, noise.by_row_um)
    families = [carried(one.family, one.effect, data) for one in found.solved]
    return noise, whitening, solve(families, [0] * len(families), data, whitening)


def _finding(solved: Solved, rival: Rivals, data: Residuals) -> Finding:
    family = solved.family
    kinds = [look.family.kind for look in rival.looks]
    others = tuple(dict.fromkeys(kind for kind in kinds if kind != family.kind))
    labels = [look.family.label for look in rival.looks[1:] if look.family.kind == family.kind]
    same = tuple(label for label in labels if label != family.label)
    probability = sum(w for kind, w in zip(kinds, rival.weights, strict=True) if kind == family.kind)
    return Finding(
        family.kind,
        family.label,
        solved.effect,
        _choices(solved),
        solved.parameters,
        min(probability, 1.0 - np.exp(rival.looks[0].log_p)),
        solved.displacement_um(data),
        others,
        same,
    )


def _choices(solved: Solved) -> dict[str, object]:
    """Axis, face, ... of an effect, and the direction that was found for it."""
    if solved.family.directions is None:
        return dict(solved.family.choices)
    return {**solved.family.choices, "direction": getattr(solved.effect, "direction", None)}


def _with_separations(
    findings: Sequence[Finding], solved: Sequence[Solved], ranked: Sequence[Rivals], data: Residuals, noise: Noise
) -> tuple[list[Finding], dict[str, str]]:
    """The findings with the reason of their sets and the measurement that would separate them."""
    told: list[Finding] = []
    placements: dict[str, str] = {}
    sets = any(finding.confounded_with or finding.alternatives for finding in findings)
    possible = lengthened(data, noise.sigma_um) if sets else []
    for place, finding in enumerate(findings):
        if not finding.confounded_with and not finding.alternatives:
            told.append(finding)
            continue
        best = separate(place, solved, ranked[place], possible)
        name = f"separate-{len(placements) + 1}"
        by = NO_SEPARATION
        if best is not None:
            placements[f"{name}.toml"] = best.placement_text()
            command = best.command(name, data.gauge.path, data.machine.path)
            rest = f"; {', '.join(best.untold)}: {NO_SEPARATION}" if best.untold else ""
            by = f"{best.run.words}, which tells it from {', '.join(best.told)}: {command}{rest}"
        told.append(replace(finding, reason=_reason(finding, data), separate_by=by))
    return told, placements


def _reason(finding: Finding, data: Residuals) -> str:
    """Why the set cannot be told apart, in words."""
    others = ", ".join([*finding.confounded_with, *finding.alternatives])
    count = int(data.placement.max()) + 1
    where = "the one placement" if count == 1 else f"the {count} placements"
    return f"in {where} of this recording {finding.label} and {others} displace the readings in the same pattern"


def _scatter_findings(noise: Noise, data: Residuals) -> list[Finding]:
    found = []
    nothing = np.zeros(len(data))
    if noise.outliers.size:
        rows = tuple(int(row) + 1 for row in noise.outliers)
        estimate = {"rows": Estimate(float(len(rows)), None, "count")}
        found.append(Finding("outliers", "outliers", None, {"rows": rows}, estimate, 0.998, nothing))
    if noise.growth is not None:
        per, rate, p = noise.growth
        choices: dict[str, object] = {"per": per}
        if per == "time":
            choices["start_s"] = float(data.probings.time_s.min())
        parameters = {"rate": Estimate(rate, None, GROWTH_UNITS.get(per, "um/m"))}
        found.append(Finding("noise_growth", f"noise_growth_{per}", None, choices, parameters, 1.0 - p, nothing))
    return found


def _nameless(finding: Finding) -> Located:
    """What disturbs the scatter, where its kind is no candidate."""
    if finding.kind == "outliers":
        return Located(
            "order", "both", ISOLATED, "single probings lie far outside the scatter", 0.0, 1.0 - finding.probability
        )
    per = str(finding.choices["per"])
    covariate = f"machine {per}" if per in AXES else per
    return Located(covariate, "both", GROWING, f"the scatter grows with {covariate}", 0.0, 1.0 - finding.probability)


def _fit(data: Residuals, noise: Noise, whitening: Whitening, findings: Sequence[Finding], fitted: Fitted) -> Fit:
    left, basis = fitted.left, fitted.basis
    before = whitening(data.um)
    columns = [f.share_um for f in findings if f.share_um.any()]
    design = np.array(columns).T if columns else np.zeros((len(data), 0))
    none = np.zeros((len(data), 0))
    holdout = {
        folds.by: (
            holdout_rms(data, noise.by_row_um, none, folds),
            holdout_rms(data, noise.by_row_um, design, folds),
        )
        for folds in make_folds(data)
    }
    used = np.isfinite(noise.by_row_um)
    return Fit(
        noise.sigma_um,
        noise.dof,
        _rms(_centred(data, data.um)[used]),
        _rms(_centred(data, data.um - design.sum(axis=1))[used]),
        holdout,
        float(before @ before) / max(whitening.dof, 1),
        float(left @ left) / max(whitening.dof - basis.shape[1], 1),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean())) if values.size else float("nan")


def _centred(data: Residuals, um: Array) -> Array:
    """Residuals with the mean origin of every placement taken out along the gauge."""
    along = um * data.side
    count = data.placement.max() + 1
    mean = np.bincount(data.placement, along, count) / np.bincount(data.placement, minlength=count)
    return um - data.side * mean[data.placement]


def _insufficient(data: Residuals, noise: Noise) -> Diagnosis:
    whitening = make_whitening(data, noise.by_row_um)
    located = most_telling(all_forms(data, whitening), whitening(data.um))
    fit = _fit(data, noise, whitening, [], solve([], [], data, whitening))
    return Diagnosis("insufficient", (), located, (), fit, noise, data, data.um, data.um, ())


def _where(found: Explained) -> tuple[Located, ...]:
    """Where the disagreement lives: in what tells most, and in what the laws leave where that is something else."""
    told = {one.covariate for one in found.located}
    return (*found.located, *(one for one in found.unexplained if one.covariate not in told))


def _diagnosis(
    found: Explained,
    findings: Sequence[Finding],
    fit: Fit,
    noise: Noise,
    data: Residuals,
    placements: dict[str, str],
) -> Diagnosis:
    verdict: Verdict = "unknown" if found.unexplained else "effects" if findings else "adequate"
    shares = np.sum([f.share_um for f in findings], axis=0) if findings else np.zeros(len(data))
    before, after = _centred(data, data.um), _centred(data, data.um - shares)
    return Diagnosis(
        verdict,
        tuple(findings),
        _where(found),
        found.unexplained,
        fit,
        noise,
        data,
        before,
        after,
        tuple(found.selector.trail),
        placements,
        tuple(_remarks(found, data)),
        found.refuted,
    )


def _remarks(found: Explained, data: Residuals) -> Iterator[str]:
    """What has to be known of the search to read what it says."""
    searched = len(found.selector.residuals)
    if searched < len(data):
        yield f"searched in {searched} of {len(data)} rows, fitted to all of them"
    if start_s := clock_start_s(data):
        yield f"where something lives in time is counted from the first touch, at which the clock read {start_s:.12g} s"

"""From a recording to a diagnosis: residuals, problem, posterior, statements."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from stepgauge.axis.sensors import without_probe
from stepgauge.diagnosis.clock import clock_start_s, counted_from, on_recording_clock
from stepgauge.diagnosis.design import add_separations, worth_measuring
from stepgauge.diagnosis.findings import findings
from stepgauge.diagnosis.fits.solve import solve
from stepgauge.diagnosis.holdout import holdout_rms, make_folds
from stepgauge.diagnosis.hypotheses import Searched
from stepgauge.diagnosis.laws import geometry
from stepgauge.diagnosis.laws.library import carried
from stepgauge.diagnosis.noise import (
    degrees,
    disturbed,
    is_repeated,
    noise_of,
    row_scatter_um,
    stated_scatter,
    unlike_stated,
)
from stepgauge.diagnosis.priors import KIND, Priors, nearest_name, shipped_priors, stated_kind
from stepgauge.diagnosis.problem import bare_problem, make_problem, plain_metric
from stepgauge.diagnosis.remainder import is_negligible, may_remain, negligible
from stepgauge.diagnosis.residuals import Residuals, make_residuals, without_copies
from stepgauge.diagnosis.result import Finding, Fit, GaugeDiagnosis, Located, Noise, rms
from stepgauge.diagnosis.stated_model import Model, make_model
from stepgauge.diagnosis.statements import conclude, undecided
from stepgauge.diagnosis.stating_rules import answer_of, structure_alone
from stepgauge.diagnosis.structure import inexact_laws, structure
from stepgauge.diagnosis.wording.phrases import Phrase, misfit, number
from stepgauge.diagnosis.wording.structure import SCATTER, located
from stepgauge.effects import effect_kinds
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.inference.hypothesis import Hypothesis, log_posterior
from stepgauge.inference.metric import Metric
from stepgauge.inference.search import Progress, Search
from stepgauge.machine.file import Machine
from stepgauge.probes.schema import USUAL_PRETRAVEL_UM
from stepgauge.recording import Recording

FEWEST_DOF = 8
MOST_SEARCHED = 3000
"""Largest number of rows in the search; the laws found are fitted to all."""
FEWEST_RUNS = 6
CONFIRMED = 4.0
"""Standard uncertainties from which all rows confirm the size of a law that was found in some."""


def diagnose(
    recording: Recording,
    gauge: Gauge,
    machine: Machine,
    without: Collection[str] = (),
    priors: Priors | None = None,
    separations: bool = True,
    progress: Progress | None = None,
    kind: str | None = None,
) -> GaugeDiagnosis:
    """Find where recording and simulation disagree, and the effects that explain it.

    Parameters
    ----------
    recording : one or more placements, joined
    gauge : the certificate
    machine : the model to be tested, with its effects
    without : kinds of effects that are no candidates, because they are known to be absent
    priors : the table of priors, the shipped one by default
    separations : whether to look for the further run that discriminates most of each set
    progress : told the labels of what is most probable up to now, whenever that changes
    kind : of the machine, in place of that in its file: a name in the table of priors

    Raises
    ------
    InputError
        recordings of another gauge, or too small for a diagnosis; kinds that do not exist
    """
    absent, table = {*without, *without_probe(recording.comments.get("sensor"))}, priors or shipped_priors()
    kind = stated_kind(kind, {KIND: machine.table.kind or ""}, table, machine.path)
    table = table.adapt([kind] if kind else [])
    machine = replace(machine, table=machine.table.model_copy(update={KIND: kind}))
    recorded = without_copies(make_residuals(recording, gauge, machine))
    return diagnose_with_search(recorded, absent, table, separations, progress)[0]


@threadpool_limits.wrap(limits=1, user_api="blas")
def diagnose_with_search(
    recorded: Residuals,
    without: Collection[str] = (),
    priors: Priors | None = None,
    separations: bool = True,
    progress: Progress | None = None,
) -> tuple[GaugeDiagnosis, Searched | None]:
    """The diagnosis of residuals and the search that it is made from, None where they are too few; as :func:`diagnose`.

    On one thread: many small products are five times slower if several threads share each.
    """
    known = {*effect_kinds(), geometry.KIND}
    for kind in without:
        if kind not in known:
            expected = nearest_name(kind, sorted(known))
            raise InputError(naming("without"), "no such kind of effect", found=kind, expected=expected)
    start_s, table = clock_start_s(recorded), priors or shipped_priors()
    some = counted_from(_some(recorded), start_s)
    if degrees(some) < FEWEST_DOF:
        return insufficient(recorded), None
    search = Search(make_problem(some, table, without), table.scatter, progress)
    found = _answered(some, search, table)
    told = _make_diagnosis(found, recorded, start_s, table, without, separations)
    met = _most_probable(search)
    if met.log_posterior > found.reached + np.log(table.decision.excluded):
        # the averages met what no step of the search leads to, as several laws in place of one form
        found = _answered(some, search, table, search.climbed(met))
        told = _make_diagnosis(found, recorded, start_s, table, without, separations)
    return told, found


def _some(data: Residuals) -> Residuals:
    """All rows, or whole cycles spread over a recording that is too long to search all rows."""
    if len(data) <= MOST_SEARCHED:
        return data
    run = np.unique(data.frame[["placement", "cycle"]].to_numpy(), axis=0, return_inverse=True)[1].ravel()
    runs = int(run.max()) + 1
    if runs < FEWEST_RUNS:  # a long series of one spot
        return data.at(np.isin(np.arange(len(data)), np.linspace(0, len(data) - 1, MOST_SEARCHED).astype(int)))
    few = max(round(runs * MOST_SEARCHED / len(data)), FEWEST_RUNS)
    # one after the other for what is quick, spread over all for what is slow
    chosen = np.union1d(np.arange(few * 2 // 3), np.linspace(0, runs - 1, few - few * 2 // 3).astype(int))
    return data.at(np.isin(run, chosen))


def _answered(data: Residuals, search: Search, priors: Priors, best: Hypothesis | None = None) -> Searched:
    answer = answer_of(search, priors.decision, best)
    reached = _most_probable(search).log_posterior
    return Searched(data, search, answer, make_model(search, answer, data, priors), reached)


def _most_probable(search: Search) -> Hypothesis:
    """Of all hypotheses that were computed."""
    return max(search.evidence.best_by_labels.values(), key=log_posterior)


def _make_diagnosis(
    found: Searched,
    recorded: Residuals,
    start_s: float,
    priors: Priors,
    without: Collection[str],
    separations: bool,
) -> GaugeDiagnosis:
    search, answer, model = found.search, found.answer, found.model
    data = found.data if len(found.data) == len(recorded) else counted_from(recorded, start_s)
    told = list(findings(model, answer, found.data, priors))
    left = list(structure(model, answer, found.data, priors))
    if len(found.data) < len(data):
        told = _on_all_rows(told, model, data)
        left = [replace(one, share_um=np.zeros(0)) for one in left]
    noise, remaining = noise_of(model, search.problem, data), tuple(may_remain(found))
    nothing = negligible(remaining, noise.sigma_um, data.machine.table.kind)
    left = [one for one in left if not is_negligible(one, nothing)]
    if not any(one.probability >= priors.decision.stated for one in left):
        left += undecided(answer, told, priors.decision)
    told, left, placements = add_separations(told, left, found, priors, separations)
    named, nameless = stated_scatter(answer, model, noise, data, priors, without)
    told += named
    left += [*nameless, *disturbed(answer, model, search.problem, found.data, start_s, priors)]
    if not named and not any(one.form in SCATTER for one in left):
        told = [*unlike_stated(noise, search.problem, data, priors), *told]
    told = [on_recording_clock(one, start_s) for one in told]
    concluded = conclude(answer, told, left, priors.decision, nothing)
    further = ""
    if concluded.verdict == "insufficient" and separations:
        further, placements = worth_measuring(found, priors)
    remainder_um = model.remainder_um if len(found.data) == len(data) else np.zeros(len(data))
    shares = np.sum([remainder_um, *(one.share_um for one in concluded.findings)], axis=0)
    fit = _fit(data, noise, concluded.findings, remainder_um)
    remarks = (
        *_remarks(found, data, start_s),
        *_pretravel(found, data, data.um - shares),
        *misfit(fit.rms_before_um, fit.rms_after_um),
    )
    return GaugeDiagnosis(
        verdict=concluded.verdict,
        findings=concluded.findings,
        located=tuple(_where(search, model, concluded.structure, priors)),
        unexplained=concluded.structure,
        fit=fit,
        noise=noise,
        data=recorded,
        before_um=recorded.without_origins(recorded.um),
        after_um=recorded.without_origins(recorded.um - shares),
        trail=tuple(search.trail),
        placements=placements,
        further=further,
        may_remain=remaining,
        remarks=remarks,
        probabilities=concluded.table,
        checks=model.checks,
    )


def _where(search: Search, model: Model, left: Sequence[Located], priors: Priors) -> Iterator[Located]:
    """Covariates of the stated forms, and of the residuals before any law is named; one form to a covariate."""
    yield from left
    known, least = {one.covariate for one in left}, priors.decision.in_set
    for look, probability, share in structure_alone(search, model.state, known, least):
        yield located(look.candidate, look.atom, probability, share)


def _on_all_rows(told: Sequence[Finding], model: Model, data: Residuals) -> list[Finding]:
    """The laws that were found in some rows, fitted to all rows; those not confirmed by these are dropped.

    All errors of the geometry at once stay as they are.
    """
    metric = plain_metric(bare_problem(data), model.state.sigma_um)
    families = [carried(one.family, one.effect, data) for one in model.fitted.solved]
    solved = solve(families, [0] * len(families), data, metric).solved
    fitted = [
        replace(one, effect=s.effect, parameters=s.parameters, share_um=s.displacement_um(data))
        for one, s in zip((one for one in told if not one.effects), solved, strict=True)
        if all(one.u is None or abs(one.value) > CONFIRMED * one.u for one in s.sizes)
    ]
    return [*fitted, *(replace(one, share_um=geometry.moved_um(one.effects, data)) for one in told if one.effects)]


def _fit(data: Residuals, noise: Noise, stated: Sequence[Finding], remainder_um: Array) -> Fit:
    """Agreement before and after; chi-square by the repeatability, which what is named does not make larger.

    ``beside_um``: see :attr:`.StatedModel.remainder_um`.
    """
    problem = bare_problem(data)
    columns = [um for um in (remainder_um, *(one.share_um for one in stated)) if um.any()]
    design = np.array(columns).T if columns else np.zeros((len(data), 0))
    left_um = data.um - design.sum(axis=1)
    repeating_um = problem.repeating_um(left_um) if noise.repeats else None
    used = np.isfinite(noise.by_row_um)
    # what moves a face from repeat to repeat is no repeatability: not more than the scatter of the stated model
    stated_um = rms(noise.by_row_um[used]) / problem.typical
    sigma_um = max(min(stated_um, repeating_um or np.inf), problem.least_um)
    metric = plain_metric(problem, sigma_um)
    none = np.zeros((len(data), 0))
    holdout = {
        by: (holdout_rms(data, noise.by_row_um, none, fold), holdout_rms(data, noise.by_row_um, design, fold))
        for by, fold in make_folds(data).items()
    }
    before, after = metric(data.um * used), metric(left_um * used)
    free = sum(len(one.parameters) for one in stated if one.share_um.any())
    dof = max(int(used.sum()) - len(problem.free), 1)
    return Fit(
        rms(data.without_origins(data.um)[used]),
        rms(data.without_origins(left_um)[used]),
        holdout,
        float(before @ before) / dof,
        float(after @ after) / max(dof - free, 1),
    )


REVERSAL = "reversal_error"
"""A law that moves all readings of a placement as the radius does: where its size is open, so is the radius."""


def _pretravel(found: Searched, data: Residuals, left_um: Array) -> Iterator[Phrase]:
    """The pre-travel that nobody stated, by what is left of the readings beside the origins: a value, and no fault."""
    if not data.radius_stated:
        sizes_um = np.linalg.lstsq(data.origins.T, left_um, rcond=None)[0]
        um = float(USUAL_PRETRAVEL_UM + sizes_um[len(data.origins) - len(data.radii)])
        vague = any(one.named and one.label.startswith(REVERSAL) for one in found.model.forms)
        u = {} if vague else {"u": number(_radius_u_um(found), "um")}
        yield {"say": "pretravel", "um": number(um, "um"), **u}


def _radius_u_um(found: Searched) -> float:
    """Standard uncertainty of the effective radius that nobody stated, beside origins, laws, forms and certificate.

    Each law may be larger by as much as it was found: where it moves all readings as the radius does, u is its size.
    """
    model, data, problem = found.model, found.data, found.search.problem
    state, beside = model.state, [one.term.nuisance for one in (*model.forms, *model.geometry)]
    known = replace(problem, free=problem.free[:0])
    metric = Metric(known, state.noise, found.search.noise_models, state.sigma_um, beside)
    laws = [one.displacement_um(data) for one in model.fitted.solved]
    columns = metric(np.vstack([data.origins, *laws]))
    prior = np.repeat([0.0, 1.0], [len(data.origins), len(laws)])
    variance = np.linalg.pinv(columns @ columns.T + np.diag(prior)).diagonal()
    return float(np.sqrt(variance[len(data.origins) - len(data.radii)]) * model.wider)


def insufficient(recorded: Residuals) -> GaugeDiagnosis:
    """The diagnosis of residuals that cannot tell: no search is made."""
    data = _some(recorded)
    problem = bare_problem(data)
    sigma = problem.within_um
    by_row, none = row_scatter_um(data, sigma), np.zeros(0, np.intp)
    noise = Noise(sigma * problem.typical, by_row, max(degrees(data), 0), none, is_repeated(data))
    fit = _fit(data, noise, [], np.zeros(len(data)))
    return GaugeDiagnosis(verdict="insufficient", fit=fit, noise=noise, data=data, before_um=data.um, after_um=data.um)


def _remarks(found: Searched, data: Residuals, start_s: float) -> Iterator[Phrase]:
    """Remarks on the search that the reader of its results needs."""
    scatter = found.model.state.noise
    if len(found.data) < len(data):
        yield {"say": "searched", "some": str(len(found.data)), "every": str(len(data))}
    yield from inexact_laws(found.model)
    if start_s:
        yield {"say": "clock", "start": number(start_s, "s")}
    if scatter.certificate > 1.0:
        yield {"say": "certificate", "factor": number(scatter.certificate)}
    if scatter.tails == "heavy":
        yield {"say": "heavy"}
    if scatter.rounded and np.any(found.data.latched_um):
        yield {"say": "latched"}
    elif scatter.rounded:
        yield {"say": "resolution", "step": number(found.search.problem.step_um, "um")}

"""The residuals of a recording as a problem: nuisances, order of probing, and all laws and forms as candidates."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from stepgauge.diagnosis.covariates import everywhere
from stepgauge.diagnosis.gaussian_processes.candidates import random_function_candidates
from stepgauge.diagnosis.laws.candidates import law_candidates
from stepgauge.diagnosis.laws.geometry import KIND, geometry_of
from stepgauge.diagnosis.laws.grids import finest_period_mm, share_below
from stepgauge.diagnosis.laws.parts import laws_in_parts
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.inference.problem import Law, Problem
from stepgauge.recording import POSITION

LEAST_GAP = 0.2
"""Least time between neighbours over the typical one: readings with equal times are not one reading."""
LEFT = np.geomspace(0.03, 1.0, 36)
"""Shares of the scatter of repeats that may be left beside its stated growth, where no repeatability is stated."""
NANOMETRE = 1e-3
"""Repeatability below which a recording without a stated one tells nothing of it, um."""
STEP_GRAIN_UM = 0.01
"""A resolution finer than this counts as none."""


def make_problem(data: Residuals, priors: Priors, without: Collection[str] = ()) -> Problem:
    """The problem of a recording, with all its candidates; without the kinds in ``without``."""
    bare = bare_problem(data)
    laws = law_candidates(data, priors, plain_metric(bare, bare.within_um, priors), without)
    kinds, finer = {law.kind for law in laws}, _finer_odds(laws, data)
    geometry = None if KIND in without else geometry_of(laws, data, priors)
    laws += [] if geometry is None else [geometry]
    functions = random_function_candidates(data, priors, bare.scale_um * bare.typical, kinds, finer=finer)
    candidates = (*laws, *functions)
    return replace(bare, candidates=candidates, in_part=laws_in_parts(data, priors))


def _finer_odds(laws: Sequence[Law], data: Residuals) -> float:
    """Prior odds of all periods along the line that are shorter than those that are tried."""
    finest_mm = finest_period_mm(data)
    if finest_mm is None:
        return 0.0
    periods = [
        (law, p)
        for law in laws
        for p in law.source.law.parameters()
        if p.decades and p.name == law.source.law.rhythm()[0]
    ]
    along = [(law, p) for law, p in periods if "coordinate" in law.source.law.covariates]
    return sum(float(np.exp(law.log_odds)) * share_below(p, finest_mm, data) for law, p in along)


def bare_problem(data: Residuals, independent: bool = False) -> Problem:
    """The problem of a recording without candidates; ``independent``: for scatter that is the same for every row."""
    face = data.face - data.face.min()
    certified = (face == np.arange(face.max() + 1)[:, None]) * data.side
    u_um = data.gauge.u_own_um[data.face.min() - 1 :][: len(certified)]
    shown = certified.any(axis=1) & (u_um > 0.0)  # targets are exact; hundreds of columns that move nothing are slow
    shared = data.gauge.u_common_um[:, data.face - 1] * data.side
    shared = shared[shared.any(axis=1)]
    size_um = np.abs(shared).max(axis=1)
    # what the scatter may grow with, from 0 to 1
    growing = {c.name: (c.values - c.values.min()) / c.span for c in ([] if independent else everywhere(data))}
    stated_um, grown_um = float(data.machine.table.repeatability_um), np.hypot(data.grown_um, data.latched_um)
    problem = Problem(
        residual_um=data.um,
        scale_um=stated_um,
        certified=np.vstack([certified[shown], shared / size_um[:, None]]),
        certified_u=np.concatenate([u_um[shown], size_um]),
        known_um=data.lengths_um,
        free=data.origins.astype(float),
        order=data.order,
        gap=np.zeros(0) if independent else _gaps(data),
        growing=growing,
        step_um=0.0 if independent else display_step_um(data),
        group=data.group,
        candidates=(),
        latched_um=data.latched_um,
    )
    # a machine file may say that readings repeat perfectly, and means that it does not know
    scale_um = stated_um if stated_um > 0.0 else _left_um(problem, grown_um)
    if scale_um < NANOMETRE:
        scale_um = shipped_priors().sizes.repeatability_um
    return replace(problem, scale_um=scale_um, stated=1.0 + (grown_um / scale_um) ** 2)


def plain_metric(problem: Problem, sigma_um: float, priors: Priors | None = None) -> Metric:
    """The whitening of scatter that nothing but what is stated makes grow."""
    scatters = NoiseModels(problem, (priors or shipped_priors()).scatter)
    return Metric(problem, scatters.plain(), scatters, sigma_um)


def _left_um(problem: Problem, grown_um: Array | float) -> float:
    """The most likely scatter of repeats beside its stated growth, um."""
    if not np.any(grown_um):
        return problem.within_um
    count = np.bincount(problem.group)[problem.group]
    mean = np.bincount(problem.group, problem.residual_um)[problem.group] / count
    square = (problem.residual_um - mean) ** 2 * count / np.maximum(count - 1, 1)
    left_um = problem.within_um * LEFT
    variance = (left_um[:, None] ** 2 + np.square(grown_um))[:, count > 1]
    return float(left_um[(np.log(variance) + square[count > 1] / variance).sum(axis=1).argmin()])


def _gaps(data: Residuals) -> Array:
    """Time between neighbours over the typical one, infinite between placements and where no order is known."""
    if not data.is_ordered:
        return np.full(len(data) - 1, np.inf)
    time = data.frame["time_s"].to_numpy(float)[data.order] if data.has_time else np.arange(float(len(data)))
    gap = np.diff(time)
    gap = np.maximum(gap / max(float(np.median(gap)), 1e-9), LEAST_GAP)
    return np.where(np.diff(data.placement[data.order]) != 0, np.inf, gap)


def display_step_um(data: Residuals) -> float:
    """The resolution of the readings along the gauge, um; 0 if none is seen."""
    if data.step_um is not None:
        return data.step_um
    axis = int(np.abs(np.mean(list(data.probings.setting.axis.values()), axis=0)).argmax())
    grains = data.frame[POSITION[axis]].to_numpy(float) * 1e3 / STEP_GRAIN_UM
    whole = np.rint(grains)
    if np.abs(grains - whole).max() > 1e-3 * max(1.0, float(np.abs(grains).max()) * 1e-9):
        return 0.0
    step = int(np.gcd.reduce((whole - whole[0]).astype(np.int64)))
    return step * STEP_GRAIN_UM if step > 1 else 0.0

"""The scatter of a diagnosis: that of every row in the stated model, and what is stated of the scatter itself."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnosis.checks import noiseless
from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import OUTLIERS, Finding, Located, Noise
from stepgauge.diagnosis.stated_model import Model
from stepgauge.diagnosis.stating_rules import SURE_OUTLIER
from stepgauge.diagnosis.wording.phrases import number
from stepgauge.diagnosis.wording.structure import CORRELATED, DISTURBED, GROWING
from stepgauge.files.arrays import Array
from stepgauge.inference.noise_models import OUTLYING, NoiseModel
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.problem import Problem

AT_LEAST = 1.05
"""Ratio to the least scatter that readings may have up to which none was measured."""
REPEATABILITY = "repeatability"
"""Kind of the finding that the scatter is not the one that the machine file states."""
GROWTH_UNITS = {"time": "um/h", "speed": "um/(mm/s)"}
"""Units of the rate of growing scatter; otherwise per length."""


def noise_of(model: Model, problem: Problem, data: Residuals) -> Noise:
    """The scatter of every row in the stated model."""
    state, scatter = model.state, model.state.noise
    latched_um = np.broadcast_to(problem.latched_um, (len(problem),)) * scatter.rounded
    by_row = np.hypot(state.sigma_um * np.sqrt(model.metric.rows.scale**-2.0 * scatter.weight), latched_um)
    typical_um = state.sigma_um * bare_problem(data).typical
    outliers = np.flatnonzero(scatter.outlying > SURE_OUTLIER) if scatter.outlying is not None else np.zeros(0, int)
    by_row[outliers] = np.inf
    if len(problem) < len(data):
        by_row, outliers = row_scatter_um(data, state.sigma_um), np.zeros(0, int)
    told_by_repeats = is_repeated(data) and not latched_um.any()
    return Noise(typical_um, by_row, max(degrees(data), 1), outliers, told_by_repeats, noiseless(problem, state))


def row_scatter_um(data: Residuals, sigma_um: float) -> Array:
    """The scatter of every row where nothing but what the machine file states makes it grow."""
    return sigma_um * np.sqrt(bare_problem(data).stated) * np.ones(len(data))


def degrees(data: Residuals) -> int:
    """Degrees of freedom: rows minus origins or, with repeats, rows minus means."""
    count = np.bincount(data.group)
    within = int((np.maximum(count, 1) - 1).sum())
    return within if is_repeated(data) else len(data) - int(data.placement.max()) - 3


def is_repeated(data: Residuals) -> bool:
    """Whether most faces were probed repeatedly."""
    count = np.bincount(data.group)
    return bool((count[data.group] > 1).mean() > 0.5)


def stated_scatter(
    answer: Posterior, model: Model, noise: Noise, data: Residuals, priors: Priors, without: Collection[str]
) -> tuple[list[Finding], list[Located]]:
    """Outliers and growing scatter as findings, correlated scatter as a form; kinds in ``without`` as forms, too."""
    stated, scatter = priors.decision.stated, model.state.noise
    named: list[Finding] = []
    left: list[Located] = []
    p = answer.probability_of_scatter(OUTLYING)
    if p >= stated and noise.outliers.size:
        named.append(outlier_finding(data.row[noise.outliers] + 1, p, len(data)))
    p = answer.probability_of_scatter("growth")
    grown = scatter if scatter.growth is not None else answer.likeliest_scatter("growth")
    if p >= stated and grown is not None:
        named.append(_growing(grown, noise.sigma_um, p, data))
    p = answer.probability_of_scatter("correlation")
    if p >= stated and scatter.correlated:
        how = {"say": "correlated", "correlation": number(scatter.correlation)}
        name = "time" if data.has_time else "order"
        left.append(Located(name, "both", CORRELATED, [{"say": "flicker"} if scatter.flicker else how], 0.0, p))
    for one in [one for one in named if one.kind in without]:
        covariate = "order" if one.kind == OUTLIERS else str(one.choices["per"])
        phrase = {"say": "excluded_kind", "law": one.kind, "covariate": covariate}
        left.append(Located(covariate, "both", GROWING, [phrase], 0.0, one.probability))
    return [one for one in named if one.kind not in without], left


def outlier_finding(rows: NDArray[np.intp], p: float, size: int) -> Finding:
    """Rows that are not used, by their numbers from 1; ``size``: number of residuals."""
    count = {"rows": Estimate(float(len(rows)), None, "count")}
    return Finding(OUTLIERS, OUTLIERS, None, {"rows": tuple(map(int, rows))}, count, p, np.zeros(size), own=p)


def disturbed(
    answer: Posterior, model: Model, problem: Problem, data: Residuals, start_s: float, priors: Priors
) -> Iterator[Located]:
    """Larger scatter in a stretch of the record as a form over the time, or over the order of reading."""
    burst, p = model.state.noise.burst, answer.probability_of_scatter("burst")
    if burst is None or p < priors.decision.stated:
        return
    first, end, factor = burst
    phrase: dict[str, Any] = {"say": "disturbed_rows", "first": str(first + 1), "end": str(end)}
    if data.has_time:
        low, high = data.probings.time_s[problem.order[[first, end - 1]]] + start_s
        phrase = {"say": "disturbed", "first": number(low, "s"), "end": number(high, "s")}
    phrase["factor"] = number(factor)
    yield Located("time" if data.has_time else "order", "both", DISTURBED, [phrase], 0.0, p)


def unlike_stated(noise: Noise, problem: Problem, data: Residuals, priors: Priors) -> Iterator[Finding]:
    """Scatter larger or smaller than the machine file states, by more than such statements usually are off.

    The logarithm of an estimated standard deviation has the standard uncertainty 1 / sqrt(2 dof) (GUM E.4.3). A
    recording without a machine file states nothing, and is judged by its own repeats; what is no more than the step of
    a display was not measured.
    """
    stated_um = data.machine.table.repeatability_um
    if data.probings.setting.recording != "gauge" or stated_um <= 0.0:
        return
    if noise.sigma_um <= AT_LEAST * problem.least_um * problem.typical:
        return
    ratio = noise.sigma_um / (problem.scale_um * problem.typical)
    if ratio < 1.0 and not noise.repeats:
        return  # readings that agree by a latch tell nothing
    u = 1.0 / np.sqrt(2.0 * noise.dof)
    p = float(special.ndtr((abs(np.log(ratio)) - np.log(priors.scatter.sigma_factor)) / u))
    values = {
        "repeatability_um": Estimate(noise.sigma_um, noise.sigma_um * u, "um"),
        "stated_um": Estimate(noise.sigma_um / ratio, None, "um"),
    }
    if p >= priors.decision.stated:
        yield Finding(REPEATABILITY, REPEATABILITY, None, {}, values, p, np.zeros(len(data)), own=p)


def _growing(scatter: NoiseModel, sigma_um: float, p: float, data: Residuals) -> Finding:
    """Growing scatter as the effect ``noise_growth``: a rate per metre, hour or mm/s."""
    assert scatter.growth is not None
    name, rate = scatter.growth
    per = name.removeprefix("machine ")
    choices: dict[str, object] = {"per": per}
    span = _span(per, data)
    if per == "time":
        choices["start_s"] = float(data.probings.time_s.min())
    estimate = {"rate": Estimate(rate * sigma_um / span, None, GROWTH_UNITS.get(per, "um/m"))}
    return Finding("noise_growth", f"noise_growth_{per}", None, choices, estimate, p, np.zeros(len(data)), own=p)


def _span(per: str, data: Residuals) -> float:
    """Span of the covariate of growing scatter, in the unit of the effect."""
    if per == "time":
        return float(np.ptp(data.probings.time_s)) / 3600.0
    if per == "speed":
        return float(np.ptp(data.probings.speed_mm_s))
    values = data.probings.certified_mm() if per == "position" else data.probings.coordinate_mm(per)
    return float(np.ptp(values)) * 1e-3

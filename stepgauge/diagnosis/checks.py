"""The posterior predictive check: do the residuals of the best hypothesis agree with its scatter?

Each part compares a statistic of the residuals with its distribution under the hypothesis, in standard deviations of
it: rows (the largest one), repeats (their scatter against all rows'), sequence (neighbours in the order
of probing), tails (the fourth moment).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import special

from stepgauge.diagnosis.result import Check
from stepgauge.diagnosis.wording.phrases import number
from stepgauge.files.arrays import Array
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import Problem

ALLOWED = 4.0
"""Standard deviations up to which a part passes: four parts of a thousand recordings fail one by chance in four."""


def predictive_checks(problem: Problem, state: Hypothesis, metric: Metric) -> tuple[Check, ...]:
    """All parts of the check; ``metric``: that of the scatter of the state at its sigma."""
    independent = metric.rows(state.residual_um) / state.sigma_um
    return tuple(_checks(problem, state, independent, metric))


def noiseless(problem: Problem, state: Hypothesis) -> bool:
    """Whether less is left than the least scatter that a reading can have."""
    return float(np.sqrt((state.residual_um**2).mean())) < problem.least_um


def widening(checks: tuple[Check, ...], problem: Problem, state: Hypothesis, metric: Metric) -> float:
    """Factor on standard uncertainties from the result of the check, one if all parts pass.

    Correlated neighbours have less information than as many independent readings: for a correlation r the variance of
    a mean is larger by (1 + r) / (1 - r). If repeats scatter less than the rest, the model lacks some structure, and
    all uncertainties are increased by the ratio.
    """
    factor, failed = 1.0, {one.check for one in checks if not one.passed}
    if "sequence" in failed:
        r = min(_neighbours(problem, metric.rows(state.residual_um)), 0.98)
        factor *= float(np.sqrt((1.0 + r) / (1.0 - r))) if r > 0.0 else 1.0
    if "repeats" in failed:
        within = problem.repeating_um(problem.residual_um, _ordinary(state, metric)) or problem.within_um
        factor *= max(state.sigma_um / within, 1.0)
    return factor


def _ordinary(state: Hypothesis, metric: Metric) -> Array:
    """Variance of every row over that of an ordinary one, without outliers and tails, ``(n,)``."""
    return np.asarray(state.noise.weight / metric.rows.scale**2)


def _checks(problem: Problem, state: Hypothesis, independent: Array, metric: Metric) -> Iterator[Check]:
    n = len(independent)
    largest = float(np.abs(independent).max())
    chance = float(np.log(2.0 * n) + special.log_ndtr(-largest))
    rows = 0.0 if chance > np.log(0.5) else -float(special.ndtri_exp(chance))
    yield _check("rows", rows, largest=number(largest))
    if noiseless(problem, state):
        return  # less than the least scatter is left, and has no structure that anybody would see
    within = problem.repeating_um(state.residual_um, _ordinary(state, metric))
    if within is not None and state.noise.weight.min() > 0.5:
        dof = int((np.bincount(problem.group) - 1).sum())
        ratio = state.sigma_um / max(within, 1e-12)
        sizes = {"within": number(within, "um"), "all": number(state.sigma_um, "um")}
        yield _check("repeats", float(np.log(ratio)) * np.sqrt(2.0 * dof), **sizes)
    r = _neighbours(problem, independent)
    yield _check("sequence", r * np.sqrt(n), correlation=number(r), negative=number(-r))
    excess = float((independent**4).mean() / (independent**2).mean() ** 2) - 3.0
    # the fourth moment of a normal sample is skewed itself: its cube root is nearly normal
    tails = float(np.cbrt(max(excess, -2.0) + 3.0) - np.cbrt(3.0)) * np.sqrt(n / 24.0) * 3.0 * np.cbrt(9.0)
    yield _check("tails", tails, excess=number(excess), negative=number(-excess))


def _check(name: str, deviation: float, **sizes: Any) -> Check:
    return Check(name, float(deviation), bool(abs(deviation) <= ALLOWED), {"say": f"check_{name}", **sizes})


def _neighbours(problem: Problem, independent: Array) -> float:
    """Correlation of neighbours; with correlated scatter the rows are in this order already."""
    turn = independent[problem.order]
    turn = turn - turn.mean()
    return float((turn[1:] * turn[:-1]).sum() / max(float((turn**2).sum()), 1e-300))

"""Shapes whose posterior is no single peak, integrated over all that are possible.

A lag that the fit leaves at a bound: the best fit of a body that follows within the time between two touches is one
that follows at once, and that of one slower than the recording is as slow as was tried. At a bound there is no
curvature that gave an uncertainty. And the azimuth of a tripod: its force has corners, and from few directions an arm
may pass for a gap between two.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnosis.fitting import Beside, beside
from stepgauge.diagnosis.library import Family, family_signatures
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.solve import Estimate, Fitted, Solved

Array = NDArray[np.float64]
LAG, AZIMUTH = "lag_s", "arm_azimuth_deg"
SHORTER = (0.125, 0.25, 0.5)
"""Lags below the shortest of the grid, over it: frequent readings tell them from none."""


def with_marginals(fitted: Fitted, data: Residuals, metric: Metric) -> Fitted:
    """The fit, with mean and standard deviation of a lag at a bound and its sizes, and that of an azimuth."""
    solved = []
    for place, one in enumerate(fitted.solved):
        if _is_at_a_bound(one):
            one = _with_mean_lag(one, beside(fitted, place, data, metric), data)
        if AZIMUTH in one.family.atoms[0]:
            one = _with_all_azimuths(one, beside(fitted, place, data, metric))
        solved.append(one)
    return replace(fitted, solved=tuple(solved))


def _is_at_a_bound(solved: Solved) -> bool:
    told = solved.parameters.get(LAG)
    return bool(_lags_s(solved.family)) and (told is None or told.u is None)


def _lags_s(family: Family) -> list[float]:
    return sorted({float(atom[LAG]) for atom in family.atoms if atom.get(LAG) is not None})


def _with_mean_lag(solved: Solved, beside: Beside, data: Residuals) -> Solved:
    """The law with its lag averaged by marginal likelihood beside the other laws, lags spaced by their logarithm."""
    grid = _lags_s(solved.family)
    lags = np.array([0.0, *(share * grid[0] for share in SHORTER), *grid])
    signatures = (family_signatures(solved.family, {**_shape(solved), LAG: float(lag)}, data) for lag in lags)
    found = [_sized(beside(one), beside.left, solved.family.prior) for one in signatures]
    weight = special.softmax([log for log, _, _ in found])
    size = np.tensordot(weight, [one for _, one, _ in found], 1)
    apart = np.array([one - size for _, one, _ in found])
    within = np.array([covariance for _, _, covariance in found])
    spread = np.tensordot(weight, within + apart[:, :, None] * apart[:, None, :], 1)
    mean_s = float(weight @ lags)
    lag_u = float(np.sqrt(weight @ (lags - mean_s) ** 2))
    return _told(solved, Estimate(mean_s, lag_u, "s"), size, spread)


def _with_all_azimuths(solved: Solved, beside: Beside) -> Solved:
    """The law with the root mean square distance of all azimuths from the one that is told, if it is the larger."""
    family, told = solved.family, solved.parameters[AZIMUTH]
    found = [_sized(beside(family.signature(i)), beside.left, family.prior) for i in range(len(family.atoms))]
    # the compliance is not negative: what half of the normal distribution of its size is above zero
    logs = [log + float(special.log_ndtr(size[0] / np.sqrt(u2[0, 0]))) for log, size, u2 in found]
    weight = special.softmax(np.add(logs, [family.log_prior(atom) for atom in family.atoms]))
    turn = 360.0 if "arm" in family.choices else 120.0
    apart = np.array([float(atom[AZIMUTH]) for atom in family.atoms]) - told.value
    apart -= turn * np.round(apart / turn)
    u = max(told.u or 0.0, float(np.sqrt(weight @ apart**2)))
    return replace(solved, parameters={**solved.parameters, AZIMUTH: replace(told, u=u)})


def _shape(solved: Solved) -> dict[str, Any]:
    return {name: getattr(solved.effect, name) for name in solved.family.atoms[0]}


def _sized(columns: Array, left: Array, prior: float) -> tuple[float, Array, Array]:
    """Log marginal likelihood of columns ``(k, n)``, mean of their sizes ``(k,)`` and covariance ``(k, k)``."""
    gram = columns @ columns.T + np.eye(len(columns)) / prior**2
    covariance = np.asarray(np.linalg.inv(gram), float)
    size = covariance @ (columns @ left)
    return 0.5 * float(size @ gram @ size) - 0.5 * float(np.linalg.slogdet(gram)[1]), np.asarray(size), covariance


def _told(solved: Solved, lag: Estimate, size: Array, covariance: Array) -> Solved:
    """The law with this lag and these components of its size."""
    (name,) = (p.name for p in type(solved.effect).parameters() if p.role == "linear")
    length = float(np.linalg.norm(size))
    unit = size / max(length, 1e-300)
    changed: dict[str, Any] = {LAG: lag.value, name: float(size[0])}
    if solved.family.directions is not None:
        along = unit @ solved.family.directions
        sign = np.sign(along[np.abs(along).argmax()])
        changed |= {name: float(sign * length), "direction": tuple(float(sign * share) for share in along)}
    told = Estimate(changed[name], float(np.sqrt(unit @ covariance @ unit)), solved.parameters[name].unit)
    parameters = {**solved.parameters, name: told, LAG: lag}
    return replace(solved, effect=solved.effect.model_copy(update=changed), parameters=parameters)

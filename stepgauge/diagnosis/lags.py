"""Lags that a fit leaves at a bound: integrated over all that are possible, with the size that goes with each.

The best fit of a body that follows within the time between two touches is one that follows at once, and that of one
slower than the recording is as slow as was tried. There is no curvature at a bound that gave an uncertainty.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnosis.library import Family, family_signatures
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.solve import Estimate, Fitted, Solved, orthonormal

Array = NDArray[np.float64]
LAG = "lag_s"
SHORTER = (0.125, 0.25, 0.5)
"""Lags below the shortest of the grid, over it: frequent readings tell them from none."""


def with_lags(fitted: Fitted, data: Residuals, metric: Metric) -> Fitted:
    """The fit, with mean and standard deviation of every lag that it left at a bound and of the sizes beside it."""
    solved = [
        _integrated(fitted, place, data, metric) if _is_at_a_bound(one) else one
        for place, one in enumerate(fitted.solved)
    ]
    return replace(fitted, solved=tuple(solved))


def _is_at_a_bound(solved: Solved) -> bool:
    told = solved.parameters.get(LAG)
    return bool(_lags_s(solved.family)) and (told is None or told.u is None)


def _lags_s(family: Family) -> list[float]:
    return sorted({float(atom[LAG]) for atom in family.atoms if atom.get(LAG) is not None})


def _integrated(fitted: Fitted, place: int, data: Residuals, metric: Metric) -> Solved:
    """The law with its lag averaged by marginal likelihood beside the other laws, lags spaced by their logarithm."""
    solved, grid = fitted.solved[place], _lags_s(fitted.solved[place].family)
    lags = np.array([0.0, *(share * grid[0] for share in SHORTER), *grid])
    beside = [t for other, t in enumerate(fitted.tangents) if other != place]
    others = orthonormal(np.hstack([np.zeros((len(fitted.left), 0)), *beside]))
    own = fitted.left + metric(solved.displacement_um(data))
    signatures = (family_signatures(solved.family, {**_shape(solved), LAG: float(lag)}, data) for lag in lags)
    columns = [metric(one) for one in signatures]
    found = [_sized(one - (one @ others) @ others.T, own, solved.family.prior) for one in columns]
    weight = special.softmax([log for log, _, _ in found])
    size = np.tensordot(weight, [one for _, one, _ in found], 1)
    apart = np.array([one - size for _, one, _ in found])
    within = np.array([covariance for _, _, covariance in found])
    spread = np.tensordot(weight, within + apart[:, :, None] * apart[:, None, :], 1)
    mean_s = float(weight @ lags)
    lag_u = float(np.sqrt(weight @ (lags - mean_s) ** 2))
    return _told(solved, Estimate(mean_s, lag_u, "s"), size, spread)


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

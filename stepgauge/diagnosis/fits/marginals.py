"""Shapes whose posterior is no single peak, integrated over all that are possible.

A lag: a slow body that follows a temperature much resembles a quick one that follows it less, and the curvature at the
best of several peaks tells nothing of the others. At a bound there is none at all: the best fit of a body that follows
within the time between two touches is one that follows at once, and that of one slower than the recording is as slow as
was tried. And the azimuth of a tripod: its force has corners, and from few directions an arm may pass for a gap between
two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from stepgauge.diagnosis.fits.solve import Estimate, Fitted, Solved, orthonormal
from stepgauge.diagnosis.laws.library import Family, family_signatures
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import AmplitudePrior

LAG, AZIMUTH = "lag_s", "arm_azimuth_deg"
LAGS, SHORTEST, FAR = 25, 0.125, 5.0
"""How many lags are integrated over, evenly by their logarithm; the shortest of them over that of the grid: frequent
readings tell it from none; and how far from the fitted one as many lie closely, in its standard uncertainties."""
AT_ONCE = 1e-3
"""Share of the shortest lag: an expectation below it is the weight that is left beside a body that follows at once."""


@dataclass(frozen=True)
class ConditionalFit:
    """What one law has to explain ``(n,)``, and the tangents of the others, which may explain a part of it."""

    left: Array
    others: Array
    metric: Metric

    def __call__(self, columns: Array) -> Array:
        """Mapped columns ``(k, n)`` as far as the other laws do not explain them."""
        white = self.metric(columns)
        return white - (white @ self.others) @ self.others.T


def _conditional_fit(fitted: Fitted, place: int, data: Residuals, metric: Metric) -> ConditionalFit:
    """One law of a fit, beside the others."""
    tangents = [t for other, t in enumerate(fitted.tangents) if other != place]
    others = orthonormal(np.hstack([np.zeros((len(fitted.left), 0)), *tangents]))
    return ConditionalFit(fitted.left + metric(fitted.solved[place].displacement_um(data)), others, metric)


def marginalise(fitted: Fitted, data: Residuals, metric: Metric) -> Fitted:
    """The fit, with lags and azimuths as uncertain as all that are possible leave them, and the sizes beside a lag."""
    solved = []
    for place, one in enumerate(fitted.solved):
        if _lags_s(one.family):
            one = _marginalise_lag(one, _conditional_fit(fitted, place, data, metric), data)
        if AZIMUTH in one.family.atoms[0]:
            one = _widen_azimuth(one, _conditional_fit(fitted, place, data, metric))
        solved.append(one)
    return replace(fitted, solved=tuple(solved))


def _lags_s(family: Family) -> list[float]:
    return sorted({float(atom[LAG]) for atom in family.atoms if atom.get(LAG) is not None})


def _marginalise_lag(solved: Solved, beside: ConditionalFit, data: Residuals) -> Solved:
    """The law with the expectations of lag and size by marginal likelihood beside the other laws, and their deviations.

    These are what is stated of a skewed distribution (GUM supplement 1).
    """
    lags, log_share = _tried(solved)
    shape = {name: getattr(solved.effect, name) for name in solved.family.atoms[0]}
    signatures = (family_signatures(solved.family, {**shape, LAG: float(lag)}, data) for lag in lags)
    found = [_sized(beside(one), beside.left, solved.family.sizes) for one in signatures]
    weight = special.softmax(np.add([log for log, _, _ in found], log_share))
    sizes, within = np.array([one for _, one, _ in found]), np.array([one for _, _, one in found])
    mean_s, size = float(weight @ lags), weight @ sizes
    apart = sizes - size
    covariance = np.tensordot(weight, within + apart[:, :, None] * apart[:, None, :], 1)
    lag = Estimate(mean_s, float(np.sqrt(weight @ (lags - mean_s) ** 2)), "s")
    return _told(solved, lag if mean_s > AT_ONCE * lags[1] else Estimate(0.0, None, "s"), size, covariance)


def _tried(solved: Solved) -> tuple[Array, Array]:
    """Lags ``(k,)`` and the logarithms of their shares: every ratio is equally likely, and none at all as one step.

    Those of the whole range, and more about the lag that was fitted.
    """
    grid, known = _lags_s(solved.family), solved.parameters.get(LAG)
    log_lags = np.linspace(np.log(SHORTEST * grid[0]), np.log(grid[-1]), LAGS)
    step = log_lags[1] - log_lags[0]
    if known is not None and known.u and known.value > 0.0:
        near = np.log(known.value) + np.linspace(-FAR, FAR, LAGS) * min(known.u / known.value, step)
        log_lags = np.union1d(log_lags, near[near > log_lags[0]])
    return np.r_[0.0, np.exp(log_lags)], np.log(np.r_[step, np.gradient(log_lags)])


def _widen_azimuth(solved: Solved, beside: ConditionalFit) -> Solved:
    """The law with the root mean square distance of all azimuths from the one that is told, if it is the larger."""
    family, told = solved.family, solved.parameters[AZIMUTH]
    found = [_sized(beside(family.signature(i)), beside.left, family.sizes) for i in range(len(family.atoms))]
    # the compliance is not negative: what half of the normal distribution of its size is above zero
    logs = [log + float(special.log_ndtr(size[0] / np.sqrt(u2[0, 0]))) for log, size, u2 in found]
    weight = special.softmax(np.add(logs, [family.log_prior(atom) for atom in family.atoms]))
    turn = 360.0 if "arm" in family.choices else 120.0
    apart = np.array([float(atom[AZIMUTH]) for atom in family.atoms]) - told.value
    apart -= turn * np.round(apart / turn)
    u = max(told.u or 0.0, float(np.sqrt(weight @ apart**2)))
    return replace(solved, parameters={**solved.parameters, AZIMUTH: replace(told, u=u)})


def _sized(columns: Array, left: Array, sizes: AmplitudePrior | None) -> tuple[float, Array, Array]:
    """Log marginal likelihood of columns ``(k, n)``, mean of their amplitudes ``(k,)`` and covariance ``(k, k)``.

    Over all ``sizes``; a longer lag has a larger amplitude, and one size alone would prefer the shorter one.
    """
    value, turn = np.linalg.eigh(columns @ columns.T)
    product = turn.T @ (columns @ left)
    prior = np.zeros((1, 1)) if sizes is None else sizes.sd[:, None] ** -2.0
    precision = np.maximum(value, 0.0) + prior
    found = product / precision
    log = 0.5 * (product * found - np.log(precision) + np.log(np.where(prior > 0.0, prior, 1.0))).sum(axis=1)
    log = log + (0.0 if sizes is None else sizes.log_weight)
    weight = special.softmax(log)
    mean = weight @ found
    covariance = np.diag(weight @ (1.0 / precision)) + np.einsum("t,ti,tj->ij", weight, found - mean, found - mean)
    return float(special.logsumexp(log)), turn @ mean, turn @ covariance @ turn.T


def _told(solved: Solved, lag: Estimate, size: Array, covariance: Array) -> Solved:
    """The law with this lag and these components of its size."""
    (name,) = (p.name for p in type(solved.effect).parameters() if p.role == "linear")
    length = float(np.linalg.norm(size))
    unit = size / max(length, 1e-300)
    changed: dict[str, Any] = {LAG: lag.value, name: float(size[0])}
    if solved.family.directions is not None:
        along = unit @ solved.family.directions
        sign = np.sign(along[np.abs(along).argmax()])
        changed |= {
            name: float(sign * length),
            solved.family.law.free_direction(): tuple(float(sign * share) for share in along),
        }
    told = Estimate(changed[name], float(np.sqrt(unit @ covariance @ unit)), solved.parameters[name].unit)
    parameters = {**solved.parameters, name: told, LAG: lag}
    return replace(solved, effect=solved.effect.model_copy(update=changed), parameters=parameters)

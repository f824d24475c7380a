"""Pure repeatability of a map, from directions that were probed more than once; no model enters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnose.maps.data import MapData, Measured

Array = NDArray[np.float64]
Scatter = Literal["constant", "proportional"]
FEWEST_DOF = 6
"""Degrees of freedom from which on the scatter among repeats is leant on."""
OUTLIER_P = 0.002
"""Chance of setting aside any row of an undisturbed map."""
MOST_OUTLIERS = 0.1
CLEARLY = 6.0
"""Difference of twice the log likelihoods from which on another law of the scatter is taken."""
MAD = 1.4826
"""Standard deviation over the median of absolute deviations, of a normal distribution."""
STEPS = 20


@dataclass(frozen=True)
class MapNoise:
    """Scatter of a single probing, by quantity.

    ``sigma``: standard deviation of each quantity as a share of :func:`sizes`, no smaller than what rounding gives;
    None without repeats enough. ``dof``: degrees of freedom that the repeats have; ``outliers (n,)``: rows that differ
    from the other repeats of their direction by more than chance; ``copies``: repeats agree to the last bit.
    """

    sigma: tuple[float, ...] | None
    dof: int
    scatter: Scatter
    outliers: NDArray[np.bool_]
    copies: bool = False

    @property
    def repeats(self) -> bool:
        """Whether the scatter is known from repeats."""
        return self.sigma is not None


def estimate_noise(data: MapData) -> MapNoise:
    """Repeatability from what differs between probings of the same direction.

    Robust: deviations are judged by their median first, and those too large to be chance are taken out until nothing
    changes. Of two probings that differ nobody knows which is bad: both are left out of the estimate, and neither is
    called an outlier here. Repeats that all agree to the last bit are copies and say nothing.
    """
    group = data.direction
    constant = [_scatter_of(m, group, "constant") for m in data.measured]
    dof = min(each.dof for each in constant)
    outliers = np.logical_or.reduce([each.outliers for each in constant])
    copies = dof > 0 and any(each.sigma <= 0.0 for each in constant)
    if dof < FEWEST_DOF or copies:
        return MapNoise(None, dof, "constant", np.zeros(len(data), bool), copies)
    proportional = [_scatter_of(m, group, "proportional") for m in data.measured]
    gain = sum(
        _log_likelihood(m, group, "proportional", p.keep & c.keep)
        - _log_likelihood(m, group, "constant", p.keep & c.keep)
        for m, p, c in zip(data.measured, proportional, constant, strict=True)
    )
    chosen: Scatter = "proportional" if 2.0 * gain > CLEARLY else "constant"
    used = proportional if chosen == "proportional" else constant
    if chosen == "proportional":
        outliers = np.logical_or.reduce([each.outliers for each in used])
    return MapNoise(tuple(each.sigma for each in used), min(each.dof for each in used), chosen, outliers)


def without_outliers(noise: MapNoise, rows: int) -> MapNoise:
    """The noise for the rows of a map whose outliers are gone."""
    return replace(noise, outliers=np.zeros(rows, bool))


def sizes(measured: Measured, scatter: Scatter) -> Array:
    """What the scatter is proportional to, (n,)."""
    largest = float(measured.values.max())
    if scatter == "constant" or largest <= 0.0:
        return np.ones(len(measured.values))
    return np.maximum(measured.values, 1e-3 * largest)


def robust_scale(deviation: Array, rounding: float, dof: int) -> tuple[float, NDArray[np.bool_]]:
    """Standard deviation (n,) of deviations that are normal but for a few, and which are too large for that.

    ``rounding`` is the least it can be.
    """
    n = max(len(deviation), 1)
    bound = float(-stats.t.ppf(OUTLIER_P / (2.0 * n), max(dof - 1, 2)))
    scale = max(MAD * float(np.median(np.abs(deviation))), rounding)
    far = np.zeros(n, bool)
    for _ in range(STEPS):
        now = np.abs(deviation) > bound * scale
        rest = float(np.sqrt((deviation[~now] ** 2).mean())) if (~now).any() else 0.0
        scale = max(rest, rounding)
        if (now == far).all():
            break
        far = now
    return scale, far


@dataclass(frozen=True)
class _Scatter:
    sigma: float
    dof: int
    keep: NDArray[np.bool_]
    outliers: NDArray[np.bool_]


def _scatter_of(measured: Measured, group: NDArray[np.intp], scatter: Scatter) -> _Scatter:
    """Of one quantity, among the repeats of each direction."""
    size = sizes(measured, scatter)
    keep = np.bincount(group)[group] > 1
    outliers = np.zeros(len(group), bool)
    for _ in range(STEPS):
        deviation, count = _deviations(measured.values, group, keep)
        standard = deviation[keep] / size[keep] / np.sqrt(1.0 - 1.0 / count[keep])
        dof = int(keep.sum() - (np.bincount(group[keep]) > 0).sum()) if keep.any() else 0
        if dof < 1:
            return _Scatter(0.0, 0, keep, outliers)
        _, far = robust_scale(standard, measured.rounding / float(size[keep].max()), dof)
        if not far.any():
            break
        worst = np.flatnonzero(keep)[int(np.abs(standard).argmax())]
        lone = count[worst] > 2
        outliers[worst] |= lone
        keep = keep & (np.arange(len(group)) != worst) if lone else keep & (group != group[worst])
    sigma = float(np.sqrt((deviation[keep] ** 2 / size[keep] ** 2).sum() / dof))
    floor = measured.rounding / float(np.median(size[keep]))
    found = max(sigma, floor) if sigma > 0.0 or measured.quantum > 0.0 else 0.0
    return _Scatter(found, dof, keep, outliers)


def _log_likelihood(measured: Measured, group: NDArray[np.intp], scatter: Scatter, keep: NDArray[np.bool_]) -> float:
    """Of the deviations among repeats of some rows, at their likeliest scatter: for two laws to be compared by."""
    size = sizes(measured, scatter)[keep]
    deviation, _ = _deviations(measured.values, group, keep)
    dof = int(keep.sum() - (np.bincount(group[keep]) > 0).sum()) if keep.any() else 0
    if dof < 1:
        return 0.0
    sigma = float(np.sqrt((deviation[keep] ** 2 / size**2).sum() / dof))
    floor = measured.rounding / float(np.median(size))
    return -dof * (np.log(max(sigma, floor, 1e-300)) + float(np.log(size).mean()))


def _deviations(values: Array, group: NDArray[np.intp], keep: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Deviation of each row from the mean of the rows kept in its direction, and how many those are, (n,)."""
    count = np.bincount(group, keep)
    mean = np.bincount(group, np.where(keep, values, 0.0)) / np.maximum(count, 1.0)
    return values - mean[group], np.maximum(count[group], 1.0)

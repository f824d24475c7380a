"""Pure repeatability, from the repeats and without a model, and what disturbs it: outliers and growing scatter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from stepgauge.diagnose.residuals import Residuals

Array = NDArray[np.float64]
Growth = tuple[str, float, float]
"""Covariate with which the scatter grows, the rate of it, and the chance of as much in scatter that does not grow."""
OUTLIER_P = 0.002
"""Chance of calling any row of an undisturbed recording an outlier, beside a model any one or several together."""
OUTLIER_GROWING_P = 0.00005
"""The same where the scatter grows: how it grows is known roughly, and a row far out in it is less of a surprise."""
UNSURPRISING_P = 0.05
"""The same where a model knows better: a row that is no farther off is none; its repeats were odd to the other side."""
GROWTH_P = 0.001
"""Chance of seeing growing scatter in the repeats of an undisturbed recording."""
GROWTH_BESIDE_P = 0.0015
"""The same in all rows beside a model, which see more."""
STILL_GROWING_P = 0.01
"""The same in all rows where the repeats have shown it."""
GROWTH_RANKS_P = 0.01
FEWEST_GROWING = 12
"""Rows with freedom left from which growth of the scatter can be told."""
MOST_OUTLIERS = 0.1
LARGE = 3000
MOST_DATUM = 0.5
MOST_LONE = 0.03
NEAR = 3.0
"""Standard deviations within which a repeat counts as good."""
KNOT_ROWS = 16
"""Rows of one placement per knot of the slow change with time that is taken out before the scatter is judged."""


@dataclass(frozen=True)
class Noise:
    """Scatter of a single probing.

    ``sigma_um``: standard deviation at the typical row; ``by_row_um (n,)``: for each row, infinite for outliers;
    ``dof``: degrees of freedom behind it; ``outliers``: indices of rows; ``growth``: covariate and rate of growing
    scatter, None if there is none; ``repeats``: whether it comes from repeats.
    """

    sigma_um: float
    by_row_um: Array
    dof: int
    outliers: NDArray[np.intp]
    growth: Growth | None
    repeats: bool


def estimate_noise(data: Residuals, may_grow: bool = True, growth: Growth | None = None) -> Noise:
    """Repeatability from what differs between repeats beyond any slow change.

    Every set of repeats (same face, placement and speed) may lie anywhere, and the placement may move smoothly with
    time, along the gauge and along the approach, and by a constant of each speed; what is left is scatter, whatever the
    model. Without repeats only a
    smooth change along the gauge is allowed for, and the scatter is larger or smaller than the truth by what that
    misses. ``may_grow``: whether growth of the scatter is looked for; ``growth``: how it is known to grow.
    """
    basis, repeats = _free_columns(data)
    told = ~_datum_rows(data)
    weight = np.ones(len(data)) if growth is None else _weights(data, growth[0], growth[1])
    for p in (OUTLIER_P, OUTLIER_GROWING_P):
        keep, residual, leverage = _without_outliers(data.um / weight, basis / weight[:, None], told, p)
        growth = growth_of(data, residual, leverage, keep) if growth is None and may_grow else growth
        if growth is None:
            break
        weight = _weights(data, growth[0], growth[1])
    dof = int(keep.sum() - round(float(leverage[keep].sum())))
    sigma = float(np.sqrt((residual[keep] ** 2).sum() / max(dof, 1)))
    good = keep | ~told
    by_row = np.where(good, sigma * weight, np.inf)
    rate = None if growth is None else (growth[0], sigma * growth[1], growth[2])
    return Noise(sigma, by_row, dof, np.flatnonzero(~good), rate, repeats)


def with_lone_rows(noise: Noise, left_um: Array, data: Residuals, beside_outliers: bool = False) -> Noise:
    """The scatter with other outliers where a model that knows the other faces knows better than the repeats.

    Of two repeats that differ the repeats alone cannot say which is bad; ``left_um (n,)``, what a model leaves, can. A
    face that is off in all its repeats is no matter of outliers. ``beside_outliers``: only where the repeats have one.
    """
    along = left_um * data.side
    middle = np.array([np.median(along[data.placement == i]) for i in range(int(data.placement.max()) + 1)])
    typical = np.where(np.isfinite(noise.by_row_um), noise.by_row_um, noise.sigma_um)
    off = np.abs(along - middle[data.placement]) / np.hypot(typical, data.gauge.u_um[data.face - 1])
    near = np.bincount(data.group, off < NEAR) > 0
    lone = (off >= _far_out(off, OUTLIER_P if noise.growth is None else OUTLIER_GROWING_P, noise)) & near[data.group]
    if beside_outliers:
        lone &= np.isin(data.group, data.group[noise.outliers])
    if lone.sum() > MOST_LONE * len(data):
        return noise
    with_lone = np.bincount(data.group, lone) > 0
    good = np.isfinite(noise.by_row_um) | (with_lone[data.group] & (off < NEAR))
    if not beside_outliers:
        good |= off < _surprising(UNSURPRISING_P, noise)
    good &= ~lone
    return replace(noise, by_row_um=np.where(good, typical, np.inf), outliers=np.flatnonzero(~good))


def _far_out(off: Array, p: float, noise: Noise) -> float:
    """Standard deviations from which rows are farther off than scatter is, with a chance of ``p``; infinite if none.

    Two rows, neither of which would be a surprise by itself, may be one together: half of the chance is that of the
    row that is farthest off, a quarter that of the next being as far as it is, and so on.
    """
    count = 1 + int(MOST_LONE * len(off))
    ranked, rank = np.sort(off)[::-1][:count], np.arange(count)
    together = stats.binom.sf(rank, len(off), 2.0 * stats.t.sf(ranked, max(noise.dof, 1)))
    odd = np.flatnonzero(together <= p * 0.5 ** (rank + 1))
    return float(ranked[odd[-1]]) if odd.size else np.inf


def _surprising(p: float, noise: Noise) -> float:
    """Standard deviations by which any row is off, to either side, with a chance of ``p``."""
    return float(-stats.t.ppf(p / (2.0 * len(noise.by_row_um)), max(noise.dof, 1)))


def _free_columns(data: Residuals) -> tuple[Array, bool]:
    counts = np.bincount(data.group)
    repeats = bool((counts[data.group] > 1).mean() > 0.5 and len(counts) < 0.8 * len(data))
    if repeats:
        groups = np.eye(len(counts))[data.group]
    else:
        groups = np.column_stack([_smooth(data.probings.certified_mm(), data, 8, data.side == s) for s in (1, -1)])
    slow = []
    for placement in range(data.placement.max() + 1):
        rows = data.placement == placement
        knots = int(np.clip(rows.sum() // KNOT_ROWS, 3, 14))
        rank = np.empty(len(data))
        rank[data.order] = np.arange(len(data))
        hats = _smooth(rank, data, knots, rows)
        slow += [hats, hats * data.side[:, None]]
    return np.column_stack([groups, *slow, *_speeds(data)]), repeats


def _speeds(data: Residuals) -> Iterator[Array]:
    """Constants of every speed but the first, along the approach and along the gauge; repeats may differ by them."""
    for speed in range(1, data.speed.max() + 1):
        yield (data.speed == speed).astype(float)
        yield (data.speed == speed) * data.side


def _smooth(x: Array, data: Residuals, knots: int, rows: NDArray[np.bool_]) -> Array:
    """Piecewise linear functions of ``x`` over some rows, shape ``(n, knots)``."""
    columns = np.zeros((len(data), knots))
    if rows.any():
        at = np.linspace(x[rows].min(), x[rows].max() + 1e-9, knots)
        columns[rows] = np.column_stack([np.interp(x[rows], at, np.eye(knots)[i]) for i in range(knots)])
    return columns


def _fit(um: Array, basis: Array, keep: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Residuals of all rows and leverages of the rows kept."""
    u, s, _ = np.linalg.svd(basis[keep], full_matrices=False)
    u = u[:, s > 1e-8 * s[0]]
    residual = np.zeros(len(um))
    residual[keep] = um[keep] - u @ (u.T @ um[keep])
    leverage = np.ones(len(um))
    leverage[keep] = np.minimum((u**2).sum(axis=1), 1.0)
    return residual, leverage


def _datum_rows(data: Residuals) -> NDArray[np.bool_]:
    """Rows that read the same in all repeats while others scatter: a datum that was set, not probed."""
    count = np.bincount(data.group)
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, data.group, data.um)
    np.maximum.at(high, data.group, data.um)
    spread = high - low
    datum = (count > 1) & (spread < 1e-6)
    return datum[data.group] if datum.sum() < MOST_DATUM * (count > 1).sum() else np.zeros(len(data), bool)


def _without_outliers(
    um: Array, basis: Array, told: NDArray[np.bool_], p: float
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Rows to keep, and residuals and leverages of the fit to these.

    Take out one row after the other while the largest studentised residual is too large to be chance.

    Of large recordings all that are too large at once: the scatter that they are judged by hardly knows them.
    """
    keep = told.copy()
    for _ in range(int(MOST_OUTLIERS * len(um))):
        residual, leverage = _fit(um, basis, keep)
        free = np.sqrt(np.maximum(1.0 - leverage, 1e-9))
        standard = np.where(keep & (leverage < 0.95), np.abs(residual) / free, 0.0)
        dof = int(keep.sum() - leverage[keep].sum()) - 1
        worst = int(standard.argmax())
        rss = float((residual[keep] ** 2).sum() - standard[worst] ** 2)
        if dof < 5 or rss <= 0.0:
            return keep, residual, leverage
        t = standard[worst] / np.sqrt(rss / dof)
        if np.log(2.0 * keep.sum()) + stats.t.logsf(t, dof) > np.log(p):
            return keep, residual, leverage
        if len(um) < LARGE:
            keep[worst] = False
        else:
            keep &= standard < -stats.t.ppf(p / (2.0 * keep.sum()), dof) * np.sqrt(rss / dof)
    return keep, *_fit(um, basis, keep)


def _covariates(data: Residuals) -> dict[str, Array]:
    low = data.probings.setting.travel_mm[:, 0]
    found = {axis: (data.probings.coordinate_mm(axis) - low[i]) * 1e-3 for i, axis in enumerate("xyz")}
    found["position"] = data.probings.certified_mm() * 1e-3
    if "speed_mm_s" in data.frame:
        found["speed"] = data.probings.speed_mm_s.astype(float)
    if data.has_time:
        time_s = data.probings.time_s
        found["time"] = (time_s - time_s.min()) / 3600.0
    return {name: values for name, values in found.items() if np.ptp(values) > 1e-6 * max(np.abs(values).max(), 1e-9)}


def growth_of(
    data: Residuals, residual: Array, leverage: Array, keep: NDArray[np.bool_], chance: float = GROWTH_P
) -> Growth | None:
    """Covariate with which the squares grow, its rate over sigma and the p-value; None if none does.

    ``residual (n,)``: in units of the scatter that does not grow; ``leverage (n,)``: share of each row that was fitted;
    ``keep``: rows that count; ``chance``: that of growth which is believed.

    A likelihood ratio, counted at the degrees of freedom that the rows have left; and, for it believes in the normal
    distribution, the ranks of the squares must grow as well.
    """
    used = keep & (leverage < 0.9)
    if used.sum() < FEWEST_GROWING:
        return None
    square = residual[used] ** 2 / (1.0 - leverage[used])
    share = float((1.0 - leverage[used]).mean())
    score = stats.norm.ppf((stats.rankdata(square) - 0.5) / max(len(square), 1))
    covariates = _covariates(data)
    tests = []
    for name, values in covariates.items():
        rate, gain = _rate(square, values[used])
        ranks_p = stats.norm.sf(_rank_score(score, values[used] ** 2, data.group[used]))
        if ranks_p < GROWTH_RANKS_P:
            tests.append((gain * share, name, rate))
    if not tests:
        return None
    gain, name, rate = max(tests)
    p = 0.5 * float(stats.chi2.sf(gain, 1)) * len(covariates)
    return (name, rate, p) if p <= chance else None


def _rank_score(score: Array, covariate: Array, group: NDArray[np.intp]) -> float:
    """Correlation of normal scores with a covariate, in standard deviations of chance.

    Repeats of a face share their mean: two of m residuals correlate by -1 / (m - 1), their squares by its square.
    """
    c = covariate - covariate.mean()
    kinship = 1.0 / np.maximum(np.bincount(group) - 1.0, 1.0) ** 2
    squares = np.bincount(group, c**2)
    variance = squares.sum() + float((kinship * (np.bincount(group, c) ** 2 - squares)).sum())
    return float(score @ c / np.sqrt(max(variance, 1e-300)))


def _rate(square: Array, covariate: Array) -> tuple[float, float]:
    """The rate for which the squares are likeliest with variances as 1 + (rate covariate)^2, and its likelihood ratio.

    The ratio is twice the logarithm of the likelihood over that of no growth.
    """
    largest = float(np.abs(covariate).max())

    def unlikely(log_rate: float) -> float:
        growth = 1.0 + (np.exp(log_rate) * covariate) ** 2
        return float(np.log((square / growth).mean()) + np.log(growth).mean())

    bounds = (np.log(0.03 / largest), np.log(30.0 / largest))
    found = optimize.minimize_scalar(unlikely, bounds=bounds, method="bounded")
    return float(np.exp(found.x)), len(square) * (float(np.log(square.mean())) - float(found.fun))


def _weights(data: Residuals, covariate: str, rate: float) -> Array:
    """Scatter of every row over that at covariate zero."""
    return np.sqrt(1.0 + (rate * _covariates(data)[covariate]) ** 2)

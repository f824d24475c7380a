"""Straight lines in time, and whether noise alone makes them, whatever the visits differ by besides.

The slope is compared with what repeatability makes of it (a normal number) and with what the scatter about the line
makes of it (Student's t): a slope counts only where both say that it is no noise. So the rate of false warnings holds
where visits differ by no more than they repeat, and where they differ by more. How far visits differ shows from day to
day: a line through two days leaves nothing to tell a drift by, however many values each day has.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS


@dataclass(frozen=True)
class Trend:
    """A straight line in time: ``value + per_year * (t - middle)``, with standard uncertainties.

    ``by_chance``: probability that noise alone gives so large a slope; ``significant``: whether it is a finding among
    all that were looked at.
    """

    middle: datetime.datetime
    value: float
    u_value: float
    per_year: float
    u_per_year: float
    by_chance: float = 1.0
    significant: bool = False


@dataclass(frozen=True)
class TrendLine:
    """A line by weighted least squares: of repeatability alone, ``u_slope``; ``ratio``: Birge's, with its ``dof``.

    ``known``: whether u is that of repeatability; else it is that of the scatter, and the ratio is 1.
    """

    middle: float
    level: float
    u_level: float
    slope: float
    u_slope: float
    ratio: float
    dof: int
    known: bool

    def chance_probability(self, growth: bool = False) -> float:
        """Probability of so large a slope by noise alone; ``growth``: of one that grows, for nobody fears a smaller
        range or scatter."""
        from scipy.stats import norm, t

        size = self.slope if growth else abs(self.slope)
        sides = 1.0 if growth else 2.0
        scatter = sides * _upper(size, self.u_slope * self.ratio, lambda ratio: t.sf(ratio, self.dof))
        return min(1.0, max(scatter, sides * _upper(size, self.u_slope, norm.sf)) if self.known else scatter)


def _upper(size: float, u: float, upper: Callable[[float], float]) -> float:
    """Probability beyond ``size / u``; without scatter any growth is none of chance."""
    if u == 0.0:
        return 0.0 if size > 0.0 else 1.0
    return float(upper(size / u))


def fit_line(years: Array, value: Array, u: Array, group: Sequence[int] | None = None) -> TrendLine | None:
    """A common slope of all groups, each with a level of its own; None with fewer than three days.

    The scatter about it has the degrees of freedom of the days.

    Parameters
    ----------
    years, value, u : ``(n,)``; weights are 1/u^2 where every u is known, else equal
    group : of every value, e.g. the stylus; default: one
    """
    groups = np.zeros(len(value), int) if group is None else np.asarray(group)
    _, groups = np.unique(groups, return_inverse=True)
    visits = {(group, day) for group, day in zip(groups.tolist(), np.round(years * YEAR_DAYS).tolist(), strict=True)}
    dof = len(visits) - int(groups.max(initial=0)) - 2
    if dof < 1:
        return None
    known = bool(np.isfinite(u).all())
    weight = 1.0 / u**2 if known else np.ones(len(value))
    total = np.bincount(groups, weight)
    from_middle = years - (np.bincount(groups, weight * years) / total)[groups]
    from_level = value - (np.bincount(groups, weight * value) / total)[groups]
    spread = float((weight * from_middle**2).sum())
    if spread <= 1e-12 * float((weight * np.maximum(years**2, 1e-6)).sum()):
        return None
    slope = float((weight * from_middle * from_level).sum()) / spread
    ratio = float(
        np.sqrt((weight * (from_level - slope * from_middle) ** 2).sum() / (len(value) - int(groups.max()) - 2))
    )
    all_weight = float(weight.sum())
    middle, level = float((weight * years).sum()) / all_weight, float((weight * value).sum()) / all_weight
    scale = 1.0 if known else ratio
    ends = (scale / np.sqrt(all_weight), slope, scale / np.sqrt(spread))
    return TrendLine(middle, level, *ends, ratio if known else 1.0, dof, known)


def fit_trend(
    start: datetime.datetime,
    days: Array,
    value: Array,
    u: Array,
    group: Sequence[int] | None = None,
    growth: bool = False,
) -> Trend | None:
    """Weighted least squares in time; None with fewer than three days.

    Weights are 1/u^2 where every value has a standard uncertainty, else equal. The uncertainties are those of the
    weights, enlarged by the Birge ratio sqrt(chi^2 / (n - 2)) where the values scatter more than they say (Birge,
    Phys. Rev. 40 (1932) 207); with equal weights they come from the scatter about the line.
    """
    good = np.isfinite(value)
    kept = None if group is None else [one for one, is_good in zip(group, good, strict=True) if is_good]
    line = fit_line(days[good] / YEAR_DAYS, value[good], u[good], kept)
    if line is None:
        return None
    factor = max(line.ratio, 1.0) if line.known else 1.0
    middle = start + datetime.timedelta(days=line.middle * YEAR_DAYS)
    return Trend(
        middle, line.level, factor * line.u_level, line.slope, factor * line.u_slope, line.chance_probability(growth)
    )


def findings(by_chance: Sequence[float], share: float, weight: Sequence[float] | None = None) -> list[bool]:
    """Which of several tests are findings, so that noise alone gives any with the probability ``share`` at most.

    Holm, Scand. J. Statist. 6 (1979) 65, his procedure with weights: whatever the tests have in common. ``weight``:
    how much of the share each gets, by what is looked for; default: equal.
    """
    parts = [1.0] * len(by_chance) if weight is None else list(weight)
    order = sorted(range(len(by_chance)), key=lambda row: by_chance[row] / parts[row])
    found, left = [False] * len(by_chance), sum(parts)
    for row in order:
        if by_chance[row] > share * parts[row] / left:
            break
        found[row], left = True, left - parts[row]
    return found

"""A quantity of one owner over the years: a level that wanders, a steady rate, and jumps where causes have a date.

The state is the level and the rate of every component that a visit sees a share of, so that a diagonal placement counts
for both axes. Source: Durbin and Koopman, Time Series Analysis by DriftState Space Methods, 2nd ed. 2012, chapter 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS


@dataclass(frozen=True)
class DriftPrior:
    """Prior of the components ``(k,)``: standard deviations of the first level, of the rate in a year, of the walk in
    the root of a year, and of a jump."""

    level: Array
    rate: Array
    walk: Array
    jump: Array

    @classmethod
    def of(cls, level: Array, rate: float, walk: float, jump: float) -> DriftPrior:
        """From the levels' standard deviations ``(k,)``, the others as multiples of them."""
        return cls(level, rate * level, walk * level, jump * level)


@dataclass(frozen=True)
class DriftState:
    """Levels and rates ``(k,)`` on a day, and their covariance ``(2k, 2k)``."""

    day: float
    level: Array
    rate: Array
    covariance: Array

    def ahead(self, days: Array, component: int, walk: float) -> tuple[Array, Array]:
        """Mean and standard deviation of one level after some days."""
        years = np.asarray(days, float) / YEAR_DAYS
        k, n = component, len(self.level)
        c = self.covariance
        variance = c[k, k] + 2.0 * years * c[k, n + k] + years**2 * c[n + k, n + k] + walk**2 * years
        return self.level[k] + self.rate[k] * years, np.sqrt(variance)


def follow(
    day: Array, value: Array, variance: Array, shares: Array, prior: DriftPrior, jumps: Sequence[tuple[float, int]] = ()
) -> tuple[list[DriftState], float]:
    """The state after every day, and the logarithm of the density of the values.

    Parameters
    ----------
    day, value, variance : of every visit ``(n,)``, by day
    shares : of every component in every visit ``(n, k)``
    prior : how the components wander
    jumps : days and components of changes that are known to have happened
    """
    k = shares.shape[1]
    mean, cov = np.zeros(2 * k), np.diag(np.concatenate([prior.level, prior.rate]) ** 2)
    states, log_density, now = list[DriftState](), 0.0, float(day[0])
    left = sorted(jumps)
    for row in range(len(day)):
        mean, cov = _passed(mean, cov, (day[row] - now) / YEAR_DAYS, prior)
        while left and left[0][0] <= day[row]:
            cov[left[0][1], left[0][1]] += prior.jump[left[0][1]] ** 2
            left.pop(0)
        now = float(day[row])
        mean, cov, gain = _seen(mean, cov, value[row], variance[row], np.concatenate([shares[row], np.zeros(k)]))
        log_density += gain
        if row + 1 == len(day) or day[row + 1] > now:
            states.append(DriftState(now, mean[:k].copy(), mean[k:].copy(), cov.copy()))
    return states, log_density


def _passed(mean: Array, cov: Array, years: float, prior: DriftPrior) -> tuple[Array, Array]:
    """The state some time later."""
    k = len(mean) // 2
    step = np.eye(2 * k)
    step[:k, k:] = years * np.eye(k)
    cov = step @ cov @ step.T
    cov[np.arange(k), np.arange(k)] += prior.walk**2 * years
    return step @ mean, cov


def _seen(mean: Array, cov: Array, value: float, variance: float, share: Array) -> tuple[Array, Array, float]:
    """The state given one more value, and the logarithm of its density."""
    at = cov @ share
    total = float(share @ at) + variance
    off = value - float(share @ mean)
    return mean + at * (off / total), cov - np.outer(at, at) / total, -0.5 * float(np.log(total) + off**2 / total)


def beyond(mean: Array, sd: Array, limit: float) -> Array:
    """Probability that a normal quantity lies outside plus and minus a limit."""
    return np.asarray(ndtr((mean - limit) / sd) + ndtr((-limit - mean) / sd))


def due_day(
    state: DriftState, component: int, walk: float, limit: float, risk: float, horizon_days: float
) -> float | None:
    """First day on which the risk of being out of limits exceeds what is accepted; None past the horizon."""
    days = np.arange(0.0, horizon_days + 1.0)
    mean, sd = state.ahead(days, component, walk)
    over = np.flatnonzero(beyond(mean, sd, limit) > risk)
    return state.day + float(days[over[0]]) if over.size else None

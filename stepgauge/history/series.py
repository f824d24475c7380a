"""Every quantity by date with its trend and its control chart, and what somebody must look at.

All trends and charts of a report are tested together: noise alone gives a report with any warning in at most one of
twenty (:data:`FALSE_WARNINGS`). Limits that somebody stated are no tests, and warn besides.

Control charts for individual values: each value is held against limits that follow from all the others.

For values of one distribution the limits are a prediction interval, Student's t (Hahn and Meeker, Statistical
Intervals, 1991, 4.8), at a probability that counts how many values are looked at. Where the repeatability is known, a
value outside must be beyond that, too.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.files.notation import rounded
from stepgauge.history.entries import QUANTITIES, HistoryEntry
from stepgauge.history.scores import Scores, scores
from stepgauge.history.trend import Trend, findings, fit_trend

OTHER_TIP_UM = 50.0
SHORT_DAYS = 30.0
"""A drift over less is told as it came, and not as it would be in a year."""
FALSE_WARNINGS = 0.05
"""Probability that a report of pure noise has any warning."""
OF_TRENDS, OF_VALUES = 0.8, 0.1
"""Shares of it that trends and single values have; the rest is kept, for scores are normal only nearly."""


@dataclass(frozen=True)
class Series:
    """One quantity in one direction, by date; ``u`` is NaN where an entry has none.

    ``low``, ``high (n,)``: limits of the control chart, NaN with fewer than five values; where there is a drift, the
    chart follows it: the drift is one finding, a value beside it another. ``of_scale``: what of the value the scale
    error shows of itself, 0 for all but the reversal; ``drift``: trend of the value less that, which is tested.
    """

    quantity: str
    direction: str
    entries: tuple[HistoryEntry, ...]
    value: Array
    u: Array
    trend: Trend | None
    of_scale: Array
    drift: Trend | None
    low: Array
    high: Array

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """Values outside the control chart; none where there is no chart."""
        with np.errstate(invalid="ignore"):
            return (self.value < self.low) | (self.value > self.high)

    @property
    def charted(self) -> int:
        """Values that have limits."""
        return int((np.isfinite(self.value) & np.isfinite(self.low)).sum())


@dataclass(frozen=True)
class Alert:
    """What somebody must look at: a value beyond a limit or its control chart, or a drift."""

    kind: str
    quantity: str
    direction: str
    measured_at: datetime.datetime
    path: str
    text: str


@dataclass(frozen=True)
class _Tested:
    """A series before its findings are known; ``tip``: number of the stylus of every value."""

    series: Series
    days: Array
    scored: Scores
    tip: NDArray[np.int64]


def make_series(entries: Sequence[HistoryEntry]) -> list[Series]:
    """Every quantity in every direction, entries by date; what is a finding is decided over all of them together."""
    directions = sorted({entry.direction for entry in entries})
    made = [
        _made(name, direction, [entry for entry in entries if entry.direction == direction])
        for direction in directions
        for name in QUANTITIES
    ]
    of_trends = FALSE_WARNINGS * OF_TRENDS
    tested = [row for row, one in enumerate(made) if one.series.drift is not None]
    drifts = [(one.series.quantity, drift) for one in made if (drift := one.series.drift) is not None]
    weight = [QUANTITIES[name].weight for name, _ in drifts]
    by_chance = [drift.by_chance for _, drift in drifts]
    found = dict(zip(tested, findings(by_chance, of_trends, weight), strict=True))
    values = sum(int(count) for one in made if (count := np.isfinite(one.scored.score).sum()) >= FEWEST_FOR_CONTROL)
    of_value = FALSE_WARNINGS * OF_VALUES / max(values, 1)
    share = of_trends / max(sum(weight), 1e-9)
    return [
        _judged(one, found.get(row, False), share * QUANTITIES[one.series.quantity].weight, of_value)
        for row, one in enumerate(made)
    ]


def _made(name: str, direction: str, entries: list[HistoryEntry]) -> _Tested:
    ordered = sorted(entries, key=lambda entry: entry.measured_at)
    value, u = _values(name, ordered)
    days = np.array([(e.measured_at - ordered[0].measured_at).total_seconds() / 86400.0 for e in ordered])
    radius = np.array([entry.r_eff_mm for entry in ordered]) * 1e3
    tip = _tips(radius) if name == "r_eff_change_um" else np.zeros(len(ordered), np.int64)
    of_scale = np.zeros(len(ordered))
    if name == "reversal_um":
        of_scale = np.nan_to_num([entry.reversal_of_scale_um for entry in ordered])
    scored = scores(name, ordered, value - of_scale, u)
    start, groups, none = ordered[0].measured_at, tip.tolist(), np.full(len(ordered), np.nan)
    growth = not QUANTITIES[name].signed
    trend = fit_trend(start, days, value, u, groups, growth)
    drift = fit_trend(start, days, value - of_scale, u, groups)
    tested = fit_trend(start, days, scored.score, scored.u, groups, growth)
    drift = None if drift is None or tested is None else replace(drift, by_chance=tested.by_chance)
    return _Tested(
        Series(name, direction, tuple(ordered), value, u, trend, of_scale, drift, none, none), days, scored, tip
    )


def _judged(one: _Tested, drifts: bool, alone: float, of_value: float) -> Series:
    """The series with its findings; ``alone``: probability by chance below which a trend that is shown is marked."""
    series, scored = one.series, one.scored
    trend, drift = series.trend, series.drift
    if trend is not None:
        trend = replace(trend, significant=trend.by_chance <= alone and trend.per_year != 0.0)
    if drift is not None:
        drift = replace(drift, significant=drifts)
    per_day = np.zeros(len(series.value))
    if drifts:
        line = fit_trend(series.entries[0].measured_at, one.days, scored.score, scored.u, one.tip.tolist())
        per_day = per_day if line is None else line.per_year / YEAR_DAYS * (one.days - one.days.mean())
    low, high = (
        scored.back(limit) + series.of_scale for limit in control_limits(scored.score, scored.u, of_value, per_day)
    )
    return replace(series, trend=trend, drift=drift, low=low, high=high)


def _values(name: str, entries: list[HistoryEntry]) -> tuple[Array, Array]:
    if name == "r_eff_change_um":
        value = _change_since_tip(np.array([entry.r_eff_mm for entry in entries]) * 1e3)
    else:
        value = np.array([getattr(entry, name) for entry in entries])
    u = np.array([getattr(entry, f"u_{name}", np.nan) for entry in entries])
    return value, np.where(u > 0, u, np.nan)


def _tips(r_eff_um: Array) -> NDArray[np.int64]:
    """Number of the tip of every radius: one that is 50 um off all before is that of another stylus."""
    firsts: list[float] = []
    found = np.empty(len(r_eff_um), np.int64)
    for row, radius in enumerate(r_eff_um.tolist()):
        known = next((number for number, first in enumerate(firsts) if abs(radius - first) < OTHER_TIP_UM), None)
        if known is None:
            firsts.append(radius)
        found[row] = len(firsts) - 1 if known is None else known
    return found


def _change_since_tip(r_eff_um: Array) -> Array:
    """R_eff minus the first one of its tip."""
    tips = _tips(r_eff_um)
    _, first = np.unique(tips, return_index=True)
    return r_eff_um - r_eff_um[first[tips]]


def false_warning_words(series: Sequence[Series]) -> str:
    """How many trends and values were looked at, and how often noise alone gives a warning, in a sentence."""
    trends = sum(one.drift is not None for one in series)
    values = sum(one.charted for one in series)
    return (
        f"{trends} trends and {values} values were tested together: a report of pure noise has a warning in at most"
        f" {FALSE_WARNINGS:.0%} of cases"
    )


def judge(series: Sequence[Series], limits: Mapping[str, float]) -> list[Alert]:
    """Every value beyond its limit (``limits`` by quantity) or its chart, and the drifts that are no noise."""
    found = []
    for one in series:
        unit = QUANTITIES[one.quantity].unit
        found += _beyond_limit(one, limits.get(one.quantity), unit)
        found += _beyond_control(one, unit)
        if one.drift is not None and one.drift.significant:
            found.append(_warning("drift", one, len(one.entries) - 1, drift_words(one)))
    return sorted(found, key=lambda warning: (warning.measured_at, warning.quantity))


def drift_words(one: Series) -> str:
    """``drifts by +8.1 +- 0.2 um/m a year`` of a series with a trend; of a short one what it came to meanwhile."""
    assert one.drift is not None
    days = (one.entries[-1].measured_at - one.entries[0].measured_at).total_seconds() / 86400.0
    share = days / YEAR_DAYS if days < SHORT_DAYS else 1.0
    rate = f"{rounded(one.drift.per_year * share, 3, plus=True)} +- {rounded(one.drift.u_per_year * share, 2)}"
    beside = ", beside what the scale error shows in it" if one.of_scale.any() else ""
    unit = QUANTITIES[one.quantity].unit
    return (
        f"drifts by {rate} {unit} in {days:.0f} days{beside}"
        if share < 1.0
        else f"drifts by {rate} {unit} a year{beside}"
    )


def _beyond_limit(one: Series, limit: float | None, unit: str) -> list[Alert]:
    if limit is None:
        return []
    size = np.abs(one.value) if QUANTITIES[one.quantity].signed else one.value
    said = f"{unit}, beyond the limit {limit:g} {unit}"
    return [
        _warning("limit", one, row, f"{rounded(one.value[row], 3)} {said}{_shown_by_scale(one, row, unit)}")
        for row in np.flatnonzero(size > limit).tolist()
    ]


def _shown_by_scale(one: Series, row: int, unit: str) -> str:
    """What of a value the scale error shows of itself, in brackets where it is a tenth of it or more."""
    um = one.of_scale[row]
    if abs(um) < 0.1 * abs(one.value[row]) or um == 0.0:
        return ""
    return f" ({rounded(um, 3, plus=True)} {unit} of it are of the scale error)"


def _beyond_control(one: Series, unit: str) -> list[Alert]:
    found = []
    for row in np.flatnonzero(one.beyond).tolist():
        value, low, high = (rounded(v, 3) for v in (one.value[row], one.low[row], one.high[row]))
        found.append(_warning("control", one, row, f"{value} {unit}, outside its control chart {low} to {high} {unit}"))
    return found


def _warning(kind: str, one: Series, row: int, text: str) -> Alert:
    entry = one.entries[row]
    return Alert(kind, one.quantity, one.direction, entry.measured_at, entry.path, text)


FEWEST_FOR_CONTROL = 5
LEAST = 1e-12


def control_limits(score: Array, u: Array, false_share: float, per_day: Array) -> tuple[Array, Array]:
    """Lower and upper limit of every value, in its score; NaN with fewer than five values.

    Parameters
    ----------
    score, u : normal scores of the values and their standard uncertainties (NaN: none), ``(n,)``
    false_share : probability that noise brings one value outside
    per_day : what a drift that was found makes of every value, ``(n,)``; the chart follows it

    Notes
    -----
    The value farthest beyond the limits of the others is taken out, and so on: what it is beside does not widen the
    limits of the others.
    """
    inside = np.isfinite(score)
    level = score - per_day
    low, high = np.full(len(score), np.nan), np.full(len(score), np.nan)
    while inside.sum() >= FEWEST_FOR_CONTROL:
        low, high = _limits(level, u, inside, false_share, bool(per_day.any()))
        excess = np.where(inside, np.abs(level - (low + high) / 2.0) / ((high - low) / 2.0), 0.0)
        if excess.max() <= 1.0:
            break
        inside[int(np.argmax(excess))] = False
    return low + per_day, high + per_day


def _limits(
    level: Array, u: Array, inside: NDArray[np.bool_], false_share: float, with_slope: bool
) -> tuple[Array, Array]:
    """Of every value, from the other values that are inside."""
    from scipy.stats import norm, t

    centre, reach = np.full(len(level), np.nan), np.full(len(level), np.nan)
    for row in np.flatnonzero(np.isfinite(level)):
        others = inside.copy()
        others[row] = False
        count, kept = int(others.sum()), level[others]
        dof = count - 1 - with_slope
        if dof < 1:
            continue
        sigma = float(np.sqrt(((kept - kept.mean()) ** 2).sum() / dof))
        wide = float(t.isf(false_share / 2.0, dof)) * sigma * np.sqrt(1.0 + 1.0 / count)
        known = np.sqrt(u[row] ** 2 + (u[others] ** 2).sum() / count**2)
        least = float(norm.isf(false_share / 2.0)) * known if np.isfinite(known) else 0.0
        centre[row], reach[row] = kept.mean(), max(wide, least, LEAST)
    return centre - reach, centre + reach

"""Trend lines, limits and control charts of the quantities by date."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.notation import rounded
from stepgauge.history.entries import QUANTITIES, HistoryEntry

Array = NDArray[np.float64]
YEAR_DAYS = 365.25
FEWEST_FOR_CONTROL = 5
OTHER_TIP_UM = 50.0
_RANGE_TO_SIGMA = 1.128
"""Mean of the range of two normal values over their standard deviation (d2 of Shewhart charts, ISO 7870-2)."""
OUTSIDE = 0.0027
"""Share of normal values beyond three sigma."""


@dataclass(frozen=True)
class Trend:
    """A straight line in time: ``value + per_year * (t - middle)``, with standard uncertainties."""

    middle: datetime.datetime
    value: float
    u_value: float
    per_year: float
    u_per_year: float

    @property
    def significant(self) -> bool:
        """Whether the slope is beyond twice its standard uncertainty."""
        return abs(self.per_year) > 2.0 * self.u_per_year > 0.0


@dataclass(frozen=True)
class Series:
    """One quantity in one direction, by date; ``u`` is NaN where an entry has none.

    ``centre``, ``reach``: middle and half width of the control chart for individual values (ISO 7870-2: three sigma,
    from the mean moving range / 1.128), widened for few values; NaN with fewer than five. Where there is a drift, the
    chart follows the trend line: the drift is one finding, a value beside it another. ``of_scale``: what of the value
    the scale error shows of itself, 0 for all but the reversal; ``drift``: trend of the value less that.
    """

    quantity: str
    direction: str
    entries: tuple[HistoryEntry, ...]
    value: Array
    u: Array
    trend: Trend | None
    centre: Array
    reach: float
    of_scale: Array
    drift: Trend | None

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """Values outside the control chart; none where there is no chart."""
        with np.errstate(invalid="ignore"):
            return np.abs(self.value - self.centre) > self.reach


@dataclass(frozen=True)
class Alert:
    """What somebody must look at: a value beyond a limit or its control chart, or a drift."""

    kind: str
    quantity: str
    direction: str
    measured_at: datetime.datetime
    path: str
    text: str


def make_series(entries: Sequence[HistoryEntry]) -> list[Series]:
    """Every quantity in every direction, entries by date."""
    directions = sorted({entry.direction for entry in entries})
    return [
        _series(name, direction, [entry for entry in entries if entry.direction == direction])
        for direction in directions
        for name in QUANTITIES
    ]


def _series(name: str, direction: str, entries: list[HistoryEntry]) -> Series:
    ordered = sorted(entries, key=lambda entry: entry.measured_at)
    value, u = _values(name, ordered)
    days = np.array([(e.measured_at - ordered[0].measured_at).total_seconds() / 86400.0 for e in ordered])
    trend = fit_trend(ordered[0].measured_at, days, value, u)
    of_scale = np.zeros(len(ordered))
    if name == "reversal_um":
        of_scale = np.nan_to_num([entry.reversal_of_scale_um for entry in ordered])
    drift = fit_trend(ordered[0].measured_at, days, value - of_scale, u)
    return Series(name, direction, tuple(ordered), value, u, trend, *_chart(days, value, trend), of_scale, drift)


def _chart(days: Array, value: Array, trend: Trend | None) -> tuple[Array, float]:
    """Centre at every date, and how far from it the limits are; NaN with too few values.

    Each value is held against the limits of the others; the farthest beyond them is taken out, and so on.
    """
    inside = np.isfinite(value)
    if inside.sum() < FEWEST_FOR_CONTROL:
        return np.full(len(value), np.nan), np.nan
    slope = trend.per_year / YEAR_DAYS if trend is not None and trend.significant else 0.0
    level = value - slope * days
    while inside.sum() >= FEWEST_FOR_CONTROL:
        rows = np.flatnonzero(inside)
        others = [_limits(np.delete(level[rows], number)) for number in range(len(rows))]
        excess = [abs(level[row] - centre) / reach for row, (centre, reach) in zip(rows, others, strict=True)]
        if max(excess) <= 1.0:
            break
        inside[rows[int(np.argmax(excess))]] = False
    centre, reach = _limits(level[inside])
    return centre + slope * days, reach


def _limits(level: Array) -> tuple[float, float]:
    """Mean of values in order of time, and the distance from it that a further one keeps with 99.73 %.

    The mean of n - 1 moving ranges is worth about 0.62 (n - 1) degrees of freedom; for many values this is three sigma.
    """
    from scipy.stats import t

    sigma = float(np.abs(np.diff(level)).mean()) / _RANGE_TO_SIGMA
    factor = float(t.ppf(1.0 - OUTSIDE / 2.0, 0.62 * (len(level) - 1)))
    return float(level.mean()), max(factor * sigma * float(np.sqrt(1.0 + 1.0 / len(level))), 1e-12)


def _values(name: str, entries: list[HistoryEntry]) -> tuple[Array, Array]:
    if name == "r_eff_change_um":
        value = _from_first_of_tip(np.array([entry.r_eff_mm for entry in entries]) * 1e3)
    else:
        value = np.array([getattr(entry, name) for entry in entries])
    u = np.array([getattr(entry, f"u_{name}", np.nan) for entry in entries])
    return value, np.where(u > 0, u, np.nan)


def _from_first_of_tip(r_eff_um: Array) -> Array:
    """R_eff minus the first one of its tip: a radius that is 50 um off all before is that of another stylus."""
    firsts: list[float] = []
    change = np.empty_like(r_eff_um)
    for row, radius in enumerate(r_eff_um.tolist()):
        first = next((known for known in firsts if abs(radius - known) < OTHER_TIP_UM), None)
        if first is None:
            first = radius
            firsts.append(radius)
        change[row] = radius - first
    return change


def fit_trend(start: datetime.datetime, days: Array, value: Array, u: Array) -> Trend | None:
    """Weighted least squares in time; None with fewer than three dates.

    Weights are 1/u^2 where every value has a standard uncertainty, else equal. The uncertainties are those of the
    weights, enlarged by the Birge ratio sqrt(chi^2 / (n - 2)) where the values scatter more than they say (Birge,
    Phys. Rev. 40 (1932) 207); with equal weights they come from the scatter about the line.
    """
    good = np.isfinite(value)
    if good.sum() < 3 or np.ptp(days[good]) == 0.0:
        return None
    years, y = days[good] / YEAR_DAYS, value[good]
    known = np.isfinite(u[good]).all()
    weight = 1.0 / u[good] ** 2 if known else np.ones(len(y))
    middle = (weight * years).sum() / weight.sum()
    from_middle = years - middle
    spread = (weight * from_middle**2).sum()
    level, slope = (weight * y).sum() / weight.sum(), (weight * from_middle * y).sum() / spread
    birge = np.sqrt((weight * (y - level - slope * from_middle) ** 2).sum() / (len(y) - 2))
    factor = max(float(birge), 1.0) if known else float(birge)
    return Trend(
        start + datetime.timedelta(days=float(middle * YEAR_DAYS)),
        float(level),
        float(factor / np.sqrt(weight.sum())),
        float(slope),
        float(factor / np.sqrt(spread)),
    )


def judge(series: Sequence[Series], limits: Mapping[str, float]) -> list[Alert]:
    """Every value beyond its limit (``limits`` by quantity) or its chart, and drifts beyond twice their uncertainty."""
    found = []
    for one in series:
        unit = QUANTITIES[one.quantity].unit
        found += _beyond_limit(one, limits.get(one.quantity), unit)
        found += _beyond_control(one, unit)
        if one.drift is not None and one.drift.significant:
            rate = f"{rounded(one.drift.per_year, 3, plus=True)} +- {rounded(one.drift.u_per_year, 2)}"
            beside = ", beside what the scale error shows in it" if one.of_scale.any() else ""
            found.append(_warning("drift", one, len(one.entries) - 1, f"drifts by {rate} {unit} a year{beside}"))
    return sorted(found, key=lambda warning: (warning.measured_at, warning.quantity))


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
        value, chart = rounded(one.value[row], 3), f"{rounded(one.centre[row], 3)} +- {rounded(one.reach, 2)}"
        found.append(_warning("control", one, row, f"{value} {unit}, outside its control chart {chart} {unit}"))
    return found


def _warning(kind: str, one: Series, row: int, text: str) -> Alert:
    entry = one.entries[row]
    return Alert(kind, one.quantity, one.direction, entry.measured_at, entry.path, text)

"""Grids of the non-linear parameters of effects in a recording."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.usual import usual_shape
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, Parameter

Array = NDArray[np.float64]
FEWEST_PERIODS = 2.0
"""Least number of periods within the travel or the duration of the measurement: less of one is a curvature."""
FEWEST_ALONG = 1.25
"""The same along an axis, where a period that is not fully covered has aliases at the pitch of the faces."""
MOST_PERIODS = 4000
MOST_FREQUENCIES = 2500
RHYTHM = np.linspace(0.0, 1.0, 41)
"""Quantiles that represent the times between touches."""
GRADUAL = 0.1
"""Part of a period from touch to touch below which an oscillation is seen as a gradual change."""
MOST_TIMES = 1000
MOST_SPREAD = 1e-3
"""Share of the span within which touches of one face lie."""
LEVEL = np.sin(np.radians(2.0))
"""Share of the stylus' direction in a gauge's axis below which the gauge is square to it."""
AZIMUTH_STEP_DEG = 5.0
SEAT_SHARE = 0.2
"""Of its reaction at rest, at which a bad seat opens: readings show its product with the compliance."""
SPREAD, COARSE_SPREAD = np.linspace(-2.0, 2.0, 5), np.linspace(-1.5, 1.5, 3)
"""Points about what is usual, in standard deviations; of level gauges, which hardly show it, fewer."""
SOAKING_H, LONGEST_SOAKING = (0.05, 10.0), 6.0
"""Time constants of gauges, from a thin bar in a draught to a thick one in still air: density times heat capacity times
half the thickness over 10 W/(m2 K) is an hour for 20 mm of steel. And over the record: what falls by less than a sixth
is a gauge that is warmer."""
MOST_TOUCHES = 50.0
"""A probe has settled after some dozens of touches; a longer relaxation depends on time, not on touches."""


def parameter_grid(
    kind: type[Effect], parameter: Parameter, choices: dict[str, Any], data: Residuals, priors: Priors
) -> list[Any]:
    """Values of one non-linear parameter to try: about what is usual, by a rule, or a dozen over its sensible range.

    None stands for what is there without it: at once, from the beginning, for ever.
    """
    usual = usual_shape(parameter.name, priors, data.machine)
    if usual is not None:
        return list(usual[0] * np.exp(usual[1] * (COARSE_SPREAD if lie_level(data) else SPREAD)))
    rule = _RULES.get(f"{kind.kind}.{parameter.name}", _RULES.get(parameter.name))
    if rule is not None:
        return [value for value in rule(choices, data) if value is not None or not parameter.required]
    if parameter.sensible is None:
        return [parameter.default]
    low, high = parameter.sensible
    if low > 0:
        return list(np.geomspace(low, high, 12))
    return list(np.linspace(low, high, 13)[1:])


def _coordinate(choices: dict[str, Any], data: Residuals) -> Array:
    return data.probings.coordinate_mm(str(choices.get("axis", "x")))


def _periods_mm(choices: dict[str, Any], data: Residuals) -> Array:
    if data.turn_mm is not None:
        return data.turn_mm / np.arange(1.0, min(np.unique(_coordinate(choices, data)).size / 2.0, MOST_PERIODS) + 1.0)
    span = max(float(np.ptp(_coordinate(choices, data))), 1.0)
    frequency = np.arange(FEWEST_ALONG / span, 1.0 / data.shortest_mm, 1.0 / (3.0 * span))[:MOST_PERIODS]
    return 1.0 / frequency


def _duration_s(data: Residuals) -> float:
    return max(float(np.ptp(data.probings.time_s)), 1.0)


def _periods_s(_: dict[str, Any], data: Residuals) -> Array:
    duration = _duration_s(data)
    frequency = np.arange(FEWEST_PERIODS / duration, 1.0 / 60.0, 1.0 / (4.0 * duration))[:MOST_PERIODS]
    return 1.0 / frequency if frequency.size else np.array([duration])


def _frequencies_hz(_: dict[str, Any], data: Residuals) -> Array:
    """Frequencies that the rhythm of the touches does not show as one slow change."""
    step = 1.0 / (2.0 * _duration_s(data))
    frequency = np.arange(0.2, 0.2 + step * MOST_FREQUENCIES, step)
    between_s = np.quantile(np.diff(np.sort(data.frame["time_s"].to_numpy(float))), RHYTHM)
    turned = frequency[:, None] * between_s
    turned -= np.round(turned)
    gradual = np.quantile(np.abs(turned), 0.9, axis=1) < GRADUAL
    # a grid point beyond the fewest, for a fit moves by as much
    slow = gradual & (np.abs(turned.mean(axis=1)) * len(data) < FEWEST_PERIODS + 0.5)
    return frequency[~slow] if not slow.all() else frequency


def _times_s(_: dict[str, Any], data: Residuals) -> Array:
    times = np.unique(data.frame["time_s"].to_numpy())
    between = (times[1:] + times[:-1]) / 2.0
    return between[np.unique(np.linspace(0, len(between) - 1, min(len(between), MOST_TIMES)).astype(int))]


def _time_constants_h(_: dict[str, Any], data: Residuals) -> list[float | None]:
    hours = _duration_s(data) / 3600.0
    return [None, *np.geomspace(hours / 60.0, hours * 1.5, 12)]


def _soaking_h(choices: dict[str, Any], data: Residuals) -> Array:
    """What is possible for a bar, and shows: it has not soaked before the second touch, and not only after the run."""
    hours = _duration_s(data) / 3600.0
    if choices["warmed"] == "anew":
        hours = max(float(data.probings.since_placed_s().max()), 1.0) / 3600.0
    least, most = max(SOAKING_H[0], hours / 60.0), min(SOAKING_H[1], hours * LONGEST_SOAKING)
    return np.geomspace(least, most, 14) if least < most else np.zeros(0)


def _lags_s(_: dict[str, Any], data: Residuals) -> list[float | None]:
    return [None, *(_duration_s(data) * np.geomspace(0.0125, 0.4, 6))]


def _starts_s(_: dict[str, Any], data: Residuals) -> list[float | None]:
    """Events during the measurement; with the last touches alone nothing is told from a jump."""
    first = float(data.frame["time_s"].min())
    return [None, *(first + _duration_s(data) * np.linspace(0.03, 0.9, 12))]


def _places_mm(choices: dict[str, Any], data: Residuals) -> Array:
    x = _coordinate(choices, data)
    return np.linspace(x.min(), x.max(), 61)


def _joints_mm(choices: dict[str, Any], data: Residuals) -> Array:
    """Places well inside the travel: a slope over all of it is a scale's, a gap at its end one face's.

    Of a gap the places between two touches are all one.
    """
    x = _coordinate(choices, data)
    low, high = np.quantile(x, [0.1, 0.9])
    inside = np.linspace(low, high, 31)
    if choices["order"] == 1:
        return inside
    met = np.sort(x)
    apart = np.flatnonzero(np.diff(met) > MOST_SPREAD * max(float(np.ptp(x)), 1.0))
    between = (met[apart] + met[apart + 1]) / 2.0
    return np.asarray(between[(between > low) & (between < high)])


def _worn_mm(choices: dict[str, Any], data: Residuals) -> Array:
    x = _coordinate(choices, data)
    return np.linspace(x.min(), x.max(), 17)


def _worn_widths_mm(choices: dict[str, Any], data: Residuals) -> Array:
    """A screw wears over the strokes that it makes, not at a spot."""
    return np.geomspace(0.12, 0.6, 3) * max(float(np.ptp(_coordinate(choices, data))), 100.0)


def _decays_mm(choices: dict[str, Any], data: Residuals) -> Array:
    """What hardly fades over the longest way to a touch is a reversal, without friction."""
    longest = max(float(data.probings.run_mm(str(choices["axis"])).max()), 1.0)
    return np.geomspace(longest / 15.0, 3.0 * longest, 9)


def _widths_mm(choices: dict[str, Any], data: Residuals) -> Array:
    span = float(np.ptp(_coordinate(choices, data)))
    return np.geomspace(8.0, max(span / 2.5, 16.0), 5)


def _supports(_: dict[str, Any], data: Residuals) -> list[tuple[float, float]]:
    """Two supports, one on either side of the middle, for the gauge must not tip over; neighbours differ little."""
    length = float(data.gauge.position_mm[-1])
    left, right = np.linspace(0.0, 0.48, 17), np.linspace(0.52, 1.0, 17)
    pairs = [(a, b) for i, a in enumerate(left) for b in (right if i % 2 else right[::-1])]
    return [(float(a * length), float(b * length)) for a, b in pairs if b - a > 0.25]


def _touches(choices: dict[str, Any], data: Residuals) -> Array:
    """An effect that has not decayed before the next pause is not one of the first touches."""
    most = float(data.probings.touches_since_pause(choices["pause_s"]).max())
    return np.geomspace(0.3, float(np.clip(most / 3.0, 1.0, MOST_TOUCHES)), 14)


def _arm_azimuths_deg(choices: dict[str, Any], data: Residuals) -> Array:
    """Over what the law repeats in: three arms alike, and of gauges that lie level fronts and backs together, six."""
    turn = 360.0 if "arm" in choices else 120.0
    turn = turn / 2.0 if lie_level(data) else turn
    return np.arange(0.0, turn, AZIMUTH_STEP_DEG if turn < 180.0 else 3.0 * AZIMUTH_STEP_DEG)


def lie_level(data: Residuals) -> bool:
    """Whether all gauges lay square to the stylus."""
    stylus = np.array(data.machine.probe.stylus_direction)
    return all(abs(axis @ stylus) < LEVEL for axis in data.probings.setting.axis.values())


_RULES: dict[str, Callable[[dict[str, Any], Residuals], Any]] = {
    "period_mm": _periods_mm,
    "period_s": _periods_s,
    "frequency_hz": _frequencies_hz,
    "time_s": _times_s,
    "time_constant_h": _time_constants_h,
    "scale_joint.at_mm": _joints_mm,
    "reversal_wear.at_mm": _worn_mm,
    "reversal_wear.width_mm": _worn_widths_mm,
    "scale_warm_up.start_s": lambda choices, data: [None],
    "gauge_soaking.time_constant_h": _soaking_h,
    "gauge_soaking.start_s": lambda choices, data: [None],
    "decay_mm": _decays_mm,
    "lag_s": _lags_s,
    "start_s": _starts_s,
    "at_mm": _places_mm,
    "width_mm": _widths_mm,
    "supports_mm": _supports,
    "touches": _touches,
    "arm_azimuth_deg": _arm_azimuths_deg,
    "share": lambda choices, data: [SEAT_SHARE],
    "mrad": lambda choices, data: [1.0],
}

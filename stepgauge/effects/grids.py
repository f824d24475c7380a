"""Values of the parameters of effects that a search tries: rules in terms of the recording.

A rule takes the probings and the choices that are made (axis, column, ..) and returns the values; step, travel,
duration and sampling of the recording bound them. None stands for what is there without the parameter: at once, from
the beginning, for ever.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.effects.base import Grid
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array

Choices = Mapping[str, Any]
FEWEST_PERIODS = 2.0
"""Least number of periods within the duration of the measurement: less of one is a curvature."""
FEWEST_ALONG, FEWEST_ALONE = 1.25, 0.75
"""The same along an axis, where a period that is not fully covered has aliases at the pitch of the faces; and along one
that is recorded by itself, whose whole travel may be a period."""
MOST_PERIODS, MOST_FREQUENCIES, MOST_TIMES = 5000, 2500, 1000
LEADS_MM = (1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0, 40.0)
"""Nominal leads of ball screws, ISO 3408-2."""
PERIOD_STEPS = 3.0
"""Periods along an axis that are tried for each more of them in the travel."""
MOST_OF_A_TURN = 4.5
"""Waves in a turn up to which eccentricity, tilt and seats make them."""
FINER_THAN_STEPS = 20.0
"""Periods over the travel for each place that was measured, where places lie unevenly and so show what is finer. What
is finer still cannot be told from an amount that each place has of its own, and adds to the odds of that."""
FASTEST_CYCLE_S, SLOWEST_VIBRATION_HZ = 60.0, 0.2
"""What a room or a cooler does, and what a machine on air springs does. Of an axis by itself, whose hour is the
duration of its recording, cycles and vibrations share all that its readings resolve: its sixtieth divides them."""
RHYTHM = np.linspace(0.0, 1.0, 41)
"""Quantiles that represent the times between touches."""
GRADUAL = 0.1
"""Part of a period from touch to touch below which an oscillation is seen as a gradual change."""
MOST_SPREAD = 1e-3
"""Share of the span within which touches of one face lie."""
ROUNDING = 1e-9
"""Share of the span within which numbers are one, computed in two ways."""
CLOSE = 0.1
"""Share of the mean distance between readings below which neighbours may be of one place."""
IN_STEP = 0.1
"""Phase, rad, by which waves may differ at places in steps: they agree to a tenth of their amplitude."""
LEVEL = np.sin(np.radians(2.0))
"""Share of the stylus' direction in a gauge's axis below which the gauge is square to it."""
AZIMUTH_STEP_DEG = 5.0
LOCAL = 8.0
"""Parts of a turn of which what is local has one: half a wave of those that a turn has by themselves."""
SOAKING_H, LONGEST_SOAKING = (0.05, 10.0), 6.0
"""Time constants of gauges, from a thin bar in a draught to a thick one in still air: density times heat capacity times
half the thickness over 10 W/(m2 K) is an hour for 20 mm of steel. And over the record: what falls by less than a sixth
is a gauge that is warmer."""
MOST_TOUCHES = 50.0
"""A probe has settled after some dozens of touches; a longer relaxation depends on time, not on touches."""
TEMPERATURES = ("_C", "_K", "_degC", "_F", "_degF", "_celsius", "_kelvin")
MOST_PAUSES, PAUSE_JUMP, SHORT_PAUSE_S = 4, 1.25, 10.0
MOST_PAUSED = 0.15
"""Largest share of touches that follow a pause: what every touch follows is none."""


def values(*some: Any) -> Grid:
    """These values, whatever the recording."""
    return lambda probings, choices: list(some)


def coordinate_mm(probings: Probings, choices: Choices) -> Array:
    """Coordinate of the axis that is chosen, of x where none is."""
    return np.asarray(probings.coordinate_mm(str(choices.get("axis", "x"))), float)


def travelled_mm(probings: Probings, axis: str) -> Array:
    """Coordinates of an axis in the placements that go along it; where none does, all of them.

    Those that stay at one place tell no periods, and are on no step of the others.
    """
    x = np.asarray(probings.coordinate_mm(axis), float)
    goes = {number: abs(along["xyz".index(axis)]) > LEVEL for number, along in probings.setting.axis.items()}
    along = np.array([goes.get(int(number), True) for number in probings.column("placement")], bool)
    return x[along] if along.any() else x


def duration_s(probings: Probings) -> float:
    """From the first to the last reading."""
    return max(float(np.ptp(probings.time_s)), 1e-9)


def common_step(places: Array) -> tuple[float, float] | None:
    """The largest step in which sorted places or times lie, and their rms departure from it.

    None where it is so small that all periods that are tried show: any places are on the step of their last digit.
    """
    gaps = np.diff(places)
    if not gaps.size:
        return None
    finest = float(gaps.mean()) / (2.0 * FINER_THAN_STEPS)
    parts = np.arange(1.0, np.floor(float(gaps.min()) / finest) + 1.0)
    fits = (_fitted_step(places, float(gaps.min()) / n) for n in parts)
    return next((one for one in fits if 2.0 * np.pi * one[1] < IN_STEP * one[0]), None)


def _fitted_step(places: Array, step: float) -> tuple[float, float]:
    """A step of about a size with which places agree best, and their rms departure from it."""
    whole = np.r_[0.0, np.cumsum(np.rint(np.diff(places) / step))]  # from place to place: an error of the step adds up
    fitted, first = np.polyfit(whole, places, 1)
    return float(fitted), float(np.sqrt(np.square(places - first - fitted * whole).mean()))


def most_periods(places: Array, step: float | None = None) -> float:
    """Periods over a span that its places resolve: a half for each common step, more where they have none."""
    met = _places(places)
    found = common_step(met) if step is None else (step, 0.0)
    return FINER_THAN_STEPS * len(met) if found is None else float(np.ptp(met)) / (2.0 * found[0])


def _places(found: Array) -> Array:
    """Places that are met, ``(m,)``."""
    met = np.unique(found)
    met = met[np.r_[True, np.diff(met) > ROUNDING * np.ptp(met)]]
    apart = np.r_[True, _are_apart(met)]
    return met if apart.mean() > 0.5 else met[apart]


def _are_apart(met: Array) -> NDArray[np.bool_]:
    """Whether neighbours of sorted places are two, ``(m - 1,)``.

    What lies together within a thousandth of the span is one, but not the neighbours of a scan, which are as near.
    """
    gaps = np.diff(met)
    return gaps > min(MOST_SPREAD * gaps.sum(), CLOSE * gaps.mean()) if gaps.size else gaps > 0.0


def periods_along(probings: Probings, choices: Choices) -> Array:
    """Periods along an axis, evenly in frequency; of a turning axis, of which much was seen, whole parts of a turn."""
    x = travelled_mm(probings, str(choices.get("axis", "x")))
    span, most = float(np.ptp(x)), most_periods(x, probings.setting.step_mm)
    turn_mm = seen_turn_mm(probings, span)
    if probings.setting.recording == "distances":  # of which every one has an error of its own, by its stations
        most = min(most, np.unique(x).size / 2.0)
    if turn_mm is not None:
        return turn_mm / np.arange(1.0, min(most * turn_mm / span, MOST_PERIODS) + 1.0)
    fewest = FEWEST_ALONE if probings.setting.recording == "linear" else FEWEST_ALONG
    turns = np.arange(fewest, most + 1e-9, 1.0 / PERIOD_STEPS)[:MOST_PERIODS]
    return max(span, 1e-300) / turns


def periods_with_second(probings: Probings, choices: Choices) -> Array:
    """Periods along an axis of which half a period is resolved, too.

    Of a turning axis those of lines and poles: once and twice a turn have causes of their own.
    """
    periods, turn_mm = periods_along(probings, choices), probings.setting.turn_mm
    longest = np.inf if turn_mm is None else turn_mm / MOST_OF_A_TURN
    return periods[(periods >= 2.0 * periods.min()) & (periods < longest)]


def slow_periods_s(probings: Probings, choices: Choices) -> Array:
    """Periods of what is slow, evenly in frequency."""
    duration = duration_s(probings)
    frequency = np.arange(FEWEST_PERIODS / duration, 1.0 / FASTEST_CYCLE_S, 1.0 / (4.0 * duration))[:MOST_PERIODS]
    return 1.0 / frequency if frequency.size else np.array([duration])


def periods_in_time_s(probings: Probings, choices: Choices) -> Array:
    """All periods in time that the readings resolve, evenly in frequency."""
    most = most_periods(probings.time_s)
    turns = np.arange(FEWEST_PERIODS, most + 1e-9, 0.25)[:MOST_PERIODS]
    return duration_s(probings) / turns if turns.size else np.array([duration_s(probings)])


def frequencies_hz(probings: Probings, choices: Choices) -> Array:
    """Frequencies that the rhythm of the readings does not show as one slow change."""
    duration = duration_s(probings)
    step = 1.0 / (2.0 * duration)
    if probings.setting.recording != "gauge":
        most = most_periods(probings.time_s) / duration
        found = np.arange(1.0 / FASTEST_CYCLE_S, most + 1e-9, step)[:MOST_FREQUENCIES]
        return found if found.size else np.zeros(0)
    frequency = np.arange(SLOWEST_VIBRATION_HZ, SLOWEST_VIBRATION_HZ + step * MOST_FREQUENCIES, step)
    between_s = np.quantile(np.diff(np.sort(probings.time_s)), RHYTHM)
    turned = frequency[:, None] * between_s
    turned -= np.round(turned)
    gradual = np.quantile(np.abs(turned), 0.9, axis=1) < GRADUAL
    # a grid point beyond the fewest, for a fit moves by as much
    slow = gradual & (np.abs(turned.mean(axis=1)) * len(probings) < FEWEST_PERIODS + 0.5)
    return frequency[~slow] if not slow.all() else frequency


def between_readings_s(probings: Probings, choices: Choices) -> Array:
    """Times between neighbouring readings."""
    times = np.unique(probings.time_s)
    between = (times[1:] + times[:-1]) / 2.0
    return between[np.unique(np.linspace(0, len(between) - 1, min(len(between), MOST_TIMES)).astype(int))]


def time_constants_h(probings: Probings, choices: Choices) -> list[float | None]:
    """Time constants that show within the duration, or none."""
    hours = duration_s(probings) / 3600.0
    return [None, *np.geomspace(hours / 60.0, hours * 1.5, 12)]


def soaking_h(probings: Probings, choices: Choices) -> Array:
    """What is possible for a bar, and shows: it has not soaked before the second touch, and not only after the run."""
    hours = duration_s(probings) / 3600.0
    if choices["warmed"] == "anew":
        hours = max(float(probings.since_placed_s().max()), 1.0) / 3600.0
    least, most = max(SOAKING_H[0], hours / 60.0), min(SOAKING_H[1], hours * LONGEST_SOAKING)
    return np.geomspace(least, most, 14) if least < most else np.zeros(0)


def lags_s(probings: Probings, choices: Choices) -> list[float | None]:
    """Time constants of a body, or none: it follows at once."""
    return [None, *(duration_s(probings) * np.geomspace(0.0125, 0.4, 6))]


def starts_s(probings: Probings, choices: Choices) -> list[float | None]:
    """Events during the measurement; with the last touches alone nothing is told from a jump."""
    first = float(probings.time_s.min())
    return [None, *(first + duration_s(probings) * np.linspace(0.03, 0.9, 12))]


def middle_mm(probings: Probings, choices: Choices) -> list[float]:
    """The middle of the travel: about another place a power holds lower ones."""
    return [float(probings.setting.travel_mm["xyz".index(choices["axis"])].mean())]


def places_mm(probings: Probings, choices: Choices) -> Array:
    """Places over the travel."""
    x = coordinate_mm(probings, choices)
    return np.linspace(x.min(), x.max(), 61)


def joints_mm(probings: Probings, choices: Choices) -> Array:
    """Places well inside the travel: a slope over all of it is a scale's, a gap at its end one face's.

    Of a gap the places between two touches are all one.
    """
    x = coordinate_mm(probings, choices)
    low, high = np.quantile(x, [0.1, 0.9])
    inside = np.linspace(low, high, 31)
    if choices["order"] == 1:
        return inside
    met = np.sort(x)
    apart = np.flatnonzero(_are_apart(met))
    between = (met[apart] + met[apart + 1]) / 2.0
    return np.asarray(between[(between > low) & (between < high)])


def worn_mm(probings: Probings, choices: Choices) -> Array:
    """Places of wear over the travel."""
    x = coordinate_mm(probings, choices)
    return np.linspace(x.min(), x.max(), 17)


def worn_widths_mm(probings: Probings, choices: Choices) -> Array:
    """A screw wears over the strokes that it makes, not at a spot."""
    return np.geomspace(0.12, 0.6, 3) * max(float(np.ptp(coordinate_mm(probings, choices))), 100.0)


def decays_mm(probings: Probings, choices: Choices) -> Array:
    """What hardly fades over the longest way to a touch is a reversal, without friction."""
    longest = max(float(probings.run_mm(str(choices["axis"])).max()), 1.0)
    return np.geomspace(longest / 15.0, 3.0 * longest, 9)


def widths_mm(probings: Probings, choices: Choices) -> Array:
    """Widths of a defect that several places show, up to a part of the travel; of a turn less than of its waves."""
    span = float(np.ptp(coordinate_mm(probings, choices)))
    turn_mm = seen_turn_mm(probings, span)
    widest = span / 2.5 if turn_mm is None else turn_mm / LOCAL
    return np.geomspace(8.0, max(widest, 16.0), 5)


def seen_turn_mm(probings: Probings, span: float) -> float | None:
    """A turn of an axis of which so much was seen that waves are whole parts of it; None of any other."""
    turn_mm = probings.setting.turn_mm
    return turn_mm if turn_mm is not None and span > turn_mm / 2.0 else None


def supports_mm(probings: Probings, choices: Choices) -> list[tuple[float, float]]:
    """Two supports, one on either side of the middle, for the gauge must not tip over; neighbours differ little."""
    length = float(probings.gauge.position_mm[-1])
    left, right = np.linspace(0.0, 0.48, 17), np.linspace(0.52, 1.0, 17)
    pairs = [(a, b) for i, a in enumerate(left) for b in (right if i % 2 else right[::-1])]
    return [(float(a * length), float(b * length)) for a, b in pairs if b - a > 0.25]


def touches(probings: Probings, choices: Choices) -> Array:
    """An effect that has not decayed before the next pause is not one of the first touches."""
    most = float(probings.touches_since_pause(choices["pause_s"]).max())
    return np.geomspace(0.3, float(np.clip(most / 3.0, 1.0, MOST_TOUCHES)), 14)


def arm_azimuths_deg(probings: Probings, choices: Choices) -> Array:
    """Over what the law repeats in: three arms alike, and of gauges that lie level fronts and backs together, six."""
    turn = 360.0 if "arm" in choices else 120.0
    turn = turn / 2.0 if lie_level(probings) else turn
    return np.arange(0.0, turn, AZIMUTH_STEP_DEG if turn < 180.0 else 3.0 * AZIMUTH_STEP_DEG)


def lie_level(probings: Probings) -> bool:
    """Whether all gauges lay square to the stylus."""
    probe = probings.setting.probe
    stylus = np.array([0.0, 0.0, -1.0] if probe is None else probe.stylus_direction)
    return all(abs(axis @ stylus) < LEVEL for axis in probings.setting.axis.values())


def faces(probings: Probings, choices: Choices) -> list[int]:
    """Faces that were probed."""
    return [int(face) for face in np.unique(probings.face)]


def blocks(probings: Probings, choices: Choices) -> list[int]:
    """Blocks that were probed on both sides: a defect of one face has its own law."""
    met = set(faces(probings, choices))
    return sorted(face // 2 for face in met if face % 2 == 0 and face - 1 in met)


def placements(probings: Probings, choices: Choices) -> list[int | None]:
    """All placements together, and each of several."""
    every = [int(one) for one in np.unique(probings.column("placement"))]
    return [None, *(every if len(every) > 1 else ())]


def placements_beside_others(probings: Probings, choices: Choices) -> list[int]:
    """Placements that are not the only one with their stylus, whose radius is its own anyway."""
    numbers = probings.column("placement")
    stylus = np.nan_to_num(np.rint(probings.column("stylus")), nan=1.0) if "stylus" in probings.columns else numbers * 0
    with_each = [np.unique(numbers[stylus == one]).tolist() for one in np.unique(stylus)]
    return sorted({one for with_one in with_each if len(with_each) == 1 or len(with_one) > 1 for one in with_one})


def temperatures(probings: Probings, choices: Choices) -> list[str]:
    """Recorded temperatures that change, by the unit in their names."""
    names = [name for name in map(str, probings.columns) if name.endswith(TEMPERATURES)]
    return [name for name in names if np.unique(probings.column(name)).size > 1]


def no_or_another_temperature(probings: Probings, choices: Choices) -> list[str | None]:
    """No second temperature, or one of those recorded."""
    return [None, *temperatures(probings, choices)]


def pauses_s(probings: Probings, choices: Choices | None = None) -> list[float]:
    """What may count as a pause, s: between the sizes into which the times between touches fall, the clearest first."""
    gaps = np.sort(np.diff(np.sort(probings.time_s.astype(float))))
    gaps = np.unique(gaps[len(gaps) - int(MOST_PAUSED * len(gaps)) :])
    jump = gaps[1:] / np.maximum(gaps[:-1], 1e-9)
    places = [i for i in np.argsort(-jump)[:MOST_PAUSES] if jump[i] > PAUSE_JUMP and gaps[i + 1] > SHORT_PAUSE_S]
    found = [float(np.sqrt(gaps[i] * gaps[i + 1])) for i in places]
    return [float(f"{pause:.3g}") for pause in found] or [60.0]

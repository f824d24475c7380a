"""Thermometers beside the machine, and what the temperatures they record do to it, each after a lag."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause, on_axis
from benchmarks.blind.run_causes import direction_seen
from benchmarks.blind.scene import Scene, Sensor, contact_mm

Array = NDArray[np.float64]
Random = np.random.Generator
AXES = "xyz"
ROOM = ("room_temperature_C", "bridge_temperature_C", "column_temperature_C")
DECOY = "coolant_temperature_C"
TOP, BOTTOM = "bridge_top_temperature_C", "bridge_bottom_temperature_C"
CLOCK = 4000
"""Steps of the clock of a thermometer over the whole recording."""
PAUSE_S, DOORS = 300.0, 10
"""A longer time between touches is one in which the gauge was laid; how often a door opens while it is probed."""


def _weather(time_s: Array, random: Random, kelvin: float) -> Array:
    """A room after a quiet night: from the first touch on it wanders, over two thirds of the recording and longer.

    Doors let in air that is warmer or colder and mixes; people come and go while the gauge is probed, not while it is
    laid: what happened between two records could not be told from them.
    """
    clock_s, run_s = _clock(time_s), time_s[-1] - time_s[0]
    since = (clock_s - clock_s[0]) / run_s
    wander = random.uniform(-1.0, 1.0) * since
    for _ in range(3):
        turns, start = random.uniform(0.5, 1.5), random.uniform(0.0, 2.0 * np.pi)
        wander += 0.4 / turns * (np.sin(2.0 * np.pi * turns * since + start) - np.sin(start))
    pauses = np.append(time_s[:-1][np.diff(time_s) > PAUSE_S], time_s[-1])
    watched = time_s[pauses[np.searchsorted(pauses, time_s)] - time_s > 0.07 * run_s]
    for opened_s in random.choice(watched, DOORS) if len(watched) else ():
        for_s, back_s = clock_s - opened_s, random.uniform(0.015, 0.04) * run_s
        wander += np.where(for_s > 0.0, random.normal(0.0, 0.8) * np.exp(-np.maximum(for_s, 0.0) / back_s), 0.0)
    return np.asarray(kelvin * wander / np.ptp(wander))


def _clock(time_s: Array) -> Array:
    return np.linspace(time_s[0], time_s[-1], CLOCK)


def _sensor(column: str, time_s: Array, celsius: Array) -> Sensor:
    return Sensor(column, _clock(time_s), np.round(celsius, 3))


def thermometers(time_s: Array, random: Random) -> tuple[Sensor, ...]:
    """Room, bridge and column of a workshop, partly alike as one room has them, and a coolant that does not matter."""
    common, kelvin = _weather(time_s, random, 0.5), random.uniform(1.0, 4.0)
    seen = [
        _sensor(name, time_s, 20.0 + random.normal(0.0, 0.2) + kelvin * (common + _weather(time_s, random, 1.0)))
        for name in ROOM
    ]
    coolant = 21.0 + random.normal(0.0, 0.5) + _weather(time_s, random, random.uniform(1.0, 3.0))
    four = [*seen, _sensor(DECOY, time_s, coolant)]
    return tuple(four[k] for k in random.permutation(4))


def two_of_a_beam(time_s: Array, random: Random) -> tuple[Sensor, ...]:
    """Top and bottom of the bridge, a gradient apart, and the coolant."""
    beam, gradient = _weather(time_s, random, 2.0), _weather(time_s, random, random.uniform(1.0, 4.0))
    coolant = 21.0 + _weather(time_s, random, random.uniform(1.0, 3.0))
    middle = 20.0 + random.normal(0.0, 0.1)
    return (
        _sensor(TOP, time_s, middle + beam + gradient / 2.0),
        _sensor(BOTTOM, time_s, middle + beam - gradient / 2.0),
        _sensor(DECOY, time_s, coolant),
    )


def lagged(clock_s: Array, celsius: Array, lag_s: float) -> Array:
    """A body in air of this temperature: first order, in balance before the clock begins; exact for straight parts."""
    step_s = clock_s[1] - clock_s[0]
    kept = np.exp(-step_s / lag_s)
    state, course = float(celsius[0]), [float(celsius[0])]
    for before, after in zip(celsius[:-1].tolist(), celsius[1:].tolist(), strict=True):
        slope = (after - before) / step_s
        state = after - slope * lag_s + (state - before + slope * lag_s) * kept
        course.append(state)
    return np.array(course)


def _body(scene: Scene, random: Random, *columns: str) -> tuple[Array, float]:
    """Temperature (of two columns: their difference) of a body behind a lag, at every touch, and the lag in s."""
    lag_s = float(np.exp(random.uniform(np.log(0.02), np.log(0.2)))) * float(np.ptp(scene.time_s))
    of = {sensor.column: sensor for sensor in scene.sensors}
    air = of[columns[0]].celsius - (of[columns[1]].celsius if len(columns) > 1 else 20.0)
    clock_s = of[columns[0]].clock_s
    return np.interp(scene.time_s, clock_s, lagged(clock_s, air, lag_s)), lag_s


def gauge_soaking(scene: Scene, random: Random, anew: bool) -> Cause:
    """A bar from a store, or out of the hands that laid it (anew: before every placing): it cools into the room.

    Its outside follows the air at once for a twentieth of it, its core as a body; each block stands where its segments
    have carried it.
    """
    began_s = np.array([scene.time_s[scene.placement == place].min() for place in scene.placement])
    since_s = scene.time_s - (began_s if anew else scene.time_s[0])
    core_s = 3600.0 * float(random.uniform(0.15, 0.5))
    course = 0.95 * np.exp(-since_s / core_s) + 0.05 * np.exp(-since_s / (0.1 * core_s))
    sign, segments = float(random.choice([-1.0, 1.0])), np.diff(scene.gauge.true_mm, prepend=0.0)

    def displace(kelvin: float) -> Array:
        warm = scene.gauge_temperature_C + sign * kelvin * course - 20.0
        places = np.cumsum(segments * (1.0 + scene.gauge.true_expansion_per_K * warm[:, None]), axis=1)
        moved = contact_mm(scene, along_mm=places[np.arange(len(scene)), scene.face - 1])
        return np.asarray((moved - scene.centre_mm) * 1e3)

    return Cause("gauge_soaking", displace, "anew" if anew and np.ptp(scene.placement) else "once")


def _chosen(random: Random) -> str:
    return str(random.choice(ROOM))


def thermal_shift(scene: Scene, random: Random) -> Cause:
    """The console of the probe grows with the air around it: length times expansion times its own temperature."""
    column, direction = _chosen(random), direction_seen(scene, random)
    warm, lag_s = _body(scene, random, column)
    return Cause(
        "thermal_shift",
        lambda um_per_K: um_per_K * warm[:, None] * direction,
        column,
        lambda um_per_K: {"lag_s": lag_s},
    )


def thermal_expansion_of(scene: Scene, random: Random, axis: int) -> Cause:
    """A scale whose own sensor does not see the warmth: every graduation is farther out, the reading is too short."""
    column = _chosen(random)
    warm, lag_s = _body(scene, random, column)

    def displace(um_per_m_K: float) -> Array:
        grown = 1.0 + 1e-6 * um_per_m_K * warm
        return on_axis(scene, axis, 1e3 * scene.centre_mm[:, axis] * (1.0 / grown - 1.0))

    where = f"{column}/{AXES[axis]}"
    return Cause("thermal_expansion_of", displace, where, lambda k: {"um_per_m_K": -k, "lag_s": lag_s}, start=5.0)


def thermal_bending(scene: Scene, random: Random, travel: int, sideways: int) -> Cause:
    """A bridge warmer on top: even curvature, integrated twice from its middle, where it is held."""
    warm, lag_s = _body(scene, random, TOP, BOTTOM)
    grid_m = np.linspace(scene.travel_mm[travel, 0], scene.travel_mm[travel, 1], 1401) * 1e-3
    step_m, held = grid_m[1] - grid_m[0], len(grid_m) // 2
    slope = np.cumsum(np.full(len(grid_m), step_m))
    slope -= slope[held]
    line = np.r_[0.0, np.cumsum((slope[1:] + slope[:-1]) / 2.0) * step_m]
    line -= line[held]
    bow = np.interp(scene.centre_mm[:, travel] * 1e-3, grid_m, line)
    sign = float(random.choice([-1.0, 1.0]))
    where = f"{BOTTOM}-{TOP}/{AXES[travel]}/{AXES[sideways]}"
    return Cause(
        "thermal_bending",
        lambda k: on_axis(scene, sideways, sign * k * warm * bow),
        where,
        lambda k: {"lag_s": lag_s},
        start=20.0,
    )


def late_drift(scene: Scene, random: Random) -> Cause:
    """A heater goes on at some minute: its panel warms, and the fixture after it, in steps of a fine clock."""
    direction, run_s = direction_seen(scene, random), float(np.ptp(scene.time_s))
    on_s = float(scene.time_s[0] + random.uniform(0.25, 0.6) * run_s)
    panel_s, fixture_s = run_s * random.uniform(0.002, 0.006), run_s * random.uniform(0.05, 0.4)
    clock_s = np.linspace(on_s, scene.time_s[-1] + 1.0, CLOCK)
    step_s, panel, fixture, grown = clock_s[1] - clock_s[0], 0.0, 0.0, []
    for _ in clock_s:
        grown.append(fixture)
        panel += step_s * (1.0 - panel) / panel_s
        fixture += step_s * (panel - fixture) / fixture_s
    drift = np.interp(scene.time_s, clock_s, grown, left=0.0)
    return Cause("thermal_drift", lambda um: um * drift[:, None] * direction, "late", lambda um: {"start_s": on_s})


def scale_warm_up(scene: Scene, random: Random, axis: int) -> Cause:
    """A ball screw under servo warms by its motor from the first touch on: nut first, then the screw, held at zero."""
    run_s = float(np.ptp(scene.time_s))
    screw_s, nut_s = run_s * random.uniform(0.08, 0.5), run_s * random.uniform(0.002, 0.006)
    clock_s = np.linspace(scene.time_s[0], scene.time_s[-1], CLOCK)
    step_s, nut, screw, grown = clock_s[1] - clock_s[0], 0.0, 0.0, []
    for _ in clock_s:
        grown.append(screw)
        nut += step_s * (1.0 - nut) / nut_s
        screw += step_s * (nut - screw) / screw_s
    warm = np.interp(scene.time_s, clock_s, grown)

    def displace(um_per_m: float) -> Array:
        long = 1.0 + 1e-6 * um_per_m * warm
        return on_axis(scene, axis, 1e3 * scene.centre_mm[:, axis] * (1.0 / long - 1.0))

    return Cause("scale_warm_up", displace, AXES[axis], start=5.0)

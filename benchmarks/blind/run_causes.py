"""Causes outside the machine's geometry: probe, gauge, temperature, time, and how the gauge was laid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause
from benchmarks.blind.scene import Scene, contact_mm

Array = NDArray[np.float64]
Random = np.random.Generator
SEATS_RAD = np.radians([0.0, 120.0, 240.0])
"""The three seats of a kinematic probe."""


def _sign(random: Random) -> float:
    return float(random.choice([-1.0, 1.0]))


def _moved(scene: Scene, contact: Array) -> Array:
    return (contact - scene.centre_mm) * 1e3


def direction_seen(scene: Scene, random: Random) -> Array:
    """A direction that every placing sees: within 50 deg of the mean of the gauge axes."""
    mean = np.mean([scene.axis[scene.placement == place][0] for place in np.unique(scene.placement)], axis=0)
    mean /= np.linalg.norm(mean)
    while True:
        direction = random.standard_normal(3) * np.array([1.0, 1.0, 0.3])
        direction /= np.linalg.norm(direction)
        if direction @ mean > 0.64:
            return direction


# --- probe -----------------------------------------------------------------------------------------------------------


def effective_radius(scene: Scene, random: Random) -> Cause:
    """A stiffer spring than the file says: the stylus bends farther before the contacts open."""
    sign = _sign(random)

    def displace(um: float) -> Array:
        return _moved(scene, contact_mm(scene, pretravel_um=scene.pretravel_um + sign * um))

    return Cause("effective_radius", displace, "", lambda um: {"um": sign * um}, radius_is_effect=True)


def probe_lobing(scene: Scene, random: Random) -> Cause:
    """Statics of a tripod: the stylus carrier on three seats tilts when the load on one of them falls to zero.

    The side force F at the tip gives the moment F L about the seats at radius R; the load on seat i is
    G/3 + (2/3) F (L/R) cos(azimuth of the force to the seat), and the stylus bends by F over its stiffness.
    """
    turned = np.radians(30.0 * random.integers(12) + random.uniform(-5.0, 5.0))

    def force(azimuth: Array) -> Array:
        relief = -np.cos(azimuth[..., None] - SEATS_RAD - turned).min(axis=-1)
        return 1.0 / (2.0 * relief)

    around = force(np.linspace(0.0, 2.0 * np.pi, 3601)[:-1]).mean()
    azimuth = np.arctan2(scene.approach[:, 1], scene.approach[:, 0])
    bending = force(azimuth) - around
    return Cause("probe_lobing", lambda um: (um * bending)[:, None] * scene.approach, radius_is_effect=False)


def trigger_delay(scene: Scene, random: Random) -> Cause:
    """The counter is latched late: the machine travels on at its measuring speed meanwhile."""

    def displace(ms: float) -> Array:
        steps = 100
        travelled_mm = sum(scene.speed_mm_s * (ms * 1e-3 / steps) for _ in range(steps))
        return (np.asarray(travelled_mm) * 1e3)[:, None] * scene.approach

    one_speed = len(np.unique(scene.speed_mm_s)) == 1
    return Cause("trigger_delay", displace, "", lambda ms: {"ms": ms}, radius_is_effect=one_speed)


def approach_memory(scene: Scene, random: Random) -> Cause:
    """Contacts that creep while they rest: a long pause lets them settle, the next touches work them loose."""
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0] - 3600.0)
    usual_s = float(np.median(gap_s))
    rest_s, kept = 3.0 * usual_s, float(random.uniform(0.05, 0.4))
    sign, settled, state = _sign(random), np.empty(len(scene)), 0.0
    for row, gap in enumerate(gap_s):
        state = 1.0 - (1.0 - state) * np.exp(-max(gap - 1.5 * usual_s, 0.0) / rest_s)
        settled[row] = state
        state *= kept
    return Cause("approach_memory", lambda um: (sign * um * settled)[:, None] * scene.approach)


def noise_growth(scene: Scene, random: Random) -> Cause:
    """A bearing that roughens: the scatter of the touches grows from nothing with the square of time."""
    share = ((scene.time_s - scene.time_s[0]) / np.ptp(scene.time_s)) ** 2
    scatter = share * random.standard_normal(len(scene))
    return Cause("noise_growth", lambda um: (um * scatter)[:, None] * scene.approach)


def outliers(scene: Scene, random: Random) -> Cause:
    """Dust on a few faces at a few moments: isolated probings, all of about the same height, early or late."""
    count = max(1, len(scene) // 150)
    rows = random.choice(len(scene), count, replace=False)
    height = np.zeros(len(scene))
    height[rows] = random.uniform(0.85, 1.15, count) * random.choice([-1.0, 1.0], count)
    return Cause("outliers", lambda um: (um * height)[:, None] * scene.approach, start=5.0)


# --- gauge -----------------------------------------------------------------------------------------------------------


def gauge_temperature(scene: Scene, random: Random) -> Cause:
    """The gauge is warmer or colder than recorded; block after block and gap after gap expand."""
    sign, gauge = _sign(random), scene.gauge
    segments = np.diff(gauge.true_mm, prepend=0.0)

    def displace(kelvin: float) -> Array:
        warm = scene.gauge_temperature_C[:, None] + sign * kelvin - 20.0
        places = np.cumsum(segments * (1.0 + gauge.true_expansion_per_K * warm), axis=1)
        return _moved(scene, contact_mm(scene, along_mm=places[np.arange(len(scene)), scene.face - 1]))

    return Cause("gauge_temperature", displace, "", lambda kelvin: {"delta_K": sign * kelvin})


def scale_temperature(scene: Scene, random: Random, axis: int) -> Cause:
    """A steel scale warmer than its sensor: its graduations lie farther apart, so the reading is too short."""
    sign, expansion = _sign(random), 10.5e-6

    def displace(kelvin: float) -> Array:
        reading = scene.centre_mm.copy()
        reading[:, axis] /= 1.0 + expansion * sign * kelvin
        return (reading - scene.centre_mm) * 1e3

    return Cause("scale_temperature", displace, "xyz"[axis])


def block_defect(scene: Scene, random: Random) -> Cause:
    """A nick or a film on one face, wherever the gauge lies."""
    faces = len(scene.gauge.true_mm)
    face, sign = int(random.integers(2, faces)), _sign(random)

    def displace(um: float) -> Array:
        moved = scene.along_mm + 1e-3 * sign * um * (scene.face == face)
        return _moved(scene, contact_mm(scene, along_mm=moved))

    return Cause("block_defect", displace, str(face), lambda um: {"face": float(face), "um": sign * um}, start=3.0)


def gauge_bending(scene: Scene, random: Random) -> Cause:
    """The gauge rests on two feet and sags; the probed line lies above the neutral fibre, so faces tip."""
    foot = float(random.uniform(0.16, 0.24))
    grid = np.linspace(0.0, 1.0, 2001)
    reaction = np.where(grid > foot, 0.5, 0.0) + np.where(grid > 1.0 - foot, 0.5, 0.0)
    moment = np.cumsum(reaction - grid) / len(grid)
    slope = np.cumsum(moment) / len(grid)
    slope = (slope - slope.mean()) / np.ptp(slope)
    tipped = np.interp(scene.along_mm / scene.gauge.length_mm, grid, slope)

    def displace(um: float) -> Array:
        return _moved(scene, contact_mm(scene, along_mm=scene.along_mm - 1e-3 * um * tipped))

    return Cause("gauge_bending", displace)


def misalignment(scene: Scene, random: Random) -> Cause:
    """The programmed line crosses the gauge at an angle about its middle; ball and plane meet where they meet."""
    roll = random.uniform(0.0, 2.0 * np.pi)
    sideways = np.cross(scene.axis, np.array([0.0, 0.0, 1.0]))
    sideways /= np.linalg.norm(sideways, axis=1)[:, None]
    across = np.cos(roll) * sideways + np.sin(roll) * np.cross(sideways, scene.axis)
    programmed = scene.side[:, None] * scene.approach

    def displace(mrad: float) -> Array:
        angle = mrad * 1e-3
        return _moved(scene, contact_mm(scene, axis=np.cos(angle) * programmed + np.sin(angle) * across))

    return Cause("misalignment", displace, "", lambda mrad: {"mrad": mrad}, start=3.0, power=2.0)


# --- time ------------------------------------------------------------------------------------------------------------


def thermal_drift(scene: Scene, random: Random) -> Cause:
    """Two bodies in a warmer room, integrated in steps: the slow frame and the ram that exchanges heat with it."""
    direction, hours = direction_seen(scene, random), float(np.ptp(scene.time_s)) / 3600.0
    frame_s, ram_s = 3600.0 * hours * random.uniform(0.4, 1.5), 3600.0 * hours * random.uniform(0.01, 0.03)
    whole_s = float(np.ptp(scene.time_s))
    step_s = whole_s / 4000.0
    clock, ram, frame, expansion = [0.0], 0.0, 0.0, [0.0]
    while clock[-1] < whole_s:
        frame += step_s * ((1.0 - frame) / frame_s + 0.02 * (ram - frame) / frame_s)
        ram += step_s * (frame - ram) / ram_s
        clock.append(clock[-1] + step_s)
        expansion.append(ram)
    drift = np.interp(scene.time_s - scene.time_s[0], clock, expansion)
    return Cause("thermal_drift", lambda um: um * drift[:, None] * direction)


def temperature_cycle(scene: Scene, random: Random) -> Cause:
    """A heater that is on half of the time warms the air, the air a cover, the cover the machine: three lags."""
    direction, run_s = direction_seen(scene, random), float(scene.time_s[-1])
    cycle_time = run_s / max(len(np.unique(scene.cycle)) * len(np.unique(scene.placement)), 1)
    period_s = float(np.clip(random.uniform(0.35, 1.6) * cycle_time, 120.0, run_s / 4.0))
    return _cycle(scene, random, direction, period_s)


def slow_cycle(scene: Scene, random: Random, shortest_s: float, longest_s: float) -> Cause:
    """The same of a period that has nothing to do with the cycles of the measurement: a room, or the seasons."""
    period_s = float(np.exp(random.uniform(np.log(shortest_s), np.log(longest_s))))
    return _cycle(scene, random, direction_seen(scene, random), period_s)


def _cycle(scene: Scene, random: Random, direction: Array, period_s: float) -> Cause:
    step_s, lags_s = period_s / 200.0, period_s * np.array([0.3, 0.4, 0.5])
    clock = np.arange(-8.0 * period_s, float(scene.time_s[-1]) + period_s, step_s)
    heater = np.where((clock / period_s + random.uniform()) % 1.0 < 0.5, 1.0, -1.0)
    for lag_s in lags_s:
        warmed, state, gain = [], 0.0, float(step_s / lag_s)
        for heat in heater.tolist():
            state += gain * (heat - state)
            warmed.append(state)
        heater = np.array(warmed)
    air = np.interp(scene.time_s, clock, heater) / np.abs(heater[len(heater) // 2 :]).max()
    return Cause(
        "temperature_cycle",
        lambda um: um * air[:, None] * direction,
        "",
        lambda um: {"period_s": period_s},
    )


def step_change(scene: Scene, random: Random) -> Cause:
    """Somebody bumps into the table in the middle of a run: the gauge lies elsewhere until it is re-laid."""
    place = int(random.choice(np.unique(scene.placement)))
    rows = np.flatnonzero(scene.placement == place)
    row = int(rows[int(len(rows) * random.uniform(0.25, 0.75))])
    moved = (scene.time_s > (scene.time_s[row - 1] + scene.time_s[row]) / 2.0) & (scene.placement == place)
    push = random.standard_normal(3) * np.array([0.3, 0.3, 0.1]) + _sign(random) * scene.axis[row]
    push /= np.linalg.norm(push)
    return Cause("step_change", lambda um: um * moved[:, None] * push)

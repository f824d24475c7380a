"""Physics that the vocabulary has no name for. The right answer is ``unknown`` and where it lives."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause, on_axis
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator

_COVARIATES = {
    "power_law_memory": "pause order time",
    "time_sawtooth": "time order",
    "humidity": "humidity_pct",
    "preisach": "order direction machine gauge cycle",
    "random_walk": "time order cycle",
    "corner_cubic": "machine gauge",
    "compensation_staircase": "machine gauge",
    "cycle_offsets": "cycle time order",
    "humidity_lag": "humidity_pct time order cycle",
    "ageing_scale": "time order cycle machine gauge",
    "scale_error": "machine gauge",
    "scale_temperature": "machine gauge",
    "scale_curvature": "machine gauge",
    "periodic_scale_error": "machine gauge",
    "local_scale_defect": "machine gauge",
    "straightness": "machine gauge",
    "squareness": "machine gauge placement",
    "angular_error": "machine gauge placement",
    "gauge_temperature": "gauge",
    "misalignment": "gauge",
    "block_defect": "gauge",
    "block_shift": "gauge",
    "gauge_bending": "gauge",
    "reversal_error": "direction azimuth placement side",
    "effective_radius": "direction side",
    "probe_lobing": "azimuth direction placement",
    "trigger_delay": "speed",
    "approach_memory": "pause order time",
    "thermal_drift": "time order cycle",
    "temperature_cycle": "time order cycle",
    "step_change": "time order cycle",
    "noise_growth": "time order",
    "outliers": "time order",
    "kinematic_pretravel": "azimuth direction placement",
    "seat_defect": "azimuth direction placement",
    "tip_change": "placement direction",
    "servo_lag": "speed",
    "scale_joint": "machine gauge",
    "reversal_wear": "machine gauge direction side",
    "stick_slip": "order direction machine gauge cycle",
    "error_motion": "machine gauge placement",
    "scale_warm_up": "time order cycle machine gauge",
    "gauge_soaking": "time order cycle placement gauge",
    "thermal_shift": "time order cycle",
    "thermal_expansion_of": "time order cycle machine gauge",
    "thermal_bending": "time order cycle machine gauge",
    "geometric_errors": "machine gauge placement",
}
BEYOND = tuple(_COVARIATES)[: tuple(_COVARIATES).index("scale_error")]
"""Kinds that the vocabulary does not have."""
LIVES_IN = {kind: words.split() for kind, words in _COVARIATES.items()}
"""Covariates (as ``score.covariate`` names them) under which each may be located.

Kinds of the vocabulary are here for runs in which the tool is told to forget one of them, and because the form of
``probe_lobing`` on a step gauge is not the one of the vocabulary (see the README).
"""


def lives_in(cause: Cause) -> list[str]:
    """Covariates under which this cause may be located; what follows a recorded temperature lives in its column too."""
    columns = [part.lower() for part in re.split("[-/]", cause.where) if part.endswith("_C")]
    return [*LIVES_IN[cause.kind], *columns]


def _along_gauge(scene: Scene, um: Array) -> Array:
    return um[:, None] * scene.axis


def _centred(values: Array) -> Array:
    return (values - values.mean()) / values.std()


def power_law_memory(scene: Scene, random: Random) -> Cause:
    """Stick-slip with memory: friction strengthens with a power of the time since the last touch, at every touch."""
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0] - 60.0)
    held = (gap_s / gap_s.min()) ** random.uniform(0.35, 0.6)
    memory, lag = np.empty(len(scene)), 0.0
    for row, hold in enumerate(held):
        lag = 0.75 * lag + hold
        memory[row] = lag
    return Cause("power_law_memory", lambda um: (um * _centred(memory))[:, None] * scene.approach)


def time_sawtooth(scene: Scene, random: Random) -> Cause:
    """A cooler with hysteresis: the place of the gauge creeps and is thrown back, over and over."""
    run_s = float(scene.time_s[-1])
    passes = len(np.unique(scene.cycle)) * len(np.unique(scene.placement))
    period_s = run_s / passes * random.uniform(0.5, 1.4)
    saw = (scene.time_s / period_s + random.uniform()) % 1.0 - 0.5
    return Cause("time_sawtooth", lambda um: _along_gauge(scene, um * saw))


def humidity(scene: Scene, random: Random) -> Cause:
    """A granite table that swells: the place of the gauge follows the column ``humidity_pct``, bent upwards."""
    swollen = _centred(scene.humidity_pct)
    swollen = swollen + 0.35 * swollen**2
    return Cause("humidity", lambda um: _along_gauge(scene, um * swollen))


def preisach(scene: Scene, random: Random) -> Cause:
    """Hysteresis with inner loops: forty relays along the machine, each switching at its own two places."""
    mean = np.abs(scene.axis).mean(axis=0)
    axis = int(np.argmax(mean))
    path = scene.way_mm[:, :, axis].ravel()
    low, high = np.quantile(path, [0.02, 0.98])
    centre, half = random.uniform(low, high, 40), random.uniform(0.05, 0.3, 40) * (high - low)
    state, total = -np.ones(40), np.empty(len(path))
    for corner, at in enumerate(path):
        state = np.where(at > centre + half, 1.0, np.where(at < centre - half, -1.0, state))
        total[corner] = state.mean()
    touch = total.reshape(len(scene), -1)[:, 2]
    plain = np.interp(path, np.sort(path), np.linspace(-1.0, 1.0, len(path))).reshape(len(scene), -1)[:, 2]
    loop = touch - plain * (touch @ plain) / (plain @ plain)
    return Cause("preisach", lambda um: on_axis(scene, axis, um * loop))


def random_walk(scene: Scene, random: Random) -> Cause:
    """Drift without a law: every step in time adds an independent push, more for longer steps."""
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0])
    walk = np.cumsum(random.standard_normal(len(scene)) * np.sqrt(np.minimum(gap_s, 60.0)))
    return Cause("random_walk", lambda um: _along_gauge(scene, um * walk / np.ptp(walk)))


def corner_cubic(scene: Scene, random: Random) -> Cause:
    """One corner of the volume is spoilt: far out in x and y together x is off by the cube of the way in."""
    x, y = scene.centre_mm[:, 0], scene.centre_mm[:, 1]
    edge = np.quantile(x, random.uniform(0.35, 0.55))
    way_in = np.clip(x - edge, 0.0, None) / (scene.travel_mm[0, 1] - edge)
    rear = np.clip((y - 450.0) / 550.0, 0.0, None)
    return Cause("corner_cubic", lambda um: on_axis(scene, 0, um * rear * way_in**3), start=10.0)


def compensation_staircase(scene: Scene, random: Random) -> Cause:
    """An error table applied in steps instead of interpolated, with steps of uneven width: a saw along one axis."""
    mean = np.abs(scene.axis).mean(axis=0)
    axis = int(np.argmax(mean))
    used = scene.centre_mm[:, axis]
    edges = np.cumsum(random.uniform(45.0, 150.0, 60)) - 100.0
    below = np.searchsorted(edges, used, side="right") - 1
    width = np.diff(edges)[below]
    saw = (used - edges[below] - width / 2.0) / 100.0
    return Cause("compensation_staircase", lambda um: on_axis(scene, axis, um * saw))


def cycle_offsets(scene: Scene, random: Random) -> Cause:
    """The gauge is taken off and put back before every cycle, not quite to the same place."""
    places, cycles = scene.placement.max() + 1, scene.cycle.max() + 1
    put = random.standard_normal((places, cycles))
    return Cause("cycle_offsets", lambda um: _along_gauge(scene, um * put[scene.placement, scene.cycle]))


def late_heater(scene: Scene, random: Random) -> Cause:
    """A heater is switched on five minutes after the start; the fixture warms to a new level from then on.

    It has one time constant, so that a drift with a late beginning is exactly what it is.
    """
    rise_s = float(np.exp(random.uniform(np.log(60.0), np.log(900.0))))
    since_s = np.clip(scene.time_s - scene.time_s[0] - 300.0, 0.0, None)
    return Cause("thermal_drift", lambda um: _along_gauge(scene, -um * np.expm1(-since_s / rise_s)), "late", start=2.0)


def humidity_lag(scene: Scene, random: Random) -> Cause:
    """Wood under the table: it follows the humidity of the room as a first-order lag of some minutes."""
    lag_s = float(random.uniform(60.0, 400.0))
    soaked, state = np.empty(len(scene)), float(scene.humidity_pct[0])
    for row, gap_s in enumerate(np.diff(scene.time_s, prepend=scene.time_s[0])):
        state += -np.expm1(-gap_s / lag_s) * (scene.humidity_pct[row] - state)
        soaked[row] = state
    return Cause("humidity_lag", lambda um: _along_gauge(scene, um * _centred(soaked)))


def ageing_scale(scene: Scene, random: Random) -> Cause:
    """A young glass scale that shrinks from month to month: a length error that grows with the years."""
    years = (scene.time_s - scene.time_s[0]) / (365.25 * 86400.0)
    shrunk = years * (scene.centre_mm[:, 0] - scene.travel_mm[0].mean()) * 1e-3
    return Cause("ageing_scale", lambda um: on_axis(scene, 0, um * shrunk))

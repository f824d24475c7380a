"""Columns along the approach of the kinds that came later: tripods, wear, error motions, recorded temperatures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.families import AXES, Family, one
from benchmarks.blind.probe_causes import Tripod, normals, qualifying_normals
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
LAWS_OF_COLUMNS = ("thermal_shift", "thermal_expansion_of", "thermal_bending")
FURTHER = (
    *("kinematic_pretravel", "seat_defect", "tip_change", "servo_lag"),
    *("scale_joint", "reversal_wear", "stick_slip", "error_motion", "scale_warm_up", "gauge_soaking"),
    *LAWS_OF_COLUMNS,
)
"""Kinds of this module; besides, ``thermal_drift:late`` is a drift that begins at any time."""
SEEN = 0.05
"""Share of an axis in the approaches below which it cannot be seen."""
LEAST_WAY_M = 0.05
"""A shorter way of an axis is how the gauge happened to be laid, and no error of motion that anybody could name."""
LEVERS, SHARES = tuple(np.geomspace(2.0, 9.0, 10).tolist()), (0.1, 0.2, 0.4)
"""From arms to tip, in radii of the contacts; of the reaction at rest, at which a worn seat counts as open."""
TURNS_DEG = np.arange(0.0, 360.0, 2.0)


def further_families(scene: Scene) -> Iterator[Family]:
    """All families of :data:`FURTHER` in this measurement, and the late drift."""
    yield from _tripods(scene)
    yield from _probe(scene)
    yield from _axes(scene)
    yield from _motions(scene)
    yield from _warm_ups(scene)
    yield from _temperatures(scene)


def _tripods(scene: Scene) -> Iterator[Family]:
    """The whole pre-travel, or its variation about the qualified mean; worn seats, each of three by a turn."""
    seen, which = np.unique(np.round(normals(scene), 4), axis=0, return_inverse=True)
    turned = _turned(seen, np.radians(TURNS_DEG)).reshape(-1, 3)
    whole, varying, worn = [], [], []
    for lever in LEVERS:
        tripod = Tripod(0.0, lever)
        sound = tripod.travel(turned)
        third = sound.reshape(len(TURNS_DEG), -1)[: len(TURNS_DEG) // 3]
        whole.append(third)
        varying.append(third - tripod.travel(qualifying_normals()).mean())
        for share in SHARES:
            early = tripod.travel(turned, np.array([share, share, 0.0, 0.0, 0.0, 0.0])) - sound
            worn.append(early.reshape(len(TURNS_DEG), -1))
    for kind, parts in (("kinematic_pretravel", whole + varying), ("seat_defect", worn)):
        yield kind, "", np.concatenate(parts)[:, None, which.ravel()]


def tripods_about(scene: Scene, arm_deg: float) -> Array:
    """Columns of those tripods that have an arm within 10 deg of this azimuth, shape ``(members, 1, n)``."""
    seen, which = np.unique(np.round(normals(scene), 4), axis=0, return_inverse=True)
    turned = _turned(seen, np.radians(arm_deg + np.arange(-10.0, 10.5, 2.0)))
    parts = []
    for tripod in (Tripod(0.0, lever) for lever in LEVERS):
        whole = tripod.travel(turned.reshape(-1, 3)).reshape(len(turned), -1)
        parts += [whole, whole - tripod.travel(qualifying_normals()).mean()]
    return np.concatenate(parts)[:, None, which.ravel()]


def _turned(vectors: Array, angles: Array) -> Array:
    """Vectors in frames turned about z by these angles, shape ``(angles, vectors, 3)``."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y, z = vectors.T
    return np.stack([c * x + s * y, c * y - s * x, np.broadcast_to(z, (len(angles), len(z)))], axis=-1)


def _probe(scene: Scene) -> Iterator[Family]:
    for place in np.unique(scene.placement):
        yield one("tip_change", str(place), (scene.placement == place).astype(float))
    yield one("servo_lag", "", scene.speed_mm_s**2)


def _axes(scene: Scene) -> Iterator[Family]:
    for axis, name in enumerate(AXES):
        p, x = scene.approach[:, axis], scene.centre_mm[:, axis]
        if np.abs(p).max() < SEEN:
            continue
        at = np.arange(x.min(), x.max(), 6.0)[1:, None]
        if len(at):
            yield "scale_joint", f"{name}/0", (p * (x > at))[:, None, :]
            yield "scale_joint", f"{name}/1", (p * np.clip(x - at, 0.0, None))[:, None, :]
            for width in (15.0, 25.0, 40.0, 60.0, 90.0, 140.0, 220.0):
                yield "reversal_wear", name, (np.abs(p) * np.exp(-0.5 * ((x - at[::2]) / width) ** 2))[:, None, :]
        since = _since_the_last_touch(x, np.sign(p))
        decays = np.exp(-since / np.geomspace(0.5, 120.0, 24)[:, None])
        yield "stick_slip", name, (np.abs(p) * decays)[:, None, :]


def _since_the_last_touch(x: Array, sense: Array) -> Array:
    """Path from the last touch where it went in the sense of this one, mm, else zero."""
    return np.asarray(np.maximum(np.diff(x, prepend=x[0]) * sense, 0.0))


def _motions(scene: Scene) -> Iterator[Family]:
    """Powers of the way from the middle of the travel, translations and rotations of every axis."""
    for travel, name in enumerate(AXES):
        way = (scene.centre_mm[:, travel] - scene.travel_mm[travel].mean()) * 1e-3
        if np.ptp(way) < LEAST_WAY_M:
            continue
        for component, column in _components(scene, travel):
            for order in (1, 2, 3):
                yield one("error_motion", f"{name}/{component}/{order}", column * way**order)


def _components(scene: Scene, travel: int) -> Iterator[tuple[str, Array]]:
    """Name and effect along the approach of one um along, or one urad about, every axis that can be seen."""
    p = np.where(np.abs(scene.approach).max(axis=0) < SEEN, 0.0, scene.approach)
    for axis, name in enumerate(AXES):
        if p[:, axis].any():
            yield name, p[:, axis]
    arm = scene.arm_mm(travel)
    for axis, name in enumerate(AXES):
        yield f"r{name}", np.einsum("ij,ij->i", np.cross(np.eye(3)[axis], arm), p) * 1e-3


def _warm_ups(scene: Scene) -> Iterator[Family]:
    """One minus an exponential from any time on: of a scale, and of the whole placement."""
    t = scene.time_s - scene.time_s[0]
    run_s, rises = t[-1], []
    for start in np.r_[0.0, np.linspace(0.04, 0.92, 45)] * run_s:
        since = np.clip(t - start, 0.0, None)
        rises += [since / run_s, *(-np.expm1(-since / (run_s * share)) for share in np.geomspace(0.01, 3.0, 12))]
    warm = np.array(rises)[:, None, :]
    for axis, name in enumerate(AXES):
        if np.abs(scene.approach[:, axis]).max() >= SEEN:
            yield "scale_warm_up", name, warm * scene.approach[:, axis] * scene.centre_mm[:, axis]
    yield "thermal_drift", "late", warm * scene.approach.T
    since_s = t - np.array([t[scene.placement == place].min() for place in scene.placement])
    for warmed, passed_s in (("once", t), ("anew", since_s)):
        if warmed == "once" or np.ptp(scene.placement):
            constants_s = passed_s.max() * np.geomspace(0.015, 8.0, 30)[:, None]
            yield "gauge_soaking", warmed, (np.exp(-passed_s / constants_s) * scene.side * scene.along_mm)[:, None, :]


def _temperatures(scene: Scene) -> Iterator[Family]:
    for column, courses in _columns(scene):
        warm = courses[:, None, :]
        yield "thermal_shift", column, warm * scene.approach.T
        for axis, name in enumerate(AXES):
            if np.abs(scene.approach[:, axis]).max() >= SEEN:
                yield (
                    "thermal_expansion_of",
                    f"{column}/{name}",
                    warm * scene.approach[:, axis] * scene.centre_mm[:, axis],
                )
        yield "thermal_expansion_of", f"{column}/gauge", warm * scene.side * scene.along_mm
        for travel, name in enumerate(AXES):
            way = (scene.centre_mm[:, travel] - scene.travel_mm[travel].mean()) * 1e-3
            for component, effect in _components(scene, travel) if np.ptp(way) > LEAST_WAY_M else ():
                orders = np.array([way**order * effect for order in (1, 2)])
                bent = (courses[:, None, :] * orders).reshape(-1, 1, len(scene))
                yield "thermal_bending", f"{column}/{name}/{component}", bent


def _columns(scene: Scene) -> Iterator[tuple[str, Array]]:
    """Recorded temperatures above 20 deg C, and differences of two, behind lags; shape ``(lags, n)``.

    The gauge's own hardly changes within a placing: what follows it alone would have to do so by tens of um per kelvin.
    """
    recorded = {sensor.column: np.round(sensor.at(scene.time_s), 3) for sensor in scene.sensors}
    for name, celsius in recorded.items():
        yield name, _lagged(scene.time_s, celsius - 20.0)
    if recorded:
        recorded["gauge_temperature_C"] = np.round(scene.gauge_temperature_C, 2)
    for first, second in combinations(sorted(recorded), 2):
        yield f"{first}-{second}", _lagged(scene.time_s, recorded[first] - recorded[second])


def _lagged(time_s: Array, kelvin: Array) -> Array:
    """What a body has of a temperature known at the touches, straight between them, for twenty lags and none."""
    lags = np.ptp(time_s) * np.geomspace(0.004, 0.6, 20)
    course = np.empty((len(time_s), len(lags)))
    state = course[0] = np.full(len(lags), kelvin[0])
    for row, gap_s in enumerate(np.diff(time_s), 1):
        slope = (kelvin[row] - kelvin[row - 1]) / gap_s
        state = kelvin[row] - slope * lags + (state - kelvin[row - 1] + slope * lags) * np.exp(-gap_s / lags)
        course[row] = state
    return np.vstack([kelvin, course.T])


def is_further(keys: Iterable[str]) -> set[str]:
    """Those of these keys that name a kind, or a form of one, that came later."""
    return {key for key in keys if key == "thermal_drift:late" or key.partition(":")[0] in FURTHER}

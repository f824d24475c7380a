"""Columns along the approach of every plain kind of the vocabulary: what a law of this name can do in a measurement."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Family = tuple[str, str, Array]
"""Kind, where, columns of shape ``(members, k, n)``."""
AXES = "xyz"
FREQUENCIES = 4000
"""Most frequencies in time that are looked at; enough for every recording of less than a day."""


def waves(step: float, count: int, first: float, at: Array) -> Array:
    """exp(2 pi i f x) for ``count`` frequencies ``first, first + step, ...``, ``(count, n)``, by a running product."""
    turned = np.tile(np.exp(2j * np.pi * step * at), (count, 1))
    turned[0] = np.exp(2j * np.pi * first * at)
    return np.asarray(np.cumprod(turned, axis=0))


def families(scene: Scene) -> Iterator[Family]:
    yield from _scales(scene)
    yield from _geometry(scene)
    yield from _probe(scene)
    yield from _gauge(scene)
    yield from _time(scene)


def one(kind: str, where: str, column: Array) -> Family:
    return kind, where, column[None, None, :]


def _scales(scene: Scene) -> Iterator[Family]:
    if (np.abs(scene.approach).max(axis=0) > 0.1).sum() > 1:
        yield one("scale_temperature", "all", (scene.approach * scene.centre_mm).sum(axis=1))
    for axis, name in enumerate(AXES):
        p, x = scene.approach[:, axis], scene.centre_mm[:, axis]
        if np.abs(p).max() < 0.05:
            continue
        yield one("scale_error", name, p * x)
        yield one("scale_temperature", name, p * x)
        yield one("scale_curvature", name, p * (x - scene.travel_mm[axis].mean()) ** 2)
        wave = p * waves(1.0 / 4000.0, 984, 1.0 / 250.0, x)
        yield "periodic_scale_error", name, np.stack([wave.real, wave.imag], axis=1)
        at = np.arange(x.min(), x.max(), 8.0)
        for width in (6.0, 10.0, 16.0, 25.0, 40.0, 60.0):
            bump = p * np.exp(-0.5 * ((x - at[:, None]) / width) ** 2)
            yield "local_scale_defect", name, bump[:, None, :]


def _geometry(scene: Scene) -> Iterator[Family]:
    p, x = scene.approach, scene.centre_mm
    for first, second in ((0, 1), (0, 2), (1, 2)):
        if np.abs(p[:, first] * p[:, second]).max() > 0.05:
            yield one("squareness", AXES[first] + AXES[second], p[:, first] * x[:, second])
    for travel in range(3):
        for rotation in range(3):
            arm = scene.arm_mm(travel)
            abbe = np.einsum("ij,ij->i", np.cross(np.eye(3)[rotation], arm), p) * x[:, travel]
            yield one("angular_error", f"{AXES[travel]}/{AXES[rotation]}", abbe)
        for sideways in range(3):
            if sideways != travel and np.abs(p[:, travel] * p[:, sideways]).max() > 0.05:
                bow = p[:, sideways] * (x[:, travel] - scene.travel_mm[travel].mean()) ** 2
                yield one("straightness", f"{AXES[travel]}/{AXES[sideways]}", bow)
    for axis, name in enumerate(AXES):
        if np.abs(p[:, axis]).max() > 0.05:
            yield one("reversal_error", name, np.abs(p[:, axis]))


def _probe(scene: Scene) -> Iterator[Family]:
    yield one("effective_radius", "", np.ones(len(scene)))
    yield one("trigger_delay", "", scene.speed_mm_s)
    azimuth = np.arctan2(scene.approach[:, 1], scene.approach[:, 0])
    yield "probe_lobing", "", np.stack([np.cos(3 * azimuth), np.sin(3 * azimuth)])[None]
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0] - 1e4)
    first = gap_s > 3.0 * np.median(gap_s)
    since = np.arange(len(scene)) - np.maximum.accumulate(np.where(first, np.arange(len(scene)), 0))
    decays = [np.exp(-since / touches) for touches in (0.2, 0.5, 0.8, 1.2, 2.0, 4.0)]
    yield "approach_memory", "", np.stack(decays)[:, None, :]


def _gauge(scene: Scene) -> Iterator[Family]:
    stretch = scene.side * scene.along_mm
    yield one("gauge_temperature", "", stretch)
    yield one("misalignment", "", stretch)
    for place in np.unique(scene.placement):
        yield one("misalignment", str(place), stretch * (scene.placement == place))
    for face in np.unique(scene.face):
        yield one("block_defect", str(face), scene.side * (scene.face == face))
    for block in np.unique(scene.face // 2)[1:]:
        yield one("block_shift", str(block), scene.side * ((scene.face + 1) // 2 == block))
    u = scene.along_mm / scene.gauge.length_mm
    tilts = []
    for foot in np.arange(0.0, 0.3, 0.004):
        moment = np.clip(u - foot, 0.0, None) ** 2 / 4.0 + np.clip(u - 1.0 + foot, 0.0, None) ** 2 / 4.0 - u**3 / 6.0
        tilts.append(scene.side * moment)
    yield "gauge_bending", "", np.stack(tilts)[:, None, :]


def _time(scene: Scene) -> Iterator[Family]:
    t = scene.time_s - scene.time_s[0]
    run_s = t[-1]
    drifts = np.stack([t / run_s, *(1.0 - np.exp(-t / (run_s * r)) for r in np.geomspace(0.03, 3.0, 25))])
    yield "thermal_drift", "", drifts[:, None, :] * scene.approach.T
    step, first = 0.15 / run_s, 1.5 / run_s
    count = min(int(np.ceil((1.0 / 115.0 - first) / step)), FREQUENCIES)
    wave = waves(step, count, first, t)[:, None, :] * scene.approach.T
    slow = np.concatenate([wave.real, wave.imag], axis=1)
    yield "temperature_cycle", "", slow
    if _in_beats(t):
        yield "vibration", "", slow
    for place in np.unique(scene.placement):
        rows = np.flatnonzero(scene.placement == place)[1:]
        after = (t >= t[rows][:, None]) & (scene.placement == place)
        yield "step_change", "", (scene.side * after)[:, None, :]


def _in_beats(t: Array) -> bool:
    """Whether all touches came in one exact rhythm: there an oscillation of nearly that frequency is a slow wave."""
    beats = t / max(float(np.diff(t).min()), 1e-9)
    return bool(np.abs(beats - np.round(beats)).max() < 1e-6)

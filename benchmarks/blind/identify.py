"""Which names of the vocabulary fit a realised cause in this measurement, by linear algebra on the noise-free effect.

Every candidate is a family of small column sets along the approach (one set per value of what is non-linear in it). The
origins of the placings are free, errors of the certificate are priced by their stated uncertainty. What the best member
of a family leaves of the concealed effect, squared over the noise, is the chi2 by which data could tell it apart.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import nuisances
from benchmarks.blind.scene import TRAVEL_MM, Scene

Array = NDArray[np.float64]
Family = tuple[str, str, Array]
"""Kind, where, columns of shape ``(members, n, k)``."""
AXES = "xyz"
INVISIBLE = 1e-6
"""A column set whose norm after the nuisances is below this share of what it was cannot be seen at all."""


def leftovers(scene: Scene, effect_um: Array, also_um: Array | None = None) -> dict[str, float]:
    """Chi2 left of ``effect_um`` (along the approach, shape ``(n,)``) by the best member of every family.

    Keys are ``kind`` or ``kind:where``. ``also_um`` is a second concealed effect, fitted freely beside.
    """
    free = nuisances(scene, radius=False)
    if also_um is not None:
        free = np.column_stack([free, also_um])
    base = np.linalg.qr(_whiten(scene, free))[0]
    target = _whiten(scene, effect_um[:, None])[:, 0]
    target = target - base @ (base.T @ target)
    left: dict[str, float] = {}
    for kind, where, members in _families(scene):
        key = f"{kind}:{where}" if where else kind
        chi2 = _least(target, members, scene, base)
        left[key] = min(chi2, left.get(key, np.inf))
    return left


def _whiten(scene: Scene, columns: Array) -> Array:
    """Columns in units of the noise, an error common to all touches of a face allowed for: V^(-1/2) by faces."""
    faces = len(scene.gauge.u_um)
    count = np.bincount(scene.face - 1, minlength=faces)
    shared = 1.0 - 1.0 / np.sqrt(1.0 + count * (scene.gauge.u_um / scene.sigma_um) ** 2)
    share = shared / np.maximum(count, 1)
    member = np.zeros((faces, len(scene)))
    member[scene.face - 1, np.arange(len(scene))] = 1.0
    flat = columns.reshape(-1, columns.shape[-2], columns.shape[-1]) if columns.ndim == 3 else columns[None]
    mean = share[None, :, None] * np.matmul(member, flat)
    white = (flat - np.take(mean, scene.face - 1, axis=1)) / scene.sigma_um
    return white.reshape(columns.shape)


def _least(target: Array, members: Array, scene: Scene, base: Array) -> float:
    white = _whiten(scene, members)
    before = np.einsum("mnk,mnk->mk", white, white)
    white = white - np.matmul(base, np.matmul(base.T, white))
    after = np.einsum("mnk,mnk->mk", white, white)
    seen = after > INVISIBLE * np.maximum(before, 1e-30)
    white = white / np.sqrt(np.where(seen, after, np.inf))[:, None, :]
    gram, share = np.matmul(white.transpose(0, 2, 1), white), np.einsum("mnk,n->mk", white, target)
    inverse = np.linalg.pinv(gram, rcond=1e-7, hermitian=True)
    taken = np.einsum("mk,mkl,ml->m", share, inverse, share)
    return float(max(target @ target - taken.max(), 0.0))


def _families(scene: Scene) -> Iterator[Family]:
    yield from _scales(scene)
    yield from _geometry(scene)
    yield from _probe(scene)
    yield from _gauge(scene)
    yield from _time(scene)


def _one(kind: str, where: str, column: Array) -> Family:
    return kind, where, column[None, :, None]


def _scales(scene: Scene) -> Iterator[Family]:
    frequency = np.arange(1.0 / 250.0, 1.0 / 4.0, 1.0 / 4000.0)
    for axis, name in enumerate(AXES):
        p, x = scene.approach[:, axis], scene.centre_mm[:, axis]
        if np.abs(p).max() < 0.05:
            continue
        yield _one("scale_error", name, p * x)
        yield _one("scale_temperature", name, p * x)
        yield _one("scale_curvature", name, p * (x - TRAVEL_MM[axis].mean()) ** 2)
        angle = 2.0 * np.pi * frequency[:, None] * x
        yield "periodic_scale_error", name, np.stack([p * np.cos(angle), p * np.sin(angle)], axis=-1)
        at = np.arange(x.min(), x.max(), 8.0)
        for width in (6.0, 10.0, 16.0, 25.0, 40.0, 60.0):
            bump = p * np.exp(-0.5 * ((x - at[:, None]) / width) ** 2)
            yield "local_scale_defect", name, bump[:, :, None]


def _geometry(scene: Scene) -> Iterator[Family]:
    p, x = scene.approach, scene.centre_mm
    for first, second in ((0, 1), (0, 2), (1, 2)):
        if np.abs(p[:, first] * p[:, second]).max() > 0.05:
            yield _one("squareness", AXES[first] + AXES[second], p[:, first] * x[:, second])
    for travel in range(3):
        for rotation in range(3):
            arm = x.copy()
            arm[:, travel] = 0.0
            abbe = np.einsum("ij,ij->i", np.cross(np.eye(3)[rotation], arm), p) * x[:, travel]
            yield _one("angular_error", f"{AXES[travel]}/{AXES[rotation]}", abbe)
        for sideways in range(3):
            if sideways != travel and np.abs(p[:, travel] * p[:, sideways]).max() > 0.05:
                bow = p[:, sideways] * (x[:, travel] - TRAVEL_MM[travel].mean()) ** 2
                yield _one("straightness", f"{AXES[travel]}/{AXES[sideways]}", bow)
    for axis, name in enumerate(AXES):
        if np.abs(p[:, axis]).max() > 0.05:
            yield _one("reversal_error", name, np.abs(p[:, axis]))


def _probe(scene: Scene) -> Iterator[Family]:
    yield _one("effective_radius", "", np.ones(len(scene)))
    yield _one("trigger_delay", "", scene.speed_mm_s)
    azimuth = np.arctan2(scene.approach[:, 1], scene.approach[:, 0])
    yield "probe_lobing", "", np.stack([np.cos(3 * azimuth), np.sin(3 * azimuth)], axis=-1)[None]
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0] - 1e4)
    first = gap_s > 3.0 * np.median(gap_s)
    since = np.arange(len(scene)) - np.maximum.accumulate(np.where(first, np.arange(len(scene)), 0))
    decays = [np.exp(-since / touches) for touches in (0.2, 0.5, 0.8, 1.2, 2.0, 4.0)]
    yield "approach_memory", "", np.stack(decays)[:, :, None]


def _gauge(scene: Scene) -> Iterator[Family]:
    stretch = scene.side * scene.along_mm
    yield _one("gauge_temperature", "", stretch)
    yield _one("misalignment", "", stretch)
    for face in np.unique(scene.face):
        yield _one("block_defect", str(face), scene.side * (scene.face == face))
    u = scene.along_mm / scene.gauge.length_mm
    tilts = []
    for foot in np.arange(0.0, 0.3, 0.004):
        moment = np.clip(u - foot, 0.0, None) ** 2 / 4.0 + np.clip(u - 1.0 + foot, 0.0, None) ** 2 / 4.0 - u**3 / 6.0
        tilts.append(scene.side * moment)
    yield "gauge_bending", "", np.stack(tilts)[:, :, None]


def _time(scene: Scene) -> Iterator[Family]:
    t = scene.time_s - scene.time_s[0]
    run_s = t[-1]
    drifts = np.stack([t / run_s, *(1.0 - np.exp(-t / (run_s * r)) for r in np.geomspace(0.03, 3.0, 25))])
    yield "thermal_drift", "", drifts[:, :, None] * scene.approach
    frequency = np.arange(1.5 / run_s, 1.0 / 115.0, 0.15 / run_s)
    angle = 2.0 * np.pi * frequency[:, None] * t
    waves = [(np.cos(angle), np.sin(angle))[q][:, :, None] * scene.approach for q in (0, 1)]
    yield "temperature_cycle", "", np.concatenate(waves, axis=-1)
    for place in np.unique(scene.placement):
        rows = np.flatnonzero(scene.placement == place)[1:]
        after = (t >= t[rows][:, None]) & (scene.placement == place)
        yield "step_change", "", (scene.side * after)[:, :, None]

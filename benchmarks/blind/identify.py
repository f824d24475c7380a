"""Which names of the vocabulary fit a realised cause in this measurement, by linear algebra on the noise-free effect.

Every candidate is a family of small column sets along the approach (one set per value of what is non-linear in it). The
origins of the placings are free, errors of the certificate are priced by their stated uncertainty, a scatter that is
correlated by its correlation. What the best member of a family leaves of the concealed effect, squared over the noise,
is the chi2 by which data could tell it apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import nuisances
from benchmarks.blind.scatter import IDEAL, Scatter
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Family = tuple[str, str, Array]
"""Kind, where, columns of shape ``(members, k, n)``."""
AXES = "xyz"
NEAR_CHI2 = 36.0
"""A name that leaves less than this may be listed as confounded; one that leaves more is simply not the cause."""
INVISIBLE = 1e-6
"""A column set whose norm after the nuisances is below this share of what it was cannot be seen at all."""
FREQUENCIES = 4000
"""Most frequencies in time that are looked at; enough for every recording of less than a day."""


class Names:
    """All column sets of the vocabulary in one measurement, in units of its noise."""

    def __init__(self, scene: Scene, scatter: Scatter = IDEAL) -> None:
        self._scene = scene
        self.whiten = whitener(scene, scatter)
        self._origins = self.whiten(nuisances(scene, radius=False).T)

    @cached_property
    def _sets(self) -> list[tuple[str, Array, Array]]:
        """Key, columns and their products, of every family that has members."""
        sets = []
        for kind, where, members in _families(self._scene):
            if len(members):
                white = self.whiten(members)
                key = f"{kind}:{where}" if where else kind
                sets.append((key, white, np.matmul(white, white.transpose(0, 2, 1))))
        return sets

    def leftovers(self, effect_um: Array, also_um: Array | None = None) -> dict[str, float]:
        """Chi2 left of ``effect_um`` (along the approach, shape ``(n,)``) by the best member of every family.

        Keys are ``kind`` or ``kind:where``. ``also_um`` are further concealed effects, shape ``(n,)`` or ``(k, n)``,
        fitted freely beside.
        """
        free = self._origins
        if also_um is not None:
            free = np.vstack([free, self.whiten(np.atleast_2d(also_um))])
        base = np.linalg.qr(free.T)[0]
        target = self.whiten(effect_um[None])[0]
        target = target - base @ (base.T @ target)
        left: dict[str, float] = {}
        for key, white, gram in self._sets:
            chi2 = _least(target, white, gram, base)
            left[key] = min(chi2, left.get(key, np.inf))
        return left


def leftovers(scene: Scene, effect_um: Array, also_um: Array | None = None) -> dict[str, float]:
    """:meth:`Names.leftovers` where a measurement is asked once."""
    return Names(scene).leftovers(effect_um, also_um)


def whitener(scene: Scene, scatter: Scatter = IDEAL) -> Callable[[Array], Array]:
    """A function that takes rows ``(..., n)`` to units of the noise: V^(-1/2) for noise and certificate together."""
    if scatter.correlation is not None:
        return _by_matrix(scene, scatter)
    faces = len(scene.gauge.u_um)
    count = np.bincount(scene.face - 1, minlength=faces)
    shared = 1.0 - 1.0 / np.sqrt(1.0 + count * (scene.gauge.u_um / scene.sigma_um) ** 2)
    member = np.zeros((len(scene), faces))
    member[np.arange(len(scene)), scene.face - 1] = 1.0
    spread = member.T * (shared / np.maximum(count, 1))[:, None]

    def whiten(rows: Array) -> Array:
        flat = rows.reshape(-1, rows.shape[-1])
        return np.asarray(((flat - (flat @ member) @ spread) / scene.sigma_um).reshape(rows.shape))

    return whiten


def covariance_um2(scene: Scene, scatter: Scatter) -> Array:
    """Scatter, and errors of the certificate that all touches of a face share, along the approach, ``(n, n)``."""
    same_face = scene.face[:, None] == scene.face
    shared = scene.side * scene.gauge.u_um[scene.face - 1]
    return np.asarray(scene.sigma_um**2 * scatter.matrix(len(scene)) + np.outer(shared, shared) * same_face)


def _by_matrix(scene: Scene, scatter: Scatter) -> Callable[[Array], Array]:
    inverse = np.linalg.inv(np.linalg.cholesky(covariance_um2(scene, scatter))).T

    def whiten(rows: Array) -> Array:
        return np.asarray((rows.reshape(-1, rows.shape[-1]) @ inverse).reshape(rows.shape))

    return whiten


def _least(target: Array, white: Array, gram: Array, base: Array) -> float:
    before = np.einsum("mkk->mk", gram)
    taken_up = white @ base
    gram = gram - np.matmul(taken_up, taken_up.transpose(0, 2, 1))
    after = np.einsum("mkk->mk", gram)
    scale = 1.0 / np.sqrt(np.where(after > INVISIBLE * np.maximum(before, 1e-30), after, np.inf))
    share = (white @ target) * scale
    if gram.shape[-1] == 1:
        return float(max(target @ target - (share**2).max(), 0.0))
    inverse = np.linalg.pinv(gram * scale[:, :, None] * scale[:, None, :], rcond=1e-7, hermitian=True)
    taken = np.einsum("mk,mkl,ml->m", share, inverse, share)
    return float(max(target @ target - taken.max(), 0.0))


def waves(step: float, count: int, first: float, at: Array) -> Array:
    """exp(2 pi i f x) for ``count`` frequencies ``first, first + step, ...``, ``(count, n)``, by a running product."""
    turned = np.tile(np.exp(2j * np.pi * step * at), (count, 1))
    turned[0] = np.exp(2j * np.pi * first * at)
    return np.asarray(np.cumprod(turned, axis=0))


def _families(scene: Scene) -> Iterator[Family]:
    yield from _scales(scene)
    yield from _geometry(scene)
    yield from _probe(scene)
    yield from _gauge(scene)
    yield from _time(scene)


def _one(kind: str, where: str, column: Array) -> Family:
    return kind, where, column[None, None, :]


def _scales(scene: Scene) -> Iterator[Family]:
    for axis, name in enumerate(AXES):
        p, x = scene.approach[:, axis], scene.centre_mm[:, axis]
        if np.abs(p).max() < 0.05:
            continue
        yield _one("scale_error", name, p * x)
        yield _one("scale_temperature", name, p * x)
        yield _one("scale_curvature", name, p * (x - scene.travel_mm[axis].mean()) ** 2)
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
            yield _one("squareness", AXES[first] + AXES[second], p[:, first] * x[:, second])
    for travel in range(3):
        for rotation in range(3):
            arm = x.copy()
            arm[:, travel] = 0.0
            abbe = np.einsum("ij,ij->i", np.cross(np.eye(3)[rotation], arm), p) * x[:, travel]
            yield _one("angular_error", f"{AXES[travel]}/{AXES[rotation]}", abbe)
        for sideways in range(3):
            if sideways != travel and np.abs(p[:, travel] * p[:, sideways]).max() > 0.05:
                bow = p[:, sideways] * (x[:, travel] - scene.travel_mm[travel].mean()) ** 2
                yield _one("straightness", f"{AXES[travel]}/{AXES[sideways]}", bow)
    for axis, name in enumerate(AXES):
        if np.abs(p[:, axis]).max() > 0.05:
            yield _one("reversal_error", name, np.abs(p[:, axis]))


def _probe(scene: Scene) -> Iterator[Family]:
    yield _one("effective_radius", "", np.ones(len(scene)))
    yield _one("trigger_delay", "", scene.speed_mm_s)
    azimuth = np.arctan2(scene.approach[:, 1], scene.approach[:, 0])
    yield "probe_lobing", "", np.stack([np.cos(3 * azimuth), np.sin(3 * azimuth)])[None]
    gap_s = np.diff(scene.time_s, prepend=scene.time_s[0] - 1e4)
    first = gap_s > 3.0 * np.median(gap_s)
    since = np.arange(len(scene)) - np.maximum.accumulate(np.where(first, np.arange(len(scene)), 0))
    decays = [np.exp(-since / touches) for touches in (0.2, 0.5, 0.8, 1.2, 2.0, 4.0)]
    yield "approach_memory", "", np.stack(decays)[:, None, :]


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
    yield "gauge_bending", "", np.stack(tilts)[:, None, :]


def _time(scene: Scene) -> Iterator[Family]:
    t = scene.time_s - scene.time_s[0]
    run_s = t[-1]
    drifts = np.stack([t / run_s, *(1.0 - np.exp(-t / (run_s * r)) for r in np.geomspace(0.03, 3.0, 25))])
    yield "thermal_drift", "", drifts[:, None, :] * scene.approach.T
    step, first = 0.15 / run_s, 1.5 / run_s
    count = min(int(np.ceil((1.0 / 115.0 - first) / step)), FREQUENCIES)
    wave = waves(step, count, first, t)[:, None, :] * scene.approach.T
    yield "temperature_cycle", "", np.concatenate([wave.real, wave.imag], axis=1)
    for place in np.unique(scene.placement):
        rows = np.flatnonzero(scene.placement == place)[1:]
        after = (t >= t[rows][:, None]) & (scene.placement == place)
        yield "step_change", "", (scene.side * after)[:, None, :]

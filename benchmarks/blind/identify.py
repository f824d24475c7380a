"""Which names of the vocabulary fit a realised cause in this measurement, by linear algebra on the noise-free effect.

Every candidate is a family of small column sets along the approach (one set per value of what is non-linear in it). The
origins of the placings are free, errors of the certificate are priced by their stated uncertainty, a scatter that is
correlated by its correlation. What the best member of a family leaves of the concealed effect, squared over the noise,
is the chi2 by which data could tell it apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import nuisances
from benchmarks.blind.families import families
from benchmarks.blind.further_families import further_families
from benchmarks.blind.scatter import IDEAL, Scatter
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
NEAR_CHI2 = 36.0
"""A name that leaves less than this may be listed as confounded; one that leaves more is simply not the cause."""
MOST_TRIED = 40
"""Members of a kind that are tried together with those of another."""
INVISIBLE = 1e-6
"""A column set whose norm after the nuisances is below this share of what it was cannot be seen at all."""


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
        for kind, where, members in (*families(self._scene), *further_families(self._scene)):
            if len(members):
                white = self.whiten(members)
                key = f"{kind}:{where}" if where else kind
                sets.append((key, white, np.matmul(white, white.transpose(0, 2, 1))))
        return sets

    def leftover(self, effect_um: Array, members: Array) -> float:
        """Chi2 left of ``effect_um``, shape ``(n,)``, by the best of these column sets, ``(members, k, n)``."""
        base, target = self._apart(effect_um, self._origins)
        white = self.whiten(members)
        return _least(target, white, np.matmul(white, white.transpose(0, 2, 1)), base)

    def leftovers(self, effect_um: Array, also_um: Array | None = None) -> dict[str, float]:
        """Chi2 left of ``effect_um`` (along the approach, shape ``(n,)``) by the best member of every family.

        Keys are ``kind`` or ``kind:where``. ``also_um`` are further concealed effects, shape ``(n,)`` or ``(k, n)``,
        fitted freely beside.
        """
        free = self._origins
        if also_um is not None:
            free = np.vstack([free, self.whiten(np.atleast_2d(also_um))])
        base, target = self._apart(effect_um, free)
        left: dict[str, float] = {}
        for key, white, gram in self._sets:
            chi2 = _least(target, white, gram, base)
            left[key] = min(chi2, left.get(key, np.inf))
        return left

    def together(self, effect_um: Array, kinds: Sequence[str], also_um: Array | None = None) -> float:
        """Chi2 left of ``effect_um``, shape ``(n,)``, by the best members of several kinds in one model.

        ``also_um`` as in :meth:`leftovers`. Of the members of all kinds but the last those are tried that alone leave
        least, so that what is left may be less than this.
        """
        free = self._origins if also_um is None else np.vstack([self._origins, self.whiten(np.atleast_2d(also_um))])
        return self._together(effect_um, sorted(kinds, key=self._count), free)

    def _together(self, effect_um: Array, kinds: Sequence[str], free: Array) -> float:
        first, *others = kinds
        base, target = self._apart(effect_um, free)
        sets = [(white, gram) for key, white, gram in self._sets if key.partition(":")[0] == first]
        if not others:
            return min((_least(target, white, gram, base) for white, gram in sets), default=np.inf)
        left = [(chi2, white[i]) for white, gram in sets for i, chi2 in enumerate(_left(target, white, gram, base))]
        near = sorted(left, key=lambda one: one[0])[:MOST_TRIED]
        return min((self._together(effect_um, others, np.vstack([free, one])) for _, one in near), default=np.inf)

    def _count(self, kind: str) -> int:
        return sum(len(white) for key, white, _ in self._sets if key.partition(":")[0] == kind)

    def _apart(self, effect_um: Array, free: Array) -> tuple[Array, Array]:
        """An orthonormal base of what is free, and what it leaves of the effect, in units of the noise."""
        base = np.linalg.qr(free.T)[0]
        target = self.whiten(effect_um[None])[0]
        return base, target - base @ (base.T @ target)


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
    return float(_left(target, white, gram, base).min())


def _left(target: Array, white: Array, gram: Array, base: Array) -> Array:
    """Chi2 left of the target by each of some column sets, ``(members,)``."""
    before = np.einsum("mkk->mk", gram)
    taken_up = white @ base
    gram = gram - np.matmul(taken_up, taken_up.transpose(0, 2, 1))
    after = np.einsum("mkk->mk", gram)
    scale = 1.0 / np.sqrt(np.where(after > INVISIBLE * np.maximum(before, 1e-30), after, np.inf))
    share = (white @ target) * scale
    if gram.shape[-1] == 1:
        return np.maximum(target @ target - share[:, 0] ** 2, 0.0)
    inverse = np.linalg.pinv(gram * scale[:, :, None] * scale[:, None, :], rcond=1e-7, hermitian=True)
    taken = np.einsum("mk,mkl,ml->m", share, inverse, share)
    return np.maximum(target @ target - taken, 0.0)

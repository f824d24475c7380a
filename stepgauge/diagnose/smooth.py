"""Structure that follows no formula: any function of a covariate that changes no faster than over some length.

A function is a random one (a Gaussian process), known by its values at knots, with a size and a correlation length that
are fitted. What is judged is its evidence: the probability of the residuals averaged over all such functions (Rasmussen
and Williams, Gaussian Processes for Machine Learning, 2006, section 5.4). Evidence pays for every bend that the data
do not need, so that a wandering may be held against laws with a few parameters each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnose.corners import CHEAPEST, LEAST_SINE, SINES_SHARE, STEPS, Corners, WaveLook
from stepgauge.diagnose.extent import Extent
from stepgauge.diagnose.library import Family
from stepgauge.diagnose.search import Judge, Library, Look
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
SIZES = np.geomspace(2.0, 1e6, 16)
"""Prior variances to try, as the gain that is expected of them."""
TOLD = 0.5
"""Share of a direction's prior that the data must decide for it to count as fitted."""


@dataclass(frozen=True)
class Smooth:
    """Random functions of one covariate.

    ``family``: name, covariate and side, its signature ``(m, n)`` what the readings move by for one um at a knot;
    ``roots (k, m, m)``: a root of the covariance of the values at the knots, for each correlation length.
    """

    family: Family
    roots: Array


@dataclass(frozen=True)
class SmoothLook(Look):
    """A look at random functions: ``evidence`` over that of no function at all, nats; ``freedom``: chance's gain;
    ``variance`` of the values at the knots, um squared."""

    evidence: float = 0.0
    freedom: float = 0.0
    variance: float = 0.0

    @property
    def dimension(self) -> float:
        return self.freedom

    def price(self, rows: int, families: float) -> float:
        """What is not gained by the best of the functions but paid for its bends, and what was searched, nats."""
        return self.gain / 2.0 - self.evidence + float(np.log(self.looks * families))


class Forms:
    """Formulas, random functions and waves with corners together, to be looked through as one library."""

    def __init__(
        self,
        families: Sequence[Family],
        smooths: Sequence[Smooth],
        whitening: Whitening,
        waves: Sequence[Corners] = (),
    ) -> None:
        self.library = Library(families, whitening)
        self.whitening = whitening
        self.families = [
            *self.library.families,
            *(one.family for one in smooths),
            *(family for one in waves for family in one.families),
        ]
        self._smooths = [_Whitened.of(one, whitening) for one in smooths]
        self.waves = list(waves)
        self._known: dict[tuple[int, int], list[Look]] = {}

    def looks(self, residual: Array, model: Array, dof: int) -> list[Look]:
        """The best of every form beside a model's orthonormal columns ``(n, k)``, most surprising first."""
        asked = hash(residual.tobytes()), hash(model.tobytes())
        if asked not in self._known:
            self._known[asked] = self._looks(residual, model, dof)
        return self._known[asked]

    def _looks(self, residual: Array, model: Array, dof: int) -> list[Look]:
        left = residual - model @ (model.T @ residual)
        total = float(left @ left)
        found = self.library.looks(residual, model, dof)
        wandering = [one.look(left, model, total, dof) for one in self._smooths]
        jumping = self._cornered(found, left, model, Judge(float(residual @ residual), dof))
        return sorted([*found, *wandering, *jumping], key=lambda look: look.log_p)

    def _cornered(self, found: Sequence[Look], left: Array, model: Array, judge: Judge) -> Iterator[Look]:
        """Waves with corners near the sines that are strong enough to be the fundamental of one."""
        sines = {id(look.family): look for look in found if look.family.details["form"] == "period"}
        best = max((sine.gain for sine in sines.values()), default=0.0)
        most = max((look.gain for look in found), default=0.0)
        least = max(LEAST_SINE, SINES_SHARE * best, SINES_SHARE * (most - CHEAPEST))
        for one in self.waves:
            if (sine := sines[id(one.sines)]).gain < least:
                continue
            periods = one.periods_near(float(one.sines.details["atoms"][sine.atom]), STEPS)
            if len(periods):
                yield from one.looks(periods, sine.extent, left, model, judge, self.whitening)

    def columns(self, look: Look) -> Array:
        """Columns ``(d, n)`` that a look is free to move, um along the approach."""
        if isinstance(look, WaveLook):
            return look.column[None]
        index = next(i for i, family in enumerate(self.families) if family is look.family)
        count = len(self.library.families)
        if isinstance(look, SmoothLook):
            return self._smooths[index - count].told(look)
        return look.family.signature(look.atom)


@dataclass(frozen=True)
class _Whitened:
    """Random functions with their whitened columns ``white (m, n)``."""

    smooth: Smooth
    white: Array
    gram: Array

    @classmethod
    def of(cls, smooth: Smooth, whitening: Whitening) -> _Whitened:
        white = whitening(smooth.family.signature(0))
        return cls(smooth, white, white @ white.T)

    def look(self, left: Array, model: Array, total: float, dof: int) -> SmoothLook:
        """The size and the correlation length with the most evidence; ``left`` is free of the model."""
        strength, found = self._spectra(left, model)
        weight, bends = _shrinking(strength)
        per_direction = np.where(strength > 0.0, found**2 / np.maximum(strength, 1e-300), 0.0)[:, None]
        evidence = 0.5 * (per_direction * weight - bends).sum(axis=2)
        explained = np.minimum((per_direction * weight).sum(axis=2), 0.999 * total)
        ratio = -dof * np.log1p(-explained / max(total, 1e-300)) - bends.sum(axis=2)
        length, size = np.unravel_index(int(evidence.argmax()), evidence.shape)
        softened = weight[length, size] * (2.0 - weight[length, size])
        tests = len(self.smooth.roots)
        return SmoothLook(
            self.smooth.family,
            int(length) * len(SIZES) + int(size),
            float((per_direction[length, 0] * softened).sum()),
            _log_p(float(ratio.max()), tests),
            float(tests),
            Extent(tests, 0.0),
            float(evidence[length, size]),
            float(softened.sum()),
            float(SIZES[size] / max(strength[length].sum(), 1e-300)),
        )

    def told(self, look: SmoothLook) -> Array:
        """Columns ``(d, n)`` of the directions that the data decide at the size and length of a look."""
        length = look.atom // len(SIZES)
        strength, vectors = np.linalg.eigh(self._kernels(np.zeros((self.white.shape[1], 0)))[length])
        decided = look.variance * strength > TOLD / (1.0 - TOLD)
        return (self.smooth.roots[length] @ vectors[:, decided]).T @ self.smooth.family.signature(0)

    def _kernels(self, model: Array) -> Array:
        beside = self.white @ model
        gram = self.gram - beside @ beside.T
        return np.swapaxes(self.smooth.roots, 1, 2) @ gram @ self.smooth.roots

    def _spectra(self, left: Array, model: Array) -> tuple[Array, Array]:
        """Eigenvalues ``(k, m)`` of the functions' shares beside the model, and the residual's products with them."""
        strength, vectors = np.linalg.eigh(self._kernels(model))
        dots = np.swapaxes(self.smooth.roots @ vectors, 1, 2) @ (self.white @ left)
        seen = strength > 1e-6 * strength.max(axis=1, keepdims=True)
        return np.where(seen, strength, 0.0), dots


def _shrinking(strength: Array) -> tuple[Array, Array]:
    """Shares ``(k, sizes, m)`` of the data's word against the prior's, and what the prior's width costs."""
    variance = SIZES / np.maximum(strength.sum(axis=1, keepdims=True), 1e-300)
    relative = variance[..., None] * strength[:, None]
    return relative / (1.0 + relative), np.log1p(relative)


def _log_p(ratio: float, tests: int) -> float:
    """Chance of a likelihood ratio for a variance that is at its lower bound, nought (Self and Liang 1987)."""
    if ratio <= 0.0:
        return 0.0
    # half the tail of chi-square with one degree of freedom is that of a normal number beyond its root
    return min(float(special.log_ndtr(-np.sqrt(ratio)) + np.log(tests)), 0.0)


def matern_roots(knots: Array, lengths: Sequence[float], rough: bool = False) -> Array:
    """Roots of the covariances of unit variance between knots, ``(k, m, m)``.

    Matern's with exponent 3/2, or 1/2 for rough functions, that wander or jump (Rasmussen and Williams, eq. 4.17).
    """
    apart = np.abs(knots[:, None] - knots) / np.array(lengths)[:, None, None]
    scaled = np.sqrt(3.0) * apart
    covariance = np.exp(-apart) if rough else (1.0 + scaled) * np.exp(-scaled)
    return np.linalg.cholesky(covariance + 1e-8 * np.eye(len(knots)))


def smooth(family: Family, roots: Array) -> Smooth:
    """Random functions from a family of one signature with a column to each knot."""
    return Smooth(replace(family, prior=np.inf), roots)

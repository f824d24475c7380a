"""Random functions, rated by the features of all their kernels at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import GaussianProcess, slices
from stepgauge.inference.proposal import FULL, HypothesisResidual, Proposal

Array = NDArray[np.float64]
MOST_FEATURES, SEEN_FEATURES = 90, 0.99
"""Largest number of features of a random function in a look, and the share of its variance that is sufficient."""
SETTLING = 3
"""Rounds in which the noise beside a function settles, from that of the repeats."""
MOST_EXACT = 16
"""Kernels that are rated with the terms of the hypothesis; the others are taken to be independent of these."""


class Kernels:
    """The features ``(m, n)`` of all random functions that matter, kernel after kernel in ``slices``."""

    def __init__(self, smooth: Sequence[GaussianProcess]) -> None:
        self.smooth = smooth
        chosen = [_chosen(features, 1.0 if one.rough else SEEN_FEATURES) for one in smooth for features in one.features]
        self.slices = slices([len(one) for one in chosen])
        self.features = np.concatenate(chosen) if chosen else np.zeros((0, 0))


def _chosen(features: Array, share: float) -> Array:
    """The largest features ``(m, n)`` of a kernel, as many as hold a share of its variance."""
    size = (features**2).sum(axis=1)
    most = np.argsort(-size)
    seen = np.searchsorted(np.cumsum(size[most]) / size.sum(), share)
    if size.min() < 0.1 * size.max():
        most = most[: min(MOST_FEATURES, 1 + int(seen))]
    return features[most]


class Features:
    """All random functions' features with one metric, those of a kernel rotated to be orthogonal.

    ``value``, ``white (m, n)``: squared lengths and mapped features, kernel after kernel; ``first``: where each kernel
    begins.
    """

    def __init__(self, kernels: Kernels, metric: Metric) -> None:
        self.smooth = kernels.smooth
        mapped = metric(kernels.features) if len(kernels.features) else np.zeros((0, 0))
        turned = [_turned(mapped[own]) for own in kernels.slices]
        self.value = np.concatenate([value for value, _ in turned]) if turned else np.zeros(0)
        self.white = np.vstack([np.zeros((0, len(metric.basis))), *(white for _, white in turned)])
        self.slices = slices([len(value) for value, _ in turned])
        self.first = np.array([own.start for own in self.slices], np.intp)

    def proposals(self, beside: HypothesisResidual, products: Array) -> Iterator[Proposal]:
        """Looks of the random functions, over all kernels and sizes.

        ``products (m, 1 + q)``: of the mapped features with the residual and the directions that are taken.
        """
        if not self.smooth:
            return
        sizes, weight = self.smooth[0].sizes.sd, self.smooth[0].sizes.log_weight
        dot, lost = products[:, 0], products[:, 1:]
        variance = sizes[:, None] ** 2 / self._noise_beside(beside, sizes, dot)
        price = 0.5 * np.add.reduceat(np.log1p(variance * self.value), self.first, axis=1)
        shrunk, gain = self._gain(variance, dot)
        evidence = beside.student(gain) - price
        if lost.shape[1]:
            for kernel in np.argsort(-evidence.max(axis=0))[:MOST_EXACT]:
                own = self.slices[kernel]
                more, dearer = _term_corrections(shrunk[:, own], dot[own], lost[own])
                evidence[:, kernel] = beside.student(gain[:, kernel] + more) - price[:, kernel] - dearer
        yield from self._summed(evidence.T + weight, sizes)

    def _noise_beside(self, beside: HypothesisResidual, sizes: Array, dot: Array) -> Array:
        """The noise that each kernel of each size leaves, for each feature ``(sizes, m)``.

        By what is unexplained before, a rough function would be too small to explain its own fine parts.
        """
        count = np.diff(np.r_[self.first, len(self.value)])
        noise = np.full((len(sizes), len(self.first)), min(beside.noise, 1.0))
        for _ in range(SETTLING):
            variance = sizes[:, None] ** 2 / np.repeat(noise, count, axis=1)
            _, gain = self._gain(variance, dot)
            noise = beside.noise * (1.0 - np.clip(gain / beside.total, 0.0, FULL))
        return np.repeat(noise, count, axis=1)

    def _gain(self, variance: Array, dot: Array) -> tuple[Array, Array]:
        """Shrunk amplitudes over ``dot`` by feature, and the reduction of the sum of squares by kernel."""
        shrunk = variance / (1.0 + variance * self.value)
        return shrunk, np.add.reduceat(shrunk * dot**2, self.first, axis=1)

    def _summed(self, evidence: Array, sizes: Array) -> Iterator[Proposal]:
        first = 0
        for one in self.smooth:
            own = evidence[first : first + one.atoms] - np.log(one.atoms)
            total = float(np.logaddexp.reduce(own, axis=None))
            by_atom = np.logaddexp.reduce(own, axis=1)
            atom = int(by_atom.argmax())
            volume = total - float(by_atom[atom]) - float(np.log(one.atoms))
            yield Proposal(one, total + one.log_odds, volume, atom, float(sizes[own[atom].argmax()]))
            first += one.atoms


def _turned(white: Array) -> tuple[Array, Array]:
    """Squared lengths ``(m,)`` and mapped features ``(m, n)`` of a kernel rotated to be orthogonal."""
    value, vector = np.linalg.eigh(white @ white.T)
    keep = value > max(1e-4 * value[-1], 1e-12)
    keep[-1] = True
    return np.maximum(value[keep], 0.0), vector[:, keep].T @ white


def _term_corrections(shrunk: Array, dot: Array, lost: Array) -> tuple[Array, Array]:
    """Change of gain and Occam factor of a kernel by the terms of a hypothesis, ``(t,)`` each."""
    together = shrunk @ (lost * dot[:, None])
    middle = np.eye(lost.shape[1]) - (shrunk[:, None, :] * lost.T) @ lost
    more = (together * np.linalg.solve(middle, together[:, :, None])[:, :, 0]).sum(axis=1)
    return more, 0.5 * np.linalg.slogdet(middle)[1]

"""The likelihood of a hypothesis over its scatter, its amplitudes integrated: from products of columns alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

Array = NDArray[np.float64]
POTRF, POTRI, POTRS = get_lapack_funcs(("potrf", "potri", "potrs"), dtype=np.float64)
ROUNDS = 12
FIRST_STEP = 0.05
"""Half the width of the parabolas that find the most probable log sigma."""
BESIDE = np.array([-1.0, 0.0, 1.0])
ROUNDING, MORE_ROUNDING = float(np.finfo(float).eps), (0.0, 1.0, 1e2, 1e4)
"""Of products of columns, relative; sums of many are off by more, and differences of large ones."""


@dataclass(frozen=True)
class SigmaPrior:
    """Log-normal prior of sigma about what is stated, above ``least_um``; ``factor``: of one standard deviation."""

    stated_um: float
    factor: float
    least_um: float

    def log_density(self, log_sigma: Array) -> Array:
        """Logarithm of the density of log sigma, up to a constant."""
        return np.asarray(-0.5 * ((log_sigma - np.log(self.stated_um)) / np.log(self.factor)) ** 2)


class Likelihood:
    """Log marginal likelihood over the logarithm of sigma, from products of the residual and all columns.

    For a given sigma: -n log sigma - log det(A) / 2 - quad / 2 with A = I + G / sigma2, G the columns' products in
    units of their prior sd. The nuisance columns come first in A; along their eigenvectors their part is diagonal, and
    what is left beside them is as small as the terms are few. ``gram``: products of the residual and all columns;
    ``turn``, ``value``: these eigenvectors and their eigenvalues.
    """

    def __init__(self, gram: Array, sd: Array, turn: Array, value: Array, n: int, prior: SigmaPrior) -> None:
        self.yy, self.b, self.g = float(gram[0, 0]), sd * gram[1:, 0], sd[:, None] * gram[1:, 1:] * sd
        self.n, self.prior, self.lowest = n, prior, float(np.log(prior.least_um))
        self.rounding = ROUNDING * len(self.g) * float(self.g.diagonal().max(initial=0.0))
        count, self.value = len(value), value
        self.own, self.own_b = self.g[count:, count:], self.b[count:]
        self.beside, self.turned_b = turn.T @ self.g[:count, count:], turn.T @ self.b[:count]

    def __call__(self, log_sigma: Array) -> Array:
        """Logarithm of the likelihood times the prior of sigma, amplitudes integrated, for some sigmas ``(s,)``."""
        s2 = np.exp(2.0 * log_sigma)
        share = 1.0 / (s2[:, None] + self.value)
        explained, log_det = s2 * (share @ self.turned_b**2), np.log1p(self.value / s2[:, None]).sum(axis=1)
        if len(self.own_b):
            left = self.own_b - (share * self.turned_b) @ self.beside
            schur = self.own - self.beside.T @ (share[:, :, None] * self.beside)
            for i, (dot, matrix) in enumerate(zip(left, schur, strict=True)):
                factor = factored(matrix / s2[i], self.rounding / float(s2[i]))
                explained[i] += dot @ POTRS(factor, dot, lower=1)[0]
                log_det[i] += 2.0 * np.log(np.diag(factor)).sum()
        quad = np.maximum((self.yy - explained / s2) / s2, 0.0)
        return np.asarray(-self.n * log_sigma - 0.5 * log_det - 0.5 * quad + self.prior.log_density(log_sigma))

    def solved(self, log_sigma: float) -> tuple[Array, Array]:
        """Cholesky factor of A, and amplitudes in units of their prior sd."""
        s2 = float(np.exp(2.0 * log_sigma))
        factor = factored(self.g / s2, self.rounding / s2)
        if not len(factor):  # LAPACK knows no system without unknowns
            return factor, self.b.copy()
        return factor, POTRS(factor, self.b / s2, lower=1)[0]

    def square(self, amplitudes: Array, log_sigma: float) -> float:
        """Least sum of squares over the variance, with that of the amplitudes in units of their prior sd."""
        return (self.yy - float(self.b @ amplitudes)) * float(np.exp(-2.0 * log_sigma))

    def integrated(self, near_um: float) -> tuple[float, float]:
        """Logarithm of the integral over log sigma, and the most probable value, by repeated parabolas."""
        lowest, step = self.lowest, FIRST_STEP
        at = max(float(np.log(near_um)), lowest)
        for _ in range(ROUNDS):
            low, here, high = map(float, self(at + step * BESIDE))
            bend = low - 2.0 * here + high
            move = 0.5 * step * (low - high) / bend if bend < 0.0 else float(np.sign(high - low))
            curvature = max(-bend / step**2, 1.0)
            if bend < 0.0 and abs(move) < step:
                at = max(at + move, lowest)
                return float(self(np.array([at]))[0]) - 0.5 * float(np.log(curvature)), at
            at = max(at + float(np.clip(move, -2.0, 2.0)), lowest)
        return here - 0.5 * float(np.log(curvature)), at


def factored(matrix: Array, rounding: float) -> Array:
    """The lower Cholesky factor of one plus a matrix, which is overwritten.

    Products of columns are positive but for their ``rounding``. It shows beside a scatter that is next to nothing, as
    of readings on the steps of a display, and is then allowed for.
    """
    diagonal = matrix.flat[:: len(matrix) + 1]
    for times in MORE_ROUNDING:
        matrix.flat[:: len(matrix) + 1] = diagonal + (1.0 + times * rounding)
        factor, failed = POTRF(matrix, lower=1)
        if not failed:
            return np.asarray(factor)
    raise np.linalg.LinAlgError("the columns' products are not positive")


def inverse(factor: Array) -> Array:
    """The inverse of a matrix from its lower Cholesky factor."""
    if not len(factor):
        return factor.copy()
    lower = POTRI(factor, lower=1)[0]
    return np.tril(lower) + np.tril(lower, -1).T

"""Residuals as independent variables of variance one without nuisances: a linear map for one model of scatter."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.noise_models import NoiseModel, NoiseModels
from stepgauge.inference.problem import Problem

Array = NDArray[np.float64]
Columns = TypeVar("Columns", bound=NDArray[Any])
ROUNDING = 1e-14
"""Share of the largest variance of a nuisance column below which another is rounding; a free origin has the largest."""
FREE_UM = 1e3
"""Prior standard deviation of a nuisance parameter without prior knowledge: far larger than any remaining origin."""


class RowMetric:
    """Rows made independent: scaled and, where they are correlated, minus the prediction from the previous rows."""

    def __init__(self, problem: Problem, noise: NoiseModel, noise_models: NoiseModels) -> None:
        self.scale = 1.0 / np.sqrt(noise_models.variance(noise))
        self.order, self.correlated, self.problem = problem.order, noise.correlated, problem
        self.flicker = problem.flicker(noise.flicker) if noise.flicker else None
        if self.correlated:
            self.predicted = np.r_[0.0, noise.correlation**problem.gap]
            self.left = np.sqrt(1.0 - self.predicted**2)
            self.back = np.argsort(problem.order)
            self.turned = bool((np.diff(problem.order) < 0).any())

    def __call__(self, columns: Columns) -> Columns:
        """Columns ``(..., n)`` with independent rows of equal variance, in their own precision."""
        scaled = columns * self.scale.astype(columns.dtype)
        if not self.correlated:
            return cast(Columns, scaled)
        turn = scaled[..., self.order] if self.turned else scaled
        if self.flicker is not None:
            flat = turn.reshape(-1, turn.shape[-1])  # one product: as many small ones take twenty times as long
            return cast(Columns, (flat @ self.flicker.T.astype(columns.dtype)).reshape(turn.shape))
        predicted, left = self.predicted.astype(columns.dtype), self.left.astype(columns.dtype)
        turn[..., 1:] -= predicted[1:] * turn[..., :-1]
        turn /= left
        return cast(Columns, turn)

    def adjoint(self, columns: Array) -> Array:
        """The transposed map of columns ``(n, q)``."""
        if not self.correlated:
            return columns * self.scale[:, None]
        if self.flicker is not None:
            turn = self.flicker.T @ columns
        else:
            turn = columns / self.left[:, None]
            turn[:-1] -= self.predicted[1:, None] * turn[1:]
        return (turn[self.back] if self.turned else turn) * self.scale[:, None]

    @cached_property
    def log_determinant(self) -> float:
        """Logarithm of the map's determinant."""
        return float(np.log(self.scale).sum() - len(self.scale) * np.log(self.innovation))

    @cached_property
    def innovation(self) -> float:
        """Standard deviation of a row given the previous ones, over that of a row: the geometric mean of all."""
        if not self.correlated:
            return 1.0
        left = 1.0 / np.diag(self.flicker) if self.flicker is not None else self.left
        return float(np.exp(np.log(left).mean()))

    @property
    def least_um(self) -> float:
        """The least scatter, um: what scatters by no less is what the previous readings do not tell."""
        return self.problem.least_um / self.innovation

    @cached_property
    def precision(self) -> Array:
        """Precision of each row given the others, ``(n,)``, in units of that of all rows."""
        if not self.correlated:
            return self.scale**2
        if self.flicker is not None:
            square = (self.flicker**2).sum(axis=0)
        else:
            square = 1.0 / self.left**2
            square[:-1] += (self.predicted[1:] / self.left[1:]) ** 2
        return np.asarray(square[self.back] * self.scale**2)


def nuisances(problem: Problem, noise: NoiseModel) -> tuple[Array, Array]:
    """Nuisance columns ``(k, n)`` for a model of the scatter and their prior standard deviations ``(k,)``, um."""
    known_um = np.zeros((0, len(problem))) if problem.known_um is None else problem.known_um
    columns = [problem.certified, known_um, problem.free]
    sd = [problem.certified_u * noise.certificate, np.ones(len(known_um)), np.full(len(problem.free), FREE_UM)]
    if noise.rounded:
        columns.append(problem.grouped)
        sd.append(problem.rounded_um)
    return np.vstack(columns), np.concatenate(sd)


class Metric:
    """The map for a given scatter ``sigma_um``: products of mapped columns are those of the likelihood.

    With N the nuisances and V their variances, (I + N V N')^-1 = (I - F (1 - h) F')^2 by the eigenvectors F of N V N'.
    Columns ``beside`` with their prior standard deviations count as nuisances, too.
    """

    def __init__(
        self,
        problem: Problem,
        noise: NoiseModel,
        noise_models: NoiseModels,
        sigma_um: float,
        beside: Sequence[tuple[Array, Array]] = (),
    ) -> None:
        self.rows, self.sigma_um = RowMetric(problem, noise, noise_models), sigma_um
        columns, sd = nuisances(problem, noise)
        columns = np.vstack([columns, *(others for others, _ in beside)])
        sd = np.concatenate([sd, *(own for _, own in beside)])
        wide = self.rows(columns / sigma_um) * sd[:, None]
        value, vector = np.linalg.eigh(wide @ wide.T)
        keep = value > ROUNDING * value.max(initial=0.0)
        value, vector = value[keep], vector[:, keep]
        self.basis = wide.T @ (vector / np.sqrt(value))
        self.kept = 1.0 / np.sqrt(1.0 + value)
        self.dof = max(len(problem) - len(problem.free), 2)

    def __call__(self, columns: Array) -> Array:
        """Mapped columns ``(..., n)``."""
        x = self.rows(columns / self.sigma_um)
        return x - ((x @ self.basis) * (1.0 - self.kept)) @ self.basis.T

    def adjoint(self, columns: Array) -> Array:
        """The transposed map of columns ``(n, q)``."""
        x = columns - self.basis @ ((1.0 - self.kept)[:, None] * (self.basis.T @ columns))
        return self.rows.adjoint(x) / self.sigma_um

"""Residuals as independent numbers of variance one, freed from the nuisances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.residuals import Residuals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Whitening:
    """The linear map that makes an adequate model's residuals white.

    A probing scatters with its own sigma; the true position of a face is off its certified one by the certificate's
    standard uncertainty, the same way in all probings of that face (a random effect, shrunk in closed form face by
    face); the origin of every placement is unknown and projected out. Rows of sigma infinity have no weight.
    """

    inverse_sigma: Array
    side: Array
    face: NDArray[np.int64]
    shrink: Array
    strength: Array
    nuisance: Array

    def __call__(self, columns: Array) -> Array:
        """Whitened columns ``(..., n)`` orthogonal to the nuisances."""
        take, _, give = self._low_rank
        x = (columns * self.inverse_sigma).reshape(-1, columns.shape[-1])
        x -= (x @ take) @ give
        return x.reshape(columns.shape)

    def carried_back(self, white: Array) -> Array:
        """Columns ``(n, q)`` whose products with unwhitened columns are those of ``white`` with whitened ones."""
        take, _, give = self._low_rank
        return (white - take @ (give @ white)) * self.inverse_sigma[:, None]

    @cached_property
    def squared(self) -> tuple[Array, Array]:
        """Matrices T ``(n, k)`` and A ``(k, k)``: products of whitened x and y are x y' - (x T) A (y T)'.

        ``x`` and ``y`` are scaled by sigma already.
        """
        take, middle, give = self._low_rank
        return take, middle + middle.T - give @ take @ middle.T

    @cached_property
    def _low_rank(self) -> tuple[Array, Array, Array]:
        """Matrices T ``(n, k)``, M ``(k, k)``, M T' of the projection: shrinking by face, then without nuisances.

        With V the faces' columns and g their shrinking, (I - V g V') (I - N N') = I - T M T', T = [V N].
        """
        faces = len(self.shrink)
        v = (self.face[:, None] == np.arange(faces)) * (self.side * self.inverse_sigma)[:, None]
        g = (1.0 - self.shrink) / np.maximum(self.strength, 1e-300)
        take = np.hstack([v, self.nuisance])
        middle = np.eye(take.shape[1])
        middle[:faces, :faces] = np.diag(g)
        middle[:faces, faces:] = -g[:, None] * (v.T @ self.nuisance)
        return take, middle, middle @ take.T

    @property
    def dof(self) -> int:
        """Rows with weight less the nuisances."""
        return int((self.inverse_sigma > 0).sum()) - self.nuisance.shape[1]


def make_whitening(residuals: Residuals, sigma_um: Array) -> Whitening:
    """The whitening for a sigma per row, infinite for no weight."""
    inverse = np.where(np.isfinite(sigma_um), 1.0 / sigma_um, 0.0)
    face = residuals.face - residuals.face.min()
    u_um = residuals.gauge.u_um[residuals.face.min() - 1 :]
    strength = np.bincount(face, inverse**2, minlength=face.max() + 1).astype(float)
    u = u_um[: len(strength)]
    shrink = 1.0 / np.sqrt(1.0 + u**2 * strength)
    empty = Whitening(inverse, residuals.side, face, shrink, strength, np.zeros((len(face), 0)))
    origins = (residuals.placement == np.arange(residuals.placement.max() + 1)[:, None]) * residuals.side
    return Whitening(inverse, residuals.side, face, shrink, strength, orthonormal(empty(origins).T))


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis ``(n, k)`` of the span of columns ``(n, m)``; columns that add nothing are dropped."""
    if columns.shape[1] == 0:
        return columns
    size = np.linalg.norm(columns, axis=0)
    keep = size > 1e-9 * max(float(size.max()), 1e-300)
    u, s, _ = np.linalg.svd(columns[:, keep] / size[keep], full_matrices=False)
    return u[:, s > 1e-7]

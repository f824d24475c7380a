"""How much each family would explain, and how surprising that is after so many looks.

The gain of a signature is what it takes off the whitened sum of squares, less the price of a size beyond what occurs (a
normal prior, wide as against the sensible range: it bears on what is badly determined, and hardly on anything else). Its significance counts every look: within a
family by the length of the curve that its whitened signatures draw on the unit sphere (Hotelling's tube: the chance
that pure noise comes as near to any point of the curve), between families by their number (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnose.library import Family
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
PERIODS = {"period_mm", "period_s", "frequency_hz"}
"""Parameters whose values stand in a family from the slowest to the fastest."""
ALIAS_GAIN = 0.03
"""Share of the gain that a period may lose by lying between two of the grid."""
CHUNK = 4_000_000
"""Numbers whitened at a time."""
COLLINEAR = 1e-4
"""Share of a signature's square that must be left beside the nuisances and the terms already there.

A signature that is all but an origin shift (a period that fits into the pitch of the gauge) would fit anything with a
huge amplitude.
"""


@dataclass(frozen=True)
class Look:
    """The best signature of a family: which one, what it gains, and how surprising that is.

    ``gain`` is in units of variance one; ``log_p``: logarithm of the family's p-value, all its looks counted.
    """

    family: Family
    atom: int
    gain: float
    log_p: float

    @property
    def score(self) -> float:
        return -self.log_p


class Library:
    """Families with their whitened signatures, to be looked through again and again."""

    def __init__(self, families: Sequence[Family], whitening: Whitening) -> None:
        self.families = list(families)
        self.whitening = whitening
        self._white: list[Array] = []
        self._square: list[Array] = []
        self._looks: list[float] = []
        for family in self.families:
            white = _whitened(family.columns, whitening)
            self._white.append(white)
            self._square.append(np.einsum("adn,n->ad", family.columns**2, whitening.inverse_sigma**2))
            self._looks.append(_curve_length(white))

    def white(self, index: int) -> Array:
        return self._white[index]

    def gains(self, index: int, residual: Array, model: Array) -> Array:
        """Gain of every signature of a family beside a model's orthonormal columns ``(n, k)``, shape ``(atoms,)``."""
        white = self._white[index]
        beside = white - (white @ model) @ model.T if model.shape[1] else white
        total = self._square[index]
        family = self.families[index]
        if white.shape[1] == 1:
            return _gain_one(beside[:, 0], total[:, 0], residual, family.positive, family.prior**-2)
        return _gain_more(beside, total, residual, family.prior**-2)

    def looks(self, residual: Array, model: Array, dof: int, variance: float = 1.0) -> list[Look]:
        """The best signature of every family, most surprising first."""
        found = []
        rss = float(residual @ residual)
        for index, family in enumerate(self.families):
            gains = self.gains(index, residual, model)
            atom = _best_atom(family, gains)
            gain = float(gains[atom])
            d = family.dimension
            left = (rss - gain) / max(dof - d, 1)
            scaled = gain / max(min(variance, left), 1e-12)
            found.append(Look(family, atom, gain, log_p_value(scaled, d, dof, self._looks[index], len(gains))))
        return sorted(found, key=lambda look: look.log_p)


def _best_atom(family: Family, gains: Array) -> int:
    """The signature that gains most; of periods that the recording cannot tell apart (aliases) the longest."""
    best = int(gains.argmax())
    if not PERIODS & set(family.atoms[best]):
        return best
    return int((gains >= gains[best] * (1.0 - ALIAS_GAIN)).argmax())


def _whitened(columns: Array, whitening: Whitening) -> Array:
    size = max(1, CHUNK // max(columns.shape[1] * columns.shape[2], 1))
    return np.concatenate([whitening(columns[i : i + size]) for i in range(0, len(columns), size)])


def _gain_one(beside: Array, total: Array, residual: Array, positive: bool, stiffness: float) -> Array:
    left = (beside**2).sum(axis=1)
    dot = beside @ residual
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.where(left > COLLINEAR * total, dot**2 / (left + stiffness), 0.0)
    return np.where(dot > 0, gain, 0.0) if positive else gain


def _gain_more(beside: Array, total: Array, residual: Array, stiffness: float) -> Array:
    scale = np.sqrt(np.maximum(total, 1e-300))
    unit = beside / scale[..., None]
    gram = unit @ np.swapaxes(unit, 1, 2)
    stiff = stiffness / np.maximum(scale**2, 1e-300)
    dot = unit @ residual
    value, vector = np.linalg.eigh(gram)
    share = np.einsum("aij,ai->aj", vector, dot)
    against = np.einsum("aij,ai->aj", vector**2, stiff)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(value > COLLINEAR, share**2 / (value + against), 0.0).sum(axis=1)


def _curve_length(white: Array) -> float:
    """Length of the curve of the normalised signatures, rad; two-dimensional ones by their larger principal angle."""
    if len(white) < 2:
        return 0.0
    bases = np.linalg.qr(np.swapaxes(white, 1, 2) / _sizes(white))[0]
    overlap = np.swapaxes(bases[:-1], 1, 2) @ bases[1:]
    smallest = np.linalg.svd(overlap, compute_uv=False)[:, -1]
    return float(np.arccos(np.clip(smallest, 0.0, 1.0)).sum())


def _sizes(white: Array) -> Array:
    return np.maximum(np.linalg.norm(white, axis=2), 1e-300)[:, None, :]


@lru_cache(maxsize=100_000)
def log_p_value(gain: float, dimension: int, dof: int, length: float, count: int) -> float:
    """Logarithm of the chance that noise gains as much anywhere in a family."""
    if gain <= 0.0:
        return 0.0
    single = float(stats.f.logsf(gain / dimension, dimension, max(dof - dimension, 1)))
    looks = min(1.0 + length * np.sqrt(gain) / np.sqrt(2.0 * np.pi), float(count))
    return min(single + float(np.log(looks)), 0.0)

"""How much each family would explain, and how surprising that is after so many looks.

The gain of a signature is what it takes off the whitened sum of squares, less the price of a size beyond what occurs (a
normal prior, wide as against the sensible range: it bears on what is badly determined, and hardly on anything else).
Its significance counts every look: within a family by the length of the curve that its whitened signatures draw on the
unit sphere (Hotelling's tube: the chance that pure noise comes as near to any point of the curve), between families by
their number (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnose.library import Family
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
PERIODS = {"period_mm", "period_s", "frequency_hz"}
"""Parameters whose values stand in a family from the slowest to the fastest."""
ALIAS_GAIN = 0.03
"""Share of the gain that a period may lose by lying between two of the grid."""
FAR_OUT = 1e-217
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

    ``gain`` is in units of variance one; ``log_p``: logarithm of the family's p-value, all its looks counted;
    ``looks``: how many independent signatures the family amounts to.
    """

    family: Family
    atom: int
    gain: float
    log_p: float
    looks: float

    def price(self, rows: int, families: int) -> float:
        """What it takes to say which law with which values (Schwarz' criterion, and what was searched), in nats."""
        return 0.5 * self.family.dimension * float(np.log(max(rows, 2))) + float(np.log(self.looks * families))


class Library:
    """Families with their whitened signatures, to be looked through again and again.

    Signatures are scaled by what they were before the nuisances were taken out, and stacked by their number of linear
    parameters, so that one product with a residual and a model serves all of them.
    """

    def __init__(self, families: Sequence[Family], whitening: Whitening) -> None:
        self.families = list(families)
        self.whitening = whitening
        self._stacks: list[_Stack] = []
        self._place: dict[int, tuple[_Stack, int]] = {}
        for dimension in sorted({family.dimension for family in self.families}):
            members = [i for i, family in enumerate(self.families) if family.dimension == dimension]
            stack = _Stack([self.families[i] for i in members], whitening)
            self._stacks.append(stack)
            self._place |= {index: (stack, place) for place, index in enumerate(members)}

    def white(self, index: int) -> Array:
        """Whitened signatures of a family, shape ``(atoms, d, n)``."""
        stack, place = self._place[index]
        rows = stack.rows(place)
        return stack.unit[rows] * stack.scale[rows][..., None]

    def looks(self, residual: Array, model: Array, dof: int) -> list[Look]:
        """The best signature of every family beside a model's orthonormal columns ``(n, k)``, most surprising first."""
        left = residual - model @ (model.T @ residual)
        found = [look for stack in self._stacks for look in stack.looks(left, model, float(residual @ residual), dof)]
        return sorted(found, key=lambda look: look.log_p)


class _Stack:
    """Families of the same number of linear parameters ``d``, one behind the other.

    ``unit (atoms, d, n)``, ``scale (atoms, d)``: whitened signatures and what they were divided by; ``gram``: their
    products; ``stiff``: the price of their sizes.
    """

    def __init__(self, families: Sequence[Family], whitening: Whitening) -> None:
        self.families = list(families)
        self.first = np.cumsum([0, *(len(family.columns) for family in families)])
        white = [_whitened(family.columns, whitening) for family in families]
        scale = [np.sqrt(np.einsum("adn,n->ad", f.columns**2, whitening.inverse_sigma**2)) for f in families]
        self.scale = np.maximum(np.concatenate(scale), 1e-150)
        self.unit = np.concatenate(white)
        self.unit /= self.scale[..., None]
        self.gram = self.unit @ np.swapaxes(self.unit, 1, 2)
        price = np.repeat([family.prior**-2 for family in families], np.diff(self.first))
        self.stiff = price[:, None] / self.scale**2
        self.lengths = [_curve_length(self.unit[self.rows(i)], self.gram[self.rows(i)]) for i in range(len(families))]

    def rows(self, place: int) -> slice:
        """Where the signatures of a family stand."""
        return slice(int(self.first[place]), int(self.first[place + 1]))

    def looks(self, left: Array, model: Array, total: float, dof: int) -> Iterator[Look]:
        """The best signature of each family; ``total``: sum of squares of the residual that they must bring down."""
        gains = self._gains(left, model)
        for place, family in enumerate(self.families):
            own = gains[self.rows(place)]
            atom = _best_atom(family, own)
            gain = float(own[atom])
            variance = min(1.0, (total - gain) / max(dof - family.dimension, 1))
            scaled = gain / max(variance, 1e-12)
            looks = min(1.0 + self.lengths[place] * np.sqrt(scaled / (2.0 * np.pi)), float(len(own)))
            yield Look(family, atom, gain, log_p_value(scaled, family.dimension, dof, looks), looks)

    def _gains(self, left: Array, model: Array) -> Array:
        """Gain of every signature, shape ``(atoms,)``."""
        atoms, d, n = self.unit.shape
        products = (self.unit.reshape(-1, n) @ np.column_stack([left, model])).reshape(atoms, d, -1)
        dot, beside = products[..., 0], products[..., 1:]
        gram = self.gram - beside @ np.swapaxes(beside, 1, 2)
        gain = _gain_one(gram[:, 0, 0], dot[:, 0], self.stiff[:, 0]) if d == 1 else _gain_more(gram, dot, self.stiff)
        for place, family in enumerate(self.families):
            if family.positive:
                own = self.rows(place)
                gain[own] = np.where(dot[own, 0] > 0.0, gain[own], 0.0)
        return gain


def _best_atom(family: Family, gains: Array) -> int:
    """The signature that gains most; of periods that the recording cannot tell apart (aliases) the longest."""
    best = int(gains.argmax())
    if not PERIODS & set(family.atoms[best]):
        return best
    return int((gains >= gains[best] * (1.0 - ALIAS_GAIN)).argmax())


def _whitened(columns: Array, whitening: Whitening) -> Array:
    size = max(1, CHUNK // max(columns.shape[1] * columns.shape[2], 1))
    return np.concatenate([whitening(columns[i : i + size]) for i in range(0, len(columns), size)])


def _gain_one(left: Array, dot: Array, stiff: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(left > COLLINEAR, dot**2 / (left + stiff), 0.0)


def _gain_more(gram: Array, dot: Array, stiff: Array) -> Array:
    value, vector = np.linalg.eigh(gram)
    share = np.einsum("aij,ai->aj", vector, dot)
    against = np.einsum("aij,ai->aj", vector**2, stiff)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(value > COLLINEAR, share**2 / (value + against), 0.0).sum(axis=1)


def _curve_length(unit: Array, gram: Array) -> float:
    """Length of the curve of the normalised signatures, rad; of subspaces by their larger principal angle."""
    if len(unit) < 2:
        return 0.0
    cross = unit[:-1] @ np.swapaxes(unit[1:], 1, 2)
    shrink = np.linalg.inv(gram + 1e-12 * np.eye(gram.shape[1]))
    overlap = shrink[:-1] @ cross @ shrink[1:] @ np.swapaxes(cross, 1, 2)
    smallest = np.linalg.eigvals(overlap).real.min(axis=1)
    return float(np.arccos(np.sqrt(np.clip(smallest, 0.0, 1.0))).sum())


@lru_cache(maxsize=100_000)
def log_p_value(gain: float, dimension: int, dof: int, looks: float) -> float:
    """Logarithm of the chance that noise gains as much anywhere in a family of so many independent signatures."""
    if gain <= 0.0:
        return 0.0
    single = _log_f_tail(gain / dimension, dimension, max(dof - dimension, 1))
    return min(single + float(np.log(looks)), 0.0)


def _log_f_tail(f: float, d: int, dof: int) -> float:
    """Logarithm of the upper tail of an F distribution.

    Far out, where it underflows, the first term of the series is all there is: with x = dof / (dof + d f) the tail
    is the incomplete beta I_x(dof / 2, d / 2), about x^a (1 - x)^(b - 1) / (a B(a, b)).
    """
    tail = float(special.fdtrc(d, dof, f))
    if tail > FAR_OUT:
        return float(np.log(tail))
    a, b, x = dof / 2.0, d / 2.0, dof / (dof + d * f)
    return float(a * np.log(x) + (b - 1.0) * np.log1p(-x) - np.log(a) - special.betaln(a, b))

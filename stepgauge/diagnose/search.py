"""How much each family would explain, and how surprising that is after so many looks.

The gain of a signature is what it takes off the whitened sum of squares, less the price of a size beyond what occurs (a
normal prior, wide as against the sensible range: it bears on what is badly determined, and hardly on anything else).
Its significance counts every look: within a family by the extent of what its whitened signatures draw on the unit
sphere (the chance that pure noise comes as near to any point of the curve or the surface), between families by
their number, each weighted by how common its law is (Bonferroni, with the chances divided by weights as in Genovese,
Roeder and Wasserman, Biometrika 93, 2006).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnose.extent import Extent, along_curve, over_surface
from stepgauge.diagnose.library import SIZES, Family
from stepgauge.diagnose.patterns import Patterns, grouped
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
PERIODS = {"period_mm", "period_s", "frequency_hz"}
"""Parameters whose values stand in a family from the slowest to the fastest."""
ALIAS_GAIN = 0.03
"""Share of the gain that a period may lose by lying between two of the grid."""
SHOWS = 4.5
"""Standard deviations from which a law is seen among all others."""
FAR_OUT = 1e-217
SMALLEST = 1e-150
SURPRISING = -2.0
"""Logarithm of the chance below which a gain is computed again in double precision."""
BOUND_ERROR = 1e-3
COLLINEAR = 1e-4
"""Share of a signature's square that must be left beside the nuisances and the terms already there.

A signature that is all but an origin shift (a period that fits into the pitch of the gauge) would fit anything with a
huge amplitude.
"""


@dataclass(frozen=True)
class Look:
    """The best signature of a family: which one, what it gains, and how surprising that is.

    ``gain`` is in units of variance one; ``log_p``: logarithm of the family's p-value, all its looks counted, over how
    common it is in a size that shows; ``looks``: how many independent signatures the family amounts to, on its
    ``extent``.
    """

    family: Family
    atom: int
    gain: float
    log_p: float
    looks: float
    extent: Extent

    @property
    def dimension(self) -> float:
        """What chance gains at this look, and as many parameters."""
        return self.family.dimension

    def price(self, rows: int, families: float) -> float:
        """What it takes to say which law with which values (Schwarz' criterion, and what was searched), in nats."""
        said = 0.5 * self.dimension * float(np.log(max(rows, 2)))
        return said + float(np.log(self.looks * families)) + self.extent.rarity


class Library:
    """Families whose signatures are looked through again and again.

    Signatures are scaled by what they were before the nuisances were taken out. They are whitened implicitly: what they
    are multiplied with is carried back instead. The search runs in single precision, and what it points to is computed
    again in double.
    """

    def __init__(
        self, families: Sequence[Family], whitening: Whitening, patterns: Sequence[Patterns] | None = None
    ) -> None:
        self.families = list(families)
        self.whitening = whitening
        self._patterns = list(grouped(self.families)) if patterns is None else patterns
        self._stacks = [list(_stacks(one, whitening)) for one in self._patterns]
        self._place = {id(family): i for i, family in enumerate(self.families)}

    @cached_property
    def rarities(self) -> list[float]:
        """How much rarer each family is, in a size that shows, than the commonest law that always shows, nats."""
        of = {
            id(family): extent.rarity
            for stacks in self._stacks
            for stack in stacks
            for family, extent in zip(stack.families, stack.extents, strict=True)
        }
        return [of[id(family)] for family in self.families]

    @property
    def breadth(self) -> float:
        """How many of the commonest laws the families amount to."""
        return float(np.exp(-np.array(self.rarities)).sum())

    def judged_by(self, whitening: Whitening) -> Library:
        """The same families beside another scatter of the probings."""
        return Library(self.families, whitening, self._patterns)

    def gains(self, index: int, residual: Array, model: Array) -> Array:
        """Gains of all signatures of one family beside a model's orthonormal columns, shape ``(atoms,)``."""
        left = residual - model @ (model.T @ residual)
        patterns, stack = self._stack_of(self.families[index])
        own = stack.rows_of(self.families[index])
        dots = patterns.dots(self.whitening.carried_back(np.column_stack([left, model])), own)
        return stack.gains_of(self.families[index], dots, own)

    def look(self, index: int, residual: Array, model: Array, dof: int) -> Look:
        """The best signature of one family beside a model's orthonormal columns ``(n, k)``."""
        family, gains = self.families[index], self.gains(index, residual, model)
        judge, atom = Judge(float(residual @ residual), dof), _best_atom(family, gains)
        found = judge.look(family, atom, float(gains[atom]), self._stack_of(family)[1].extent_of(family))
        if found.log_p >= SURPRISING:
            return found
        return next(self._sharpened([found], residual - model @ (model.T @ residual), model, judge))

    def _stack_of(self, family: Family) -> tuple[Patterns, _Stack]:
        """Where a family stands."""
        every = ((p, stack) for p, stacks in zip(self._patterns, self._stacks, strict=True) for stack in stacks)
        return next((p, stack) for p, stack in every if any(one is family for one in stack.families))

    def looks(self, residual: Array, model: Array, dof: int) -> list[Look]:
        """The best signature of every family beside a model's orthonormal columns ``(n, k)``, most surprising first."""
        left = residual - model @ (model.T @ residual)
        back = self.whitening.carried_back(np.column_stack([left, model]))
        judge = Judge(float(residual @ residual), dof)
        found: list[Look] = []
        for patterns, stacks in zip(self._patterns, self._stacks, strict=True):
            dots = patterns.dots(back)
            found += [look for stack in stacks for look in stack.looks(dots, judge)]
        found.sort(key=self._rank)
        told = sum(look.log_p < SURPRISING for look in found) + 1
        return sorted(self._sharpened(found[:told], left, model, judge), key=self._rank) + found[told:]

    def gaining(self, look: Look, gain: float, residual: Array, dof: int) -> Look:
        """The same look with another gain."""
        return Judge(float(residual @ residual), dof).look(look.family, look.atom, gain, look.extent)

    def _rank(self, look: Look) -> tuple[float, int, int]:
        return look.log_p, look.family.dimension, self._place[id(look.family)]

    def _sharpened(self, found: Sequence[Look], left: Array, model: Array, judge: Judge) -> Iterator[Look]:
        """The same looks with gains in double precision."""
        for dimension in {look.family.dimension for look in found}:
            own = [look for look in found if look.family.dimension == dimension]
            columns = np.stack([look.family.signature(look.atom) for look in own])
            priors = np.array([look.family.prior for look in own])[:, None]
            for look, gain in zip(own, _precise_gains(columns, priors, left, model, self.whitening), strict=True):
                yield judge.look(look.family, look.atom, float(gain), look.extent)


@dataclass(frozen=True)
class Judge:
    """What a gain is measured by: the residual's sum of squares ``total`` and its degrees of freedom.

    The scatter is what a signature leaves, as in an F test, and at most one standard deviation of chance above what was
    stated: more than that is structure still to be found.
    """

    total: float
    dof: int

    def look(self, family: Family, atom: int, gain: float, extent: Extent) -> Look:
        """A look at a signature with its gain."""
        most = 1.0 + np.sqrt(2.0 / max(self.dof, 1))
        variance = min(most, (self.total - gain) / max(self.dof - family.dimension, 1))
        scaled = gain / max(variance, 1e-12)
        looks = extent.looks(scaled)
        log_p = log_p_value(scaled, family.dimension, self.dof, looks)
        return Look(family, atom, gain, min(log_p + extent.rarity, 0.0), looks, extent)


def _stacks(patterns: Patterns, whitening: Whitening) -> Iterator[_Stack]:
    grams = patterns.grams(whitening)
    for families, mix in patterns.sets:
        yield _Stack(families, mix, whitening, [_mixed(gram, mix) for gram in grams])


def _mixed(gram: Array, mix: Array) -> Array:
    """Products of signatures ``(atoms, d, d)`` from those ``(atoms, r, depth, r, depth)`` for a basis of the shares."""
    mixed = np.einsum("ka,iajbm,lb->ikjlm", mix, gram, mix, optimize=True)
    d = mixed.shape[1] * mixed.shape[2]
    return mixed.reshape(-1, d, d)


class _Stack:
    """Families of the same number of linear parameters ``d`` that show in the same shares, one behind the other.

    ``scale (atoms, d)``: what signatures are divided by; ``gram``: their products after that; ``stiff``: the price of
    their sizes.
    """

    def __init__(self, families: Sequence[Family], mix: Array, whitening: Whitening, grams: Sequence[Array]) -> None:
        self.families, self.mix = list(families), mix
        raw, white, beside = grams
        self.first = np.cumsum([0, *(len(family.pattern) for family in families)])
        square = np.einsum("aii->ai", raw)
        self.scale = np.where(square > 0.0, np.sqrt(np.maximum(square, 0.0)), np.inf)
        self.gram = white / self.scale[:, :, None] / self.scale[:, None, :]
        price = np.repeat([family.prior**-2 for family in families], np.diff(self.first))
        self.stiff = price[:, None] / self.scale**2
        cross = beside / self.scale[:-1, :, None] / self.scale[1:, None, :]
        shown = np.sqrt(np.maximum(np.einsum("aii->ai", white), 0.0)).max(axis=1)
        self.extents = [
            self._extent(family, own, cross[own], _rarity(family, shown[own].max()), whitening)
            for family, own in zip(self.families, self._rows(), strict=True)
        ]

    def _extent(self, family: Family, own: slice, cross: Array, rarity: float, whitening: Whitening) -> Extent:
        """What the signatures of one family draw: a surface, or what stands one behind the other."""
        surface = over_surface(family, self.scale[own, 0], whitening)
        length, area = surface or (along_curve(self.gram[own], cross), 0.0)
        return Extent(len(self.gram[own]), length, area, rarity)

    def _rows(self) -> Iterator[slice]:
        """Where the signatures of each family stand."""
        return (slice(int(a), int(b)) for a, b in zip(self.first[:-1], self.first[1:], strict=True))

    def looks(self, dots: Array, judge: Judge) -> Iterator[Look]:
        """The best signature of each family; ``dots``: see :meth:`Patterns.dots`, the residual's before the model's."""
        gains = self._gains(dots)
        for family, own, extent in zip(self.families, self._rows(), self.extents, strict=True):
            atom = _best_atom(family, gains[own])
            yield judge.look(family, atom, float(gains[own][atom]), extent)

    def extent_of(self, family: Family) -> Extent:
        """What the signatures of one family draw."""
        return next(extent for one, extent in zip(self.families, self.extents, strict=True) if one is family)

    def rows_of(self, family: Family) -> slice:
        """Where the signatures of one family stand."""
        return next(rows for one, rows in zip(self.families, self._rows(), strict=True) if one is family)

    def gains_of(self, family: Family, dots: Array, own: slice) -> Array:
        """Gains of all signatures of one family, from the products of its own rows."""
        gram, dot = self._beside(dots, own)
        gain = _gain(gram, dot, self.stiff[own])
        return np.where(dot[:, 0] > 0.0, gain, 0.0) if family.positive else gain

    def _beside(self, dots: Array, rows: slice = slice(None)) -> tuple[Array, Array]:
        """Products of the signatures with each other and with the residual, what the model takes left out."""
        scale = self.scale[rows]
        mixed = np.tensordot(self.mix, dots, 1).transpose(1, 0, 2, 3)
        products = mixed.reshape(*scale.shape, -1) / scale[..., None]
        dot, beside = products[..., 0], products[..., 1:]
        return self.gram[rows] - beside @ np.swapaxes(beside, 1, 2), dot

    def _gains(self, dots: Array) -> Array:
        """Gain of every signature, shape ``(atoms,)``; of those that cannot be the best of their family maybe none."""
        gram, dot = self._beside(dots)
        gain = self._best_gains(gram, dot)
        for family, own in zip(self.families, self._rows(), strict=True):
            if family.positive:
                gain[own] = np.where(dot[own, 0] > 0.0, gain[own], 0.0)
        return gain

    def _best_gains(self, gram: Array, dot: Array) -> Array:
        """Gains where they may be a family's best: bounds say where, the highest bound of a family first."""
        if len(dot) == len(self.families):
            return _gain(gram, dot, self.stiff)
        bound, gain = _bound(gram, dot), np.zeros(len(dot))
        bar = np.maximum.reduceat(bound, self.first[:-1])
        for _ in range(2):
            may = bound >= np.repeat(bar, np.diff(self.first))
            gain[may] = _gain(gram[may], dot[may], self.stiff[may])
            bar = np.maximum.reduceat(gain, self.first[:-1]) * (1.0 - ALIAS_GAIN) * (1.0 - BOUND_ERROR)
        return gain


def _rarity(family: Family, shown: float) -> float:
    """How much rarer a family is in a size that shows; ``shown``: a unit of it, in standard deviations.

    Sizes have a heavy tail, 1 / (1 + size / usual)^2, of which 1 / (1 + size / usual) is beyond any size. A law that
    could hardly show needs no share of the false alarms, and leaves it to those that can.
    """
    usual = max((size for name, size in family.usual.items() if name not in SIZES), default=np.inf)
    return family.rarity + float(np.log1p(SHOWS / max(usual * shown if shown > 0.0 else 0.0, SMALLEST)))


def _best_atom(family: Family, gains: Array) -> int:
    """The signature that gains most; of periods that the recording cannot tell apart (aliases) the longest."""
    best = int(gains.argmax())
    if not PERIODS & set(family.atoms[best]):
        return best
    return int((gains >= gains[best] * (1.0 - ALIAS_GAIN)).argmax())


def _bound(gram: Array, dot: Array) -> Array:
    """What the gains cannot exceed, by elimination: far quicker than the gains; infinite where that would be unsafe."""
    gram, dot, bound = gram.copy(), dot.copy(), np.zeros(len(dot))
    unsafe = np.zeros(len(dot), bool)
    for i in range(dot.shape[1]):
        pivot = gram[:, i, i]
        unsafe |= pivot < COLLINEAR
        share = gram[:, i, i + 1 :] / np.maximum(pivot, COLLINEAR)[:, None]
        bound += dot[:, i] ** 2 / np.maximum(pivot, COLLINEAR)
        dot[:, i + 1 :] -= share * dot[:, i, None]
        gram[:, i + 1 :, i + 1 :] -= share[:, :, None] * gram[:, i, None, i + 1 :]
    return np.where(unsafe, np.inf, bound)


def _gain(gram: Array, dot: Array, stiff: Array) -> Array:
    """Gains ``(atoms,)`` from the products ``(atoms, d, d)`` of what is left of the signatures."""
    if gram.shape[1] == 1:  # nearly all laws; there is nothing to turn
        value, share, against = gram[:, 0], dot, stiff
    else:
        value, vector = np.linalg.eigh(gram)
        share = np.einsum("aij,ai->aj", vector, dot)
        against = np.einsum("aij,ai->aj", vector**2, stiff)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(value > COLLINEAR, share**2 / (value + against), 0.0).sum(axis=1)


def _precise_gains(columns: Array, prior: Array | float, left: Array, model: Array, whitening: Whitening) -> Array:
    """Gains of signatures ``(atoms, d, n)`` in double precision; ``left`` is free of the model."""
    scale = np.maximum(np.linalg.norm(columns * whitening.inverse_sigma, axis=2), SMALLEST)
    unit = whitening(columns) / scale[..., None]
    beside = unit @ model
    gram = unit @ np.swapaxes(unit, 1, 2) - beside @ np.swapaxes(beside, 1, 2)
    return _gain(gram, unit @ left, (prior * scale) ** -2)


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

"""Effects that this recording cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.search import SMALLEST, Look, log_p_value
from stepgauge.diagnose.select import Selector, Term

Array = NDArray[np.float64]
UNDECIDED = np.log(100.0)
"""Two laws that are likelier than each other by less than this factor are not told apart."""
MOST_IMPLAUSIBLE = UNDECIDED + 1.5
"""Where every law needs a size that does not occur, none is preferred for needing a little less."""
MOST_COMPARED = 30
"""Laws that are fitted in one place at most."""
MOST_FITTED = 2.0
"""Logarithm of the chance that fitting a law's non-linear parameters may yet take off, beyond the grid's."""


@dataclass(frozen=True)
class Rivals:
    """The laws that could stand in one place of the model, best first, with their posterior weights."""

    looks: tuple[Look, ...]
    weights: tuple[float, ...]


def rivals(selector: Selector, terms: tuple[Term, ...], place: int) -> Rivals:
    """All families that explain nearly as much as the best one in one place, the other terms staying."""
    looks = selector.looks_in_place(terms, place)[:MOST_COMPARED]
    left = _Left.of(selector, terms, place, max(look.gain for look in looks))
    near: list[tuple[Look, float]] = []
    for look in looks:
        best = min((left.unlikely(other) + far for other, far in near), default=0.0)
        if left.unlikely(look) > best + UNDECIDED + MOST_FITTED:
            continue
        fitted = selector.fitted(look, terms, place)
        left = left.beside(fitted.gain)
        near.append((fitted, _implausible(fitted, selector, terms, place)))
    # what might be chance by itself may be what there is, and does not stand for it
    chance = max(selector.bar, looks[0].log_p)
    ranked = sorted(((left.unlikely(look) + far, look) for look, far in near), key=lambda one: one[0])
    ranked.sort(key=lambda one: one[1].log_p > chance)
    ranked = [one for one in ranked if one[0] <= ranked[0][0] + UNDECIDED]
    weight = np.exp([ranked[0][0] - rank for rank, _ in ranked])
    return Rivals(tuple(look for _, look in ranked), tuple(float(w) for w in weight / weight.sum()))


@dataclass(frozen=True)
class _Left:
    """What laws in one place are compared by: the sum of squares ``total`` without any, and its degrees of freedom.

    ``most``: the largest gain of any. What that leaves beyond the scatter is the work of none of them.
    """

    total: float
    dof: int
    most: float

    @classmethod
    def of(cls, selector: Selector, terms: tuple[Term, ...], place: int, most: float) -> _Left:
        left, others = selector.residual_in_place(terms, place)
        return cls(float(left @ left), selector.dof - others.shape[1], most)

    def beside(self, gain: float) -> _Left:
        """The same with another gain."""
        return replace(self, most=max(self.most, gain))

    def unlikely(self, look: Look) -> float:
        """Logarithm of a law's chance with what it leaves itself as the scatter, so that laws compare by that.

        The chance by which a law enters takes the scatter to be known: far above the bar it tells two laws of many rows
        apart by less than the ratio of their likelihoods does.
        """
        scatter = min(self.total, self.dof + self.most) - look.gain
        dof = max(self.dof - look.family.dimension, 1)
        gain = look.gain * dof / max(scatter, SMALLEST)
        return log_p_value(gain, look.family.dimension, self.dof, look.looks) + look.extent.rarity


def _implausible(look: Look, selector: Selector, terms: tuple[Term, ...], place: int) -> float:
    """How much less likely a law is for a size that hardly occurs: a heavy tail, 1 / (1 + size)^2 of every size.

    Without this an axis that hardly moves in the recording could explain everything, by a scale ten per cent too long.
    """
    usual = look.family.usual
    if not usual:
        return 0.0
    effect = selector.fit(selector.exchanged(terms, place, look)).solved[place].effect
    sizes = [abs(getattr(effect, name)) / size for name, size in usual.items()]
    return min(2.0 * float(np.log1p(sizes).sum()), MOST_IMPLAUSIBLE)

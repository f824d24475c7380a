"""Effects that this recording cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass

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
    near = _ranked(selector, terms, place)
    near = [one for one in near if one[0] <= near[0][0] + UNDECIDED]
    weight = np.exp([near[0][0] - rank for rank, _ in near])
    return Rivals(tuple(look for _, look in near), tuple(float(w) for w in weight / weight.sum()))


def _ranked(selector: Selector, terms: tuple[Term, ...], place: int) -> list[tuple[float, Look]]:
    """Fitted laws that may be rivals in one place, each with the logarithm of its chance, the likeliest first.

    What might be chance by itself comes last: it may be what there is, and does not stand for it.
    """
    looks = selector.looks_in_place(terms, place)
    left, others = selector.residual_in_place(terms, place)
    total, dof = float(left @ left), selector.dof - others.shape[1]
    near: list[tuple[float, Look]] = []
    for look in looks[:MOST_COMPARED]:
        if _unlikely(look, total, dof) > min((rank for rank, _ in near), default=0.0) + UNDECIDED + MOST_FITTED:
            continue
        fitted = selector.fitted(look, terms, place)
        near.append((_unlikely(fitted, total, dof) + _implausible(fitted, selector, terms, place), fitted))
    chance = max(selector.bar, looks[0].log_p)
    return sorted(near, key=lambda one: (one[1].log_p > chance, one[0]))


def _unlikely(look: Look, total: float, dof: int) -> float:
    """Logarithm of a law's chance with all that it leaves of the sum of squares ``total`` as the scatter.

    So laws compare by the ratio of their likelihoods, the scatter being unknown (Student). The chance by which a law
    enters takes the scatter to be known: far above the bar it tells laws apart by less than that ratio does.
    """
    dimension = look.family.dimension
    gain = look.gain * max(dof - dimension, 1) / max(total - look.gain, SMALLEST)
    return log_p_value(gain, dimension, dof, look.looks) + look.extent.rarity


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

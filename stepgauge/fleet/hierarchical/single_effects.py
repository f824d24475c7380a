"""Causes as a sum of single effects: each is one of all candidates, or none, with its posterior over them.

A cause that the fleet cannot tell from another has its probability spread over both: the set falls out. The model is
the sum of single effects of Wang, Sarkar, Carbonetto and Stephens, J. R. Stat. Soc. B 82 (2020) 1273, with prior odds
of each candidate against none, and a background that is no multiple of the identity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array

KEPT = 1e-6
"""Candidates with less of an effect's probability are left out of it."""
ROUNDS, AT_ONCE = 60, 5
"""Rounds of a search at most, so that a fleet that fits no model ends, and effects that are added in each."""
SWEEPS = 6
SETTLED = 1e-3


class Candidates(Protocol):
    """Columns over the observations.

    ``log_odds`` and ``usual`` sizes ``(j,)``; ``power (j,)``: x' V^-1 x; ``owner (j,)``: number of whose it is.
    """

    owner: NDArray[np.intp]
    log_odds: Array
    usual: Array
    power: Array

    def score(self, residual: Array) -> Array:
        """x' V^-1 r of every candidate, shape ``(j,)``."""
        ...

    def fit(self, rows: NDArray[np.intp], size: Array) -> Array:
        """The sum of some candidates times their sizes, as observations."""
        ...


@dataclass(frozen=True)
class SizeMixture:
    """Prior of sizes over the usual one: normal distributions of standard deviation ``steps (t,)``."""

    steps: Array
    log_weight: Array


@dataclass
class SingleEffect:
    """One cause: ``probability`` that it is there; ``rows`` of candidates with ``share`` (sum one), ``mean``, ``u``."""

    probability: float
    rows: NDArray[np.intp]
    share: Array
    mean: Array
    u: Array
    log_factor: float
    fitted: Array = field(repr=False)


def single_effect(residual: Array, candidates: Candidates, sizes: SizeMixture) -> SingleEffect:
    """The posterior of one effect, given what all others leave."""
    z, q = candidates.score(residual), candidates.power
    sd2 = (candidates.usual[None, :] * sizes.steps[:, None]) ** 2
    shrink = sd2 / (1.0 + sd2 * q)
    log_bf = -0.5 * np.log1p(sd2 * q) + 0.5 * z**2 * shrink + sizes.log_weight[:, None]
    own = np.logaddexp.reduce(log_bf, axis=0)
    log_odds = own + candidates.log_odds
    total = float(np.logaddexp.reduce(log_odds))
    share = np.exp(log_odds - total)
    rows = np.flatnonzero(share > KEPT)
    weight = np.exp(log_bf[:, rows] - own[rows])
    mean = (weight * shrink[:, rows]).sum(axis=0) * z[rows]
    square = (weight * (shrink[:, rows] + (shrink[:, rows] * z[rows]) ** 2)).sum(axis=0)
    probability = 1.0 / (1.0 + np.exp(-np.clip(total, -700, 700)))
    share = share[rows] / share[rows].sum()
    fitted = candidates.fit(rows, probability * share * mean)
    return SingleEffect(probability, rows, share, mean, np.sqrt(np.maximum(square - mean**2, 0.0)), total, fitted)


def find_effects(
    observed: Array,
    candidates: Candidates,
    sizes: SizeMixture,
    stated: float,
    update: Callable[[Array], None] | None = None,
    begin: Sequence[SingleEffect] = (),
) -> list[SingleEffect]:
    """Effects, while the next is likelier than not with one owner; all are revised and those that fell dropped.

    Parameters
    ----------
    observed : observations, of any shape that the candidates know
    sizes : prior of sizes
    stated : least probability of an effect that is kept
    update : told what the effects leave before each round; it may change the candidates' background
    begin : effects to begin with
    """
    search = _Search(observed, candidates, sizes, stated)
    search.effects = list(begin)
    for _ in range(ROUNDS):
        if update is not None:
            update(search.left())
        search.revise()
        if not search.add():
            break
    search.again()
    search.revise(SWEEPS)
    return search.effects


class _Search:
    """Effects so far, and the ways to change them."""

    def __init__(self, observed: Array, candidates: Candidates, sizes: SizeMixture, stated: float) -> None:
        self.observed, self.candidates, self.sizes, self.stated = observed, candidates, sizes, stated
        self.effects: list[SingleEffect] = []

    def left(self) -> Array:
        """What no effect explains."""
        return self.observed - sum((effect.fitted for effect in self.effects), np.zeros_like(self.observed))

    def add(self, most: int = AT_ONCE) -> int:
        """New effects one after the other; returns how many."""
        left, before = self.left(), len(self.effects)
        while len(self.effects) < before + most:
            new = single_effect(left, self.candidates, self.sizes)
            if not self._tells(new):
                break
            new = self._give_to_owner(new)
            self.effects.append(new)
            left = left - new.fitted
        return len(self.effects) - before

    def _tells(self, effect: SingleEffect) -> bool:
        """Whether one owner is likelier to have it than not: what many share says only that somebody has it."""
        held = float(self._held(effect).max(initial=KEPT))
        return effect.log_factor + np.log(held) >= np.log(self.stated / (1.0 - self.stated))

    def _give_to_owner(self, effect: SingleEffect) -> SingleEffect:
        """A new effect given to its likeliest owner; where several have one each, the next ones find the others."""
        mine = self.candidates.owner[effect.rows] == self._held(effect).argmax()
        share = np.where(mine, effect.share, 0.0) / effect.share[mine].sum()
        fitted = self.candidates.fit(effect.rows, effect.probability * share * effect.mean)
        return replace(effect, share=share, fitted=fitted)

    def _held(self, effect: SingleEffect) -> Array:
        return np.asarray(np.bincount(self.candidates.owner[effect.rows], effect.share), float)

    def revise(self, sweeps: int = 1) -> None:
        """Every effect again, given the others."""
        for _ in range(sweeps):
            left, change = self.left(), 0.0
            for number, old in enumerate(self.effects):
                new = single_effect(left + old.fitted, self.candidates, self.sizes)
                if not self._tells(new):
                    new.probability, new.fitted = 0.0, np.zeros_like(new.fitted)
                change = max(
                    change, abs(new.probability - old.probability), 0.01 * abs(new.log_factor - old.log_factor)
                )
                left = left + old.fitted - new.fitted
                self.effects[number] = new
            self.effects = [effect for effect in self.effects if effect.probability > 0.0]
            if change < SETTLED:
                return

    def again(self) -> None:
        """Owners with several effects are explained anew, now that all others are: fewer may do."""
        owners = [int(self._held(effect).argmax()) for effect in self.effects]
        for owner in {owner for owner in owners if owners.count(owner) > 1}:
            old, mine = self.effects, [e for e, its in zip(self.effects, owners, strict=True) if its == owner]
            self.effects = [effect for effect in old if all(effect is not one for one in mine)]
            self.add(len(mine))
            if len(self.effects) > len(old):
                self.effects = old
            owners = [int(self._held(effect).argmax()) for effect in self.effects]

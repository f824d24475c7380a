"""Which effects are there: terms are added, exchanged and dropped until nothing improves.

A term enters when the chance that noise looks like it, after all looks, is below a bar; every term must stay below the
bar beside the others, and is exchanged for whatever explains more in its place. Between two steps the non-linear
parameters are fitted: what a grid leaves of one effect must not pass for another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.holdout import Folds, holdout_rms, make_folds
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.search import PERIODS, Library, Look
from stepgauge.diagnose.solve import Fitted, solve
from stepgauge.diagnose.whitening import Whitening, orthonormal

Array = NDArray[np.float64]
FALSE_ALARM = 0.02
"""Bound of the chance that any named effect enters where there is none.

Laws resemble each other, and one with a fitted shape must be worth its words besides: that leaves a fraction of it.
"""
FURTHER_FALSE_ALARM = 0.001
"""The same for every further effect: a second cause at the same time is rarer than a first."""
SAME_IN_REPEATS = 0.05
"""Share of a displacement's square that may differ between repeats where it counts as the same in all cycles."""
MOST_TERMS = 4
ALIASES = 0.15
"""Share of the gain that an alias may lose on the grid and still be fitted."""
MOST_ALIASES = 4
SAME_FIT = 4.0
"""Difference in chi-square between aliases that is no evidence."""
ROUNDS = 6


@dataclass(frozen=True)
class Term:
    """A family of the library with the signature chosen."""

    index: int
    atom: int


@dataclass(frozen=True)
class Step:
    """One decision on the way, for the evidence trail."""

    action: str
    label: str
    gain: float
    log_p: float


class Selector:
    """Searches the library of named effects for the terms of a recording."""

    def __init__(self, library: Library, whitening: Whitening, data: Residuals, trail: Sequence[Step] = ()) -> None:
        self.library, self.whitening, self.residuals = library, whitening, data
        self.data = whitening(data.um)
        self.dof = whitening.dof
        self.bar = np.log(FALSE_ALARM / max(library.breadth, 1.0))
        self.further_bar = np.log(FURTHER_FALSE_ALARM / max(library.breadth, 1.0))
        self.trail = list(trail)
        self._fits: dict[tuple[Term, ...], Fitted] = {}
        self._looks: dict[tuple[Term, ...], list[Look]] = {}
        self._in_place: dict[tuple[tuple[Term, ...], int], tuple[Array, Array]] = {}
        self._looks_in_place: dict[tuple[tuple[Term, ...], int], list[Look]] = {}

    def fit(self, terms: tuple[Term, ...]) -> Fitted:
        """All parameters of the terms fitted together, the non-linear ones from where the signatures stand."""
        if terms not in self._fits:
            families = [self.library.families[term.index] for term in terms]
            self._fits[terms] = solve(families, [term.atom for term in terms], self.residuals, self.whitening)
        return self._fits[terms]

    def residual(self, terms: tuple[Term, ...]) -> tuple[Array, Array]:
        """What terms leave, and the orthonormal columns they take."""
        fit = self.fit(terms)
        return fit.left, fit.basis

    def residual_in_place(self, terms: tuple[Term, ...], place: int) -> tuple[Array, Array]:
        """What the terms leave but for one of them, the others as they are beside it, and the columns these take.

        Fitted without the one, the others would first bend to stand for it as well as they can.
        """
        if len(terms) == 1:
            return self.residual(())
        if (terms, place) not in self._in_place:
            fit = self.fit(terms)
            others = orthonormal(np.column_stack(fit.tangents[:place] + fit.tangents[place + 1 :]))
            left = fit.left + self.whitening(fit.solved[place].displacement_um(self.residuals))
            self._in_place[terms, place] = left - others @ (others.T @ left), others
        return self._in_place[terms, place]

    def looks_in_place(self, terms: tuple[Term, ...], place: int) -> list[Look]:
        """All families in the place of one of the terms, most surprising first."""
        if len(terms) == 1:
            return self.looks(())
        if (terms, place) not in self._looks_in_place:
            left, others = self.residual_in_place(terms, place)
            self._looks_in_place[terms, place] = self.library.looks(left, others, self.dof - others.shape[1])
        return self._looks_in_place[terms, place]

    def looks(self, terms: tuple[Term, ...]) -> list[Look]:
        """All families beside the terms, most surprising first."""
        if terms not in self._looks:
            left, basis = self.residual(terms)
            self._looks[terms] = self.library.looks(left, basis, self.dof - basis.shape[1])
        return self._looks[terms]

    def fitted(self, look: Look, terms: tuple[Term, ...], place: int) -> Look:
        """A look in the place of a term with what the law gains once all parameters are fitted, the others' as well."""
        if len(look.family.atoms) < 2 and len(terms) == 1:
            return look
        left, basis = self.residual_in_place(terms, place)
        gain = float(left @ left) - self.sum_of_squares(self.exchanged(terms, place, look))
        return self.library.gaining(look, max(gain, look.gain), left, self.dof - basis.shape[1])

    def exchanged(self, terms: tuple[Term, ...], place: int, look: Look) -> tuple[Term, ...]:
        """The terms with another law in the place of one."""
        return (*terms[:place], self.term_of(look), *terms[place + 1 :])

    def term_of(self, look: Look) -> Term:
        """The term that a look means."""
        index = next(i for i, family in enumerate(self.library.families) if family is look.family)
        return Term(index, look.atom)

    def log(self, action: str, look: Look) -> None:
        """Note a decision for the evidence trail."""
        self.trail.append(Step(action, look.family.label, look.gain, look.log_p))

    def select(self) -> tuple[Term, ...]:
        """Add, exchange and drop until nothing changes."""
        terms: tuple[Term, ...] = ()
        while len(terms) < MOST_TERMS:
            best = self.looks(terms)[0]
            if best.log_p > (self.further_bar if terms else self.bar):
                self.log("not added", best)
                break
            self.log("added", best)
            terms = self.dealiased(self._exchange(self.dealiased((*terms, self.term_of(best)))))
        return self._repeated(self._drop(terms))

    def _exchange(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Replace each term by the best in its place, as long as that changes anything."""
        for _ in range(ROUNDS):
            changed = False
            for place in range(len(terms)):
                others = terms[:place] + terms[place + 1 :]
                best = self.looks(others)[0]
                term = self.term_of(best)
                swapped = self.exchanged(terms, place, best)
                if term != terms[place] and self.sum_of_squares(swapped) < self.sum_of_squares(terms):
                    changed = changed or term.index != terms[place].index
                    if term.index != terms[place].index:
                        self.log("exchanged for", best)
                    terms = swapped
            if not changed:
                break
        return terms

    def dealiased(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Each period the longest of those that fit as well, once fitted: the grid is too coarse to tell aliases apart.

        Faces that are probed at a pitch, and touches in a steady rhythm, show a quick oscillation as a slow one.
        """
        for place, term in enumerate(terms):
            family = self.library.families[term.index]
            if not PERIODS & set(family.atoms[term.atom]):
                continue
            others = terms[:place] + terms[place + 1 :]
            left, basis = self.residual(others)
            gains = self.library.gains(term.index, left, basis)
            peaks = [Term(term.index, atom) for atom in _peaks(gains)]
            tried = [(*terms[:place], one, *terms[place + 1 :]) for one in peaks if one not in others] or [terms]
            squares = [self.sum_of_squares(one) for one in tried]
            terms = next(one for one, own in zip(tried, squares, strict=True) if own <= min(squares) + SAME_FIT)
        return terms

    def sum_of_squares(self, terms: tuple[Term, ...]) -> float:
        """Of what the terms leave."""
        left, _ = self.residual(terms)
        return float(left @ left)

    def _drop(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Take out what is no longer significant beside the rest."""
        for place in reversed(range(len(terms))):
            others = terms[:place] + terms[place + 1 :]
            look = self.look_at(terms[place].index, others)
            if look.log_p > self.bar:
                self.log("dropped", look)
                return self._drop(others)
        return terms

    def _repeated(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Only terms that help to predict whole cycles, of those that say the same in every cycle.

        What a single bad probing looks like is significant, and wrong in all other cycles.
        """
        folds = [one for one in make_folds(self.residuals) if one.by == "cycles"]
        shares = [solved.displacement_um(self.residuals) for solved in self.fit(terms).solved]
        same = [i for i, share in enumerate(shares) if not _differs_in_repeats(share, self.residuals)]
        if not folds or not same:
            return terms
        without_um = [self._held_out_um(shares[:place] + shares[place + 1 :], folds[0]) for place in same]
        # the worst first: beside it, others may only have seemed to predict nothing
        worst = int(np.argmin(without_um))
        if self._held_out_um(shares, folds[0]) <= without_um[worst]:
            return terms
        place = same[worst]
        self.log("dropped: does not predict other cycles", self.look_at(terms[place].index, ()))
        return self._repeated(terms[:place] + terms[place + 1 :])

    def _held_out_um(self, shares: Sequence[Array], folds: Folds) -> float:
        with np.errstate(divide="ignore"):
            sigma_um = 1.0 / self.whitening.inverse_sigma
        design = np.array(shares).T if shares else np.zeros((len(self.residuals), 0))
        return holdout_rms(self.residuals, sigma_um, design, folds)

    def look_at(self, index: int, others: tuple[Term, ...]) -> Look:
        """One family beside other terms."""
        if others not in self._looks:
            left, basis = self.residual(others)
            return self.library.look(index, left, basis, self.dof - basis.shape[1])
        family = self.library.families[index]
        return next(look for look in self._looks[others] if look.family is family)


def _peaks(gains: Array) -> list[int]:
    """The highest of the local maxima, in the order of the grid."""
    higher = np.concatenate([[-np.inf], gains, [-np.inf]])
    peaks = np.flatnonzero((gains >= higher[:-2]) & (gains >= higher[2:]) & (gains >= (1.0 - ALIASES) * gains.max()))
    return sorted(int(i) for i in peaks[np.argsort(-gains[peaks])][:MOST_ALIASES])


def _differs_in_repeats(um: Array, data: Residuals) -> bool:
    """Whether a displacement is not the same in all cycles; a constant is."""
    return share_within_repeats(um, data.group) > SAME_IN_REPEATS


def share_within_repeats(um: Array, group: NDArray[np.intp]) -> float:
    """Share of a displacement's square about its mean that is within repeats of a probing; NaN without any."""
    mean = np.bincount(group, um) / np.bincount(group)
    total = float(((um - um.mean()) ** 2).sum())
    return float(((um - mean[group]) ** 2).sum()) / total if total > 0.0 else float("nan")

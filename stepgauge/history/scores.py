"""Normal scores: values of any distribution as numbers that noise makes normal, so that one test serves all of them.

A largest 2s is the largest of many chi-distributed deviations, a range is skew: neither is normal, and limits of three
sigma warn of noise. What cannot be known of a distribution (by how much visits differ beyond their repeatability) is
left to the scatter of the scores from visit to visit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.history.entries import HistoryEntry

FARTHEST = 8.0
"""Normal scores are cut here: beyond it the distribution functions are 0 or 1."""


@dataclass(frozen=True)
class Scores:
    """``score (n,)`` of the values, ``u (n,)`` their standard uncertainties (NaN: not known), ``back``: to values."""

    score: Array
    u: Array
    back: Callable[[Array], Array]


def scores(quantity: str, entries: Sequence[HistoryEntry], value: Array, u: Array) -> Scores:
    """The values of the entries as normal scores.

    ``value``, ``u``: of the ``quantity``, as :data:`stepgauge.history.entries.QUANTITIES` names it, ``(n,)``.
    """
    none = np.full_like(value, np.nan)
    if quantity == "worst_two_sigma_um":
        largest = LargestDeviation.of(entries)
        if largest is not None:
            return Scores(largest.score(value / 2.0), np.ones_like(value), lambda score: 2.0 * largest.value(score))
    if quantity in ("worst_two_sigma_um", "band_um"):
        with np.errstate(divide="ignore", invalid="ignore"):
            return Scores(np.where(value > 0.0, np.log(value), np.nan), none, np.exp)
    return Scores(value, pooled_u(entries, u), lambda score: score)


def pooled_u(entries: Sequence[HistoryEntry], u: Array) -> Array:
    """Standard uncertainties of one repeatability for all visits, by their cycles (JCGM 100:2008, 4.2.4).

    That of a visit alone comes from few readings: values of which it happens to be small would seem to drift.
    """
    cycles = np.array([max(entry.cycles, 1) for entry in entries], float)
    known = np.isfinite(u)
    if not known.any():
        return u
    of_one = float(np.sqrt((u[known] ** 2 * cycles[known]).mean()))
    return np.where(known, of_one / np.sqrt(cycles), np.nan)


@dataclass(frozen=True)
class LargestDeviation:
    """The largest standard deviation s of the faces of a visit.

    With one repeatability sigma at all m faces, each with nu degrees of freedom, P(s < x) = F(nu, nu x^2 / sigma^2)^m
    with the distribution function F of chi squared; sigma is pooled over all visits. ``nu``, ``faces``: ``(n,)``.
    """

    sigma_um: float
    nu: Array
    faces: Array

    @classmethod
    def of(cls, entries: Sequence[HistoryEntry]) -> LargestDeviation | None:
        """None where the repeats of a visit are not known."""
        s, dof, faces = (np.array([getattr(entry, name) for entry in entries], float) for name in _REPEATS)
        if not (np.isfinite(s) & (dof > 0) & (faces > 0)).all() or not (s > 0).any():
            return None
        return cls(float(np.sqrt((dof * s**2).sum() / dof.sum())), dof / faces, faces)

    def score(self, largest_um: Array) -> Array:
        """Normal scores of the largest deviations, ``(n,)``."""
        from scipy.stats import chi2, norm

        beyond = chi2.sf(self.nu * (largest_um / self.sigma_um) ** 2, self.nu)
        with np.errstate(divide="ignore"):
            below = self.faces * np.log1p(-beyond)
        found = np.where(below > np.log(0.5), norm.isf(-np.expm1(below)), norm.ppf(np.exp(below)))
        return np.clip(found, -FARTHEST, FARTHEST)

    def value(self, score: Array) -> Array:
        """The largest deviations of normal scores, um."""
        from scipy.stats import chi2, norm

        bounded = np.clip(score, -FARTHEST, FARTHEST)
        beyond = -np.expm1(norm.logcdf(bounded) / self.faces)
        return np.asarray(self.sigma_um * np.sqrt(chi2.isf(beyond, self.nu) / self.nu))


_REPEATS = ("s_um", "s_dof", "s_faces")

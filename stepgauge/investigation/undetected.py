"""What could be there and not have shown yet: laws of usual size to which the recording so far is blind.

A law whose amplitude is normal with variance s (in units of what the readings tell) moves new readings by an amount
that has this variance. The Bhattacharyya distance to readings without the law is then

    B = ln(1 + s / 2) / 2 - ln(1 + s) / 4

for every amplitude, s being what the new readings add to what the old ones have told. exp(-B) bounds the chance to
mistake one for the other.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnosis.further_runs import ExtendedRecording, independent_metric
from stepgauge.diagnosis.laws.candidates import law_candidates
from stepgauge.diagnosis.priors import Priors
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import Law

TINY = 1e-300
SHAPES = 12
"""Shapes of a law that are looked at, spread over all: a mean over them is asked for, no more."""


@dataclass(frozen=True)
class Unseen:
    """Laws with the odds that they are there and have not shown, and how far a run would show each.

    ``odds (k,)`` against nothing more being there; ``overlap (k,)``: chance to mistake its readings, 1 where the run is
    blind to the law, too.
    """

    kinds: tuple[str, ...]
    odds: Array
    overlap: Array

    @property
    def chance(self) -> float:
        """Chance that the run shows a law that has not shown yet."""
        return float((self.odds * (1.0 - self.overlap)).sum() / (1.0 + self.odds.sum()))

    @property
    def nats(self) -> float:
        """Least expected information about whether one of them is there, nats."""
        p = np.r_[1.0, self.odds] / (1.0 + self.odds.sum())
        mixed = np.r_[p[0] + p[1:] @ self.overlap, p[0] * self.overlap + p[1:].sum()]
        return float(max(-(p * np.log(mixed)).sum(), 0.0))

    def most(self, count: int) -> list[str]:
        """The kinds that the run would most probably show."""
        weight = self.odds * (1.0 - self.overlap)
        ranked: dict[str, float] = {}
        for kind, value in zip(self.kinds, weight, strict=True):
            ranked[kind] = ranked.get(kind, 0.0) + float(value)
        return sorted(ranked, key=lambda kind: -ranked[kind])[:count]


def unseen(
    more: ExtendedRecording,
    n_old: int,
    priors: Priors,
    without: Collection[str] = (),
    named: Collection[str] = (),
    least_um: float = 0.0,
) -> Unseen:
    """Laws that a run may show, where the recording so far is its first ``n_old`` rows.

    ``without``: kinds that are known not to be there; ``named``: labels of laws that are there; ``least_um``: laws that
    displace no reading by more do not count.
    """
    old = np.arange(len(more.data)) < n_old
    before = independent_metric(more.data.at(old), more.metric.sigma_um)
    laws = [law for law in law_candidates(more.data, priors, more.metric, without) if law.label not in named]
    told = [_told(law, more, before, old, least_um) for law in laws]
    odds = [np.exp(law.log_odds) * one[0] for law, one in zip(laws, told, strict=True)]
    return Unseen(tuple(law.kind for law in laws), np.array(odds), np.array([one[1] for one in told]))


def _told(
    law: Law, more: ExtendedRecording, before: Metric, old: NDArray[np.bool_], least_um: float
) -> tuple[float, float]:
    """By how much the old rows have lowered the odds of a law that matters, and how far the new ones overlap."""
    shown = np.unique(np.linspace(0, law.atoms - 1, min(law.atoms, SHAPES)).astype(int))
    columns = np.stack([law.columns(int(atom))[: law.dimension] for atom in shown])  # without its tolerance
    whole, first = (more.metric(columns) ** 2).sum(axis=2), (before(columns[:, :, old]) ** 2).sum(axis=2)
    weight = np.exp(law.sizes.log_weight)
    s_old = first[..., None] * law.sizes.sd**2
    s_new = np.maximum((1.0 + whole[..., None] * law.sizes.sd**2) / (1.0 + s_old) - 1.0, 0.0)
    # a law that would have shown and did not is less probable by its evidence, on average the square root of 1 + s
    kept = (1.0 + s_old).prod(axis=1) ** -0.5
    overlap = np.exp(-0.5 * np.log1p(s_new / 2.0) + 0.25 * np.log1p(s_new)).prod(axis=1)
    largest_um = np.abs(more.data.without_origins(columns)).max(axis=2)[..., None] * law.sizes.sd / np.sqrt(1.0 + s_old)
    matters = 1.0 - special.erf(least_um / np.maximum(np.sqrt(2.0) * largest_um, TINY)).prod(axis=1)
    share = kept * weight * matters
    total = float(share.sum())
    return total / len(shown), float((share * overlap).sum()) / max(total, TINY)

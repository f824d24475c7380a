"""A rated candidate, and what a hypothesis leaves for it to explain."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.problem import Candidate, Law, Term

Array = NDArray[np.float64]
UNSEEN = 3e-6
"""Share of a signature that single precision cannot distinguish from zero."""
UNLOST = 0.01
"""Share of a direction below which a hypothesis explains nothing of it: most features of a function are small."""
FULL = 0.9999


@dataclass(frozen=True)
class Proposal:
    """A candidate rated for addition to a hypothesis.

    ``gain``: increase of the log posterior, prior included, of which ``company`` is for one of its kind that is there;
    ``volume``: log evidence of all shapes together minus that of the best one, their prior included (negative as a
    rule); ``atom``, ``sd``: that shape and its size;
    ``by_atom``: log evidence of each shape, of laws.
    """

    candidate: Candidate
    gain: float
    volume: float
    atom: int
    sd: float
    by_atom: Array | None = None
    company: float = 0.0

    @property
    def log_odds(self) -> float:
        """Log prior odds of the candidate beside the hypothesis."""
        return self.candidate.log_odds + self.company

    def beside(self, kinds: Collection[str]) -> Proposal:
        """The look beside terms of some kinds."""
        more = self.candidate.again if self.candidate.kind in kinds else 0.0
        return replace(self, gain=self.gain + more, company=more) if more else self

    def term(self) -> Term:
        """The candidate with its best shape and size."""
        columns = self.candidate.columns(self.atom)
        return Term(self.candidate, self.atom, columns, self.sd, self.candidate.log_odds + self.volume)

    def peaks(self, most: int) -> list[int]:
        """Other local maxima on the grid of shapes, the best first: aliases of a period."""
        if self.by_atom is None or not isinstance(self.candidate, Law) or len(self.by_atom) < 3:
            return []
        inside = self.by_atom[1:-1]
        tops = 1 + np.flatnonzero((inside > self.by_atom[:-2]) & (inside > self.by_atom[2:]))
        ranked = tops[np.argsort(-self.by_atom[tops])]
        return [int(atom) for atom in ranked if atom != self.atom][:most]

    def volume_of(self, atom: int) -> float:
        """The volume with another shape in place of the best one."""
        assert isinstance(self.candidate, Law)
        weight = self.candidate.log_weight
        return self.volume + float(weight[atom] - weight[self.atom])


def limit_per_kind(proposals: Iterable[Proposal], most: int = 2) -> Iterator[Proposal]:
    """The first ones of every kind; one of all axes at once is none of those of an axis."""
    count: dict[tuple[str, float], int] = {}
    for proposal in proposals:
        kind = (proposal.candidate.kind, proposal.candidate.again)
        count[kind] = count.get(kind, 0) + 1
        if count[kind] <= most:
            yield proposal


@dataclass(frozen=True)
class HypothesisResidual:
    """What a hypothesis leaves for further candidates: its residual, and what its terms take of further columns.

    ``turn (1 + k, 1 + q)``: from products with the mapped residuals of the problem and the mapped columns of all terms
    to those with the residual of the hypothesis and with directions, whose squares are what the terms take of the sum
    of squares of a further column; ``total``: sum of squares that is left.
    """

    turn: Array
    total: float
    dof: float

    @property
    def noise(self) -> float:
        return self.total / self.dof

    def student(self, gain: Array) -> Array:
        """Log evidence of reductions of the sum of squares, the scatter integrated."""
        return np.asarray(-0.5 * self.dof * np.log1p(-np.clip(gain, 0.0, FULL * self.total) / self.total))

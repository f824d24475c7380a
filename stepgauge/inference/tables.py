"""Laws with the same number of amplitudes, all shapes of all of them rated at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.amplitudes import log_inside
from stepgauge.inference.metric import Metric
from stepgauge.inference.patterns import Patterns, mixed
from stepgauge.inference.problem import Law
from stepgauge.inference.proposal import UNSEEN, HypothesisResidual, Proposal

Array = NDArray[np.float64]
Dots = dict[int, tuple[Array, Array | None]]
"""By the place of a pattern: products with a residual ``(r, atoms, depth)``, and what a hypothesis takes of its own
``(atoms, r, depth, r, depth)``; None for nothing."""
Bounds = tuple[NDArray[np.bool_], Array]
"""Of amplitudes, by row: whether they are positive, and their least magnitude."""
WORTH_A_SIZE = 15.0
"""Shapes whose evidence is lower than the best by more than this are not tried with further sizes, nats."""


@dataclass(frozen=True)
class SignatureTable:
    """Laws with the same number of amplitudes, all shapes of all of them in one row after the other.

    ``sets``: which pattern and which mixture of shares the rows come from; ``gram (rows, d, d)``; ``unseen (rows, d)``:
    limits of rounding; ``sizes (t, rows)`` and ``weight (t, rows)``: priors of size and shape together;
    ``first``: where each law begins; ``owner``: the law of each row.
    """

    sets: list[tuple[int, Array]]
    laws: list[Law]
    gram: Array
    unseen: Array
    sizes: Array
    weight: Array
    positive: NDArray[np.bool_]
    least: Array
    first: NDArray[np.intp]
    owner: NDArray[np.intp]

    def proposals(self, dots: Dots, beside: HypothesisResidual) -> Iterator[Proposal]:
        """Evidence of every shape and size; a shape rejected with the largest size is not tried with smaller ones."""
        d = self.gram.shape[1]
        dot = np.concatenate([_mixed_dots(dots[place][0], mix, d) for place, mix in self.sets])
        lost = [None if (loss := dots[place][1]) is None else mixed(loss, mix) for place, mix in self.sets]
        taken = [one for one in lost if one is not None]
        own = self.gram - np.concatenate(taken) if taken else self.gram.copy()
        diagonal = np.arange(d)
        own[:, diagonal, diagonal] = np.maximum(own[:, diagonal, diagonal], 0.0) + self.unseen
        found = np.full(self.sizes.shape, -np.inf)
        found[-1:], most = _sized(own, self.unseen, dot, self.sizes[-1:], self._bounds(slice(None)), beside)
        if len(found) > 1:
            keep = np.flatnonzero(most[0] > np.maximum.reduceat(most[0], self.first)[self.owner] - WORTH_A_SIZE)
            sizes, bounds = self.sizes[:-1, keep], self._bounds(keep)
            found[:-1, keep], _ = _sized(own[keep], self.unseen[keep], dot[keep], sizes, bounds, beside)
        yield from self._summed(found + self.weight)

    def _bounds(self, rows: slice | NDArray[np.intp]) -> Bounds:
        return self.positive[rows], self.least[rows]

    def _summed(self, evidence: Array) -> Iterator[Proposal]:
        """The looks of all laws from log evidences ``(t, rows)``, priors included."""
        by_row = evidence.max(axis=0)
        by_row += np.log(np.exp(evidence - by_row).sum(axis=0))
        highest = np.maximum.reduceat(by_row, self.first)
        total = highest + np.log(np.add.reduceat(np.exp(by_row - highest[self.owner]), self.first))
        ends = np.r_[self.first[1:], len(by_row)]
        for law, first, end, sum_ in zip(self.laws, self.first, ends, total, strict=True):
            own = by_row[first:end]
            atom = int(own.argmax())
            volume = float(sum_ - own[atom] + law.log_weight[atom])
            sd = float(self.sizes[evidence[:, first + atom].argmax(), first + atom])
            yield Proposal(law, float(sum_) + law.log_odds, volume, atom, sd, own)


def tables(patterns: Sequence[Patterns], metric: Metric, first: int) -> list[SignatureTable]:
    """Tables of some patterns, of which the first one has the place ``first``."""
    rows: dict[int, list[tuple[int, Array, list[Law], Array, Array]]] = {}
    for place, one in enumerate(patterns, first):
        length, white = one.grams(metric)
        for laws, mix in one.sets:
            gram = mixed(white, mix)
            rows.setdefault(gram.shape[1], []).append((place, mix, laws, gram, _unseen(length, mix)))
    return [_table(parts) for parts in rows.values()]


def _unseen(length: Array, mix: Array) -> Array:
    """Limits of rounding ``(atoms, d)`` of signatures mixed from basis rows of lengths ``(atoms, r, depth)``.

    They follow from the rows that are mixed: where these cancel each other, their rounding does not. A matrix of d
    amplitudes is positive where d times the rounding of its elements is on its diagonal.
    """
    square = (np.abs(mix) @ length).reshape(len(length), -1) ** 2
    return np.asarray(UNSEEN * square.shape[1] * square)


def _table(parts: Sequence[tuple[int, Array, list[Law], Array, Array]]) -> SignatureTable:
    laws = [law for _, _, own, _, _ in parts for law in own]
    most = max(len(law.sizes.sd) for law in laws)
    count = np.array([law.atoms for law in laws])
    sizes = np.concatenate([np.tile(_padded(law.sizes.sd, most)[:, None], law.atoms) for law in laws], axis=1)
    weight = np.concatenate(
        [_padded(law.sizes.log_weight, most, -np.inf)[:, None] + law.log_weight for law in laws], axis=1
    )
    return SignatureTable(
        [(place, mix) for place, mix, _, _, _ in parts],
        laws,
        np.concatenate([gram for _, _, _, gram, _ in parts]),
        np.concatenate([unseen for _, _, _, _, unseen in parts]),
        sizes,
        weight,
        np.repeat([law.positive for law in laws], count),
        np.repeat([law.least for law in laws], count),
        np.r_[0, np.cumsum(count)[:-1]],
        np.repeat(np.arange(len(laws)), count),
    )


def _padded(values: Array, most: int, filler: float | None = None) -> Array:
    """Values padded at the front, so that the largest sizes stay last."""
    before = np.full(most - len(values), values[0] if filler is None else filler)
    return np.concatenate([before, values])


def _mixed_dots(dots: Array, mix: Array, d: int) -> Array:
    """Products ``(rows, d)`` of signatures from those of basis rows ``(r, rows, depth)``."""
    if len(mix) == 1 and mix.shape[1] == 1 and mix[0, 0] == 1.0:
        return dots[0]
    return np.asarray(np.tensordot(mix, dots, 1).transpose(1, 0, 2).reshape(dots.shape[1], d))


def _sized(
    gram: Array, unseen: Array, dot: Array, sd: Array, bounds: Bounds, beside: HypothesisResidual
) -> tuple[Array, Array]:
    """Log evidence ``(t, rows)`` for some sizes of each, with and without its Occam factor.

    ``gram`` with the limits of rounding ``unseen`` on its diagonal.
    """
    ridge = beside.noise / sd**2
    explained, log_det = _explained(gram, unseen, ridge, dot)
    most = beside.student(explained)
    positive, least = bounds
    if (cut := positive | (least > 0.0)).any():
        a = gram[cut, 0, 0] + ridge[:, cut]
        most[:, cut] += log_inside(dot[cut, 0] / a, np.sqrt(beside.noise / a), sd[:, cut], least[cut], positive[cut])
    return most - 0.5 * np.maximum(log_det, 0.0), most


def _explained(gram: Array, unseen: Array, ridge: Array, dot: Array) -> tuple[Array, Array]:
    """What signatures explain beside ridges, and log determinants in units of these; each ``(t, rows)``.

    Written out for one and two amplitudes. Determinants and pivots are at least those that follow from ``unseen`` and
    ridge, if rounding made them smaller.
    """
    if gram.shape[1] == 1:
        a = gram[:, 0, 0] + ridge
        return dot[:, 0] ** 2 / a, np.log(a / ridge)
    if gram.shape[1] == 2:
        a, b, c = gram[:, 0, 0] + ridge, gram[:, 0, 1], gram[:, 1, 1] + ridge
        u, v = unseen[:, 0] + ridge, unseen[:, 1] + ridge
        det = np.maximum(a * c - b**2, u * c + v * a - u * v)
        b = np.sign(b) * np.sqrt(np.maximum(a * c - det, 0.0))
        x, y = dot[:, 0], dot[:, 1]
        return (c * x**2 - 2.0 * b * x * y + a * y**2) / det, np.log(det / ridge**2)
    return _factored(gram, unseen, ridge, dot)


def _factored(gram: Array, unseen: Array, ridge: Array, dot: Array) -> tuple[Array, Array]:
    """The same by one factorisation (Cholesky) of all rows and sizes: there are thousands of small matrices."""
    d = gram.shape[1]
    a = np.array(np.broadcast_to(gram.transpose(1, 2, 0)[:, :, None], (d, d, *ridge.shape)), order="C")
    x = np.array(np.broadcast_to(dot.T[:, None], (d, *ridge.shape)), order="C")
    explained, log_det = np.zeros(ridge.shape), np.zeros(ridge.shape)
    for j in range(d):
        square = np.maximum(a[j, j], unseen[:, j]) + ridge
        log_det += np.log(square / ridge)
        root = np.sqrt(square)
        x[j] /= root
        explained += x[j] ** 2
        below = a[j + 1 :, j] / root
        a[j + 1 :, j + 1 :] -= below[:, None] * below
        x[j + 1 :] -= below * x[j]
    return explained, log_det

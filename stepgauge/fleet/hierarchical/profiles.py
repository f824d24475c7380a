"""The shape that is left beside the slope and the block size: blocks of gauges, and places of machine scales.

A face that is off follows its gauge; a place of a scale stays with its machine. What certificates leave uncertain is
nothing wrong: it is integrated out, face by face.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from stepgauge.effects.scales import bump
from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical.causes import Cause, courses, growth, owners_of
from stepgauge.fleet.hierarchical.priors import FleetPriors
from stepgauge.fleet.hierarchical.visits import Crossing, GaugeVisits

WIDTHS_MM = (12.5, 25.0, 50.0, 100.0)
"""Full widths at half height of places of a scale; they are tried every half width."""
SEEN_SHARE = 0.2
"""Least component of the gauge's axis along a scale that it looks at."""
DATES, NEAR = 8, 60
"""Dates of a change that are tried for every block, and around a date that was found."""
MOST_PLACES = 500_000
"""Indices along an axis stay below this: kilometres."""
LEAST_POWER = 0.1
"""Candidates that a size of 3 um would not show are none, 1 / um^2."""
FREE_UM = 5.0
"""Standard deviation of faces of which nothing is known."""


@dataclass(frozen=True)
class GaugePatterns:
    """Causes of one gauge: patterns of its faces ``(f, c)``, each with every course of ``factor (k, n)``."""

    ladder: GaugeVisits
    patterns: Array
    factor: Array
    causes: list[Cause]
    log_odds: Array
    usual: Array

    @cached_property
    def certified(self) -> Array:
        """Covariance of the certified positions, um^2."""
        u, r = np.maximum(self.ladder.gauge.u_um, 1e-3), self.ladder.gauge.correlation
        return np.diag(u**2) if r is None else np.outer(u, u) * (0.999 * r + 0.001 * np.eye(len(u)))

    @cached_property
    def _projected(self) -> Array:
        """Rows that the frames of the visits take out of the weights, ``(n, 3, f)``."""
        root = np.linalg.cholesky(self.ladder.normal)
        return np.einsum("nf,fi,nij->njf", self.ladder.weight, self.ladder.frame, root)

    def information(self, factor: Array) -> Array:
        """Sum of the visits' weights without their frames, each times a factor: ``(f, f)``."""
        rows = self._projected.reshape(-1, self.ladder.um.shape[1])
        return np.asarray(np.diag(factor @ self.ladder.weight) - (rows * np.repeat(factor, 3)[:, None]).T @ rows)

    @cached_property
    def faces(self) -> tuple[Array, bool]:
        """Cholesky factor of the information on the gauge's faces, certificate included."""
        count = len(self.ladder.visits)
        return linalg.cho_factor(self.information(np.ones(count)) + np.linalg.inv(self.certified), check_finite=False)

    @cached_property
    def free_faces(self) -> tuple[Array, bool]:
        """The same where nothing is known of the faces but their nominal places."""
        count, faces = self.ladder.um.shape
        return linalg.cho_factor(self.information(np.ones(count)) + np.eye(faces) / FREE_UM**2, check_finite=False)

    def solve(self, um: Array, free: bool = False) -> Array:
        """V^-1 times departures ``(n, f)``: frames free, certificates within their uncertainty or ``free``."""
        weighted = self.ladder.weighted(um)
        factor = self.free_faces if free else self.faces
        face = linalg.cho_solve(factor, weighted.sum(axis=0), check_finite=False)
        return np.asarray(weighted - self.ladder.weighted(np.broadcast_to(face, um.shape)))

    def power(self) -> Array:
        """x' V^-1 x of every pattern and course, flat."""
        found = []
        for factor in self.factor:
            seen = self.information(factor) @ self.patterns
            square = seen if (factor == factor**2).all() else self.information(factor**2) @ self.patterns
            own = (self.patterns * square).sum(axis=0)
            found.append(own - (seen * linalg.cho_solve(self.faces, seen, check_finite=False)).sum(axis=0))
        return np.maximum(np.concatenate(found), 0.0)

    def score(self, solved: Array) -> Array:
        """x' of what :meth:`solve` gave."""
        return np.asarray((self.factor @ solved @ self.patterns).ravel())

    def fit(self, size: Array) -> Array:
        """The sum of all, ``(n, f)``."""
        return np.asarray(self.factor.T @ size.reshape(len(self.factor), -1) @ self.patterns.T)


class ProfileCandidates:
    """All patterns of all gauges, and all places of all machines' scales."""

    def __init__(
        self,
        fleet: Crossing,
        ladders: Sequence[GaugeVisits],
        priors: FleetPriors,
        dated: Sequence[tuple[str, str, float]] = (),
    ) -> None:
        """``dated``: gauge, block and about the day of changes that are to be dated to the visit."""
        self.gauges = [one for ladder in ladders for one in _gauge_patterns(fleet, ladder, priors)]
        self.gauges += [one for ladder in ladders for one in _dated(fleet, ladder, priors, dated)]
        self._owners = [int(np.flatnonzero([ladder is one.ladder for ladder in ladders])[0]) for one in self.gauges]
        self._rows = np.cumsum([0, *(ladder.um.size for ladder in ladders)])
        self.places, causes, odds, usual = _places(fleet, ladders, priors)
        self._placed = self.places.T.tocsr()
        self.causes = [cause for one in self.gauges for cause in one.causes] + causes
        self.owner = owners_of(self.causes)
        self._ends = np.cumsum([0, *(len(one.causes) for one in self.gauges)])
        self.log_odds = np.concatenate([*(one.log_odds for one in self.gauges), odds])
        self.usual = np.concatenate([*(one.usual for one in self.gauges), usual])
        self.power = np.concatenate([*(one.power() for one in self.gauges), self._power_of_places()])
        self.power[self.power < LEAST_POWER] = np.inf

    def _first(self) -> Iterator[tuple[int, GaugePatterns]]:
        """One group of patterns of every gauge: they share the covariance."""
        seen = set[int]()
        for owner, one in zip(self._owners, self.gauges, strict=True):
            if owner not in seen:
                seen.add(owner)
                yield owner, one

    def solve(self, um: Array, free: bool = False) -> Array:
        """V^-1 times departures, flat; ``free``: the faces are taken to be anywhere."""
        solved = np.empty_like(um)
        for owner, one in self._first():
            low, high = self._rows[owner], self._rows[owner + 1]
            solved[low:high] = one.solve(um[low:high].reshape(one.ladder.um.shape), free).ravel()
        return solved

    def score(self, residual: Array) -> Array:
        """x' V^-1 r of every candidate."""
        solved = self.solve(residual)
        parts = []
        for owner, one in zip(self._owners, self.gauges, strict=True):
            own = solved[self._rows[owner] : self._rows[owner + 1]].reshape(one.ladder.um.shape)
            parts.append(one.score(own))
        return np.concatenate([*parts, self._placed @ solved])

    def fit(self, rows: NDArray[np.intp], size: Array) -> Array:
        """The sum of some candidates, flat."""
        every = np.zeros(len(self.causes))
        every[rows] = size
        found = self.places @ every[self._ends[-1] :] if self.places.shape[1] else np.zeros(self._rows[-1])
        for owner, one, low, high in zip(self._owners, self.gauges, self._ends[:-1], self._ends[1:], strict=True):
            if every[low:high].any():
                found[self._rows[owner] : self._rows[owner + 1]] += one.fit(every[low:high]).ravel()
        return np.asarray(found)

    def _power_of_places(self) -> Array:
        """x' V^-1 x of places."""
        found = np.zeros(self.places.shape[1])
        for owner, one in self._first():
            ladder = one.ladder
            own = self.places[self._rows[owner] : self._rows[owner + 1]]
            used = np.flatnonzero(np.diff(own.tocsc().indptr))
            weighted = own[:, used].multiply(ladder.weight.ravel()[:, None]).tocsc()
            found[used] += np.asarray(own[:, used].multiply(weighted).sum(axis=0)).ravel()
            frames, seen_in = _frames(ladder)
            framed = (frames.T @ weighted).tocsc()
            found[used] -= np.asarray(framed.multiply(framed).sum(axis=0)).ravel()
            face = np.tile(np.arange(ladder.um.shape[1]), len(ladder.visits))
            summed = sparse.csr_matrix((np.ones(len(face)), (face, np.arange(len(face))))) @ weighted
            for some in np.array_split(np.arange(len(used)), max(1, len(used) // 2048)):
                seen = summed[:, some].toarray() - (framed[:, some].T @ seen_in.T).T
                found[used[some]] -= (seen * linalg.cho_solve(one.faces, seen, check_finite=False)).sum(axis=0)
        return np.maximum(found, 0.0)


def _frames(ladder: GaugeVisits) -> tuple[sparse.csr_matrix, Array]:
    """The visits' frames, orthonormal under their weights: ``(n f, 3 n)``, and weighted, face by face ``(f, 3 n)``."""
    root = np.linalg.cholesky(ladder.normal)
    count, faces = ladder.um.shape
    values = np.einsum("fi,nij->nfj", ladder.frame, root)
    rows = np.repeat(np.arange(count * faces), 3)
    columns = (3 * np.repeat(np.arange(count), faces)[:, None] + np.arange(3)).ravel()
    frames = sparse.csr_matrix((values.ravel(), (rows, columns)), shape=(count * faces, 3 * count))
    weighted = (values * ladder.weight[:, :, None]).transpose(1, 0, 2).reshape(faces, -1)
    return frames, weighted


def _gauge_patterns(fleet: Crossing, ladder: GaugeVisits, priors: FleetPriors) -> Iterator[GaugePatterns]:
    """Blocks that are off, always or since a day, and wear of the blocks from the first to some other."""
    name = _name(fleet, ladder)
    day, blocks = fleet.day[ladder.visits], ladder.gauge.n_blocks
    one_block = np.repeat(np.eye(blocks), 2, axis=0)
    numbers = [str(block) for block in range(1, blocks + 1)]
    yield _patterns(ladder, name, "block", numbers, one_block, list(_few(courses(day, priors))), priors)
    used = np.tril(np.ones((blocks, blocks))).T[:, : blocks - 1]
    worn = np.repeat(used, 2, axis=0) * ladder.side[:, None]
    where = ["used"] * (blocks - 1)
    yield _patterns(ladder, name, "wear", where, worn, list(growth(day, priors, float(fleet.day.min()))), priors)


def _dated(
    fleet: Crossing, ladder: GaugeVisits, priors: FleetPriors, dated: Sequence[tuple[str, str, float]]
) -> Iterator[GaugePatterns]:
    """Changes of some blocks on every day of a visit near the one that was found."""
    name, day = _name(fleet, ladder), fleet.day[ladder.visits]
    known = np.unique(day)[1:]
    for _, block, about in [one for one in dated if one[0] == name]:
        near = np.sort(known[np.argsort(np.abs(known - about), kind="stable")[:NEAR]])
        share = (1.0 - priors.time.always) / len(known)
        tried = [("since", float(since), (day >= since).astype(float), share) for since in near]
        pattern = np.repeat(np.arange(1, ladder.gauge.n_blocks + 1) == int(block), 2)[:, None].astype(float)
        one = _patterns(ladder, name, "block", [block], pattern, tried, priors)
        yield replace(one, log_odds=one.log_odds - np.log(ladder.gauge.n_blocks))


def _name(fleet: Crossing, ladder: GaugeVisits) -> str:
    return fleet.names["gauge"][int(fleet.owner["gauge"][ladder.visits[0]])]


def _few(all_of: Iterator[tuple[str, float, Array, float]]) -> Iterator[tuple[str, float, Array, float]]:
    """Some of the dates, each with the odds of those that it stands for."""
    every = list(all_of)
    dated = every[1:]
    kept = dated[:: max(1, len(dated) // DATES)]
    yield every[0]
    for course, day, factor, share in kept:
        yield course, day, factor, share * len(dated) / len(kept)


def _patterns(
    ladder: GaugeVisits,
    name: str,
    kind: str,
    where: Sequence[str],
    patterns: Array,
    tried: list[tuple[str, float, Array, float]],
    priors: FleetPriors,
) -> GaugePatterns:
    prior = priors.kinds["gauge"][kind]
    causes = [Cause("gauge", name, kind, place, course, day) for course, day, _, _ in tried for place in where]
    odds = np.repeat([np.log(prior.odds * share / len(where)) for *_, share in tried], len(where))
    factor = np.array([one[2] for one in tried])
    return GaugePatterns(ladder, patterns, factor, causes, odds, np.full(len(causes), prior.usual))


def _places(
    fleet: Crossing, ladders: Sequence[GaugeVisits], priors: FleetPriors
) -> tuple[sparse.csr_matrix, list[Cause], Array, Array]:
    """Columns ``(rows, places)`` of all places of all scales that any visit saw."""
    prior = priors.kinds["machine"]["local_scale"]
    parts = [part for number, width in enumerate(WIDTHS_MM) for part in _seen_places(fleet, ladders, width, number)]
    total = sum(ladder.um.size for ladder in ladders)
    if not parts:
        return sparse.csr_matrix((total, 0)), [], np.zeros(0), np.zeros(0)
    row, value = (np.concatenate([part[k] for part in parts]) for k in (0, 2))
    codes, column = np.unique(np.concatenate([part[1] for part in parts]), return_inverse=True)
    known = _decoded(codes)
    matrix = sparse.csr_matrix((value, (row, column.ravel())), shape=(total, len(known)))
    machines, count = fleet.names["machine"], np.bincount(known[:, 0])
    causes = [
        Cause("machine", machines[m], "local_scale", f"{'xyz'[k]} {at * WIDTHS_MM[w] / 2.0:.0f} mm")
        for m, k, w, at in known.tolist()
    ]
    return matrix, causes, np.log(prior.odds * 2.0 / count[known[:, 0]]), np.full(len(known), prior.usual)


def _code(machine: NDArray[np.intp], axis: int, width: int, at: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number for a place: of its machine, axis, width, and index along the axis."""
    return np.asarray(((machine * 3 + axis) * len(WIDTHS_MM) + width) * 2 * MOST_PLACES + at + MOST_PLACES)


def _decoded(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Machine, axis, width and index ``(n, 4)``."""
    rest, at = np.divmod(codes, 2 * MOST_PLACES)
    rest, width = np.divmod(rest, len(WIDTHS_MM))
    machine, axis = np.divmod(rest, 3)
    return np.column_stack([machine, axis, width, at - MOST_PLACES])


def _seen_places(
    fleet: Crossing, ladders: Sequence[GaugeVisits], width: float, number: int
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.int64], Array]]:
    """Rows, codes of places, and displacements along the gauge."""
    first = 0
    for ladder in ladders:
        machine = np.repeat(fleet.owner["machine"][ladder.visits], ladder.um.shape[1])
        for k in range(3):
            share = np.repeat(ladder.axis[:, k], ladder.um.shape[1])
            rows = np.flatnonzero((np.abs(share) > SEEN_SHARE) & (ladder.weight.ravel() > 0.0))
            x = np.asarray(ladder.at_mm[:, :, k].ravel()[rows], float)
            for step in (-2, -1, 0, 1, 2):
                at = np.rint(x / (width / 2.0)).astype(np.int64) + step
                yield (
                    first + rows,
                    _code(machine[rows], k, number, at),
                    share[rows] * np.asarray(bump(x - at * (width / 2.0), 0.0, width)),
                )
        first += ladder.um.size

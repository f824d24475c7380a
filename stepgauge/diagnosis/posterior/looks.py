"""Rating of all candidates for addition to a hypothesis in one pass: the approximate gain in the log posterior.

The scatter is integrated as in a Student distribution with the remaining degrees of freedom, shapes are summed over
their grids and sizes over their mixtures. A look proposes candidates; :mod:`evidence` computes those proposed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import block_diag, cholesky, solve_triangular

from stepgauge.diagnosis.posterior.evidence import State
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.posterior.patterns import Patterns, grouped, mixed
from stepgauge.diagnosis.posterior.problem import Candidate, Law, Problem, Smooth, Term
from stepgauge.diagnosis.posterior.scatter import Scatters

Array = NDArray[np.float64]
UNSEEN = 3e-6
"""Share of a signature that single precision cannot distinguish from zero."""
UNLOST = 1e-4
"""Share of a direction below which a hypothesis explains nothing of it: most features of a function are small."""
WORTH_A_SIZE = 15.0
"""Shapes whose evidence is lower than the best by more than this are not tried with further sizes, nats."""
MOST_FEATURES, SEEN_FEATURES = 90, 0.99
"""Largest number of features of a random function in a look, and the share of its variance that is sufficient."""
FULL = 0.9999
MOST_TURNED = 10.0
"""Length of a mixture of products from which they are computed anew: single precision would show."""
MOST_SPANS = 400
"""Largest number of rows of terms whose products are kept."""
MOST_EXACT = 16
"""Kernels that are rated with the terms of the hypothesis; the others are taken to be independent of these."""
LIKE_SIGMA = 0.5
"""Difference of log sigma within which looks use the same metric."""


@dataclass(frozen=True)
class Look:
    """A candidate rated for addition to a hypothesis.

    ``gain``: increase of the log posterior, prior included; ``volume``: log evidence of all shapes together
    minus that of the best one, their prior included (negative as a rule); ``atom``, ``sd``: that shape and its size;
    ``by_atom``: log evidence of each shape, of laws.
    """

    candidate: Candidate
    gain: float
    volume: float
    atom: int
    sd: float
    by_atom: Array | None = None

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


class _Span:
    """The mapped columns of a term as ``mix (d, k)`` of orthonormal rows ``(k, n)``, with products computed once.

    Most hypotheses that are looked at have all terms but one in common. ``dots``: products of the rows with patterns,
    by their place; ``features``: with the features of random functions.
    """

    def __init__(self, white: Array, sd: float) -> None:
        value, vector = np.linalg.eigh(white @ white.T)
        keep = value * sd**2 > UNLOST * UNSEEN
        keep[-1] = True
        self.mix = vector[:, keep] * np.sqrt(value[keep])
        self.rows = (vector[:, keep] / np.sqrt(value[keep])).T @ white
        self.dots: dict[int, NDArray[np.float32]] = {}
        self.features: Array | None = None


@dataclass(frozen=True)
class _Beside:
    """Residual of a hypothesis: mapped, with the columns of its terms as a low-rank loss, and their products.

    ``spans``: those of the terms, of which the loss is a mixture ``turn``; None where rounding would show in it.
    """

    left: Array
    lost: Array
    total: float
    dof: float
    spans: tuple[_Span, ...] = ()
    turn: Array | None = None

    @property
    def scatter(self) -> float:
        return self.total / self.dof

    def student(self, gain: Array) -> Array:
        """Log evidence of reductions of the sum of squares, the scatter integrated."""
        return np.asarray(-0.5 * self.dof * np.log1p(-np.clip(gain, 0.0, FULL * self.total) / self.total))


class Looker:
    """Looks with one metric."""

    def __init__(self, problem: Problem, metric: Metric, kernels: _Kernels) -> None:
        self.metric, self.patterns = metric, list[Patterns]()
        self.white = metric(problem.um)
        self.tables: list[_Table] = []
        self.smooth = _Features(kernels, metric)
        self.spans: dict[tuple[object, ...], _Span] = {}

    def admit(self, patterns: Sequence[Patterns]) -> None:
        """All of ``patterns`` that are not known yet; tables are added, none is changed."""
        more = patterns[len(self.patterns) :]
        self.tables += _tables(more, self.metric, len(self.patterns))
        self.patterns += more
        self.__dict__.pop("plain", None)

    def looks(self, state: State, known: int = 0) -> list[Look]:
        """All candidates for addition to a hypothesis, but for the first ``known`` tables."""
        beside, tables = self._beside(state), self.tables[known:]
        dots = self._dots(beside, dict.fromkeys(place for table in tables for place, _ in table.sets))
        found = [look for table in tables for look in table.looks(dots, beside)]
        return found if known else [*found, *self.smooth.looks(beside)]

    def _dots(self, beside: _Beside, places: Collection[int]) -> dict[int, Array]:
        """Products of patterns with residual and loss, ``(r, atoms, depth, 1 + q)``, by their place."""
        if beside.spans and beside.turn is None:
            vectors = self.metric.adjoint(np.column_stack([beside.left, beside.lost]))
            return {place: self.patterns[place].dots(vectors) for place in places}
        left = self.metric.adjoint(beside.left[:, None])
        dots = {place: self.patterns[place].dots(left) for place in places}
        if beside.turn is None:
            return dots
        for span in beside.spans:
            self._fill(span, [place for place in places if place not in span.dots])
        turn = beside.turn.astype(np.float32)
        for place in places:
            lost = np.concatenate([span.dots[place] for span in beside.spans], axis=3) @ turn
            dots[place] = np.concatenate([dots[place], lost], axis=3)
        return dots

    def _fill(self, span: _Span, places: Sequence[int]) -> None:
        """Products of a span with patterns that it has not met."""
        if places:
            vectors = self.metric.adjoint(span.rows.T)
            span.dots |= {place: self.patterns[place].dots(vectors).astype(np.float32) for place in places}

    def _span(self, term: Term) -> _Span:
        """The span of a term; those used last are kept."""
        key = (*term.key[:2], term.key[-1])
        span = self.spans.pop(key, None) or _Span(self.metric(term.columns), float(term.candidate.sizes.sd.max()))
        self.spans[key] = span
        while sum(len(one.rows) for one in self.spans.values()) > MOST_SPANS and len(self.spans) > 1:
            del self.spans[next(iter(self.spans))]
        return span

    def pairs(self, state: State, most: int, without: frozenset[str]) -> list[tuple[Look, Look]]:
        """The most probable pairs of laws of one shape and one amplitude each.

        Two laws may explain together what neither does alone; all pairs are rated, at each step of the sizes.
        """
        keep = [i for i, law in enumerate(self.plain[0]) if law.label not in without]
        if len(keep) < 2:
            return []
        beside, laws, white = self._beside(state), [self.plain[0][i] for i in keep], self.plain[1][keep]
        dot, lost = white @ beside.left, white @ beside.lost
        gram = white @ white.T - lost @ lost.T
        first, second = np.triu_indices(len(laws), 1)
        odds = np.array([law.log_odds for law in laws])
        found: list[tuple[float, int, int, int]] = []
        for k in range(min(len(law.sizes.sd) for law in laws)):
            sd = np.array([law.sizes.sd[k] for law in laws])
            weight = odds + np.array([law.sizes.log_weight[k] for law in laws])
            ridge = beside.scatter / sd**2
            a, b, c = gram[first, first] + ridge[first], gram[first, second], gram[second, second] + ridge[second]
            det = np.maximum(a * c - b**2, ridge[first] * ridge[second])
            square = (c * dot[first] ** 2 - 2.0 * b * dot[first] * dot[second] + a * dot[second] ** 2) / det
            price = 0.5 * (np.log(det) - np.log(ridge[first] * ridge[second]))
            gain = beside.student(square) - price + weight[first] + weight[second]
            best = np.argpartition(-gain, most)[:most] if len(gain) > most else range(len(gain))
            found += [(float(gain[i]), int(first[i]), int(second[i]), k) for i in best]
        return [
            (_alone(laws[i], k, gain), _alone(laws[j], k, gain)) for gain, i, j, k in sorted(found, reverse=True)[:most]
        ]

    @cached_property
    def plain(self) -> tuple[list[Law], Array]:
        """Laws of one shape and one amplitude, and their mapped signatures ``(m, n)``."""
        laws = [law for table in self.tables for law in table.laws if law.atoms == law.dimension == 1]
        laws = [law for law in laws if law.named and not law.positive and len(law.sizes.sd) > 1]
        columns = np.array([law.columns(0)[0] for law in laws]).reshape(len(laws), len(self.white))
        return laws, self.metric(columns)

    def _beside(self, state: State) -> _Beside:
        if not state.terms:
            return _Beside(self.white, np.zeros((len(self.white), 0)), float(self.white @ self.white), self.metric.dof)
        spans = tuple(self._span(term) for term in state.terms)
        rows, mix = np.vstack([one.rows for one in spans]), block_diag(*(one.mix for one in spans))
        sd = np.concatenate([np.full(len(term.columns), term.sd) for term in state.terms])
        factor = cholesky(mix @ (rows @ rows.T) @ mix.T + np.diag(sd**-2.0), lower=True)
        turn = solve_triangular(factor, mix, lower=True).T
        lost = rows.T @ turn
        left = self.white - lost @ (lost.T @ self.white)
        share, vector = np.linalg.eigh(lost.T @ lost)
        turn, lost = turn @ vector[:, share > UNLOST], lost @ vector[:, share > UNLOST]
        sharp = (np.linalg.norm(turn, axis=0) <= MOST_TURNED * np.linalg.norm(lost, axis=0)).all()
        total = float(self.white @ left)
        return _Beside(left, lost, total, self.metric.dof, spans, turn if sharp else None)


def _alone(law: Law, size: int, gain: float) -> Look:
    """The look of a law of one shape with one of its sizes."""
    return Look(law, gain, float(law.log_weight[0]), 0, float(law.sizes.sd[size]))


@dataclass(frozen=True)
class _Table:
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
    first: NDArray[np.intp]
    owner: NDArray[np.intp]

    def looks(self, dots: Mapping[int, Array], beside: _Beside) -> Iterator[Look]:
        """Evidence of every shape and size; a shape rejected with the largest size is not tried with smaller ones."""
        d = self.gram.shape[1]
        products = [_mixed_dots(dots[place], mix, d) for place, mix in self.sets]
        product = np.concatenate(products)
        dot, lost = product[..., 0], product[..., 1:]
        own = self.gram - np.einsum("rdq,req->rde", lost, lost) if lost.shape[2] else self.gram.copy()
        diagonal = np.arange(d)
        own[:, diagonal, diagonal] = np.maximum(own[:, diagonal, diagonal], 0.0) + self.unseen
        found = np.full(self.sizes.shape, -np.inf)
        found[-1], most = _sized(own, dot, self.sizes[-1], self.positive, beside)
        if len(found) > 1:
            keep = np.flatnonzero(most > np.maximum.reduceat(most, self.first)[self.owner] - WORTH_A_SIZE)
            every, smaller = np.tile(keep, len(found) - 1), self.sizes[:-1, keep].ravel()
            sized, _ = _sized(own[every], dot[every], smaller, self.positive[every], beside)
            found[:-1, keep] = sized.reshape(-1, len(keep))
        yield from self._summed(found + self.weight)

    def _summed(self, evidence: Array) -> Iterator[Look]:
        """The looks of all laws from log evidences ``(t, rows)``, priors included."""
        by_row = np.logaddexp.reduce(evidence, axis=0)
        highest = np.maximum.reduceat(by_row, self.first)
        total = highest + np.log(np.add.reduceat(np.exp(by_row - highest[self.owner]), self.first))
        ends = np.r_[self.first[1:], len(by_row)]
        for law, first, end, sum_ in zip(self.laws, self.first, ends, total, strict=True):
            own = by_row[first:end]
            atom = int(own.argmax())
            volume = float(sum_ - own[atom] + law.log_weight[atom])
            sd = float(self.sizes[evidence[:, first + atom].argmax(), first + atom])
            yield Look(law, float(sum_) + law.log_odds, volume, atom, sd, own)


def _tables(patterns: Sequence[Patterns], metric: Metric, first: int) -> list[_Table]:
    """Tables of some patterns, of which the first one has the place ``first``."""
    rows: dict[int, list[tuple[int, Array, list[Law], Array, Array]]] = {}
    for place, one in enumerate(patterns, first):
        raw, white = one.grams(metric)
        for laws, mix in one.sets:
            gram = mixed(white, mix)
            unseen = UNSEEN * np.maximum(np.einsum("aii->ai", mixed(raw, mix)), 0.0)
            rows.setdefault(gram.shape[1], []).append((place, mix, laws, gram, unseen))
    return [_table(parts) for parts in rows.values()]


def _table(parts: Sequence[tuple[int, Array, list[Law], Array, Array]]) -> _Table:
    laws = [law for _, _, own, _, _ in parts for law in own]
    most = max(len(law.sizes.sd) for law in laws)
    count = np.array([law.atoms for law in laws])
    sizes = np.concatenate([np.tile(_padded(law.sizes.sd, most)[:, None], law.atoms) for law in laws], axis=1)
    weight = np.concatenate(
        [_padded(law.sizes.log_weight, most, -np.inf)[:, None] + law.log_weight for law in laws], axis=1
    )
    return _Table(
        [(place, mix) for place, mix, _, _, _ in parts],
        laws,
        np.concatenate([gram for _, _, _, gram, _ in parts]),
        np.concatenate([unseen for _, _, _, _, unseen in parts]),
        sizes,
        weight,
        np.repeat([law.positive for law in laws], count),
        np.r_[0, np.cumsum(count)[:-1]],
        np.repeat(np.arange(len(laws)), count),
    )


def _padded(values: Array, most: int, filler: float | None = None) -> Array:
    """Values padded at the front, so that the largest sizes stay last."""
    before = np.full(most - len(values), values[0] if filler is None else filler)
    return np.concatenate([before, values])


def _mixed_dots(dots: Array, mix: Array, d: int) -> Array:
    """Products ``(rows, d, q)`` of signatures from those of basis rows ``(r, rows, depth, q)``."""
    if len(mix) == 1 and mix.shape[1] == 1 and mix[0, 0] == 1.0:
        return dots[0]
    products = np.tensordot(mix, dots, 1).transpose(1, 0, 2, 3)
    return np.asarray(products.reshape(products.shape[0], d, -1))


def _sized(gram: Array, dot: Array, sd: Array, positive: NDArray[np.bool_], beside: _Beside) -> tuple[Array, Array]:
    """Log evidence ``(rows,)`` for one size of each, with and without its Occam factor."""
    d, s2 = gram.shape[1], beside.scatter
    ridge = s2 / sd**2
    solved, log_det = _solve(gram, ridge, dot)
    most = beside.student((dot * solved).sum(axis=1))
    price = 0.5 * (np.maximum(log_det, d * np.log(ridge)) - d * np.log(ridge))
    if positive.any():
        z = dot[:, 0] / np.sqrt((gram[:, 0, 0] + ridge) * s2)
        most = np.where(positive, most + special.log_ndtr(z) + np.log(2.0), most)
    return most - price, most


def _solve(gram: Array, ridge: Array, dot: Array) -> tuple[Array, Array]:
    """Solutions ``(rows, d)`` and log determinants with a ridge; written out for one and two amplitudes."""
    if gram.shape[1] == 1:
        a = gram[:, 0, 0] + ridge
        return dot / a[:, None], np.log(a)
    if gram.shape[1] == 2:
        a, b, c = gram[:, 0, 0] + ridge, gram[:, 0, 1], gram[:, 1, 1] + ridge
        det = np.maximum(a * c - b**2, ridge**2)
        x, y = (c * dot[:, 0] - b * dot[:, 1]) / det, (a * dot[:, 1] - b * dot[:, 0]) / det
        return np.stack([x, y], axis=1), np.log(det)
    return _cholesky(gram, ridge, dot)


def _cholesky(gram: Array, ridge: Array, dot: Array) -> tuple[Array, Array]:
    """The same by one factorisation of all rows: there are thousands of small matrices."""
    a = np.array(gram.transpose(1, 2, 0), order="C")
    x = np.array(dot.T, order="C")
    log_det = np.zeros(len(gram))
    for j in range(len(a)):
        square = np.maximum(a[j, j] + ridge, ridge)
        log_det += np.log(square)
        a[j, j] = np.sqrt(square)
        a[j + 1 :, j] /= a[j, j]
        x[j] /= a[j, j]
        below = a[j + 1 :, j]
        a[j + 1 :, j + 1 :] -= below[:, None] * below
        x[j + 1 :] -= below * x[j]
    for j in range(len(a) - 1, -1, -1):
        x[j] /= a[j, j]
        x[:j] -= a[j, :j] * x[j]
    return x.T, log_det


class _Kernels:
    """The features ``(m, n)`` of all random functions that matter, kernel after kernel in ``slices``."""

    def __init__(self, smooth: Sequence[Smooth]) -> None:
        self.smooth = smooth
        chosen = [_chosen(features) for one in smooth for features in one.features]
        self.slices = _slices([len(one) for one in chosen])
        self.features = np.concatenate(chosen) if chosen else np.zeros((0, 0))


def _chosen(features: Array) -> Array:
    """The largest features ``(m, n)`` of a kernel, as many as hold nearly all of its variance."""
    size = (features**2).sum(axis=1)
    most = np.argsort(-size)
    seen = np.searchsorted(np.cumsum(size[most]) / size.sum(), SEEN_FEATURES)
    if size.min() < 0.1 * size.max():
        most = most[: min(MOST_FEATURES, 1 + int(seen))]
    return features[most]


class _Features:
    """All random functions' features with one metric, those of a kernel rotated to be orthogonal.

    ``value``, ``white (m, n)``: squared lengths and mapped features, kernel after kernel; ``first``: where each kernel
    begins.
    """

    def __init__(self, kernels: _Kernels, metric: Metric) -> None:
        self.smooth = kernels.smooth
        mapped = metric(kernels.features) if len(kernels.features) else np.zeros((0, 0))
        turned = [_turned(mapped[own]) for own in kernels.slices]
        self.value = np.concatenate([value for value, _ in turned]) if turned else np.zeros(0)
        self.white = np.concatenate([white for _, white in turned]) if turned else np.zeros((0, 0))
        self.slices = _slices([len(value) for value, _ in turned])
        self.first = np.array([own.start for own in self.slices], np.intp)

    def looks(self, beside: _Beside) -> Iterator[Look]:
        """Looks of the random functions, over all kernels and sizes."""
        if not self.smooth:
            return
        sizes, weight = self.smooth[0].sizes.sd, self.smooth[0].sizes.log_weight
        variance = sizes[:, None] ** 2 / beside.scatter
        dot, lost = self.white @ beside.left, self._lost(beside)
        shrunk = variance / (1.0 + variance * self.value)
        price = 0.5 * np.add.reduceat(np.log1p(variance * self.value), self.first, axis=1)
        gain = np.add.reduceat(shrunk * dot**2, self.first, axis=1)
        evidence = beside.student(gain) - price
        if lost.shape[1]:
            for kernel in np.argsort(-evidence.max(axis=0))[:MOST_EXACT]:
                own = self.slices[kernel]
                more, dearer = _beside_terms(shrunk[:, own], dot[own], lost[own])
                evidence[:, kernel] = beside.student(gain[:, kernel] + more) - price[:, kernel] - dearer
        yield from self._summed(evidence.T + weight, sizes)

    def _lost(self, beside: _Beside) -> Array:
        """Products ``(m, q)`` of the features with the loss."""
        if beside.turn is None:
            return self.white @ beside.lost
        for span in beside.spans:
            span.features = self.white @ span.rows.T if span.features is None else span.features
        return np.hstack([span.features for span in beside.spans if span.features is not None]) @ beside.turn

    def _summed(self, evidence: Array, sizes: Array) -> Iterator[Look]:
        first = 0
        for one in self.smooth:
            own = evidence[first : first + one.atoms] - np.log(one.atoms)
            total = float(np.logaddexp.reduce(own, axis=None))
            by_atom = np.logaddexp.reduce(own, axis=1)
            atom = int(by_atom.argmax())
            volume = total - float(by_atom[atom]) - float(np.log(one.atoms))
            yield Look(one, total + one.log_odds, volume, atom, float(sizes[own[atom].argmax()]))
            first += one.atoms


def _slices(counts: Sequence[int]) -> list[slice]:
    ends = np.cumsum([0, *counts]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def _turned(white: Array) -> tuple[Array, Array]:
    """Squared lengths ``(m,)`` and mapped features ``(m, n)`` of a kernel rotated to be orthogonal."""
    value, vector = np.linalg.eigh(white @ white.T)
    keep = value > max(1e-4 * value[-1], 1e-12)
    keep[-1] = True
    return np.maximum(value[keep], 0.0), vector[:, keep].T @ white


def _beside_terms(shrunk: Array, dot: Array, lost: Array) -> tuple[Array, Array]:
    """Change of gain and Occam factor of a kernel by the terms of a hypothesis, ``(t,)`` each."""
    together = shrunk @ (lost * dot[:, None])
    middle = np.eye(lost.shape[1]) - (shrunk[:, None, :] * lost.T) @ lost
    more = (together * np.linalg.solve(middle, together[:, :, None])[:, :, 0]).sum(axis=1)
    return more, 0.5 * np.linalg.slogdet(middle)[1]


class Looks:
    """Looks of all candidates, with a metric for every model of the scatter that hypotheses have."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.patterns = list(grouped([one for one in problem.candidates if isinstance(one, Law)]))
        self.kernels = _Kernels([one for one in problem.candidates if isinstance(one, Smooth)])
        self._lookers: dict[tuple[object, ...], Looker] = {}
        self._looks: dict[tuple[object, ...], tuple[int, list[Look]]] = {}

    def admit(self, laws: Sequence[Law]) -> None:
        """Further laws; what was computed of the others stays."""
        self.patterns += grouped(laws)

    def __call__(self, state: State, scatters: Scatters) -> list[Look]:
        """All candidates for addition to a hypothesis, the best first; computed once."""
        key = (frozenset(term.key for term in state.terms), state.scatter.key)
        known, looks = self._looks.get(key, (0, []))
        looker = self._looker(state, scatters)
        if not looks or known < len(looker.tables):
            looks = sorted([*looks, *looker.looks(state, known)], key=lambda look: -look.gain)
            self._looks[key] = len(looker.tables), looks
        return looks

    def pairs(self, state: State, scatters: Scatters, most: int, without: frozenset[str]) -> list[tuple[Look, Look]]:
        """The most probable pairs of laws of one shape and one amplitude, without those of the given labels."""
        return self._looker(state, scatters).pairs(state, most, without)

    def _looker(self, state: State, scatters: Scatters) -> Looker:
        sigma_um = state.sigma_um if state.scatter.correlated else min(state.sigma_um, self.problem.within_um)
        key = (*state.scatter.alike, round(float(np.log(sigma_um)) / LIKE_SIGMA))
        if key not in self._lookers:
            metric = Metric(self.problem, state.scatter, scatters, sigma_um)
            self._lookers[key] = Looker(self.problem, metric, self.kernels)
        if len(self._lookers[key].patterns) < len(self.patterns):
            self._lookers[key].admit(self.patterns)
        return self._lookers[key]

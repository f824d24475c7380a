"""The log posterior of one hypothesis: log prior plus log marginal likelihood.

Amplitudes and nuisance parameters are integrated exactly (they are linear with normal priors), the scatter sigma by
Laplace's approximation in its logarithm (MacKay, Neural Computation 4, 1992: 415). The sizes of each term are summed at
the most probable sizes of the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import get_lapack_funcs

from stepgauge.diagnosis.posterior.metric import Rows, nuisances
from stepgauge.diagnosis.posterior.priors import Priors
from stepgauge.diagnosis.posterior.problem import Candidate, Law, Problem, Term, slices
from stepgauge.diagnosis.posterior.scatter import Scatter, Scatters

Array = NDArray[np.float64]
POTRF, POTRI, POTRS = get_lapack_funcs(("potrf", "potri", "potrs"), dtype=np.float64)
ROUNDS = 12
FIRST_STEP = 0.05
"""Half the width of the parabolas that find the most probable log sigma."""
BESIDE = np.array([-1.0, 0.0, 1.0])
LEAST_SIGMA = 1e-3
"""Of the scatter over what is stated, where readings are on no steps."""
RESIZED = 8
"""Most changes of a size on the way to the most probable ones."""
FINE = 2.0
"""Ratio of neighbouring measures of what a law moves beside its signature."""
LOG_2 = float(np.log(2.0))
ROUNDING, MORE_ROUNDING = float(np.finfo(float).eps), (0.0, 1.0, 1e2, 1e4)
"""Of products of columns, relative; sums of many are off by more, and differences of large ones."""


@dataclass(frozen=True, eq=False)
class State:
    """A hypothesis: its terms and scatter, and the quantities that follow from them.

    ``log_posterior``: up to a constant of the problem; ``sigma_um``: standard deviation of an ordinary row; ``left_um
    (n,)``: residuals after terms and nuisance parameters; ``mean (k,)``: posterior mean of the amplitudes of ``count``
    nuisance parameters and of the terms, ``prior_sd`` their prior standard deviations, ``factor`` that of their
    precision in units of these; ``square``: sum of squares at the most probable sigma, over its variance, with that of
    the amplitudes over theirs; ``by_size``: of each term, log evidence of its sizes over that of its present one.
    """

    terms: tuple[Term, ...]
    scatter: Scatter
    log_posterior: float
    sigma_um: float
    left_um: Array
    factor: Array
    prior_sd: Array
    mean: Array
    count: int
    square: float
    by_size: tuple[Array, ...] = ()

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance of nuisance parameters and amplitudes at the most probable sigma."""
        return np.asarray(self.prior_sd[:, None] * _inverse(self.factor) * self.prior_sd)

    @property
    def labels(self) -> frozenset[str]:
        """Labels of the terms, without their shapes."""
        return frozenset(term.candidate.label for term in self.terms)

    @property
    def named(self) -> bool:
        """Whether all terms are laws."""
        return all(term.candidate.named for term in self.terms)

    @property
    def log_fit(self) -> float:
        """Log likelihood at the most probable amplitudes and sigma, up to a constant of the scatter."""
        return -len(self.left_um) * float(np.log(self.sigma_um)) - 0.5 * self.square

    @property
    def current(self) -> bool:
        """Whether no term has the volume of correlated scatter where the scatter is independent."""
        return self.scatter.correlated or not any(term.correlated for term in self.terms)

    def place(self, candidate: Candidate) -> int:
        """The place of a candidate among the terms, whose order is that of whoever asked for them first."""
        return next(i for i, term in enumerate(self.terms) if term.candidate is candidate)

    def where(self, term: Term) -> int | None:
        """The place of this very term; None for one that the hypothesis has otherwise or not at all."""
        return next((i for i, own in enumerate(self.terms) if own is term), None)

    def amplitudes(self, place: int) -> tuple[Array, Array]:
        """Posterior mean ``(d,)`` and covariance ``(d, d)`` of the amplitudes of one term that are told."""
        own = self._told(place)
        return self.mean[own], self.covariance[own, own]

    def told_um(self, place: int) -> Array:
        """Mean of what one term moves by its signature, ``(n,)``."""
        term = self.terms[place]
        return np.asarray(self.mean[self._told(place)] @ term.columns[: term.told])

    def beside_um(self, place: int) -> Array:
        """Mean of what one term moves beside its signature, ``(n,)``."""
        first, term = self._told(place).stop, self.terms[place]
        return np.asarray(self.mean[first : first + len(term.beside)] @ term.beside)

    def size(self, place: int) -> float:
        """Length of the mean amplitudes of one term."""
        return float(np.linalg.norm(self.mean[self._told(place)]))

    def _told(self, place: int) -> slice:
        first = self.count + sum(len(term.columns) for term in self.terms[:place])
        return slice(first, first + self.terms[place].told)


@dataclass(frozen=True)
class _Base:
    """Common to all hypotheses with one scatter: rows, mapped residual and nuisance columns, and their products.

    ``turn (k, k)``, ``value (k,)``: eigenvectors and eigenvalues of the products of the nuisance columns in units of
    their prior ``sd``.
    """

    rows: Rows
    raw: Array
    mapped: Array
    gram: Array
    sd: Array
    turn: Array
    value: Array


class Evidence:
    """Log posteriors of hypotheses, each computed once."""

    def __init__(self, problem: Problem, priors: Priors) -> None:
        self.problem, self.scatters = problem, Scatters(problem, priors)
        self.log_scale, self.log_spread = float(np.log(problem.scale_um)), float(np.log(priors.scatter.sigma_factor))
        self.least_um = max(problem.steps_um / np.sqrt(12.0), LEAST_SIGMA * problem.scale_um)
        self.visited: dict[tuple[object, ...], State] = {}
        self._bases: dict[tuple[object, ...], _Base] = {}
        self._columns: dict[tuple[object, ...], Array] = {}
        self._products: dict[tuple[object, ...], Array] = {}
        self._squares: dict[int, Array] = {}

    @property
    def current(self) -> Iterator[State]:
        """All hypotheses that were computed with the volumes that hold for their scatter."""
        return (state for state in self.visited.values() if state.current)

    def __call__(self, terms: tuple[Term, ...], scatter: Scatter, near_um: float | None = None) -> State:
        """The hypothesis of some terms and a scatter; ``near_um``: a first guess of the scatter."""
        key = _key(terms, scatter)
        if key not in self.visited:
            self.visited[key] = self._state(terms, scatter, near_um or self.problem.within_um)
        return self.visited[key]

    def narrowed(self, state: State, candidate: Candidate, by: float) -> State:
        """A hypothesis in place of the same with a volume of one term that is too large, by so many nats."""
        place = state.place(candidate)
        narrow = replace(state.terms[place], log_prior=state.terms[place].log_prior - by)
        terms = (*state.terms[:place], narrow, *state.terms[place + 1 :])
        self.visited.pop(_key(state.terms, state.scatter), None)
        return self.visited.setdefault(
            _key(terms, state.scatter), replace(state, terms=terms, log_posterior=state.log_posterior - by)
        )

    def _base(self, scatter: Scatter) -> _Base:
        if scatter.key not in self._bases:
            rows = Rows(self.problem, scatter, self.scatters)
            columns, sd = nuisances(self.problem, scatter)
            raw = np.vstack([self.problem.um, columns])
            mapped = rows(raw)
            gram = mapped @ mapped.T
            value, turn = np.linalg.eigh(sd[:, None] * gram[1:, 1:] * sd)
            self._bases[scatter.key] = _Base(rows, columns, mapped, gram, sd, turn, np.maximum(value, 0.0))
        return self._bases[scatter.key]

    def _mapped(self, term: Term, scatter: Scatter, base: _Base) -> Array:
        key = (term.key, scatter.key)
        if key not in self._columns:
            self._columns[key] = base.rows(term.columns)
        return self._columns[key]

    def _gram(self, terms: tuple[Term, ...], scatter: Scatter, base: _Base) -> Array:
        """Products of the residual and all columns; those of two terms are computed once."""
        first, *own = slices([len(base.gram), *(len(term.columns) for term in terms)])
        size = own[-1].stop if own else first.stop
        gram = np.empty((size, size))
        gram[first, first] = base.gram
        for i, (one, term) in enumerate(zip(own, terms, strict=True)):
            beside = self._product(term, None, scatter, base)
            gram[first, one], gram[one, first] = beside, beside.T
            for other, another in zip(own[: i + 1], terms, strict=False):
                product = self._product(term, another, scatter, base)
                gram[one, other], gram[other, one] = product, product.T
        return gram

    def _product(self, term: Term, other: Term | None, scatter: Scatter, base: _Base) -> Array:
        """Products ``(d, e)`` of a term's columns with another's; ``(k, d)`` with residual and nuisance columns."""
        key = (term.key, None if other is None else other.key, scatter.key)
        if key not in self._products:
            mapped = self._mapped(term, scatter, base)
            beside = base.mapped @ mapped.T if other is None else mapped @ self._mapped(other, scatter, base).T
            self._products[key] = beside
        return self._products[key]

    def _state(self, terms: tuple[Term, ...], scatter: Scatter, near_um: float) -> State:
        """The hypothesis with the most probable size of every term, and all sizes summed.

        One size is changed at a time: of two laws alike that are large together one is enough. What a law moves beside
        its signature is in proportion to the amplitude that it has, and not to a larger one that it might have had.
        """
        state = self._of_sizes(terms, scatter, near_um)
        for _ in range(RESIZED):
            term = _resized(state) or _in_proportion(state)
            if term is None:
                break
            terms = tuple(term if one.candidate is term.candidate else one for one in state.terms)
            state = self._of_sizes(terms, scatter, state.sigma_um)
        summed = sum(float(np.logaddexp.reduce(one)) for one in state.by_size)
        state = self._with_signs(replace(state, log_posterior=state.log_posterior + summed))
        return state if np.isfinite(state.log_posterior) else replace(state, log_posterior=-np.inf)

    def _of_sizes(self, terms: tuple[Term, ...], scatter: Scatter, near_um: float) -> State:
        """The hypothesis with the sizes that its terms have; their prior is that of their sizes summed."""
        base = self._base(scatter)
        gram = self._gram(terms, scatter, base)
        sd = np.concatenate([base.sd, *(term.sds for term in terms)])
        likelihood = _Likelihood(gram, sd, base, len(self.problem), self.log_scale, self.log_spread, self.least_um)
        log_evidence, log_sigma = likelihood.integrated(near_um)
        factor, amplitudes = likelihood.solved(log_sigma)
        mean, first = sd * amplitudes, len(base.sd)
        left_um = self.problem.um - mean[:first] @ base.raw
        for term in terms:
            left_um -= mean[first : (first := first + len(term.columns))] @ term.columns
        log_posterior = log_evidence + base.rows.log_determinant + scatter.log_prior
        log_posterior += sum(term.log_prior for term in terms)
        sigma_um, square = float(np.exp(log_sigma)), likelihood.square(amplitudes, log_sigma)
        state = State(terms, scatter, log_posterior, sigma_um, left_um, factor, sd, mean, len(base.sd), square)
        try:
            return replace(state, by_size=tuple(_by_size(state)))
        except np.linalg.LinAlgError:  # no number is left of amplitudes beyond all rounding: nobody chooses this
            weights = tuple(term.candidate.sizes.log_weight for term in terms)
            return replace(state, log_posterior=-np.inf, by_size=weights)

    def _with_signs(self, state: State) -> State:
        """The state with half-normal priors of amplitudes that cannot be negative: twice the part above zero."""
        gain = 0.0
        for place, term in enumerate(state.terms):
            if isinstance(term.candidate, Law) and term.candidate.positive:
                mean, covariance = state.amplitudes(place)
                gain += LOG_2 + float(special.log_ndtr(mean[0] / np.sqrt(covariance[0, 0])))
        return replace(state, log_posterior=state.log_posterior + gain) if gain else state

    def most_without(self, state: State, place: int) -> float:
        """What the log posterior of a hypothesis cannot exceed without one of its terms that it needs.

        The others may have any of their sizes: they explain most with the largest ones, and their Occam factors are at
        most one. For the same sigma the sum of squares rises as the density of the amplitudes falls to zero (Dickey,
        Annals of Mathematical Statistics 42, 1971: 204). For a larger sigma the sum of squares falls at most with its
        square, and the determinant rises at least with as many powers as there are rows beyond columns.
        """
        term, dof = state.terms[place], len(self.problem) - len(state.mean)
        if dof <= 0 or any(isinstance(one.candidate, Law) and one.candidate.positive for one in state.terms):
            return np.inf
        more = _square_without(state, place)
        if more <= dof:
            return np.inf
        occam = -float(np.log(np.diag(state.factor)[state.count :]).sum())
        best = 0.5 * (state.square - dof) - 0.5 * dof * float(np.log(more / dof))
        stated = 0.5 * ((float(np.log(state.sigma_um)) - self.log_scale) / self.log_spread) ** 2
        prior = term.log_prior + sum(float(np.logaddexp.reduce(one)) for one in state.by_size)
        return state.log_posterior - prior - occam + best + stated

    def squares(self, state: State) -> Array:
        """Expected squared residual of each row over its variance, given the other rows, ``(n,)``; computed once."""
        if id(state) not in self._squares:
            self._squares[id(state)] = self._expected_squares(state)
        return self._squares[id(state)]

    def _expected_squares(self, state: State) -> Array:
        base = self._base(state.scatter)
        columns = np.vstack([base.raw, *(term.columns for term in state.terms)])
        own = np.einsum("kn,kn->n", columns, state.covariance @ columns)
        rows, variance = base.rows, self.scatters.ordinary(state.scatter) * state.sigma_um**2
        if not rows.correlated:
            return cast(Array, (state.left_um**2 + own) / variance)
        conditional = rows.adjoint(rows(state.left_um)[:, None])[:, 0] / rows.precision
        return cast(Array, (conditional**2 + own) * rows.precision / rows.scale**2 / variance)


def _key(terms: tuple[Term, ...], scatter: Scatter) -> tuple[object, ...]:
    return frozenset(term.key for term in terms), scatter.key


class _Likelihood:
    """Log marginal likelihood over the logarithm of sigma, from products of the residual and all columns.

    For a given sigma: -n log sigma - log det(A) / 2 - quad / 2 with A = I + G / sigma2, G the columns' products in
    units of their prior sd. The nuisance columns come first in A; along their eigenvectors their part is diagonal, and
    what is left beside them is as small as the terms are few.
    """

    def __init__(
        self, gram: Array, sd: Array, base: _Base, n: int, log_scale: float, log_spread: float, least_um: float
    ) -> None:
        self.yy, self.b, self.g = float(gram[0, 0]), sd * gram[1:, 0], sd[:, None] * gram[1:, 1:] * sd
        self.n, self.log_scale, self.log_spread, self.lowest = n, log_scale, log_spread, float(np.log(least_um))
        self.rounding = ROUNDING * len(self.g) * float(self.g.diagonal().max(initial=0.0))
        count, self.value = len(base.value), base.value
        self.own, self.own_b = self.g[count:, count:], self.b[count:]
        self.beside, self.turned_b = base.turn.T @ self.g[:count, count:], base.turn.T @ self.b[:count]

    def __call__(self, log_sigma: Array) -> Array:
        """Logarithm of the likelihood times the prior of sigma, amplitudes integrated, for some sigmas ``(s,)``."""
        s2 = np.exp(2.0 * log_sigma)
        share = 1.0 / (s2[:, None] + self.value)
        explained, log_det = s2 * (share @ self.turned_b**2), np.log1p(self.value / s2[:, None]).sum(axis=1)
        if len(self.own_b):
            left = self.own_b - (share * self.turned_b) @ self.beside
            schur = self.own - self.beside.T @ (share[:, :, None] * self.beside)
            for i, (dot, matrix) in enumerate(zip(left, schur, strict=True)):
                factor = _factor(matrix / s2[i], self.rounding / float(s2[i]))
                explained[i] += dot @ POTRS(factor, dot, lower=1)[0]
                log_det[i] += 2.0 * np.log(np.diag(factor)).sum()
        quad = np.maximum((self.yy - explained / s2) / s2, 0.0)
        prior = -0.5 * ((log_sigma - self.log_scale) / self.log_spread) ** 2
        return np.asarray(-self.n * log_sigma - 0.5 * log_det - 0.5 * quad + prior)

    def solved(self, log_sigma: float) -> tuple[Array, Array]:
        """Cholesky factor of A, and amplitudes in units of their prior sd."""
        s2 = float(np.exp(2.0 * log_sigma))
        factor = _factor(self.g / s2, self.rounding / s2)
        return factor, POTRS(factor, self.b / s2, lower=1)[0]

    def square(self, amplitudes: Array, log_sigma: float) -> float:
        """Least sum of squares over the variance, with that of the amplitudes in units of their prior sd."""
        return (self.yy - float(self.b @ amplitudes)) * float(np.exp(-2.0 * log_sigma))

    def integrated(self, near_um: float) -> tuple[float, float]:
        """Logarithm of the integral over log sigma, and the most probable value, by repeated parabolas."""
        lowest, step = self.lowest, FIRST_STEP
        at = max(float(np.log(near_um)), lowest)
        for _ in range(ROUNDS):
            low, here, high = map(float, self(at + step * BESIDE))
            bend = low - 2.0 * here + high
            move = 0.5 * step * (low - high) / bend if bend < 0.0 else float(np.sign(high - low))
            curvature = max(-bend / step**2, 1.0)
            if bend < 0.0 and abs(move) < step:
                at = max(at + move, lowest)
                return float(self(np.array([at]))[0]) - 0.5 * float(np.log(curvature)), at
            at = max(at + float(np.clip(move, -2.0, 2.0)), lowest)
        return here - 0.5 * float(np.log(curvature)), at


def _slices(terms: tuple[Term, ...]) -> list[slice]:
    return slices(len(term.columns) for term in terms)


def _amplitudes(state: State) -> tuple[Array, Array]:
    """Posterior mean and covariance of the amplitudes of all terms: the last corner of the precision's factor."""
    count, sd = state.count, state.prior_sd[state.count :]
    return state.mean[count:], sd[:, None] * _inverse(state.factor[count:, count:].copy()) * sd


def _square_without(state: State, place: int) -> float:
    """Least sum of squares over the variance without a term, if all other terms have their largest sizes."""
    mean, narrow = state.mean[state.count :], state.prior_sd[state.count :]
    own = _slices(state.terms)[place]
    narrowest = [0.0 if i == place else float(t.candidate.sizes.sd.max()) for i, t in enumerate(state.terms)]
    sd = np.concatenate([np.maximum(t.sds, least) for t, least in zip(state.terms, narrowest, strict=True)])
    root = np.tril(state.factor[state.count :, state.count :]) / narrow[:, None]
    precision = root @ root.T
    product = precision @ mean
    wide = np.linalg.inv(precision + np.diag(sd**-2.0 - narrow**-2.0))
    amplitudes = (wide @ product)[own]
    square = state.square + float(product @ (mean - wide @ product))
    return square + float(amplitudes @ np.linalg.solve(wide[own, own], amplitudes))


def _by_size(state: State) -> Iterator[Array]:
    """Log evidence of each size of each term, its weight included, over that of the size that the term has.

    Of its amplitudes the likelihood is normal: their posterior without their prior.
    """
    if not state.terms:
        return
    every, covariance = _amplitudes(state)
    for term, whole in zip(state.terms, _slices(state.terms), strict=True):
        own = slice(whole.start, whole.start + term.told)
        mean, sizes = every[own], term.candidate.sizes
        if len(sizes.sd) == 1 and sizes.sd[0] == term.sd:
            yield sizes.log_weight
            continue
        value, turn = _axes(covariance[own, own])
        precision = np.maximum(1.0 / np.maximum(value, 1e-300) - term.sd**-2.0, 0.0)
        product = turn.T @ mean / np.maximum(value, 1e-300)
        s2 = np.r_[sizes.sd, term.sd][:, None] ** 2
        evidence = 0.5 * (product**2 / (precision + 1.0 / s2) - np.log1p(precision * s2)).sum(axis=1)
        yield evidence[:-1] - evidence[-1] + sizes.log_weight


def _axes(covariance: Array) -> tuple[Array, Array]:
    """Eigenvalues and eigenvectors; most terms have one amplitude."""
    return (covariance[0], np.ones((1, 1))) if len(covariance) == 1 else np.linalg.eigh(covariance)


def _resized(state: State) -> Term | None:
    """The term that gains most by another size, with that size; None if all have their most probable ones."""
    found, most = None, 0.0
    for term, evidence in zip(state.terms, state.by_size, strict=True):
        sd = term.candidate.sizes.sd
        best = int(evidence.argmax())
        present = np.flatnonzero(sd == term.sd)
        gain = float(evidence[best] - evidence[present[0]]) if present.size else np.inf
        if gain > most:
            found, most = replace(term, sd=float(sd[best])), gain
    return found


def _in_proportion(state: State) -> Term | None:
    """A term that moves beside its signature by another measure than that of its amplitude, with that one; or None."""
    for place, term in enumerate(state.terms):
        if len(term.beside):
            near = FINE ** round(math.log(max(state.size(place), 1e-300), FINE))
            if near != term.beside_sd:
                return replace(term, beside_sd=near)
    return None


def _factor(matrix: Array, rounding: float) -> Array:
    """The lower Cholesky factor of one plus a matrix, which is overwritten.

    Products of columns are positive but for their ``rounding``. It shows beside a scatter that is next to nothing, as
    of readings on the steps of a display, and is then allowed for.
    """
    diagonal = matrix.flat[:: len(matrix) + 1]
    for times in MORE_ROUNDING:
        matrix.flat[:: len(matrix) + 1] = diagonal + (1.0 + times * rounding)
        factor, failed = POTRF(matrix, lower=1)
        if not failed:
            return np.asarray(factor)
    raise np.linalg.LinAlgError("the columns' products are not positive")


def _inverse(factor: Array) -> Array:
    """The inverse of a matrix from its lower Cholesky factor."""
    lower = POTRI(factor, lower=1)[0]
    return np.tril(lower) + np.tril(lower, -1).T

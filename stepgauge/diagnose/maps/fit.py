"""Changes of a probe fitted to a map by weighted least squares.

Where directions were probed more than once the scatter is known. Elsewhere what scatters is the rounding of the printed
digits, which is known, and a rest, which is not: variance = quantum^2 / 12 + (s w)^2 with one s per quantity, by
maximum likelihood. ``w`` is 1, or the size of the value where the rest grows with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from stepgauge.diagnose.maps.candidates import Candidate, Knob
from stepgauge.diagnose.maps.model import MapModel, Term, Terms
from stepgauge.diagnose.maps.noise import MapNoise, sizes
from stepgauge.errors import InputError

Array = NDArray[np.float64]
STEP = 1e-4
"""Share of a knob's typical departure by which it is moved to find the slope."""
FAR = 1e8
"""Whitened residual of a construction that cannot be."""
STEPS = 25
FIRST_STEPS = 4
"""Steps from each of several starts before only the best goes on."""
TRIALS = 8
"""Steps tried, each shorter than the last, before a fit counts as found."""
ENOUGH = 1e-4
"""Gain in chi-square, for a variance of what is left, that is worth another step: a hundredth of an uncertainty."""
MOST_STARTS = 3
"""Starts, the best ones, from which a change is searched."""


@dataclass(frozen=True)
class Fitted:
    """Terms with fitted values.

    ``sigma``: standard deviation (n,) of each quantity's rows; ``whitened (m,)``: all residuals over their sigma;
    ``jacobian (m, k)``: slopes of the whitened residuals in units of the knobs' typical departures; ``deviance``:
    -2 ln likelihood; ``rest``: the part of the scatter of each quantity beyond the rounding. ``between``: sum of
    squares of the means over the repeats of a direction, and how many directions there are in all quantities.
    """

    terms: Terms
    sigma: tuple[Array, ...]
    whitened: Array
    jacobian: Array
    deviance: float
    rest: tuple[float, ...]
    between: tuple[float, int]

    @property
    def rss(self) -> float:
        return float(self.whitened @ self.whitened)

    @property
    def size(self) -> int:
        return int(self.jacobian.shape[1])

    @property
    def dof(self) -> int:
        return len(self.whitened) - self.size

    @property
    def variance(self) -> tuple[float, int]:
        """Of the whitened residuals, at least 1, and its degrees of freedom.

        Where directions differ by more than their repeats do, repeats are not independent of each other, and the
        directions count, not the rows.
        """
        return larger_variance(self.rss, self.dof, self.between[0], self.between[1] - self.size)

    @property
    def bic(self) -> float:
        return self.deviance + self.size * float(np.log(len(self.whitened)))


class Fitter:
    """Fits terms to the rows of a map; ``rows`` leaves out held-out groups."""

    def __init__(self, model: MapModel, noise: MapNoise, rows: NDArray[np.bool_] | None = None) -> None:
        self.model, self.noise = model, noise
        self.rows = np.ones(len(model.data), bool) if rows is None else rows
        self._direction = model.data.direction[self.rows]
        self._sizes = [sizes(m, noise.scatter) for m in model.data.measured]
        self._found: dict[frozenset[Candidate], Fitted] = {}

    def fit(self, candidates: Sequence[Candidate], start: Sequence[Term] = ()) -> Fitted:
        """Least squares from the probe's own values, or from those of ``start``, sigma and values in turn.

        The same candidates are not fitted twice.
        """
        key = frozenset(candidates)
        if key not in self._found:
            self._found[key] = self._fit(candidates, start)
        return self._found[key]

    def _fit(self, candidates: Sequence[Candidate], start: Sequence[Term]) -> Fitted:
        begun = {term.candidate: term.values for term in start}
        terms = tuple(Term(c, begun.get(c, c.starts[0])) for c in candidates)
        rest = self._rest(terms)
        begins = self._best_starts(terms, set(begun), rest)
        if len(begins) > 1:
            begins = [self._solve(each, rest, FIRST_STEPS) for each in begins]
        terms = self._solve(min(begins, key=lambda each: self.left(each, rest)), rest)
        rest = self._rest(terms)
        if terms and self.noise.sigma is None:
            terms = self._solve(terms, rest)
            rest = self._rest(terms)
        return self.at(terms, rest)

    def refit(self, fitted: Fitted) -> Terms:
        """The terms of another fit, solved for these rows with its scatter."""
        return self._solve(fitted.terms, fitted.rest)

    def at(self, terms: Terms, rest: Sequence[float]) -> Fitted:
        """The fit as it stands at these values."""
        sigma = self._sigma(rest)
        white = self._white(terms, sigma)
        deviance = float(white @ white) + 2.0 * float(sum(np.log(s[self.rows]).sum() for s in sigma))
        between = between_directions(white, self._direction, len(sigma))
        slopes = self._slopes(terms, sigma, white)
        return Fitted(terms, tuple(sigma), white, slopes, deviance, tuple(rest), between)

    def left(self, terms: Terms, rest: Sequence[float]) -> float:
        """Sum of the squares of the whitened residuals."""
        return float((self._white(terms, self._sigma(rest)) ** 2).sum())

    def _best_starts(self, terms: Terms, begun: set[Candidate], rest: Sequence[float]) -> list[Terms]:
        """From where to search: a new term at the starts that leave least, the last of several at its best few.

        The force has kinks where another contact opens first, where a search over the phase may hang, and levels where
        a friction that is too large changes nothing any more.
        """
        found = [terms]
        for place, term in enumerate(terms):
            if term.candidate not in begun and len(term.candidate.starts) > 1:
                tried = [_replaced(found[0], place, Term(term.candidate, s)) for s in term.candidate.starts]
                tried.sort(key=lambda each: self.left(each, rest))
                found = tried[:MOST_STARTS]
        return found

    def _solve(self, terms: Terms, rest: Sequence[float], steps: int = STEPS) -> Terms:
        """Levenberg and Marquardt's way down, within the bounds."""
        if not terms:
            return terms
        sigma, knobs = self._sigma(rest), _knobs(terms)
        scale = np.array([k.typical for k in knobs])
        low, high = (np.array([getattr(k, end) for k in knobs]) / scale for end in ("low", "high"))
        x = np.clip(_values(terms) / scale, low, high)
        white = self._white(_with_values(terms, x * scale), sigma)
        damping = 1e-4
        for _ in range(steps):
            slopes = self._slopes(_with_values(terms, x * scale), sigma, white)
            before = float(white @ white)
            worth = ENOUGH * before / max(len(white) - len(knobs), 1)
            for _ in range(TRIALS):
                moved = np.clip(x + _step(slopes, white, damping), low, high)
                if before - _square(white + slopes @ (moved - x)) < worth:
                    return _with_values(terms, x * scale)
                tried = self._white(_with_values(terms, moved * scale), sigma)
                if _square(tried) < before:
                    break
                damping *= 10.0
            else:
                break
            x, white, damping = moved, tried, damping / 30.0
        return _with_values(terms, x * scale)

    def _white(self, terms: Terms, sigma: Sequence[Array]) -> Array:
        try:
            residuals = self.model.residuals(terms)
        except InputError:
            return np.full(int(self.rows.sum()) * len(sigma), FAR)
        white = np.concatenate([(r / s)[self.rows] for r, s in zip(residuals, sigma, strict=True)])
        return np.where(np.isfinite(white), np.clip(white, -FAR, FAR), FAR)

    def _slopes(self, terms: Terms, sigma: Sequence[Array], here: Array) -> Array:
        """Slopes by one-sided differences, away from the nearer bound."""
        columns, values = [], _values(terms)
        for place, knob in enumerate(_knobs(terms)):
            step = STEP * knob.typical * (1.0 if values[place] + knob.typical < knob.high else -1.0)
            moved = values.copy()
            moved[place] += step
            moved_white = self._white(_with_values(terms, moved), sigma)
            columns.append((moved_white - here) * (knob.typical / step))
        return np.array(columns).T if columns else np.zeros((len(here), 0))

    def _sigma(self, rest: Sequence[float]) -> list[Array]:
        measured = self.model.data.measured
        return [np.hypot(m.rounding, r * w) for m, r, w in zip(measured, rest, self._sizes, strict=True)]

    def _rest(self, terms: Terms) -> tuple[float, ...]:
        """Scatter of each quantity beyond the rounding: that of the repeats, or the likeliest."""
        parts = zip(self.model.data.measured, self._sizes, strict=True)
        if self.noise.sigma is not None:
            known = zip(self.noise.sigma, parts, strict=True)
            return tuple(_beyond(sigma, m.rounding / float(np.median(w))) for sigma, (m, w) in known)
        try:
            residuals = self.model.residuals(terms)
        except InputError:
            residuals = self.model.residuals(())
        return tuple(
            likeliest(r[self.rows], m.rounding, w[self.rows]) for r, (m, w) in zip(residuals, parts, strict=True)
        )


def uncertainties(fitted: Fitted) -> Array:
    """Covariance (k, k) of the knobs' values; NaN where the map says nothing of them."""
    scale = np.array([k.typical for k in _knobs(fitted.terms)])
    gram = fitted.jacobian.T @ fitted.jacobian
    if fitted.size == 0 or np.linalg.matrix_rank(gram, tol=1e-12 * max(float(np.trace(gram)), 1e-300)) < fitted.size:
        return np.full((fitted.size, fitted.size), np.nan)
    variance, _ = fitted.variance
    return np.asarray(np.linalg.inv(gram) * variance * np.outer(scale, scale), dtype=np.float64)


def between_directions(whitened: Array, direction: NDArray[np.intp], quantities: int) -> tuple[float, int]:
    """Sum of squares of the means over repeats, each times their number, and how many means there are.

    ``whitened (quantities * n,)``: one quantity behind the other; ``direction (n,)``: index of the direction.
    """
    count = np.maximum(np.bincount(direction), 1)
    sums = [np.bincount(direction, part) for part in whitened.reshape(quantities, -1)]
    return float(sum((each**2 / count).sum() for each in sums)), int((np.bincount(direction) > 0).sum()) * quantities


def larger_variance(rss: float, dof: int, between: float, between_dof: int) -> tuple[float, int]:
    """Mean square of all residuals or of the means over repeats, the larger one but at least 1, and its degrees."""
    pooled = rss / max(dof, 1)
    of_means = between / between_dof if between_dof > 0 else 0.0
    return (max(of_means, 1.0), between_dof) if of_means > pooled else (max(pooled, 1.0), dof)


def likeliest(residual: Array, rounding: float, size: Array) -> float:
    """The s that makes residuals of variance rounding^2 + (s size)^2 likeliest."""
    typical = float(np.sqrt(np.mean((residual / size) ** 2)))
    if typical <= 0.0:
        return 0.0 if rounding > 0.0 else 1e-12
    if rounding == 0.0:
        return typical

    def deviance(log_s: float) -> float:
        variance = rounding**2 + (np.exp(log_s) * size) ** 2
        return float((residual**2 / variance + np.log(variance)).sum())

    found = minimize_scalar(deviance, bounds=(np.log(typical) - 8.0, np.log(typical) + 1.0), method="bounded")
    return float(np.exp(found.x)) if found.fun < deviance(-np.inf) else 0.0


def _beyond(sigma: float, rounding: float) -> float:
    return float(np.sqrt(max(sigma**2 - rounding**2, 0.0)))


def _square(white: Array) -> float:
    return float(white @ white)


def _step(slopes: Array, white: Array, damping: float) -> Array:
    gram = slopes.T @ slopes
    stiff = np.diag(gram) + 1e-12 * float(np.trace(gram)) + 1e-9
    return np.asarray(-np.linalg.solve(gram + damping * np.diag(stiff), slopes.T @ white), float)


def _knobs(terms: Terms) -> list[Knob]:
    return [knob for term in terms for knob in term.candidate.knobs]


def _values(terms: Terms) -> Array:
    return np.array([value for term in terms for value in term.values], float)


def _with_values(terms: Terms, values: Array) -> Terms:
    cuts = np.cumsum([len(term.values) for term in terms])[:-1]
    parts = np.split(np.asarray(values, float), cuts)
    return tuple(Term(t.candidate, tuple(map(float, p))) for t, p in zip(terms, parts, strict=True))


def _replaced(terms: Terms, place: int, term: Term) -> Terms:
    return (*terms[:place], term, *terms[place + 1 :])

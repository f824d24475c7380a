"""What is nothing wrong: errors within a certificate, small errors of every machine, scatter from visit to visit.

All of it is normal with mean zero. Variances that are stated (a certificate's) are taken; the others are estimated over
the fleet (empirical Bayes), so that machines without much data are judged by all machines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse

from stepgauge.files.arrays import Array

LEAST = 1e-4
"""Least standard deviation of an estimated term, in the unit of the observations."""
ROUNDS = 4
"""Fixed-point iterations of the variances for a given set of causes; each begins where the last one ended."""
CHUNK = 2048


@dataclass
class RandomEffect:
    """Independent coefficients with one standard deviation: ``columns (n, q)`` sparse; ``known``: it is stated.

    ``least``: a standard deviation that is not estimated away, since no fleet is large enough to know it is zero;
    ``pool``: terms of one pool have one standard deviation until the pools are opened.
    """

    name: str
    columns: sparse.csc_matrix
    sd: float | Array
    known: bool = False
    least: float = LEAST
    pool: str = ""


class Background:
    """The covariance V = D + Z G Z' of observations ``(n,)``, and what it makes of vectors and columns.

    Parameters
    ----------
    variance : of the observations themselves, from repeats ``(n,)``
    terms : the coefficients' columns and standard deviations
    scatter : standard deviation from visit to visit, a first value

    ``ends``: where the coefficients of each term begin and end among all of them.
    """

    def __init__(self, variance: Array, terms: Sequence[RandomEffect], scatter: float) -> None:
        self.variance, self.scatter, self.pooled = variance, scatter, True
        self.terms = [term for term in terms if term.columns.nnz]
        n = len(variance)
        blocks = [term.columns for term in self.terms]
        self.columns = sparse.hstack(blocks, format="csc") if blocks else sparse.csc_matrix((n, 0))
        self.rows = self.columns.tocsr()
        self.ends = np.cumsum([0, *(term.columns.shape[1] for term in self.terms)])
        self.factor()

    def factor(self) -> None:
        """Bring everything up to date with the standard deviations."""
        self.weight = 1.0 / (self.variance + self.scatter**2)
        weighted = self.columns.multiply(self.weight[:, None]).tocsc()
        self.weighted = weighted
        precision = (self.columns.T @ weighted).toarray()
        self.prior = np.concatenate([np.full(t.columns.shape[1], 1.0) * t.sd for t in self.terms] or [np.zeros(0)])
        precision[np.diag_indices(len(precision))] += 1.0 / self.prior**2
        factor = linalg.cholesky(precision, lower=True, check_finite=False) if len(precision) else precision
        self.log_det = 2.0 * float(np.log(np.diag(factor)).sum()) if len(precision) else 0.0
        self.log_det += float(2.0 * np.log(self.prior).sum() - np.log(self.weight).sum())
        self.inverse = _inverse(factor)

    def solve(self, um: Array) -> Array:
        """V^-1 times a vector."""
        return np.asarray(self.weight * um - self.weighted @ (self.inverse @ (self.weighted.T @ um)))

    def expected(self, term: RandomEffect, um: Array) -> Array:
        """What a term is in every observation, given observations ``(n,)``: the mean of its posterior."""
        place = next(i for i, one in enumerate(self.terms) if one is term)
        own = slice(self.ends[place], self.ends[place + 1])
        return np.asarray(term.columns @ (self.inverse[own] @ (self.weighted.T @ um)))

    def log_likelihood(self, um: Array) -> float:
        """Logarithm of the density of observations, without a constant."""
        return -0.5 * float(self.log_det + um @ self.solve(um))

    def power(self, columns: sparse.csc_matrix) -> Array:
        """x' V^-1 x of every column ``(n, j)``, shape ``(j,)``."""
        found = np.empty(columns.shape[1])
        for low in range(0, columns.shape[1], CHUNK):
            some = columns[:, low : low + CHUNK]
            own = np.asarray(some.multiply(some).multiply(self.weight[:, None]).sum(axis=0)).ravel()
            seen = (self.weighted.T @ some).tocsr()
            used = np.flatnonzero(np.diff(seen.indptr))
            part = seen[used].toarray()
            found[low : low + CHUNK] = own - np.einsum("ij,ij->j", part, self.inverse[np.ix_(used, used)] @ part)
        return np.maximum(found, 0.0)

    def estimate(self, um: Array, rounds: int = ROUNDS) -> None:
        """The standard deviations that are not stated, and the scatter, from what the causes leave.

        Fixed point of restricted likelihood: squares over effective numbers (MacKay, Neural Computation 4 (1992) 415).
        """
        for _ in range(rounds):
            at = self.inverse @ (self.weighted.T @ um)
            left = um - self.columns @ at
            known = np.diag(self.inverse) / self.prior**2
            self._update_terms(at, known)
            self._update_scatter(left)
            self.factor()

    def _update_terms(self, at: Array, known: Array) -> None:
        squares, numbers = dict[str, float](), dict[str, float]()
        keys = [term.pool if self.pooled and term.pool else term.name for term in self.terms]
        for key, low, high in zip(keys, self.ends[:-1], self.ends[1:], strict=True):
            squares[key] = squares.get(key, 0.0) + float((at[low:high] ** 2).sum())
            numbers[key] = numbers.get(key, 0.0) + float((1.0 - known[low:high]).sum())
        for key, term in zip(keys, self.terms, strict=True):
            if not term.known:
                term.sd = max(float(np.sqrt(squares[key] / max(numbers[key], 1e-6))), term.least)

    def _update_scatter(self, left: Array) -> None:
        free = np.maximum(1.0 - self._leverage(), 0.0)
        ratio = float((left**2 * self.weight**2).sum()) / max(float((free * self.weight).sum()), 1e-12)
        self.scatter = max(self.scatter * float(np.sqrt(ratio)), LEAST)

    def _leverage(self) -> Array:
        """Share of every observation that the terms fit."""
        most = np.diff(self.rows.indptr).max(initial=0)
        place, value = np.zeros((len(self.weight), most), np.intp), np.zeros((len(self.weight), most))
        slot = np.arange(self.rows.nnz) - np.repeat(self.rows.indptr[:-1], np.diff(self.rows.indptr))
        row = np.repeat(np.arange(len(self.weight)), np.diff(self.rows.indptr))
        place[row, slot], value[row, slot] = self.rows.indices, self.rows.data
        if not most:
            return np.zeros(len(self.weight))
        cross = self.inverse[place[:, :, None], place[:, None, :]]
        return np.asarray(self.weight * np.einsum("ni,nij,nj->n", value, cross, value))


def _inverse(factor: Array) -> Array:
    """From a lower Cholesky factor to the inverse of its matrix."""
    if not len(factor):
        return factor
    lower = linalg.lapack.dpotri(factor, lower=True)[0]
    return np.asarray(np.tril(lower) + np.tril(lower, -1).T)

"""Signatures of many families at once: patterns of the probings, and the shares in which they show on each row.

Families often differ only in the share of each row: a motion along x, along y or anywhere between, a form on the fronts
or on the backs. A pattern is kept once, and everything that a search asks of it (its products with a residual, with a
model, with itself and its neighbour) is computed for some of the shares, of which all others are mixtures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.library import Family
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
CHUNK = 200_000
"""Numbers worked on at a time: they stay in a processor's cache."""
DEPENDENT = 1e-9


class Patterns:
    """Patterns of the same depth that show in the same sets of shares.

    ``values (atoms, depth, n)``, single precision: where a search points to is computed again in double. ``sets``: the
    families by their shares, each with the shares as mixtures ``(k, r)`` of the rows of ``basis (r, n)``.
    """

    def __init__(self, families: Sequence[Family]) -> None:
        patterns = {id(family.pattern): family.pattern for family in families}
        shares = {id(family.shares): family.share_rows for family in families}
        self.values = _single(list(patterns.values()))
        self.atoms, self.depth, self.n = self.values.shape
        self.basis = _basis(np.concatenate(list(shares.values())))
        place = {key: i for i, key in enumerate(patterns)}
        members = sorted(families, key=lambda family: place[id(family.pattern)])
        self.sets = [
            ([family for family in members if id(family.shares) == key], _mixture(rows, self.basis))
            for key, rows in shares.items()
        ]

    def dots(self, vectors: Array, rows: slice = slice(None)) -> Array:
        """Products of some atoms with vectors ``(n, q)`` for every row of the basis, ``(r, atoms, depth, q)``."""
        r, q = len(self.basis), vectors.shape[1]
        weighted = (self.basis.T[:, :, None] * vectors[:, None]).reshape(self.n, r * q).astype(np.float32)
        products = self.values[rows].reshape(-1, self.n) @ weighted
        return products.reshape(-1, self.depth, r, q).transpose(2, 0, 1, 3).astype(float)

    def grams(self, whitening: Whitening) -> tuple[Array, Array, Array]:
        """Products of each atom with itself, not whitened and whitened, and with the next atom, whitened.

        Shapes ``(atoms, r, depth, r, depth)``, the last for one atom less.
        """
        take, against = whitening.squared
        size = max(1, CHUNK // (len(self.basis) * self.depth * self.n))
        weighted = self.basis * whitening.inverse_sigma
        parts = [self._grams(slice(i, i + size + 1), size, weighted, take, against) for i in range(0, self.atoms, size)]
        shape = (-1, len(self.basis), self.depth, len(self.basis), self.depth)
        raw, white, beside = (np.concatenate(part).reshape(shape) for part in zip(*parts, strict=True))
        return raw, white, beside

    def _grams(
        self, atoms: slice, size: int, weighted: Array, take: Array, against: Array
    ) -> tuple[Array, Array, Array]:
        """The same for some atoms, the last of which is only there as a neighbour."""
        y = (self.values[atoms, None] * weighted[:, None]).reshape(-1, len(weighted) * self.depth, self.n)
        taken = (y.reshape(-1, self.n) @ take).reshape(*y.shape[:2], -1)
        given = (taken.reshape(-1, len(against)) @ against).reshape(taken.shape)
        raw = y[:size] @ np.swapaxes(y[:size], 1, 2)
        white = raw - given[:size] @ np.swapaxes(taken[:size], 1, 2)
        beside = y[:-1] @ np.swapaxes(y[1:], 1, 2) - given[:-1] @ np.swapaxes(taken[1:], 1, 2)
        return raw, white, beside


def grouped(families: Sequence[Family]) -> Iterator[Patterns]:
    """Families sorted by the depth of their patterns and the sets of shares in which these show."""
    shares: dict[int, tuple[int, ...]] = {}
    for family in families:
        shares[id(family.pattern)] = (*shares.get(id(family.pattern), ()), id(family.shares))
    keys = [(family.pattern.shape[1], shares[id(family.pattern)]) for family in families]
    for key in dict.fromkeys(keys):
        yield Patterns([family for family, own in zip(families, keys, strict=True) if own == key])


def _basis(shares: Array) -> Array:
    """Independent ones of the shares ``(k, n)``, those that leave out most rows first: nothing cancels in mixtures."""
    found = np.zeros((0, shares.shape[1]))
    for row in shares[np.argsort(np.linalg.norm(shares, axis=1), kind="stable")]:
        left = row - _mixture(row[None], found)[0] @ found
        if np.linalg.norm(left) > DEPENDENT * np.linalg.norm(row):
            found = np.vstack([found, row])
    return found


def _mixture(shares: Array, basis: Array) -> Array:
    """Coefficients ``(k, r)`` of shares in a basis ``(r, n)``."""
    mix = np.linalg.lstsq(basis.T, shares.T, rcond=None)[0].T
    return np.where(np.abs(mix) < DEPENDENT, 0.0, mix)


def _single(patterns: Sequence[Array]) -> NDArray[np.float32]:
    values = np.empty((sum(map(len, patterns)), *patterns[0].shape[1:]), np.float32)
    np.concatenate(patterns, out=values, casting="same_kind")
    return values

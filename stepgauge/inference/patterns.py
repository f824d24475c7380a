"""Signatures of many laws at once: patterns over the rows, and their shares on each row.

Laws often differ only in the share of each row: a motion along x, along y or anywhere between. A pattern is kept once,
and all its products that a search needs (with a residual, with a model, with itself) are computed for a basis of the
shares; all others are linear combinations of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.chunks import chunks
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import Law

Array = NDArray[np.float64]
DEPENDENT = 1e-9
LARGE = 1_000_000
"""Numbers in a pattern from which it is by itself."""


class Patterns:
    """Patterns of the same depth with the same sets of shares.

    ``values (atoms, depth, n)``, in single precision: candidates chosen by the search are computed again in double.
    ``sets``: the laws by their shares, each with the shares as mixtures ``(k, r)`` of the rows of ``basis (r, n)``.
    """

    def __init__(self, laws: Sequence[Law]) -> None:
        patterns = {id(law.pattern): law.pattern for law in laws}
        shares = {id(law.shares): law.shares for law in laws}
        self.values = _single(list(patterns.values()))
        self.atoms, self.depth, self.n = self.values.shape
        self.basis = _basis(np.concatenate(list(shares.values())))
        place = {key: i for i, key in enumerate(patterns)}
        members = sorted(laws, key=lambda law: place[id(law.pattern)])
        self.sets = [
            ([law for law in members if id(law.shares) == key], _mixture(rows, self.basis))
            for key, rows in shares.items()
        ]

    def dots(self, vectors: Array) -> NDArray[np.float32]:
        """Products of all atoms with vectors ``(n, q)`` for every row of the basis, ``(atoms, depth, r, q)``."""
        r, q = len(self.basis), vectors.shape[1]
        weighted = (self.basis.T[:, :, None] * vectors[:, None]).reshape(self.n, r * q).astype(np.float32)
        return np.asarray((self.values.reshape(-1, self.n) @ weighted).reshape(self.atoms, self.depth, r, q))

    def grams(self, metric: Metric) -> tuple[Array, Array]:
        """Lengths of each atom by rows alone, ``(atoms, r, depth)``, and its products with itself by the metric.

        These are ``(atoms, r, depth, r, depth)``.
        """
        take = metric.basis.astype(np.float32)
        lost = (1.0 - metric.kept**2).astype(np.float32)
        of_one = len(self.basis) * self.depth * self.n
        parts = [self._grams(some, metric, take, lost) for some in chunks(self.atoms, of_one)]
        length, white = (np.concatenate(part).astype(float) for part in zip(*parts, strict=True))
        shape = (-1, len(self.basis), self.depth)
        return length.reshape(shape), white.reshape(*shape, *shape[1:])

    def _grams(
        self, atoms: slice, metric: Metric, take: NDArray[np.float32], lost: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        basis = (self.basis / metric.sigma_um).astype(np.float32)
        y = (self.values[atoms, None] * basis[:, None]).reshape(-1, len(basis) * self.depth, self.n)
        rows = metric.rows(y).astype(np.float32)
        taken = (rows.reshape(-1, self.n) @ take).reshape(*rows.shape[:2], -1)
        raw = rows @ np.swapaxes(rows, 1, 2)
        return np.linalg.norm(rows, axis=2), raw - (taken * lost) @ np.swapaxes(taken, 1, 2)


def grouped(laws: Sequence[Law]) -> Iterator[Patterns]:
    """Laws sorted by the depth of their patterns and by their sets of shares; a large pattern is not copied."""
    shares: dict[int, tuple[int, ...]] = {}
    for law in laws:
        shares[id(law.pattern)] = (*shares.get(id(law.pattern), ()), id(law.shares))
    keys = [
        (law.pattern.shape[1], shares[id(law.pattern)], id(law.pattern) if law.pattern.size > LARGE else 0)
        for law in laws
    ]
    for key in dict.fromkeys(keys):
        yield Patterns([law for law, own in zip(laws, keys, strict=True) if own == key])


def mixed(gram: Array, mix: Array) -> Array:
    """Products ``(atoms, d, d)`` of signatures from those of basis rows ``(atoms, r, depth, r, depth)``."""
    products = np.einsum("ka,iajbm,lb->ikjlm", mix, gram, mix, optimize=True)
    d = products.shape[1] * products.shape[2]
    return products.reshape(-1, d, d)


def residual_products(products: NDArray[np.float32]) -> Array:
    """Products with the first of some vectors, the residual, ``(r, atoms, depth)``."""
    return products[..., 0].transpose(2, 0, 1).astype(float)


def loss_products(products: NDArray[np.float32]) -> Array:
    """What the other vectors of ``(atoms, depth, r, 1 + q)``, those of the loss, take of the products of a signature.

    These are ``(atoms, r, depth, r, depth)``, as :meth:`Patterns.grams`.
    """
    atoms, depth, r, q = products.shape
    lost = products[..., 1:].transpose(0, 2, 1, 3).reshape(atoms, r * depth, q - 1)
    taken = np.einsum("adq,adq->a", lost, lost) if r * depth == 1 else lost @ np.swapaxes(lost, 1, 2)
    return taken.astype(float).reshape(atoms, r, depth, r, depth)


def _basis(shares: Array) -> Array:
    """A basis of the shares ``(k, n)``, each the farthest from those before it: coefficients stay of order one."""
    unit = shares / np.maximum(np.linalg.norm(shares, axis=1, keepdims=True), 1e-300)
    chosen: list[int] = []
    left = unit
    while (far := np.linalg.norm(left, axis=1)).max() > DEPENDENT:
        chosen.append(int(np.flatnonzero(far > 0.999 * far.max())[0]))
        left = unit - _mixture(unit, unit[chosen]) @ unit[chosen]
    return np.asarray(shares[chosen])


def _mixture(shares: Array, basis: Array) -> Array:
    """Coefficients ``(k, r)`` of shares in a basis ``(r, n)``."""
    mix = np.linalg.lstsq(basis.T, shares.T, rcond=None)[0].T
    return np.where(np.abs(mix) < DEPENDENT, 0.0, mix)


def _single(patterns: Sequence[Array | NDArray[np.float32]]) -> NDArray[np.float32]:
    if len(patterns) == 1:
        return patterns[0].astype(np.float32, copy=False)
    values = np.empty((sum(map(len, patterns)), *patterns[0].shape[1:]), np.float32)
    np.concatenate(patterns, out=values, casting="same_kind")
    return values

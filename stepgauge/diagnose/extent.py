"""How many looks a family of signatures amounts to.

The normalised signatures of a law with one free parameter draw a curve on the unit sphere, those of a law with two a
surface. The chance that pure noise comes nearer than some angle to any point of it is that of a tube about it: its
length counts for a curve (Hotelling, Am. J. Math. 61, 1939), its area and half the length of its rim for a surface
(Worsley, Ann. Stat. 23, 1995: the expected Euler characteristic of what exceeds a threshold).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.library import Family
from stepgauge.diagnose.whitening import Whitening

Array = NDArray[np.float64]
SINGULAR = 1e-7
"""Eigenvalue of normalised products, over the largest, that single precision cannot tell from nought."""
NOTHING = 1e-2
"""Share of a signature that must be left beside the nuisances to be a direction at all."""


@dataclass(frozen=True)
class Extent:
    """What the normalised signatures of a family draw, and how rarely the family is there to be seen.

    ``atoms``: how many there are; ``length`` of the way along them, rad, or half that around the surface which they
    draw, of ``area`` rad squared; ``rarity``: how much rarer the family is, in a size that shows in this recording,
    than the commonest law that always shows, nats.
    """

    atoms: int
    length: float
    area: float = 0.0
    rarity: float = 0.0

    def looks(self, gain: float) -> float:
        """How many independent signatures the family amounts to for a gain in chi-square; never more than there are."""
        turns = gain / (2.0 * np.pi)
        return float(min(1.0 + self.length * np.sqrt(turns) + self.area * turns, self.atoms))


def along_curve(gram: Array, cross: Array) -> float:
    """Length of the way along normalised signatures, rad; of subspaces by their larger principal angle.

    Parameters
    ----------
    gram : products of each signature with itself, shape ``(atoms, d, d)``
    cross : products of each with the next, of which the last is not used
    """
    if len(gram) < 2:
        return 0.0
    cross = cross[: len(gram) - 1]
    shrink = np.linalg.pinv(gram, rcond=SINGULAR, hermitian=True)
    overlap = shrink[:-1] @ cross @ shrink[1:] @ np.swapaxes(cross, 1, 2)
    smallest = np.linalg.eigvals(overlap).real.min(axis=1)
    return float(np.arccos(np.sqrt(np.clip(smallest, 0.0, 1.0))).sum())


def over_surface(family: Family, size: Array, whitening: Whitening) -> tuple[float, float] | None:
    """Half the length of the rim and the area of what signatures with two free parameters draw, rad and rad squared.

    Parameters
    ----------
    family : whose signatures are one column each
    size : of each whitened by its scatter alone, with the nuisances, shape ``(atoms,)``
    whitening : takes the nuisances out

    Returns
    -------
    None where the parameters are not two numbers on a lattice.
    """
    lattice = _lattice(family.atoms) if family.dimension == 1 else None
    if lattice is None:
        return None
    white = whitening(family.columns[:, 0])
    left = np.linalg.norm(white, axis=1)
    seen = left > NOTHING * size
    unit = white / np.where(seen, left, np.inf)[:, None]
    cosine = np.abs(unit @ unit.T)
    lattice = np.where((lattice >= 0) & seen[lattice], lattice, -1)
    cells = np.stack([lattice[:-1, :-1], lattice[1:, :-1], lattice[1:, 1:], lattice[:-1, 1:]], axis=-1)
    area = sum(_triangle(cosine, cells[..., corners]).sum() for corners in ([0, 1, 3], [2, 1, 3]))
    sides = [(lattice[:-1], lattice[1:]), (lattice[:, :-1].T, lattice[:, 1:].T)]
    return sum(_rim(cosine, *one) for one in sides) / 2.0, float(area)


def _lattice(atoms: Sequence[Mapping[str, Any]]) -> NDArray[np.intp] | None:
    """Where on a lattice of their two parameters the signatures stand, -1 where there is none."""
    if sum(np.size(value) for value in atoms[0].values()) != 2:
        return None
    values = np.array([np.hstack(list(atom.values())) for atom in atoms], float)
    places = [np.unique(column, return_inverse=True)[1] for column in values.T]
    lattice = np.full([int(place.max()) + 1 for place in places], -1)
    lattice[places[0], places[1]] = np.arange(len(atoms))
    return lattice if min(lattice.shape) > 1 else None


def _chords(cosine: Array, one: NDArray[np.intp], other: NDArray[np.intp]) -> Array:
    """Squares of the chords between signatures, nought where one is missing."""
    there = (one >= 0) & (other >= 0)
    return np.where(there, 2.0 - 2.0 * np.minimum(cosine[one, other], 1.0), 0.0)


def _triangle(cosine: Array, corners: NDArray[np.intp]) -> Array:
    """Areas of triangles with their corners at signatures (Heron), nought where one is missing."""
    a, b, c = (_chords(cosine, corners[..., i], corners[..., j]) for i, j in ((0, 1), (1, 2), (2, 0)))
    squares = 2.0 * (a * b + b * c + c * a) - a**2 - b**2 - c**2
    return np.where((corners >= 0).all(axis=-1), np.sqrt(np.maximum(squares, 0.0)) / 4.0, 0.0)


def _rim(cosine: Array, one: NDArray[np.intp], other: NDArray[np.intp]) -> float:
    """Length of those steps from one row of the lattice to the next that have a cell on one side only."""
    there = (one >= 0) & (other >= 0)
    cells = there[:, 1:] & there[:, :-1]
    beside = np.pad(cells, ((0, 0), (1, 0))).astype(int) + np.pad(cells, ((0, 0), (0, 1)))
    return float(np.sqrt(_chords(cosine, one, other))[there & (beside == 1)].sum())

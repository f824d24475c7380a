"""What laws move beside their signatures, as amplitudes of which nothing is told.

A law of a process leaves something out of its own shape, the model discrepancy. A body warms with one time constant in
the law and with several in a workshop; a worn stretch has a width, but not the profile of a bell. Where such a law is
large, what it leaves out is larger than the scatter, and a second law would be told for it. So its shape has a
tolerance: a share of its size has other shapes of the same law, those that resemble it most (Kennedy and O'Hagan,
Journal of the Royal Statistical Society B 63, 2001: 425, section 2). Of a wave these are its harmonics.

And what follows a temperature with a lag depends on what nobody read of it (:mod:`..unread`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import svd

from stepgauge.diagnosis.laws.library import Family, family_signatures
from stepgauge.diagnosis.laws.usual import size_of_shape
from stepgauge.diagnosis.posterior.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.unread import principal, shifts
from stepgauge.effects.following import Following
from stepgauge.effects.probings import Probings

Array = NDArray[np.float64]
Source = Callable[[int, dict[str, Any]], Array]
"""From the number of an atom and a shape near it to columns ``(p, n)``."""
MOST_AMPLITUDES = 12
NEGLIGIBLE = 1e-6
"""Most courses that are told apart, and the share of the law's own variance below which another does not matter."""
MOST_SHAPES = 400
"""Shapes of a law whose other shapes are tried: beyond it these are single waves."""
HARMONICS = (2, 3)
PERIOD = "period_s"
LAG, UNREAD = "lag_s", "unread"


class Beside:
    """What a law moves beside its signature, for each of its shapes; ``sources``: by what, none for most laws."""

    def __init__(self, family: Family, courses: Courses, data: Residuals, priors: Priors) -> None:
        self.family, self.data, self.sources = family, data, list[Source]()
        if is_process(family, frozenset(priors.laws.processes)):
            self.sources.append(partial(_inexact, family, courses, data, priors.laws.discrepancy))
        if follows_with_lag(family):
            self.sources.append(lambda atom, shape: unread_columns(family, data, shape))

    def of_atom(self, atom: int) -> Array:
        """For a shape of the grid, ``(p, n)``."""
        return self(atom, self.family.atoms[atom])

    def __call__(self, atom: int, shape: dict[str, Any]) -> Array:
        """For a shape near that of an atom, ``(p, n)``."""
        return np.concatenate([np.zeros((0, len(self.data))), *(of(atom, shape) for of in self.sources)])


def _inexact(
    family: Family, courses: Courses, data: Residuals, share: float, atom: int, shape: dict[str, Any]
) -> Array:
    size = share * size_of_shape(family.kind, shape, family.atoms)
    return size * discrepancy(family, courses, atom, shape, data)


class Courses:
    """All shapes of a law of one amplitude as mixtures of orthogonal courses; ``pattern (atoms, 1, n)``."""

    def __init__(self, pattern: Array) -> None:
        self.pattern = pattern

    @cached_property
    def _mixed(self) -> tuple[Array, Array]:
        """Coordinates ``(atoms, r)`` of the shapes, each of length one, and the courses ``(r, n)``."""
        length = np.maximum(np.linalg.norm(self.pattern[:, 0], axis=1, keepdims=True), 1e-300)
        left, size, courses = svd(self.pattern[:, 0] / length, full_matrices=False, check_finite=False)
        keep = size**2 > NEGLIGIBLE**2 * size[0] ** 2
        return left[:, keep] * size[keep], courses[keep]

    def beside(self, atom: int) -> Array:
        """What one shape becomes by others ``(p, n)``, as large as they and as it are.

        Every other shape has a weight as it resembles this one: the square of the cosine between them.
        """
        every, courses = self._mixed
        alike = every @ every[atom]
        apart = every - np.outer(alike / alike[atom], every[atom])
        value, vector = np.linalg.eigh((apart.T * (alike**2 / (alike**2).sum())) @ apart)
        keep = value > NEGLIGIBLE
        mixed = (vector[:, keep] * np.sqrt(value[keep])).T[-MOST_AMPLITUDES:]
        return np.asarray(np.linalg.norm(self.pattern[atom]) * mixed @ courses)


def is_process(family: Family, shapes: frozenset[str]) -> bool:
    """Whether a law has a shape that idealises a process: one of those parameters, with values to choose from."""
    if PERIOD in family.atoms[0]:
        return PERIOD in shapes
    few = 1 < len(family.atoms) <= MOST_SHAPES and family.pattern.shape[1] == 1
    return few and bool(shapes & family.atoms[-1].keys())


def discrepancy(family: Family, courses: Courses, atom: int, shape: dict[str, Any], data: Residuals) -> Array:
    """Displacements along the approach ``(p, n)`` that a law has beside its own, um for a unit of its amplitude.

    The law has a ``shape`` near that of an ``atom``; what would be the law itself again is taken out.
    """
    if PERIOD in shape:
        return np.concatenate(list(_harmonics(family, shape, data)))
    own = family_signatures(family, shape, data)
    beside = np.concatenate([courses.beside(atom) * share for share in family.share_rows])
    return np.asarray(beside - (beside @ np.linalg.pinv(own)) @ own)


def _harmonics(family: Family, shape: dict[str, Any], data: Residuals) -> Iterator[Array]:
    for order in HARMONICS:
        yield family_signatures(family, {**shape, PERIOD: shape[PERIOD] / order}, data)


def follows_with_lag(family: Family) -> bool:
    """Whether a law follows a recorded column after a lag."""
    return family.law is not None and issubclass(family.law, Following)


def unread_columns(family: Family, data: Residuals, shape: Mapping[str, Any]) -> Array:
    """Displacements along the approach ``(p, n)`` by what was not read, um for a unit of the amplitude of the law.

    The standard uncertainties of all pauses as their principal components, for each direction that is free.
    """
    lag_s, nothing = shape.get(LAG), np.zeros((0, len(data)))
    if not lag_s:
        return nothing
    names = [family.choices[name] for name in ("column", "minus") if family.choices.get(name)]
    time_s, columns = data.probings.time_s, [data.probings.column(name) for name in names]
    moved = np.concatenate([shifts(time_s, values, float(lag_s)) for values in columns])
    return np.concatenate([principal(moved * per_K) for per_K in _per_K(family, shape, data)])


def _per_K(family: Family, shape: Mapping[str, Any], data: Residuals) -> Array:
    """Displacement along the approach by one kelvin, um, of every free direction ``(k, n)``."""
    probings = Probings({**_columns(data), UNREAD: np.ones(len(data))}, data.probings.setting)
    warmed = replace(family, choices=family.choices | {"column": UNREAD, "minus": None, "from_C": 0.0})
    return family_signatures(warmed, {**shape, LAG: 0.0}, replace(data, probings=probings))


def _columns(data: Residuals) -> dict[str, Array]:
    return {str(name): data.probings.column(name) for name in data.frame.columns}

"""What laws move beside their signatures, as amplitudes of which nothing is told.

A law of a process leaves something out of its own shape, the model discrepancy. A body warms with one time constant in
the law and with several in a workshop; a worn stretch has a width, but not the profile of a bell. Where such a law is
large, what it leaves out is larger than the scatter, and a second law would be told for it. So its shape has a
tolerance: a share of its size has other shapes of the same law, those that resemble it most (Kennedy and O'Hagan,
Journal of the Royal Statistical Society B 63, 2001: 425, section 2). Of a wave these are its harmonics.

And what follows a temperature with a lag depends on what nobody read of it (:mod:`..unobserved_inputs`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import svd

from stepgauge.diagnosis.laws.library import Family, family_signatures, fixed_values
from stepgauge.diagnosis.laws.usual import size_of_shape
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.unobserved_inputs import principal, shifts
from stepgauge.effects.following import Following
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import residual_columns

MOST_AMPLITUDES = 12
NEGLIGIBLE = 1e-6
"""Most courses that are told apart, and the share of the law's own variance below which another does not matter."""
MOST_SHAPES = 400
"""Shapes of a law whose other shapes are tried: beyond it these are single waves."""
HARMONICS = (2, 3)
LAG, UNREAD = "lag_s", "unread"


@dataclass(frozen=True)
class Discrepancy:
    """What a law moves beside its signature, for each of its shapes.

    ``share``: what it has in other shapes, over its size (``discrepancy`` in the priors); 0 for a law that is exact.
    """

    family: Family
    courses: UnobservedCourses
    data: Residuals
    share: float

    @property
    def any(self) -> bool:
        """Whether the law moves anything beside its signature."""
        return self.share > 0.0 or follows_with_lag(self.family) or len(self._uncertain) > 0

    @cached_property
    def _uncertain(self) -> Array:
        """What comes with the law by an unknown amount, ``(p, n)``."""
        family = self.family
        return family.law.model_construct(**fixed_values(family.law) | family.choices).uncertain_um(self.data.probings)

    def __call__(self, atom: int, shape: dict[str, Any] | None = None) -> Array:
        """For a shape of the grid or one near it, ``(p, n)``."""
        family, data = self.family, self.data
        shape = family.atoms[atom] if shape is None else shape
        parts = [np.zeros((0, len(data)))]
        if self.share > 0.0:
            size = self.share * size_of_shape(family.kind, shape, family.atoms)
            parts.append(size * discrepancy(family, self.courses, atom, shape, data))
        if follows_with_lag(family):
            parts.append(unread_columns(family, data, shape))
        parts.append(self._uncertain)
        return np.concatenate(parts)


class UnobservedCourses:
    """All shapes of a law of one amplitude as mixtures of orthogonal courses; ``pattern (atoms, 1, n)``."""

    def __init__(self, pattern: Array) -> None:
        self.pattern = pattern

    @cached_property
    def _mixed(self) -> tuple[Array, Array]:
        """Coordinates ``(atoms, r)`` of the shapes, each of length one, and the courses ``(r, n)``."""
        length = np.linalg.norm(self.pattern[:, 0], axis=1, keepdims=True)
        unit = self.pattern[:, 0] / np.maximum(length, np.finfo(length.dtype).tiny)
        left, size, courses = svd(unit, full_matrices=False, check_finite=False)
        keep = size > NEGLIGIBLE * size[0]
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


def is_process(family: Family) -> bool:
    """Whether a law has a shape that idealises a process, with values to choose from.

    One wave of those in a turn has none beside it: its harmonics are laws, too.
    """
    if family.alone is not None or not family.law.process:
        return False
    if family.law.phase():
        return True
    return 1 < len(family.atoms) <= MOST_SHAPES and family.pattern.shape[1] == 1


def discrepancy(family: Family, courses: UnobservedCourses, atom: int, shape: dict[str, Any], data: Residuals) -> Array:
    """Displacements along the approach ``(p, n)`` that a law has beside its own, um for a unit of its amplitude.

    The law has a ``shape`` near that of an ``atom``; what would be the law itself again is taken out.
    """
    if family.law.phase():
        period, inverse = family.law.rhythm()
        orders = (order for order in HARMONICS if order > len(family.law.sines()))
        waves = ({**shape, period: shape[period] * (order if inverse else 1.0 / order)} for order in orders)
        return np.concatenate([family_signatures(family, one, data) for one in waves])
    beside = np.concatenate([courses.beside(atom) * share for share in family.share_rows])
    return residual_columns(beside, family_signatures(family, shape, data))


def follows_with_lag(family: Family) -> bool:
    """Whether a law follows a recorded column after a lag."""
    return issubclass(family.law, Following)


def unread_columns(family: Family, data: Residuals, shape: Mapping[str, Any]) -> Array:
    """Displacements along the approach ``(p, n)`` by what was not read, um for a unit of the amplitude of the law.

    The standard uncertainties of all pauses as their principal components, for each direction that is free.
    """
    if not (lag_s := shape.get(LAG)):
        return np.zeros((0, len(data)))
    names = [family.choices[name] for name in ("column", "minus") if family.choices.get(name)]
    time_s, columns = data.probings.time_s, [data.probings.column(name) for name in names]
    moved = np.concatenate([shifts(time_s, values, float(lag_s)) for values in columns])
    # by one kelvin, along every direction that is free
    probings = Probings({**data.columns, UNREAD: np.ones(len(data))}, data.probings.setting)
    warmed = replace(family, choices=family.choices | {"column": UNREAD, "minus": None, "from_C": 0.0})
    each = family_signatures(warmed, {**shape, LAG: 0.0}, replace(data, probings=probings))
    return np.concatenate([principal(moved * per_K) for per_K in each])

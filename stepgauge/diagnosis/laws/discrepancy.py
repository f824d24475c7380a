"""What a law of a process leaves out of its own shape, as amplitudes beside its own: the model discrepancy.

A body warms with one time constant in the law and with several in a workshop; a worn stretch has a width, but not the
profile of a bell. Where such a law is large, what it leaves out is larger than the scatter, and a second law would be
told for it. So its shape has a tolerance: a share of its size has other shapes of the same law, those that resemble it
most (Kennedy and O'Hagan, Journal of the Royal Statistical Society B 63, 2001: 425, section 2). Of a wave these are its
harmonics.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import svd

from stepgauge.diagnosis.laws.library import Family, family_signatures
from stepgauge.diagnosis.residuals import Residuals

Array = NDArray[np.float64]
MOST_AMPLITUDES = 12
NEGLIGIBLE = 1e-6
"""Most courses that are told apart, and the share of the law's own variance below which another does not matter."""
MOST_SHAPES = 400
"""Shapes of a law whose other shapes are tried: beyond it these are single waves."""
HARMONICS = (2, 3)
PERIOD = "period_s"


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

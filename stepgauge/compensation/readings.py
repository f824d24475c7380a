"""Mean errors of a machine axis at its coordinates, with weights and uncertainties, whatever measured them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array


@dataclass(frozen=True)
class AxisReadings:
    """Mean errors of an axis where it was measured: at the faces of a gauge, or at targets; arrays ``(n,)``.

    ``coordinate_mm``: of the axis, as indicated; ``sense``: +1, -1, of travel on the axis; ``error_um``: along the
    axis, of backs of a gauge with the tip diameter in it (``has_tip``); ``variance_um2``: of ``error_um``; ``share``:
    of the axis in the gauge axis; ``tip_um``: tip diameter with variance, or None: nobody stated it; ``u_length``:
    standard uncertainty in proportion to length, um per mm; ``told``: notes that
    stand where the readings come from; ``reversal_note``: where the reversal of the table comes from.
    """

    path: str
    axis: str
    coordinate_mm: Array
    sense: NDArray[np.int64]
    has_tip: NDArray[np.bool_]
    error_um: Array
    variance_um2: Array
    share: float
    tip_um: tuple[float, float] | None
    u_length: float
    about: Mapping[str, Any]
    notes: tuple[str, ...]
    told: tuple[str, ...] = ()
    reversal_note: str = ""

    def require(self, sense: int) -> None:
        """:class:`InputError` where fewer than two places were measured in this sense of travel."""
        if (self.sense == sense).sum() < 2:
            word = "positive" if sense > 0 else "negative"
            raise InputError(
                self.path,
                f"too few places were measured in {word} travel of {self.axis}",
                found=int((self.sense == sense).sum()),
                expected="two or more",
            )

    def range_mm(self, sense: int) -> tuple[float, float]:
        """Lowest and highest coordinate measured in a sense of travel."""
        x = self.coordinate_mm[self.sense == sense]
        return float(x.min()), float(x.max())

    def covers(self, x: Array, sense: int) -> NDArray[np.bool_]:
        """Whether places are between measured ones of this sense."""
        if not (self.sense == sense).any():
            return np.zeros(len(x), bool)
        low, high = self.range_mm(sense)
        return np.asarray((x >= low - 1e-6) & (x <= high + 1e-6))

    def weights(self, x: Array, sense: int) -> Array:
        """Weights of the readings, and last of the tip diameter, in the error at ``x``; shape ``(len(x), n + 1)``."""
        rows = np.flatnonzero(self.sense == sense)
        rows = rows[np.argsort(self.coordinate_mm[rows])]
        weights = np.zeros((len(x), len(self.sense) + 1))
        for row, unit in zip(rows, np.eye(len(rows)), strict=True):
            weights[:, row] = np.interp(x, self.coordinate_mm[rows], unit)
        weights[:, -1] = -1.0 if self.has_tip[rows[0]] else 0.0
        return weights

    def slope_weights(self, sense: int) -> Array:
        """Weights of the slope (um per mm) of the least-squares line through the places of a sense; ``(n + 1,)``."""
        rows = self.sense == sense
        from_middle = np.where(rows, self.coordinate_mm - self.coordinate_mm[rows].mean(), 0.0)
        return np.append(from_middle / (from_middle**2).sum(), 0.0)

    def combine(self, weights: Array) -> Array:
        """Errors along the axis, um, from weights ``(m, n + 1)``."""
        tip = 0.0 if self.tip_um is None else self.tip_um[0]
        return np.asarray((self._folded(weights) @ self.error_um + weights[:, -1] * tip) / self.share)

    def uncertainty_um(self, weights: Array, from_zero_mm: Array) -> Array:
        """Standard uncertainty: readings by place, the tip, and what grows with the distance from the zero."""
        tip_variance = 0.0 if self.tip_um is None else self.tip_um[1]
        variance = self._folded(weights) ** 2 @ self.variance_um2 + weights[:, -1] ** 2 * tip_variance
        return np.sqrt(variance + (self.u_length * from_zero_mm) ** 2)

    def _folded(self, weights: Array) -> Array:
        by_face, tip = weights[:, :-1], weights[:, -1:]
        return by_face if self.tip_um is not None else by_face + tip * self._tip_weights

    @cached_property
    def _tip_weights(self) -> Array:
        """Weights ``(n,)`` of the readings in a tip diameter that nobody stated: with it the mean reversal is 0.

        Readings cannot tell the tip from a reversal. R_eff would not do: it holds the error of a block too, so that a
        scale error would show a reversal of itself times the block.
        """
        both = self.coordinate_mm[self.covers(self.coordinate_mm, 1) & self.covers(self.coordinate_mm, -1)]
        if not both.size:  # one sense of travel was measured, and a table of it holds no tip
            return np.zeros(len(self.sense))
        reversal = (self.weights(both, 1) - self.weights(both, -1)).mean(axis=0)
        return np.asarray(-reversal[:-1] / reversal[-1])

    def mean_reversal_text(self, x: Array) -> str:
        """Mean of positive minus negative travel where both were measured, in words."""
        both = x[self.covers(x, 1) & self.covers(x, -1)]
        if self.tip_um is None or not both.size:
            return "not known"
        rows = (self.weights(both, 1) - self.weights(both, -1)).mean(axis=0, keepdims=True)
        value, u = self.combine(rows)[0], self.uncertainty_um(rows, np.zeros(1))[0]
        return f"{value:+.2f} um (u = {u:.2f} um) positive minus negative travel"


def check_placement(number: int, numbers: Sequence[int], path: str) -> None:
    """:class:`InputError` for a placement that was not measured."""
    if number not in numbers:
        raise InputError(path, f"there is no placement {number}", expected=", ".join(map(str, numbers)))

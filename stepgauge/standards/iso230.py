"""ISO 230-2: accuracy and repeatability of positioning of an axis, from deviations at target positions.

Clause numbers are those of the terms in ISO 230-2:2006, clause 2; the edition of 2014 keeps the formulas. All functions
take deviations in um of shape ``(targets, runs)``; "up" is an approach in the positive direction, "down" the other. Of
a rotary axis the same numbers are in arcsec, whatever their names say: :class:`.positioning.Units` tells them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stepgauge.files.arrays import Array


@dataclass(frozen=True)
class Direction:
    """Approaches in one direction: deviations ``x_um (targets, runs)``, two runs or more."""

    x_um: Array

    @cached_property
    def mean_um(self) -> Array:
        """Mean unidirectional positional deviation at a position (2.10), shape ``(targets,)``."""
        return self.x_um.mean(axis=1)

    @cached_property
    def s_um(self) -> Array:
        """Estimator of the standard deviation of positioning at a position, n - 1 (2.15), shape ``(targets,)``."""
        return self.x_um.std(axis=1, ddof=1)

    @property
    def u_mean_um(self) -> Array:
        """Standard uncertainty of the mean from the runs alone (GUM 4.2.3, type A), s / sqrt(runs), ``(targets,)``."""
        return self.s_um / np.sqrt(self.x_um.shape[1])

    @property
    def high_um(self) -> Array:
        """Mean plus two standard deviations."""
        return self.mean_um + 2.0 * self.s_um

    @property
    def low_um(self) -> Array:
        """Mean minus two standard deviations."""
        return self.mean_um - 2.0 * self.s_um

    @property
    def R_at_um(self) -> Array:
        """Unidirectional repeatability at a position, 4 s (2.16), shape ``(targets,)``."""
        return 4.0 * self.s_um

    @property
    def R_um(self) -> float:
        """Unidirectional repeatability of positioning of the axis (2.18)."""
        return float(self.R_at_um.max())

    @property
    def E_um(self) -> float:
        """Unidirectional systematic deviation of positioning (2.20)."""
        return float(np.ptp(self.mean_um))

    @property
    def A_um(self) -> float:
        """Unidirectional accuracy of positioning (2.23)."""
        return float(self.high_um.max() - self.low_um.min())


@dataclass(frozen=True)
class AxisParameters:
    """The parameters of an axis from approaches in both directions, um."""

    up: Direction
    down: Direction

    @property
    def directions(self) -> dict[str, Direction]:
        """Both directions by name."""
        return {"up": self.up, "down": self.down}

    @property
    def mean_um(self) -> Array:
        """Mean bidirectional positional deviation at a position (2.11), shape ``(targets,)``."""
        return (self.up.mean_um + self.down.mean_um) / 2.0

    @property
    def B_at_um(self) -> Array:
        """Reversal value at a position, up minus down (2.12), shape ``(targets,)``."""
        return self.up.mean_um - self.down.mean_um

    @property
    def B_um(self) -> float:
        """Reversal value of the axis, the largest of the positions without its sign (2.13)."""
        return float(np.abs(self.B_at_um).max())

    @property
    def mean_B_um(self) -> float:
        """Mean reversal value of the axis (2.14)."""
        return float(self.B_at_um.mean())

    @property
    def R_at_um(self) -> Array:
        """Bidirectional repeatability at a position (2.17), shape ``(targets,)``."""
        both = 2.0 * self.up.s_um + 2.0 * self.down.s_um + np.abs(self.B_at_um)
        return np.max([both, self.up.R_at_um, self.down.R_at_um], axis=0)

    @property
    def R_um(self) -> float:
        """Bidirectional repeatability of positioning of the axis (2.19)."""
        return float(self.R_at_um.max())

    @property
    def E_um(self) -> float:
        """Bidirectional systematic deviation of positioning (2.21)."""
        return float(np.ptp([self.up.mean_um, self.down.mean_um]))

    @property
    def M_um(self) -> float:
        """Mean bidirectional positional deviation of the axis (2.22): the range of the means of both directions."""
        return float(np.ptp(self.mean_um))

    @property
    def A_um(self) -> float:
        """Bidirectional accuracy of positioning (2.24)."""
        high = max(self.up.high_um.max(), self.down.high_um.max())
        return float(high - min(self.up.low_um.min(), self.down.low_um.min()))


@dataclass(frozen=True)
class OneWay:
    """The parameters of an axis that was approached in one direction, ``way``: ``up`` or ``down``.

    Reversal and whatever is of both directions is not known.
    """

    way: str
    direction: Direction

    @property
    def directions(self) -> dict[str, Direction]:
        """The direction by name."""
        return {self.way: self.direction}


Parameters = AxisParameters | OneWay


def axis_parameters(up_um: Array, down_um: Array) -> AxisParameters:
    """The parameters from deviations ``(targets, runs)`` in um; the counts of runs may differ.

    ``ValueError`` for fewer than two runs, other targets in the two directions, or deviations that are not finite.
    """
    up, down = np.asarray(up_um, float), np.asarray(down_um, float)
    if up.ndim != 2 or down.ndim != 2 or len(up) != len(down) or not len(up):
        raise ValueError(f"deviations must be (targets, runs) for the same targets, not {up.shape} and {down.shape}")
    if min(up.shape[1], down.shape[1]) < 2:
        raise ValueError("a standard deviation needs two runs in each direction")
    if not (np.isfinite(up).all() and np.isfinite(down).all()):
        raise ValueError("deviations must be finite")
    return AxisParameters(Direction(up), Direction(down))

"""The uncertainty budget of a probe calibration and U(L) from it (Ren, Qu and Chen 2020, Table 2, Eqs 16-18).

A component is either constant (um) or proportional to the measured length (um/m). Both parts are added in
quadrature, U = k sqrt(a^2 + (b L)^2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array


@dataclass(frozen=True)
class Component:
    """One line of a budget: standard uncertainty ``fixed_um`` plus ``per_m_um`` per metre; type A or B (GUM)."""

    name: str
    kind: Literal["A", "B"]
    fixed_um: float = 0.0
    per_m_um: float = 0.0


@dataclass(frozen=True)
class ProbeBudget:
    """Components taken as independent; the two combined standard uncertainties of Eq 18."""

    components: tuple[Component, ...]

    @property
    def fixed_um(self) -> float:
        """Part that does not depend on length, um."""
        return float(np.sqrt(sum(part.fixed_um**2 for part in self.components)))

    @property
    def per_m_um(self) -> float:
        """Part proportional to length, um/m."""
        return float(np.sqrt(sum(part.per_m_um**2 for part in self.components)))

    def expanded_um(self, length_m: ArrayLike, coverage_factor: float = 2.0) -> Array:
        """U(L) = k sqrt(a^2 + (b L)^2) in um for lengths in m (Eq 18)."""
        return coverage_factor * np.hypot(self.fixed_um, self.per_m_um * np.asarray(length_m, dtype=float))

    def shares(self, length_m: float) -> Array:
        """Share of each component in the variance at ``length_m``, (n,), adding to 1."""
        variances = np.array([part.fixed_um**2 + (part.per_m_um * length_m) ** 2 for part in self.components])
        return variances / variances.sum()


def temperature_um_per_m(u_temperature_K: float, expansion_per_K: float) -> float:
    """Standard uncertainty alpha u(T) of a length from its temperature, in um/m."""
    return 1e6 * expansion_per_K * u_temperature_K


def expansion_um_per_m(u_expansion_per_K: float, temperature_offset_K: float) -> float:
    """Standard uncertainty |T - 20| u(alpha) of a length from its expansion coefficient, in um/m.

    Squared, these two are the terms (Delta T L)^2 u(alpha)^2 and (alpha L)^2 u(Delta T)^2 of the propagation; in Eq 17
    the sensitivity coefficients are not squared.
    """
    return 1e6 * u_expansion_per_K * abs(temperature_offset_K)


def cosine_um_per_m(angle_rad: float) -> float:
    """Cosine error 1 - cos(angle) of a length measured at an angle to its axis, in um/m."""
    return 1e6 * 2.0 * float(np.sin(angle_rad / 2.0)) ** 2


def repeatability_component(name: str, readings_um: ArrayLike) -> Component:
    """A type A component from repeated readings: their experimental standard deviation.

    Raises ``ValueError`` for fewer than two readings.
    """
    readings = np.asarray(readings_um, dtype=float)
    if readings.size < 2:
        raise ValueError(f"{name}: repeatability needs at least two readings, not {readings.size}")
    return Component(name, "A", fixed_um=float(readings.std(ddof=1)))


def ren_budget(expansion_per_K: float = 11.5e-6, cosine_per_m_um: float = 0.001) -> ProbeBudget:
    """The budget of Ren Table 2, its part proportional to length computed from the stated causes.

    Parameters
    ----------
    expansion_per_K : of the grating; the table's 0.058 and 0.115 um/m for 5 and 10 mK mean 11.5e-6
    cosine_per_m_um : the table's value. 0.1 mm in 100 mm, as the table states the cause, would give
        ``cosine_um_per_m(1e-3)`` = 0.5 um/m, 500 times as much: pass this value to see its influence.
    """
    return ProbeBudget(
        (
            Component("probing", "A", fixed_um=0.034),
            Component("calibration of the probe", "B", fixed_um=0.030),
            Component("standard sphere", "B", fixed_um=0.030),
            Component("grating ruler", "B", fixed_um=0.020),
            Component("repeatability at the zero position", "A", fixed_um=0.055),
            Component("repeatability at the trigger position", "A", fixed_um=0.060),
            Component("temperature measurement, 5 mK", "B", per_m_um=temperature_um_per_m(0.005, expansion_per_K)),
            Component("temperature distribution, 10 mK", "A", per_m_um=temperature_um_per_m(0.010, expansion_per_K)),
            Component("expansion coefficient, 1e-6/K at 10 mK", "B", per_m_um=expansion_um_per_m(1.0e-6, 0.010)),
            Component("cosine error", "B", per_m_um=cosine_per_m_um),
        )
    )


def add_repeatability(pretravel_std_um: float | None) -> ProbeBudget:
    """Ren's budget with the repeatability measured on the bench.

    A pre-travel is the difference of two readings, and its standard deviation contains the scatter of both: it replaces
    the components of zero and trigger position together. None (a single push) keeps the table's values.
    """
    budget = ren_budget()
    if pretravel_std_um is None:
        return budget
    kept = [part for part in budget.components if not part.name.startswith("repeatability")]
    return ProbeBudget((*kept, Component("repeatability of the pre-travel, measured", "A", fixed_um=pretravel_std_um)))

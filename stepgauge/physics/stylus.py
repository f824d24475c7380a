"""The stylus as a beam: steps of diameter and material, bending, shear and compression.

A stylus is a cantilever of round sections, listed from the probe body to the tip, with the force at the tip centre.
The uniform beam F L^3 / (3 E I) of Ren et al. 2020 (Eqs 8-10) and of the "existing method" in Rodrigues 2021 is one
section without shear. Bending and shear: S. Timoshenko, Strength of Materials; shear coefficients: G. R. Cowper,
The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33 (1966), 335-340.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics.contact import N_PER_MM2_IN_GPA

GRAVITY_M_S2 = 9.80665
_KG_PER_MM3 = 1e-9


@dataclass(frozen=True)
class StylusSection:
    """A round piece of the stylus; with ``bore_mm`` a tube (carbon fibre stems).

    Attributes
    ----------
    length_mm, diameter_mm, bore_mm : size
    modulus_GPa, poisson : Young's modulus along the stylus and Poisson's ratio; an infinite modulus is rigid
    density_kg_m3 : 0 if the weight does not matter
    """

    length_mm: float
    diameter_mm: float
    modulus_GPa: float
    poisson: float = 0.3
    bore_mm: float = 0.0
    density_kg_m3: float = 0.0

    def __post_init__(self) -> None:
        if self.length_mm <= 0.0 or not 0.0 <= self.bore_mm < self.diameter_mm:
            raise ValueError("a section has a length, and a diameter larger than its bore")

    @property
    def area_mm2(self) -> float:
        """Area of the cross-section, mm2."""
        return np.pi / 4.0 * (self.diameter_mm**2 - self.bore_mm**2)

    @property
    def second_moment_mm4(self) -> float:
        """Second moment of area, pi (d^4 - bore^4) / 64 (Ren Eq 9)."""
        return np.pi / 64.0 * (self.diameter_mm**4 - self.bore_mm**4)

    @property
    def modulus_N_mm2(self) -> float:
        """Young's modulus, N/mm2."""
        return self.modulus_GPa * N_PER_MM2_IN_GPA

    @property
    def mass_kg(self) -> float:
        """Mass of the section, kg."""
        return self.area_mm2 * self.length_mm * self.density_kg_m3 * _KG_PER_MM3

    @property
    def shear_coefficient(self) -> float:
        """Cowper's kappa of a tube; with no bore 6 (1 + nu) / (7 + 6 nu)."""
        bore, nu = self.bore_mm / self.diameter_mm, self.poisson
        wall = (1.0 + bore**2) ** 2
        return 6.0 * (1.0 + nu) * wall / ((7.0 + 6.0 * nu) * wall + (20.0 + 12.0 * nu) * bore**2)


Stylus = Sequence[StylusSection]


def length_mm(stylus: Stylus) -> float:
    """Length of all sections together, mm."""
    return float(sum(section.length_mm for section in stylus))


def bending_compliance_mm_per_N(stylus: Stylus) -> float:
    """Lateral motion of the tip per newton by bending: the sum of (a^3 - b^3) / (3 E I) over the sections.

    a and b are the distances of a section's ends from the tip. One section gives L^3 / (3 E I) (Ren Eq 10).
    """
    ends = _distances_from_tip(stylus)
    return float(
        sum(
            (ends[i] ** 3 - ends[i + 1] ** 3) / (3.0 * section.modulus_N_mm2 * section.second_moment_mm4)
            for i, section in enumerate(stylus)
        )
    )


def shear_compliance_mm_per_N(stylus: Stylus) -> float:
    """Lateral motion of the tip per newton by shear: the sum of l / (kappa G A) (Timoshenko, Cowper)."""
    return float(sum(s.length_mm * _shear_softness(s) for s in stylus))


def lateral_compliance_mm_per_N(stylus: Stylus) -> float:
    """Bending and shear together."""
    return bending_compliance_mm_per_N(stylus) + shear_compliance_mm_per_N(stylus)


def axial_compliance_mm_per_N(stylus: Stylus) -> float:
    """Motion of the tip along the stylus per newton along it: the sum of l / (E A)."""
    return float(sum(s.length_mm / (s.modulus_N_mm2 * s.area_mm2) for s in stylus))


def tip_displacement_mm(stylus: Stylus, force_N: ArrayLike) -> Array:
    """Displacement (..., 3) of the tip under a force (..., 3) in N; z is the stylus axis."""
    lateral, axial = lateral_compliance_mm_per_N(stylus), axial_compliance_mm_per_N(stylus)
    return np.asarray(force_N, dtype=float) * np.array([lateral, lateral, axial])


def uniform_deflection_mm(section: StylusSection, force_N: ArrayLike, at_mm: ArrayLike) -> Array:
    """Deflection of a uniform cantilever at a distance from its root, F x^2 (3 L - x) / (6 E I) (Ren Eq 8)."""
    x = np.asarray(at_mm, dtype=float)
    rigidity = section.modulus_N_mm2 * section.second_moment_mm4
    return np.asarray(force_N, dtype=float) * x**2 * (3.0 * section.length_mm - x) / (6.0 * rigidity)


def mass_kg(stylus: Stylus) -> float:
    """Mass of the sections whose density is known."""
    return float(sum(section.mass_kg for section in stylus))


def centre_of_mass_mm(stylus: Stylus) -> float:
    """Distance of the centre of mass from the root; half of the length if no density is known."""
    total, ends = mass_kg(stylus), length_mm(stylus) - _distances_from_tip(stylus)
    if total == 0.0:
        return length_mm(stylus) / 2.0
    middles = 0.5 * (ends[:-1] + ends[1:])
    return float(sum(s.mass_kg * middle for s, middle in zip(stylus, middles, strict=True)) / total)


def sag_mm(stylus: Stylus) -> float:
    """Deflection of the tip by the weight of a horizontal stylus, in mm (without shear).

    It is the same for all probings in one orientation, so a qualification corrects it; between orientations it does
    not.
    """
    ends = _distances_from_tip(stylus)
    load = [s.mass_kg * GRAVITY_M_S2 / s.length_mm for s in stylus]
    knots, weights = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for i, section in enumerate(stylus):
        x = 0.5 * (ends[i] - ends[i + 1]) * knots + 0.5 * (ends[i] + ends[i + 1])
        moment = sum(_moment_of_weight(x, ends[j], ends[j + 1], load[j]) for j in range(len(stylus)))
        rigidity = section.modulus_N_mm2 * section.second_moment_mm4
        total += float(0.5 * section.length_mm * np.sum(weights * moment * x) / rigidity)
    return total


def _moment_of_weight(x: Array, far: float, near: float, load_N_per_mm: float) -> Array:
    """Bending moment at distances x from the tip, by the part of the load between the tip and x."""
    reach = np.clip(x, near, far)
    return load_N_per_mm * (reach - near) * (x - 0.5 * (reach + near))


def _shear_softness(section: StylusSection) -> float:
    shear_modulus = section.modulus_N_mm2 / (2.0 * (1.0 + section.poisson))
    return 1.0 / (section.shear_coefficient * shear_modulus * section.area_mm2)


def _distances_from_tip(stylus: Stylus) -> Array:
    """Distances of the section ends from the tip, from the root on, (sections + 1,)."""
    if len(stylus) == 0:
        raise ValueError("a stylus has at least one section")
    return np.append(np.cumsum([s.length_mm for s in reversed(stylus)])[::-1], 0.0)

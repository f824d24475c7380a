"""Pre-travel: travel of the machine from first contact to the trigger.

It is the sum of three displacements (Ren Eq 5, Wozniak Eq 2): of the transducer (the tripod tilts by the compliance of
its seats, and until a contact is open far enough), of the stylus (bending, shear, compression) and of the contact
between tip and surface (indentation). All are taken along the surface normal, since the tip slides along the surface
freely.

Two signs of the indentation are in the literature. Wozniak *adds* it: the machine travels the indentation, too, so this
is the pre-travel in the indication of a machine, r - R_eff, which a simulated machine must show. Ren *subtracts* it:
this is not the travel of the machine, but the displacement that remains for transducer and stylus if their sum, as
written, is taken as the travel; the two differ by twice the indentation.

Sources: G. Ren, X. Qu, X. Chen, Sensors 2020 (Abbe bench), Eqs 5-15; A. Wozniak, Simple method of 3D error
compensation of triggering probes on coordinate measuring machine, Eq 2; M. Rodrigues 2021, Eq 3.2 (the sensing distance
d_s = d_f / cos(inclination) is the lateral deflection, d_f is the pre-travel).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics.contact import N_PER_MM2_IN_GPA, approach_mm
from stepgauge.physics.trigger import DOWN, Tripod, opening_contact, reaction_slopes, rest_reactions_N

Indentation = Literal["added", "subtracted", "left out"]

_SIGN = {"added": 1.0, "subtracted": -1.0, "left out": 0.0}


@dataclass(frozen=True)
class Elasticity:
    """Compliances of a probe, along and across the stylus.

    Attributes
    ----------
    lateral_mm_per_N, axial_mm_per_N : of the stylus and its carrier, without the seats
    seat_mm_per_N23 : Hertz coefficient k of one of the six contacts, approach = k F^(2/3); 0 = rigid seats
    tip_mm_per_N23 : Hertz coefficient of the tip on the surface; 0 = rigid
    opening_mm : opening of a contact at which the electronics respond (Wozniak's a)
    """

    lateral_mm_per_N: float
    axial_mm_per_N: float = 0.0
    seat_mm_per_N23: float = 0.0
    tip_mm_per_N23: float = 0.0
    opening_mm: float = 0.0


@dataclass(frozen=True)
class Terms:
    """The parts of a pre-travel, arrays (...) in mm, each along the surface normal."""

    transducer_mm: Array
    stylus_mm: Array
    contact_mm: Array

    def total_mm(self, indentation: Indentation = "added") -> Array:
        """L_c + L_p + L_k as Wozniak (``"added"``), L_c + L_p - L_k as Ren (``"subtracted"``), or without L_k."""
        return self.transducer_mm + self.stylus_mm + _SIGN[indentation] * self.contact_mm


def elastic_terms(
    elasticity: Elasticity, force_N: ArrayLike, normal: ArrayLike, push: ArrayLike | None = None
) -> Terms:
    """Pre-travel of a probe whose transducer does not move, such as a piezo probe at its first stage.

    Parameters
    ----------
    force_N : (...) size of the force at the trigger; ``inf`` gives ``inf``
    normal : (..., 3) outward surface normal in the probe's frame
    push : (..., 3) unit vector of the force on the tip, the normal where there is no friction
    """
    n, force = np.asarray(normal, dtype=float), np.asarray(force_N, dtype=float)
    f = n if push is None else np.asarray(push, dtype=float)
    finite = np.where(np.isfinite(force), force, 0.0)
    lateral = elasticity.lateral_mm_per_N * (n[..., 0] * f[..., 0] + n[..., 1] * f[..., 1])
    stylus = finite * (lateral + elasticity.axial_mm_per_N * n[..., 2] * f[..., 2])
    contact = approach_mm(elasticity.tip_mm_per_N23, finite * np.sum(n * f, axis=-1))
    never = np.isinf(force)
    return Terms(np.zeros(force.shape), np.where(never, np.inf, stylus), np.where(never, 0.0, contact))


def kinematic_terms(
    tripod: Tripod,
    elasticity: Elasticity,
    force_N: ArrayLike,
    normal: ArrayLike,
    push: ArrayLike | None = None,
    down: ArrayLike = DOWN,
) -> Terms:
    """Pre-travel of a probe that triggers when its tripod opens a contact; arguments as in :func:`elastic_terms`."""
    terms = elastic_terms(elasticity, force_N, normal, push)
    f = np.asarray(normal if push is None else push, dtype=float)
    finite = np.where(np.isfinite(force_N), force_N, 0.0)
    seats = seat_displacement_mm(tripod, elasticity.seat_mm_per_N23, finite, normal, f, down)
    opening = elasticity.opening_mm * opening_lever(tripod, f, normal, down)
    return Terms(np.where(np.isinf(force_N), 0.0, seats + opening), terms.stylus_mm, terms.contact_mm)


def seat_displacement_mm(
    tripod: Tripod,
    seat_mm_per_N23: float,
    force_N: ArrayLike,
    normal: ArrayLike,
    push: ArrayLike,
    down: ArrayLike = DOWN,
) -> Array:
    """Displacement of the tip along the normal, (...), by the compliance of the six contacts.

    This is Ren's rigid displacement L_c (Eq 7) without his lever ratio L / L_a: by virtual work the tip moves by the
    sum of the changes of approach of all six contacts, each times the change of its reaction per newton at the tip. A
    tripod with rigid seats does not move before the trigger.
    """
    slopes = reaction_slopes(tripod, normal)
    rest = rest_reactions_N(tripod, down)
    loaded = rest + np.asarray(force_N, dtype=float)[..., None] * reaction_slopes(tripod, push)
    change = approach_mm(seat_mm_per_N23, loaded) - approach_mm(seat_mm_per_N23, rest)
    return np.sum(slopes * change, axis=-1)


def opening_lever(tripod: Tripod, push: ArrayLike, normal: ArrayLike, down: ArrayLike = DOWN) -> Array:
    """Displacement of the tip along the normal per unit of opening of the contact that opens first, (...)."""
    first = opening_contact(tripod, push, down)
    slopes = reaction_slopes(tripod, normal)
    lever = -np.take_along_axis(slopes, np.maximum(first, 0)[..., None], axis=-1)[..., 0]
    return np.where(first >= 0, lever, 0.0)


def piezo_force_N(direction: ArrayLike, lateral_N: float, axial_N: float) -> Array:
    """Force (...) at which the sensing element of a two-stage probe responds, from its two thresholds.

    Between across (``lateral_N``) and along the stylus (``axial_N``) the squares of the shares add up. With equal
    thresholds the force is the same in all directions, as Wozniak assumes.
    """
    n = np.asarray(direction, dtype=float)
    lateral = (n[..., 0] ** 2 + n[..., 1] ** 2) / lateral_N**2
    return np.asarray(1.0 / np.sqrt(lateral + n[..., 2] ** 2 / axial_N**2))


@dataclass(frozen=True)
class PretravelLaw:
    """Pre-travel as a function of force in one direction, f(F) = c F^(2/3) + b F, in mm (the shape of Ren Eq 13).

    ``two_thirds_mm`` is the Hertz part in mm/N^(2/3), of the carrier minus or plus of the tip; ``linear_mm`` is the
    beam's in mm/N.
    """

    two_thirds_mm: float
    linear_mm: float

    def pretravel_mm(self, force_N: ArrayLike) -> Array:
        """f(F) in mm, for forces >= 0."""
        root = np.cbrt(np.asarray(force_N, dtype=float))
        return root**2 * (self.two_thirds_mm + self.linear_mm * root)

    def force_N(self, pretravel_mm: ArrayLike) -> Array:
        """The inverse (Ren writes f' in Eq 14): the force at a pre-travel >= 0.

        With x = F^(1/3) this is the positive root of b x^3 + c x^2 = w: one for every w > 0. Found by Newton's method
        from above, where the cubic is convex and the steps never pass the root.

        Raises ``ValueError`` for a beam that is rigid or for a negative pre-travel.
        """
        w = np.asarray(pretravel_mm, dtype=float)
        if self.linear_mm <= 0.0 or np.any(w < 0.0):
            raise ValueError("the inverse needs a beam that bends and a pre-travel that is not negative")
        b, c = self.linear_mm, self.two_thirds_mm
        x = np.cbrt(w / b) + max(-c, 0.0) / b
        for _ in range(60):
            slope = x * (3.0 * b * x + 2.0 * c)
            x = x - np.divide(x**2 * (b * x + c) - w, slope, out=np.zeros_like(x), where=slope > 0.0)
        return x**3


def ren_carrier_mm(
    lever_ratio: float, contact_factor: float, compliance_per_GPa: float, ball_mm: float, pin_mm: float
) -> float:
    """Coefficient of Ren's L_c in mm/N^(2/3) (Eqs 6 and 7).

    Parameters
    ----------
    lever_ratio : L / L_a, tip displacement over displacement at the contact that is relieved
    contact_factor : n_delta of the ball on the pin (0.9744 for equal radii)
    compliance_per_GPa : (1 - mu_1^2) / E_1 + (1 - mu_2^2) / E_2
    ball_mm, pin_mm : radii R_1 and R_2
    """
    curvature = (2.0 * pin_mm + ball_mm) / (pin_mm * ball_mm)
    return lever_ratio * 0.655 * contact_factor * float(np.cbrt(_per_N(compliance_per_GPa) ** 2 * curvature))


def ren_tip_mm(compliance_per_GPa: float, tip_radius_mm: float) -> float:
    """Coefficient of Ren's L_k in mm/N^(2/3) (Eq 11); r is the radius, though the paper calls it a diameter."""
    return 0.8255 * float(np.cbrt(_per_N(compliance_per_GPa) ** 2 / tip_radius_mm))


def ren_law(
    carrier_mm: float, beam_mm_per_N: float, tip_mm: float, indentation: Indentation = "subtracted"
) -> PretravelLaw:
    """Ren's pre-travel L_c + L_p - L_k over the force (Eqs 5, 12, 13), or with the indentation added."""
    return PretravelLaw(carrier_mm + _SIGN[indentation] * tip_mm, beam_mm_per_N)


def _per_N(compliance_per_GPa: float) -> float:
    return compliance_per_GPa / N_PER_MM2_IN_GPA

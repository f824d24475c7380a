"""Probes computed from their construction: the kinematic tripod, and the piezo probe that has one behind its sensor."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics import friction, pretravel, trigger
from stepgauge.probes.base import Probe

UM_PER_MM = 1e3


@dataclass(frozen=True, kw_only=True)
class MechanicalProbe(Probe):
    """A probe with a stylus that bends.

    Attributes
    ----------
    tripod : seat and load of the stylus carrier
    elasticity : its compliances
    tip_friction : coefficient of friction of the tip on the surface (Wozniak's mu)
    seat_friction : coefficient of friction of the arms in their seats (mu_g)
    arm_radius_mm : radius of the arms, for the seat friction
    indentation : sign of the tip's indentation in the pre-travel, see :mod:`stepgauge.physics.pretravel`
    """

    tripod: trigger.Tripod
    elasticity: pretravel.Elasticity
    tip_friction: float = 0.0
    seat_friction: float = 0.0
    arm_radius_mm: float = 0.0
    indentation: pretravel.Indentation = "added"

    @abstractmethod
    def _force_N(self, push: Array) -> Array:
        """Force at the trigger for directions (..., 3) of the force on the tip."""

    @abstractmethod
    def _terms(self, force_N: Array, normal: Array, push: Array) -> pretravel.Terms:
        """Parts of the pre-travel along ``normal``."""

    def pretravel_um(self, approach: ArrayLike) -> Array:
        return UM_PER_MM * self.terms(approach).total_mm(self.indentation)

    def terms(self, approach: ArrayLike) -> pretravel.Terms:
        """The pre-travel by parts, arrays (...) in mm."""
        normal = self.normals(approach)
        push = self._push(normal)
        return self._terms(self._force_N(push), normal, push)

    def trigger_force_N(self, approach: ArrayLike) -> Array:
        return self._force_N(self._push(self.normals(approach)))

    def deflection_um(self, approach: ArrayLike) -> Array:
        push = self._push(self.normals(approach))
        level = push * [1.0, 1.0, 0.0]
        length = np.linalg.norm(level, axis=-1, keepdims=True)
        sideways = np.divide(level, length, out=np.zeros_like(level), where=length > 0.0)
        return UM_PER_MM * self._terms(self._force_N(push), sideways, push).total_mm("left out")

    def _push(self, normal: Array) -> Array:
        if self.tip_friction == 0.0:
            return normal
        lateral = self.elasticity.lateral_mm_per_N
        ratio = self.elasticity.axial_mm_per_N / lateral if lateral > 0.0 else 0.0
        return friction.tip_force_direction(normal, self.tip_friction, ratio)

    def _opening_force_N(self, push: Array) -> Array:
        if self.seat_friction == 0.0:
            return trigger.trigger_force_N(self.tripod, push, self.down)
        return friction.trigger_force_N(self.tripod, push, self.seat_friction, self.arm_radius_mm, self.down)


@dataclass(frozen=True, kw_only=True)
class KinematicProbe(MechanicalProbe):
    """Triggers when the first of six contacts opens."""

    def _force_N(self, push: Array) -> Array:
        return self._opening_force_N(push)

    def _terms(self, force_N: Array, normal: Array, push: Array) -> pretravel.Terms:
        return pretravel.kinematic_terms(self.tripod, self.elasticity, force_N, normal, push, self.down)


@dataclass(frozen=True, kw_only=True)
class PiezoProbe(MechanicalProbe):
    """Two stages: a sensing element latches the position, the tripod behind it confirms the touch later.

    Until the latch the tripod stays in its seat, so no opening enters the pre-travel. Where the tripod would open
    before the element responds, the tripod triggers.

    Attributes
    ----------
    lateral_N, axial_N : force across and along the stylus at which the element responds
    """

    lateral_N: float = field()
    axial_N: float = field()

    def confirmation_force_N(self, approach: ArrayLike) -> Array:
        """Force at which the tripod opens and confirms the touch, (...)."""
        return self._opening_force_N(self._push(self.normals(approach)))

    def _force_N(self, push: Array) -> Array:
        return np.minimum(pretravel.piezo_force_N(push, self.lateral_N, self.axial_N), self._opening_force_N(push))

    def _terms(self, force_N: Array, normal: Array, push: Array) -> pretravel.Terms:
        closed = pretravel.Elasticity(
            self.elasticity.lateral_mm_per_N,
            self.elasticity.axial_mm_per_N,
            self.elasticity.seat_mm_per_N23,
            self.elasticity.tip_mm_per_N23,
        )
        return pretravel.kinematic_terms(self.tripod, closed, force_N, normal, push, self.down)

"""Backlash: the reading depends on the direction from which an axis arrives, on where, and after what way."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects.base import Array, Axis, Displacement, Effect, parameter
from stepgauge.effects.probings import Probings
from stepgauge.effects.scales import bump

STANDSTILL = 1e-6
"""An axis whose share of the approach is below this does not travel; its share is rounding."""


class ReversalError(Effect):
    """The reading depends on the sense of travel: d = (B / 2) sign(p_axis), nothing where the axis stands."""

    kind: ClassVar[str] = "reversal_error"
    equation: ClassVar[str] = "d = (um / 2) sign(approach on the axis)"
    source: ClassVar[str] = "ISO 230-2:2014, reversal error B of an axis"
    covariates: ClassVar[tuple[str, ...]] = ("approach",)
    axis: Axis = parameter(unit="", role="choice", meaning="axis that reverses: x, y or z")
    um: float = parameter(
        unit="um", meaning="reading in positive minus reading in negative travel", ge=-1e4, le=1e4, sensible=(-20, 20)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Plus half in positive travel, minus half in negative travel."""
        return {self.axis: sense(probings, self.axis) * (self.um / 2.0)}


class ReversalWear(Effect):
    """The reversal is larger where a screw is worn: d = (um / 2) sign(p_axis) exp(-4 ln2 ((x - at) / width)^2).

    A bump of the reversal, to be added to that of the whole axis; one wider than the travel is a reversal that grows.
    """

    kind: ClassVar[str] = "reversal_wear"
    equation: ClassVar[str] = "d = (um / 2) sign(approach on the axis) exp(-4 ln2 ((x - at_mm) / width_mm)^2)"
    source: ClassVar[str] = "ISO 230-2:2014, reversal error B by position; a Gaussian of full width at half height"
    covariates: ClassVar[tuple[str, ...]] = ("approach", "coordinate")
    sought: ClassVar[bool] = False
    axis: Axis = parameter(unit="", role="choice", meaning="axis that reverses: x, y or z")
    at_mm: float = parameter(
        unit="mm", role="nonlinear", meaning="coordinate where it is worn most", ge=-1e5, le=1e5, sensible=(-2e3, 2e3)
    )
    width_mm: float = parameter(
        unit="mm", role="nonlinear", meaning="full width at half height", gt=0, le=1e5, sensible=(20, 1000)
    )
    um: float = parameter(
        unit="um", meaning="reversal there, beyond that elsewhere", ge=-1e4, le=1e4, sensible=(-50, 50)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A reversal times a bump."""
        worn = bump(probings.axis_mm(self.axis), self.at_mm, self.width_mm)
        return {self.axis: sense(probings, self.axis) * worn * (self.um / 2.0)}


class StickSlip(Effect):
    """Friction holds an axis back after it has turned: d = (um / 2) sign(p_axis) exp(-s / decay), s the way since then.

    After a touch an axis retracts. Coming on to the next touch in the sense of its approach it has travelled the way
    between the two; from the other side it turns just before the search, s = 0.
    """

    kind: ClassVar[str] = "stick_slip"
    equation: ClassVar[str] = (
        "d = (um / 2) sign(approach on the axis) exp(-s / decay_mm); s: way from the last touch in that sense, else 0"
    )
    source: ClassVar[str] = "presliding friction as a relaxing spring: Armstrong et al., Automatica 30 (1994) 1083"
    covariates: ClassVar[tuple[str, ...]] = ("approach", "order")
    sought: ClassVar[bool] = False
    axis: Axis = parameter(unit="", role="choice", meaning="axis that sticks: x, y or z")
    um: float = parameter(unit="um", meaning="reversal just after turning", ge=-1e4, le=1e4, sensible=(-20, 20))
    decay_mm: float = parameter(
        unit="mm", role="nonlinear", meaning="way in which it falls to 1/e", gt=0, le=1e4, sensible=(0.5, 100)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """What is left of a reversal after the way to the touch."""
        left = np.exp(-probings.run_mm(self.axis) / self.decay_mm)
        return {self.axis: sense(probings, self.axis) * left * (self.um / 2.0)}


def sense(probings: Probings, axis: str) -> Array:
    """+1 in positive travel of an axis, -1 in negative travel, 0 where it stands."""
    share = probings.approach(axis)
    return np.sign(share) * (np.abs(share) > STANDSTILL)

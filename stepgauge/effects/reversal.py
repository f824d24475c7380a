"""Backlash: the reading depends on the direction from which an axis arrives."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects.base import Axis, Displacement, Effect, parameter
from stepgauge.effects.probings import Probings

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
        share = probings.approach(self.axis)
        return {self.axis: (np.sign(share) * (np.abs(share) > STANDSTILL)) * (self.um / 2.0)}

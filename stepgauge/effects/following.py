"""Effects of a recorded temperature, through the first-order lag of a body that takes time to warm."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from stepgauge.effects.base import Array, Axis, Direction, Displacement, Effect, along, parameter
from stepgauge.effects.geometry import PowerOfCoordinate
from stepgauge.effects.motion import moved
from stepgauge.effects.probings import Probings
from stepgauge.effects.thermal import REFERENCE_C, begins_s, hours_since

LAG = "T: the column, or the column minus another, after a first-order lag"


class Following(Effect):
    """A recorded column, or the difference of two, after a first-order lag."""

    column: str = parameter(unit="", role="choice", meaning="recorded temperature, or any other column", min_length=1)
    minus: str | None = parameter(None, unit="", role="choice", meaning="column that is subtracted: a gradient")
    lag_s: float = parameter(
        0.0, unit="s", role="nonlinear", meaning="time constant of the body", ge=0, le=1e9, sensible=(0, 4e4)
    )
    from_C: float | None = parameter(
        None,
        unit="deg C",
        role="fixed",
        meaning="temperature at which it is zero; without it 20, of a difference 0",
        ge=-1e9,
        le=1e9,
    )

    def warmer_K(self, probings: Probings) -> Array:
        """Temperature of the body above ``from_C``, K, (n,)."""
        nothing = (0.0 if self.minus else REFERENCE_C) if self.from_C is None else self.from_C
        warmth = probings.lagged(self.column, self.lag_s) - nothing
        return warmth if self.minus is None else warmth - probings.lagged(self.minus, self.lag_s)


class ThermalExpansionOf(Following):
    """A length follows a recorded temperature: d = um_per_m_K (T - T0) x, of a scale or along the gauge."""

    kind: ClassVar[str] = "thermal_expansion_of"
    equation: ClassVar[str] = f"d = um_per_m_K (T - from_C) x (scale) or S (gauge); {LAG}"
    source: ClassVar[str] = "ISO/TR 16015; first-order lag of a body in air, ISO 230-3:2020"
    covariates: ClassVar[tuple[str, ...]] = ("time", "coordinate")
    of: Literal["x", "y", "z", "gauge"] = parameter(
        unit="", role="choice", meaning="scale x, y or z (indication too long), or the gauge (longer)"
    )
    um_per_m_K: float = parameter(unit="um/(m K)", meaning="growth per length", ge=-1e3, le=1e3, sensible=(-15, 15))

    def displacement_um(self, probings: Probings) -> Displacement:
        """Proportional to the length from machine zero, or from face 1."""
        growth = self.um_per_m_K * 1e-3 * self.warmer_K(probings)
        if self.of == "gauge":
            return {"approach": probings.shifted_along_gauge(growth * probings.certified_mm())}
        return moved(probings, self.of, self.of, growth * probings.axis_mm(self.of))


class ThermalShift(Following):
    """The origin follows a recorded temperature: d = um_per_K (T - T0) along a direction."""

    kind: ClassVar[str] = "thermal_shift"
    equation: ClassVar[str] = f"d = um_per_K (T - from_C) along the direction; {LAG}"
    source: ClassVar[str] = "environmental temperature variation error, ISO 230-3:2020"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    um_per_K: float = parameter(unit="um/K", meaning="shift per kelvin", ge=-1e4, le=1e4, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """The same everywhere in the machine."""
        return along(self.direction, self.um_per_K * self.warmer_K(probings))


class ThermalBending(PowerOfCoordinate, Following):
    """A temperature gradient bends an axis: one of its error motions is d = per_K (T - T0) ((x - about) / 1 m)^order.

    A bar that is warmer at its top by g K per metre of its height bends with the curvature alpha g: straightness error
    alpha g x^2 / 2 (order 2) together with pitch alpha g x (order 1).
    """

    kind: ClassVar[str] = "thermal_bending"
    equation: ClassVar[str] = (
        f"e = per_K (T - from_C) ((x - about_mm) / 1 m)^order; d = e, of a rotation e (axis) x arm; {LAG}"
    )
    source: ClassVar[str] = (
        "bending of a beam by a gradient of temperature, Timoshenko; Bryan, CIRP Annals 39 (1990) 645"
    )
    covariates: ClassVar[tuple[str, ...]] = ("time", "coordinate")
    order: int = parameter(2, unit="", role="choice", meaning="power of the coordinate in metres", ge=0, le=9)
    per_K: float = parameter(
        unit="um or urad per K", meaning="error at 1 m from about_mm", ge=-1e5, le=1e5, sensible=(-20, 20)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """An error motion in proportion to the change of temperature."""
        return self.motion_um(self.per_K * self.warmer_K(probings), probings)


class ScaleWarmUp(Effect):
    """A scale warms up after an event: d = um_per_m x (1 - exp(-t / tau))."""

    kind: ClassVar[str] = "scale_warm_up"
    equation: ClassVar[str] = "d = um_per_m x (1 - exp(-t / time_constant_h)); t = time_s - start_s, zero before"
    source: ClassVar[str] = "first-order warm-up, ISO 230-3:2020; a ball screw after switching on"
    covariates: ClassVar[tuple[str, ...]] = ("time", "coordinate")
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    um_per_m: float = parameter(
        unit="um/m", meaning="indication too long in the end by", ge=-1e4, le=1e4, sensible=(-50, 50)
    )
    time_constant_h: float = parameter(
        unit="h", role="nonlinear", meaning="time constant", gt=0, le=1e4, sensible=(0.05, 5)
    )
    start_s: float = begins_s()

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero before the event, proportional to the coordinate in the end."""
        warmed = -np.expm1(-hours_since(self.start_s, probings) / self.time_constant_h)
        return moved(probings, self.axis, self.axis, self.um_per_m * 1e-3 * warmed * probings.axis_mm(self.axis))

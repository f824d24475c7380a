"""Errors of a scale: they depend on the coordinate of its axis only."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import AXES, Axis, Displacement, Effect, EffectPrior, parameter
from stepgauge.effects.probings import Probings
from stepgauge.effects.waves import sine
from stepgauge.files.arrays import Array


class ScaleError(Effect):
    """The scale is too long or too short: d = ppm 1e-6 x."""

    kind: ClassVar[str] = "scale_error"
    equation: ClassVar[str] = "d = ppm 1e-6 x"
    source: ClassVar[str] = "ISO 230-2:2014, linear part of the systematic deviation; Zhang et al. 1985, EXX"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear", "distances")
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        1.0, 5.0, "errors permitted to bridge machines grow by 2 to 5 um/m", basis="grade", again=1.0
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    ppm: float = parameter(unit="um/m", meaning="indication too long by", ge=-1e5, le=1e5, sensible=(-50, 50))

    def displacement_um(self, probings: Probings) -> Displacement:
        """ppm times the coordinate in metres."""
        return {self.axis: self.ppm * 1e-3 * probings.axis_mm(self.axis)}


class ScaleCurvature(Effect):
    """The error of the scale is quadratic: d = k (x - middle of travel)^2."""

    kind: ClassVar[str] = "scale_curvature"
    equation: ClassVar[str] = "d = um_per_m2 (x - middle of travel)^2"
    source: ClassVar[str] = "quadratic term of the systematic positioning deviation, ISO 230-2:2014"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear")
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.6, 5.0, basis="grade")
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    um_per_m2: float = parameter(
        unit="um/m^2", meaning="coefficient of the square", ge=-1e6, le=1e6, sensible=(-100, 100)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Quadratic about the middle of the travel."""
        middle = probings.setting.travel_mm["xyz".index(self.axis)].mean()
        from_middle_mm = probings.coordinate_mm(self.axis) - middle
        return {self.axis: from_middle_mm * from_middle_mm * (self.um_per_m2 * 1e-6)}


class PeriodicScaleError(Effect):
    """The error of the scale is periodic, as with its pitch: d = A sin(2 pi x / period + phase)."""

    kind: ClassVar[str] = "periodic_scale_error"
    equation: ClassVar[str] = "d = amplitude_um sin(2 pi x / period_mm + phase_deg)"
    source: ClassVar[str] = (
        "subdivisional error of incremental scales and ball screws, Slocum, Precision Machine Design"
    )
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "distances")
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.6, "interpolation and screw pitch", basis="grade")
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    period_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="period along the axis",
        gt=0,
        le=1e4,
        sensible=(0.004, 700),
        grid=grids.periods_along,
        decades=True,
    )
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=0, le=1e3, sensible=(0, 10))
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="phase at coordinate 0", ge=-360, le=360, sensible=(-180, 180)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A sine of the coordinate."""
        wave = sine(1.0 / self.period_mm, probings.axis_mm(self.axis), self.phase_deg)
        return {self.axis: self.amplitude_um * wave}


class LocalScaleDefect(Effect):
    """The scale has an error at one position: d = h exp(-4 ln2 ((x - at) / width)^2), wherever the gauge lies."""

    kind: ClassVar[str] = "local_scale_defect"
    equation: ClassVar[str] = "d = height_um exp(-4 ln2 ((x - at_mm) / width_mm)^2)"
    source: ClassVar[str] = "Gaussian; width_mm is its full width at half height"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.6, 1.0, "dirt or a chip under a tape", basis="grade")
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    at_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="machine coordinate of the middle",
        ge=-1e5,
        le=1e5,
        sensible=(-2e3, 2e3),
        edge=True,
        grid=grids.places_mm,
    )
    width_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="full width at half height",
        gt=0,
        le=1e4,
        sensible=(5, 200),
        grid=grids.widths_mm,
    )
    height_um: float = parameter(unit="um", meaning="height", ge=-1e4, le=1e4, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """A Gaussian of the coordinate."""
        return {self.axis: self.height_um * bump(probings.axis_mm(self.axis), self.at_mm, self.width_mm)}


class ScaleJoint(Effect):
    """Two scales are joined: beyond the joint d = size ((x - at) / 1 m)^order, a step (order 0) or a slope (1)."""

    kind: ClassVar[str] = "scale_joint"
    equation: ClassVar[str] = "d = size ((x - at_mm) / 1 m)^order where x >= at_mm, else 0"
    source: ClassVar[str] = "tapes and racks laid end to end: gap or difference in pitch; definition"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.2, 2.0, "tapes and racks laid end to end", basis="grade")
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    order: int = parameter(
        1, unit="", role="choice", meaning="0: a gap in um, 1: a slope in um/m", ge=0, le=1, grid=grids.values(0, 1)
    )
    at_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="coordinate of the joint",
        ge=-1e5,
        le=1e5,
        sensible=(-2e3, 2e3),
        edge=True,
        grid=grids.joints_mm,
    )
    size: float = parameter(
        unit="um or um/m", meaning="error beyond the joint minus error before it", ge=-1e5, le=1e5, sensible=(-50, 50)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero before the joint."""
        beyond = probings.axis_mm(self.axis) - self.at_mm
        return {self.axis: self.size * np.where(beyond >= 0.0, (beyond * 1e-3) ** self.order, 0.0)}


class ScrewError(Effect):
    """A screw or its gear has a periodic error: d = A sin(2 pi order gear x / pitch + phase)."""

    kind: ClassVar[str] = "screw_error"
    equation: ClassVar[str] = "d = amplitude_um sin(2 pi order gear x / pitch_mm + phase_deg)"
    source: ClassVar[str] = (
        "cyclic error of ball screws and their drives, ISO 230-2:2014; Slocum, Precision Machine Design"
    )
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = AXES
    sought: ClassVar[bool] = False
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the screw: x, y or z")
    pitch_mm: float = parameter(
        unit="mm", role="nonlinear", meaning="travel per revolution of the screw", gt=0, le=1e3, sensible=(1, 50)
    )
    order: int = parameter(1, unit="", role="choice", meaning="periods per revolution", ge=1, le=100)
    gear: float = parameter(
        1.0,
        unit="1",
        role="fixed",
        meaning="revolutions of the part with the error per revolution of the screw",
        gt=0,
        le=1e4,
    )
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=0, le=1e3, sensible=(0, 20))
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="phase at coordinate 0", ge=-360, le=360, sensible=(-180, 180)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A sine of the revolutions."""
        wave = sine(self.order * self.gear / self.pitch_mm, probings.axis_mm(self.axis), self.phase_deg)
        return {self.axis: self.amplitude_um * wave}


def bump(x: Array, at: float, width: float) -> Array:
    """A Gaussian of height 1 and of a full width at half height."""
    u = (x - at) * (2.0 * np.sqrt(np.log(2.0)) / width)
    return np.exp(-u * u)

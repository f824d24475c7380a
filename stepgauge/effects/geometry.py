"""Rigid-body errors of the guideways: straightness, rotations with their Abbe arms, squareness.

With the scale errors they make the 21 errors of a three-axis machine (Zhang et al., CIRP Annals 34/1, 1985; ISO
230-1:2012): three positioning errors, six straightness errors, nine rotations and three squareness errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import model_validator

from stepgauge.effects import grids
from stepgauge.effects.base import GAUGE, Axis, Displacement, Effect, EffectPrior, Wording, parameter
from stepgauge.effects.motion import COMPONENTS, Component, moved, reference_point, um_or_mrad
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array
from stepgauge.files.config import Vector3

_SQUARE = {"xy": ("x", "y"), "xz": ("x", "z"), "yz": ("y", "z")}


class Squareness(Effect):
    """Two axes are not perpendicular: the first indicates more with the second, d_first = angle * second.

    The second axis then leans towards - of the first: a positive angle is one of more than 90 deg between them.
    """

    kind: ClassVar[str] = "squareness"
    equation: ClassVar[str] = "d_first = urad 1e-6 second"
    source: ClassVar[str] = "ISO 230-1:2012, squareness; Zhang et al. 1985"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        1.0, 8.0, "ISO 10791-1 permits 40 urad; a workshop square shows 300", basis="grade", most=300.0
    )
    words: ClassVar[Wording | None] = Wording(
        "squareness",
        "The axes {plane} are at {urad} {urad:over|under} 90 deg between their + directions (10 urad are 1 um in"
        " 100 mm): up to {largest} in this recording.",
        "Measure the squareness of {plane} by other means: {steps:a square and a dial gauge|a square, or a ball"
        " plate}.",
        "{steps:Frame: + end of {plane:second} {urad:±mm per 100 mm}|Turn {plane:second} by {urad:±}, its + end}"
        " towards {urad:+|-}{plane:first}; or enter this angle of {plane} in the controller.",
        german=Wording(
            "Rechtwinkligkeit",
            "Zwischen den Plusrichtungen von {plane} liegen {urad} {urad:mehr|weniger} als 90 Grad (10 urad sind 1 um"
            " auf 100 mm): bis {largest} in diesen Messdaten.",
            "Die Rechtwinkligkeit {plane} anders messen: mit einem Winkel {steps:und einer Messuhr|oder einer"
            " Kugelplatte}.",
            "{steps:Rahmen: Ende von {plane:second} bei + um {urad:±mm auf 100 mm}|{plane:second} um {urad:±} drehen,"
            " das Ende bei +} nach {urad:+|-}{plane:first}; oder diesen Winkel von {plane} in die Steuerung eingeben.",
        ),
    )
    plane: Literal["xy", "xz", "yz"] = parameter(unit="", role="choice", meaning="plane of the two axes")
    urad: float = parameter(
        unit="urad",
        meaning="angle between the + directions of the two axes, over 90 deg",
        ge=-1e5,
        le=1e5,
        sensible=(-100, 100),
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """The second coordinate in metres times the angle, on the first axis."""
        first, second = _SQUARE[self.plane]
        return moved(probings, second, first, self.urad * 1e-3 * probings.axis_mm(second))


class Straightness(Effect):
    """A guideway is not straight but a parabola: d = um (1 - (2 (x - middle) / length)^2) across the travel."""

    kind: ClassVar[str] = "straightness"
    equation: ClassVar[str] = "d_direction = um (1 - (2 (x - middle of travel) / length_mm)^2)"
    source: ClassVar[str] = "ISO 230-1:2012, straightness, as a parabola with sagitta um over length_mm"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.25,
        1.5,
        "a straightedge shows 0.15 mm; guideways of one machine are of one grinding and age",
        basis="grade",
        most=150.0,
        unit="um over the travel",
        again=0.5,
    )
    words: ClassVar[Wording | None] = Wording(
        "straightness",
        "The {axis} guideway is curved towards {um:+|-}{direction} by {um} in the middle of {length_mm:4}.",
        "Measure the straightness of {axis} with a straightedge or a laser.",
        "Enter it in the error map, or level the bed.",
        german=Wording(
            "Geradheit",
            "Die Führung {axis} ist in der Mitte von {length_mm:4} um {um} nach {um:+|-}{direction} gekrümmt.",
            "Die Geradheit von {axis} mit einem Lineal oder Laser messen.",
            "In die Fehlerkarte eingeben oder das Bett ausrichten.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis of travel: x, y or z")
    direction: Axis = parameter(unit="", role="choice", meaning="axis that is displaced, not the axis of travel")
    um: float = parameter(unit="um", meaning="sagitta of the parabola", ge=-1e4, le=1e4, sensible=(-20, 20))
    length_mm: float = parameter(
        unit="mm", role="fixed", meaning="chord of the parabola, about the middle of the travel", gt=0, le=1e5
    )

    @model_validator(mode="after")
    def _across(self) -> Straightness:
        return _different(self, self.axis, self.direction, "direction", "scale_curvature")

    def displacement_um(self, probings: Probings) -> Displacement:
        """A parabola: um in the middle of the travel, 0 half a length from there."""
        middle = probings.setting.travel_mm["xyz".index(self.axis)].mean()
        u = (probings.coordinate_mm(self.axis) - middle) * (2.0 / self.length_mm)
        return moved(probings, self.axis, self.direction, self.um * (1.0 - u * u))


class AngularError(Effect):
    """The carriage rotates as it travels: d = e(x) r x arm, e = urad_per_m x (pitch, yaw, or roll about its own axis).

    The arm is from the reference point of the carriage, in the machine's chain of axes, to the tip. Without a chain it
    begins at the line of the scale of this axis (``scale_at_mm``) and moves with the carriage, so it has no component
    along the travel. Pitch and yaw act along the travel (Abbe), roll across it.
    """

    kind: ClassVar[str] = "angular_error"
    equation: ClassVar[str] = "d = urad_per_m 1e-6 x (rotation axis) x (tip - scale line)"
    source: ClassVar[str] = "Abbe 1890; Bryan, Precision Engineering 1 (1979) 129; Zhang et al. 1985, EAX to ECZ"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.4, 10.0, "pitch and yaw of bridge machines, ISO 230-1", basis="grade", most=300.0
    )
    words: ClassVar[Wording | None] = Wording(
        "angular error",
        "The {travel_axis} carriage rotates about {rotation_axis} by {urad_per_m} of travel; the error of a"
        " length is this rotation times its distance from the scale (Abbe).",
        "Measure the angle of the {travel_axis} carriage with an autocollimator, or, where it is no rotation about the"
        " vertical, with an electronic level.",
        "Enter it in the error map; look at bearings and preload of the {travel_axis} carriage.",
        german=Wording(
            "Winkelabweichung des Schlittens",
            "Der Schlitten {travel_axis} dreht sich auf seinem Weg um {rotation_axis}, um {urad_per_m}; der"
            " Fehler einer Länge ist diese Drehung mal ihrem Abstand vom Maßstab (Abbe).",
            "Den Winkel des Schlittens {travel_axis} mit einem Autokollimator messen, oder, wo er keine Drehung um"
            " die Senkrechte ist, mit einer elektronischen Libelle.",
            "In die Fehlerkarte eingeben; Lager und Vorspannung des Schlittens {travel_axis} ansehen.",
        ),
    )
    travel_axis: Axis = parameter(unit="", role="choice", meaning="axis that travels: x, y or z")
    rotation_axis: Axis = parameter(unit="", role="choice", meaning="axis about which the carriage rotates: x, y or z")
    urad_per_m: float = parameter(unit="urad/m", meaning="rotation per travel", ge=-1e5, le=1e5, sensible=(-100, 100))
    scale_at_mm: Vector3 | None = reference_point()

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """A rotation about the axis of travel is a roll."""
        return bool(choices["travel_axis"] != choices["rotation_axis"])

    def displacement_um(self, probings: Probings) -> Displacement:
        """Angle times arm, on the axes across the rotation."""
        angle_mrad = probings.axis_mm(self.travel_axis) * (self.urad_per_m * 1e-6)
        return moved(probings, self.travel_axis, f"r{self.rotation_axis}", angle_mrad, self.scale_at_mm)


class Roll(Effect):
    """The carriage rolls about its axis of travel: d = e(x) t x arm, e = urad_per_m x."""

    kind: ClassVar[str] = "roll"
    equation: ClassVar[str] = "d = urad_per_m 1e-6 x (travel axis) x (tip - scale line)"
    source: ClassVar[str] = "Zhang et al. 1985, EAX, EBY, ECZ; the same as angular_error with both axes equal"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.15, 10.0, basis="grade", most=300.0)
    words: ClassVar[Wording | None] = Wording(
        "roll",
        "The {axis} carriage rolls by {urad_per_m} of its travel.",
        "Measure the roll of the {axis} carriage with electronic levels, about a vertical one with a square and dial.",
        "Enter it in the error map.",
        german=Wording(
            "Rollen des Schlittens",
            "Der Schlitten {axis} rollt auf seinem Weg um {urad_per_m}.",
            "Das Rollen des Schlittens {axis} mit elektronischen Libellen messen, um eine senkrechte Achse mit Winkel"
            " und Messuhr.",
            "In die Fehlerkarte eingeben.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis of travel: x, y or z")
    urad_per_m: float = parameter(unit="urad/m", meaning="rotation per travel", ge=-1e5, le=1e5, sensible=(-100, 100))
    scale_at_mm: Vector3 | None = reference_point()

    def displacement_um(self, probings: Probings) -> Displacement:
        """Angle times arm, on the two axes across the travel."""
        angle_mrad = probings.axis_mm(self.axis) * (self.urad_per_m * 1e-6)
        return moved(probings, self.axis, f"r{self.axis}", angle_mrad, self.scale_at_mm)


class PowerOfCoordinate(Effect):
    """One error motion of an axis, as a power of the axis' coordinate in metres, counted from ``about_mm``."""

    axis: Axis = parameter(unit="", role="choice", meaning="axis of travel: x, y or z")
    component: Component = parameter(unit="", role="choice", meaning=COMPONENTS)
    order: int = parameter(
        1, unit="", role="choice", meaning="power of the coordinate in metres", ge=0, le=9, grid=grids.values(2, 3)
    )
    about_mm: float = parameter(
        0.0, unit="mm", role="fixed", meaning="origin of the power", ge=-1e5, le=1e5, grid=grids.middle_mm
    )
    scale_at_mm: Vector3 | None = reference_point()

    def motion_um(self, coefficient: Array | float, probings: Probings) -> Displacement:
        """The power times ``coefficient`` (um or urad at 1 m), rotations act with their arm."""
        metres = (probings.axis_mm(self.axis) - self.about_mm) * 1e-3
        amount = um_or_mrad(coefficient * metres**self.order, self.component)
        return moved(probings, self.axis, self.component, amount, self.scale_at_mm)

    def unit_of(self, name: str) -> str:
        """Of a rotation an angle, else a length."""
        out = "um or " if self.component.startswith("r") else " or urad"
        return super().unit_of(name).replace(out, "")


class ErrorMotion(PowerOfCoordinate):
    """One of the 21 errors of a machine as a power of its axis' coordinate: d = coefficient ((x - about) / 1 m)^order.

    A positioning or straightness error in um, or a rotation in urad, which acts with the arm of
    :class:`AngularError`. Powers add up to a polynomial; order 1 across the travel is squareness.
    """

    kind: ClassVar[str] = "error_motion"
    equation: ClassVar[str] = "e = coefficient ((x - about_mm) / 1 m)^order; d = e, of a rotation e (axis) x arm"
    source: ClassVar[str] = "ISO 230-1:2012, linear and angular error motions; Zhang et al. 1985, EXX to ECZ"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.15, 30.0, "what is left of a guideway beyond a bow", basis="grade", most=3000.0, unit="um/m^3 or urad/m^2"
    )
    words: ClassVar[Wording | None] = Wording(
        "error motion",
        "The {axis} axis errs in {component} (r: a rotation) with the power {order} of its coordinate, up to"
        " {largest} in this recording.",
        "Measure this error motion of {axis} with a laser, an autocollimator or levels.",
        "Enter it in the error map.",
        german=Wording(
            "Bewegungsabweichung",
            "Die Achse {axis} weicht in {component} (r: eine Drehung) mit der Potenz {order} ihrer Koordinate"
            " ab, in diesen Messdaten bis {largest}.",
            "Diese Bewegungsabweichung von {axis} mit Laser, Autokollimator oder Libellen messen.",
            "In die Fehlerkarte eingeben.",
        ),
    )
    coefficient: float = parameter(
        unit="um or urad", meaning="error at 1 m from about_mm", ge=-1e6, le=1e6, sensible=(-50, 50)
    )

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Lower orders have laws of their own."""
        return bool(choices["order"] == (2 if choices["component"].startswith("r") else 3))

    def displacement_um(self, probings: Probings) -> Displacement:
        """A power of the coordinate; rotations with their arm."""
        return self.motion_um(self.coefficient, probings)


def _different(effect: Straightness, travel: str, other: str, key: str, instead: str) -> Straightness:
    if travel == other:
        raise ValueError(f"{key} across the travel axis {travel} (along it use kind {instead})")
    return effect

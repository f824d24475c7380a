"""Effects of a recorded temperature, through the first-order lag of a body that takes time to warm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import (
    AXES,
    GAUGE,
    Axis,
    Direction,
    Displacement,
    Effect,
    EffectPrior,
    Wording,
    along,
    parameter,
)
from stepgauge.effects.geometry import PowerOfCoordinate
from stepgauge.effects.motion import moved
from stepgauge.effects.probings import Probings
from stepgauge.effects.thermal import REFERENCE_C, begins_s, hours_since
from stepgauge.files.arrays import Array

LEAST_VARIED = 0.1
"""Share of a temperature above that at which an effect is zero that must be variation, both root mean square."""
SAME_PART = 10.0
"""Odds that an effect follows thermometers on the part that it moves, over others: they are there for that."""
PART_OF = {"gauge_temperature_C": "gauge"} | {f"scale_temperature_{axis}_C": axis for axis in "xyz"}
"""The documented columns of temperatures, and the part that each is read on: an axis with its scale, or the gauge."""
LAG = "T: the column, or the column minus another, after a first-order lag"


class Following(Effect):
    """A recorded column, or the difference of two, after a first-order lag."""

    column: str = parameter(
        unit="",
        role="choice",
        meaning="recorded temperature, or any other column",
        min_length=1,
        grid=grids.temperatures,
    )
    minus: str | None = parameter(
        None,
        unit="",
        role="choice",
        meaning="column that is subtracted: a gradient",
        grid=grids.no_or_another_temperature,
    )
    lag_s: float = parameter(
        0.0,
        unit="s",
        role="nonlinear",
        meaning="time constant of the body",
        ge=0,
        le=1e9,
        sensible=(0, 4e4),
        grid=grids.lags_s,
        odds=1.0,
    )
    from_C: float | None = parameter(
        None,
        unit="deg C",
        role="fixed",
        meaning="temperature at which it is zero; without it 20, of a difference 0",
        ge=-1e9,
        le=1e9,
    )

    @classmethod
    def varies(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Whether the temperature varies, beside what it is above that at which the effect is zero."""
        column = Following.model_construct(column=choices["column"], minus=choices.get("minus"), lag_s=0.0, from_C=None)
        warmer_K = column.warmer_K(probings)
        return bool(warmer_K.std() >= LEAST_VARIED * np.sqrt(np.mean(warmer_K**2)))

    @classmethod
    def preference(cls, choices: Mapping[str, Any]) -> float:
        """A thermometer tells of the part that it is on, and a part bends by a difference within itself.

        That between two parts, or one temperature alone, bends it only as far as it stands for such a difference.
        """
        part, minus = choices.get("of", choices.get("axis")), choices.get("minus") or ""
        if part is None:
            return 1.0
        if on_one_part(choices["column"], minus):
            return SAME_PART
        return 1.0 if {PART_OF.get(name, part) for name in (choices["column"], minus)} == {part} else 1.0 / SAME_PART

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
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.6,
        5.0,
        "steel has 11.5, of which some is compensated, aluminium 24; a fifth of what is corrected",
        most=30.0,
    )
    words: ClassVar[Wording | None] = Wording(
        "thermal expansion",
        "Lengths of {of} change with {column}{minus: less {minus}|}{lag_s:, {lag_s:3} late|}, by {um_per_m_K}: up"
        " to {largest} in this recording.",
        "Compare the recorded temperature {column} with a calibrated thermometer.",
        "Correct by this temperature, or keep it constant.",
        german=Wording(
            "Wärmeausdehnung",
            "Längen ({of}) ändern sich mit {column}{minus: minus {minus}|}{lag_s:, um {lag_s:3} verzögert|}, um"
            " {um_per_m_K}: bis {largest} in diesen Messdaten.",
            "Die aufgezeichnete Temperatur {column} mit einem kalibrierten Thermometer vergleichen.",
            "Mit dieser Temperatur korrigieren oder sie konstant halten.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "thermal expansion",
        "In proportion to position the readings follow {column}{minus: less {minus}|}{lag_s:, {lag_s:3} late|},"
        " by {um_per_m_K}: the scale, or what realises the targets, expands.",
        "Compare the recorded temperature {column} with a calibrated thermometer.",
        "Correct by this temperature, or keep it constant.",
        german=Wording(
            "Wärmeausdehnung",
            "Im Verhältnis zur Position folgen die Werte {column}{minus: minus {minus}|}{lag_s:, um {lag_s}"
            " verzögert|}, um {um_per_m_K}: Der Maßstab oder was die Ziele darstellt dehnt sich aus.",
            "Die aufgezeichnete Temperatur {column} mit einem kalibrierten Thermometer vergleichen.",
            "Mit dieser Temperatur korrigieren oder sie konstant halten.",
        ),
    )
    of: Literal["x", "y", "z", "gauge"] = parameter(
        unit="", role="choice", meaning="scale x, y or z (indication too long), or the gauge (longer)"
    )
    um_per_m_K: float = parameter(unit="um/(m K)", meaning="growth per length", ge=-1e3, le=1e3, sensible=(-15, 15))

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """A length that follows a constant temperature is a scale error."""
        return choices.get("minus") is None and cls.varies(choices, probings)

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
    process: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.6, 2.0, "10 to 200 mm of steel between what is measured and held, at most a metre of aluminium", most=30.0
    )
    words: ClassVar[Wording | None] = Wording(
        "thermal shift",
        "The readings move along {direction} with {column}{minus: less {minus}|}{lag_s:, {lag_s:3} late|}, by"
        " {um_per_K}: up to {largest} in this recording.",
        "Compare the recorded temperature {column} with a calibrated thermometer.",
        "Keep this temperature constant, or measure a reference point again and again.",
        german=Wording(
            "thermische Verschiebung",
            "Die Werte wandern längs {direction} mit {column}{minus: minus {minus}|}{lag_s:, um {lag_s}"
            " verzögert|}, um {um_per_K}: bis {largest} in diesen Messdaten.",
            "Die aufgezeichnete Temperatur {column} mit einem kalibrierten Thermometer vergleichen.",
            "Diese Temperatur konstant halten oder einen Bezugspunkt immer wieder messen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "thermal shift",
        "All readings follow {column}{minus: less {minus}|}{lag_s:, {lag_s:3} late|} alike, by {um_per_K}: zero"
        " moves, not the scale.",
        "Compare the recorded temperature {column} with a calibrated thermometer; look at what holds the"
        " instrument and the part.",
        "Keep this temperature constant, or read a reference again and again.",
        german=Wording(
            "thermische Verschiebung",
            "Alle Werte folgen {column}{minus: minus {minus}|}{lag_s:, um {lag_s:3} verzögert|} gleich, um"
            " {um_per_K}: Der Nullpunkt wandert, nicht der Maßstab.",
            "Die aufgezeichnete Temperatur {column} mit einem kalibrierten Thermometer vergleichen; ansehen,"
            " was Messgerät und Werkstück hält.",
            "Diese Temperatur konstant halten oder einen Bezug immer wieder ablesen.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    um_per_K: float = parameter(unit="um/K", meaning="shift per kelvin", ge=-1e4, le=1e4, sensible=(-20, 20))

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """A difference of two temperatures bends what is between them."""
        return choices.get("minus") is None

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
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.2,
        3.0,
        "11.5 urad/m for 1 K/m of height; an aluminium beam 0.15 m high: 150 urad/m by 1 K across it",
        most=100.0,
        unit="um or urad per K at 1 m",
    )
    words: ClassVar[Wording | None] = Wording(
        "thermal bending",
        "The {axis} guideway bends in {component} (r: a rotation) with {column}{minus: less {minus}|}{lag_s:,"
        " {lag_s} late|}, by {per_K}: up to {largest} in this recording.",
        "Look for what heats one side of {axis}: sun, a lamp, an electrical cabinet.",
        "Remove or shield the source of heat.",
        german=Wording(
            "thermische Biegung",
            "Die Führung {axis} biegt sich in {component} (r: eine Drehung) mit {column}{minus: minus"
            " {minus}|}{lag_s:, um {lag_s:3} verzögert|}, um {per_K}: bis {largest} in diesen Messdaten.",
            "Suchen, was eine Seite von {axis} wärmt: Sonne, eine Lampe, ein Schaltschrank.",
            "Die Wärmequelle entfernen oder abschirmen.",
        ),
    )
    order: int = parameter(
        2, unit="", role="choice", meaning="power of the coordinate in metres", ge=0, le=9, grid=grids.values(1, 2)
    )
    per_K: float = parameter(
        unit="um or urad per K", meaning="error at 1 m from about_mm", ge=-1e5, le=1e5, sensible=(-20, 20)
    )

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """A beam bends, it grows elsewhere; a bending by a constant temperature is a straightness or a pitch."""
        own_axis, turns = choices["component"].endswith(choices["axis"]), choices["component"].startswith("r")
        twice = choices.get("minus") is not None and choices["column"] >= choices["minus"]
        return bool(
            choices["order"] == (1 if turns else 2) and not own_axis and not twice and cls.varies(choices, probings)
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
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear")
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.3, 10.0, "a screw warms by 1 K in use", again=1.0)
    words: ClassVar[Wording | None] = Wording(
        "scale warm-up",
        "The {axis} scale warms with a time constant of {time_constant_h} and reads {um_per_m} too"
        " {um_per_m:long|short} in the end.",
        "Log the temperature of the {axis} scale from switching on.",
        "Warm the machine up before measuring.",
        german=Wording(
            "Warmlaufen des Maßstabs",
            "Der Maßstab {axis} erwärmt sich mit einer Zeitkonstante von {time_constant_h} und zeigt am Ende um"
            " {um_per_m} zu {um_per_m:viel|wenig} an.",
            "Die Temperatur des Maßstabs {axis} vom Einschalten an aufzeichnen.",
            "Die Maschine vor der Messung warmlaufen lassen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "scale warm-up",
        "In proportion to position the readings change with a time constant of {time_constant_h}, in the end by"
        " {um_per_m}: the scale, the screw, or what realises the targets, warms up.",
        "Log the temperature of the scale or screw from switching on.",
        "Drive the axis over its travel until it is warm before measuring.",
        german=Wording(
            "Warmlaufen des Maßstabs",
            "Im Verhältnis zur Position ändern sich die Werte mit einer Zeitkonstante von {time_constant_h}, am Ende um"
            " {um_per_m}: Der Maßstab, die Spindel oder was die Ziele darstellt erwärmt sich.",
            "Die Temperatur von Maßstab oder Spindel vom Einschalten an aufzeichnen.",
            "Die Achse vor der Messung über ihren Weg fahren, bis sie warm ist.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis of the scale: x, y or z")
    um_per_m: float = parameter(
        unit="um/m", meaning="indication too long in the end by", ge=-1e4, le=1e4, sensible=(-50, 50)
    )
    time_constant_h: float = parameter(
        unit="h",
        role="nonlinear",
        meaning="time constant",
        gt=0,
        le=1e4,
        sensible=(0.05, 5),
        grid=grids.time_constants_h,
    )
    start_s: float = begins_s(grids.values(None))

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero before the event, proportional to the coordinate in the end."""
        warmed = -np.expm1(-hours_since(self.start_s, probings) / self.time_constant_h)
        return moved(probings, self.axis, self.axis, self.um_per_m * 1e-3 * warmed * probings.axis_mm(self.axis))


def on_one_part(one: str, other: str) -> bool:
    """Whether two thermometers are on the same part of a machine, as far as names tell: they begin with the same word.

    The documented columns of gauge and scales are of different parts, and a name that begins with the quantity tells
    of none.
    """
    first, second = (name.split("_")[0].lower() for name in (one, other))
    return first == second and not first.startswith(("temp", "gauge", "scale"))

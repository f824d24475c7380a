"""Temperature: gauge and scales that are warmer than recorded, a gauge that soaks, and drift.

The reference temperature is 20 deg C. In a gauge at T each position is longer by alpha (T - 20). In a scale at T the
graduation is expanded by 1 + alpha_s (T - 20) about machine zero: without compensation the indication is
x / (1 + alpha_s (T - 20)), too short; a controller that compensates multiplies by 1 + alpha_s (T_recorded - 20) and
indicates x if its sensor has no error.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import (
    GAUGE,
    Axis,
    Direction,
    Displacement,
    Effect,
    EffectPrior,
    Grid,
    Wording,
    along,
    parameter,
)
from stepgauge.effects.probings import Probings
from stepgauge.effects.waves import sine
from stepgauge.files.arrays import Array

LIKE_DIRECTIONS = 0.1
"""Cosine to an axis below which a gauge hardly lies along it."""
LATE = 0.2
"""Odds of what begins during the measurement, over what was there before."""
REFERENCE_C = 20.0
"""Reference temperature of lengths, ISO 1."""


def begins_s(grid: Grid) -> Any:
    """The parameter of effects that begin at an event: switching on, an opened door, the first coolant."""
    meaning = "time at which it begins; nothing before"
    return parameter(
        0.0,
        unit="s",
        role="nonlinear",
        meaning=meaning,
        sensible=(0, 1e4),
        grid=grid,
        clock=True,
        odds=LATE,
        ge=-1e12,
        le=1e12,
    )


def hours_since(start_s: float | Array, probings: Probings) -> Array:
    """Time since an event, h; 0 before it."""
    return np.maximum(probings.time_s - start_s, 0.0) / 3600.0


def _expanded(warmer_K: float | Array, probings: Probings) -> Displacement:
    """Of a gauge that is warmer than recorded, by a number or in every row, each face moves in proportion to S."""
    shift_um = probings.expand_faces(probings.gauge.position_mm * (probings.gauge.table.expansion_per_K * 1e3))
    return {"approach": probings.shifted_along_gauge(warmer_K * shift_um)}


class GaugeTemperature(Effect):
    """The gauge is warmer than the recording says: its faces move alpha delta S along the gauge from face 1."""

    kind: ClassVar[str] = "gauge_temperature"
    equation: ClassVar[str] = "d = expansion_per_K delta_K S along the gauge axis"
    source: ClassVar[str] = "ISO 1:2022 and ISO/TR 16015; steel: 11.5 um/m per K"
    covariates: ClassVar[tuple[str, ...]] = ("position",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        1.0, 0.3, "a thermometer that is off, or soaking that takes longer than the run"
    )
    words: ClassVar[Wording | None] = Wording(
        "gauge temperature",
        "The thermometer of the gauge is off, or does not touch it: the gauge is {delta_K} {delta_K:warmer|colder}"
        " than recorded, besides the stated u: up to {largest} in this recording.",
        "Measure the temperature on the bar of the gauge with a calibrated thermometer, before and after a run.",
        "Wait until the gauge has the temperature of the machine; record its temperature.",
        german=Wording(
            "Temperatur des Stufenendmaßes",
            "Der Fühler am Stufenendmaß zeigt falsch oder liegt nicht an: Es ist um {delta_K}"
            " {delta_K:wärmer|kälter} als aufgezeichnet, neben der angegebenen u: bis {largest} in diesen Messdaten.",
            "Die Temperatur am Stufenendmaß mit einem kalibrierten Thermometer messen, vor und nach einer Messung.",
            "Warten, bis das Stufenendmaß die Temperatur der Maschine hat; seine Temperatur aufzeichnen.",
        ),
    )
    delta_K: float = parameter(
        unit="K", meaning="true minus recorded gauge temperature", ge=-40, le=40, sensible=(-5, 5)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Proportional to the certified position of the face."""
        return _expanded(self.delta_K, probings)


class GaugeSoaking(Effect):
    """The gauge takes on the temperature of its surroundings: at first its faces are off by alpha delta S.

    It came from a store or a car, or hands warmed it when it was laid.
    """

    kind: ClassVar[str] = "gauge_soaking"
    equation: ClassVar[str] = (
        "d = expansion_per_K delta_K S exp(-t / time_constant_h) along the gauge axis;"
        " t = time_s - start_s, nothing before; or since the first probing of each placement"
    )
    source: ClassVar[str] = "ISO/TR 16015; a body with one time constant in air (Newton's law of cooling)"
    covariates: ClassVar[tuple[str, ...]] = ("position", "time")
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.6, 0.5, "from a store into the room, or in the hands when it is laid"
    )
    words: ClassVar[Wording | None] = Wording(
        "gauge soaking",
        "The gauge begins {delta_K} {delta_K:warmer|colder} than recorded ({warmed}) and takes on the"
        " temperature of its surroundings with a time constant of {time_constant_h}.",
        "Log the temperature on the bar of the gauge from the moment it is laid.",
        "Let the gauge soak for three time constants before measuring; lay it with gloves.",
        german=Wording(
            "Angleichen des Stufenendmaßes",
            "Das Stufenendmaß ist anfangs um {delta_K} {delta_K:wärmer|kälter} als aufgezeichnet und gleicht"
            " sich mit einer Zeitkonstante von {time_constant_h} der Umgebung an.",
            "Die Temperatur am Stufenendmaß vom Auflegen an aufzeichnen.",
            "Vor der Messung drei Zeitkonstanten warten; mit Handschuhen auflegen.",
        ),
    )
    warmed: Literal["once", "anew"] = parameter(
        "once", unit="", role="choice", meaning="warmed once, before start_s, or anew before each placement"
    )
    delta_K: float = parameter(unit="K", meaning="at first warmer than recorded by", ge=-200, le=200, sensible=(-5, 5))
    time_constant_h: float = parameter(
        unit="h", role="nonlinear", meaning="time constant", gt=0, le=1e4, sensible=(0.05, 5), grid=grids.soaking_h
    )
    start_s: float = begins_s(grids.values(None))

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Of one placement both ways of warming are the same."""
        return bool(choices["warmed"] == "once" or np.ptp(probings.column("placement")) > 0)

    def displacement_um(self, probings: Probings) -> Displacement:
        """Proportional to the certified position of the face, and less with time."""
        once = self.warmed == "once"
        hours = (probings.time_s - self.start_s if once else probings.since_placed_s()) / 3600.0
        warmer_K = self.delta_K * np.exp(-np.maximum(hours, 0.0) / self.time_constant_h) * (hours >= 0.0)
        return _expanded(warmer_K, probings)


class ScaleTemperature(Effect):
    """A scale is warmer than the recording says: d = -alpha_s delta x, since its graduation expands."""

    kind: ClassVar[str] = "scale_temperature"
    equation: ClassVar[str] = "d = -scale_expansion_per_K delta_K x"
    source: ClassVar[str] = "ISO/TR 16015; alpha_s is machine.scale_expansion_per_K; the same compensated or not"
    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.6, 0.5, "a sensor that hangs in the air, or is not calibrated", again=1.0
    )
    words: ClassVar[Wording | None] = Wording(
        "scale temperature",
        "The scale ({axis}) is {delta_K} {delta_K:warmer|colder} than recorded and reads too"
        " {delta_K:short|long}, up to {largest} in this recording.",
        "Measure the scale temperature of {axis} with a calibrated thermometer.",
        "Have its sensor adjusted, or state the measured temperature.",
        german=Wording(
            "Temperatur des Maßstabs",
            "Der Maßstab ({axis}) ist um {delta_K} {delta_K:wärmer|kälter} als aufgezeichnet und zeigt zu"
            " {delta_K:wenig|viel} an, in diesen Messdaten bis {largest}.",
            "Die Temperatur des Maßstabs {axis} mit einem kalibrierten Thermometer messen.",
            "Seinen Fühler justieren lassen oder die gemessene Temperatur angeben.",
        ),
    )
    axis: Axis | Literal["all"] = parameter(
        unit="", role="choice", meaning="axis of the scale: x, y or z; all: those of one room are alike"
    )
    delta_K: float = parameter(
        unit="K", meaning="true minus recorded scale temperature", ge=-40, le=40, sensible=(-5, 5)
    )

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Along one axis only its own scale shows."""
        seen = np.abs(list(probings.setting.axis.values())).max(axis=0)
        return choices["axis"] != "all" or bool((seen > LIKE_DIRECTIONS).sum() > 1)

    def displacement_um(self, probings: Probings) -> Displacement:
        """Proportional to the coordinate, from machine zero."""
        per_mm = probings.setting.scale_expansion_per_K * 1e3
        axes = "xyz" if self.axis == "all" else self.axis
        return {axis: self.delta_K * (-per_mm * probings.axis_mm(axis)) for axis in axes}


class ThermalDrift(Effect):
    """The whole placement drifts: d = rate t, or rate tau (1 - exp(-t / tau)) with a time constant tau."""

    kind: ClassVar[str] = "thermal_drift"
    equation: ClassVar[str] = (
        "d = rate t; with a time constant: rate tau (1 - exp(-t / tau)); t = time_s - start_s, nothing before"
    )
    source: ClassVar[str] = "first-order warm-up, ISO 230-3:2020"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    process: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        1.0, 2.0, "for an hour or more; what ends sooner moves by 2 um in all"
    )
    words: ClassVar[Wording | None] = Wording(
        "thermal drift",
        "Relative to the machine the gauge drifts{start_s: from {start_s:=4} on|} towards"
        " {rate_um_per_h:+|-}{direction}, {time_constant_h:first |}by {rate_um_per_h}{time_constant_h:, settling"
        " with a time constant of {time_constant_h}|}.",
        "Log the temperatures of air, gauge and machine; ask what was switched on before the run.",
        "Wait for equilibrium, or measure there and back (stepgauge plan --order up-down).",
        german=Wording(
            "thermische Drift",
            "Gegen die Maschine driftet das Stufenendmaß{start_s: ab {start_s:=4}|} nach"
            " {rate_um_per_h:+|-}{direction}, {time_constant_h:anfangs |}um {rate_um_per_h}{time_constant_h:,"
            " und kommt mit einer Zeitkonstante von {time_constant_h} zur Ruhe|}.",
            "Die Temperaturen von Luft, Stufenendmaß und Maschine aufzeichnen; fragen, was vorher eingeschaltet wurde.",
            "Das Gleichgewicht abwarten, oder hin und zurück messen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "drift",
        "The reading drifts, {time_constant_h:first |}by {rate_um_per_h}{time_constant_h:, settling with a time"
        " constant of {time_constant_h}|}.",
        "Log the temperatures of air, axis and instrument.",
        "Wait for equilibrium; measure there and back.",
        german=Wording(
            "Drift",
            "Der Wert driftet, {time_constant_h:anfangs |}um {rate_um_per_h}{time_constant_h:, und kommt mit"
            " einer Zeitkonstante von {time_constant_h} zur Ruhe|}.",
            "Die Temperaturen von Luft, Achse und Messgerät aufzeichnen.",
            "Das Gleichgewicht abwarten; hin und zurück messen.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    rate_um_per_h: float = parameter(unit="um/h", meaning="rate at start_s", ge=-1e5, le=1e5, sensible=(-50, 50))
    time_constant_h: float | None = parameter(
        None,
        unit="h",
        role="nonlinear",
        meaning="time constant; without it linear",
        gt=0,
        le=1e3,
        sensible=(0.01, 5),
        grid=grids.time_constants_h,
        odds=12.0,
    )
    start_s: float = begins_s(grids.starts_s)

    def displacement_um(self, probings: Probings) -> Displacement:
        """A ramp, or an exponential approach with the time constant."""
        hours = hours_since(self.start_s, probings)
        if self.time_constant_h is None:
            return along(self.direction, self.rate_um_per_h * hours)
        grown_h = -self.time_constant_h * np.expm1(-hours / self.time_constant_h)
        return along(self.direction, self.rate_um_per_h * grown_h)


SCANNED = 0.1
"""Odds of a slow cycle in a scan of an axis, over those in readings at rest."""


class TemperatureCycle(Effect):
    """Air conditioning shifts the placement periodically: d = A sin(2 pi t / period + phase)."""

    kind: ClassVar[str] = "temperature_cycle"
    equation: ClassVar[str] = "d = amplitude_um sin(2 pi time_s / period_s + phase_deg)"
    source: ClassVar[str] = "environmental temperature variation error, ISO 230-3:2020"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    process: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.5)
    words: ClassVar[Wording | None] = Wording(
        "temperature cycle",
        "The gauge oscillates along {direction} by {amplitude_um} every {period_s:4}, as with an air"
        " conditioning or a coolant unit that switches on and off.",
        "Compare the period with that of the air conditioning or the coolant unit.",
        "Keep the stream of air or coolant off the machine.",
        german=Wording(
            "Temperaturzyklus",
            "Das Stufenendmaß schwankt längs {direction} um {amplitude_um} alle {period_s:4}, wie bei einer"
            " Klimaanlage oder Kühlung, die ein- und ausschaltet.",
            "Die Periode mit der von Klimaanlage oder Kühlgerät vergleichen.",
            "Den Luft- oder Kühlmittelstrom von der Maschine fernhalten.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "slow cycle",
        "The reading goes to and fro by {amplitude_um} every {period_s:4}, as an air conditioning or a cooling"
        " unit that switches would make it.",
        "Compare the period with that of the air conditioning or the coolant unit.",
        "Keep the stream of air or coolant off the axis.",
        german=Wording(
            "langsamer Zyklus",
            "Der Wert schwankt um {amplitude_um} alle {period_s:4}, wie bei einer Klimaanlage oder Kühlung, die"
            " ein- und ausschaltet.",
            "Die Periode mit der von Klimaanlage oder Kühlgerät vergleichen.",
            "Den Luft- oder Kühlmittelstrom von der Achse fernhalten.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=0, le=1e4, sensible=(0, 20))
    period_s: float = parameter(
        unit="s",
        role="nonlinear",
        meaning="period",
        gt=0,
        le=1e9,
        sensible=(60, 7200),
        grid=grids.slow_periods_s,
        decades=True,
    )
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="phase at time 0", ge=-360, le=360, sensible=(-180, 180)
    )

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """What repeats while an axis is scanned is mostly passed, not switched: a scan is quick beside a room."""
        scanned = probings.setting.recording in ("linear", "rotary") and "speed_mm_s" in probings.columns
        return SCANNED if scanned else 1.0

    def displacement_um(self, probings: Probings) -> Displacement:
        """A sine of time."""
        return along(self.direction, self.amplitude_um * sine(1.0 / self.period_s, probings.time_s, self.phase_deg))


class UncompensatedScales(Effect):
    """Scales without temperature compensation: d = x / (1 + alpha_s (T - 20)) - x on all three axes.

    It has no kind: it is switched on by ``scales_compensated = false`` of the machine table.
    """

    covariates: ClassVar[tuple[str, ...]] = ("coordinate",)
    temperature_C: float

    @property
    def label(self) -> str:
        """Its name among the shares."""
        return "uncompensated_scales"

    def displacement_um(self, probings: Probings) -> Displacement:
        """Indication minus true coordinate."""
        spread = probings.setting.scale_expansion_per_K * (self.temperature_C - REFERENCE_C)
        stretch = -spread / (1.0 + spread) * 1e3
        return {axis: stretch * probings.axis_mm(axis) for axis in "xyz"}

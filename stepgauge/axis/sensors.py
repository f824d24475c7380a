"""What read an axis, and what it can have as a cause: a laser has no pre-travel, an encoder no first touch."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from stepgauge.effects import effect_kinds

SCALE = {"scale_error", "scale_curvature", "periodic_scale_error", "local_scale_defect", "scale_joint", "screw_error"}
TRAVEL = {"reversal_error", "reversal_wear", "stick_slip"}
TIME = {"thermal_drift", "temperature_cycle", "step_change", "vibration", "thermal_shift"}
SCATTER = {"noise_growth", "outliers"}
CONTACT = {"effective_radius", "trigger_delay", "approach_memory"}
PROBE = {*CONTACT, "probe_lobing", "lever_arm", "pretravel_scale", "kinematic_pretravel", "seat_defect", "tip_change"}
"""Kinds that need a probe which touches."""
OPEN_ENDED = {"scale_error", "scale_curvature"}
"""Kinds of a scale with two ends: on a circle an error must close after a turn."""
DISTANCE = {"scale_error", "periodic_scale_error", "effective_radius"}
"""Kinds of a distance meter: its frequency, its interpolation within a wavelength, its additive constant."""


@dataclass(frozen=True)
class Sensor:
    """``words``: what it is called; ``touches``: whether it reads when it touches; ``travels``: whether it reads an
    axis that comes from two sides."""

    words: str
    touches: bool = False
    travels: bool = True


SENSORS = {
    "touch": Sensor("touch-trigger probe", touches=True),
    "dial": Sensor("dial gauge"),
    "laser": Sensor("laser interferometer"),
    "encoder": Sensor("encoder"),
    "autocollimator": Sensor("autocollimator"),
    "capacitive": Sensor("capacitive sensor"),
    "inductive": Sensor("inductive sensor"),
    "optical": Sensor("optical sensor"),
    "edm": Sensor("electronic distance meter", travels=False),
    "other": Sensor("instrument"),
}


def kinds_of(sensor: str, form: str, rotary: bool = False) -> set[str]:
    """Kinds of effects that a recording of a form (``axis``, ``spot``, ``distances``) by a sensor may show."""
    known = SENSORS[sensor]
    if form == "distances" or sensor == "edm":
        return DISTANCE | TIME | SCATTER
    kinds = TIME | SCATTER | (CONTACT if known.touches else set())
    if form == "axis":
        kinds |= SCALE - (OPEN_ENDED if rotary else set())
        kinds |= TRAVEL | {"thermal_expansion_of"}
    return kinds


def not_candidates(sensor: str, form: str, rotary: bool = False) -> set[str]:
    """Kinds of the vocabulary that such a recording cannot show."""
    return set(effect_kinds()) - kinds_of(sensor, form, rotary)


def without_probe(sensor: str | None) -> Collection[str]:
    """Kinds that a recording of a gauge cannot show because what read it does not touch; none where it is not said."""
    touches = sensor is None or sensor not in SENSORS or SENSORS[sensor].touches
    return () if touches else PROBE & set(effect_kinds())

"""What read an axis, and what it can have as a cause: a laser has no pre-travel, an encoder no first touch."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from stepgauge.effects import effect_kinds


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


def recording_of(form: str, rotary: bool = False) -> str:
    """What a recording is of (:data:`stepgauge.effects.base.RECORDINGS`), by its form (``axis``, ``spot``, ..)."""
    return ("rotary" if rotary else "linear") if form == "axis" else form


def kinds_of(sensor: str, form: str, rotary: bool = False) -> set[str]:
    """Kinds of effects that a recording of a form (``axis``, ``spot``, ``distances``) by a sensor may show.

    A distance meter has the effects of distances, whatever is measured with it.
    """
    of = "distances" if sensor == "edm" else recording_of(form, rotary)
    known, touches = effect_kinds(every=True), SENSORS[sensor].touches
    return {kind for kind, one in known.items() if of in one.recordings and (touches or of not in one.touch)}


def not_candidates(sensor: str, form: str, rotary: bool = False) -> set[str]:
    """Kinds of the vocabulary that such a recording cannot show."""
    return set(effect_kinds()) - kinds_of(sensor, form, rotary)


def without_probe(sensor: str | None) -> Collection[str]:
    """Kinds that a recording of a gauge cannot show because what read it does not touch; none where it is not said."""
    touches = sensor is None or sensor not in SENSORS or SENSORS[sensor].touches
    return () if touches else {kind for kind, one in effect_kinds().items() if "gauge" in one.touch}

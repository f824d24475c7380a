"""Effects of speed on the recorded position: a late latch, an axis that falls behind, a latch once in a cycle."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects.base import GAUGE, UNDETERMINED, Displacement, Effect, EffectPrior, Wording, parameter
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array


class TriggerDelay(Effect):
    """The position is latched a delay after the trigger: d = delay * measuring speed along the approach."""

    kind: ClassVar[str] = "trigger_delay"
    equation: ClassVar[str] = "d = ms speed_mm_s along the approach"
    source: ClassVar[str] = "Jankowski in Rodrigues 2021: 14.5 ms of radio delay at 50 mm/min are 12.1 um"
    covariates: ClassVar[tuple[str, ...]] = ("speed",)
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "spot")
    touch: ClassVar[tuple[str, ...]] = ("gauge", "spot")
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.2, "controllers poll in 0.1 to 1 ms")
    words: ClassVar[Wording | None] = Wording(
        "trigger delay",
        "The position is latched {ms} {ms:late|early}: up to {largest} at the speeds of this recording.",
        "Probe one face at two speeds: does the reading change in proportion?",
        "Qualify the probe at the measuring speed.",
        german=Wording(
            "Schaltverzögerung",
            "Die Position wird um {ms} zu {ms:spät|früh} erfasst: bis {largest} bei den Geschwindigkeiten"
            " dieser Messdaten.",
            "Eine Fläche mit zwei Geschwindigkeiten antasten: Ändert sich der Wert im selben Verhältnis?",
            "Den Taster mit der Antastgeschwindigkeit einmessen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "trigger delay",
        "The position is latched {ms} {ms:late|early}.",
        "Read one target at two speeds.",
        "Read at rest, or state the delay.",
        german=Wording(
            "Schaltverzögerung",
            "Die Position wird um {ms} zu {ms:spät|früh} erfasst.",
            "Ein Ziel mit zwei Geschwindigkeiten ablesen.",
            "In Ruhe ablesen oder die Verzögerung angeben.",
        ),
    )
    ms: float = parameter(unit="ms", meaning="delay between trigger and latch", ge=-1e3, le=1e3, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """ms times mm/s are um."""
        return {"approach": self.ms * probings.speed_mm_s}


class ServoLag(Effect):
    """A lag of the axes that grows with the square of the speed: d = k speed^2 along the approach.

    A lag in proportion to the speed is ``trigger_delay``.
    """

    kind: ClassVar[str] = "servo_lag"
    equation: ClassVar[str] = "d = um_per_mm2_s2 speed_mm_s^2 along the approach"
    source: ClassVar[str] = (
        "following error of a servo with viscous friction; second term of a power series in the speed"
    )
    covariates: ClassVar[tuple[str, ...]] = ("speed",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.2, 0.05, "controllers take most of it back", basis="grade")
    words: ClassVar[Wording | None] = Wording(
        "servo lag",
        "The axes fall behind with the square of the measuring speed, up to {largest} in this recording.",
        "Probe one face at three speeds.",
        "Qualify and measure at one speed, a slower one.",
        german=Wording(
            "Schleppabstand",
            "Die Achsen bleiben mit dem Quadrat der Antastgeschwindigkeit zurück, in diesen Messdaten bis {largest}.",
            "Eine Fläche mit drei Geschwindigkeiten antasten.",
            "Mit einer einzigen, langsameren Geschwindigkeit einmessen und messen.",
        ),
    )
    um_per_mm2_s2: float = parameter(unit="um/(mm/s)^2", meaning="lag at 1 mm/s", ge=-1e3, le=1e3, sensible=(-1, 1))

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """Two speeds tell a constant and a proportion, a square needs a third."""
        return 1.0 if np.unique(probings.speed_mm_s).size > 2 else UNDETERMINED

    def displacement_um(self, probings: Probings) -> Displacement:
        """The square of the speed."""
        return {"approach": self.um_per_mm2_s2 * probings.speed_mm_s * probings.speed_mm_s}


class InterpolationStep(Effect):
    """Positions are latched once per cycle of the controller: d = speed times the rest of the cycle at the trigger.

    It is between zero and the travel in one cycle, depending on the time. Times are seldom known to a fraction of the
    cycle: the diagnosis subtracts half of it, and the rest is scatter, or an error that repeats have in common.
    """

    kind: ClassVar[str] = "interpolation_step"
    equation: ClassVar[str] = "d = speed_mm_s ((-time_s) mod cycle_ms) along the approach"
    source: ClassVar[str] = "latch at the next interpolation cycle; uniform between 0 and its way, JCGM 100:2008, 4.3.7"
    covariates: ClassVar[tuple[str, ...]] = ("speed", "time")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    sought: ClassVar[bool] = False
    words: ClassVar[Wording | None] = Wording(
        "interpolation step",
        "Positions are latched once in {cycle_ms} only.",
        "Look up the cycle of the position latch in the manual of the controller.",
        "Measure slower, or state the cycle.",
        german=Wording(
            "Takt der Positionserfassung",
            "Positionen werden nur einmal in {cycle_ms} erfasst.",
            "Den Takt der Positionserfassung im Handbuch der Steuerung nachsehen.",
            "Langsamer messen oder den Takt angeben.",
        ),
    )
    cycle_ms: float = parameter(
        unit="ms", role="nonlinear", meaning="interpolation cycle", gt=0, le=1e3, sensible=(0.25, 20)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """ms times mm/s are um."""
        return {"approach": probings.speed_mm_s * np.mod(probings.time_s * -1e3, self.cycle_ms)}

    def expected(self) -> Effect:
        """Half a cycle late."""
        return TriggerDelay(ms=0.5 * self.cycle_ms, when=self.when)

    def latched_um(self, probings: Probings) -> Array:
        """That of a uniform distribution over the travel in one cycle."""
        return np.asarray(probings.speed_mm_s * self.cycle_ms / np.sqrt(12.0))

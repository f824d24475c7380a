"""Effects that depend on the time of a probing, or on the probings before it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import Direction, Displacement, Effect, EffectPrior, Wording, along, parameter
from stepgauge.effects.probings import Probings
from stepgauge.effects.waves import sine


class StepChange(Effect):
    """The origin changes by a step, after a knock or a slipped clamp: d = um from time_s on."""

    kind: ClassVar[str] = "step_change"
    equation: ClassVar[str] = "d = um where time_s (of the probing) >= time_s"
    source: ClassVar[str] = "Heaviside step in time"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    several: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 1.0, "a slipped clamp or a knock")
    words: ClassVar[Wording | None] = Wording(
        "step change",
        "At {time_s:=4} the origin changed by {um} towards {um:+|-}{direction}: a knock or a slipped clamp.",
        "Look at the clamps of the gauge, and whether stylus and probe are tight.",
        "Tighten them; use no readings from before and after together.",
        german=Wording(
            "Sprung",
            "Bei {time_s:=4} sprang der Nullpunkt um {um} nach {um:+|-}{direction}: ein Stoß oder ein"
            " gerutschtes Spannmittel.",
            "Die Spannmittel des Stufenendmaßes ansehen, und ob Taststift und Taster fest sind.",
            "Festziehen; Werte von davor und danach nicht zusammen benutzen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "step change",
        "At {time_s:=4} the reading jumps by {um}: a knock, a slipped clamp or a counting error.",
        "Look at clamps, mirrors and cables, and at the count of the instrument.",
        "Fasten them; use no readings from before and after together.",
        german=Wording(
            "Sprung",
            "Bei {time_s:=4} springt der Wert um {um}: ein Stoß, ein gerutschtes Spannmittel oder ein Zählfehler.",
            "Spannmittel, Spiegel, Kabel und den Zähler des Messgeräts ansehen.",
            "Befestigen; Werte von davor und danach nicht zusammen benutzen.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    time_s: float = parameter(
        unit="s",
        role="nonlinear",
        meaning="time of the step",
        ge=-1e12,
        le=1e12,
        sensible=(0, 1e4),
        grid=grids.between_readings_s,
        clock=True,
        fitted=False,
    )
    um: float = parameter(unit="um", meaning="step", ge=-1e5, le=1e5, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero before, um after."""
        return along(self.direction, np.where(probings.time_s >= self.time_s, self.um, 0.0))


class Vibration(Effect):
    """The machine vibrates faster than it is sampled: d = A sin(2 pi f t + phase) at the triggers, which aliases."""

    kind: ClassVar[str] = "vibration"
    equation: ClassVar[str] = "d = amplitude_um sin(2 pi frequency_hz time_s + phase_deg)"
    source: ClassVar[str] = "sampled sine; with touches every T seconds it shows at |f - k / T|"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    process: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.4, 0.4)
    words: ClassVar[Wording | None] = Wording(
        "vibration",
        "Machine and gauge vibrate relative to each other along {direction} by {amplitude_um} at"
        " {frequency_hz:5}, or at an alias of this frequency at these times of probing.",
        "Switch off, one by one, what turns near the machine: fans, pumps, spindles.",
        "Isolate it, or measure without it.",
        german=Wording(
            "Schwingung",
            "Maschine und Stufenendmaß schwingen gegeneinander längs {direction} um {amplitude_um} mit"
            " {frequency_hz:5} oder einer Alias-Frequenz davon zu diesen Zeiten.",
            "Nacheinander abschalten, was sich nahe der Maschine dreht: Lüfter, Pumpen, Spindeln.",
            "Die Quelle entkoppeln oder ohne sie messen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "vibration",
        "The reading swings by {amplitude_um} at {frequency_hz:5}, or at a frequency that looks the same at"
        " these moments of reading.",
        "Switch off, one by one, what turns near by: fans, pumps, spindles.",
        "Isolate it, or measure without it.",
        german=Wording(
            "Schwingung",
            "Der Wert schwingt um {amplitude_um} mit {frequency_hz:5} oder einer Frequenz, die zu diesen Zeiten"
            " ebenso aussieht.",
            "Nacheinander abschalten, was sich in der Nähe dreht: Lüfter, Pumpen, Spindeln.",
            "Die Quelle entkoppeln oder ohne sie messen.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    frequency_hz: float = parameter(
        unit="Hz",
        role="nonlinear",
        meaning="frequency",
        gt=0,
        le=1e4,
        sensible=(0.2, 100),
        grid=grids.frequencies_hz,
        decades=True,
    )
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=0, le=1e3, sensible=(0, 5))
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="phase at time 0", ge=-360, le=360, sensible=(-180, 180)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A sine of time."""
        return along(self.direction, self.amplitude_um * sine(self.frequency_hz, probings.time_s, self.phase_deg))


class DriveCycle(Effect):
    """A part of a drive that turns at constant speed errs once a turn: d = A sin(2 pi t / period + phase).

    A worm, a gear, a screw, a belt, a pole of a motor or resolver, a line of an encoder: seen at one spot, or in an
    instrument that follows, its error repeats in time.
    """

    kind: ClassVar[str] = "drive_cycle"
    equation: ClassVar[str] = "d = amplitude_um sin(2 pi time_s / turn_s + phase_deg)"
    source: ClassVar[str] = "transmission error of gears and worms; periodic error of a telescope's mount: definition"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    recordings: ClassVar[tuple[str, ...]] = ("spot",)
    process: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.5, "what follows or turns has a drive")
    words: ClassVar[Wording | None] = Wording(
        "drive cycle",
        "The reading repeats every {turn_s:4}, by up to {amplitude_um}, as the error of a worm, gear, screw or motor"
        " that turns once in this time would make it.",
        "Compare the period with a turn of each part of the drive, and with half of it.",
        "Correct the periodic error of the drive, or have the part exchanged.",
        german=Wording(
            "Umlauf eines Antriebsteils",
            "Der Wert wiederholt sich alle {turn_s:4}, um bis zu {amplitude_um}, wie beim Fehler von Schnecke,"
            " Zahnrad, Spindel oder Motor, die sich in dieser Zeit einmal drehen.",
            "Die Periode mit einer Umdrehung jedes Teils des Antriebs vergleichen, und mit der Hälfte davon.",
            "Den periodischen Fehler des Antriebs korrigieren oder das Teil tauschen lassen.",
        ),
    )
    direction: Direction = parameter(unit="", role="choice", meaning="x, y, z or a vector in machine axes")
    amplitude_um: float = parameter(unit="um", meaning="amplitude", ge=0, le=1e4, sensible=(0, 20))
    turn_s: float = parameter(
        unit="s",
        role="nonlinear",
        meaning="time of a turn",
        gt=0,
        le=1e9,
        sensible=(1, 7200),
        grid=grids.periods_in_time_s,
        decades=True,
    )
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="phase at time 0", ge=-360, le=360, sensible=(-180, 180)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A sine of time."""
        return along(self.direction, self.amplitude_um * sine(1.0 / self.turn_s, probings.time_s, self.phase_deg))


class ApproachMemory(Effect):
    """The first probings after a pause have another pre-travel: d = um exp(-k / touches), k probings after the pause.

    The first probing of a recording counts as one after a pause (k = 0).
    """

    kind: ClassVar[str] = "approach_memory"
    equation: ClassVar[str] = "d = um exp(-k / touches) along the approach, k = touches since a pause > pause_s"
    source: ClassVar[str] = "reseating of a kinematic probe after rest, as an exponential run-in"
    covariates: ClassVar[tuple[str, ...]] = ("order", "time")
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "spot")
    touch: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "spot")
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.6, 0.7, "reseating of a kinematic probe after a rest")
    words: ClassVar[Wording | None] = Wording(
        "approach memory",
        "The first probing after a pause triggers {um} {um:later|earlier}; this decays to 1/e within {touches:2}.",
        "Probe one point ten times after a pause.",
        "Begin every run with some probings for nothing.",
        german=Wording(
            "erste Antastungen nach einer Pause",
            "Die erste Antastung nach einer Pause schaltet um {um} {um:später|früher}; das klingt in wenigen"
            " Antastungen ab.",
            "Nach einer Pause einen Punkt zehnmal antasten.",
            "Jede Messung mit einigen Antastungen beginnen, die nicht zählen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "approach memory",
        "The first readings after a pause are {um} off.",
        "Read one target ten times after a pause.",
        "Begin every run with some readings for nothing.",
        german=Wording(
            "erste Werte nach einer Pause",
            "Die ersten Werte nach einer Pause weichen um {um} ab.",
            "Nach einer Pause ein Ziel zehnmal ablesen.",
            "Jede Messung mit einigen Ablesungen beginnen, die nicht zählen.",
        ),
    )
    um: float = parameter(
        unit="um", meaning="pre-travel of the first probing larger by", ge=-1e3, le=1e3, sensible=(-10, 10)
    )
    touches: float = parameter(
        unit="touches",
        role="nonlinear",
        meaning="number of probings in which it decays to 1/e",
        gt=0,
        le=1e4,
        sensible=(0.5, 50),
        grid=grids.touches,
    )
    pause_s: float = parameter(
        60.0,
        unit="s",
        role="choice",
        meaning="shortest time between two probings that is a pause",
        ge=0,
        le=1e6,
        grid=grids.pauses_s,
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Decays with the number of probings."""
        return {"approach": self.um * np.exp(probings.touches_since_pause(self.pause_s) * (-1.0 / self.touches))}

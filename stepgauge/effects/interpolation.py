"""Errors of an interpolation: a wave and its second harmonic, of one period."""

from __future__ import annotations

from typing import ClassVar

from stepgauge.effects import grids
from stepgauge.effects.base import Displacement, EffectPrior, Wording, parameter
from stepgauge.effects.probings import Probings
from stepgauge.effects.scales import PeriodicScaleError
from stepgauge.effects.waves import sine


class InterpolationError(PeriodicScaleError):
    """The sine and cosine of an encoder are not alike: d = A sin(u + phase) + B sin(2 u + phase), u = 2 pi x / period.

    Offsets of the two signals make the first harmonic, unlike gains and an angle that is not 90 deg the second.
    """

    kind: ClassVar[str] = "interpolation_error"
    equation: ClassVar[str] = (
        "d = amplitude_um sin(2 pi x / period_mm + phase_deg) + second_um sin(4 pi x / period_mm + second_phase_deg)"
    )
    source: ClassVar[str] = "Heydemann, Applied Optics 20 (1981) 3382: offsets, gains and phase of quadrature signals"
    recordings: ClassVar[tuple[str, ...]] = ("linear", "rotary")
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.5, 0.6, "half of all periodic errors have a second harmonic: signals, bearings, couplings", basis="grade"
    )
    words: ClassVar[Wording | None] = Wording(
        "interpolation error",
        "The error of the {axis} scale repeats every {period_mm:5}: with the amplitude {amplitude_um}, and {second_um}"
        " at half the period.",
        "Look at the sine and cosine of the reading head of {axis}.",
        "Clean the {axis} scale and adjust its reading head.",
        german=Wording(
            "Interpolationsfehler",
            "Der Fehler des Maßstabs {axis} wiederholt sich alle {period_mm:5}: mit der Amplitude {amplitude_um}, und"
            " {second_um} bei der halben Periode.",
            "Sinus und Kosinus des Lesekopfs von {axis} ansehen.",
            "Den Maßstab {axis} reinigen und seinen Lesekopf einstellen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "interpolation error",
        "The error repeats every {period_mm:5}{turns:, {turns}|}: with the amplitude {amplitude_um}, and {second_um} at"
        " half the period.",
        "Compare the period{aliases:, and every alias of it that is named,|} with the pitch of scale, screw or gear. Of"
        " an encoder look at sine and cosine: offsets make the first amplitude, unlike gains and phases the second.",
        "{seat:Centre and level what turns: table, scale or artefact.|}{gear:Adjust worm and wheel, or the gear.|}"
        "{scale:Clean the scale and adjust its reading head; align bearing and coupling of a screw.|}",
        german=Wording(
            "Interpolationsfehler",
            "Der Fehler wiederholt sich alle {period_mm:5}{turns:, {turns}|}: mit der Amplitude {amplitude_um}, und"
            " {second_um} bei der halben Periode.",
            "Die Periode{aliases:, auch jede genannte Alias-Periode,|} mit der Teilung von Maßstab, Spindel oder"
            " Getriebe vergleichen. Bei einem Messgerät Sinus und Kosinus ansehen: Versatz macht die erste Amplitude,"
            " ungleiche Verstärkung und Phase die zweite.",
            "{seat:Zentrieren und ausrichten, was sich dreht: Tisch, Maßstab oder Maßverkörperung.|}{gear:Schnecke und"
            " Rad oder das Getriebe einstellen.|}{scale:Den Maßstab reinigen und seinen Lesekopf einstellen; Lager und"
            " Kupplung einer Spindel ausrichten.|}",
        ),
    )
    period_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="period along the axis",
        gt=0,
        le=1e4,
        sensible=(0.004, 700),
        grid=grids.periods_with_second,
        decades=True,
    )
    second_um: float = parameter(unit="um", meaning="amplitude at half the period", ge=0, le=1e3, sensible=(0, 10))
    second_phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="its phase at half the period", ge=-360, le=360, sensible=(-180, 180)
    )

    @classmethod
    def per_turn(cls) -> dict[int, float]:
        """Its period is of lines and poles."""
        return {}

    def displacement_um(self, probings: Probings) -> Displacement:
        """Two sines of the coordinate."""
        first_um = super().displacement_um(probings)[self.axis]
        second = sine(2.0 / self.period_mm, probings.axis_mm(self.axis), self.second_phase_deg)
        return {self.axis: first_um + self.second_um * second}

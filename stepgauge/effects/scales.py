"""Errors of a scale: they depend on the coordinate of its axis only."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import AXES, Axis, Displacement, Effect, EffectPrior, Wording, parameter
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
    words: ClassVar[Wording | None] = Wording(
        "scale error",
        "The {axis} scale indicates {ppm} too {ppm:long|short}, up to {largest} in this recording.",
        "Compare {steps:the steps per mm|the linear correction} of {axis} in the controller, and the temperature of"
        " the {axis} {steps:screw|scale} in the machine file, with what is there.",
        "{steps:{axis:$100|$101|$102}: x {ppm:factor} (commanded over true way), steps per mm of {axis} of grbl (M92 of"
        " Marlin, SCALE of [JOINT_{axis:0|1|2}] in the ini of LinuxCNC); or a|A} linear correction of {axis} that"
        " divides by {steps:it|{ppm:factor}}.",
        german=Wording(
            "Maßstabsfehler",
            "Der Maßstab {axis} zeigt {ppm} zu {ppm:viel|wenig} an, in diesen Messdaten bis {largest}.",
            "Die {steps:Schritte je mm|lineare Korrektur} von {axis} in der Steuerung und die Temperatur {steps:der"
            " Spindel|des Maßstabs} {axis} in der Maschinendatei mit dem vergleichen, was da ist.",
            "{steps:{axis:$100|$101|$102}: x {ppm:factor} (befohlener durch wahren Weg), Schritte je mm von {axis} bei"
            " grbl (M92 bei Marlin, SCALE in [JOINT_{axis:0|1|2}] der ini von LinuxCNC); oder eine|Eine} lineare"
            " Korrektur von {axis}, die durch {steps:diese Zahl|{ppm:factor}} teilt.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "scale error",
        "In proportion to position the readings are {ppm} too {ppm:long|short}. A wrong temperature or"
        " coefficient of expansion, and a line of measurement at an angle to the axis, look the same.",
        "Measure the temperature of the scale, state its coefficient of expansion, and align the line of measurement.",
        "If it stays, in the controller: steps per unit divided by {ppm:factor} (times commanded over true way),"
        " or a linear correction that takes {ppm:±} {ppm:off|on}.",
        german=Wording(
            "Maßstabsfehler",
            "Die Werte sind im Verhältnis zur Position um {ppm} zu {ppm:groß|klein}. Eine falsche Temperatur,"
            " ein falscher Ausdehnungskoeffizient oder eine schräge Messlinie sehen ebenso aus.",
            "Die Temperatur des Maßstabs messen, seinen Ausdehnungskoeffizienten angeben und die Messlinie ausrichten.",
            "Bleibt es, in der Steuerung: Schritte je Einheit geteilt durch {ppm:factor} (mal befohlener durch wahren"
            " Weg), oder eine lineare Korrektur, die {ppm:±} {ppm:wegnimmt|hinzufügt}.",
        ),
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
    words: ClassVar[Wording | None] = Wording(
        "scale curvature",
        "The error of the {axis} scale is a parabola about the middle of its travel, up to {largest} in this"
        " recording.",
        "Compare the error table of {axis} in the controller with the machine's last one.",
        "Make a new error table of {axis} from an evaluation along it (stepgauge compensate).",
        german=Wording(
            "gekrümmter Maßstab",
            "Der Fehler des Maßstabs {axis} ist eine Parabel um die Mitte des Wegs, in diesen Messdaten bis {largest}.",
            "Die Korrekturtabelle von {axis} in der Steuerung mit der letzten der Maschine vergleichen.",
            "Eine neue Korrekturtabelle von {axis} aus einer Auswertung längs der Achse machen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "scale curvature",
        "The error is bowed over the travel, by up to {largest}.",
        "Compare the error table of the controller with the last one; look at the screw's preload and its warm-up.",
        "Make a new error table.",
        german=Wording(
            "gekrümmter Maßstab",
            "Der Fehler ist über den Weg gewölbt, um bis zu {largest}.",
            "Die Korrekturtabelle der Steuerung mit der letzten vergleichen; die Vorspannung der Spindel ansehen.",
            "Eine neue Korrekturtabelle machen.",
        ),
    )
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
    words: ClassVar[Wording | None] = Wording(
        "periodic scale error",
        "The error of the {axis} scale repeats every {period_mm:5}, by up to {amplitude_um} for a position and"
        " twice that for a length.",
        "Compare the period{aliases:, and every alias of it that is named,|} with the pitch of the {axis}"
        " scale, screw or rack; look for {steps:a bent screw or a loose coupling|dirt on the reading head}.",
        "{steps:Align bearing and coupling of the {axis} screw, or exchange it; what stays is a limit of the machine|"
        "Clean the {axis} scale and adjust the gap of its reading head}.",
        german=Wording(
            "periodischer Maßstabsfehler",
            "Der Fehler des Maßstabs {axis} wiederholt sich alle {period_mm:5}, um bis zu {amplitude_um} für"
            " eine Position und das Doppelte für eine Länge.",
            "Die Periode{aliases:, auch jede genannte Alias-Periode,|} mit der Teilung von Maßstab, Spindel"
            " oder Zahnstange von {axis} vergleichen; {steps:die Spindel auf Schlag und ihre Kupplung|den Lesekopf auf"
            " Schmutz} ansehen.",
            "{steps:Lager und Kupplung der Spindel {axis} ausrichten oder sie tauschen; was bleibt, ist eine Grenze der"
            " Maschine|Den Maßstab {axis} reinigen und den Spalt seines Lesekopfs einstellen}.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "periodic scale error",
        "The error repeats every {period_mm:5}{turns:, {turns}|}, by up to {amplitude_um}.",
        "Compare the period{aliases:, and every alias of it that is named,|} with the pitch of scale, screw or"
        " gear, with a turn, and with the wavelength.",
        "{seat:Centre and level what turns: table, scale or artefact.|}{gear:Adjust worm and wheel, or the gear.|}"
        "{scale:Clean the scale and adjust its reading head; align a screw.|}",
        german=Wording(
            "periodischer Maßstabsfehler",
            "Der Fehler wiederholt sich alle {period_mm:5}{turns:, {turns}|}, um bis zu {amplitude_um}.",
            "Die Periode{aliases:, auch jede genannte Alias-Periode,|} mit der Teilung von Maßstab, Spindel"
            " oder Getriebe, mit einer Umdrehung und mit der Wellenlänge vergleichen.",
            "{seat:Zentrieren und ausrichten, was sich dreht: Tisch, Maßstab oder Maßverkörperung.|}{gear:Schnecke und"
            " Rad oder das Getriebe einstellen.|}{scale:Den Maßstab reinigen und seinen Lesekopf einstellen; eine"
            " Spindel ausrichten.|}",
        ),
    )
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

    @classmethod
    def per_turn(cls) -> dict[int, float]:
        """Eccentricity; tilt or an elliptic seat; seats on three and on four points, which are rarer."""
        return {1: 1.0, 2: 1.0, 3: 0.3, 4: 0.3}

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
    words: ClassVar[Wording | None] = Wording(
        "local scale defect",
        "Near {axis} = {at_mm:=4}, over about {width_mm:2}, the machine indicates {height_um} too"
        " {height_um:long|short}, wherever the gauge lies.",
        "Inspect the {axis} {steps:screw or rack|scale}{at_mm:? at {at_mm:=5}|} for dirt, {steps:wear|a scratch} or a"
        " joint.",
        "Clean it; if the error stays: Make a new error table of {axis} from an evaluation along it (stepgauge"
        " compensate).",
        german=Wording(
            "örtlicher Maßstabsfehler",
            "Bei {axis} = {at_mm:=4} zeigt die Maschine auf etwa {width_mm:2} um {height_um} zu"
            " {height_um:viel|wenig} an, wo immer das Stufenendmaß liegt.",
            "{steps:Spindel oder Zahnstange|Den Maßstab} {axis}{at_mm:? bei {at_mm:=5}|} auf Schmutz,"
            " {steps:Verschleiß|Kratzer} oder einen Stoß ansehen.",
            "Reinigen; bleibt die Abweichung, eine neue Korrekturtabelle von {axis} machen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "local scale defect",
        "About {at_mm:=4}, over a width of {width_mm:2}, the readings are off by {height_um}: look there.",
        "Inspect the scale at this position.",
        "Clean it; if it stays, make a new error table.",
        german=Wording(
            "örtlicher Maßstabsfehler",
            "Bei {at_mm:=4}, auf einer Breite von {width_mm:2}, weichen die Werte um {height_um} ab.",
            "Den Maßstab an dieser Stelle ansehen.",
            "Reinigen; bleibt es, eine neue Korrekturtabelle machen.",
        ),
    )
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
    several: ClassVar[bool] = True
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.2, 2.0, "tapes and racks laid end to end", basis="grade")
    words: ClassVar[Wording | None] = Wording(
        "scale joint",
        "From {axis} = {at_mm:=4} on the {axis} scale has {order:another slope, by {size},|a gap of {size}} and"
        " reads {size:more|less}: two scales or tapes may meet there.",
        "Inspect the {axis} {steps:screw or rack|scale} for a joint{at_mm:? at {at_mm:=5}|}.",
        "Make a new error table of {axis} from an evaluation along it (stepgauge compensate).",
        german=Wording(
            "Stoß zweier Maßstäbe",
            "Ab {axis} = {at_mm:=4} hat der Maßstab {axis} {order:eine andere Steigung, um {size},|eine Lücke"
            " von {size}} und zeigt {size:mehr|weniger} an: Dort stoßen vielleicht zwei Maßstäbe zusammen.",
            "{steps:Spindel oder Zahnstange|Den Maßstab} {axis}{at_mm:? bei {at_mm:=5}|} auf einen Stoß ansehen.",
            "Eine neue Korrekturtabelle von {axis} aus einer Auswertung längs der Achse machen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "scale joint",
        "At {at_mm:=4} {order:the slope of the error changes|the readings jump} by {size}: two pieces of a"
        " scale, or of a compensation table, meet there.",
        "Inspect the scale for a joint at this position.",
        "Make a new error table.",
        german=Wording(
            "Stoß zweier Maßstäbe",
            "Bei {at_mm:=4} {order:ändert sich die Steigung des Fehlers|springen die Werte} um {size}: Dort"
            " stoßen zwei Maßstäbe oder Korrekturtabellen zusammen.",
            "Den Maßstab an dieser Stelle auf einen Stoß ansehen.",
            "Eine neue Korrekturtabelle machen.",
        ),
    )
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

    def unit_of(self, name: str) -> str:
        """Of a gap a length, of another slope a length per length."""
        unit = super().unit_of(name)
        return unit.split(" or ")[int(self.order)] if name == "size" else unit

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
    words: ClassVar[Wording | None] = Wording(
        "screw error",
        "The error of the {axis} screw repeats with its pitch of {pitch_mm:5}, by up to {amplitude_um}.",
        "Compare the period with the pitch of the screw of {axis}; look at its bearing and coupling.",
        "Have the screw of {axis} and its bearing aligned.",
        german=Wording(
            "Spindelfehler",
            "Der Fehler der Spindel {axis} wiederholt sich mit ihrer Steigung von {pitch_mm:5}, um bis zu"
            " {amplitude_um}.",
            "Die Periode mit der Steigung der Spindel {axis} vergleichen; Lager und Kupplung ansehen.",
            "Die Spindel {axis} und ihr Lager ausrichten lassen.",
        ),
    )
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

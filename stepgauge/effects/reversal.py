"""Reversal errors: dependence on the direction of travel, on the position, and on the path since the reversal."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import AXES, UNDETERMINED, Axis, Displacement, Effect, EffectPrior, Wording, parameter
from stepgauge.effects.probings import Probings
from stepgauge.effects.scales import bump
from stepgauge.files.arrays import Array

FEWEST_BACK = 0.2
"""Share of the touches each way from which a difference between the ways can be told from single touches."""
STANDSTILL = 1e-6
"""If the component of the approach along an axis is below this, the axis does not move: it is rounding."""


class ReversalError(Effect):
    """The indication depends on the direction of travel: d = (B / 2) sign(p_axis), 0 where the axis does not move."""

    kind: ClassVar[str] = "reversal_error"
    equation: ClassVar[str] = "d = (um / 2) sign(approach on the axis)"
    source: ClassVar[str] = "ISO 230-2:2014, reversal error B of an axis"
    covariates: ClassVar[tuple[str, ...]] = ("approach",)
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        1.0,
        1.0,
        "linear scales to ball screws; drives of one machine are of one design and age",
        basis="grade",
        again=2.0,
    )
    words: ClassVar[Wording | None] = Wording(
        "reversal error",
        "{axis} indicates {um} {um:more|less} when probed towards + than towards -: backlash, hysteresis of the"
        " drive, or a pre-travel that depends on the direction. The size of a block has this error.",
        "Drive {axis} to a dial gauge from both sides: if it does not differ, the cause is the probe.",
        "{steps:{axis:$160|$161|$162}: {um:=±mm}, backlash of {axis} of grblHAL (BACKLASH of"
        " [JOINT_{axis:0|1|2}] in the ini of LinuxCNC)|Make the"
        " backlash compensation of {axis} in the controller {um:larger|smaller} by {um:±}}; or adjust the drive, or"
        " qualify the probe.",
        german=Wording(
            "Umkehrspanne",
            "{axis} zeigt in Richtung + um {um} {um:mehr|weniger} an als in Richtung -: Lose, Hysterese des"
            " Antriebs oder ein richtungsabhängiger Vorlaufweg. Die Größe eines Blocks hat diesen Fehler.",
            "{axis} von beiden Seiten an eine Messuhr fahren: Zeigt sie keinen Unterschied, ist der Taster die"
            " Ursache.",
            "{steps:{axis:$160|$161|$162}: {um:=±mm}, Lose von {axis} bei grblHAL (BACKLASH in"
            " [JOINT_{axis:0|1|2}] der ini von LinuxCNC)|Die"
            " Losekompensation von {axis} in der Steuerung um {um:±} {um:größer|kleiner} machen}; oder den Antrieb"
            " einstellen, oder den Taster neu einmessen.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "reversal error",
        "Coming in the positive direction the reading is {um} {um:more|less} than in the negative one:"
        " backlash, hysteresis of the drive or of the instrument.",
        "Read the position with another instrument, coming from both sides.",
        "Adjust the drive, or in the controller its backlash by {um:±} {um:less|more}.",
        german=Wording(
            "Umkehrspanne",
            "In positiver Richtung angefahren ist der Wert um {um} {um:größer|kleiner} als in negativer: Lose,"
            " Hysterese des Antriebs oder des Messgeräts.",
            "Die Position mit einem anderen Gerät ablesen, von beiden Seiten kommend.",
            "Den Antrieb einstellen, oder in der Steuerung seine Lose um {um:±} {um:kleiner|größer}.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis that reverses: x, y or z")
    um: float = parameter(
        unit="um",
        meaning="indication in positive minus indication in negative travel",
        ge=-1e4,
        le=1e4,
        sensible=(-20, 20),
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """Plus half in positive travel, minus half in negative travel."""
        return {self.axis: sense(probings, self.axis) * (self.um / 2.0)}


class ReversalWear(Effect):
    """The reversal error is larger where a screw is worn: d = (um / 2) sign(p_axis) exp(-4 ln2 ((x - at) / width)^2).

    It is added to the reversal error of the whole axis; if it is wider than the travel, the reversal error grows along
    it.
    """

    kind: ClassVar[str] = "reversal_wear"
    equation: ClassVar[str] = "d = (um / 2) sign(approach on the axis) exp(-4 ln2 ((x - at_mm) / width_mm)^2)"
    source: ClassVar[str] = "ISO 230-2:2014, reversal error B by position; a Gaussian of full width at half height"
    covariates: ClassVar[tuple[str, ...]] = ("approach", "coordinate")
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.2, 1.0, "screws wear where they work most", basis="grade")
    words: ClassVar[Wording | None] = Wording(
        "reversal wear",
        "The reversal of {axis} is {um} {um:larger|smaller} about {axis} = {at_mm:=4}, over some {width_mm:2},"
        " than elsewhere: the screw may be worn there.",
        "Drive {axis} to a dial gauge from both sides, {at_mm:?near {at_mm:=5} and far from it|in several places}.",
        "Have the screw of {axis} inspected; its backlash compensation holds for one place only.",
        german=Wording(
            "Umkehrspanne durch Verschleiß",
            "Die Umkehrspanne von {axis} ist bei {axis} = {at_mm:=4}, auf etwa {width_mm:2}, um {um}"
            " {um:größer|kleiner} als sonst: Die Spindel ist dort vielleicht verschlissen.",
            "{axis} {at_mm:?nahe {at_mm:=5} und weit davon|an mehreren Stellen} von beiden Seiten an eine Messuhr"
            " fahren.",
            "Die Spindel von {axis} prüfen lassen; ihr Losausgleich gilt nur an einer Stelle.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "reversal wear",
        "About {at_mm:=4}, over a width of {width_mm:2}, the reversal is {um} {um:larger|smaller} than"
        " elsewhere: wear of the screw or its nut, or a guide that binds.",
        "Read the position near there and far from it with another instrument, coming from both sides.",
        "Have the drive inspected; a backlash compensation holds for one place only.",
        german=Wording(
            "Umkehrspanne durch Verschleiß",
            "Bei {at_mm:=4}, auf einer Breite von {width_mm:2}, ist die Umkehrspanne um {um} {um:größer|kleiner}"
            " als sonst: Verschleiß von Spindel oder Mutter, oder eine klemmende Führung.",
            "Die Position dort und weit davon mit einem anderen Gerät ablesen, von beiden Seiten kommend.",
            "Den Antrieb prüfen lassen; ein Losausgleich gilt nur an einer Stelle.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis that reverses: x, y or z")
    at_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="coordinate of the largest wear",
        ge=-1e5,
        le=1e5,
        sensible=(-2e3, 2e3),
        edge=True,
        grid=grids.worn_mm,
    )
    width_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="full width at half height",
        gt=0,
        le=1e5,
        sensible=(20, 1000),
        grid=grids.worn_widths_mm,
    )
    um: float = parameter(unit="um", meaning="additional reversal error there", ge=-1e4, le=1e4, sensible=(-50, 50))

    def displacement_um(self, probings: Probings) -> Displacement:
        """A reversal error times a Gaussian."""
        worn = bump(probings.axis_mm(self.axis), self.at_mm, self.width_mm)
        return {self.axis: sense(probings, self.axis) * worn * (self.um / 2.0)}


class ReversalSlope(Effect):
    """The reversal error grows along the axis: d = (um_per_m / 2) sign(p_axis) (x - middle of travel).

    It is added to the reversal error of the whole axis, which is that in the middle.
    """

    kind: ClassVar[str] = "reversal_slope"
    equation: ClassVar[str] = "d = (um_per_m / 2) sign(approach on the axis) (x - middle of travel)"
    source: ClassVar[str] = "ISO 230-2:2014, reversal error B by position; a screw that is worn towards one end"
    covariates: ClassVar[tuple[str, ...]] = ("approach", "coordinate")
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.2, 3.0, "screws and racks wear towards one end", basis="grade")
    words: ClassVar[Wording | None] = Wording(
        "reversal error that grows",
        "The reversal error of {axis} grows by {um_per_m} along it: the drive has more play towards one end.",
        "Drive {axis} to a dial gauge from both sides, at both ends of its travel.",
        "Have the drive of {axis} inspected; a backlash compensation holds for one place only.",
        german=Wording(
            "mit der Achse wachsende Umkehrspanne",
            "Die Umkehrspanne von {axis} wächst längs der Achse um {um_per_m}: Der Antrieb hat gegen ein Ende"
            " mehr Lose.",
            "{axis} an beiden Enden des Wegs von beiden Seiten an eine Messuhr fahren.",
            "Den Antrieb von {axis} prüfen lassen; ein Losausgleich gilt nur an einer Stelle.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "reversal error that grows",
        "The reversal error grows by {um_per_m} along the axis: the drive has more play towards one end.",
        "Read both ends with another instrument, coming from both sides.",
        "Have the drive inspected; a backlash compensation holds for one place only.",
        german=Wording(
            "mit der Achse wachsende Umkehrspanne",
            "Die Umkehrspanne wächst längs der Achse um {um_per_m}: Der Antrieb hat gegen ein Ende mehr Lose.",
            "Beide Enden mit einem anderen Gerät ablesen, von beiden Seiten kommend.",
            "Den Antrieb prüfen lassen; ein Losausgleich gilt nur an einer Stelle.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis that reverses: x, y or z")
    um_per_m: float = parameter(
        unit="um/m", meaning="reversal error more for each metre of travel", ge=-1e5, le=1e5, sensible=(-50, 50)
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """A reversal error in proportion to the distance from the middle."""
        middle = probings.setting.travel_mm["xyz".index(self.axis)].mean()
        from_middle_m = (probings.axis_mm(self.axis) - middle) * 1e-3
        return {self.axis: sense(probings, self.axis) * from_middle_m * (self.um_per_m / 2.0)}


class StickSlip(Effect):
    """Friction holds an axis back after a reversal: d = (um / 2) sign(p_axis) exp(-s / decay), s the path since then.

    After a probing an axis retracts. If it reaches the next probing in the direction of its approach, s is the path
    between the two; from the other side it reverses just before the search, s = 0.
    """

    kind: ClassVar[str] = "stick_slip"
    equation: ClassVar[str] = (
        "d = (um / 2) sign(approach on the axis) exp(-s / decay_mm); s: path from the last touch in that sense, else 0"
    )
    source: ClassVar[str] = "presliding friction as a relaxing spring: Armstrong et al., Automatica 30 (1994) 1083"
    covariates: ClassVar[tuple[str, ...]] = ("approach", "order")
    process: ClassVar[bool] = True
    recordings: ClassVar[tuple[str, ...]] = AXES
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.2, 1.0, "slideways more, rolling and air bearings less", basis="grade"
    )
    words: ClassVar[Wording | None] = Wording(
        "stick-slip",
        "After {axis} has turned round, the two directions differ by {um}, which fades over {decay_mm} of way:"
        " friction holds it back.",
        "Look at lubrication and wipers of the {axis} guideway.",
        "Clean and lubricate the guideway of {axis}.",
        german=Wording(
            "Ruckgleiten",
            "Nach einer Umkehr von {axis} weichen beide Richtungen um {um} voneinander ab, was auf {decay_mm}"
            " Weg abklingt: Reibung hält die Achse zurück.",
            "Schmierung und Abstreifer der Führung {axis} ansehen.",
            "Die Führung {axis} reinigen und schmieren.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "stick-slip",
        "Just after the axis turns, the two directions differ by {um}, which fades over {decay_mm}: friction in"
        " the guides or the drive.",
        "Look at lubrication and wipers of the guideway; approach a target from farther away.",
        "Clean and lubricate the guideway.",
        german=Wording(
            "Ruckgleiten",
            "Kurz nach einer Umkehr weichen beide Richtungen um {um} voneinander ab, was auf {decay_mm}"
            " abklingt: Reibung in Führung oder Antrieb.",
            "Schmierung und Abstreifer der Führung ansehen; ein Ziel von weiter her anfahren.",
            "Die Führung reinigen und schmieren.",
        ),
    )
    axis: Axis = parameter(unit="", role="choice", meaning="axis that sticks: x, y or z")
    um: float = parameter(
        unit="um", meaning="reversal error just after a reversal", ge=-1e4, le=1e4, sensible=(-20, 20)
    )
    decay_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="path in which it decays to 1/e",
        gt=0,
        le=1e4,
        sensible=(0.5, 100),
        grid=grids.decays_mm,
    )

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """Where an axis comes nearly always from one side, single touches tell."""
        way = probings.way()
        few = min((way > 0).sum(), (way < 0).sum()) < FEWEST_BACK * len(way)
        return UNDETERMINED if few else 1.0

    def displacement_um(self, probings: Probings) -> Displacement:
        """The reversal error that remains after the path to the probing."""
        left = np.exp(-probings.run_mm(self.axis) / self.decay_mm)
        return {self.axis: sense(probings, self.axis) * left * (self.um / 2.0)}


def sense(probings: Probings, axis: str) -> Array:
    """+1 in positive travel of an axis, -1 in negative travel, 0 where it does not move."""
    share = probings.approach(axis)
    return np.sign(share) * (np.abs(share) > STANDSTILL)

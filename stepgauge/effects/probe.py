"""Effects of the touch-trigger probe: its pre-travel, which depends on direction and speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import GAUGE, UNDETERMINED, Displacement, Effect, EffectPrior, Wording, parameter
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array
from stepgauge.probes import EmpiricalProbe, MechanicalProbe, Probe

TOLD_APART, LIKE_DIRECTIONS = 0.3, 0.1
"""Share of the placements' own levels that must be left beside what they have in common, and what counts as alike."""
ON_AXIS = 1e-6
"""Sine of the polar angle below which an approach along the stylus has no azimuth."""
ACROSS = np.column_stack([np.cos(np.arange(36) * np.pi / 18), np.sin(np.arange(36) * np.pi / 18), np.zeros(36)])
"""Contact normals around the stylus, in the frame of the probe."""


class EffectiveRadius(Effect):
    """The mean pre-travel is larger than modelled: d = um along every approach (R_eff = r - w is smaller)."""

    kind: ClassVar[str] = "effective_radius"
    equation: ClassVar[str] = "d = um along the approach"
    source: ClassVar[str] = "Pahk & Kim, Eq 1: R_eff from the size of a known block"
    covariates: ClassVar[tuple[str, ...]] = ("side",)
    touch: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "spot")
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        2.0, 1.0, "drift of a qualification from day to day, after every change of the stylus", basis="grade"
    )
    words: ClassVar[Wording | None] = Wording(
        "tip correction",
        "The probe triggers {um} {um:later|earlier} than modelled, equally on all faces; blocks appear too"
        " {um:small|large} by twice that.",
        "Is the stylus tight and the tip clean? {steps:Touch both sides of one gauge block|Qualify it on the reference"
        " sphere} and compare.",
        "In the machine file: pretravel_um {new_um:= {new_um:±}|{um:plus|minus} {um:±}}; of another tip tip_radius_mm"
        " {um:minus|plus} {um:±mm} instead.",
        german=Wording(
            "Tastkugelkorrektur",
            "Der Taster schaltet auf allen Flächen um {um} {um:später|früher} als angenommen; Blöcke erscheinen"
            " um das Doppelte zu {um:klein|groß}.",
            "Ist der Taststift fest und die Kugel sauber? {steps:Ein Endmaß von beiden Seiten antasten|An der"
            " Bezugskugel einmessen} und vergleichen.",
            "In der Maschinendatei: pretravel_um {new_um:= {new_um:±}|{um:plus|minus} {um:±}}; bei einer anderen Kugel"
            " stattdessen tip_radius_mm {um:minus|plus} {um:±mm}.",
        ),
    )
    corrected_words: ClassVar[Wording | None] = Wording(
        "tip correction",
        "The machine takes off {um} too {um:much|little} for the tip, equally on all faces: the radius of its"
        " qualification is too {um:large|small}; blocks appear too {um:small|large} by twice that.",
        "Is the stylus tight and the tip clean? Qualify it on the reference sphere and compare the radius.",
        "Qualify the stylus anew; the radius by which the machine corrects {um:minus|plus} {um:±}.",
        german=Wording(
            "Tastkugelkorrektur",
            "Die Maschine zieht für die Tastkugel auf allen Flächen {um} zu {um:viel|wenig} ab: Der eingemessene"
            " Radius ist zu {um:groß|klein}; Blöcke erscheinen um das Doppelte zu {um:klein|groß}.",
            "Ist der Taststift fest und die Kugel sauber? An der Bezugskugel einmessen und den Radius vergleichen.",
            "Den Taststift neu einmessen; der Radius, mit dem die Maschine korrigiert, {um:minus|plus} {um:±}.",
        ),
    )
    axis_words: ClassVar[Wording | None] = Wording(
        "additive constant",
        "All readings are {um} {um:late or too long|early or too short}, whatever their length: a pre-travel or"
        " an additive constant.",
        "Determine the constant by other means, on a known length or on the reference sphere.",
        "Enter the new constant.",
        german=Wording(
            "Additionskonstante",
            "Alle Werte sind um {um} {um:zu spät oder zu lang|zu früh oder zu kurz}, wie lang die Strecke auch"
            " ist: ein Vorlaufweg oder eine Additionskonstante.",
            "Die Konstante anders bestimmen, an einer bekannten Länge oder an der Bezugskugel.",
            "Die neue Konstante eingeben.",
        ),
    )
    um: float = parameter(unit="um", meaning="mean pre-travel larger by", ge=-1e4, le=1e4, sensible=(-20, 20))

    def displacement_um(self, probings: Probings) -> Displacement:
        """The same for all."""
        return {"approach": np.broadcast_to(self.um, np.broadcast_shapes(np.shape(self.um), (len(probings),)))}


class ProbeLobing(Effect):
    """Three lobes of a tripod probe: d = A cos(3 (azimuth - phase)) along the approach, azimuth about the stylus.

    With a further stylus in proportion to its pre-travel by the same trigger moment.
    """

    kind: ClassVar[str] = "probe_lobing"
    equation: ClassVar[str] = "d = amplitude_um cos(3 (azimuth - phase_deg)) along the approach"
    source: ClassVar[str] = (
        "first harmonic of the pre-travel of a three-contact probe, Wozniak & Dobosz, Measurement 34"
    )
    covariates: ClassVar[tuple[str, ...]] = ("azimuth",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 1.0, "tripod probes of 50 mm stylus")
    words: ClassVar[Wording | None] = Wording(
        "probe lobing",
        "The pre-travel varies by {amplitude_um} about its mean with the direction of approach, in three lobes:"
        " largest at an azimuth of {phase_deg:=3} and every 120 deg from there.",
        "Probe a sphere from all sides (stepgauge probe qualify).",
        "Compensate by direction (stepgauge probe compensate), or have the probe module exchanged.",
        german=Wording(
            "Dreibogen des Tasters",
            "Der Vorlaufweg ändert sich mit der Antastrichtung um {amplitude_um} um sein Mittel, in drei Bögen,"
            " am größten bei einem Azimut von {phase_deg:=3} und alle 120° davon.",
            "Eine Kugel von allen Seiten antasten.",
            "Je Richtung kompensieren oder das Tastmodul tauschen lassen.",
        ),
    )
    amplitude_um: float = parameter(unit="um", meaning="half of peak to valley", ge=0, le=1e3, sensible=(0, 10))
    phase_deg: float = parameter(
        0.0, unit="deg", role="phase", meaning="azimuth of a lobe", ge=-360, le=360, sensible=(-60, 60), turn=120.0
    )

    def displacement_um(self, probings: Probings) -> Displacement:
        """cos 3b and sin 3b as polynomials of cos b and sin b; zero along the stylus, where b is undefined."""
        c, s = probings.lateral_share()
        size = np.sqrt(c * c + s * s)
        inverse = np.where(size > ON_AXIS, 1.0, 0.0) / np.maximum(size, ON_AXIS)
        c, s = c * inverse, s * inverse
        phase = np.radians(3.0 * self.phase_deg)
        lobes = c * (4.0 * c * c - 3.0) * np.cos(phase) + s * (3.0 - 4.0 * s * s) * np.sin(phase)
        return {"approach": self.amplitude_um * (lobes * (size > ON_AXIS)) * probings.setting.pretravel}


class TipChange(Effect):
    """One placement was probed with another tip, or after a change of the stylus: d = um along every approach there."""

    kind: ClassVar[str] = "tip_change"
    equation: ClassVar[str] = "d = um along the approach where the placement is 'placement'"
    source: ClassVar[str] = "definition; effective radii of several styli, ISO 10360-5"
    covariates: ClassVar[tuple[str, ...]] = ("side", "placement")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.3, 1.0, "tips are changed and qualified anew between placements"
    )
    words: ClassVar[Wording | None] = Wording(
        "tip change",
        "In placement {placement} the probe triggers {um} {um:later|earlier} than in the others: another tip or"
        " stylus, or one not qualified anew.",
        "Compare the stylus of placement {placement} with that of the others.",
        "Qualify it, and measure this placement again.",
        german=Wording(
            "anderer Taststift",
            "In Lage {placement} schaltet der Taster um {um} {um:später|früher} als in den anderen: ein anderer"
            " Taststift, oder einer, der nicht neu eingemessen wurde.",
            "Den Taststift der Lage {placement} mit dem der anderen vergleichen.",
            "Ihn einmessen und diese Lage noch einmal messen.",
        ),
    )
    placement: int = parameter(
        unit="",
        role="choice",
        meaning="number of the placement",
        ge=1,
        le=10_000,
        grid=grids.placements_beside_others,
    )
    um: float = parameter(unit="um", meaning="pre-travel larger there by", ge=-1e4, le=1e4, sensible=(-20, 20))

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """Placements tell a radius of their own from what all have in common by directions that all have."""
        numbers = probings.column("placement")
        own = (numbers == np.unique(numbers)[:, None]).astype(float)
        shared = np.vstack([np.ones(len(probings)), np.abs([probings.approach(axis) for axis in "xyz"])])
        return 1.0 if share_beside(own, shared) > TOLD_APART else UNDETERMINED

    def displacement_um(self, probings: Probings) -> Displacement:
        """Zero in all other placements."""
        return {"approach": self.um * (probings.column("placement") == self.placement)}


class LeverArm(Effect):
    """The trigger lever is longer than modelled: d = w(lever + mm) - w(lever) along the approach.

    For a kinematic probe the statics give the influence of a longer lever. For a probe of which only a pre-travel w is
    known: a lateral trigger force F has a fixed moment F lever about the contacts, and w is the bending under F, so
    that d = -w mm / (lever + mm) sin^2(polar), with the stylus length as lever.
    """

    kind: ClassVar[str] = "lever_arm"
    equation: ClassVar[str] = (
        "d = w(lever + mm) - w(lever) along the approach; first order: -w mm / (lever + mm) sin^2(polar)"
    )
    source: ClassVar[str] = "moment balance at the trigger, Rodrigues 2021 (50 mm stylus, 14.5 mm of carrier left out)"
    covariates: ClassVar[tuple[str, ...]] = ("polar",)
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(0.5, 2.0, unit="mm")
    words: ClassVar[Wording | None] = Wording(
        "lever arm",
        "The trigger lever is {mm} {mm:longer|shorter} than modelled.",
        "Measure the length of the stylus and compare it with the file.",
        "State the measured length.",
        german=Wording(
            "Hebelarm des Tasters",
            "Der Hebel des Tasters ist um {mm} {mm:länger|kürzer} als angenommen.",
            "Die Länge des Taststifts messen und mit der Datei vergleichen.",
            "Die gemessene Länge angeben.",
        ),
    )
    mm: float = parameter(
        unit="mm", role="nonlinear", meaning="lever longer than modelled by", ge=-20, le=500, sensible=(0, 30)
    )

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Of a pre-travel that nobody modelled nothing changes."""
        probe = probings.setting.probe
        return probe is None or probe.model != "constant"

    def displacement_um(self, probings: Probings) -> Displacement:
        """Change of the pre-travel with the lever."""
        return {"approach": lever_pretravel_um(probings, self.mm)}


class PretravelScale(Effect):
    """All pre-travel is larger than modelled by the same share: d = percent / 100 w along the approach.

    A stylus that bends more, a module that gives way, a spring that is set harder: the pre-travel w of the machine
    file's probe keeps its shape over the directions. Of a probe with the same pre-travel everywhere it is a radius.
    """

    kind: ClassVar[str] = "pretravel_scale"
    equation: ClassVar[str] = "d = percent / 100 w(approach) along the approach"
    source: ClassVar[str] = (
        "pre-travel = force x compliance; Rodrigues 2021: compliance of an OMP40-2 0.911 of the uniform beam's"
    )
    covariates: ClassVar[tuple[str, ...]] = ("azimuth", "polar")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.3, 10.0, "9 % between a uniform stylus and one with a stiff root"
    )
    words: ClassVar[Wording | None] = Wording(
        "pretravel scale",
        "The pre-travel is {percent} {percent:larger|smaller} than modelled in every direction: the stylus"
        " bends {percent:more|less}, or the spring is set otherwise.",
        "Look which stylus is in the probe, and compare it with the machine file.",
        "Correct the stiffness of the stylus in the machine file.",
        german=Wording(
            "größerer Vorlaufweg",
            "Der Vorlaufweg ist in jeder Richtung um {percent} {percent:größer|kleiner} als angenommen: Der"
            " Stift biegt sich {percent:mehr|weniger}, oder die Feder ist anders eingestellt.",
            "Nachsehen, welcher Stift im Taster steckt, und mit der Maschinendatei vergleichen.",
            "Die Steifigkeit des Stifts in der Maschinendatei berichtigen.",
        ),
    )
    percent: float = parameter(
        unit="%", meaning="pre-travel larger than modelled by", gt=-100, le=1e4, sensible=(-50, 100)
    )

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Of a pre-travel that nobody modelled nothing changes."""
        probe = probings.setting.probe
        return probe is None or probe.model != "constant"

    def displacement_um(self, probings: Probings) -> Displacement:
        """In proportion to the modelled pre-travel; nothing where no probe is modelled."""
        sensor = probings.setting.sensor
        if sensor is None:
            return {"approach": np.zeros(len(probings))}
        approach, which = probings.approaches()
        return {"approach": self.percent * 1e-2 * sensor.pretravel_um(approach)[which]}


def lever_pretravel_um(probings: Probings, longer_mm: float | Array) -> Array:
    """Change of the pre-travel when the lever is longer, um, ``(n,)`` or, for a lever by run ``(runs, 1)``, by run."""
    sensor, table = probings.setting.sensor, probings.setting.probe
    sensor = sensor.base if isinstance(sensor, EmpiricalProbe) else sensor
    if isinstance(sensor, MechanicalProbe):
        return _static_pretravel_um(sensor, probings, longer_mm)
    if sensor is None or table is None:
        return np.zeros(len(probings))
    c, s = probings.lateral_share()
    across = c * c + s * s
    return across * (-_mean_pretravel_um(sensor) * longer_mm / (table.shank_length_mm + longer_mm))


def _static_pretravel_um(sensor: MechanicalProbe, probings: Probings, longer_mm: float | Array) -> Array:
    approach = np.stack([probings.approach(axis) for axis in "xyz"], axis=-1)
    modelled = sensor.pretravel_um(approach)
    changes = []
    for more in np.ravel(longer_mm):
        tripod = replace(sensor.tripod, lever_mm=sensor.tripod.lever_mm + float(more))
        changes.append(replace(sensor, tripod=tripod).pretravel_um(approach) - modelled)
    return changes[0] if np.ndim(longer_mm) == 0 else np.stack(changes)


def _mean_pretravel_um(sensor: Probe) -> float:
    """Mean over the directions across the stylus."""
    return float(sensor.pretravel_um(sensor.approaches(ACROSS)).mean())


def share_beside(columns: Array, shared: Array) -> float:
    """Share of the norm of columns ``(k, n)`` that is left beside what others ``(m, n)`` have in common with them.

    The others count as different where they differ by more than a tenth.
    """
    left = columns - np.linalg.lstsq(shared.T, columns.T, rcond=LIKE_DIRECTIONS)[0].T @ shared
    return float(np.linalg.norm(left) / np.linalg.norm(columns))

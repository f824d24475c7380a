"""Effects of the touch-trigger probe: its pre-travel, which depends on direction and speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from stepgauge.effects import grids
from stepgauge.effects.base import GAUGE, UNDETERMINED, Displacement, Effect, EffectPrior, parameter
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
        2.0, 1.0, "drift of a qualification from day to day, after every change of the stylus"
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


class TriggerDelay(Effect):
    """The position is latched a delay after the trigger: d = delay * measuring speed along the approach."""

    kind: ClassVar[str] = "trigger_delay"
    equation: ClassVar[str] = "d = ms speed_mm_s along the approach"
    source: ClassVar[str] = "Jankowski in Rodrigues 2021: 14.5 ms of radio delay at 50 mm/min are 12.1 um"
    covariates: ClassVar[tuple[str, ...]] = ("speed",)
    recordings: ClassVar[tuple[str, ...]] = ("gauge", "linear", "rotary", "spot")
    touch: ClassVar[tuple[str, ...]] = ("gauge", "spot")
    prior: ClassVar[EffectPrior | None] = EffectPrior(1.0, 0.2, "controllers poll in 0.1 to 1 ms")
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
        return _by_statics_um(sensor, probings, longer_mm)
    if sensor is None or table is None:
        return np.zeros(len(probings))
    c, s = probings.lateral_share()
    across = c * c + s * s
    return across * (-_mean_pretravel_um(sensor) * longer_mm / (table.shank_length_mm + longer_mm))


def _by_statics_um(sensor: MechanicalProbe, probings: Probings, longer_mm: float | Array) -> Array:
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

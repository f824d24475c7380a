"""Pre-travel of a kinematic probe by direction: trigger force by the statics of its six contacts, times compliance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from stepgauge.effects import grids
from stepgauge.effects.base import (
    GAUGE,
    UNDETERMINED,
    Displacement,
    Effect,
    EffectPrior,
    UsualShape,
    Wording,
    parameter,
)
from stepgauge.effects.probings import Probings, Setting
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.physics import friction, trigger
from stepgauge.physics.directions import iso_10360_5_points
from stepgauge.probes import MechanicalProbe
from stepgauge.probes.base import head_frame

LEVER = UsualShape(15.0, 1.4, "in units of a seat of 10 mm and 30 deg: seats of 7 to 14 mm", beyond_stylus=True)
ALONG = UsualShape(0.03, 3.0, "OMP40-2 with 50 mm, most of it where the tip meets the face; a module is softer")
UNQUALIFIED = 0.03
"""Odds of a tripod's whole pre-travel, over its variation alone: tips are qualified before they measure."""
FEWEST_DIRECTIONS = 3
SEAT_SHARE = 0.2
"""Of its reaction at rest, at which a bad seat opens: readings show its product with the compliance."""
QUALIFIED = iso_10360_5_points()
"""Contact normals of a qualification, in the frame of the probe."""
FEW = 300
"""Numbers of directions up to which a trigger force is kept."""


def arm_azimuth(turn: float) -> Any:
    """The parameter of a tripod's azimuth; ``turn``, deg: after which it looks the same."""
    meaning, grid = "azimuth of an arm in the probe's frame", grids.arm_azimuths_deg
    return parameter(
        0.0,
        unit="deg",
        role="nonlinear",
        meaning=meaning,
        sensible=(-60, 60),
        grid=grid,
        turn=turn,
        ge=-360,
        le=360,
    )


class Seated(Effect):
    """A probe that triggers when the first of its six contacts opens: seat, lever and compliance.

    If the probe of the machine file is a constant or has no pre-travel, these parameters describe the probe. With a
    further stylus the lever is longer by as much as the stylus, and the compliance grows with its length cubed.
    """

    um_per_N: float = parameter(
        unit="um/N",
        meaning="compliance of stylus, module and contact across the stylus",
        ge=0,
        le=1e3,
        sensible=(0.5, 50),
    )
    lever_mm: float = parameter(
        unit="mm",
        role="nonlinear",
        meaning="from the plane of the arms to the tip",
        gt=0,
        le=1e3,
        sensible=(15, 150),
        usual=LEVER,
    )
    arm_azimuth_deg: float = arm_azimuth(120.0)
    along: float = parameter(
        0.03,
        unit="1",
        role="nonlinear",
        meaning="compliance along the stylus over that across it",
        ge=0,
        le=10,
        sensible=(0.003, 0.3),
        usual=ALONG,
    )
    friction: float = parameter(
        0.0, unit="1", role="fixed", meaning="coefficient of friction of the arms in their seats", ge=0, le=0.4
    )
    tip_friction: float = parameter(
        0.0, unit="1", role="fixed", meaning="coefficient of friction of the tip on the face", ge=0, le=1
    )
    preload_N: float = parameter(5.0, unit="N", role="fixed", meaning="spring force along the axis", gt=0, le=100)
    contact_radius_mm: float = parameter(
        10.0, unit="mm", role="fixed", meaning="from the probe's axis to the contacts", gt=0, le=100
    )
    contact_angle_deg: float = parameter(
        30.0, unit="deg", role="fixed", meaning="of the contact normals above the plane of the arms", gt=1, lt=89
    )

    @model_validator(mode="after")
    def _holds_and_opens(self) -> Self:
        if self.friction:
            friction.trigger_force_N(self.tripod(), [0.0, 0.0, 1.0], self.friction)  # says so where the seat jams
        return self

    @classmethod
    def is_own(cls, choices: Mapping[str, Any], probings: Probings) -> bool:
        """Of a probe that is modelled by its construction a part may be different; it is not another tripod."""
        return not isinstance(probings.setting.sensor, MechanicalProbe)

    @classmethod
    def rarity(cls, probings: Probings) -> float:
        """Along few directions it is a radius or a reversal."""
        few = len(probings.approaches()[0]) < FEWEST_DIRECTIONS + len(np.unique(probings.column("placement")))
        return UNDETERMINED if few else 1.0

    @classmethod
    def preference(cls, choices: Mapping[str, Any]) -> float:
        """The mean pre-travel is in the effective radius of the qualification."""
        return UNQUALIFIED if choices.get("part") == "whole" else 1.0

    def displacement_um(self, probings: Probings) -> Displacement:
        """Force times compliance; computed once for every distinct direction."""
        sensor = probings.setting.sensor
        approach, which = probings.approaches()
        normal = -approach @ (head_frame() if sensor is None else sensor.frame).T
        force = np.stack([one.force_N(normal) for one in self._runs(probings.setting)])
        if not np.isfinite(force).all():
            lost = approach[~np.isfinite(force).all(axis=0)][0]
            found = "approach " + ", ".join(f"{share:.3f}" for share in lost)
            raise InputError("effects", "a tripod never triggers: the face pulls the stylus out of it", found=found)
        by_row = (force[0] if len(force) == 1 else force)[..., which]
        return {"approach": self.um_per_N * probings.setting.compliance * by_row}

    def force_N(self, normal: Array) -> Array:
        """Force times the share of the compliance, N, (n,), for contact normals (n, 3) in the probe's frame."""
        raise NotImplementedError

    def _runs(self, setting: Setting) -> Iterator[Seated]:
        """This effect for every run, where parameters differ by run; a further stylus has a lever of its own."""
        values = {p.name: getattr(self, p.name) for p in self.parameters() if p.role == "nonlinear"}
        if setting.longer_mm and setting.probe is not None:
            values["lever_mm"] = np.maximum(self.lever_mm + setting.longer_mm, setting.probe.shank_length_mm)
        runs = max(np.size(value) for value in values.values())
        for run in range(runs):
            yield self.replace_values(
                **{name: float(np.ravel(v)[min(run, np.size(v) - 1)]) for name, v in values.items()}
            )

    def tripod(self, opening_N: tuple[float, ...] = (0.0,) * trigger.CONTACTS) -> trigger.Tripod:
        """The seat, with an opening force for each contact."""
        angle, azimuth = np.radians(self.contact_angle_deg), np.radians(self.arm_azimuth_deg)
        seat = (self.preload_N, self.contact_radius_mm, float(angle), self.lever_mm, float(azimuth))
        return trigger.Tripod(*seat, opening_force_N=opening_N)

    def giving_way_N(self, normal: Array, tripod: trigger.Tripod) -> Array:
        """Pre-travel per compliance across the stylus, (...), for contact normals (..., 3) in the probe's frame.

        ``inf`` where the probe never triggers, also for a stylus that is stiff along itself.
        """
        push = friction.tip_force_direction(normal, self.tip_friction, self.along) if self.tip_friction else normal
        if self.friction:
            force = friction.trigger_force_N(tripod, push, self.friction)
        elif push.size <= FEW:
            force = _known_force_N(tripod, np.asarray(push, dtype=float).tobytes()).reshape(push.shape[:-1])
        else:
            force = trigger.trigger_force_N(tripod, push)
        share = np.sum(normal * push, axis=-1) - (1.0 - self.along) * normal[..., 2] * push[..., 2]
        return np.multiply(force, share, out=np.full(share.shape, np.inf), where=np.isfinite(force))


@lru_cache(maxsize=1024)
def _known_force_N(tripod: trigger.Tripod, push: bytes) -> Array:
    """Trigger force for few directions (n, 3): those of a program recur with every recording and every defect."""
    found = trigger.trigger_force_N(tripod, np.frombuffer(push).reshape(-1, 3))
    found.flags.writeable = False
    return found


class KinematicPretravel(Seated):
    """The probe triggers when its tripod opens a contact: d = um_per_N F(direction) along the approach.

    F is the force at which the first of the six reactions becomes zero; the compliance along the stylus is ``along``
    times that across it. The effect is added to the pre-travel of the probe in the machine file: after a qualification
    with a constant only the part that is ``varying`` about the mean of the qualification remains.
    """

    kind: ClassVar[str] = "kinematic_pretravel"
    equation: ClassVar[str] = (
        "d = um_per_N F (sin^2(polar) + along cos^2(polar)) along the approach; across the stylus"
        " F = preload_N / max over arms of 2 (lever_mm / contact_radius_mm cos(b) + tan(contact_angle_deg) |sin(b)|),"
        " b: azimuth from the arm"
    )
    source: ClassVar[str] = "statics of six contacts, docs/virtual-cmm.md; Rodrigues 2021, 2.7 to 2.9; Ren et al. 2020"
    covariates: ClassVar[tuple[str, ...]] = ("azimuth", "polar")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        2.0,
        5.0,
        "every kinematic probe has it, a qualification leaves its variation; OMP40-2: 4.6 at 50 mm",
        basis="stylus",
        unit="um/N",
    )
    words: ClassVar[Wording | None] = Wording(
        "kinematic pretravel",
        "The probe triggers as a tripod on six contacts does, with an arm at an azimuth of {arm_azimuth_deg:=3}"
        " (or opposite, if all gauges lay level): up to {largest} in this recording.",
        "Probe a sphere from all sides (stepgauge probe qualify).",
        "Compensate by direction (stepgauge probe compensate), or have the probe module exchanged.",
        german=Wording(
            "Vorlauf des Dreipunkttasters",
            "Der Taster schaltet wie ein Dreibein auf sechs Kontakten, mit einem Arm bei einem Azimut von"
            " {arm_azimuth_deg:=3} (oder gegenüber, wenn alle Stufenendmaße waagrecht lagen): bis {largest} in"
            " diesen Messdaten.",
            "Eine Kugel von allen Seiten antasten.",
            "Je Richtung kompensieren oder das Tastmodul tauschen lassen.",
        ),
    )
    part: Literal["whole", "varying"] = parameter(
        "whole",
        unit="",
        role="choice",
        meaning="the whole pre-travel, or its variation about the mean of 25 points on a sphere",
    )

    def force_N(self, normal: Array) -> Array:
        """Of the seat without defect; minus the mean of its qualification, if so chosen."""
        tripod = self.tripod()
        force = self.giving_way_N(normal, tripod)
        return force if self.part == "whole" else force - self.giving_way_N(QUALIFIED, tripod).mean()


class SeatDefect(Seated):
    """One seat of a tripod is worn or dirty and opens too early: d = um_per_N (F with it - F without).

    Its two contacts count as open at a ``share`` of their reaction at rest. The probe triggers earlier where that arm
    opens first, and as before elsewhere: orders 1 and 2 in azimuth, which a tripod without defect does not have.
    """

    kind: ClassVar[str] = "seat_defect"
    equation: ClassVar[str] = (
        "d = um_per_N (F - F of the sound seat) (sin^2(polar) + along cos^2(polar)) along the approach;"
        " where the arm opens first F is (1 - share) times that of the sound seat"
    )
    source: ClassVar[str] = "statics of six contacts, of which two count as open too early; docs/virtual-cmm.md"
    covariates: ClassVar[tuple[str, ...]] = ("azimuth", "polar")
    recordings: ClassVar[tuple[str, ...]] = GAUGE
    touch: ClassVar[tuple[str, ...]] = ("gauge",)
    prior: ClassVar[EffectPrior | None] = EffectPrior(
        0.2, 5.0, "bends the stylus as kinematic_pretravel does", basis="stylus", unit="um/N"
    )
    words: ClassVar[Wording | None] = Wording(
        "seat defect",
        "One seat of the probe's tripod opens too early, that of the arm at an azimuth of {arm_azimuth_deg:=3} (or"
        " opposite, if all gauges lay level): up to {largest} in this recording.",
        "Probe a sphere from all sides (stepgauge probe qualify).",
        "Have the probe cleaned, or its module exchanged.",
        german=Wording(
            "schadhafte Auflage im Taster",
            "Eine Auflage im Dreibein des Tasters öffnet zu früh, die des Arms bei einem Azimut von"
            " {arm_azimuth_deg:=3} (oder gegenüber, wenn alle Stufenendmaße waagrecht lagen): bis {largest} in"
            " diesen Messdaten.",
            "Eine Kugel von allen Seiten antasten.",
            "Den Taster reinigen oder sein Modul tauschen lassen.",
        ),
    )
    arm_azimuth_deg: float = arm_azimuth(360.0)
    arm: Literal["first", "second", "third"] = parameter(
        "first",
        unit="",
        role="choice",
        meaning="arm on the defective seat: first (at arm_azimuth_deg), second or third",
        grid=grids.values("first"),  # the azimuth says which one
    )
    share: float = parameter(
        unit="1",
        role="nonlinear",
        meaning="share of the reaction at rest at which it counts as open",
        ge=0,
        le=0.95,
        sensible=(0.02, 0.5),
        grid=grids.values(SEAT_SHARE),
    )

    def force_N(self, normal: Array) -> Array:
        """Of the defective seat minus that of the seat without defect."""
        sound = self.tripod()
        rest = trigger.rest_reactions_N(sound)
        worn = np.arange(trigger.CONTACTS) // 2 == ("first", "second", "third").index(self.arm)
        early = self.tripod(tuple((self.share * rest * worn).tolist()))
        force = self.giving_way_N(normal, sound)
        opens = np.isfinite(force)  # a seat that no push opens has no force to be less than
        return np.subtract(self.giving_way_N(normal, early), force, out=np.full(force.shape, np.inf), where=opens)

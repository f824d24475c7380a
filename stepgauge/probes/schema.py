"""Keys of a probe file: the ``[probe]`` table and the tables inside it, key by key with unit and range."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from stepgauge.files.config import TomlTable, Vector3
from stepgauge.physics.pretravel import Indentation
from stepgauge.probes.empirical import EmpiricalTable
from stepgauge.probes.table import Symmetry

DEFAULT_STYLUS_MM = 50.0
"""Stylus length where the file does not state one; only collision checks use it."""
USUAL_PRETRAVEL_UM = 3.0
"""Pre-travel that is simulated where the file does not state one; usual are 2 to 10 um."""
SHANK_SHARE = 0.6
"""Shank diameter over ball diameter where the file does not state the shank."""
Pair = Annotated[tuple[float, float], Field(strict=False)]


class ProbeTable(TomlTable):
    """Keys that every model has."""

    model: str = Field(description="constant, lobed, table, kinematic or piezo")
    name: str = Field("", description="name of the probe, for reports")
    tool: str = Field("", description="what an I++ DME server calls it, which can change to it by itself")
    tip_radius_mm: float = Field(gt=0, le=20, description="true radius of the tip ball, mm")
    stylus_direction: Vector3 = Field((0.0, 0.0, -1.0), description="from the probe body to the tip, machine axes")
    roll_deg: float = Field(0.0, ge=-360, le=360, description="turn of the probe about its stylus, deg")
    stylus_length_mm: float | None = Field(None, gt=0, le=1000, description="tip centre to probe body, mm")
    stylus_diameter_mm: float | None = Field(None, gt=0, le=40, description="diameter of the shank, mm")
    body_diameter_mm: float = Field(25.0, gt=0, le=500, description="diameter of the probe body, mm")
    body_length_mm: float = Field(120.0, ge=0, le=2000, description="length of the probe body and head, mm")
    empirical: list[EmpiricalTable] = Field([], description="tables [[probe.empirical]], laws without a name")

    @model_validator(mode="after")
    def _unit_direction(self) -> ProbeTable:
        if abs(np.linalg.norm(self.stylus_direction) - 1.0) > 1e-6:
            raise ValueError("stylus_direction must be a unit vector")
        if self.shank_radius_mm >= self.tip_radius_mm:
            raise ValueError("stylus_diameter_mm must be smaller than the tip ball")
        return self

    @property
    def states_radius(self) -> bool:
        """Whether tip minus pre-travel, the effective radius, is stated; else readings tell it."""
        return True

    @property
    def shank_length_mm(self) -> float:
        """From the tip centre to the probe body."""
        return DEFAULT_STYLUS_MM if self.stylus_length_mm is None else self.stylus_length_mm

    @property
    def shank_radius_mm(self) -> float:
        """Of the stylus near the tip."""
        return SHANK_SHARE * self.tip_radius_mm if self.stylus_diameter_mm is None else self.stylus_diameter_mm / 2.0


class ConstantTable(ProbeTable):
    """``model = "constant"``: the same pre-travel in all directions."""

    model: Literal["constant"] = "constant"
    pretravel_um: float = Field(
        USUAL_PRETRAVEL_UM, ge=0, le=1000, description="travel from contact to trigger, um; without it readings tell it"
    )

    @property
    def states_radius(self) -> bool:
        return "pretravel_um" in self.model_fields_set


class LobedTable(ProbeTable):
    """``model = "lobed"``: a mean with three lobes in the approach azimuth."""

    model: Literal["lobed"]
    pretravel_um: float = Field(ge=0, le=1000, description="mean travel from contact to trigger, um")
    amplitude_um: float = Field(ge=0, le=1000, description="half of peak to valley of the three lobes, um")
    phase_deg: float = Field(0.0, ge=-360, le=360, description="approach azimuth of the largest pre-travel, deg")


class MapTable(ProbeTable):
    """``model = "table"``: a map of directions from a file."""

    model: Literal["table"]
    map: str = Field(description="CSV with polar_deg,azimuth_deg,pretravel_um, beside this file")
    symmetry: Symmetry = Field("none", description='"none", "three-fold" (120 deg) or "mirrored" (0 to 60 deg)')


class SeatTable(TomlTable):
    """``[probe.seat]``: the tripod on its six contacts."""

    preload_N: float = Field(gt=0, le=100, description="spring force along the axis, N")
    contact_radius_mm: float = Field(gt=0, le=100, description="from the probe axis to the contacts, mm")
    contact_angle_deg: float = Field(gt=0, lt=90, description="of the contact normals above the plane of the arms, deg")
    carrier_mm: float = Field(0.0, ge=-50, le=200, description="from the plane of the arms to the stylus root, mm")
    arm_azimuth_deg: float = Field(0.0, ge=-360, le=360, description="azimuth of the first arm, deg")
    preload_offset_mm: Pair = Field((0.0, 0.0), description="x and y of the spring beside the axis, mm")
    opening_force_N: float = Field(0.0, ge=0, le=100, description="reaction at which a contact counts as open, N")
    opening_um: float = Field(0.0, ge=0, le=1000, description="gap at which the electronics see a contact open, um")
    friction: float = Field(0.0, ge=0, le=1, description="coefficient of friction of the arms in their seats")
    arm_radius_mm: float = Field(0.0, ge=0, le=20, description="radius of the arms, mm")
    ball_radius_mm: float | None = Field(None, gt=0, le=20, description="radius of the seat balls, mm; none = rigid")
    modulus_GPa: float = Field(620.0, gt=0, le=2000, description="Young's modulus of balls and arms, GPa")
    poisson: float = Field(0.22, ge=0, lt=0.5, description="Poisson's ratio of balls and arms")
    mass_g: float = Field(0.0, ge=0, le=1000, description="mass that moves with the tripod, without the stylus, g")
    mass_centre_mm: float = Field(
        0.0, ge=-100, le=200, description="its centre of mass below the plane of the arms, mm"
    )

    @model_validator(mode="after")
    def _arm_for_balls(self) -> SeatTable:
        if self.ball_radius_mm is not None and self.arm_radius_mm == 0.0:
            raise ValueError("arm_radius_mm must be given with ball_radius_mm")
        return self


class SectionTable(TomlTable):
    """``[[probe.stylus]]``: one section of the stylus, from the probe body to the tip."""

    length_mm: float = Field(gt=0, le=1000, description="length of the section, mm; the last ends at the tip centre")
    diameter_mm: float = Field(gt=0, le=50, description="outer diameter, mm")
    bore_mm: float = Field(0.0, ge=0, le=50, description="inner diameter of a tube, mm")
    modulus_GPa: float = Field(gt=0, le=2000, description="Young's modulus along the stylus, GPa")
    poisson: float = Field(0.3, ge=0, lt=0.5, description="Poisson's ratio")
    density_kg_m3: float = Field(0.0, ge=0, le=25000, description="density, kg/m3; 0 = weight left out")

    @model_validator(mode="after")
    def _has_wall(self) -> SectionTable:
        if self.bore_mm >= self.diameter_mm:
            raise ValueError("bore_mm must be smaller than diameter_mm")
        return self


class SurfaceTable(TomlTable):
    """``[probe.surface]``: tip and workpiece at the contact; without it they are rigid and frictionless."""

    tip_modulus_GPa: float = Field(gt=0, le=2000, description="Young's modulus of the tip, GPa")
    tip_poisson: float = Field(ge=0, lt=0.5, description="Poisson's ratio of the tip")
    modulus_GPa: float = Field(gt=0, le=2000, description="Young's modulus of the workpiece, GPa")
    poisson: float = Field(ge=0, lt=0.5, description="Poisson's ratio of the workpiece")
    friction: float = Field(0.0, ge=0, le=1, description="coefficient of friction of the tip on the workpiece")
    indentation: Indentation = Field("added", description='"added" (Wozniak), "subtracted" (Ren) or "left out"')


class SensorTable(TomlTable):
    """``[probe.sensor]``: the element of a piezo probe."""

    lateral_N: float = Field(gt=0, le=100, description="force across the stylus at which it answers, N")
    axial_N: float = Field(gt=0, le=100, description="force along the stylus at which it answers, N")


class KinematicTable(ProbeTable):
    """``model = "kinematic"``: a tripod on six contacts that open."""

    model: Literal["kinematic"]
    seat: SeatTable = Field(description="table [probe.seat]")
    stylus: list[SectionTable] = Field(min_length=1, description="tables [[probe.stylus]], from body to tip")
    surface: SurfaceTable | None = Field(None, description="table [probe.surface]")

    @property
    def shank_length_mm(self) -> float:
        """From the tip centre to the probe body: all sections of the stylus, mm."""
        return sum(section.length_mm for section in self.stylus)


class PiezoTable(KinematicTable):
    """``model = "piezo"``: a kinematic probe whose sensing element latches before the contacts open."""

    model: Literal["piezo"]  # type: ignore[assignment]
    sensor: SensorTable = Field(description="table [probe.sensor]")


TABLES: dict[str, type[ProbeTable]] = {
    "constant": ConstantTable,
    "lobed": LobedTable,
    "table": MapTable,
    "kinematic": KinematicTable,
    "piezo": PiezoTable,
}

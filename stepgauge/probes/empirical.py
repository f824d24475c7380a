"""A probe model plus empirical laws: fitted functions of the direction without a known cause."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable
from stepgauge.files.formula import parse_formula
from stepgauge.probes.base import Probe

Quantity = Literal["trigger_force_N", "deflection_um", "pretravel_um"]
DIRECTION = ("polar_deg", "azimuth_deg", "polar_rad", "azimuth_rad")
"""Names in a formula: polar angle and azimuth (0 to 360 deg) of the contact normal in the probe's frame."""

parse = lru_cache(maxsize=512)(parse_formula)


class EmpiricalTable(TomlTable):
    """``[[probe.empirical]]``: a fitted formula without a known cause that is added to one quantity."""

    quantity: Quantity = Field(description="trigger_force_N, deflection_um or pretravel_um")
    formula: str = Field(min_length=1, description="in the quantity's unit, e.g. c1 * cos(2 * azimuth_rad)")
    coefficients: dict[str, float] = Field(default_factory=dict, description="values of the names in the formula")

    @model_validator(mode="after")
    def _understood(self) -> EmpiricalTable:
        names = parse(self.formula).names - set(DIRECTION)
        for name in sorted(names ^ set(self.coefficients)):
            what = "a value for" if name in names else "a formula with"
            raise ValueError(f"{what} {name!r}; directions are {', '.join(DIRECTION)}")
        return self

    def at(self, normal: Array) -> Array:
        """The formula for contact normals (..., 3), (...)."""
        values = directions(normal) | {name: np.asarray(c, float) for name, c in self.coefficients.items()}
        return np.broadcast_to(parse(self.formula)(values), normal.shape[:-1])


def directions(normal: Array) -> dict[str, Array]:
    """Values of the names of :data:`DIRECTION` for contact normals (..., 3)."""
    polar = np.arctan2(np.hypot(normal[..., 0], normal[..., 1]), normal[..., 2])
    azimuth = np.arctan2(normal[..., 1], normal[..., 0]) % (2.0 * np.pi)
    # normals made from round angles give them back, so that an edge at such an angle lies on its own side
    round_polar, round_azimuth = (np.asarray(np.round(np.degrees(angle), 6), float) for angle in (polar, azimuth))
    return dict(zip(DIRECTION, (round_polar, round_azimuth % 360.0, polar, azimuth), strict=True))


@dataclass(frozen=True, kw_only=True)
class EmpiricalProbe(Probe):
    """The values of ``base`` plus empirical laws; ``inf`` (never triggers) stays ``inf``."""

    base: Probe
    laws: tuple[EmpiricalTable, ...]

    def pretravel_um(self, approach: ArrayLike) -> Array:
        return self._add_laws("pretravel_um", self.base.pretravel_um(approach), approach)

    def trigger_force_N(self, approach: ArrayLike) -> Array:
        return self._add_laws("trigger_force_N", self.base.trigger_force_N(approach), approach)

    def deflection_um(self, approach: ArrayLike) -> Array:
        return self._add_laws("deflection_um", self.base.deflection_um(approach), approach)

    def _add_laws(self, quantity: Quantity, values: Array, approach: ArrayLike) -> Array:
        normal = self.normals(approach)
        return values + sum((law.at(normal) for law in self.laws if law.quantity == quantity), np.zeros(values.shape))


def add_laws(probe: Probe, laws: list[EmpiricalTable]) -> Probe:
    """The probe itself where there are no laws."""
    if not laws:
        return probe
    return EmpiricalProbe(
        tip_radius_mm=probe.tip_radius_mm,
        name=probe.name,
        frame=probe.frame,
        stylus_length_mm=probe.stylus_length_mm,
        base=probe,
        laws=tuple(laws),
    )

"""Units of an axis: positions and deviations as the user has them, and the base units that they are computed in.

Positions are computed in mm or deg, deviations in um or arcsec; what is told is told in the user's units.
"""

from __future__ import annotations

from dataclasses import dataclass

from stepgauge.errors import InputError, naming
from stepgauge.files.units import ANGLE_DEG, LENGTH_MM

BASE = {"linear": (1.0, 1e3), "rotary": (1.0, 3600.0)}
"""Base position (mm or deg) in itself and in base deviations (um or arcsec)."""
_GOES_WITH = """nm:nm um:um mm:um cm:um m:mm inch:uin thou:uin uin:uin deg:arcsec arcmin:arcsec arcsec:arcsec
    rad:urad mrad:urad urad:urad gon:mgon mgon:mgon"""
_CALLED = """millimetre:mm millimeter:mm µm:um μm:um micron:um mikrometer:um in:inch inches:inch zoll:inch ":inch
    µin:uin microinch:uin mil:thou °:deg degree:deg degrees:deg ″:arcsec '':arcsec µrad:urad"""
_FINER, _SAME = (dict(pair.split(":") for pair in pairs.split()) for pairs in (_GOES_WITH, _CALLED))
"""Unit in which deviations are told, by the unit of positions; plain names of units by their other names."""
NAMES = tuple(_FINER)
"""Units that an axis may have."""


@dataclass(frozen=True)
class AxisUnits:
    """``position`` and ``deviation``: names of the units in which an axis is told."""

    position: str
    deviation: str

    @classmethod
    def of(cls, position: str, deviation: str | None = None) -> AxisUnits:
        """Units by any of their names; deviations by default in the unit that goes with the positions."""
        place = plain_name(position)
        told = _FINER[place] if deviation is None else plain_name(deviation)
        if (told in ANGLE_DEG) != (place in ANGLE_DEG):
            raise InputError(
                naming("deviation_unit"), "not a unit of this axis", found=told, expected=f"as {_FINER[place]}"
            )
        return cls(place, told)

    @property
    def axis(self) -> str:
        """``linear`` or ``rotary``."""
        return "rotary" if self.position in ANGLE_DEG else "linear"

    @property
    def base_position(self) -> float:
        """One unit of position, in mm or deg."""
        return base_of(self.position)

    @property
    def base_deviation(self) -> float:
        """One unit of deviation, in um or arcsec."""
        return base_of(self.deviation) * BASE[self.axis][1]

    @property
    def deviations_per_position(self) -> float:
        """One unit of position in units of deviation."""
        return self.base_position / base_of(self.deviation)


def plain_name(unit: str) -> str:
    """The name of a unit by which columns are called; :class:`InputError` for what is no unit of a position."""
    key = unit.strip().casefold().replace("\u03bc", "u")
    name = _SAME.get(key, key)
    if name not in _FINER:
        raise InputError("unit", "not a unit of length or angle", found=repr(unit), expected=", ".join(NAMES))
    return name


def base_of(unit: str) -> float:
    """One of a unit in mm or deg."""
    return LENGTH_MM[unit] if unit in LENGTH_MM else ANGLE_DEG[unit]

"""Units of an axis: positions and deviations as the user has them, and the base units that they are computed in.

Positions are computed in mm or deg, deviations in um or arcsec; what is told is told in the user's units.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

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
_RELATIVE = {"m": "mm/km", "inch": "uin/inch", "thou": "uin/inch", "uin": "uin/inch"}
"""What a millionth is called beside a unit of position."""
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

    @cached_property
    def told(self) -> Mapping[str, str]:
        """The unit in which a number is told, by the unit of a linear axis that it is computed in."""
        dev, place = self.deviation, self.position
        turned = self.axis == "rotary"
        return {
            "um": dev,
            "mm": place,
            "s": "s",
            "ms": "ms",
            "h": "h",
            "Hz": "Hz",
            "um/(mm/s)": f"{dev}/({place}/s)",
            "um/(mm/s)^2": f"{dev}/({place}/s)^2",
            "mm/s": f"{place}/s",
            "um/h": f"{dev}/h",
            "um/K": f"{dev}/K",
            "um/m": f"{dev}/deg" if turned else _RELATIVE.get(place, "um/m"),
            "um/m^2": f"{dev}/deg^2" if turned else "um/m^2",
            "um/(m K)": f"{dev}/(deg K)" if turned else "um/(m K)",
        }

    def key(self, name: str) -> str:
        """A name that ends in a unit of a linear axis with that of this one: ``rate_um_per_h`` as ``rate_uin_per_h``.

        The end is the unit in words (:func:`unit_words`), which a name of a parameter has.
        """
        for unit in sorted(self.told, key=len, reverse=True):
            if f"_{name}".endswith(f"_{unit_words(unit)}"):
                return name.removesuffix(unit_words(unit)) + unit_words(self.told[unit])
        return name


def unit_words(unit: str) -> str:
    """A unit as names have it: ``um/(m K)`` is ``um_per_m_K``, ``um/(mm/s)^2`` is ``um_per_mm2_s2``."""
    top, _, below = unit.partition("/")
    power = below.partition(")^")[2]
    parts = [part + power for part in re.findall(r"[A-Za-z]+\d*", below.partition(")^")[0].replace("^", ""))]
    return f"{top}_per_{'_'.join(parts)}" if parts else top


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

"""The numbers of a diagnosis of an axis in the user's units.

The JSON of a diagnosis states units in its keys (``rms_before_um``) and beside its parameters. Both are converted
here, from what was computed (um and mm of a CMM, :class:`.residuals.Scaling`), into the user's units. Words are made
of these numbers afterwards.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stepgauge.axis.units import AxisUnits
from stepgauge.diagnosis.axis.residuals import Scaling
from stepgauge.files.notation import significant

_KEY = re.compile(r"^(.*_)?(um|mm|s)$")
_RELATIVE = {"m": "mm/km", "inch": "uin/inch", "thou": "uin/inch", "uin": "uin/inch"}
"""What a millionth is called beside a unit of position."""


@dataclass(frozen=True)
class UnitConversion:
    """From what was computed to the units of the user; ``scaling``: of the axis."""

    units: AxisUnits
    scaling: Scaling

    @cached_property
    def factors(self) -> dict[str, tuple[float, str]]:
        """Factor and unit by the unit of a parameter, of a deviation, a position, a time and what is made of them."""
        units, scaling = self.units, self.scaling
        um = 1.0 / scaling.deviation / units.base_deviation
        mm = 1.0 / scaling.position / units.base_position
        s = 1.0 / scaling.time
        dev, place = units.deviation, units.position
        found = {"um": (um, dev), "mm": (mm, place), "s": (s, "s"), "h": (s, "h"), "Hz": (1.0 / s, "Hz")}
        found |= {
            "um/(mm/s)": (um * s / mm, f"{dev}/({place}/s)"),
            "um/h": (um / s, f"{dev}/h"),
            "um/K": (um, f"{dev}/K"),
            "mm/s": (mm / s, f"{place}/s"),
        }
        found["ms"] = (scaling.position / scaling.deviation * s, "ms")
        found["um/(mm/s)^2"] = (um * (s / mm) ** 2, f"{dev}/({place}/s)^2")
        slope = scaling.position / scaling.deviation
        if units.axis == "rotary":
            per_deg = slope * 1e-3 / units.base_deviation
            found["ms"] = (slope * s * 1e3 / 3600.0, "ms")  # of um/(mm/s) arcsec/(deg/s)
            return found | {
                "um/m": (per_deg, f"{dev}/deg"),
                "um/(m K)": (per_deg, f"{dev}/(deg K)"),
                "um/m^2": (per_deg * scaling.position * 1e-3, f"{dev}/deg^2"),
            }
        relative = _RELATIVE.get(units.position, "um/m")
        found["um/(m K)"] = (slope, "um/(m K)")
        return found | {"um/m": (slope, relative), "um/m^2": (slope * scaling.position, "um/m^2")}

    def converted(self, value: Any, key: str = "") -> Any:
        """The same JSON in the user's units; keys that end in um or mm end in the user's units."""
        if isinstance(value, Mapping):
            if "value" in value:
                return self.parameter(value)
            return {self.name(name): self.converted(one, name) for name, one in value.items()}
        if isinstance(value, list | tuple):
            return [self.converted(one, key) for one in value]
        match = _KEY.match(key)
        return value * self.factors[match[2]][0] if match and isinstance(value, float) else value

    def parameter(self, stated: Mapping[str, Any]) -> dict[str, Any]:
        """A value with its uncertainty and unit."""
        factor, unit = self.factors.get(stated.get("unit", ""), (1.0, stated.get("unit")))
        scaled = {
            key: one * factor if key in ("value", "u") and isinstance(one, float) else one
            for key, one in stated.items()
        }
        return {**scaled, "unit": unit} if unit is not None else scaled

    def condition(self, formula: str) -> str:
        """The condition of a law, ``x_mm > 120``, in the user's units: ``position > 0.1 deg``."""
        if not formula:
            return ""
        name, sense, edge = formula.split()
        own = {"x_mm": ("position", "mm"), "time_s": ("time", "s")}.get(name)
        if own is None:
            return f"{name} {sense} {significant(float(edge), 4)}"
        covariate, (factor, told) = own[0], self.factors[own[1]]
        return f"{covariate} {sense} {significant(float(edge) * factor, 4)} {told}"

    def name(self, key: str) -> str:
        """A key with the user's unit at its end."""
        match = _KEY.match(key)
        return f"{match[1] or ''}{self.factors[match[2]][1]}" if match else key

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
        slope, turned = scaling.position / scaling.deviation, units.axis == "rotary"
        per_m = slope * 1e-3 / units.base_deviation if turned else slope
        factor = {"um": um, "mm": mm, "s": s, "h": s, "Hz": 1.0 / s, "mm/s": mm / s}
        factor |= {"um/(mm/s)": um * s / mm, "um/(mm/s)^2": um * (s / mm) ** 2, "um/h": um / s, "um/K": um}
        factor |= {
            "ms": slope * s * (1e3 / 3600.0 if turned else 1.0),  # of um/(mm/s), of a turn of arcsec/(deg/s)
            "um/m": per_m,
            "um/(m K)": per_m,
            "um/m^2": per_m * scaling.position * (1e-3 if turned else 1.0),
        }
        return {unit: (value, units.told[unit]) for unit, value in factor.items()}

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
        return self.units.key(key)

"""A diagnosis of an axis in the user's units and in words that fit a sensor and its targets.

The JSON of a diagnosis states units in its keys (``rms_before_um``) and beside its parameters. Both are turned here, in
one place, from what was computed (um and mm of a CMM, :class:`.residuals.Scaling`) into the user's units.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stepgauge.axis.units import AxisUnits
from stepgauge.diagnosis.axis.residuals import Scaling
from stepgauge.diagnosis.wording.axis import kind_name
from stepgauge.files.notation import rounded

_NUMBER = r"(?<![\w.])([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?) "
_KEY = re.compile(r"^(.*_)?(um|mm|s)$")
PLAIN = ("in_practice", "command", "commands", "path", "sha256", "label", "separate_by", "kind")
"""Keys whose texts stay as they are."""
_RELATIVE = {"m": "mm/km", "inch": "uin/inch", "thou": "uin/inch", "uin": "uin/inch"}
"""What a millionth is called beside a unit of position."""
_LABEL = re.compile(r"\b([a-z]+(?:_[a-z]+)+)_x\b")
OPPOSITE = "with opposite sign in the two directions of travel"
_WORDS = (
    (", with the same sign on front and back faces (along the gauge)", ", the same in both directions of travel"),
    (", along the approach", f", {OPPOSITE}"),
    ("along the gauge", "along the axis"),
    ("touches since a pause", "readings since a pause"),
    ("rest before the touch", "time since the reading before"),
    ("from the first touch", "from the first reading"),
    ("faces deviate from the certificate by", "targets deviate from their positions by"),
    ("probings", "readings"),
    ("probing", "reading"),
    ("machine x", "position"),
    ("face", "target"),
)


@dataclass(frozen=True)
class AxisWording:
    """From what was computed to what is told; ``scaling``: of the axis; ``both_ways``: of its travel; ``form``."""

    units: AxisUnits
    scaling: Scaling
    both_ways: bool
    form: str

    @cached_property
    def factors(self) -> dict[str, tuple[float, str]]:
        """Factor and unit by the unit of a parameter, of a deviation, a position, a time and what is made of them."""
        units, scaling = self.units, self.scaling
        um = 1.0 / scaling.deviation / units.base_deviation
        mm = 1.0 / scaling.position / units.base_position
        s = 1.0 / scaling.time
        dev, place = units.deviation, units.position
        found = {"um": (um, dev), "mm": (mm, place), "s": (s, "s"), "h": (s, "h"), "Hz": (1.0 / s, "Hz")}
        found |= {"um/h": (um / s, f"{dev}/h"), "um/K": (um, f"{dev}/K"), "mm/s": (mm / s, f"{place}/s")}
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

    def told(self, value: Any, key: str = "") -> Any:
        """The same JSON in the user's units and words; keys that end in um or mm end in the user's units."""
        if isinstance(value, Mapping):
            if "value" in value:
                return self.parameter(value)
            value = _of_joint(value) if "order" in value and "size" in value else value
            return {self.name(name): self.told(one, name) for name, one in value.items()}
        if isinstance(value, list):
            return [self.told(one, key) for one in value]
        if isinstance(value, str):
            return value if key in PLAIN else self.text(value)
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

    def name(self, key: str) -> str:
        """A key with the user's unit at its end."""
        match = _KEY.match(key)
        return f"{match[1] or ''}{self.factors[match[2]][1]}" if match else key

    def text(self, words: str) -> str:
        """A sentence of a form, in the user's units and in the words of an axis."""
        for old, new in _WORDS:
            if old.startswith(",") and (not self.both_ways or self.form != "axis"):
                new = ""
            words = words.replace(old, new)
        if self.form == "distances":
            words = words.replace("target", "pair").replace("position", "distance")
        words = _LABEL.sub(lambda match: kind_name(match[1], self.form), words)
        return re.sub(rf"{_NUMBER}(um|mm|s|Hz)\b(?!/)", self._scaled, words)

    def _scaled(self, match: re.Match[str]) -> str:
        factor, unit = self.factors[match[2]]
        digits = max(4, len(re.sub(r"e.*|\D", "", match[1]).strip("0")))
        return f"{rounded(float(match[1]) * factor, digits) if factor != 1.0 else match[1]} {unit}"


def _of_joint(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The size of a joint in its own unit: a gap (order 0) in um, another slope (order 1) in um/m."""
    unit = "um/m" if parameters["order"]["value"] else "um"
    return {**parameters, "size": {**parameters["size"], "unit": unit}}

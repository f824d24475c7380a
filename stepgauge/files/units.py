"""Units stated in files, and units inferred from numbers."""

from __future__ import annotations

import keyword
import math
import re
import unicodedata
from dataclasses import dataclass

from stepgauge.files.notation import rounded

LENGTH_MM = {
    "mm": 1.0,
    "millimetre": 1.0,
    "millimeter": 1.0,
    "um": 1e-3,
    "µm": 1e-3,
    "μm": 1e-3,
    "micron": 1e-3,
    "mikrometer": 1e-3,
    "nm": 1e-6,
    "cm": 10.0,
    "m": 1000.0,
    "in": 25.4,
    "inch": 25.4,
    "inches": 25.4,
    "zoll": 25.4,
    '"': 25.4,
    "uin": 25.4e-6,
    "µin": 25.4e-6,
    "microinch": 25.4e-6,
    "thou": 25.4e-3,
    "mil": 25.4e-3,
}
ANGLE_DEG = {
    "deg": 1.0,
    "°": 1.0,
    "degree": 1.0,
    "degrees": 1.0,
    "arcmin": 1.0 / 60.0,
    "arcsec": 1.0 / 3600.0,
    "″": 1.0 / 3600.0,
    "''": 1.0 / 3600.0,
    "rad": math.degrees(1.0),
    "mrad": math.degrees(1e-3),
    "urad": math.degrees(1e-6),
    "µrad": math.degrees(1e-6),
    "gon": 0.9,
    "mgon": 0.9e-3,
}
SPEED_MM_S = {
    "mm/s": 1.0,
    "mmps": 1.0,
    "mm/sec": 1.0,
    "mm/min": 1.0 / 60.0,
    "m/min": 1000.0 / 60.0,
    "m/s": 1000.0,
    "in/min": 25.4 / 60.0,
    "in/s": 25.4,
}
TIME_S = {"s": 1.0, "sec": 1.0, "sek": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
_CELSIUS, _KELVIN, _FAHRENHEIT = (1.0, 0.0), (1.0, -273.15), (5.0 / 9.0, -160.0 / 9.0)
TEMPERATURE_C = {
    "c": _CELSIUS,
    "°c": _CELSIUS,
    "degc": _CELSIUS,
    "deg c": _CELSIUS,
    "grad c": _CELSIUS,
    "celsius": _CELSIUS,
    "k": _KELVIN,
    "kelvin": _KELVIN,
    "f": _FAHRENHEIT,
    "°f": _FAHRENHEIT,
    "degf": _FAHRENHEIT,
    "deg f": _FAHRENHEIT,
    "fahrenheit": _FAHRENHEIT,
}
_LOOKS = ((1.0 / 25.4, "inches"), (25.4, "mm read as inches"), (1e-3, "m"), (1e3, "um"), (0.1, "cm"))


@dataclass(frozen=True)
class Unit:
    """``value * factor + offset`` is in the recording's unit; ``name`` as it stands in the file."""

    name: str
    quantity: str
    factor: float
    offset: float = 0.0


def find_unit(text: str) -> Unit | None:
    """A unit by its name, upper or lower case; None for what is none."""
    name = text.strip()
    key = name.casefold().replace("\u03bc", "u")  # casefold makes one of both letters for micro
    known = (("length", LENGTH_MM), ("angle", ANGLE_DEG), ("speed", SPEED_MM_S), ("time", TIME_S))
    for quantity, factors in known:
        if key in factors:
            return Unit(name, quantity, factors[key])
    if key in TEMPERATURE_C:
        return Unit(name, "temperature", *TEMPERATURE_C[key])
    return Unit(name, "none", 1.0) if key in ("", "-", "1") else None


def column_name(header: str) -> str:
    """The name of a column as laws and formulas take it: letters, digits and underscores, the unit at the end.

    ``Air humidity [%]`` is ``Air_humidity_percent``; what begins with a digit, or is a word of formulas, is set behind
    an underscore.
    """
    name = re.sub(r"\W+", "_", header.replace("%", " percent ").replace("°", " deg ").strip()).strip("_")
    name = unicodedata.normalize("NFKC", name)
    return name if name.isidentifier() and not keyword.iskeyword(name) else f"_{name}"


def unit_hint(found_mm: float, expected_mm: float, tolerance: float = 0.05) -> str:
    """Words for lengths that are the expected ones in another unit; empty where they are not."""
    unit = likely_unit(found_mm, expected_mm, tolerance)
    found, expected = rounded(found_mm, 4), rounded(expected_mm, 4)
    return "" if unit is None else f" (looks like {unit}: a span of {found} where {expected} mm is expected)"


def likely_unit(found_mm: float, expected_mm: float, tolerance: float = 0.05) -> str | None:
    """The other unit that a length seems to be stated in; None where there is none."""
    if found_mm <= 0.0 or expected_mm <= 0.0:
        return None
    ratio = found_mm / expected_mm
    return next((unit for factor, unit in _LOOKS if abs(ratio / factor - 1.0) < tolerance), None)


def temperature_hint(value: float) -> str:
    """Words for a temperature that is sensible in K or F but not in deg C."""
    for unit, name in ((_KELVIN, "K"), (_FAHRENHEIT, "F")):
        celsius = value * unit[0] + unit[1]
        if 0.0 <= celsius <= 50.0:
            return f"looks like {name}: {value:g} {name} is {celsius:.2f} deg C"
    return "K or F?"

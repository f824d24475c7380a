r"""Units of D-SI, the SI in the notation ``\micro\metre`` (PTB's Digital System of Units, after the LaTeX siunitx).

A unit is a row of ``\prefix\unit\tothe{n}``, each after an optional ``\per``. Only units that a certificate of lengths
may need are known; another one is an error, never a guess.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

MICROMETRE, MILLIMETRE, CELSIUS, ONE = r"\micro\metre", r"\milli\metre", r"\degreecelsius", r"\one"
PER_KELVIN, MICROMETRE_PER_METRE = r"\kelvin\tothe{-1}", r"\micro\metre\metre\tothe{-1}"

PREFIX = {
    "tera": 1e12,
    "giga": 1e9,
    "mega": 1e6,
    "kilo": 1e3,
    "hecto": 1e2,
    "deca": 1e1,
    "deci": 1e-1,
    "centi": 1e-2,
    "milli": 1e-3,
    "micro": 1e-6,
    "nano": 1e-9,
    "pico": 1e-12,
}
LENGTH, TEMPERATURE, NUMBER = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 0)
Dimension = tuple[int, int, int, int]
"""Powers of length, temperature, time and mass."""
UNIT: dict[str, tuple[float, Dimension]] = {
    "metre": (1.0, LENGTH),
    "kelvin": (1.0, TEMPERATURE),
    "degreecelsius": (1.0, TEMPERATURE),
    "second": (1.0, (0, 0, 1, 0)),
    "minute": (60.0, (0, 0, 1, 0)),
    "hour": (3600.0, (0, 0, 1, 0)),
    "kilogram": (1.0, (0, 0, 0, 1)),
    "gram": (1e-3, (0, 0, 0, 1)),
    "newton": (1.0, (1, 0, -2, 1)),
    "pascal": (1.0, (-1, 0, -2, 1)),
    "radian": (1.0, NUMBER),
    "one": (1.0, NUMBER),
    "percent": (1e-2, NUMBER),
    "ppm": (1e-6, NUMBER),
}
NAMES: dict[Dimension, str] = {LENGTH: "a length", TEMPERATURE: "a temperature", NUMBER: "a number"}
_HEAD = re.compile(r"(\\per)?\\([a-z]+)(?:\\([a-z]+))?")
_POWER = re.compile(r"\\tothe\{(-?\d+)\}")
CELSIUS_ZERO_K = 273.15


@dataclass(frozen=True)
class SiUnit:
    """``value * factor`` is the value in SI base units; ``celsius`` where the scale begins at 273.15 K."""

    factor: float
    dimension: Dimension
    celsius: bool = False


def parse_unit(text: str) -> SiUnit:
    r"""The unit that a D-SI text names; ``ValueError`` says what is wrong with it.

    >>> parse_unit(r"\micro\metre\per\metre\per\kelvin").dimension
    (0, -1, 0, 0)
    """
    stripped = text.strip()
    factor, dimension, place = 1.0, [0, 0, 0, 0], 0
    if not stripped:
        raise ValueError("the unit is empty")
    while place < len(stripped):
        end, one, power = _one_factor(stripped, place)
        factor *= one.factor**power
        dimension = [d + power * p for d, p in zip(dimension, one.dimension, strict=True)]
        place = end
    return SiUnit(factor, (dimension[0], dimension[1], dimension[2], dimension[3]), stripped == CELSIUS)


def _one_factor(text: str, place: int) -> tuple[int, SiUnit, int]:
    r"""``\per\prefix\unit\tothe{n}`` at a place: where it ends, the unit and its power."""
    found = _HEAD.match(text, place)
    if found is None:
        raise ValueError(f"{text!r} is not written as D-SI, e.g. {MICROMETRE}")
    per, first, second = found[1], found[2], found[3]
    if first in PREFIX:
        if second not in UNIT:
            raise ValueError(f"{text!r}: prefix \\{first} without a known unit")
        name, scale, end = second, PREFIX[first], found.end(3)
    else:
        name, scale, end = first, 1.0, found.end(2)
    if name not in UNIT:
        raise ValueError(f"{text!r}: unit \\{name} is not known")
    power = _POWER.match(text, end)
    exponent = int(power[1]) if power else 1
    value, dimension = UNIT[name]
    return power.end() if power else end, SiUnit(value * scale, dimension), -exponent if per else exponent


def describe(dimension: Dimension) -> str:
    """``a length``; powers of the base units for what has no name."""
    if dimension in NAMES:
        return NAMES[dimension]
    powers = zip(("m", "K", "s", "kg"), dimension, strict=True)
    return " ".join(f"{unit}^{power}" for unit, power in powers if power)

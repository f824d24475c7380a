"""What an effect is called, what it means, what to check and what to repair: templates, and how they are filled.

A template names parameters in braces: ``{ppm}`` is the magnitude with its unit, ``{period_mm:5}`` the same in five
significant digits, ``{at_mm:=4}`` with its sign, ``{um:±}`` with its expanded uncertainty, ``{um:=±mm}`` with
its sign and in a unit of the controller, ``{ppm:factor}`` the factor from true to indicated lengths with its own,
``{um:later|earlier}`` one of two, the first for a positive value or a text, ``{axis:$100|$101|$102}`` what belongs to
an axis, ``{plane:second}`` the second axis of a plane. They may hold names again:
``{lag_s:, {lag_s:3} late|}``; ``{at_mm:? at {at_mm:=5}|}`` is told where the value is known, whatever its sign.
``{largest}`` is the largest displacement, ``{steps:of steppers|of others}`` what is told of machines that are set by
their steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stepgauge.files.notation import rounded, uncertain

DIGITS = 2
"""Significant digits of a value in a sentence."""
FACTOR, UNCERTAIN = "factor", "±"
"""What says a relative value as the factor from true to indicated lengths, and any value with its uncertainty."""
PLACES = ("first", "second")
KNOWN = "?"
"""Before two texts, of which the first is told of a value that is known."""
RELATIVE = {"um/m": 1e-6, "mm/m": 1e-3, "1e-6": 1e-6}
SET_IN = {"": 1.0, "mm": 1e-3, "mm per 100 mm": 1e-4, "mm auf 100 mm": 1e-4}
"""What a value in um or urad is multiplied by in the unit in which a controller or a frame is set."""
COVERAGE = 2.0
"""Coverage factor of the uncertainty behind a plus-minus sign, which says so: (k = 2)."""


@dataclass(frozen=True)
class Wording:
    """Name, meaning, check and repair of a finding in English, and the same in ``german``."""

    name: str = ""
    means: str = ""
    check: str = ""
    repair: str = ""
    german: Wording | None = None

    def said_in(self, language: str) -> Wording:
        """The words in a language, ``en`` or ``de``; in English where they are not told in it."""
        return self.german if language == "de" and self.german is not None else self


class _Value:
    """A value in a template, with its unit and the decimal mark of the language; None is said as its name."""

    def __init__(
        self, name: str, value: Any = None, unit: str = "", german: bool = False, u: float | None = None
    ) -> None:
        self.name, self.value, self.unit, self.german, self.u = name, value, unit, german, u

    def __format__(self, spec: str) -> str:
        if "|" in spec:
            first, second, *third = spec.removeprefix(KNOWN).split("|")
            if spec.startswith(KNOWN):
                return second if self.value is None else first
            if third:
                return (first, second, *third)["xyz".index(self.value)] if self.value in ("x", "y", "z") else first
            positive = self.value > 0 if isinstance(self.value, float | int) else bool(self.value)
            return first if positive else second
        if isinstance(self.value, float | int) and not isinstance(self.value, bool):
            text = (
                self._uncertain(spec)
                if spec == FACTOR or UNCERTAIN in spec
                else f"{self._number(spec)} {self.unit}".strip()
            )
            return text.replace(".", ",") if self.german else text
        if isinstance(self.value, list | tuple):
            return direction_words(self.value)
        if spec in PLACES and isinstance(self.value, str):
            return self.value[PLACES.index(spec)]
        every = "alle Achsen" if self.german else "all axes"
        return self.name.split("_")[0] if self.value is None else every if self.value == "all" else str(self.value)

    def _number(self, spec: str) -> str:
        assert self.value is not None
        signed = spec.startswith("=")
        return rounded(self.value if signed else abs(self.value), int(spec.lstrip("=") or DIGITS))

    def _uncertain(self, spec: str) -> str:
        """The magnitude, or the factor, with its expanded uncertainty and unit; with its sign if that is wanted."""
        assert self.value is not None
        sign, _, unit = spec.partition(UNCERTAIN)
        scale, unit = (SET_IN[unit], unit or self.unit) if spec != FACTOR else (RELATIVE.get(self.unit, 1e-6), "")
        value = 1.0 + self.value * scale if spec == FACTOR else abs(self.value) * scale
        signed = ("- " if self.value < 0.0 else "+ ") if sign == "=" else ""
        if not self.u:
            return f"{signed}{rounded(value, 8 if spec == FACTOR else 4)} {unit}".strip()
        text, expanded = uncertain(value, COVERAGE * self.u * scale, most=9)
        return f"{signed}{text} ± {expanded} {unit}".strip() + f" (k = {COVERAGE:g})"


class _Values(dict[str, _Value]):
    def __missing__(self, name: str) -> _Value:
        return _Value(name)


def filled(text: str, values: Mapping[str, Mapping[str, Any]], language: str = "en") -> str:
    """A template with values in the places of their names; a name without a value is said as itself.

    ``values``: each with its ``value`` and, if it is a number, its ``unit``, as a ``diagnosis.json`` has them.
    """
    known = _Values()
    for name, one in values.items():
        unit = str(one.get("unit") or "")
        unit = "" if unit in ("1", "count") else unit
        known[name] = _Value(name, one.get("value"), unit, language == "de", one.get("u"))
    return text.format_map(known)


def direction_words(direction: Any) -> str:
    """A machine axis by name, also where the components are those of one, or a direction by its components."""
    if isinstance(direction, str):
        return direction
    if not all(isinstance(one, int | float) for one in direction):
        return ", ".join(map(str, direction))
    shares = [round(float(one), 3) + 0.0 for one in direction]
    along = [name for name, one in zip("xyz", shares, strict=False) if abs(one) == 1.0]
    if along:
        return f"{'-' if min(shares) < 0.0 else ''}{along[0]}"
    return f"({', '.join(f'{one:.3f}' for one in shares)})"

"""Tolerances of the parameters of ISO 230-2, and the decision on an axis by the rule of ISO 14253-1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from stepgauge.conditions import NOTHING, Conditions, gate
from stepgauge.conditions.decision import (
    DECISION_SOURCE,
    NO_LIMIT,
    ConformityDecision,
    Outcome,
    decide,
    decision_of,
    prevented,
)
from stepgauge.errors import InputError, naming
from stepgauge.standards.iso230 import OneWay, Parameters

PARAMETERS = ("A", "A_up", "A_down", "E", "E_up", "E_down", "M", "R", "R_up", "R_down", "B", "mean_B")
"""In the order in which the standard's report has them."""
WORDS: Mapping[Outcome, str] = {
    "conforms": "The parameters conform.",
    "does not conform": "The parameters do not conform.",
    "not decidable": "Neither conformity nor nonconformity is proven.",
}


def parameters_um(found: Parameters) -> dict[str, float]:
    """The parameters of an axis by name, um; of one direction those of it alone."""
    if isinstance(found, OneWay):
        one = found.direction
        return {f"{name}_{found.way}": value for name, value in (("A", one.A_um), ("E", one.E_um), ("R", one.R_um))}
    up, down = found.up, found.down
    values = [found.A_um, up.A_um, down.A_um, found.E_um, up.E_um, down.E_um, found.M_um]
    values += [found.R_um, up.R_um, down.R_um, found.B_um, found.mean_B_um]
    return dict(zip(PARAMETERS, values, strict=True))


@dataclass(frozen=True)
class Requirement:
    """Tolerances by parameter, um; ``expanded_um`` of the parameters (ISO/TR 230-9), None if not stated.

    ``unit``: how um is told; of a rotary axis the numbers are in arcsec. ``conditions``: of the readings that it is put
    to; what prevents a statement prevents every outcome.
    """

    tolerance_um: Mapping[str, float] = field(default_factory=dict)
    expanded_um: float | None = None
    unit: str = "µm"
    decimals: int = 2
    conditions: Conditions = NOTHING

    @classmethod
    def parse(
        cls, texts: Sequence[str], expanded_um: float | None = None, names: Sequence[str] = PARAMETERS
    ) -> Requirement:
        """``A=10``, ``R_up=4``: :class:`InputError` for another form or name, no limit above zero, or two of them."""
        limits: dict[str, float] = {}
        for text in texts:
            name, _, value = text.partition("=")
            try:
                limit = float(value)
            except ValueError:
                limit = float("nan")
            if name not in names or not 0.0 < limit < float("inf"):
                expected = f"NAME=UM with NAME one of {', '.join(names)}, e.g. {names[0]}=10"
                raise InputError(naming("tolerances"), "this is no tolerance", found=repr(text), expected=expected)
            if name in limits:
                found = f"{name}={limits[name]:g} and {text}"
                raise InputError(naming("tolerances"), "a parameter has two tolerances", found=found, expected="one")
            limits[name] = limit
        return cls(limits, expanded_um)

    def outcomes(self, values_um: Mapping[str, float]) -> dict[str, Outcome]:
        """The decision on each parameter that has a tolerance; empty without a stated uncertainty."""
        u = self.expanded_um
        if u is None:
            return {}
        limits = self.tolerance_um.items()
        return {name: gate(self.conditions, decide(values_um[name], limit, u)) for name, limit in limits}

    def decision(self, axes: Sequence[tuple[str, Mapping[str, float]]]) -> ConformityDecision:
        """The decision with its sentence of page 1; ``axes``: their names (or none) and parameters in um."""
        parts = [
            (f"{axis} {name}".strip(), one) for axis, values in axes for name, one in self.outcomes(values).items()
        ]
        if self.conditions.preventing:
            return prevented(self.conditions.no_statement, parts)
        if not self.tolerance_um:
            return NO_LIMIT
        if self.expanded_um is None:
            why = "the uncertainty of the parameters was not stated"
            rule = f"Decision rule: {DECISION_SOURCE}; it needs that uncertainty."
            text = f"{self._compared(axes)} Conformity is not proven: {why}. {rule}"
            return ConformityDecision("not decidable", text, why)
        return decision_of(parts, WORDS, f"{self._compared(axes)} U = {self.expanded_um:g} {self.unit}.")

    def _compared(self, parts: Sequence[tuple[str, Mapping[str, float]]]) -> str:
        said = []
        for part, values in parts:
            decided, head = self.outcomes(values), f"{part}: " if part else ""
            for name, limit in self.tolerance_um.items():
                told = f": {decided[name]}" if name in decided else ""
                value = f"{values[name]:.{self.decimals}f} {self.unit}"
                said.append(f"{head}{name} = {value}, tolerance {limit:g} {self.unit}{told}")
        return "; ".join(said) + "."


NO_REQUIREMENT = Requirement()

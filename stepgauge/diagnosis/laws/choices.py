"""What a recording leaves to choose of a law: axis, face, column, ..

A choice that a recording hardly tells is not left out: how rare it is, is a prior (:meth:`.Effect.rarity`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, Parameter
from stepgauge.effects.grids import temperatures as recorded_temperatures

ALL = "all"
"""The choice of an axis that means all of them."""
NEEDS_TIME = {"time", "order"}
FEWEST_BACK = 0.2
"""Share of the touches each way from which a difference between the ways can be told from single touches."""


def choices_of(law: type[Effect], data: Residuals) -> Iterator[dict[str, Any]]:
    """All choices of a law in this recording; what is None is unset."""
    if NEEDS_TIME & set(law.covariates) and not data.has_time:
        return
    chosen = [p for p in law.parameters() if p.role == "choice" or (p.role == "fixed" and p.grid is not None)]
    for choices in _choose(law, chosen, {}, data):
        if law.is_own(choices, data.probings):
            yield choices


def _choose(
    law: type[Effect], left: Sequence[Parameter], chosen: dict[str, Any], data: Residuals
) -> Iterator[dict[str, Any]]:
    """The choices that are made, with every combination of those that are left."""
    if not left:
        yield chosen
        return
    for value in _values(law, left[0], chosen, data):
        yield from _choose(law, left[1:], chosen if value is None else {**chosen, left[0].name: value}, data)


def _values(law: type[Effect], parameter: Parameter, chosen: Mapping[str, Any], data: Residuals) -> Sequence[Any]:
    if parameter.name == law.free_direction():
        return ["approach"]  # what it is along the approach is known by then; the direction takes a share of it
    if parameter.grid is not None:
        return list(parameter.grid(data.probings, chosen))
    return parameter.choices or (parameter.default,)


def is_common(kind: str, choices: Mapping[str, Any]) -> bool:
    """Whether a law is of all axes, or of all placements, at once."""
    return choices.get("axis") == ALL or (kind == "misalignment" and "placement" not in choices)


def temperatures(data: Residuals) -> list[str]:
    """Recorded temperatures that change, by the unit in their names."""
    return recorded_temperatures(data.probings, {})


def goes_both_ways(data: Residuals) -> bool:
    """Whether enough touches were made each way to tell the ways apart."""
    way = data.probings.way()
    return data.is_ordered and bool(min((way > 0).sum(), (way < 0).sum()) >= FEWEST_BACK * len(data))

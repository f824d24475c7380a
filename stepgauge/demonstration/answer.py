"""What was concealed beside what the diagnosis says, from its file alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.notation import probability

UNITS = {"um", "mm", "ppm", "s", "K", "deg"}


@dataclass(frozen=True)
class NamedCandidate:
    """One candidate of the answer: what it is called, its probability, and whether it is what was concealed."""

    label: str
    probability: float
    is_truth: bool
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class Compared:
    """A number: what was concealed, what was found, its standard uncertainty (NaN where none is stated)."""

    name: str
    unit: str
    truth: float
    found: float
    u: float

    @property
    def deviation(self) -> float:
        """Found minus concealed in standard uncertainties."""
        return (self.found - self.truth) / self.u if self.u > 0.0 else float("nan")

    @property
    def u_text(self) -> str:
        """Its standard uncertainty with two digits."""
        return f"{self.u:.2g}" if self.u > 0.0 else "not stated"


@dataclass(frozen=True)
class RevealedFault:
    """``members``: candidates by probability; ``numbers``: of the one that is true, if it is among them; ``others``:
    effects that the diagnosis states beside it, which nobody concealed."""

    members: tuple[NamedCandidate, ...]
    numbers: tuple[Compared, ...]
    others: tuple[str, ...]

    @property
    def place(self) -> int:
        """1 where the truth is the most probable, 2, 3, .. further down in the set, 0 where it is not in it."""
        return next((number for number, one in enumerate(self.members, 1) if one.is_truth), 0)

    def sentence(self) -> str:
        """Right, right as one of a set, or wrong; with its probability."""
        if not self.place:
            return "The diagnosis did not name it."
        odds = f"with probability {probability(self.members[self.place - 1].probability)}"
        if len(self.members) == 1:
            return f"The diagnosis named it, {odds}."
        rank = "first" if self.place == 1 else f"number {self.place}"
        return f"The diagnosis named it {rank}, {odds}, of {len(self.members)} that these recordings cannot tell apart."


def compare_answer(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> RevealedFault:
    """The concealed effect (a table of a machine file) against ``diagnosis.json``."""
    sets = [tuple(_members(one, truth)) for one in diagnosis["effects"]]
    right = next((one for one in sets if any(member.is_truth for member in one)), sets[0] if sets else ())
    found = next((member.parameters for member in right if member.is_truth), {})
    numbers = tuple(_numbers(truth, found))
    return RevealedFault(right, numbers, tuple(one[0].label for one in sets if one is not right))


def _members(finding: Mapping[str, Any], truth: Mapping[str, Any]) -> Iterator[NamedCandidate]:
    own = {
        "conditional_probability": finding["probability"],
        **{key: finding[key] for key in ("kind", "label", "parameters")},
    }
    for one in finding.get("set") or [own]:
        yield NamedCandidate(
            name_of(str(one["label"])), float(one["conditional_probability"]), _is_truth(one, truth), one["parameters"]
        )


def _is_truth(member: Mapping[str, Any], truth: Mapping[str, Any]) -> bool:
    """Whether kind and choices (axis, direction, ..) are those that were concealed."""
    choices = {key: value for key, value in truth.items() if key != "kind" and isinstance(value, str)}
    found = {key: member["parameters"].get(key, {}).get("value") for key in choices}
    return bool(member["kind"] == truth["kind"] and all(_same(found[key], choices[key]) for key in choices))


def _same(found: object, concealed: str) -> bool:
    """Directions may come back as vectors."""
    if isinstance(found, list | tuple) and concealed in "xyz":
        return bool(np.abs(np.asarray(found, float)["xyz".index(concealed)]) > np.cos(np.radians(10.0)))
    return found == concealed


def _numbers(truth: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[Compared]:
    for name, value in truth.items():
        if name in found and not isinstance(value, str):
            estimate = found[name]
            u, unit, number = float(estimate.get("u") or "nan"), str(estimate["unit"]), float(estimate["value"])
            turned = round((value - number) / 360.0) * 360.0 if unit == "deg" else 0.0
            yield Compared(_without_unit(name), unit, float(value), number + turned, u)


def _without_unit(name: str) -> str:
    """``period_mm``: period; a parameter that is called by its unit alone is the size."""
    return " ".join(part for part in name.split("_") if part not in UNITS) or "size"

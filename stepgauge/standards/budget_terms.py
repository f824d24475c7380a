"""A source of uncertainty, and what it adds to the mean reading of every face as GTC numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from stepgauge.files.arrays import Array


@dataclass(frozen=True)
class UncertaintySource:
    """A line of the list of sources: ``u`` in ``unit`` (two numbers where it varies by face), type A or B.

    ``name`` is its key, as in the Monte Carlo, ``label`` what a person calls it.
    """

    name: str
    label: str
    kind: Literal["A", "B"]
    u: tuple[float, float]
    unit: str
    dof: float
    stated_by: str


@dataclass(frozen=True)
class BudgetTerm:
    """A source as GTC numbers: ``um[i]`` is what it adds to the mean reading of face ``i`` of the section."""

    source: UncertaintySource
    um: list[Any]


def independent(u: Array, dof: float, name: str) -> list[Any]:
    """One number per face; one ensemble, so that a common count of degrees of freedom is not counted twice."""
    from GTC import multiple_ureal

    labels = [f"{name} {i}" for i in range(len(u))]
    return list(multiple_ureal([0.0] * len(u), [float(v) for v in u], dof, labels))

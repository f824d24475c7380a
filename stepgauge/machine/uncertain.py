"""Values with a standard uncertainty: ``ppm = { value = 2.5, u = 0.8, distribution = "normal" }``."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable, check_table

Distribution = Literal["normal", "uniform", "triangular", "arcsine", "student"]
REACH = {"normal": 5.0, "uniform": 3.0**0.5, "triangular": 6.0**0.5, "arcsine": 2.0**0.5, "student": 20.0}
"""Farthest draw from the value, in standard uncertainties; the unbounded distributions are cut there."""


class UncertainTable(TomlTable):
    """The keys of a value with uncertainty."""

    value: float = Field(description="best estimate")
    u: float = Field(ge=0, description="standard uncertainty, in the unit of the value")
    distribution: Distribution = Field("normal", description="normal, uniform, triangular, arcsine or student")
    dof: float | None = Field(None, ge=3, description="degrees of freedom, of distribution student only")

    @model_validator(mode="after")
    def _student_has_dof(self) -> UncertainTable:
        if (self.distribution == "student") != (self.dof is not None):
            raise ValueError('dof together with distribution = "student", and only there')
        return self


@dataclass(frozen=True)
class Uncertain:
    """An input quantity; ``key`` is its place in the machine file, e.g. ``effect[1].ppm``.

    ``u`` is the scale that the draws are made with (JCGM 101:2008, 6.4): the standard deviation, except for ``student``
    where it is the standard uncertainty of a certificate or a mean with ``dof`` degrees of freedom.
    """

    key: str
    value: float
    u: float
    distribution: Distribution = "normal"
    dof: float | None = None

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value that can be drawn."""
        reach = REACH[self.distribution] * self.u
        return self.value - reach, self.value + reach

    def draw(self, uniform: Array) -> Array:
        """Values from random numbers between 0 and 1 by the inverse distribution."""
        reach = REACH[self.distribution]
        return self.value + self.u * np.clip(_INVERSE[self.distribution](uniform, self.dof), -reach, reach)


def _normal(p: Array, dof: float | None) -> Array:
    from scipy.special import ndtri

    return ndtri(p)


def _student(p: Array, dof: float | None) -> Array:
    from scipy.special import stdtrit

    return stdtrit(dof, p)


def _uniform(p: Array, dof: float | None) -> Array:
    return (2.0 * p - 1.0) * REACH["uniform"]


def _triangular(p: Array, dof: float | None) -> Array:
    low = np.sqrt(2.0 * np.minimum(p, 1.0 - p)) - 1.0
    return np.where(p < 0.5, low, -low) * REACH["triangular"]


def _arcsine(p: Array, dof: float | None) -> Array:
    return -np.cos(np.pi * p) * REACH["arcsine"]


_INVERSE: dict[str, Callable[[Array, float | None], Array]] = {
    "normal": _normal,
    "uniform": _uniform,
    "triangular": _triangular,
    "arcsine": _arcsine,
    "student": _student,
}


def split_uncertain(data: Any, where: str | Path, key: str = "") -> tuple[Any, tuple[Uncertain, ...]]:
    """The content of a TOML file with plain values, and the values with an uncertainty by their keys."""
    if isinstance(data, dict) and "u" in data and data.keys() <= UncertainTable.model_fields.keys():
        table = check_table(UncertainTable, data, where, key)
        found = Uncertain(key, table.value, table.u, table.distribution, table.dof)
        return table.value, (found,) if table.u else ()
    if isinstance(data, dict):
        named = ((name, value, f"{key}.{name}".lstrip(".")) for name, value in data.items())
        return _split_many(named, where, dict)
    if isinstance(data, list):
        numbered = ((None, value, f"{key}[{number}]") for number, value in enumerate(data, 1))
        return _split_many(numbered, where, lambda pairs: [value for _, value in pairs])
    return data, ()


def put_uncertain(data: Any, one: Uncertain) -> None:
    """The opposite: a value of ``data`` gets its uncertainty back, at its key."""
    *way, last = (int(part) - 1 if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", one.key))
    for part in way:
        data = data[part]
    known = {name: getattr(one, name) for name in UncertainTable.model_fields}
    data[last] = {name: value for name, value in known.items() if value is not None}


def _split_many(
    entries: Iterable[tuple[str | None, Any, str]], where: str | Path, build: Callable[[list[tuple[Any, Any]]], Any]
) -> tuple[Any, tuple[Uncertain, ...]]:
    plain: list[tuple[Any, Any]] = []
    uncertain: list[Uncertain] = []
    for name, value, key in entries:
        without, found = split_uncertain(value, where, key)
        plain.append((name, without))
        uncertain.extend(found)
    return build(plain), tuple(uncertain)


def replaced(table: Mapping[str, Any], path: list[str], value: Any) -> dict[str, Any]:
    """A copy of nested tables with another value at a path of keys."""
    if len(path) == 1:
        return {**table, path[0]: value}
    return {**table, path[0]: replaced(table[path[0]], path[1:], value)}

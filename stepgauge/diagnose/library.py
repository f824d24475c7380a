"""Every named effect that a recording could show, as signatures along the approach."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.grids import parameter_grid
from stepgauge.diagnose.residuals import Residuals
from stepgauge.effects import Effect, Parameter, along_approach_um, effect_kinds
from stepgauge.errors import InputError

Array = NDArray[np.float64]
NOT_LAWS = {"axis_compensation", "empirical", "error_map", "outliers", "noise_growth"}
"""Kinds that are no law of the mean with parameters of their own: fitted elsewhere or not at all."""
NEEDS_TIME = {"time", "order"}


@dataclass(frozen=True)
class Family:
    """One law with its choices made (axis, face, ...) and its signatures.

    ``kind`` is the name in the vocabulary, or ``form:...`` for a form without a law. ``atoms``: the non-linear
    parameters of each signature; ``columns (atoms, d, n)``: displacement along the approach in um for a unit of each of
    the ``d`` linear parameters. ``law``: the effect class, None for a form.
    """

    kind: str
    label: str
    choices: dict[str, Any]
    atoms: Sequence[dict[str, Any]]
    columns: Array
    law: type[Effect] | None = None
    covariate: str = ""
    positive: bool = False
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def dimension(self) -> int:
        return int(self.columns.shape[1])


def parameter_count(family: Family) -> int:
    """Fitted parameters of a family: the linear ones, and those that its signatures were searched for."""
    searched = len(family.atoms[0]) if len(family.atoms) > 1 else 0
    return family.dimension + searched


def effect_families(data: Residuals) -> Iterator[Family]:
    """Families of all named effects whose signature can be computed from this recording and is not nothing."""
    for kind, law in sorted(effect_kinds().items()):
        if kind in NOT_LAWS or (kind == "lever_arm" and data.machine.probe.model == "constant"):
            continue
        if NEEDS_TIME & set(law.covariates) and not data.has_time:
            continue
        for choices in _choices(law, data):
            family = _family(law, choices, data)
            if family is not None:
                yield family


def _choices(law: type[Effect], data: Residuals) -> Iterator[dict[str, Any]]:
    names = [p for p in law.parameters() if p.role == "choice"]
    values = [_values_of(p, data) for p in names]
    for combination in product(*values):
        yield dict(zip((p.name for p in names), combination, strict=True))


def _values_of(parameter: Parameter, data: Residuals) -> Sequence[Any]:
    if parameter.name == "face":
        return [int(face) for face in np.unique(data.face)]
    return parameter.choices or (parameter.default,)


def _family(law: type[Effect], choices: dict[str, Any], data: Residuals) -> Family | None:
    nonlinear = [p for p in law.parameters() if p.role == "nonlinear" and p.name != "phase_deg"]
    grids = [parameter_grid(law, p, choices, data) for p in nonlinear]
    atoms = [dict(zip((p.name for p in nonlinear), values, strict=True)) for values in product(*grids)]
    try:
        columns = signatures(law, choices, atoms, data)
    except (InputError, ValueError):
        return None  # impossible choices (travel and direction the same), or a column this recording lacks
    size = np.sqrt((columns**2).mean(axis=2)).max(axis=1)
    seen = size > 1e-9 * max(float(size.max()), 1e-300)
    if not seen.any() or size.max() == 0.0:
        return None
    probe = law.model_construct(**(fixed_values(law) | choices | atoms[0]))
    positive = law.kind == "misalignment"
    kept = [atom for atom, keep in zip(atoms, seen, strict=True) if keep]
    return Family(law.kind, probe.label, choices, kept, columns[seen], law, law.covariates[0], positive)


def fixed_values(law: type[Effect]) -> dict[str, Any]:
    """Defaults of the fixed parameters; a length that only rescales is taken as a metre."""
    values: dict[str, Any] = {}
    for p in law.parameters():
        if p.role == "fixed":
            values[p.name] = 1000.0 if p.required else p.default
    return values


def signatures(law: type[Effect], choices: dict[str, Any], atoms: Sequence[dict[str, Any]], data: Residuals) -> Array:
    """Displacement along the approach for a unit of each linear parameter, um, shape ``(atoms, d, n)``."""
    if len(atoms) > 1 and all(isinstance(value, float | int) for atom in atoms for value in atom.values()):
        together = {name: np.array([float(atom[name]) for atom in atoms])[:, None] for name in atoms[0]}
        return np.stack(_columns(law, choices, together, data, len(atoms)), axis=1)
    return np.concatenate([np.stack(_columns(law, choices, atom, data, 1), axis=1) for atom in atoms])


def _columns(
    law: type[Effect], choices: dict[str, Any], atom: dict[str, Any], data: Residuals, count: int
) -> list[Array]:
    """One array ``(count, n)`` per linear parameter; a sine of any amplitude and phase is a sum of two."""
    linear = [p.name for p in law.parameters() if p.role == "linear"]
    values = fixed_values(law) | choices | atom | dict.fromkeys(linear, 1.0)
    if not any(p.name == "phase_deg" for p in law.parameters()):
        return [_column(law, values, data, count)]
    quarter = 90.0 if law.quadrature else 30.0  # of a period, or of a lobe
    return [_column(law, values | {"phase_deg": phase}, data, count) for phase in (0.0, quarter)]


def _column(law: type[Effect], values: dict[str, Any], data: Residuals, count: int) -> Array:
    validate = {name: value for name, value in values.items() if value is not None}
    effect = law.model_validate(validate) if _needs_check(law) else law.model_construct(**values)
    return np.broadcast_to(along_approach_um(effect, data.probings), (count, len(data))).astype(float)


def _needs_check(law: type[Effect]) -> bool:
    """Laws with a rule between their choices must be built with it."""
    return law.kind == "straightness"

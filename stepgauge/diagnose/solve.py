"""Parameters of the chosen effects with their uncertainties: generalised least squares over all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from stepgauge.diagnose.library import Family, fixed_values
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.whitening import Whitening
from stepgauge.effects import Effect, along_approach_um

Array = NDArray[np.float64]
STEP = 1e-4
"""Share of a parameter's scale by which it is moved to find the slope."""
FROZEN = {"time_s", "supports_mm"}
"""Parameters in which the displacement has no slope, or too little to be fitted further than the grid."""


@dataclass(frozen=True)
class Estimate:
    """A parameter: value, standard uncertainty (None where the data give none) and unit."""

    value: float
    u: float | None
    unit: str


@dataclass(frozen=True)
class Solved:
    """An effect with its fitted parameters."""

    family: Family
    effect: Effect
    parameters: dict[str, Estimate]


def solve(families: Sequence[Family], atoms: Sequence[int], data: Residuals, whitening: Whitening) -> list[Solved]:
    """Fit all parameters of the families together, starting from the signatures chosen."""
    laws = [_Law(family, atom) for family, atom in zip(families, atoms, strict=True)]
    if not laws:
        return []
    white = whitening(data.um)
    columns = np.concatenate([whitening(law.family.columns[atom]) for law, atom in zip(laws, atoms, strict=True)])
    coefficients = np.linalg.lstsq(columns.T, white, rcond=None)[0]
    start, place = [], 0
    for law in laws:
        start.append(law.start(coefficients[place : place + law.family.dimension]))
        place += law.family.dimension
    return _refine(laws, np.concatenate(start), data, whitening, white)


class _Law:
    """A family as a function of its fitted parameters."""

    def __init__(self, family: Family, atom: int) -> None:
        assert family.law is not None
        self.family, self.law, self.atom = family, family.law, dict(family.atoms[atom])
        known = {p.name: p for p in self.law.parameters()}
        linear = [name for name, p in known.items() if p.role == "linear"]
        moving = [name for name, value in self.atom.items() if value is not None and name not in FROZEN]
        phase = ["phase_deg"] if "phase_deg" in known else []
        self.names = [*linear, *moving, *phase]
        self.units = {name: known[name].unit for name in known}

    def start(self, coefficients: Array) -> Array:
        """Parameters that the signature's coefficients mean."""
        values = dict(self.atom)
        if "phase_deg" in self.names:
            lobes = 1.0 if self.law.quadrature else 3.0
            values["amplitude_um"] = float(np.hypot(*coefficients))
            values["phase_deg"] = float(np.degrees(np.arctan2(coefficients[1], coefficients[0])) / lobes)
        elif self.law.kind == "misalignment":
            values["mrad"] = float(np.sqrt(max(coefficients[0], 0.0)))
        else:
            linear = [p.name for p in self.law.parameters() if p.role == "linear"]
            values |= dict(zip(linear, map(float, coefficients), strict=True))
        self.atom |= {name: values[name] for name in self.atom}
        return np.array([values[name] for name in self.names], float)

    def values(self, parameters: Array) -> dict[str, Any]:
        return (
            fixed_values(self.law)
            | self.family.choices
            | self.atom
            | dict(zip(self.names, map(float, parameters), strict=True))
        )

    def displacement_um(self, parameters: Array, data: Residuals) -> Array:
        """Along the approach, shape ``(n,)``."""
        effect = self.law.model_construct(**self.values(parameters))
        return np.broadcast_to(along_approach_um(effect, data.probings), (len(data),)).astype(float)

    def scales(self, parameters: Array) -> Array:
        """How far a parameter is moved to see its effect."""
        return np.array(
            [
                max(abs(value), 1e-3) if name not in ("phase_deg", "at_mm") else 10.0
                for name, value in zip(self.names, parameters, strict=True)
            ]
        )


def _refine(laws: Sequence[_Law], start: Array, data: Residuals, whitening: Whitening, white: Array) -> list[Solved]:
    cuts = np.cumsum([len(law.names) for law in laws])[:-1]
    scale = np.concatenate([law.scales(part) for law, part in zip(laws, np.split(start, cuts), strict=True)])

    def left(moved: Array) -> Array:
        parts = np.split(start + moved * scale, cuts)
        shares = [law.displacement_um(part, data) for law, part in zip(laws, parts, strict=True)]
        return white - whitening(np.sum(shares, axis=0))

    found = least_squares(
        left, np.zeros(len(start)), method="lm" if len(white) > len(start) else "trf", max_nfev=60 * len(start)
    )
    moved = found.x if found.cost <= 0.5 * float((left(np.zeros(len(start))) ** 2).sum()) else np.zeros(len(start))
    values = start + moved * scale
    u = _uncertainties(found.jac, scale)
    solved = []
    for law, part, spread in zip(laws, np.split(values, cuts), np.split(u, cuts), strict=True):
        solved.append(_solved(law, part, spread))
    return solved


def _uncertainties(jacobian: Array, scale: Array) -> Array:
    """Standard uncertainties from the curvature of the sum of squares (variance one), NaN where there is none."""
    gram = jacobian.T @ jacobian
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    value, vector = np.linalg.eigh(gram / np.outer(size, size))
    good = value > 1e-10
    inverse = (vector[:, good] / value[good]) @ vector[:, good].T
    u = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / size * scale
    return np.where((vector[:, ~good] ** 2).sum(axis=1) > 1e-6, np.nan, u)


def _solved(law: _Law, parameters: Array, u: Array) -> Solved:
    values = law.values(parameters)
    if "amplitude_um" in values and values["amplitude_um"] < 0:
        values["amplitude_um"] *= -1.0
        values["phase_deg"] += 180.0 if law.law.quadrature else 60.0
    if "phase_deg" in values:
        turn = 360.0 if law.law.quadrature else 120.0
        values["phase_deg"] = (values["phase_deg"] + turn / 2.0) % turn - turn / 2.0
    if law.law.kind == "misalignment":
        values["mrad"] = abs(values["mrad"])
    estimates = {
        name: Estimate(float(values[name]), None if np.isnan(spread) else float(spread), law.units[name])
        for name, spread in zip(law.names, u, strict=True)
    }
    for name in FROZEN & set(law.atom):
        if isinstance(law.atom[name], float):
            estimates[name] = Estimate(float(law.atom[name]), None, law.units[name])
    return Solved(law.family, law.law.model_construct(**values), estimates)

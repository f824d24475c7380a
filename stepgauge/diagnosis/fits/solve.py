"""Parameters of the chosen effects with their uncertainties: generalised least squares over all of them together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy import special
from scipy.linalg import block_diag

from stepgauge.diagnosis.fits.law import FittedLaw
from stepgauge.diagnosis.laws.library import Family
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, along_approach_um
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.nonlinear import least_squares
from stepgauge.inference.problem import slices

SAME_COST = 1e-6
"""Least relative decrease of the sum of squares by a step: with a thousand rows a thousandth in chi-square."""
SAME_SHAPE = 1e-5
"""The same for a shape that a search rates: a hundredth of a nat."""
UNTOLD = 1e-10
"""Share of the largest curvatures below which a combination of parameters is not determined."""
IMPOSSIBLE = 1e6
"""Residual of every row in standard deviations where a law cannot be."""


@dataclass(frozen=True)
class Estimate:
    """A parameter: value, standard uncertainty (None if the data give none) and unit."""

    value: float
    u: float | None
    unit: str


def widened(parameters: Mapping[str, Estimate], factor: float) -> dict[str, Estimate]:
    """Parameters with their standard uncertainties times a factor."""
    return {name: one if one.u is None else replace(one, u=one.u * factor) for name, one in parameters.items()}


@dataclass(frozen=True)
class Solved:
    """An effect with its fitted parameters."""

    family: Family
    effect: Effect
    parameters: dict[str, Estimate]

    @property
    def is_possible(self) -> bool:
        """Whether all numbers are such as the effect may have."""
        known = {p.name: p for p in type(self.effect).parameters()}
        values = ((known[name], one.value) for name, one in self.parameters.items() if name in known)
        return all(p.low <= value <= p.high for p, value in values)

    @property
    def sizes(self) -> list[Estimate]:
        """Its linear parameters."""
        linear = {p.name for p in type(self.effect).parameters() if p.role == "linear"}
        return [one for name, one in self.parameters.items() if name in linear]

    def displacement_um(self, data: Residuals) -> Array:
        """Displacement along the approach, shape ``(n,)``."""
        return np.broadcast_to(along_approach_um(self.effect, data.probings), (len(data),)).astype(float)


@dataclass(frozen=True)
class Fitted:
    """Laws fitted together.

    ``left (n,)``: whitened residuals; ``basis (n, k)``: orthonormal columns of all that the fit can change to first
    order, with the tangents of the non-linear parameters; ``tangents``: these columns for each law, ``(n, p)`` each;
    ``u_um (n,)``: standard uncertainty of what all laws move together beside the origins.
    """

    solved: tuple[Solved, ...]
    left: Array
    basis: Array
    tangents: tuple[Array, ...] = ()
    u_um: Array = field(default_factory=lambda: np.zeros(0))


def solve(families: Sequence[Family], atoms: Sequence[int], data: Residuals, whitening: Metric) -> Fitted:
    """Fit all parameters of the families together, starting from the signatures chosen."""
    if not families:
        return Fitted((), (white := whitening(data.um)), np.zeros((len(white), 0)))
    together = _Together(families, atoms, data, whitening)
    moved = together.minimum()
    slopes = together.slopes(moved)
    fitted = list(zip(together.laws, together.parts(moved), strict=True))
    spans = np.concatenate([law.spans(part) for law, part in fitted])
    covariance = _covariance(slopes, together.scale, spans)
    bound = np.concatenate([law.bound(part) for law, part in fitted])
    covariance[bound, bound] = np.nan  # where a bound holds, the data give no uncertainty
    own = slices(len(part) for _, part in fitted)
    solved = tuple(_solved(law, part, covariance[s, s]) for (law, part), s in zip(fitted, own, strict=True))
    slope = slopes[: len(data)]
    left = together.residuals(moved)[: len(data)]
    u_um = _together_u_um([law.slopes(part, law.scales(part), data) for law, part in fitted], covariance, data)
    return Fitted(solved, left, orthonormal(slope), tuple(slope[:, s] for s in own), u_um)


def _together_u_um(slopes: Sequence[Array], covariance: Array, data: Residuals) -> Array:
    """Standard uncertainty of what laws move together at every row, beside the origins; where a bound holds, none."""
    moved = data.without_origins(np.vstack(slopes))
    return np.sqrt(np.maximum(np.einsum("in,ij,jn->n", moved, np.nan_to_num(covariance), moved), 0.0))


def fitted_effect(family: Family, atom: int, data: Residuals, whitening: Metric) -> Effect:
    """One law alone with its parameters fitted, starting from the signature chosen, without their uncertainties."""
    together = _Together([family], [atom], data, whitening)
    (part,), (law,) = together.parts(together.minimum(SAME_SHAPE)), together.laws
    return _solved(law, part, np.full((len(part), len(part)), np.nan)).effect


class _Together:
    """Some laws as a sum of squares of steps ``moved (p,)`` from where their signatures begin.

    Their residuals are those of the rows, then of what is known of the parameters.
    """

    def __init__(self, families: Sequence[Family], atoms: Sequence[int], data: Residuals, whitening: Metric) -> None:
        self.laws = [FittedLaw(family, atom) for family, atom in zip(families, atoms, strict=True)]
        self.data, self.whitening, self.white = data, whitening, whitening(data.um)
        pairs = zip(families, atoms, strict=True)
        columns = np.concatenate([whitening(family.signature(atom)) for family, atom in pairs])
        coefficients = np.linalg.lstsq(columns.T, self.white, rcond=None)[0]
        own = slices(family.dimension for family in families)
        start = [law.start(coefficients[s]) for law, s in zip(self.laws, own, strict=True)]
        self.start, self.own = np.concatenate(start), slices(map(len, start))
        self.scale = np.concatenate([law.scales(part) for law, part in zip(self.laws, start, strict=True)])

    def minimum(self, tolerance: float = SAME_COST) -> Array:
        """The steps that lead to the least sum of squares."""
        none = np.zeros(len(self.start))
        bounds = (np.concatenate(each) for each in zip(*(law.bounds for law in self.laws), strict=True))
        low, high = ((each - self.start) / self.scale for each in bounds)
        return least_squares(self.residuals, self.slopes, none, tolerance, 60 * len(none), (low, high))

    def parts(self, moved: Array) -> list[Array]:
        """The parameters of each law."""
        return [(self.start + moved * self.scale)[s] for s in self.own]

    def residuals(self, moved: Array) -> Array:
        """Shape ``(n + k,)``."""
        parts = self.parts(moved)
        known = [law.known(part) for law, part in zip(self.laws, parts, strict=True)]
        left = _unexplained(self.laws, parts, self.data, self.whitening, self.white)
        return np.concatenate([left, *known])

    def slopes(self, moved: Array) -> Array:
        """Shape ``(n + k, p)``."""
        # that keep half the digits, away from zero
        steps = np.sqrt(np.finfo(float).eps) * np.where(moved < 0.0, -1.0, 1.0) * np.maximum(np.abs(moved), 1.0)
        parts, steps = self.parts(moved), steps * self.scale
        laws = list(zip(self.laws, parts, self.own, strict=True))
        um = np.vstack([law.slopes(part, steps[s], self.data) for law, part, s in laws])
        known = block_diag(*(law.known_slopes(part) for law, part, _ in laws))
        return np.vstack([-self.whitening(um).T, known]) * self.scale


def _unexplained(
    laws: Sequence[FittedLaw], parts: Sequence[Array], data: Residuals, whitening: Metric, white: Array
) -> Array:
    """What laws with these parameters leave; far too much where there is no such law, so that no step leads there.

    A tripod may be stated so that a face pulls the stylus out of it and the probe never triggers.
    """
    try:
        shares = [law.displacement_um(part, data) for law, part in zip(laws, parts, strict=True)]
    except InputError:
        return np.full(len(white), IMPOSSIBLE)
    return white - whitening(np.sum(shares, axis=0))


def _covariance(jacobian: Array, scale: Array, spans: Array) -> Array:
    """Covariance from the curvature of the sum of squares (variance one); NaN on the diagonal if not determined.

    ``spans``: standard deviations of the parameters before the recording, infinite where nothing is known. The
    curvature at the best fit may tell less of a shape than its range.
    """
    gram = jacobian.T @ jacobian
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    value, vector = np.linalg.eigh(gram / np.outer(size, size))
    lost = (vector[:, value <= UNTOLD] ** 2).sum(axis=1) > 1e-6
    told = np.where(lost, 0.0, scale / spans)
    value, vector = np.linalg.eigh((gram + np.diag(told**2)) / np.outer(size, size))
    good = value > UNTOLD
    covariance = (vector[:, good] / value[good]) @ vector[:, good].T * np.outer(scale / size, scale / size)
    covariance[lost, lost] = np.nan
    return covariance


def _spreads(law: FittedLaw, parameters: Array, covariance: Array) -> dict[str, float]:
    """Standard uncertainty by name; that of a size from its components'.

    What is uncertain across a direction makes a size larger to second order (GUM 5.1.2, note): the root of the mean
    square over the size that is stated counts as uncertainty, too.
    """
    spread = dict(zip(law.names, np.sqrt(np.maximum(np.diag(covariance), 0.0)), strict=True))
    if law.free:
        own = slice(0, law.free)
        size = float(np.linalg.norm(parameters[own]))
        unit = parameters[own] / max(size, 1e-300)
        along = float(unit @ covariance[own, own] @ unit)
        across = float(np.trace(covariance[own, own])) - along
        variance = along + float(np.hypot(size, np.sqrt(max(across, 0.0))) - size) ** 2
        spread = {name: u for name, u in spread.items() if not name.startswith("component")}
        spread = {law.linear[0]: float(np.sqrt(max(variance, 0.0))) if variance == variance else np.nan} | spread
    return spread


def _solved(law: FittedLaw, parameters: Array, covariance: Array) -> Solved:
    values = law.values(parameters)
    if law.free:
        _point_forward(values, law)
    _turn_round(values, law)
    spreads = _spreads(law, parameters, covariance)
    if law.law.kind == "misalignment":
        values["mrad"] = abs(values["mrad"])
    elif law.family.positive:
        for name in law.linear:
            values[name], spreads[name] = _above_zero(float(values[name]), float(spreads[name]))
    estimates = {
        name: Estimate(float(values[name]), None if np.isnan(spread) else float(spread), law.units[name])
        for name, spread in spreads.items()
        if name in law.units
    }
    for name in law.frozen & set(law.atom):
        if isinstance(law.atom[name], float):
            estimates[name] = Estimate(float(law.atom[name]), None, law.units[name])
    return Solved(law.family, law.law.model_construct(**values), estimates)


def _turn_round(values: dict[str, Any], law: FittedLaw) -> None:
    """Sines with positive amplitudes, and all angles within half a turn of zero."""
    for amplitude, phase in law.sines:
        if values[amplitude.name] < 0:
            values[amplitude.name] *= -1.0
            values[phase.name] += phase.turn / 2.0
    for p in law.law.parameters():
        if p.turn and isinstance(values.get(p.name), float):
            values[p.name] = (values[p.name] + p.turn / 2.0) % p.turn - p.turn / 2.0


def _above_zero(value: float, u: float) -> tuple[float, float]:
    """Mean and standard deviation of a normal distribution of what cannot be negative, cut off at zero."""
    if not u > 0.0:
        return max(value, 0.0), u
    at = value / u
    ratio = float(np.exp(-0.5 * at**2 - special.log_ndtr(at)) / np.sqrt(2.0 * np.pi))
    return max(value + u * ratio, 0.0), u * float(np.sqrt(max(1.0 - ratio * (at + ratio), 0.0)))


def _point_forward(values: dict[str, Any], law: FittedLaw) -> None:
    """A direction and its opposite are equivalent: the one with its largest component positive is stated."""
    name = law.law.free_direction()
    direction = np.array(values[name])
    if direction[np.abs(direction).argmax()] < 0.0:
        direction = -direction
        if law.sines:
            _, phase = law.sines[0]
            values[phase.name] += phase.turn / 2.0
        else:
            values[law.linear[0]] *= -1.0
    values[name] = tuple(float(share) for share in direction)


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis ``(n, k)`` of the span of columns ``(n, m)``; linearly dependent columns are dropped."""
    if columns.shape[1] == 0:
        return columns
    size = np.linalg.norm(columns, axis=0)
    keep = size > 1e-9 * max(float(size.max()), 1e-300)
    u, s, _ = np.linalg.svd(columns[:, keep] / size[keep], full_matrices=False)
    return np.asarray(u[:, s > 1e-7])

"""Parameters of the chosen effects with their uncertainties: generalised least squares over all of them together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from stepgauge.diagnosis.laws.library import Family, fixed_values, stated
from stepgauge.diagnosis.posterior.metric import Metric
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, along_approach_um
from stepgauge.errors import InputError

Array = NDArray[np.float64]
UNBOUNDED = 1e300
BEYOND = 0.02
"""Standard deviation by which a non-linear parameter may lie outside its grid, as a share of the grid."""
SMALLEST_SHARE = 0.01
"""Share of the least value of the grid below which all values count as equal: a logarithm needs a positive one."""
SAME_COST = 1e-6
"""Least relative decrease of the sum of squares by a step: with a thousand rows a thousandth in chi-square."""
UNTOLD = 1e-10
"""Share of the largest curvatures below which a combination of parameters is not determined."""
IMPOSSIBLE = 1e6
"""Residual of every row in standard deviations where a law cannot be."""
FROZEN = {"time_s", "when"}
"""Parameters without a derivative of the displacement: their resolution is that of the grid."""


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

    def displacement_um(self, data: Residuals, **changed: float) -> Array:
        """Displacement along the approach, shape ``(n,)``, optionally with some parameters changed."""
        effect = self.effect.model_copy(update=changed) if changed else self.effect
        return np.broadcast_to(along_approach_um(effect, data.probings), (len(data),)).astype(float)


@dataclass(frozen=True)
class Fitted:
    """Laws fitted together.

    ``left (n,)``: whitened residuals; ``basis (n, k)``: orthonormal columns of all that the fit can change to first
    order, with the tangents of the non-linear parameters; ``tangents``: these columns for each law, ``(n, p)`` each.
    """

    solved: tuple[Solved, ...]
    left: Array
    basis: Array
    tangents: tuple[Array, ...] = ()


def solve(families: Sequence[Family], atoms: Sequence[int], data: Residuals, whitening: Metric) -> Fitted:
    """Fit all parameters of the families together, starting from the signatures chosen."""
    laws = [_Law(family, atom) for family, atom in zip(families, atoms, strict=True)]
    white = whitening(data.um)
    if not laws:
        return Fitted((), white, np.zeros((len(white), 0)))
    columns = np.concatenate([whitening(law.family.signature(atom)) for law, atom in zip(laws, atoms, strict=True)])
    coefficients = np.linalg.lstsq(columns.T, white, rcond=None)[0]
    cuts = np.cumsum([law.family.dimension for law in laws])[:-1]
    start = [law.start(part) for law, part in zip(laws, np.split(coefficients, cuts), strict=True)]
    return _refine(laws, np.concatenate(start), data, whitening, white)


class _Law:
    """A family as a function of its fitted parameters.

    A free direction is represented by its components: the first ``k`` parameters.
    """

    def __init__(self, family: Family, atom: int) -> None:
        assert family.law is not None
        self.family, self.law, self.atom = family, family.law, dict(family.atoms[atom])
        known = {p.name: p for p in self.law.parameters()}
        self.linear = [name for name, p in known.items() if p.role == "linear"]
        moving = [
            part
            for name, value in self.atom.items()
            if value is not None and name not in FROZEN | family.taken
            for part in _parts(name, value)
        ]
        phase = ["phase_deg"] if "phase_deg" in known else []
        components = [f"component {i}" for i in range(self.free)]
        self.names = [*(components or self.linear), *moving, *phase]
        self.units = {name: known[name].unit for name in known}
        self.sized = self.free or len(self.linear)
        ranges = [self.family.ranges.get(name, (-UNBOUNDED, UNBOUNDED)) for name in self.names]
        self.range = np.array([(low, high) if low < high else (-UNBOUNDED, UNBOUNDED) for low, high in ranges]).T
        # of what is usual nothing is known where a name has no prior: infinitely wide about one
        about = [family.about.get(name, (1.0, np.inf)) for name in self.names]
        self.usual, self.spread = np.array(about).reshape(-1, 2).T
        # a step of the search may end where a time would run backwards, which no law can compute
        low = np.where(np.isfinite(self.spread), self.usual, self.range[0])
        self.least = np.where(low > 0.0, SMALLEST_SHARE * low, -UNBOUNDED)
        self._shapes: dict[bytes, Array] = {}

    @property
    def free(self) -> int:
        """Number of components of a free direction, 0 without one."""
        return 0 if self.family.directions is None else len(self.family.directions)

    def start(self, coefficients: Array) -> Array:
        """Parameters from the coefficients of the signature."""
        values: dict[str, Any] = dict(self.atom)
        if "phase_deg" in self.names:
            lobes = 1.0 if self.law.quadrature else 3.0
            size, turn = _sine(coefficients.reshape(-1, 2))
            names = [f"component {i}" for i in range(self.free)] or ["amplitude_um"]
            values |= dict(zip(names, map(float, size), strict=True))
            values["phase_deg"] = float(np.degrees(turn) / lobes)
        elif self.law.kind == "misalignment":
            values["mrad"] = float(np.sqrt(max(coefficients[0], 0.0)))
        else:
            names = [f"component {i}" for i in range(self.free)] or self.linear
            # a law without an amplitude, as a longer lever, starts from its shape alone
            values |= dict(zip(names, map(float, coefficients), strict=True)) if names else {}
        self.atom |= {name: values[name] for name in self.atom}
        for name, value in self.atom.items():
            values |= dict(zip(_parts(name, value), value, strict=True)) if isinstance(value, tuple) else {}
        return np.array([values[name] for name in self.names], float)

    def values(self, parameters: Array) -> dict[str, Any]:
        """All parameters of the effect."""
        fitted: dict[str, Any] = dict(zip(self.names, map(float, parameters), strict=True))
        if self.family.directions is not None:
            vector = parameters[: self.free] @ self.family.directions
            size = float(np.linalg.norm(vector))
            fitted = {name: value for name, value in fitted.items() if not name.startswith("component")}
            fitted |= {
                self.linear[0]: size,
                "direction": tuple(vector / size) if size > 0.0 else tuple(self.family.directions[0]),
            }
        for name, value in self.atom.items():
            if isinstance(value, tuple):
                fitted[name] = tuple(fitted.pop(part) for part in _parts(name, value))
        return stated(fixed_values(self.law) | self.family.choices | self.atom | fitted)

    def shape(self, parameters: Array, data: Residuals) -> Array:
        """Displacement along the approach for a unit of every size, um, for one or more sets of parameters ``(m, p)``.

        Shape ``(m, k, n)``; for a law without a size it is the displacement itself.
        """
        sets = np.maximum(np.atleast_2d(parameters), self.least)[:, self.sized :]
        key = sets.tobytes()
        if key not in self._shapes:
            self._shapes = {key: self._shape(sets, data)}
        return self._shapes[key]

    def _shape(self, sets: Array, data: Residuals) -> Array:
        values = self._values_of_sets(sets)
        effect = self.law.model_construct(**(values | dict.fromkeys(self.linear, 1.0)))
        um = np.broadcast_to(along_approach_um(effect, data.probings), (len(sets), len(data)))
        return um[:, None] * (1.0 if self.family.directions is None else self._shares(data))

    def _values_of_sets(self, sets: Array) -> dict[str, Any]:
        """All parameters but the sizes, the fitted ones ``(m, 1)``; a free direction is in its shares."""
        fitted: dict[str, Any] = dict(zip(self.names[self.sized :], sets.T[..., None], strict=True))
        for name, value in self.atom.items():
            if isinstance(value, tuple):
                fitted[name] = tuple(fitted.pop(part) for part in _parts(name, value))
        direction = {} if self.family.directions is None else {"direction": "approach"}
        return stated(fixed_values(self.law) | self.family.choices | self.atom | fitted | direction)

    def _shares(self, data: Residuals) -> Array:
        """Shares of the free direction's unit vectors in the approaches, ``(k, n)``."""
        assert self.family.directions is not None
        return self.family.directions @ np.array([data.probings.approach(axis) for axis in "xyz"])

    def displacement_um(self, parameters: Array, data: Residuals) -> Array:
        """Along the approach, shape ``(n,)``."""
        return self._scaled(parameters, self.shape(parameters, data))[0]

    def _scaled(self, parameters: Array, shape: Array) -> Array:
        return np.einsum("k,mkn->mn", parameters[: self.sized], shape) if self.sized else shape[:, 0]

    def slopes(self, parameters: Array, steps: Array, data: Residuals) -> Array:
        """Slope of the displacement in every parameter, shape ``(p, n)``: exact for sizes, else by ``steps``.

        Back where there is no such law one step ahead.
        """
        try:
            return self._slopes(parameters, steps, data)
        except InputError:
            return self._slopes(parameters, -steps, data)

    def _slopes(self, parameters: Array, steps: Array, data: Residuals) -> Array:
        moved = parameters + np.vstack([np.zeros(len(steps)), np.diag(steps)[self.sized :]])
        shape = self.shape(moved, data)
        um = self._scaled(parameters, shape)
        return np.vstack([shape[0, : self.sized], (um[1:] - um[0]) / steps[self.sized :, None]])

    def known(self, parameters: Array) -> Array:
        """Distance of sizes and shapes from the medians of their priors, in standard deviations."""
        sizes = parameters[: self.sized] / self.family.prior
        value, inside = self._positive(parameters)
        far = np.log(value / self.usual) + (inside - value) / value  # below the least value on a straight line
        return np.concatenate([sizes, far / self.spread])

    def known_slopes(self, parameters: Array) -> Array:
        """Slope of :meth:`known` in every parameter."""
        sizes = np.eye(self.sized, len(self.names)) / self.family.prior
        return np.vstack([sizes, np.diag(1.0 / (self._positive(parameters)[0] * self.spread))])

    def _positive(self, parameters: Array) -> tuple[Array, Array]:
        """Shapes of which something is usual, not below their least value and as they are; one for all others."""
        known = np.isfinite(self.spread)
        return np.where(known, np.maximum(parameters, self.least), 1.0), np.where(known, parameters, 1.0)

    def strays(self, parameters: Array) -> tuple[Array, Array]:
        """Distance of parameters beyond their grid, in standard deviations, and the derivative of each.

        A period of many times the span is a parabola, a decay over many times the touches a constant: other laws. As a
        ratio if the grid has only positive values.
        """
        low, high = self.range
        if ((parameters >= low) & (parameters <= high)).all():
            return np.zeros(len(parameters)), np.zeros(len(parameters))
        by_ratio = low > 0.0
        inside = np.clip(parameters, low, high)
        positive = np.maximum(parameters, self.least)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            beyond = np.where(by_ratio, np.log(positive / inside), (parameters - inside) / (high - low))
            slope = np.where(by_ratio, 1.0 / positive, 1.0 / (high - low))
        return beyond / BEYOND, np.where(parameters != inside, slope, 0.0) / BEYOND

    def spans(self, parameters: Array) -> Array:
        """Standard deviations of the shapes before the recording: of a uniform distribution over their ranges.

        Of what is positive, by its logarithm, as shapes are tried. Infinite for sizes, whose prior is among the
        residuals.
        """
        low, high = self.range
        by_ratio = low > 0.0
        with np.errstate(divide="ignore"):
            ratio = np.log(np.where(by_ratio, high / low, 1.0))
        span = np.where(by_ratio, np.abs(parameters) * ratio, high - low) / np.sqrt(12.0)
        return np.where(np.arange(len(span)) < self.sized, np.inf, np.maximum(span, 1e-300))

    def scales(self, parameters: Array) -> Array:
        """Step of each parameter for its derivative."""
        return np.array(
            [
                10.0 if name.endswith("_deg") or "_mm" in name else max(abs(value), 1e-3)
                for name, value in zip(self.names, parameters, strict=True)
            ]
        )


def _parts(name: str, value: object) -> list[str]:
    """Names of the numbers of a parameter: its own, or one for each of several."""
    return [f"{name} {i}" for i in range(len(value))] if isinstance(value, tuple) else [name]


def _sine(coefficients: Array) -> tuple[Array, float]:
    """Signed amplitudes ``(k,)`` and the common phase, rad, of sine and cosine coefficients ``(k, 2)``."""
    _, _, turns = np.linalg.svd(coefficients, full_matrices=False)
    first = turns[0] * (np.sign(coefficients[np.abs(coefficients).sum(axis=1).argmax()] @ turns[0]) or 1.0)
    return coefficients @ first, float(np.arctan2(first[1], first[0]))


def _refine(laws: Sequence[_Law], start: Array, data: Residuals, whitening: Metric, white: Array) -> Fitted:
    cuts = np.cumsum([len(law.names) for law in laws])[:-1]
    scale = np.concatenate([law.scales(part) for law, part in zip(laws, np.split(start, cuts), strict=True)])

    def left(moved: Array) -> Array:
        parts = np.split(start + moved * scale, cuts)
        known = np.concatenate([law.known(part) for law, part in zip(laws, parts, strict=True)])
        strays = np.concatenate([law.strays(part)[0] for law, part in zip(laws, parts, strict=True)])
        return np.concatenate([_unexplained(laws, parts, data, whitening, white), known, strays])

    def slopes(moved: Array) -> Array:
        parts, steps = np.split(start + moved * scale, cuts), np.split(_steps(moved) * scale, cuts)
        um = [law.slopes(part, step, data) for law, part, step in zip(laws, parts, steps, strict=True)]
        strays = np.diag(np.concatenate([law.strays(part)[1] for law, part in zip(laws, parts, strict=True)]))
        known = block_diag(*(law.known_slopes(part) for law, part in zip(laws, parts, strict=True)))
        return np.vstack([-whitening(np.vstack(um)).T, known, strays]) * scale

    method = "lm" if len(white) > len(start) else "trf"
    found = least_squares(left, np.zeros(len(start)), slopes, method=method, ftol=SAME_COST, max_nfev=60 * len(start))
    moved = found.x if found.cost <= 0.5 * float((left(np.zeros(len(start))) ** 2).sum()) else np.zeros(len(start))
    values = start + moved * scale
    fitted = list(zip(laws, np.split(values, cuts), strict=True))
    spans = np.concatenate([law.spans(part) for law, part in fitted])
    covariance = _covariance(found.jac[: len(found.jac) - len(start)], scale, spans)
    strays = np.concatenate([law.strays(part)[0] for law, part in fitted])
    covariance[strays != 0.0, strays != 0.0] = np.nan  # where a bound holds, the data give no uncertainty
    solved, first = [], 0
    for law, part in fitted:
        own = slice(first, first + len(part))
        solved.append(_solved(law, part, covariance[own, own]))
        first += len(part)
    slope = found.jac[: len(white)]
    return Fitted(tuple(solved), left(moved)[: len(white)], orthonormal(slope), tuple(np.split(slope, cuts, axis=1)))


def _unexplained(
    laws: Sequence[_Law], parts: Sequence[Array], data: Residuals, whitening: Metric, white: Array
) -> Array:
    """What laws with these parameters leave; far too much where there is no such law, so that no step leads there.

    A tripod may be stated so that a face pulls the stylus out of it and the probe never triggers.
    """
    try:
        shares = [law.displacement_um(part, data) for law, part in zip(laws, parts, strict=True)]
    except InputError:
        return np.full(len(white), IMPOSSIBLE)
    return white - whitening(np.sum(shares, axis=0))


def _steps(moved: Array) -> Array:
    """Steps of a difference quotient that keep half the digits, away from zero."""
    return np.sqrt(np.finfo(float).eps) * np.where(moved < 0.0, -1.0, 1.0) * np.maximum(np.abs(moved), 1.0)


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


def _spreads(law: _Law, parameters: Array, covariance: Array) -> dict[str, float]:
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


def _solved(law: _Law, parameters: Array, covariance: Array) -> Solved:
    values = law.values(parameters)
    if "direction" in values and law.free:
        _point_forward(values, law)
    if "amplitude_um" in values and values["amplitude_um"] < 0:
        values["amplitude_um"] *= -1.0
        values["phase_deg"] += 180.0 if law.law.quadrature else 60.0
    if "phase_deg" in values:
        turn = 360.0 if law.law.quadrature else 120.0
        values["phase_deg"] = (values["phase_deg"] + turn / 2.0) % turn - turn / 2.0
    if "arm_azimuth_deg" in values:
        turn = 360.0 if "arm" in values else 120.0  # which of three arms alike is not told
        values["arm_azimuth_deg"] = (values["arm_azimuth_deg"] + turn / 2.0) % turn - turn / 2.0
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
    for name in (FROZEN | law.family.taken) & set(law.atom):
        if isinstance(law.atom[name], float):
            estimates[name] = Estimate(float(law.atom[name]), None, law.units[name])
    return Solved(law.family, law.law.model_construct(**values), estimates)


def _above_zero(value: float, u: float) -> tuple[float, float]:
    """Mean and standard deviation of a normal distribution of what cannot be negative, cut off at zero."""
    if not u > 0.0:
        return max(value, 0.0), u
    at = value / u
    ratio = float(np.exp(-0.5 * at**2 - special.log_ndtr(at)) / np.sqrt(2.0 * np.pi))
    return max(value + u * ratio, 0.0), u * float(np.sqrt(max(1.0 - ratio * (at + ratio), 0.0)))


def _point_forward(values: dict[str, Any], law: _Law) -> None:
    """A direction and its opposite are equivalent: the one with its largest component positive is stated."""
    direction = np.array(values["direction"])
    if direction[np.abs(direction).argmax()] < 0.0:
        direction = -direction
        if "phase_deg" in values:
            values["phase_deg"] += 180.0
        else:
            values[law.linear[0]] *= -1.0
    values["direction"] = tuple(float(share) for share in direction)


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis ``(n, k)`` of the span of columns ``(n, m)``; linearly dependent columns are dropped."""
    if columns.shape[1] == 0:
        return columns
    size = np.linalg.norm(columns, axis=0)
    keep = size > 1e-9 * max(float(size.max()), 1e-300)
    u, s, _ = np.linalg.svd(columns[:, keep] / size[keep], full_matrices=False)
    return np.asarray(u[:, s > 1e-7])

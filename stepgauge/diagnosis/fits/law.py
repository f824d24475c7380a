"""A law as a function of the parameters that are fitted: displacement, slopes, and what is known of them beforehand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.library import Family, fixed_values, stated
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import along_approach_um
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array

SMALLEST_SHARE = 0.01
"""Share of what is usual below which a shape does not come: a logarithm needs a positive one."""


class FittedLaw:
    """A family as a function of its fitted parameters.

    A free direction is represented by its components: the first ``k`` parameters.
    """

    def __init__(self, family: Family, atom: int) -> None:
        self.family, self.law, self.atom = family, family.law, dict(family.atoms[atom])
        known = {p.name: p for p in self.law.parameters()}
        self.linear = [name for name, p in known.items() if p.role == "linear"]
        moving = [
            part
            for name, value in self.atom.items()
            if value is not None and name not in self.frozen
            for part in parts_of(name, value)
        ]
        self.sines = self.law.sines()
        phases = [phase.name for _, phase in self.sines]
        components = [f"component {i}" for i in range(self.free)]
        self.names = [*(components or self.linear), *moving, *phases]
        self.units = {name: known[name].unit for name in known}
        self.sized = self.free or len(self.linear)
        # of what is usual nothing is known where a name has no prior: infinitely wide about one
        about = [family.about.get(name, (1.0, np.inf)) for name in self.names]
        self.usual, self.spread = np.array(about).reshape(-1, 2).T
        ranges = np.array([family.ranges.get(name, (-np.inf, np.inf)) for name in self.names]).reshape(-1, 2)
        ranges[ranges[:, 0] == ranges[:, 1]] = -np.inf, np.inf
        # a step may not end where a time would run backwards, which no law can compute
        low = np.where(np.isfinite(self.spread), SMALLEST_SHARE * self.usual, ranges[:, 0])
        self.bounds = low, ranges[:, 1]
        self._shapes: dict[bytes, Array] = {}

    @property
    def frozen(self) -> set[str]:
        """Parameters that are not fitted: their resolution is that of the grid."""
        return {p.name for p in self.law.parameters() if not p.fitted} | {"when"} | self.family.taken

    @property
    def free(self) -> int:
        """Number of components of a free direction, 0 without one."""
        return 0 if self.family.directions is None else len(self.family.directions)

    def start(self, coefficients: Array) -> Array:
        """Parameters from the coefficients of the signature."""
        values: dict[str, Any] = dict(self.atom)
        components = [f"component {i}" for i in range(self.free)]
        if self.sines:
            for (amplitude, phase), own in zip(self.sines, np.split(coefficients, len(self.sines)), strict=True):
                size, turn = _sine(own.reshape(-1, 2))
                values |= dict(zip(components or [amplitude.name], map(float, size), strict=True))
                values[phase.name] = float(turn / (2.0 * np.pi) * phase.turn)
        elif self.law.kind == "misalignment":
            values["mrad"] = float(np.sqrt(max(coefficients[0], 0.0)))
        else:
            names = components or self.linear
            # a law without an amplitude, as a longer lever, starts from its shape alone
            values |= dict(zip(names, map(float, coefficients), strict=True)) if names else {}
        self.atom |= {name: values[name] for name in self.atom}
        for name, value in self.atom.items():
            values |= dict(zip(parts_of(name, value), value, strict=True)) if isinstance(value, tuple) else {}
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
                self.law.free_direction(): tuple(vector / size) if size > 0.0 else tuple(self.family.directions[0]),
            }
        for name, value in self.atom.items():
            if isinstance(value, tuple):
                fitted[name] = tuple(fitted.pop(part) for part in parts_of(name, value))
        return stated(fixed_values(self.law) | self.family.choices | self.atom | fitted)

    def shape(self, parameters: Array, data: Residuals) -> Array:
        """Displacement along the approach for a unit of every size, um, for one or more sets of parameters ``(m, p)``.

        Shape ``(m, k, n)``; for a law without a size it is the displacement itself.
        """
        sets = np.atleast_2d(parameters)[:, self.sized :]
        key = sets.tobytes()
        if key not in self._shapes:
            self._shapes = {key: self._shape(sets, data)}
        return self._shapes[key]

    def _shape(self, sets: Array, data: Residuals) -> Array:
        values = self._values_of_sets(sets)
        alone = [dict.fromkeys(self.linear, 0.0) | {name: 1.0} for name in self.linear] or [{}]
        um = np.empty((len(sets), len(alone), len(data)))
        with np.errstate(all="ignore"):  # far from its range an effect may be no number, and no step leads there
            for place, sizes in enumerate(alone):
                um[:, place] = along_approach_um(self.law.model_construct(**values | sizes), data.probings)
        if not np.isfinite(um).all():
            raise InputError("effects", "no number", found=self.law.kind)
        return um * (1.0 if self.family.directions is None else self._shares(data))

    def _values_of_sets(self, sets: Array) -> dict[str, Any]:
        """All parameters but the sizes, the fitted ones ``(m, 1)``; a free direction is in its shares."""
        fitted: dict[str, Any] = dict(zip(self.names[self.sized :], sets.T[..., None], strict=True))
        for name, value in self.atom.items():
            if isinstance(value, tuple):
                fitted[name] = tuple(fitted.pop(part) for part in parts_of(name, value))
        direction = {} if self.family.directions is None else {self.law.free_direction(): "approach"}
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
        known = np.isfinite(self.spread)
        far = np.log(np.where(known, parameters, 1.0) / self.usual) / self.spread
        return np.concatenate([parameters[: self.sized] / self.family.prior, far])

    def known_slopes(self, parameters: Array) -> Array:
        """Slope of :meth:`known` in every parameter."""
        sizes = np.eye(self.sized, len(self.names)) / self.family.prior
        return np.vstack([sizes, np.diag(1.0 / (np.where(np.isfinite(self.spread), parameters, 1.0) * self.spread))])

    def bound(self, parameters: Array) -> NDArray[np.bool_]:
        """Parameters at the end of their grid.

        A period of many times the span is a parabola, a decay over many times the touches a constant: other laws.
        """
        return np.asarray((parameters <= self.bounds[0]) | (parameters >= self.bounds[1]))

    def spans(self, parameters: Array) -> Array:
        """Standard deviations of the shapes before the recording: of a uniform distribution over their ranges.

        Of what is positive, by its logarithm, as shapes are tried. Infinite for sizes, whose prior is among the
        residuals.
        """
        low, high = self.bounds
        by_ratio = (low > 0.0) & np.isfinite(high)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(np.where(by_ratio, high / low, 1.0))
            span = np.where(by_ratio, np.abs(parameters) * ratio, high - low) / np.sqrt(12.0)
        return np.where(np.arange(len(span)) < self.sized, np.inf, np.maximum(span, 1e-300))

    def scales(self, parameters: Array) -> Array:
        """Step of each parameter for its derivative."""
        return np.array(
            [
                10.0 if self.units.get(name.split()[0]) in ("deg", "mm") else max(abs(value), 1e-3)
                for name, value in zip(self.names, parameters, strict=True)
            ]
        )


def parts_of(name: str, value: object) -> list[str]:
    """Names of the numbers of a parameter: its own, or one for each of several."""
    return [f"{name} {i}" for i in range(len(value))] if isinstance(value, tuple) else [name]


def _sine(coefficients: Array) -> tuple[Array, float]:
    """Signed amplitudes ``(k,)`` and the common phase, rad, of sine and cosine coefficients ``(k, 2)``."""
    _, _, turns = np.linalg.svd(coefficients, full_matrices=False)
    first = turns[0] * (np.sign(coefficients[np.abs(coefficients).sum(axis=1).argmax()] @ turns[0]) or 1.0)
    return coefficients @ first, float(np.arctan2(first[1], first[0]))

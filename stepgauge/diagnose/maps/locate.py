"""Where on the map disagreement lives: the forms that stand out of the scatter, all looks counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnose.maps.chance import log_p_value
from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.fit import Fitted, between_directions
from stepgauge.diagnose.maps.forms import Family, Located, Shape, families
from stepgauge.diagnose.maps.noise import MapNoise
from stepgauge.diagnose.solve import orthonormal

Array = NDArray[np.float64]
FALSE_ALARM = 0.006
"""Chance that structure is seen where there is none."""
MOST_FORMS = 4
COLLINEAR = 1e-4
"""Share of a shape's square that must be left beside what is fitted already."""
NEARLY = 0.9
"""Share of the gain of the best form that is enough for a plainer one."""
PLAIN = {"offset": 0, "trend": 1, "harmonic": 1, "bow": 2}
"""Forms from plain to odd; all others are odder."""
DIRECTION, IRREGULAR = "direction", "irregular"


@dataclass(frozen=True)
class Found:
    """A form that stands out: of which quantity, its shape, what it gains in chi-square and how surprising that is."""

    quantity: int
    covariate: str
    form: str
    shape: Shape
    gain: float
    log_p: float
    looks: int


@dataclass(frozen=True)
class _Look:
    found: Found
    column: Array


@dataclass(frozen=True)
class _Rest:
    """Sums of squares that a form must bring down, of all residuals and of the means over repeats, with their dof."""

    rss: float
    dof: int
    between: float
    between_dof: int

    def against(self, gain: float, d: int) -> tuple[float, int, int]:
        """A gain of ``d`` numbers over the variance that is then left; ``d``; degrees of freedom of both."""
        pooled = (self.rss - gain) / (self.dof - d)
        of_means = (self.between - gain) / max(self.between_dof - d, 1)
        variance, dof = (of_means, self.between_dof) if of_means > pooled else (pooled, self.dof)
        return gain / max(variance, 1e-12), d, dof


class Locator:
    """Looks for the forms of a map in whitened residuals."""

    def __init__(self, data: MapData) -> None:
        self.data = data
        self._direction = data.direction
        self.families = families(data)
        self.bar = float(np.log(FALSE_ALARM / (len(self.families) * len(data.measured))))

    def standing_out(self, fitted: Fitted) -> list[Found]:
        """Forms beside the fitted terms and each other, most surprising first, as long as they are no chance."""
        found: list[Found] = []
        basis = orthonormal(fitted.jacobian)
        while len(found) < MOST_FORMS:
            left = fitted.whitened - basis @ (basis.T @ fitted.whitened)
            looks = [
                look
                for look in self._looks(left, basis, fitted)
                if look.found.log_p <= self.bar and not self._in_the_digits(look.found, fitted)
            ]
            if not looks:
                break
            best = _plainest(looks)
            found.append(best.found)
            basis = orthonormal(np.column_stack([basis, best.column]))
        return found

    def _in_the_digits(self, one: Found, fitted: Fitted) -> bool:
        """Whether a form is no larger than the rounding, which repeats where a symmetric probe repeats its values."""
        return self.data.measured[one.quantity].is_rounded(fitted.sigma[one.quantity]) and one.gain < len(self.data)

    def located(self, found: list[Found], fitted: Fitted) -> tuple[Located, ...]:
        """In words, with the share of the structure of all residuals."""
        total = max(fitted.rss - len(fitted.whitened), 1.0)
        return tuple(
            Located(
                one.covariate,
                "both",
                one.form,
                f"{quantity_words(self.data.measured[one.quantity].name)}: {one.shape.words}",
                round(min(one.gain / total, 1.0), 4),
                float(np.exp(one.log_p)),
            )
            for one in found
        )

    def _looks(self, left: Array, basis: Array, fitted: Fitted) -> list[_Look]:
        n, quantities = len(self.data), len(self.data.measured)
        between, means = between_directions(left, self._direction, quantities)
        rest = _Rest(float(left @ left), len(left) - basis.shape[1], between, means - basis.shape[1])
        looks = []
        for i, sigma in enumerate(fitted.sigma):
            rows = slice(i * n, (i + 1) * n)
            for family in self.families:
                white = family.columns / sigma
                gains, free = _gains(white, left[rows], basis[rows])
                best = int(gains.argmax())
                looks.append(self._look(i, family, best, float(gains[best]), int(free[best]), rest))
                looks[-1].column[rows] = white[best].T
        return looks

    def _look(self, i: int, family: Family, best: int, gain: float, d: int, rest: _Rest) -> _Look:
        log_p = 0.0
        if d > 0 and rest.dof - d >= 2:
            log_p = log_p_value(*rest.against(gain, d), float(len(family.shapes)))
        column = np.zeros((len(self.data) * len(self.data.measured), family.columns.shape[1]))
        shape = family.shapes[best]
        return _Look(Found(i, family.covariate, family.form, shape, gain, log_p, len(family.shapes)), column)


def _plainest(looks: list[_Look]) -> _Look:
    """The plainest form that says nearly as much as the most surprising one does of the same quantity."""
    first = min(looks, key=lambda look: look.found.log_p)
    near = [
        look
        for look in looks
        if look.found.quantity == first.found.quantity and look.found.gain >= NEARLY * first.found.gain
    ]
    return min(near, key=lambda look: (PLAIN.get(look.found.form.split()[0], len(PLAIN)), look.found.log_p))


def lack_of_fit(data: MapData, noise: MapNoise, whitened: Array, parameters: int) -> tuple[float, float]:
    """Chi-square of the means over repeats beyond what the scatter gives them, and the logarithm of its chance.

    Without repeats nothing can be said: 0 and 0. ``parameters``: how many were fitted.
    """
    if not noise.repeats:
        return 0.0, 0.0
    square, means = between_directions(whitened, data.direction, len(data.measured))
    dof = means - parameters
    if dof < 1:
        return 0.0, 0.0
    p = float(stats.f.logsf(square / dof, dof, noise.dof * len(data.measured)))
    return max(square - dof, 0.0), p


def quantity_words(name: str) -> str:
    """A quantity as people say it: ``trigger_force_N`` is the trigger force."""
    return {"pretravel_um": "pre-travel"}.get(name, name.rsplit("_", 1)[0].replace("_", " "))


def _gains(white: Array, left: Array, basis: Array) -> tuple[Array, NDArray[np.intp]]:
    """Of shapes (a, d, n) beside a basis (n, k): what each takes off the sum of squares, and by how many, (a,)."""
    dot, beside = white @ left, white @ basis
    alone = white @ np.swapaxes(white, 1, 2)
    scale = np.sqrt(np.maximum(np.einsum("add->ad", alone), 1e-300))
    gram = (alone - beside @ np.swapaxes(beside, 1, 2)) / (scale[:, :, None] * scale[:, None, :])
    value, vector = np.linalg.eigh(gram)
    share = np.einsum("aij,ai->aj", vector, dot / scale)
    free = value > COLLINEAR
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = np.where(free, share**2 / value, 0.0).sum(axis=1)
    return gains, free.sum(axis=1)

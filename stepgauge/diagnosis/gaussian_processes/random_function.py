"""Random functions of a covariate, and names of their shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import REST, TOUCHES, Covariate, axes_shown, lives_on, standard
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.kernels import matern
from stepgauge.inference.problem import Refined
from stepgauge.recording import OPTIONAL

Features = Sequence[Array] | Array | NDArray[np.float32]
"""Features of each kernel, ``(m, n)`` each, or signatures of each shape, ``(atoms, d, n)``."""
TREND, SMOOTH, ROUGH, LAGGED, WAVE = "trend", "smooth", "rough", "lagged", "wave"
LENGTH, LEVELS, LOOP, HARMONICS, BEAT = "changing length", "levels", "loop", "harmonics", "beat"
SAWTOOTH, HYSTERESIS, RESTS = "sawtooth", "hysteresis", "memory of rests"
PERIODIC = (WAVE, SAWTOOTH)
WANDERING = ("time", "order")
DRIFTING = (*WANDERING, "cycle")
ROUGH_LENGTHS = (0.015, 0.1)
WALK_LENGTHS = (0.1, 1.0)
"""Those of errors that add up along an axis, as of the divisions of a scale or the turns of a screw."""
HELD = 0.999
"""Share of the variance of a function of two covariates that is enough of it."""
VOLUME_LENGTHS = (0.25, 0.6)
"""Correlation lengths of what changes with two coordinates, over the span of each."""


@dataclass(frozen=True)
class RandomFunction:
    """A random function of a covariate, on all the sides on which it may act, or on its ``side`` as it is stated.

    ``kernels``: for each of its shapes ``trend``, ``smooth`` or ``rough``, or its numbers: a lag in s, a period;
    ``share``: its prior odds over those of an ordinary one; ``of``: from such numbers of some shapes, of the grid or
    not, to their signatures ``(k, d, n)``, before the share of each row; ``near``: the shapes about one, tried one
    after the other to fit what lies between those of the grid; ``unread``: from the numbers of a shape to what it may
    do beside its signature, ``(p, n)`` before the share of each row.
    """

    covariate: str
    unit: str
    shape: str
    features: Features
    kernels: tuple[object, ...]
    sides: tuple[str, ...]
    share: float = 1.0
    beside: str = ""
    of: Callable[[Sequence[Any]], Array] | None = None
    near: tuple[Callable[[Any], Sequence[Any]], ...] = ()
    unread: Callable[[Any], Array] | None = None
    side: str = ""

    def refined(self, data: Residuals, share: Array, atom: int, um: Array) -> Refined:
        """Of the shapes near one of the grid that which explains most beside the origins; ``share (n,)``: by row."""
        assert self.of is not None
        shape: Any = self.kernels[atom]
        for near in self.near:
            shapes = near(shape)
            shape = shapes[_best(self.of(shapes) * share, data, um)]
        columns = self.of([shape])[0]
        return Refined(
            (columns if self.unread is None else np.concatenate([columns, self.unread(shape)])) * share, shape
        )


def _best(columns: Array, data: Residuals, um: Array) -> int:
    """Of some signatures ``(k, d, n)`` the number of the one that explains most beside the origins."""
    free = data.without_origins(columns)
    gram = free @ np.swapaxes(free, 1, 2)
    diagonal = np.einsum("kii->ki", gram)
    diagonal += 1e-6 * np.maximum(diagonal.max(axis=1, keepdims=True), 1e-300)
    dot = free @ data.without_origins(um)
    return int(np.einsum("kd,kd->k", dot, np.linalg.solve(gram, dot[:, :, None])[..., 0]).argmax())


def functions(one: Covariate, data: Residuals, priors: Priors) -> RandomFunction:
    """Smooth functions of several lengths, rough ones of covariates such as time, and a trend.

    The trend is the last one: where it is a law's, the numbers of the others stay. A relaxation after a pause
    depends on ratios of its duration: its functions are smooth in the logarithm.
    """
    values = np.log1p(one.values) if one.name == REST or one.name.startswith(TOUCHES) else one.values
    smooth = [matern(values, length) for length in priors.forms.lengths]
    walks = one.name == "position" and data.probings.setting.recording == "linear"
    lengths = ROUGH_LENGTHS if one.name in WANDERING else WALK_LENGTHS if walks else ()
    rough = [matern(values, length, rough=True) for length in lengths]
    kernels = (*[SMOOTH] * len(smooth), *[ROUGH] * len(rough), TREND)
    features = [*smooth, *rough, standard(values, one.known)[None]]
    share = priors.forms.own_column if one.further and one.name not in OPTIONAL else 1.0
    return RandomFunction(one.name, one.unit, SMOOTH, features, kernels, sides_of(one, data), share)


def sides_of(one: Covariate, data: Residuals) -> tuple[str, ...]:
    """The sides on which a function of a covariate may act."""
    axes = [axis for axis in axes_shown(data) if lives_on(one, axis)]
    return ("approach", "gauge", *axes)


def changing(position: Covariate, slow: Covariate, priors: Priors) -> Iterator[RandomFunction]:
    """Length errors, and errors along the gauge, that change smoothly with time or order."""
    both, share = ("approach", "gauge"), priors.forms.product
    length = position.standard
    grown = [matern(slow.values, at) * (length - zero) for at in priors.forms.lengths[1:3] for zero in
             (0.0, length.min(), length.max())]  # fmt: skip
    yield RandomFunction(slow.name, slow.unit, LENGTH, grown, (SMOOTH,) * len(grown), both, share, "position")
    surface = [_product(matern(position.values, a), matern(slow.values, b)) for a, b in ((0.15, 0.08), (0.3, 0.25))]
    yield RandomFunction(slow.name, slow.unit, SMOOTH, surface, (SMOOTH, SMOOTH), both, share, "position")


def volumes(places: Sequence[Covariate], data: Residuals, priors: Priors) -> Iterator[RandomFunction]:
    """Errors of the volume: smooth functions of two coordinates together, as of a spoilt corner."""
    sides, share = ("gauge", *axes_shown(data)), priors.forms.product
    for one, other in combinations(places, 2):
        surface = [_product(matern(one.values, length), matern(other.values, length)) for length in VOLUME_LENGTHS]
        yield RandomFunction(one.name, one.unit, SMOOTH, surface, (SMOOTH,) * len(surface), sides, share, other.name)


def _product(one: Array, other: Array, most: int = 200) -> Array:
    """Products of features, without negligible ones: those that hold all but a thousandth of the variance."""
    both = (one[:, None] * other[None]).reshape(-1, one.shape[1])
    size = (both**2).sum(axis=1)
    largest = np.argsort(-size)
    held = np.cumsum(size[largest]) / size.sum()
    return both[largest[: min(most, 1 + int(np.searchsorted(held, HELD)))]]

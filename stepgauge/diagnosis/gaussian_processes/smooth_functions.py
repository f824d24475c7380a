"""Smooth and rough functions of one covariate or of two.

Their features are those of :mod:`stepgauge.inference.kernels`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from stepgauge.diagnosis.covariates import REST, TOUCHES, Covariate, axes_shown, lives_on, standard
from stepgauge.diagnosis.gaussian_processes.random_function import (
    LENGTH,
    ROUGH,
    SMOOTH,
    TREND,
    WANDERING,
    RandomFunction,
)
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.kernels import matern
from stepgauge.recording import OPTIONAL

ROUGH_LENGTHS = (0.015, 0.1)
HELD = 0.999
"""Share of the variance of a function of two covariates that is enough of it."""
VOLUME_LENGTHS = (0.25, 0.6)
"""Correlation lengths of what changes with two coordinates, over the span of each."""


def functions(one: Covariate, data: Residuals, priors: Priors) -> RandomFunction:
    """Smooth functions of several lengths, rough ones of covariates such as time, and a trend.

    The trend is the last one: where it is a law's, the numbers of the others stay. A relaxation after a pause
    depends on ratios of its duration: its functions are smooth in the logarithm.
    """
    values = np.log1p(one.values) if one.name == REST or one.name.startswith(TOUCHES) else one.values
    smooth = [matern(values, length) for length in priors.forms.lengths]
    rough = [matern(values, length, rough=True) for length in ROUGH_LENGTHS] if one.name in WANDERING else []
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

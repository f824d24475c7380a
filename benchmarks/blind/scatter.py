"""Scatter of the touches: the ordinary one, and seven kinds that are not ideal.

All have unit variance, so that the noise of one probing and the size of a cause mean the same under each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator


@dataclass(frozen=True)
class Scatter:
    """``draw(random, n)`` gives independent numbers of unit variance; ``correlation(n)`` the correlation at 0 to n - 1
    touches apart. ``step_um`` is the step of the display, ``stated`` the share of its certificate's uncertainty that
    the gauge file admits. ``information`` is Fisher's about a shift of one reading, in units of a normal one's.
    """

    name: str
    draw: Callable[[Random, int], Array] = lambda random, n: random.normal(0.0, 1.0, n)
    correlation: Callable[[int], Array] | None = None
    step_um: float = 0.0
    stated: float = 1.0
    information: float = 1.0

    def sigma_um(self, plain_um: float) -> float:
        """Standard deviation of one reading whose noise before the display is ``plain_um``."""
        return float(np.hypot(plain_um, self.step_um / np.sqrt(12.0)))

    def noise_um(self, random: Random, scene: Scene) -> Array:
        """The scatter of all touches before the display, um, shape ``(n,)``."""
        white = self.draw(random, len(scene))
        if self.correlation is not None:
            white = np.linalg.cholesky(self.matrix(len(scene))) @ white
        return np.sqrt(scene.sigma_um**2 - self.step_um**2 / 12.0) * white

    def matrix(self, n: int) -> Array:
        """Correlations of ``n`` touches, shape ``(n, n)``."""
        if self.correlation is None:
            return np.eye(n)
        apart = np.abs(np.arange(n)[:, None] - np.arange(n))
        return np.asarray(self.correlation(n)[apart] + 1e-9 * (apart == 0))


def _student(random: Random, n: int) -> Array:
    """Student's t of 4 degrees of freedom; its variance is 2."""
    return random.standard_t(4.0, n) / np.sqrt(2.0)


def _skewed(random: Random, n: int) -> Array:
    """Gamma of shape 3 about its mean: skewness 1.15, late triggers go farther than early ones."""
    return (random.gamma(3.0, 1.0, n) - 3.0) / np.sqrt(3.0)


def _first_order(kept: float, n: int) -> Array:
    """AR(1): every touch keeps this share of the last one's deviation."""
    return np.asarray(kept ** np.arange(n), float)


def _flicker(n: int) -> Array:
    """Power over frequency 1/f from one swing in four recordings up to half the rhythm of the touches."""
    power = np.r_[0.0, 1.0 / np.arange(1, 2 * n + 1)]
    at = np.fft.irfft(power)[:n]
    return np.asarray(at / at[0])


IDEAL = Scatter("normal")
NOT_IDEAL = (
    Scatter("student_t", _student, information=10.0 / 7.0),
    Scatter("skewed", _skewed, information=3.0),
    Scatter("rounded_0.5", step_um=0.5),
    Scatter("rounded_1", step_um=1.0),
    Scatter("ar1_0.6", correlation=partial(_first_order, 0.6)),
    Scatter("ar1_0.9", correlation=partial(_first_order, 0.9)),
    Scatter("flicker", correlation=_flicker),
    Scatter("certificate_half", stated=0.5),
)
SCATTERS = {scatter.name: scatter for scatter in (IDEAL, *NOT_IDEAL)}
CORRELATED = tuple(scatter.name for scatter in NOT_IDEAL if scatter.correlation is not None)
"""Under these an answer may say that the scatter follows the order of the touches."""

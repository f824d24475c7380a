"""Random functions of a covariate: names of their shapes, before and after the choice of the side on which they act."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Refined

Features = Sequence[Array] | Array | NDArray[np.float32]
"""Features of each kernel, ``(m, n)`` each, or signatures of each shape, ``(atoms, d, n)``."""
TREND, SMOOTH, ROUGH, LAGGED, WAVE = "trend", "smooth", "rough", "lagged", "wave"
LENGTH, LEVELS, LOOP, HARMONICS, BEAT = "changing length", "levels", "loop", "harmonics", "beat"
SAWTOOTH, HYSTERESIS, RESTS = "sawtooth", "hysteresis", "memory of rests"
PERIODIC = (WAVE, SAWTOOTH)
MEMORIES = (LAGGED, RESTS, HYSTERESIS)
WANDERING = ("time", "order")
DRIFTING = (*WANDERING, "cycle")


@dataclass(frozen=True)
class RandomFunction:
    """A random function of a covariate, as it is stated: ``shape``, side and kernels.

    ``kernels``: for each of its shapes ``trend``, ``smooth`` or ``rough``, or its numbers: a lag in s, a period;
    ``of``: from such numbers, of the grid or not, to the signature ``(d, n)``, before the share of each row.
    """

    covariate: str
    unit: str
    shape: str
    side: str
    kernels: tuple[object, ...]
    beside: str = ""
    of: Callable[[Any], Array] | None = field(default=None, compare=False)


@dataclass(frozen=True)
class RandomFunctionFeatures:
    """The features of a random function on all the sides on which it may act.

    ``share``: its prior odds over those of an ordinary one; ``refine``: the fit of its shape between those of the
    grid, as of a law, from its share in every row ``(n,)`` on; ``of``: as of :class:`RandomFunction`; ``unread``: from
    the numbers of a shape to what it may do beside its signature, ``(p, n)`` before the share of each row.
    """

    covariate: str
    unit: str
    shape: str
    features: Features
    kernels: tuple[object, ...]
    sides: tuple[str, ...]
    share: float = 1.0
    beside: str = ""
    refine: Callable[[Array, int, Array], Refined] | None = None
    of: Callable[[Any], Array] | None = None
    unread: Callable[[Any], Array] | None = None

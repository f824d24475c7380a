"""Random functions of a covariate, and names of their shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Refined

Features = Sequence[Array] | Array | NDArray[np.float32]
"""Features of each kernel, ``(m, n)`` each, or signatures of each shape, ``(atoms, d, n)``."""
TREND, SMOOTH, ROUGH, LAGGED, WAVE = "trend", "smooth", "rough", "lagged", "wave"
LENGTH, LEVELS, LOOP, HARMONICS, BEAT = "changing length", "levels", "loop", "harmonics", "beat"
SAWTOOTH, HYSTERESIS, RESTS = "sawtooth", "hysteresis", "memory of rests"
PERIODIC = (WAVE, SAWTOOTH)
WANDERING = ("time", "order")
DRIFTING = (*WANDERING, "cycle")


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

"""One row of the benchmark, and how rows are put together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.blind.cause import Cause
from benchmarks.blind.scene import Design, Scene

Random = np.random.Generator
Make = Callable[[Scene, Random], Cause]
SIZES = (1.0, 0.5, 0.3, 0.2)


@dataclass(frozen=True)
class Recipe:
    """One row of the benchmark: the causes to conceal and the measurements to choose from.

    ``whole_set`` are the kinds that a confounded answer must contain; ``forgiven`` kinds may be named in addition,
    ``not_named`` must not be listed. ``sizes`` are made unless others are asked for; ``nulls`` is the number of
    recordings of a recipe without causes, over the number asked for.
    """

    family: str
    name: str
    causes: tuple[Make, ...]
    designs: tuple[Design, ...]
    whole_set: tuple[str, ...] = ()
    forgiven: tuple[str, ...] = ()
    sizes: tuple[float, ...] = SIZES
    scatter: str = "normal"
    nulls: float = 1.0
    not_named: tuple[str, ...] = ()


def pick(make: Callable[..., Cause], *choices: object) -> Make:
    """The cause with one of several axes, planes or axis pairs, by the random numbers of the case."""

    def made(scene: Scene, random: Random) -> Cause:
        choice = choices[int(random.integers(len(choices)))]
        return make(scene, random, *choice) if isinstance(choice, tuple) else make(scene, random, choice)

    return made


def kits(*names: str, **settings: object) -> tuple[Design, ...]:
    """A design for each kit, all with the same settings."""
    return tuple(Design(name, **settings) for name in names)  # type: ignore[arg-type]

"""A concealed cause: what it does to the readings, as a function of how strong it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cause:
    """``displace(strength)`` gives the displacement of the indicated points, um, shape ``(n, 3)``.

    ``where`` is the axis, plane, axis pair or face ("" without). ``parameters(strength)`` are the numbers that a
    diagnosis may be held to, by the name and unit of the vocabulary. ``start`` is a strength of a sensible order;
    ``power`` how the displacement grows with it. ``radius_is_effect``: the part that looks like a wrong mean pre-travel
    belongs to this cause and counts towards its size. ``turns`` are the periods of those parameters that are angles.
    """

    kind: str
    displace: Callable[[float], Array]
    where: str = ""
    parameters: Callable[[float], dict[str, float]] = field(default=lambda strength: {})
    start: float = 1.0
    power: float = 1.0
    radius_is_effect: bool = False
    turns: dict[str, float] = field(default_factory=dict)

    @property
    def key(self) -> str:
        return f"{self.kind}:{self.where}" if self.where else self.kind


def along(scene: Scene, displacement_um: Array) -> Array:
    """The part along the approach, um, shape ``(n,)``."""
    return np.einsum("ij,ij->i", displacement_um, scene.approach)


def on_axis(scene: Scene, axis: int, um: Array) -> Array:
    """A displacement of one machine axis only."""
    displacement = np.zeros((len(scene), 3))
    displacement[:, axis] = um
    return displacement


def nuisances(scene: Scene, *, radius: bool) -> Array:
    """Columns of what is no finding: the unknown origin of every placing, and the constant pre-travel if ``radius``."""
    columns = [scene.side * (scene.placement == place) for place in np.unique(scene.placement)]
    return np.column_stack([*columns, np.ones(len(scene))] if radius else columns)


def without(columns: Array, values: Array) -> Array:
    """``values`` less their least-squares part in ``columns``."""
    return values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]


def size(scene: Scene, cause: Cause, strength: float) -> float:
    """Rms of the cause along the approach, less what is nuisance, over the noise of one probing."""
    left = without(nuisances(scene, radius=not cause.radius_is_effect), along(scene, cause.displace(strength)))
    return float(np.sqrt(np.mean(left**2)) / scene.sigma_um)


def strength_for(scene: Scene, cause: Cause, wanted: float) -> float:
    """The strength at which the cause has the wanted size to 0.1 %; ``ValueError`` where it cannot be seen at all."""
    strength = cause.start
    for _ in range(60):
        now = size(scene, cause, strength)
        if now < 1e-9:
            raise ValueError(f"{cause.key} is invisible in this measurement")
        if abs(now / wanted - 1.0) < 1e-3:
            return strength
        strength *= float(np.clip((wanted / now) ** (1.0 / cause.power), 0.1, 10.0))
    raise ValueError(f"{cause.key} does not reach size {wanted}")

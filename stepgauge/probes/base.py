"""The interface of all probes, and the two models without mechanics.

Frames and signs
----------------
The input of a probe are *approaches*: unit vectors (n, 3) in machine axes, of travel towards the surface. They are
converted to contact normals in the frame of the probe, whose z axis is the stylus axis from tip to body; with the tip
down its axes are those of the machine. The polar angle of a normal is counted from z: 90 deg is a wall parallel to the
stylus, 0 a horizontal surface under it. Its azimuth is counted from x towards y; an approach along machine +x therefore
has the normal azimuth 180 deg. For another stylus direction, x of the probe is machine x made perpendicular to the
stylus (machine y for a stylus along x), then rotated about the stylus by the roll.

Pre-travel is positive: the machine travels by it towards the surface from contact to trigger, so that the recorded tip
centre is contact - r p + w p for an approach p.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.files.arrays import Array
from stepgauge.physics.directions import probe_frame

HANGING = (0.0, 0.0, -1.0)

# Sine of the polar angle below which a direction along the stylus has no azimuth.
_ON_AXIS = 1e-6


def head_frame(stylus_direction: Sequence[float] = HANGING, roll_rad: float = 0.0) -> Array:
    """Rows x, y, z of the probe's frame in machine axes, (3, 3); ``stylus_direction`` points from body to tip."""
    frame = probe_frame([-component for component in stylus_direction])
    cos, sin = np.cos(roll_rad), np.sin(roll_rad)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ frame


@dataclass(frozen=True, kw_only=True)
class Probe(ABC):
    """A probe with a tip in some orientation.

    Attributes
    ----------
    tip_radius_mm : true radius of the tip ball
    name : for reports
    frame : (3, 3) rows of the probe's axes in machine axes, from :func:`head_frame`
    stylus_length_mm : tip centre to probe body, None where the file does not say
    """

    tip_radius_mm: float
    name: str = ""
    frame: Array = field(default_factory=head_frame)
    stylus_length_mm: float | None = None

    @abstractmethod
    def pretravel_um(self, approach: ArrayLike) -> Array:
        """Travel of the machine from contact to trigger, (...), for approaches (..., 3) in machine axes.

        ``inf`` where the probe never triggers (a kinematic probe whose stylus is pulled out of its seat).
        """

    def trigger_force_N(self, approach: ArrayLike) -> Array:
        """Force on the tip at the trigger, (...); NaN if the model has no forces."""
        return np.full(np.shape(approach)[:-1], np.nan)

    def deflection_um(self, approach: ArrayLike) -> Array:
        """Lateral deflection of the tip at the trigger, (...) (Rodrigues' sensing distance).

        NaN if the model has no deflection.
        """
        return np.full(np.shape(approach)[:-1], np.nan)

    def normals(self, approach: ArrayLike) -> Array:
        """Contact normals (..., 3) in the probe's frame."""
        return -np.asarray(approach, dtype=float) @ self.frame.T

    def approaches(self, normal: ArrayLike) -> Array:
        """Approaches (..., 3) in machine axes of contact normals in the probe's frame."""
        return -np.asarray(normal, dtype=float) @ self.frame

    @property
    def down(self) -> Array:
        """Direction of gravity (machine -z) in the probe's frame, (3,)."""
        return -self.frame[:, 2]


@dataclass(frozen=True, kw_only=True)
class ConstantProbe(Probe):
    """The same pre-travel in all directions."""

    constant_um: float

    def pretravel_um(self, approach: ArrayLike) -> Array:
        return np.full(np.shape(approach)[:-1], self.constant_um)


@dataclass(frozen=True, kw_only=True)
class LobedProbe(Probe):
    """Mean plus three lobes, w = mean + amplitude cos(3 (azimuth - phase)).

    The azimuth is that of the *approach* in the probe's frame. Along the stylus there is no azimuth: there it is the
    mean. Same law and signs as the effect ``probe_lobing``.
    """

    mean_um: float
    amplitude_um: float
    phase_rad: float = 0.0

    def pretravel_um(self, approach: ArrayLike) -> Array:
        along = -self.normals(approach)
        azimuth = np.arctan2(along[..., 1], along[..., 0])
        lobes = np.cos(3.0 * (azimuth - self.phase_rad))
        has_azimuth = np.hypot(along[..., 0], along[..., 1]) > _ON_AXIS
        return self.mean_um + self.amplitude_um * np.where(has_azimuth, lobes, 0.0)

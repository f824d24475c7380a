"""Coordinate systems of I++ DME: machine coordinates into those of a part, and back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError

LARGEST_MM = 1e6


@dataclass(frozen=True)
class Transformation:
    """``part = rotation @ machine + origin_mm``; ``numbers`` are X0, Y0, Z0, Theta, Psi, Phi (mm, deg) as given."""

    numbers: tuple[float, ...] = (0.0,) * 6
    rotation: Array = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of(cls, numbers: list[float]) -> Transformation:
        """From the six numbers of the standard: the machine's origin in part coordinates, and three Euler angles.

        The specification leaves open how the angles are used; here they are z-x-z, R = Rz(phi) Rx(theta) Rz(psi), as
        its range for theta alone (0 to 180 deg, else error 1007) suggests.
        """
        if max(map(abs, numbers)) > LARGEST_MM:
            raise DmeError(509)
        theta, psi, phi = np.radians(numbers[3:])
        if not 0.0 <= theta <= np.pi:
            raise DmeError(1007)
        return cls(tuple(numbers), _about_z(phi) @ _about_x(theta) @ _about_z(psi))

    @property
    def origin_mm(self) -> Array:
        """Where the machine's origin lies in the part's coordinates, (3,) in mm."""
        return np.array(self.numbers[:3])

    def to_part(self, machine_mm: Array) -> Array:
        """A position in the part's coordinates, mm."""
        return self.rotation @ machine_mm + self.origin_mm

    def to_machine(self, part_mm: Array) -> Array:
        """A position in machine coordinates, mm."""
        return self.rotation.T @ (part_mm - self.origin_mm)


def _about_z(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]])


@dataclass
class Coordinates:
    """The selected coordinate system and all that were defined; a system that was not is that of the machine."""

    selected: str = "MachineCsy"
    defined: dict[str, Transformation] = field(default_factory=dict)

    @property
    def current(self) -> Transformation | None:
        """The transformation that holds; None in machine coordinates."""
        return self.defined.get(self.selected)

    def to_machine(self, position_mm: Array) -> Array:
        """A position of a command in machine coordinates, mm."""
        return position_mm if self.current is None else self.current.to_machine(position_mm)

    def to_part(self, machine_mm: Array) -> Array:
        """A position of the machine as it is answered, mm."""
        return machine_mm if self.current is None else self.current.to_part(machine_mm)

    def direction_to_machine(self, vector: Array) -> Array:
        """A direction of a command in machine axes."""
        return vector if self.current is None else self.current.rotation.T @ vector

    def direction_to_part(self, vector: Array) -> Array:
        """A direction of the machine as it is answered."""
        return vector if self.current is None else self.current.rotation @ vector

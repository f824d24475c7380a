"""Displacement of the indication by an error motion of one axis: a translation directly, a rotation with its arm.

The sign is that of the indication. Where an axis carries the probe, its carriage has moved or rotated in the opposite
direction; where it carries the table, in the same one. So one value has the same influence in every chain, but for the
arm.
"""

from __future__ import annotations

from typing import Any, Literal

from stepgauge.effects.base import Displacement, parameter
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Array
from stepgauge.files.config import Vector3

NEXT = {"x": "y", "y": "z", "z": "x"}
"""Right-handed order: e_a x e_NEXT[a] is the third axis."""
UNSTATED: Vector3 = (0.0, 0.0, 0.0)
Component = Literal["x", "y", "z", "rx", "ry", "rz"]
COMPONENTS = "displacement along x, y, z (um) or rotation about them, rx, ry, rz (urad)"


def reference_point() -> Any:
    """The parameter of every rotation: its fixed point."""
    meaning = "a point of the line of the scale, machine coordinates; without it that of the machine's chain, or zero"
    return parameter(None, unit="mm", role="fixed", meaning=meaning)


def um_or_mrad(amount: Array, component: str) -> Array:
    """A translation in um unchanged, a rotation in urad as mrad (mrad times mm are um)."""
    return amount if len(component) == 1 else amount * 1e-3


def moved(
    probings: Probings, travel: str, component: str, amount: Array, reference_mm: Vector3 | None = None
) -> Displacement:
    """Displacement in um by an error motion of the axis ``travel``.

    ``component`` x, y, z: a translation, ``amount`` in um; rx, ry, rz: a rotation, ``amount`` in mrad, about the
    carriage's reference point (``reference_mm`` in its place: machine coordinates).
    """
    if len(component) == 1:
        return {component: amount}
    rotation = component[1]
    second = NEXT[rotation]
    third = NEXT[second]
    displaced: Displacement = {}
    for to, of, sign in ((third, second, 1.0), (second, third, -1.0)):  # e x arm, with (rotation, second, third) ahead
        arm = arm_mm(probings, travel, of, reference_mm)
        if arm is not None:
            displaced[to] = amount * (sign * arm)
    return displaced


def arm_mm(probings: Probings, travel: str, component: str, reference_mm: Vector3 | None) -> Array | float | None:
    """One component of the arm from a rotating carriage to the tip, mm; None where there is none.

    Without a stated chain the carriage is assumed to move with its own axis only: the arm is from the reference point
    to the tip, without the component along the travel.
    """
    chain = probings.setting.chain
    if chain is None:
        at = UNSTATED if reference_mm is None else reference_mm
        return None if component == travel else probings.coordinate_mm(component) - at["xyz".index(component)]
    rest = chain.rest_arm_mm(travel, component, reference_mm)
    return probings.axis_mm(component) + rest if component in chain.beyond(travel) else rest or None

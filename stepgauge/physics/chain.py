"""The chain of axes of a machine: which bodies rotate with a carriage, and about which point.

A chain runs from the workpiece over the axes that carry the table to the base, and on over those that carry the probe
to the tip. Each axis is a joint between two bodies; its *carriage* is the one farther from the base. A point that
belongs to a carriage keeps its distance from it; the tip moves away from it by the travel of every joint that lies
between that carriage and the tip. So, to first order in the errors, a rotation e of the carriage of axis a displaces
the indication of the tip by e x arm with

    arm_c = u_c (if the joint c lies between the carriage of a and the tip, else 0) + tip_c - reference_ac,

where u are the coordinates of the axes. The derivation is in docs/virtual-cmm.md.

Sources: G. Zhang, R. Veale, T. Charlton, B. Borchardt, R. Hocken, Error compensation of coordinate measuring machines,
CIRP Annals 34 (1985) 445; the axes' order as in the structural codes of ISO 230-1:2012 and ISO 10791-6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Vector = tuple[float, float, float]
_ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Chain:
    """Three axes between a workpiece and a tip.

    Attributes
    ----------
    table, probe : names of the axes that carry the table and of those that carry the probe, from the base outward
    reference_mm : by axis, the point of its carriage whose motion its positioning and straightness errors describe,
        with all axes at 0; from the point that the scales measure
    tip_mm : tip centre from the point that the scales measure (the position of which is the coordinates of the axes)
    """

    table: str = ""
    probe: str = ""
    reference_mm: Mapping[str, Vector] = field(default_factory=dict)
    tip_mm: Vector = _ZERO

    def __post_init__(self) -> None:
        if sorted(self.table + self.probe) != ["x", "y", "z"]:
            raise ValueError("each of the axes x, y and z once, in the table's or the probe's part of the chain")

    def beyond(self, axis: str) -> str:
        """The joints between the carriage of an axis and the tip, in the order of the chain.

        The carriage of an axis of the probe comes after its joint, that of an axis of the table before it.
        """
        joints = self.table[::-1] + self.probe
        return joints[joints.index(axis) + (axis in self.probe) :]

    def rest_arm_mm(self, axis: str, component: str, reference_mm: Vector | None = None) -> float:
        """One component of the arm from the carriage's reference point to the tip with all axes at 0.

        ``reference_mm``: a point of the carriage in place of that of the chain.
        """
        i = "xyz".index(component)
        reference = self.reference_mm.get(axis, _ZERO) if reference_mm is None else reference_mm
        return self.tip_mm[i] - reference[i]

"""The measuring positions of ISO 10360-2 with the lengths that were tested in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepgauge.conditions import NOTHING, Conditions, gate
from stepgauge.conditions.decision import Outcome, conformity_probability, decide
from stepgauge.files.arrays import Array
from stepgauge.standards.length_uncertainty import TestUncertainty
from stepgauge.standards.lengths import Faces, Kind, LengthReadings
from stepgauge.standards.measuring_line import DIAGONALS, SAME_DIRECTION_DEG


@dataclass(frozen=True)
class TestLength:
    """One length in one position: ``error_um`` has one entry per repeat (``cycles``)."""

    __test__ = False

    position: int
    kind: Kind
    faces: Faces
    nominal_mm: float
    length_mm: float
    cycles: tuple[int, ...]
    error_um: Array
    mpe_um: float
    uncertainty: TestUncertainty
    expanded_um: float
    conditions: Conditions = NOTHING

    @property
    def outcomes(self) -> list[Outcome | None]:
        """The decision on each repeat; None of a unidirectional length, which E0,MPE is no limit of."""
        if self.kind == "unidirectional":
            return [None] * len(self.error_um)
        missing = self.uncertainty.missing
        decided = (decide(float(error), self.mpe_um, self.expanded_um, missing) for error in self.error_um)
        conditions = self.conditions.weighed(self.expanded_um)
        return [gate(conditions, one) for one in decided]

    @property
    def conformity_probability(self) -> float | None:
        """Of the worst repeat, by JCGM 106; None where nothing is decided, or U lacks contributions."""
        if self.kind == "unidirectional" or self.uncertainty.missing or self.conditions.preventing:
            return None
        u_um = self.uncertainty.standard_um
        return min(conformity_probability(float(error), self.mpe_um, u_um) for error in self.error_um)

    @property
    def range_um(self) -> float:
        """Repeatability range: largest minus smallest error of the repeats; NaN with a single one."""
        return float(np.ptp(self.error_um)) if len(self.error_um) > 1 else float("nan")


@dataclass(frozen=True)
class Position:
    """One placement as a measuring position; what needs the machine's travel is None without it.

    ``line_mm``: travel along the measured line; ``orientation``: the nearest of the standard's seven, ``off_deg`` away.
    """

    number: int
    table: LengthReadings
    lengths: tuple[TestLength, ...]
    orientation: str | None = None
    orientation_number: int | None = None
    off_deg: float | None = None
    line_mm: float | None = None

    @property
    def mandatory(self) -> bool | None:
        """Whether it lies along a body diagonal, which the standard demands; None without the machine's travel."""
        if self.orientation_number is None or self.off_deg is None:
            return None
        return self.orientation_number <= DIAGONALS and self.off_deg <= SAME_DIRECTION_DEG

    def longest_mm(self) -> float:
        """The longest nominal test length, mm; 0 without any."""
        return max((one.nominal_mm for one in self.lengths), default=0.0)

    def select_kind(self, kind: Kind) -> list[TestLength]:
        """The lengths of one kind, shortest first."""
        return [one for one in self.lengths if one.kind == kind]

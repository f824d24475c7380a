"""ISO 10360-2: errors of length measurement, their repeatability range, and whether they keep the permissible error.

Seven positions, five lengths each, three repeats: 105 errors E0 of bidirectional lengths. Further series use the same
equations: E150 with the stylus offset, and the length of normal expansion beside a gauge of low expansion. Certified
positions are brought to the recorded gauge temperature; readings are left as they are (the convention of
:mod:`stepgauge.evaluation.evaluate`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stepgauge.conditions import Conditions, gate
from stepgauge.conditions.decision import Outcome, decide, together
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.recording import Recording
from stepgauge.recording.conventions import complete_by_machine
from stepgauge.recording.identity import check_recording
from stepgauge.standards.iso10360_positions import Position, TestLength
from stepgauge.standards.iso10360_rules import excluded_parts, rules_of
from stepgauge.standards.iso10360_series import E0, LengthSeries
from stepgauge.standards.length_uncertainty import TestConditions, length_uncertainty
from stepgauge.standards.lengths import (
    REPEATS,
    Faces,
    Kind,
    LengthReadings,
    candidates,
    choose,
    doubtful_rule,
    face_table,
    length_errors_um,
    nominal_length_mm,
)
from stepgauge.standards.measuring_line import line_length_mm, orientation_of
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.rules import Excluded, Rule
from stepgauge.standards.tip import TipDiameter, tip_diameter

KINDS: tuple[Kind, Kind] = ("bidirectional", "unidirectional")
MOST_REMEASURED = 5
REMEASURE_SOURCE = (
    "ISO 10360-2:2009, compliance with specifications; how often, ten times or three, is unconfirmed: see the standard"
)


@dataclass(frozen=True)
class Specification:
    """What is tested against: the permissible error, and the limit of the repeatability range in um (None: none).

    ``also``: other standards that the same errors are judged by, too.
    """

    mpe: Mpe
    repeatability_um: float | None = None
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choices:
    """The tester's choices: a stated tip diameter in mm, the side of unidirectional lengths, nominal lengths in mm.

    ``normal_too``: a length of normal expansion is tested, too, as the standard asks beside a gauge of low expansion.
    """

    tip_diameter_mm: float | None = None
    side: Literal["fronts", "backs"] = "fronts"
    lengths_mm: tuple[float, ...] | None = None
    normal_too: bool = False


@dataclass(frozen=True)
class LengthTest:
    """The whole test. ``rules`` and ``excluded`` say what the standard asks and what was left out; ``stated``: what is
    known of its own uncertainty."""

    gauge: Gauge
    specification: Specification
    stated: TestConditions
    tip: TipDiameter | None
    positions: tuple[Position, ...]
    rules: tuple[Rule, ...]
    excluded: tuple[Excluded, ...]
    path: str = ""
    comments: Mapping[str, str] = field(default_factory=dict)
    series: LengthSeries = E0

    @property
    def conditions(self) -> Conditions:
        """Those of the readings in all positions, each once, beside the uncertainty of the longest length."""
        largest = max((one.expanded_um for position in self.positions for one in position.lengths), default=None)
        return sum((one.table.conditions for one in self.positions), Conditions()).weighed(largest)

    def lengths(self, kind: Kind) -> list[TestLength]:
        """All test lengths of one kind."""
        return [one for position in self.positions for one in position.select_kind(kind)]

    def outcome(self, kind: Kind) -> Outcome | None:
        """The decision on all errors of one kind; None where there are none, or no limit is for them."""
        every = [outcome for one in self.lengths(kind) for outcome in one.outcomes if outcome is not None]
        return together(every) if every else None

    def repeatability_outcome(self, kind: Kind) -> Outcome | None:
        """The decision on the repeatability ranges; None without a limit or repeats, and of unidirectional lengths.

        What makes a test value uncertain is the same in all repeats of a length, so nothing but the rounding of
        readings with coarse steps is subtracted from the limit.
        """
        ranges = [one.range_um for one in self.lengths(kind) if np.isfinite(one.range_um)]
        limit = self.specification.repeatability_um
        if limit is None or not ranges or kind == "unidirectional":
            return None
        return gate(self.conditions, decide(max(ranges), limit, self._range_expanded_um))

    @property
    def _range_expanded_um(self) -> float:
        """U (k = 2) of a range from the rounding of its four readings, each by half a step at most (GUM F.2.2.1)."""
        coarse = [one.size_um or 0.0 for one in self.conditions.of("resolution") if one.state != "met"]
        return 2.0 * math.sqrt(4.0 / 3.0) * max(coarse, default=0.0)

    def remeasure(self, kind: Kind) -> list[TestLength]:
        """Lengths whose single error outside the conformance zone the standard lets be measured again.

        Allowed for at most five lengths with one such repeat each; else, and where U lacks contributions or nothing is
        decided, the list is empty.
        """
        if self.missing or self.outcome(kind) is None:
            return []
        outside = {id(one): sum(o != "conforms" for o in one.outcomes) for one in self.lengths(kind)}
        again = [one for one in self.lengths(kind) if outside[id(one)]]
        single = all(outside[id(one)] == 1 and len(one.error_um) >= REPEATS for one in again)
        return again if single and len(again) <= MOST_REMEASURED else []

    @property
    def complete(self) -> bool:
        """Whether every rule of the test is met."""
        return all(rule.met for rule in self.rules)

    @property
    def missing(self) -> list[str]:
        """Contributions to the test value uncertainty that were not evaluated."""
        names: dict[str, None] = {}
        for kind in KINDS:
            for one in self.lengths(kind):
                names.update(dict.fromkeys(one.uncertainty.missing))
        return list(names)


def length_test(
    recording: Recording,
    gauge: Gauge,
    specification: Specification,
    conditions: TestConditions | None = None,
    choices: Choices | None = None,
    machine: Machine | None = None,
    placements: Sequence[Placement] = (),
    series: LengthSeries = E0,
) -> LengthTest:
    """Test of the errors of length measurement with a step gauge (ISO 10360-2:2009, clause 6).

    Parameters
    ----------
    recording : every placement of the gauge is a measuring position, every cycle a repeat
    gauge : the certificate
    specification : permissible errors
    conditions : what is known of the test's own uncertainty
    choices : tip diameter and lengths
    machine : its travel tells which positions were measured, and how long they should be
    placements : where the gauge lay, in order; default: the axis is the mean approach
    series : which of the standard's series of lengths the recording is

    Raises
    ------
    InputError
        a recording of another gauge, one position given twice, faces probed twice in a cycle, a tip diameter that is
        not this tip's, no length at all. Too few positions, lengths or repeats are no error: the rules say what is
        incomplete.
    """
    recording = complete_by_machine(recording, machine.table if machine else None)
    check_recording(recording, gauge)
    numbers = recording.placements
    if placements and len(placements) != len(numbers):
        raise InputError(
            recording.path, "one placement file per position", found=len(placements), expected=f"{len(numbers)} or none"
        )
    conditions, choices = conditions or TestConditions(), choices or Choices()
    tip = tip_diameter(recording, gauge, placements, choices.tip_diameter_mm, conditions.tip_diameter_u_um)
    used = numbers[: series.positions]
    lies: Sequence[Placement | None] = placements or [None] * len(used)
    maker = _PositionMaker(gauge, specification, conditions, choices, tip, machine)
    tables = [face_table(recording, gauge, number, place) for number, place in zip(used, lies, strict=False)]
    positions = tuple(maker.position(table) for table in tables)
    if not any(position.lengths for position in positions):
        raise InputError(recording.path, "no length was measured", expected="at least two blocks with the same faces")
    return LengthTest(
        gauge,
        specification,
        conditions,
        tip,
        positions,
        rules_of(series, positions, numbers, gauge, tip, machine, choices.normal_too)
        + doubtful_rule(tables, REMEASURE_SOURCE),
        excluded_parts(series, positions, numbers, tip),
        recording.path,
        recording.comments,
        series,
    )


@dataclass(frozen=True)
class _PositionMaker:
    gauge: Gauge
    specification: Specification
    conditions: TestConditions
    choices: Choices
    tip: TipDiameter | None
    machine: Machine | None

    def position(self, table: LengthReadings) -> Position:
        """The lengths of one position of the gauge, of each kind that can be judged."""
        lengths = tuple(
            self._length(table, kind, faces)
            for kind in KINDS
            if kind == "unidirectional" or self.tip is not None
            for faces in choose(candidates(table, kind, self.choices.side), self.gauge, self._wanted(kind))
        )
        if self.machine is None:
            return Position(table.placement, table, lengths)
        nearest, off_deg = orientation_of(table.axis, self.machine.travel_mm)
        line = line_length_mm(table.point_mm, table.axis, self.machine.travel_mm)
        return Position(table.placement, table, lengths, nearest.name, nearest.number, off_deg, line)

    def _wanted(self, kind: Kind) -> tuple[float, ...] | None:
        """The tester's lengths are bidirectional ones; unidirectional lengths are shorter by a block or as long."""
        return self.choices.lengths_mm if kind == "bidirectional" else None

    def _length(self, table: LengthReadings, kind: Kind, faces: Faces) -> TestLength:
        cycles = table.repeats(faces)[:REPEATS]
        nominal = nominal_length_mm(self.gauge, faces)
        tip_mm = self.tip.diameter_mm if self.tip else 0.0
        tip_u = self.tip.u_um if self.tip and kind == "bidirectional" else None
        sure = length_uncertainty(self.gauge, faces, table.temperature_C, self.conditions, tip_u)
        return TestLength(
            table.placement,
            kind,
            faces,
            nominal,
            float(self.gauge.position_mm[faces[1] - 1] - self.gauge.position_mm[faces[0] - 1]),
            tuple(int(cycle) for cycle in cycles),
            length_errors_um(table, faces, cycles, tip_mm),
            float(self.specification.mpe.at_um(nominal)),
            sure,
            self.conditions.coverage_factor * sure.standard_um,
            table.conditions,
        )

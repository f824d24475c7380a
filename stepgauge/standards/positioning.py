"""A recording of a step gauge as positioning of an axis: target positions, runs and deviations for ISO 230-2.

Assumptions. A face can be probed from one side only, so no face is approached in both directions. The middle of each
block is a target: its front face gives the approach in the positive direction; its back face, minus the tip diameter,
that in the negative direction. The means are interpolated linearly from the faces to the middle of the block between
neighbouring faces of one side; the scatter of each face is not changed.

Sign. The deviation of the standard is actual minus target position. The indicated position is the target, the certified
position the actual one: the deviation is certified minus indicated position, the negative of the error XF or XB of
``evaluate``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions import NOTHING, Conditions
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.notation import decimals
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.recording import Recording
from stepgauge.recording.conventions import Convention, complete_by_machine, convention_of
from stepgauge.recording.identity import check_recording
from stepgauge.standards.iso230 import AxisParameters, Parameters, axis_parameters
from stepgauge.standards.iso230_decision import NO_REQUIREMENT, Requirement
from stepgauge.standards.iso230_rules import Thermal, rules_of
from stepgauge.standards.lengths import LengthReadings, doubtful_rule, face_table, nearest_axis
from stepgauge.standards.rules import Excluded, Rule
from stepgauge.standards.tip import TipDiameter, tip_diameter

Counts = NDArray[np.int64]
Pairing = Literal["middle", "faces"]
ALONG_AXIS_DEG = 1.0
"""A gauge turned more than this from every axis moves several of them."""
PAIRINGS = {
    "middle": "means carried from the faces to the middle of the block, along straight lines between faces of one side",
    "faces": "front and back of a block taken as one target, a block apart as they are",
}


@dataclass(frozen=True)
class Units:
    """What lengths and deviations of an axis are told in, in keys and in print, and with how many decimals."""

    position: str
    deviation: str
    position_symbol: str
    deviation_symbol: str
    position_decimals: int = 3
    deviation_decimals: int = 2

    def fine_enough(self, travel: float, deviation: float) -> Units:
        """With three significant digits of the largest deviation, and a thousandth of the travel, or more."""
        position, of_deviation = (decimals(one, 3) for one in (travel, deviation))
        return replace(
            self,
            position_decimals=max(self.position_decimals, position + 1),
            deviation_decimals=max(self.deviation_decimals, of_deviation),
        )

    def deviation_text(self, value: float) -> str:
        """A deviation with its unit, as messages have it."""
        return f"{value:.{self.deviation_decimals}f} {self.deviation}"

    def printed(self, value: float) -> str:
        """A deviation with its symbol, as figures have it."""
        return f"{value:.{self.deviation_decimals}f} {self.deviation_symbol}"


LINEAR, ROTARY = Units("mm", "um", "mm", "µm"), Units("deg", "arcsec", "°", "arcsec")


@dataclass(frozen=True)
class TargetPositions:
    """Target positions of one placement, in the order of the axis.

    ``block (m,)``; ``gauge_mm (m,)``: middle of the block along the gauge; ``machine_mm (m,)``: its machine coordinate
    on the axis (on the nearest one, where several move).
    """

    block: Counts
    gauge_mm: Array
    machine_mm: Array


@dataclass(frozen=True)
class AxisTest:
    """Positioning of one axis from one placement.

    ``axis``: x, y or z, None where several axes move (of an instrument: its name, as ``title``); ``off_deg``: angle
    of the gauge to the nearest axis; ``reversed``: whether the gauge runs against the (nearest) axis, its backs then
    being touched on the way up.
    """

    placement: int
    axis: str | None
    nearest: str
    off_deg: float
    reversed: bool
    targets: TargetPositions
    runs: tuple[int, ...]
    parameters: Parameters
    temperature_C: float | None
    travel_mm: float | None
    rules: tuple[Rule, ...]
    excluded: tuple[Excluded, ...]
    title: str = ""
    units: Units = LINEAR
    conditions: Conditions = NOTHING

    @property
    def name(self) -> str:
        """How the axis is called in a title."""
        return self.title or f"axis {self.axis}" if self.axis else f"line near {self.nearest} (several axes move)"


@dataclass(frozen=True)
class PositioningTest:
    """Positioning from all placements of a recording.

    ``gauge``, ``tip``, ``pairing``: None where an instrument read the axis; ``instrument`` then says what it was, what
    its targets were, and the sign. ``further``: other standards that the deviations are evaluated by, too.
    """

    gauge: Gauge | None
    tip: TipDiameter | None
    pairing: Pairing | None
    axes: tuple[AxisTest, ...]
    path: str = ""
    comments: Mapping[str, str] = field(default_factory=dict)
    requirement: Requirement = NO_REQUIREMENT
    instrument: Mapping[str, str] = field(default_factory=dict)
    further: tuple[str, ...] = ()

    @property
    def conditions(self) -> Conditions:
        """Those of the readings of all axes, each once."""
        return sum((one.conditions for one in self.axes), Conditions())

    @property
    def units(self) -> Units:
        """What the axes are told in: all are linear or all rotary."""
        return self.axes[0].units

    @property
    def complete(self) -> bool:
        """Whether every rule is met for every axis."""
        return all(rule.met for one in self.axes for rule in one.rules)


def positioning_test(
    recording: Recording,
    gauge: Gauge,
    tip_diameter_mm: float | None = None,
    pairing: Pairing = "middle",
    machine: Machine | None = None,
    placements: Sequence[Placement] = (),
    requirement: Requirement = NO_REQUIREMENT,
) -> PositioningTest:
    """Accuracy and repeatability of positioning from a recording of a step gauge (ISO 230-2).

    Parameters
    ----------
    recording : every placement is an axis, every cycle a run
    gauge : the certificate
    tip_diameter_mm : effective tip diameter; default: from the gauge's own first block, whose reversal is then zero
    pairing : how front and back of a block become one target, see :data:`PAIRINGS`
    machine : its travel tells how much of the axis was measured
    placements : where the gauge lay, in order; default: the axis is the mean approach
    requirement : tolerances of the parameters, and their expanded uncertainty

    Raises
    ------
    InputError
        a recording of another gauge, a single run, no two complete blocks. Fewer runs or targets than the standard asks
        are no error: the rules say what is incomplete.
    """
    recording = complete_by_machine(recording, machine.table if machine else None)
    check_recording(recording, gauge)
    numbers = recording.placements
    if placements and len(placements) != len(numbers):
        raise InputError(
            recording.path, "one placement file per placement", found=len(placements), expected=len(numbers)
        )
    tip = tip_diameter(recording, gauge, placements, tip_diameter_mm)
    if tip is None:
        raise InputError(recording.path, "no block has both faces measured", expected="fronts and backs of the blocks")
    lies: Sequence[Placement | None] = placements or [None] * len(numbers)
    convention = convention_of(recording.comments, recording.path)
    axes = tuple(
        _axis_test(face_table(recording, gauge, number, place), gauge, tip, pairing, machine, convention)
        for number, place in zip(numbers, lies, strict=True)
    )
    conditions = sum((one.conditions for one in axes), Conditions())
    wanted = replace(requirement, conditions=conditions.weighed(requirement.expanded_um))
    return PositioningTest(gauge, tip, pairing, axes, recording.path, recording.comments, wanted)


def _axis_test(
    table: LengthReadings,
    gauge: Gauge,
    tip: TipDiameter,
    pairing: Pairing,
    machine: Machine | None,
    convention: Convention | None,
) -> AxisTest:
    blocks, runs = _complete(table)
    nearest, off_deg = nearest_axis(table.axis)
    along = off_deg <= ALONG_AXIS_DEG
    against = bool(table.axis[nearest] < 0.0)  # also where several axes move: the targets are told on the nearest one
    middle = gauge.block_centre_mm[blocks - 1]
    order = slice(None, None, -1 if against else 1)
    thermal = Thermal(table.temperature_C, table.scales_C, convention)
    return AxisTest(
        table.placement,
        "xyz"[nearest] if along else None,
        "xyz"[nearest],
        off_deg,
        against,
        TargetPositions(blocks[order], middle[order], _coordinates(table, middle, nearest)[order]),
        tuple(int(run) for run in runs),
        _deviations(*_errors_um(table, gauge, tip, pairing, blocks, runs), against),
        table.temperature_C,
        None if machine is None else float(np.ptp(machine.travel_mm[nearest])),
        rules_of(middle, len(runs), off_deg, ALONG_AXIS_DEG, tip, thermal)
        + doubtful_rule([table], "ISO 230-2, test procedure"),
        _excluded(table, blocks, runs),
        conditions=table.conditions,
    )


def _errors_um(
    table: LengthReadings, gauge: Gauge, tip: TipDiameter, pairing: Pairing, blocks: Counts, runs: Counts
) -> tuple[Array, Array]:
    """Indicated less certified position at the targets, from fronts and from backs, each ``(targets, runs)``."""
    front, back = (_readings(table, faces, runs) for faces in (2 * blocks - 1, 2 * blocks))
    zero_mm = front[0].mean()
    errors = (front - zero_mm) * 1e3, (back - zero_mm - tip.diameter_mm) * 1e3
    if pairing == "faces":
        return errors
    middle = gauge.block_centre_mm[blocks - 1]
    at_mm = gauge.position_mm[2 * blocks - 2], gauge.position_mm[2 * blocks - 1]
    front_um, back_um = (e + carry(e.mean(axis=1), at, middle)[:, None] for e, at in zip(errors, at_mm, strict=True))
    return front_um, back_um


def _coordinates(table: LengthReadings, along_mm: Array, axis: int) -> Array:
    """Coordinates on a machine axis of positions along the gauge: the mean tip centre is at the mean certified position
    (tips before fronts and behind backs cancel)."""
    mean_position = table.point_mm @ table.axis - np.nanmean(table.off_mm)
    return np.asarray(table.point_mm[axis] + (along_mm - mean_position) * table.axis[axis])


def _deviations(error_f: Array, error_b: Array, against: bool) -> AxisParameters:
    """Errors along the gauge as deviations of the axis: their negative, turned round where the gauge runs against."""
    if against:
        return axis_parameters(error_b[::-1], error_f[::-1])
    return axis_parameters(-error_f, -error_b)


def carry(mean: Array, at_mm: Array, to_mm: Array) -> Array:
    """What a mean changes from its face to the middle of its block, on straight lines between neighbours.

    All shapes ``(m,)``, m of two or more; beyond the last face of a side its last line goes on.
    """
    slope = np.diff(mean) / np.diff(at_mm)
    piece = np.clip(np.searchsorted(at_mm, to_mm) - 1, 0, len(slope) - 1)
    return slope[piece] * (to_mm - at_mm)


def _complete(table: LengthReadings) -> tuple[Counts, Counts]:
    """Blocks with both faces in every run that is used, and the runs: those with the most faces."""
    finite = np.isfinite(table.off_mm)
    runs = finite.sum(axis=1) == finite.sum(axis=1).max()
    full = table.faces[finite[runs].all(axis=0)]
    fronts = full[full % 2 == 1]
    blocks = (fronts[np.isin(fronts + 1, full)] + 1) // 2
    where = f"placement {table.placement}"
    if len(blocks) < 2:
        raise InputError(where, "no two blocks have both faces in every run", found=f"{len(blocks)}", expected="2")
    if runs.sum() < 2:
        expected = "2 runs at least (ISO 230-2 asks 5)"
        raise InputError(where, "too few runs for a standard deviation", found=f"{runs.sum()} run", expected=expected)
    return blocks, table.cycles[runs]


def _readings(table: LengthReadings, faces: Counts, runs: Counts) -> Array:
    """Readings ``(blocks, runs)`` less certified positions, mm."""
    rows = np.isin(table.cycles, runs)
    return np.array([table.face_readings(int(face))[rows] for face in faces])


def _excluded(table: LengthReadings, blocks: Counts, runs: Counts) -> tuple[Excluded, ...]:
    source = "ISO 230-2:2014 (each target in each run, in both directions)"
    parts = []
    cycles = [str(cycle) for cycle in table.cycles if cycle not in runs]
    if cycles:
        parts.append(Excluded(f"cycles {', '.join(cycles)}", "fewer faces than the other cycles", source))
    used = np.concatenate([2 * blocks - 1, 2 * blocks])
    faces = [str(face) for face in table.faces if face not in used]
    if faces:
        parts.append(
            Excluded(f"faces {', '.join(faces)}", "the other face of the block is missing in one of the runs", source)
        )
    return tuple(parts)

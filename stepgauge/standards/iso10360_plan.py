"""The seven positions of ISO 10360-2 for one gauge in one machine: where it lies, which blocks, which way the stylus.

A position is planned with the longest section of the gauge whose whole path keeps within the travel, centred on the
position's line. Five lengths of that section are measured: the shortest, the longest and three between.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.notation import percent
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import STANDING_COS, Placement, make_placement
from stepgauge.machine.file import Machine
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.check import check_program, check_travel
from stepgauge.planning.plan import PlanOptions, faces_in_order, make_program
from stepgauge.probes.schema import ProbeTable
from stepgauge.standards.lengths import LENGTHS, choose
from stepgauge.standards.measuring_line import LONGEST_SHARE, ORIENTATIONS, Orientation

Stylus = Literal["auto", "machine", "square"]
STANDING_UP = (0.0, -1.0, 0.0)
"""Where the blocks of a gauge that stands on end face: the front of a bridge CMM."""


@dataclass(frozen=True)
class PlannedPosition:
    """One position; ``program`` and what belongs to it are None where it cannot be measured.

    ``problem`` says in words what does not fit, and by how much; None where the position is as the standard asks.
    """

    orientation: Orientation
    line_mm: float
    problem: str | None = None
    placement: Placement | None = None
    blocks: tuple[int, ...] = ()
    program: Program | None = None
    probe: ProbeTable | None = None
    longest_mm: float = 0.0

    @property
    def share(self) -> float:
        """The longest length as a share of the machine's travel along the line."""
        return self.longest_mm / self.line_mm

    def tip_off_ram_mm(self) -> float:
        """How far the tip lies off a vertical ram that carries the probe: stylus and body turned with it, mm."""
        if self.probe is None:
            return 0.0
        level = float(np.hypot(*self.probe.stylus_direction[:2]))
        return level * (self.probe.shank_length_mm + self.probe.body_length_mm)

    def turned(self, machine: Machine) -> bool:
        """Whether the stylus stands another way than in the machine file."""
        return self.probe is not None and self.probe.stylus_direction != machine.probe.stylus_direction


def plan_positions(
    gauge: Gauge,
    machine: Machine,
    options: PlanOptions,
    settings: ProbingSettings,
    stylus: Stylus = "auto",
) -> list[PlannedPosition]:
    """Plan all seven positions, each checked against gauge, rail and travel.

    Parameters
    ----------
    gauge, machine : what is measured with what; the travel is that of the tip centre, whichever way the stylus points
    options : cycles, route and clearances; its blocks are chosen here
    settings : of the probing
    stylus : ``machine``: as in the machine file; ``square``: square to the gauge, from above the blocks; ``auto``: as
        in the machine file where that is clear of the gauge, else square

    Returns
    -------
    The positions in the standard's order; look at ``problem``.
    """
    return [_plan(one, gauge, machine, options, settings, stylus) for one in ORIENTATIONS]


def _plan(
    orientation: Orientation,
    gauge: Gauge,
    machine: Machine,
    options: PlanOptions,
    settings: ProbingSettings,
    stylus: Stylus,
) -> PlannedPosition:
    start, end = orientation.ends_mm(machine.travel_mm)
    line_mm = float(np.linalg.norm(end - start))
    reason = f"the gauge has {gauge.n_blocks} blocks"
    for last in range(gauge.n_blocks, LENGTHS, -1):
        blocks = chosen_blocks(gauge, last)
        placement = centred_placement(gauge, orientation, machine.travel_mm, last)
        choice = replace(options, first_block=1, last_block=last, only_blocks=blocks)
        program = make_program(placement, gauge, choice, settings)
        try:
            check_travel(program, machine)
        except InputError as error:
            reason = f"with blocks 1 to {last} {error.what}"
            continue
        try:
            probe = _clear_probe(program, placement, gauge, machine.probe, choice, stylus)
        except InputError as error:
            return PlannedPosition(orientation, line_mm, f"cannot be measured: {error}")
        longest = float(gauge.nominal_mm[2 * last - 1])
        problem = _too_short(longest, line_mm, reason)
        return PlannedPosition(orientation, line_mm, problem, placement, blocks, program, probe, longest)
    return PlannedPosition(orientation, line_mm, f"does not fit: {reason}")


def _too_short(longest_mm: float, line_mm: float, reason: str) -> str | None:
    asked = LONGEST_SHARE * line_mm
    if longest_mm >= asked:
        return None
    return (
        f"longest length {longest_mm:.1f} mm, asked {asked:.1f} mm ({percent(LONGEST_SHARE)} of {line_mm:.1f} mm):"
        f" short by {asked - longest_mm:.1f} mm; {reason}"
    )


def chosen_blocks(gauge: Gauge, last: int) -> tuple[int, ...]:
    """The first block and the five whose backs are the ends of the lengths, in a section from block 1 to ``last``."""
    pairs = [(1, 2 * block) for block in range(2, last + 1)]
    return (1, *(faces[1] // 2 for faces in choose(pairs, gauge)))


def centred_placement(gauge: Gauge, orientation: Orientation, travel_mm: Array, last: int) -> Placement:
    """The gauge along a position's line, the middle of blocks 1 to ``last`` in the middle of the line."""
    start, end = orientation.ends_mm(travel_mm)
    along = orientation.direction(travel_mm)
    face_1 = (start + end) / 2.0 - along * gauge.position_mm[2 * last - 1] / 2.0
    c1, c2 = (face_1 + along * gauge.block_centre_mm[block - 1] for block in (1, last))
    up = STANDING_UP if abs(along[2]) > STANDING_COS else None
    return make_placement(c1, c2, 1, last, up, gauge_serial=gauge.table.serial)


def _clear_probe(
    program: Program, placement: Placement, gauge: Gauge, probe: ProbeTable, options: PlanOptions, stylus: Stylus
) -> ProbeTable:
    """The probe, turned if need be, that is clear of the gauge on the whole path."""
    faces = [face for _, face in faces_in_order(options)]
    square = probe.model_copy(update={"stylus_direction": tuple(0.0 - float(v) for v in placement.up)})
    tries = {"auto": (probe, square), "machine": (probe,), "square": (square,)}[stylus]
    for last_try, one in zip((*[False] * (len(tries) - 1), True), tries, strict=True):
        try:
            check_program(program, faces, placement, gauge, make_tool(one), options.margin_mm)
            return one
        except InputError:
            if last_try:
                raise
    raise AssertionError("at least one way of the stylus is tried")

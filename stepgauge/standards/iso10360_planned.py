"""The seven planned positions of ISO 10360-2 as a result: what is said of them, their table, their files.

The seven positions of ISO 10360-2 for one gauge in one machine: where it lies, which blocks, which way the stylus.

A position is planned with the longest section of the gauge whose whole path keeps within the travel, centred on the
position's line. Five lengths of that section are measured: the shortest, the longest and three between.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stepgauge import __version__
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.display import join_lines
from stepgauge.files.notation import percent
from stepgauge.files.stored import WrittenResult
from stepgauge.files.text import write_json, write_sealed
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import STANDING_COS, Placement, format_placement, make_placement
from stepgauge.machine.file import Machine
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.check import check_program, check_travel
from stepgauge.planning.plan import PlanOptions, faces_in_order, make_program
from stepgauge.planning.program import check_tool, program_text
from stepgauge.probes.schema import ProbeTable
from stepgauge.standards.lengths import LENGTHS, choose
from stepgauge.standards.measuring_line import LONGEST_SHARE, ORIENTATIONS, POSITIONS_SOURCE, Orientation

if TYPE_CHECKING:
    import pandas as pd


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


@dataclass(frozen=True, repr=False)
class SevenPositions(WrittenResult):
    """Positions in the travel of a machine, each with what does not fit."""

    positions: tuple[PlannedPosition, ...]
    machine: Machine

    def check(self, allow_short: bool) -> None:
        """:class:`InputError` that names the positions along which the gauge is too short, or does not fit."""
        problems = [one for one in self.positions if one.problem]
        if not problems or allow_short:
            return
        numbers = ", ".join(str(one.orientation.number) for one in problems)
        words = f"ISO 10360-2 asks for longer lengths (positions {numbers}; {{}} writes the rest)"
        raise InputError(
            self.machine.path,
            naming("allow_short", words=words),
            found=f"position {problems[0].orientation.number}: {problems[0].problem}",
            expected=f"{percent(LONGEST_SHARE)} of the travel",
        )

    def summary(self) -> str:
        """Blocks and longest length of each position, and what is to be agreed on."""
        lines = [
            f"position {one.orientation.number}, {one.orientation.name}: {self._line(one)}" for one in self.positions
        ]
        turned = [one for one in self.positions if one.turned(self.machine)]
        if turned:
            off_mm = max(one.tip_off_ram_mm() for one in turned)
            lines.append(
                "ISO 10360-2 tests E0 with the stylus tip on the axis of the ram. Where the stylus is turned it lies"
                f" off it, here by up to {off_mm:.0f} mm with stylus and probe body:"
                " agree on it, or test with a stylus that is thin enough to stay upright (as in the machine file)"
            )
        programs = sum(one.program is not None for one in self.positions)
        lines.append(
            f"path of {programs} programs checked: gauge, rail, travel of the tip centre. Locate the gauge as it really"
            " lies, and plan it again with these blocks: a program moves to where its placement says"
        )
        return join_lines(*lines)

    def _line(self, one: PlannedPosition) -> str:
        if one.program is None or one.probe is None:
            return str(one.problem)
        blocks = ", ".join(map(str, one.blocks))
        line = f"blocks {blocks}; longest {one.longest_mm:.1f} mm, {percent(one.share)} of the travel"
        if one.turned(self.machine):
            line += "; stylus square to the gauge, (" + ", ".join(f"{v:.4f}" for v in one.probe.stylus_direction) + ")"
        return f"{line}; {one.problem}" if one.problem else line

    def to_frame(self) -> pd.DataFrame:
        """One row per position: number, name, length of the line and the longest measured one in mm, problem."""
        import pandas as pd

        rows = [
            (one.orientation.number, one.orientation.name, one.line_mm, one.longest_mm, one.problem)
            for one in self.positions
        ]
        return pd.DataFrame(rows, columns=["position", "orientation", "line_mm", "longest_mm", "problem"])

    def write(
        self,
        folder: str | Path,
        dialect: str,
        *,
        template: str | Path | None = None,
        tool: str = "",
        settings: Mapping[str, str] | None = None,
    ) -> list[str]:
        """Write placements, programs, machine files and ``plan.json``; returns notes on the programs."""
        check_tool(tool, dialect)
        named = [_named(one, tool) for one in self.positions]
        with self.keeping():
            return write_plan(folder, named, self.machine, dialect, template, settings)


def _named(one: PlannedPosition, tool: str) -> PlannedPosition:
    """The position with a program that says which tool it takes, and which way its stylus stands."""
    if one.program is None or one.probe is None:
        return one
    return replace(one, program=replace(one.program, tool=tool, stylus=one.probe.stylus_direction))


def write_plan(
    folder: str | Path,
    positions: list[PlannedPosition],
    machine: Machine,
    dialect: str,
    template: str | Path | None = None,
    options: Mapping[str, str] | None = None,
) -> list[str]:
    """Write placement, program and machine file of every planned position and ``plan.json``; returns notes.

    All programs are rendered and read back before the first file is written.
    """
    rendered = {
        one.orientation.number: program_text(one.program, dialect, template, options=options)
        for one in positions
        if one.program
    }
    for one in positions:
        if one.orientation.number not in rendered or one.placement is None or one.probe is None:
            continue
        text, name = rendered[one.orientation.number], Path(folder) / f"position-{one.orientation.number}"
        write_sealed(f"{name}.toml", placement_text(one))
        text.write(f"{name}{text.dialect.suffix}")
        write_sealed(f"{name}-machine.toml", machine_with_probe(machine, one.probe))
    write_json(Path(folder) / "plan.json", plan_to_dict(positions, machine))
    return list(dict.fromkeys(text.note for text in rendered.values()))


def plan_to_dict(positions: list[PlannedPosition], machine: Machine) -> dict[str, Any]:
    """The plan as JSON types."""
    return {
        "format": "stepgauge iso10360 plan 1",
        "stepgauge": __version__,
        "source": POSITIONS_SOURCE,
        "machine": machine.table.name,
        "positions": [_position(one) for one in positions],
    }


def _position(one: PlannedPosition) -> dict[str, Any]:
    planned = one.placement is not None and one.probe is not None
    return {
        "position": one.orientation.number,
        "orientation": one.orientation.name,
        "line_mm": one.line_mm,
        "longest_mm": one.longest_mm if planned else None,
        "share": one.share if planned else None,
        "blocks": list(one.blocks),
        "stylus_direction": list(one.probe.stylus_direction) if one.probe else None,
        "stylus_from_vertical_deg": _tilt_deg(one.probe) if one.probe else None,
        "tip_off_ram_mm": one.tip_off_ram_mm() if one.probe else None,
        "problem": one.problem,
    }


def _tilt_deg(probe: ProbeTable) -> float:
    """Angle between the stylus and a vertical ram."""
    return float(np.degrees(np.arccos(np.clip(-probe.stylus_direction[2], -1.0, 1.0))))


def placement_text(one: PlannedPosition) -> str:
    """The placement file of a planned position; ValueError for one that could not be planned."""
    if one.placement is None:
        raise ValueError(f"position {one.orientation.number} has no placement: {one.problem}")
    body = format_placement(one.placement).split("\n", 1)[1]
    number, name = one.orientation.number, one.orientation.name
    return f"# Where the gauge is meant to lie: position {number} of ISO 10360-2, {name}. Lengths mm.\n{body}"


def machine_with_probe(machine: Machine, probe: ProbeTable) -> str:
    """The text of the machine file with the stylus turned as in ``probe``; files that it names are named in full."""
    import tomli_w

    data = replace(machine, probe=probe).to_dict()
    return f"# {machine.table.name}, with the stylus as planned by stepgauge test plan.\n" + tomli_w.dumps(data)

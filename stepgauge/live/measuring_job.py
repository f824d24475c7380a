"""What a client is to measure: a program, checked once more against the machine, the gauge and its placement."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from stepgauge.correspondence.expected_points import ExpectedPoints, expected_by_program
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.live.journal import Journal, Row, fingerprint
from stepgauge.machine.file import TIP_TOLERANCE_MM, Machine
from stepgauge.machine.readout import correct_temperature
from stepgauge.machine.styli import stylus_comment
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import Move, Program, trace
from stepgauge.planning.check import check_program, check_travel
from stepgauge.planning.program import fastest_mm_s
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.conventions import KEY as CONVENTION
from stepgauge.recording.conventions import complete_by_machine
from stepgauge.recording.simulated import SIMULATED, SIMULATED_COMMENT


@dataclass(frozen=True)
class Job:
    """A program with what every point of it ought to read; ``placement_number``: which placing of the gauge it is.

    ``gauge_temperature_C``: as somebody measured it; None: what the server says.
    """

    program: Program
    machine: Machine
    gauge: Gauge
    placement: Placement
    expected: ExpectedPoints
    placement_number: int = 1
    gauge_temperature_C: float | None = None

    def __len__(self) -> int:
        return len(self.expected)

    def moves(self, point: int) -> tuple[list[Move], Move]:
        """The moves to a point (numbered from 1), and its measuring move."""
        *way, measure = self.program.moves(point)
        return way, measure

    def name(self, point: int) -> str:
        """A point in words."""
        return f"cycle {self.expected.cycle[point - 1]}, face {self.expected.face[point - 1]}"

    def head(self) -> Row:
        """What the journal says of the measurement."""
        return {
            "plan": fingerprint(self.program, placement=self.placement_number, temperature=self.gauge_temperature_C),
            "machine": self.machine.table.name,
            "gauge": self.gauge.table.serial,
            "points": len(self),
            "started": datetime.datetime.now().astimezone().isoformat(timespec="milliseconds"),
        }

    def durations_s(self) -> Array:
        """Time that each point takes at full speed, with the way to it, s, shape ``(n,)``."""
        path, settings = trace(self.program), self.program.settings
        speed = np.where(path.measuring, settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
        point = np.clip(self.program.point[path.move], 1, len(self))
        return np.asarray(np.bincount(point - 1, path.length_mm / speed, len(self)), float)

    def recording(self, journal: Journal, comments: dict[str, str]) -> Recording:
        """The recording of the points in a journal, in the order of the program.

        A column that not every point has is left out. Comments say when the measurement was begun, and
        whether any point is one of the virtual CMM.
        """
        rows: list[Row] = []
        for point in sorted(journal.rows):
            measure = self.moves(point)[1]
            assert measure.approach is not None
            own: dict[str, Any] = {"placement": self.placement_number}
            own |= {"cycle": int(self.expected.cycle[point - 1]), "face": int(self.expected.face[point - 1])}
            own |= {name: journal.rows[point][name] for name in POSITION}
            own |= dict(zip(APPROACH, measure.approach.tolist(), strict=True))
            rows.append({**own, **journal.rows[point]})
        frame = pd.DataFrame(rows)
        made = SIMULATED_COMMENT if SIMULATED in frame else {}
        frame = frame.drop(columns=SIMULATED, errors="ignore").dropna(axis=1)
        said = {**self._comments(), **_begun(journal), **made, **comments}
        recording = Recording(frame, said, str(journal.path))
        if made and CONVENTION not in said:
            origin_mm = self.placement.origin_mm(self.gauge)
            recording = correct_temperature(recording, self.machine, self.gauge, origin_mm)
        return complete_by_machine(recording, self.machine.table)

    def _comments(self) -> dict[str, str]:
        return {
            "program": self.program.name,
            "machine": self.machine.table.name,
            "gauge": self.gauge.table.name,
            "gauge_serial": self.gauge.table.serial,
            "tip_radius_mm": f"{self.machine.probe.tip_radius_mm:g}",
            **stylus_comment(self.machine),
        }


def _begun(journal: Journal) -> dict[str, str]:
    """When a measurement was begun, by the clock of the computer."""
    began = datetime.datetime.fromtimestamp(journal.began_s).astimezone()
    return {"measured_at": began.isoformat(timespec="seconds")}


def make_job(
    program: Program,
    machine: Machine,
    gauge: Gauge,
    placement: Placement,
    *,
    placement_number: int = 1,
    gauge_temperature_C: float | None = None,
    margin_mm: float = 0.5,
) -> Job:
    """Check a program as ``stepgauge plan`` does, and find its faces.

    Parameters
    ----------
    program : of a plan, or read from DMIS or I++ DME, whose searches start at the stand-off
    machine, gauge, placement : what it is to be run on
    margin_mm : smallest gap of the tool to anything but the face that it touches

    Raises
    ------
    InputError
        the move that would collide, miss its face or leave the travel, a speed beyond the machine's limits, and a
        program that does not measure this gauge as placed
    """
    _check_speeds(program, machine)
    _check_tip(program, machine)
    _check_standoff(program)
    expected = expected_by_program(program, gauge, placement)
    check_program(program, expected.face.tolist(), placement, gauge, make_tool(machine.probe), margin_mm)
    check_travel(program, machine)
    return Job(program, machine, gauge, placement, expected, placement_number, gauge_temperature_C)


def _check_speeds(program: Program, machine: Machine) -> None:
    settings = program.settings
    speeds = (settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
    for name, speed, most in zip(("measuring", "travel"), speeds, fastest_mm_s(machine), strict=True):
        if not 0.0 < speed <= most:
            what = f"the {name} speed is beyond the limit of {machine.table.name}"
            raise InputError(program.name, what, found=f"{speed:g} mm/s", expected=f"up to {most:g} mm/s")


def _check_tip(program: Program, machine: Machine) -> None:
    planned, own = program.settings.tip_radius_mm, machine.probe.tip_radius_mm
    if abs(planned - own) > TIP_TOLERANCE_MM:
        found, expected = f"tip radius {planned:g} mm", f"{own:g} mm, as in {machine.path or 'the machine file'}"
        raise InputError(program.name, "the program is for another tip", found=found, expected=expected)


def _check_standoff(program: Program) -> None:
    """A program that goes to its stand-offs by moves of its own must start every search at the stated distance."""
    if program.self_positioning:
        return
    measure = np.flatnonzero(program.is_measure)
    begin = program.position_mm[measure] - program.settings.standoff_mm * program.approach[measure]
    off = np.linalg.norm(program.position_mm[measure - 1] - begin, axis=1)
    if measure[0] == 0 or off.max() > 1e-3:
        raise InputError(
            program.name,
            "the searches do not all start at one distance from their faces, as I++ DME has it",
            expected="a program in DMIS or I++ DME, which 'stepgauge plan' writes",
        )

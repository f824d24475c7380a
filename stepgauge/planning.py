"""From the files of a technician to the checked text of a program: what ``stepgauge plan`` does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepgauge.collision import make_tool
from stepgauge.errors import InputError
from stepgauge.files import write_text
from stepgauge.gauge import Gauge
from stepgauge.locate import locate, read_points
from stepgauge.locate.checks import RADIUS_TOLERANCE_MM
from stepgauge.machine_file import Machine
from stepgauge.moves import ProbingSettings, Program, trace
from stepgauge.placement import Placement, is_placement_file, read_placement
from stepgauge.plan import PlanOptions, faces_in_order, make_program, middle_standoff_mm, parse_blocks
from stepgauge.plan_check import check_program, check_travel
from stepgauge.probes.schema import ConstantTable
from stepgauge.programs import DIALECTS, Dialect
from stepgauge.programs.render import render, same_moves

DEFAULT_SPEEDS_MM_S = (3.0, 50.0)
"""Measuring and travel speed where neither the technician nor a machine file states them."""


@dataclass(frozen=True)
class ProbingChoice:
    """How to probe; None: stand-off in the middle of the narrowest gap, speeds of the machine or the defaults."""

    standoff_mm: float | None = None
    search_mm: float = 2.0
    measuring_speed_mm_s: float | None = None
    travel_speed_mm_s: float | None = None


@dataclass(frozen=True)
class ProgramText:
    """A program as its controller reads it, and what came of reading it back."""

    program: Program
    text: str
    dialect: Dialect
    note: str

    def write(self, path: str | Path) -> None:
        """Write it with the line ends of its controller."""
        write_text(path, self.text, newline=self.dialect.newline)


def read_or_locate(
    source: str | Path,
    gauge: Gauge,
    machine: Machine | None = None,
    tip_radius_mm: float | None = None,
    points_on: str | None = None,
) -> Placement:
    """The placement in a TOML file, or located from the 16 points in a CSV file.

    ``tip_radius_mm``: nominal (None: of the machine); ``points_on``: blocks that the points are on, ``A:B`` (None: the
    first and the last). :class:`InputError` as the readers and :func:`stepgauge.locate.locate`.
    """
    if is_placement_file(source):
        return read_placement(source, gauge)
    if tip_radius_mm is None and machine is not None:
        tip_radius_mm = machine.probe.tip_radius_mm
    sigma_um = machine.table.repeatability_um if machine else 1.0
    return locate(read_points(source), gauge, parse_blocks(points_on or ":", gauge), sigma_um, tip_radius_mm, source)


def agreed_tip_radius_mm(
    placement: Placement, machine: Machine | None, stated_mm: float | None, source: str | Path
) -> float:
    """The tip radius as stated, or of the machine, or as the gauge was probed with.

    :class:`InputError` in the name of ``source`` where nobody knows it, or the gauge was probed with another tip.
    """
    probed = placement.tip_radius_mm
    own = None if machine is None else machine.probe.tip_radius_mm
    radius = next((known for known in (stated_mm, own, probed) if known is not None), None)
    if radius is None:
        raise InputError(source, "the tip radius is not known", expected="--tip-radius, --machine or key tip_radius_mm")
    if probed is not None and abs(radius - probed) > RADIUS_TOLERANCE_MM:
        found, expected = f"tip radius {probed:g} mm", f"{radius:g} mm"
        raise InputError(source, "the gauge was probed with another tip", found=found, expected=expected)
    return radius


def make_settings(
    gauge: Gauge, machine: Machine | None, tip_radius_mm: float, choice: ProbingChoice
) -> ProbingSettings:
    """What holds for all probings of a program: distances in mm, speeds in mm/s."""
    standoff = choice.standoff_mm or middle_standoff_mm(gauge, tip_radius_mm)
    measuring, travel = DEFAULT_SPEEDS_MM_S
    if machine is not None:
        measuring, travel = machine.table.measuring_speed_mm_s, machine.table.travel_speed_mm_s
    return ProbingSettings(
        standoff_mm=standoff,
        search_mm=choice.search_mm,
        retract_mm=standoff,
        measuring_speed_mm_s=choice.measuring_speed_mm_s or measuring,
        travel_speed_mm_s=choice.travel_speed_mm_s or travel,
        tip_radius_mm=tip_radius_mm,
    )


def checked_program(
    placement: Placement, gauge: Gauge, machine: Machine | None, options: PlanOptions, settings: ProbingSettings
) -> Program:
    """The moves, checked: ball, shank and body clear of gauge and rail, every search meets its own face, travel kept.

    Without a machine the probe is a ball on a plain stylus and the travel is not checked. :class:`InputError` names
    the move that fails.
    """
    probe = machine.probe if machine else ConstantTable(tip_radius_mm=settings.tip_radius_mm)
    probe = probe.model_copy(update={"tip_radius_mm": settings.tip_radius_mm})
    program = make_program(placement, gauge, options, settings)
    faces = [face for _, face in faces_in_order(options)]
    check_program(program, faces, placement, gauge, make_tool(probe), options.margin_mm)
    if machine is not None:
        check_travel(program, machine)
    return program


def program_text(program: Program, dialect: str, template: str | Path | None = None) -> ProgramText:
    """The program for a controller, read back as the controller would and compared.

    ``template``: the user's own; where it speaks a language that is not read, the note says so. :class:`InputError`
    where the text makes other moves than the program.
    """
    known = DIALECTS[dialect]
    text = render(program, known, template)
    return ProgramText(program, text, known, _read_back(text, program, known, template))


def _read_back(text: str, program: Program, dialect: Dialect, template: str | Path | None) -> str:
    try:
        back = dialect.read(text, "program", program.settings)
    except InputError as error:
        if template is None:
            raise
        return f"the text of {template} is no {dialect.name}, so it was not read back ({error})"
    if not same_moves(program, back, dialect.decimals):
        where = template or dialect.template
        raise InputError(where, f"read as {dialect.name}, the rendered program makes other moves than planned")
    return f"read back as {dialect.name}: the same moves to {10.0**-dialect.decimals:g} mm"


def duration_s(program: Program) -> float:
    """How long the path takes at full speed, without accelerations."""
    path, settings = trace(program), program.settings
    speed = np.where(path.measuring, settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
    return float((path.length_mm / speed).sum())

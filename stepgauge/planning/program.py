"""From the files of a technician to the checked text of a program, for ``stepgauge plan``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.alignment.checks import RADIUS_TOLERANCE_MM
from stepgauge.errors import InputError, naming
from stepgauge.files.text import write_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import ProbingSettings, Program, trace
from stepgauge.planning.check import check_program, check_search, check_travel
from stepgauge.planning.log_check import NOT_KNOWN, log_difference
from stepgauge.planning.plan import PlanOptions, faces_in_order, make_program, middle_standoff_mm
from stepgauge.probes.schema import ConstantTable
from stepgauge.programs import DIALECTS, Dialect
from stepgauge.programs.compare import difference, read_again
from stepgauge.programs.render import CHECKED, NOT_CHECKED, render

DEFAULT_SPEEDS_MM_S = (3.0, 50.0)
"""Measuring and travel speed if neither the technician nor a machine file states them."""
SLOWEST_MM_S = 0.01
FASTEST_MM_S = (100.0, 2000.0)
"""Largest measuring and travel speed of any program."""
MEASURING_SPEEDUP = 4.0
"""A machine file that states no largest measuring speed allows this much times its measuring speed."""


@dataclass(frozen=True)
class ProbingChoice:
    """How to probe; None: stand-off in the middle of the narrowest gap, speeds of the machine or the defaults."""

    standoff_mm: float | None = None
    search_mm: float = 2.0
    measuring_speed_mm_s: float | None = None
    travel_speed_mm_s: float | None = None


@dataclass(frozen=True)
class ProgramText:
    """A program as text for its controller, and the result of reading it back."""

    program: Program
    text: str
    dialect: Dialect
    note: str

    def __str__(self) -> str:
        return self.text

    def write(self, path: str | Path) -> None:
        """Write it with the line ends of its controller, and beside it the files that the control needs besides."""
        write_text(path, self.text, newline=self.dialect.newline)
        for name, content in self.dialect.files.items():
            write_text(Path(path).with_name(name), content)

    def further_files(self, path: str | Path) -> list[Path]:
        """The further files that :meth:`write` writes."""
        return [Path(path).with_name(name) for name in self.dialect.files]


def agreed_tip_radius_mm(
    placement: Placement, machine: Machine | None, stated_mm: float | None, source: str | Path
) -> float:
    """The tip radius as stated, or of the machine, or as the gauge was probed with.

    :class:`InputError` in the name of ``source`` if it is not known, or if the gauge was probed with another tip.
    """
    probed = placement.tip_radius_mm
    own = None if machine is None else machine.probe.tip_radius_mm
    radius = next((known for known in (stated_mm, own, probed) if known is not None), None)
    if radius is None:
        raise InputError(
            source,
            "the tip radius is not known",
            expected=naming("tip_radius_mm", "machine", words="{}, {} or key tip_radius_mm"),
        )
    if probed is not None and abs(radius - probed) > RADIUS_TOLERANCE_MM:
        found, expected = f"tip radius {probed:g} mm", f"{radius:g} mm"
        raise InputError(source, "the gauge was probed with another tip", found=found, expected=expected)
    return radius


def make_settings(
    gauge: Gauge, machine: Machine | None, tip_radius_mm: float, choice: ProbingChoice
) -> ProbingSettings:
    """Settings of all probings of a program: distances in mm, speeds in mm/s."""
    standoff = choice.standoff_mm or middle_standoff_mm(gauge, tip_radius_mm)
    measuring, travel = _speeds(machine, choice)
    return ProbingSettings(
        standoff_mm=standoff,
        search_mm=choice.search_mm,
        retract_mm=standoff,
        measuring_speed_mm_s=measuring,
        travel_speed_mm_s=travel,
        tip_radius_mm=tip_radius_mm,
    )


def _speeds(machine: Machine | None, choice: ProbingChoice) -> tuple[float, float]:
    """Measuring and travel speed, within what the machine allows (:class:`InputError` if not)."""
    own = DEFAULT_SPEEDS_MM_S
    if machine is not None:
        own = (machine.table.measuring_speed_mm_s, machine.table.travel_speed_mm_s)
    asked = (choice.measuring_speed_mm_s or own[0], choice.travel_speed_mm_s or own[1])
    for name, speed, most in zip(("measuring", "travel"), asked, fastest_mm_s(machine), strict=True):
        if not SLOWEST_MM_S <= speed <= most:
            key = f"max_{name}_speed_mm_s of {machine.path}" if machine and machine.path else "a machine's"
            raise InputError(
                f"--{name}-speed",
                f"the {name} speed is beyond the limit",
                found=f"{speed:g} mm/s",
                expected=f"{SLOWEST_MM_S:g} to {most:g} mm/s ({key})",
            )
    return asked


def fastest_mm_s(machine: Machine | None) -> tuple[float, float]:
    """Largest measuring and travel speed of a machine, mm/s.

    As the machine file states them; else four times its measuring speed, and its travel speed.
    """
    if machine is None:
        return FASTEST_MM_S
    table = machine.table
    measuring = table.max_measuring_speed_mm_s or MEASURING_SPEEDUP * table.measuring_speed_mm_s
    return measuring, table.max_travel_speed_mm_s or table.travel_speed_mm_s


def checked_program(
    placement: Placement, gauge: Gauge, machine: Machine | None, options: PlanOptions, settings: ProbingSettings
) -> Program:
    """The moves, checked: ball, shank and body clear of gauge and rail, every search meets its own face, travel kept.

    Without a machine the probe is a ball on a plain stylus and the travel is not checked. :class:`InputError` names
    the move that fails. Where the blocks were not found as far apart as certified, a face may be off by half of that.
    """
    off_mm = abs(placement.details.get("too_long_mm", 0.0)) / 2.0
    check_search(off_mm, settings.search_mm)
    probe = machine.probe if machine else ConstantTable(tip_radius_mm=settings.tip_radius_mm)
    probe = probe.model_copy(update={"tip_radius_mm": settings.tip_radius_mm})
    program = make_program(placement, gauge, options, settings)
    faces = [face for _, face in faces_in_order(options)]
    check_program(program, faces, placement, gauge, make_tool(probe), options.margin_mm + off_mm)
    if machine is not None:
        check_travel(program, machine)
    return replace(program, stylus=probe.stylus_direction)


def program_text(
    program: Program,
    dialect: str,
    template: str | Path | None = None,
    unchecked: bool = False,
    options: Mapping[str, str] | None = None,
) -> ProgramText:
    """The program for a controller, read back as the controller would and compared with the plan.

    ``template``: that of the user. ``unchecked``: a text that cannot be read back is accepted, and states this in a
    comment. ``options``: of the dialect, where the control is set up otherwise. :class:`InputError` if the text cannot
    be read back, and in any case if it is read as another program than the planned one.
    """
    known = DIALECTS[dialect].apply_options(options or {})
    program = known.slowed(program)
    where = template or known.template
    text = render(program, known, template, CHECKED)
    try:
        back = read_again(text, known, program.settings)
    except InputError as error:
        if template is None or not unchecked:
            raise _unread(error, where, known) from None
        return ProgramText(program, _unchecked_text(program, known, template), known, f"NOT CHECKED: {error}")
    found = difference(program, back, known)
    if found is not None:
        raise InputError(where, f"read as {known.name}, the rendered program is another one than planned", found=found)
    note = f"read back as {known.name}: the same {_compared(known)}" + _log(text, program, known, where)
    return ProgramText(program, text, known, note + _left_to_server(program, known))


def _log(text: str, program: Program, dialect: Dialect, where: str | Path) -> str:
    """What is to be said of the log; :class:`InputError` where it would not hold what the probe says."""
    if dialect.log_decimals is None:
        return ""
    found = log_difference(text, program, dialect)
    if found is not None and found != NOT_KNOWN:
        raise InputError(where, "the log of the program is not what the probe says", found=found)
    return f"; {found}" if found else ""


def _left_to_server(program: Program, dialect: Dialect) -> str:
    """Assumption of a program that names its tool, but not the radius of the tip."""
    if not dialect.tool or "tip_radius_mm" in dialect.carries:
        return ""
    radius = program.settings.tip_radius_mm
    return f"; the tip radius is the server's affair: its tool {program.tool or dialect.tool} must have {radius:g} mm"


def _compared(dialect: Dialect) -> str:
    """Statements of a text of this dialect that were compared, in words."""
    words = [f"moves to {10.0**-dialect.decimals:.{dialect.decimals}f} mm", "directions"]
    words += ["speeds and distances"] if dialect.carries else []
    words += [name for name in ("units", "coordinates") if name in dialect.states]
    return ", ".join([*words, *(["tool"] if dialect.tool else [])])


def _unread(error: InputError, where: str | Path, dialect: Dialect) -> InputError:
    return InputError(
        where,
        f"the rendered text cannot be read back as {dialect.name}",
        found=str(error),
        expected=naming("unchecked", words="statements that stepgauge reads, or {}"),
    )


def _unchecked_text(program: Program, dialect: Dialect, template: str | Path) -> str:
    """The text with the comment that it was not checked: that of the template (``checked``), or of the dialect."""
    text = render(program, dialect, template, NOT_CHECKED)
    if NOT_CHECKED in text:
        return text
    if not dialect.comment:
        raise InputError(
            template,
            f"{dialect.name} has no comments, so the file cannot say that it is not checked",
            expected="{{ checked }} in a comment of the language that the template writes",
        )
    return f"{dialect.comment.format(NOT_CHECKED)}\n{text}"


def check_tool(name: str, dialect: str) -> None:
    """:class:`InputError` for a name of a tool that the controller cannot take, or where the text does not name one."""
    if not name:
        return
    if not DIALECTS[dialect].tool:
        raise InputError(naming("tool"), f"a program in {dialect} does not name the tool", found=repr(name))
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,32}", name):
        raise InputError(
            naming("tool"), "no name of a tool", found=repr(name), expected="1 to 32 letters, digits, _ and -"
        )


def durations_s(program: Program) -> NDArray[np.float64]:
    """How long each move takes at full speed, without accelerations, ``(n_moves,)``."""
    path, settings = trace(program), program.settings
    speed = np.where(path.measuring, settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
    seconds = np.zeros(len(program))
    np.add.at(seconds, path.move, path.length_mm / speed)
    return seconds


def duration_s(program: Program) -> float:
    """How long the path takes at full speed, without accelerations."""
    return float(durations_s(program).sum())


def duration_words(seconds: float) -> str:
    """A duration as people read it off a clock: ``7 min 23 s``."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s"

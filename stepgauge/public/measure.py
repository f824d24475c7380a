"""``measure``: a measuring program on a CMM, over I++ DME."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.live.addressing import linked
from stepgauge.live.controller import ControllerOptions
from stepgauge.live.journal import resume as go_on
from stepgauge.live.journal import start
from stepgauge.live.measuring import Progress
from stepgauge.live.measuring import measure as measure_job
from stepgauge.live.measuring_job import make_job
from stepgauge.machine.file import Machine
from stepgauge.machine.virtual import probing_settings
from stepgauge.programs import DIALECTS, read_program
from stepgauge.recording import Recording
from stepgauge.verbs.inputs import (
    File,
    a_temperature,
    as_gauge,
    as_machine,
    as_placement,
    at_least,
    moves_of_plan,
    one_of,
)

if TYPE_CHECKING:
    from stepgauge.planning.planned import Plan


def measure(
    program: File | Plan,
    machine: File | Machine,
    gauge: File | Gauge,
    placement: File | Placement,
    *,
    server: str,
    journal: File,
    resume: bool = False,
    homing: bool = False,
    tool: str = DIALECTS["ippdme"].tool,
    gauge_temperature_C: float | None = None,
    placement_number: int = 1,
    dialect: str | None = None,
    search_mm: float = 2.0,
    spy: File | None = None,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> Recording:
    """Measure a program on a CMM through its I++ DME server, or on LinuxCNC.

    Parameters
    ----------
    program : file of the program's text (DMIS, I++ DME), or a plan
    machine : travel, speeds and probe
    gauge : the certified gauge, its file or shipped name
    placement : how the gauge lies
    server : ``"HOST:PORT"``, the port is 1294 by default; or ``"linuxcnc"``, the one that runs on this computer
    journal : file that gets every point before the next one is measured
    resume : go on with the measurement of which this is the journal
    homing : the machine may home itself; without it one that is not homed is refused
    tool : what the server calls the probe
    gauge_temperature_C : default: what the server says, if it does
    placement_number : which placing of the gauge this is
    dialect : language of the text; default: recognised
    search_mm : search beyond the target, where the text does not state it
    spy : file that gets every line of both sides
    progress : called after every point with points done, points of the program, and time left at full speed, s
    stop : asked ten times a second whether to stop

    Returns
    -------
    The recording. An interrupt (Ctrl-C) or ``stop`` stops the machine, draws it back and ends the session; it is
    raised as a ``KeyboardInterrupt``.

    Raises
    ------
    InputError
        what is refused before the machine moves; an error of the machine, an answer that is no reading of its point, or
        the loss of the connection, after which the measurement can be resumed
    """
    at_least("placement_number", placement_number, 1)
    at_least("search_mm", search_mm, 0.0, "mm", beyond=True)
    a_temperature("gauge_temperature_C", gauge_temperature_C)
    steps, cmm = as_gauge(gauge), as_machine(machine)
    if isinstance(program, File):
        known = None if dialect is None else one_of("dialect", dialect, DIALECTS)
        moves = read_program(program, probing_settings(cmm, search_mm), known)
    else:
        moves = moves_of_plan(program)
    job = make_job(
        moves,
        cmm,
        steps,
        as_placement(placement, steps),
        placement_number=placement_number,
        gauge_temperature_C=gauge_temperature_C,
    )
    book = (go_on if resume else start)(Path(journal), job.head())
    try:
        if len(book.rows) == len(job):  # nothing is missing: no machine is needed
            return job.recording(book, {"server": server})
        with linked(server, moves.settings, cmm, spy=spy, stop=stop) as link:
            return measure_job(job, link, book, wishes=ControllerOptions(tool, homing), progress=progress)
    finally:
        book.close()

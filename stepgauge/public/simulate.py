"""``simulate``: a measuring program on the virtual CMM."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stepgauge.errors import InputError, naming
from stepgauge.files.dates import moment_now
from stepgauge.files.text import read_text, write_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.virtual import Conditions, Run, probing_settings, run_program
from stepgauge.programs import DIALECTS, recognise
from stepgauge.programs.controller import controller_log
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


def simulate(
    program: File | Plan,
    machine: File | Machine,
    gauge: File | Gauge,
    placement: File | Placement,
    *,
    true_placement: File | Placement | None = None,
    seed: int = 0,
    gauge_temperature_C: float | None = None,
    placement_number: int = 1,
    start_s: float = 0.0,
    dialect: str | None = None,
    search_mm: float = 2.0,
    explain: bool = False,
    keep_stopped: bool = False,
    log: File | None = None,
    teach: bool = False,
) -> Run:
    """Execute a measuring program on a virtual CMM.

    Parameters
    ----------
    program : file of the program's text, or a plan
    machine : travel, speeds, probe, repeatability and effects
    gauge : the certified gauge, its file or shipped name
    placement : how the gauge is believed to lie
    true_placement : how it really lies, where that differs
    seed : of the repeatability; the same seed gives the same readings
    gauge_temperature_C : default: that of the certificate
    placement_number : which placing of the gauge this is
    start_s : time at the start, s
    dialect : language of the text; default: recognised
    search_mm : search beyond the target, where the text does not state it
    explain : give the share of every effect, um, too
    keep_stopped : return what was recorded of a program that was stopped, instead of raising
    teach : the program touches the 16 points, so that a side, a top or the rail is as good as a face
    log : file for what the controller writes while it executes the text, for ``import``

    Returns
    -------
    The run: its recording, path, duration and notes; ``evaluate`` and ``diagnose`` take it as a recording.

    Raises
    ------
    ProgramStoppedError
        a collision, a missed face or a travel limit, with the line of the program
    InputError
        a program, machine or placement that cannot be read
    """
    at_least("seed", seed, 0)
    at_least("placement_number", placement_number, 1)
    at_least("start_s", start_s, 0.0, "s")
    at_least("search_mm", search_mm, 0.0, "mm", beyond=True)
    a_temperature("gauge_temperature_C", gauge_temperature_C)
    steps, cmm = as_gauge(gauge), as_machine(machine)
    lies = as_placement(placement, steps)
    if true_placement is not None:
        lies = as_placement(true_placement, steps)
    conditions = Conditions(steps.temperature_C(gauge_temperature_C), placement_number, start_s, teach)
    settings = probing_settings(cmm, search_mm)
    if isinstance(program, File):
        text = read_text(program)
        known = recognise(text, program) if dialect is None else DIALECTS[one_of("dialect", dialect, DIALECTS)]
        moves = known.read(text, program, settings)
    else:
        if log is not None:
            raise InputError(naming("log"), "a plan has no text that writes a log", expected="the file of a program")
        moves = moves_of_plan(program)
    run = run_program(moves, cmm, steps, lies, seed, conditions, explain)
    run = replace(run, recording=run.recording.with_comments(measured_at=moment_now()))
    if log is not None and isinstance(program, File):
        write_text(log, controller_log(text, str(program), known, settings, run).text)
    if run.stop is not None and not keep_stopped:
        raise run.stop
    return run

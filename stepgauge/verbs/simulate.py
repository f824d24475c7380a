"""``simulate``: a measuring program on the virtual CMM."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Flag, Number, Reads, Supplied, Writes
from stepgauge.verbs.shared import (
    FIGURES,
    Dialect,
    File,
    GaugeLike,
    GaugeTemperature,
    MachineLike,
    OutputFile,
    PlacementLike,
    PlacementNumber,
    Plot,
    Search,
)

if TYPE_CHECKING:
    from stepgauge.gauge.placement import Placement
    from stepgauge.machine.virtual import Run
    from stepgauge.planning.planned import Plan


def write(
    run: "Run",
    output: OutputFile,
    *,
    plot: Plot = None,
    plot_shares: Annotated[File | None, Writes("FILE", suffixes=FIGURES)] = None,
    plot_html: Annotated[File | None, Writes("FILE")] = None,
) -> Written:
    """The recording, or the table of the points that a teach program touched, and figures of the run.

    Parameters
    ----------
    output : recording to write (CSV); with ``teach`` the table of points that 'stepgauge locate' reads
    plot : plan view and elevation of the path with the gauge
    plot_shares : with ``explain``: shares of the effects, stacked along the gauge
    plot_html : the path in three dimensions, to be turned in a browser
    """
    from stepgauge.errors import InputError, naming

    run.write(output)
    if plot_shares is not None and run.shares is None:
        raise InputError(naming("plot_shares"), "there are no shares to draw", expected=naming("explain"))
    drawn = []
    if any((plot, plot_html, plot_shares)) and run.setup is not None:
        from stepgauge.figures.run import draw_run

        drawn = draw_run(run, *run.setup, plot, plot_html, plot_shares)
    empty = ["nothing was recorded, so there are no shares to draw"] if plot_shares and not len(run.recording) else []
    return Written([output, run.log, *drawn], empty)


@verb(write)
def simulate(
    program: Annotated["File | Plan", Reads("PROGRAM"), ARGUMENT],
    machine: MachineLike,
    gauge: GaugeLike,
    placement: PlacementLike,
    *,
    true_placement: Annotated["File | Placement | None", Reads("P")] = None,
    seed: Annotated[int, Count(0)] = 0,
    gauge_temperature_C: GaugeTemperature = None,
    placement_number: PlacementNumber = 1,
    start_time_s: Annotated[float, Number("s", 0.0)] = 0.0,
    dialect: Dialect = None,
    search_mm: Search = 2.0,
    explain: Annotated[bool, Flag()] = False,
    keep_stopped: Annotated[bool, Supplied(at_command=True)] = False,
    log: Annotated[File | None, Writes("FILE")] = None,
    teach: Annotated[bool, Flag()] = False,
) -> "Run":
    """Execute the text of a measuring program on a virtual CMM.

    The machine travels, searches and triggers on the gauge as it really lies, with the pre-travel of its probe, its
    repeatability, and the effects of its file; time stamps follow from the speeds. A collision, a missed face or a
    travel limit stops the program with its line; what was recorded until then is kept, and the exit code is 2.
    With ``log`` the text is executed as by its controller, with the readings of the run, and writes its log.

    Parameters
    ----------
    program : file of the program's text, or a plan
    placement : placement file: how the gauge is believed to lie
    true_placement : how the gauge really lies, where that differs from ``placement``
    seed : seed of the repeatability; the same gives the same recording
    start_time_s : time at the start
    explain : one more column per effect: its share along the approach, um
    keep_stopped : return what was recorded of a program that was stopped, instead of raising
    log : file for what the controller writes while it executes the text, for 'stepgauge import'
    teach : the program touches the 16 points ('plan --teach'), so that a side, a top or the rail is as good as a face

    Returns
    -------
    The run: its recording, path, duration and notes; ``evaluate`` and ``diagnose`` take it as a recording.

    Raises
    ------
    ProgramStoppedError
        a collision, a missed face or a travel limit, with the line of the program
    InputError
        a program, machine or placement that cannot be read

    Examples
    --------
    stepgauge simulate gauge.dmi --machine bridge-cmm --gauge step-gauge-420 --placement placement.toml -o recording.csv
    """
    from dataclasses import replace

    from stepgauge.errors import InputError, naming
    from stepgauge.files.dates import moment_now
    from stepgauge.files.text import read_text, write_text
    from stepgauge.machine.virtual import RunConditions, probing_settings, run_program
    from stepgauge.programs import DIALECTS, recognise
    from stepgauge.programs.controller import controller_log
    from stepgauge.verbs.inputs import moves_of_plan, resolve_gauge, resolve_machine, resolve_placement

    steps, cmm = resolve_gauge(gauge), resolve_machine(machine)
    lies = resolve_placement(placement, steps)
    if true_placement is not None:
        lies = resolve_placement(true_placement, steps)
    conditions = RunConditions(steps.temperature_C(gauge_temperature_C), placement_number, start_time_s, teach)
    settings = probing_settings(cmm, search_mm)
    if isinstance(program, File):
        text = read_text(program)
        known = recognise(text, program) if dialect is None else DIALECTS[dialect]
        moves = known.read(text, program, settings)
    else:
        if log is not None:
            raise InputError(naming("log"), "a plan has no text that writes a log", expected="the file of a program")
        moves = moves_of_plan(program)
    run = run_program(moves, cmm, steps, lies, seed, conditions, explain)
    if log is not None and isinstance(program, File):
        write_text(log, controller_log(text, str(program), known, settings, run).text)
    if run.stop is not None and not keep_stopped:
        raise run.stop
    run = replace(run, recording=run.recording.assign_comments(measured_at=moment_now()))
    return replace(run, setup=(cmm, steps, lies), log=None if log is None else Path(log), teach=teach)

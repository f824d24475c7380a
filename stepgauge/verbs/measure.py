"""``measure``: a measuring program, or a path that is planned now, on a CMM."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import Of, verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, Reads, Supplied, Text, Writes
from stepgauge.verbs.plan import PATH, plan
from stepgauge.verbs.shared import (
    TEMPERATURE,
    Dialect,
    File,
    GaugeLike,
    MachineLike,
    OutputFile,
    PlacementLike,
    PlacementNumber,
    Search,
    Tool,
)

if TYPE_CHECKING:
    from stepgauge.live.measuring import Progress
    from stepgauge.planning.planned import Plan
    from stepgauge.recording import Recording


def write(recording: "Recording", output: OutputFile) -> list[File]:
    """The recording.

    Parameters
    ----------
    output : recording to write (CSV); its journal is kept beside it
    """
    recording.write(output)
    return [output]


@verb(write, says=lambda recording: f"{len(recording)} points measured")
def measure(
    program: Annotated["File | Plan | None", Reads("[PROGRAM]", optional=True), ARGUMENT],
    machine: MachineLike,
    gauge: GaugeLike,
    placement: PlacementLike,
    *,
    server: Annotated[str, Text("HOST:PORT")],
    journal: Annotated[File, Supplied("journal")],
    resume: Annotated[bool, Flag()] = False,
    homing: Annotated[bool, Flag()] = False,
    tool: Tool = "StepGaugeProbe",
    gauge_temperature_C: Annotated[float | None, TEMPERATURE] = None,
    placement_number: PlacementNumber = 1,
    dialect: Dialect = None,
    search_mm: Search = 2.0,
    spy: Annotated[File | None, Writes("FILE")] = None,
    progress: Annotated["Progress | None", Supplied("live")] = None,
    stop: Annotated["Callable[[], bool] | None", Supplied("stop")] = None,
    **path: Annotated[Any, Of(plan, *PATH, "home_mm", "blocks")],
) -> "Recording":
    """Measure the gauge on a CMM over I++ DME, or on LinuxCNC.

    I++ DME is the standard interface of CMM controllers. ``program`` is what 'stepgauge plan' wrote for DMIS or I++
    DME. Without one the path is planned now, as 'stepgauge plan' would with the options of the path. Before the machine
    moves, the whole path is checked once more against gauge, rail and travel; the server must be a Cartesian CMM,
    homed, with the tool, and take the speeds of the program. From wherever the machine stands a safe way to the path is
    looked for; if there is none, nothing moves.

    Every answer is judged as it comes, by the rules of 'stepgauge import'; at one that is no reading of its point the
    measurement stops, and the machine is drawn back. Every point is in the journal, PATH.journal, before the next one
    is measured. After Ctrl-C (the machine stops, draws back and ends the session), an error of the machine, a false
    answer, or the loss of the connection, the same command with ``resume`` goes on: no point is lost, none measured
    twice. Times are the server's where it tells its own, else those of this computer; temperatures are the server's, or
    ``gauge_temperature_C``.

    Parameters
    ----------
    program : file of the program's text (DMIS, I++ DME), or a plan; default: the path is planned now
    machine : machine file: travel, speeds, probe
    server : the I++ DME server, port 1294 by default; or linuxcnc, for the LinuxCNC that runs on this computer
    journal : file that gets every point before the next one is measured
    resume : go on with a measurement that was stopped, from its journal
    homing : the machine may home itself if it is not; without it, such a machine is refused
    gauge_temperature_C : temperature of the gauge as you measure it; default: Part.Temperature of the server, if it has
        it
    spy : write down every line of both sides, as 'stepgauge import' reads it
    progress : called after every point with points done, points of the program, and time left at full speed, s
    stop : asked ten times a second whether to stop
    path : without a program, parameters of :func:`plan`

    Returns
    -------
    The recording. An interrupt (Ctrl-C) or ``stop`` stops the machine, draws it back and ends the session; it is
    raised as a ``KeyboardInterrupt``.

    Raises
    ------
    InputError
        what is refused before the machine moves; an error of the machine, an answer that is no reading of its point, or
        the loss of the connection, after which the measurement can be resumed

    Examples
    --------
    stepgauge plan placement.toml -g step-gauge-420 -m bridge-cmm -d ippdme -o gauge.ipp
    stepgauge measure gauge.ipp -m bridge-cmm -g step-gauge-420 -p placement.toml \\
        --server 127.0.0.1:1294 --homing -o recording.csv
    stepgauge measure -m bridge-cmm -g step-gauge-420 -p placement.toml --cycles 3 --order up-down \\
        --server 127.0.0.1:1294 --homing -o recording.csv
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    """
    from stepgauge.live.addressing import linked
    from stepgauge.live.controller import ControllerOptions
    from stepgauge.live.journal import resume as go_on
    from stepgauge.live.journal import start
    from stepgauge.live.measuring import measure as measure_job
    from stepgauge.live.measuring_job import make_job
    from stepgauge.machine.virtual import probing_settings
    from stepgauge.programs import read_program
    from stepgauge.verbs.inputs import moves_of_plan, resolve_gauge, resolve_machine, resolve_placement

    steps, cmm = resolve_gauge(gauge), resolve_machine(machine)
    lies = resolve_placement(placement, steps)
    program = _planned(program, dialect, lambda: plan(lies, steps, cmm, search_mm=search_mm, **path), path)
    if isinstance(program, File):
        moves = read_program(program, probing_settings(cmm, search_mm), dialect)
    else:
        moves = moves_of_plan(program)
    given = {"placement_number": placement_number, "gauge_temperature_C": gauge_temperature_C}
    job = make_job(moves, cmm, steps, lies, **given)  # type: ignore[arg-type]
    book = (go_on if resume else start)(Path(journal), job.head())
    try:
        if len(book.rows) == len(job):  # nothing is missing: no machine is needed
            return job.recording(book, {"server": server})
        with linked(server, moves.settings, cmm, spy=spy, stop=stop) as link:
            return measure_job(job, link, book, wishes=ControllerOptions(tool, homing), progress=progress)
    finally:
        book.close()


def _planned(
    program: "File | Plan | None", dialect: str | None, planned: "Callable[[], Plan]", path: dict[str, Any]
) -> "File | Plan":
    """The program, or the plan that stands for one."""
    from stepgauge.errors import InputError, naming

    if program is not None:
        if path:
            what = naming(*path, words=", ".join(["{}"] * len(path)))
            raise InputError(what, "without a program, which says it already")
        return program
    if dialect is not None:
        raise InputError(naming("dialect"), "is the language of a program, which is missing")
    return planned()

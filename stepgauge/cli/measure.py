"""``stepgauge measure``: a program, or a path that is planned now, measured on an I++ DME server."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.interrupt import interruptible, progress_bar, stoppable
from stepgauge.cli.options import (
    DIALECTS,
    GAUGE,
    PLACEMENT_NUMBER,
    SEARCH,
    TEMPERATURE_C,
    machine_option,
    output,
    say,
    say_lines,
    say_written,
)
from stepgauge.cli.plan_choices import path_options, plan_keywords, typed_path_options

if TYPE_CHECKING:
    from stepgauge.planning.planned import Plan


@click.command("measure")
@click.argument("program", required=False, metavar="[PROGRAM]")
@machine_option(True, "Machine file (TOML), or the name of a shipped one: travel, speeds, probe.")
@GAUGE
@click.option("--placement", "-p", required=True, metavar="P", help="Placement file: how the gauge lies.")
@click.option(
    "--server",
    required=True,
    metavar="HOST:PORT",
    help="The I++ DME server, port 1294 by default; or linuxcnc, for the LinuxCNC that runs on this computer.",
)
@output("Recording to write (CSV); its journal is kept beside it.")
@click.option("--resume", is_flag=True, help="Go on with a measurement that was stopped, from its journal.")
@click.option(
    "--homing", is_flag=True, help="The machine may home itself if it is not. Without it, such a machine is refused."
)
@click.option(
    "--gauge-temperature",
    type=TEMPERATURE_C,
    metavar="C",
    help="Temperature of the gauge as you measure it, deg C. Default: Part.Temperature of the server, if it has it.",
)
@PLACEMENT_NUMBER
@click.option(
    "--tool", default="StepGaugeProbe", show_default=True, metavar="NAME", help="The server's name of the probe."
)
@click.option("--spy", metavar="FILE", help="Write down every line of both sides, as 'stepgauge import' reads it.")
@click.option(
    "--dialect", "-d", type=click.Choice(DIALECTS), help="Language of the program. Default: recognised from its text."
)
@SEARCH
@path_options
def command(
    program: str | None, machine: str, gauge: str, placement: str, server: str, output: str, **options: Any
) -> None:
    """Measure the gauge on a CMM, over I++ DME, the standard interface of CMM controllers; or on LinuxCNC.

    PROGRAM is what 'stepgauge plan' wrote for DMIS or I++ DME. Without one the path is planned now, as 'stepgauge plan'
    would with the options of the path (--route to --travel-speed). Before the machine moves, the whole path is checked
    once more against gauge, rail and travel; the server must be a Cartesian CMM, homed, with the tool, and take the
    speeds of the program. From wherever the machine stands a safe way to the path is looked for; if there is none,
    nothing moves.

    Every answer is judged as it comes, by the rules of 'stepgauge import'; at one that is no reading of its point the
    measurement stops, and the machine is drawn back. Every point is in the journal, PATH.journal, before the next one
    is measured. After Ctrl-C (the machine stops, draws back and ends the session), an error of the machine, a false
    answer, or the loss of the connection, the same command with --resume goes on: no point is lost, none measured
    twice. Times are the server's where it tells its own, else those of this computer; temperatures are the server's, or
    --gauge-temperature.

    \b
    stepgauge plan placement.toml -g step-gauge-420 -m bridge-cmm -d ippdme -o gauge.ipp
    stepgauge measure gauge.ipp -m bridge-cmm -g step-gauge-420 -p placement.toml \\
        --server 127.0.0.1:1294 --homing -o recording.csv
    stepgauge measure -m bridge-cmm -g step-gauge-420 -p placement.toml --cycles 3 --order up-down \\
        --server 127.0.0.1:1294 --homing -o recording.csv
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    """
    from stepgauge.files.text import check_output
    from stepgauge.live.journal import journal_of
    from stepgauge.public.measure import measure
    from stepgauge.recording import write_recording

    read = (program, machine, gauge, placement)
    check_output(output, *read, options["spy"])
    if options["spy"]:
        check_output(options["spy"], *read)
    what = _path(program, placement, gauge, machine, options)
    with interruptible() as stop, progress_bar() as progress, stoppable():
        recording = measure(
            what,
            machine,
            gauge,
            placement,
            server=server,
            journal=journal_of(output),
            resume=options["resume"],
            homing=options["homing"],
            tool=options["tool"],
            gauge_temperature_C=options["gauge_temperature"],
            placement_number=options["placement_number"],
            dialect=options["dialect"],
            search_mm=options["search"],
            spy=options["spy"],
            progress=progress,
            stop=stop,
        )
    write_recording(output, recording)
    say(f"{len(recording)} points measured")
    say_written(output)


def _path(program: str | None, placement: str, gauge: str, machine: str, options: dict[str, Any]) -> str | Plan:
    """The program, or the plan that stands for one (:class:`click.UsageError` for a program and options of a path)."""
    if program is not None:
        if typed := typed_path_options():
            raise click.UsageError(f"{', '.join(typed)}: without PROGRAM, which says it already.")
        return program
    if options["dialect"] is not None:
        raise click.UsageError("--dialect is the language of PROGRAM, which is missing.")
    from stepgauge.public.plan import plan

    planned = plan(placement, gauge, machine, **plan_keywords(options))
    say_lines(planned.summary())
    return planned

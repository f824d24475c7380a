"""``stepgauge simulate``: run a program on the virtual CMM -> a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    DIALECTS,
    GAUGE,
    GAUGE_TEMPERATURE,
    NOT_NEGATIVE,
    PLACEMENT_NUMBER,
    SEARCH,
    check_figure,
    machine_option,
    output,
    plot_option,
    say,
    say_lines,
    say_written,
)

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run


@click.command("simulate")
@click.argument("program", metavar="PROGRAM")
@machine_option(True, "Machine file (TOML), or the name of a shipped one.")
@GAUGE
@click.option("--placement", "-p", required=True, metavar="P", help="Placement file: how the gauge is believed to lie.")
@output("Recording to write (CSV).")
@click.option("--true-placement", metavar="P", help="How the gauge really lies, where that differs from --placement.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the repeatability.")
@GAUGE_TEMPERATURE
@PLACEMENT_NUMBER
@click.option(
    "--start-time", type=NOT_NEGATIVE, default=0.0, show_default=True, metavar="S", help="Time at the start, s."
)
@click.option(
    "--dialect", "-d", type=click.Choice(DIALECTS), help="Language of the program. Default: recognised from its text."
)
@SEARCH
@plot_option("Plan view and elevation of the path with the gauge")
@click.option(
    "--teach",
    is_flag=True,
    help="PROGRAM touches the 16 points ('plan --teach'): --output is a table of them, for 'stepgauge locate'.",
)
@click.option("--log", metavar="FILE", help="What the controller writes while it executes PROGRAM, for 'import'.")
@click.option("--explain", is_flag=True, help="One more column per effect: its share along the approach, um.")
@click.option(
    "--plot-shares",
    callback=check_figure,
    metavar="FILE",
    help="Shares of the effects, stacked along the gauge (png, svg or pdf).",
)
@click.option("--plot-html", metavar="FILE", help="The path in three dimensions, to be turned in a browser.")
def command(program: str, machine: str, gauge: str, placement: str, output: str, **options: Any) -> None:
    """Execute the text of a measuring program on a virtual CMM.

    The machine travels, searches and triggers on the gauge as it really lies, with the pre-travel of its probe, its
    repeatability, and the effects of its file; time stamps follow from the speeds. A collision, a missed face or a
    travel limit stops the program with its line; what was recorded until then is kept, and the exit code is 2.
    With --log the text is executed as by its controller, with the readings of the run, and writes its log.

    \b
    stepgauge simulate gauge.dmi --machine bridge-cmm --gauge step-gauge-420 --placement placement.toml -o recording.csv
    """
    from stepgauge.files.text import check_output
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.machine.file import read_machine
    from stepgauge.public.simulate import simulate

    check_output(output, program, machine, gauge, placement, options["true_placement"])
    steps, cmm = read_gauge(gauge), read_machine(machine)
    believed = read_placement(placement, steps)
    lies = read_placement(options["true_placement"], steps) if options["true_placement"] else believed
    run = simulate(
        program,
        cmm,
        steps,
        lies,
        seed=options["seed"],
        gauge_temperature_C=options["gauge_temperature"],
        placement_number=options["placement_number"],
        start_s=options["start_time"],
        dialect=options["dialect"],
        search_mm=options["search"],
        explain=options["explain"] or bool(options["plot_shares"]),
        keep_stopped=True,
        log=options["log"],
        teach=options["teach"],
    )
    _write(run, output, options)
    drawn = []
    if options["plot"] or options["plot_html"] or options["plot_shares"]:
        from stepgauge.figures.run import draw_run

        drawn = draw_run(run, cmm, steps, lies, options["plot"], options["plot_html"], options["plot_shares"])
    say_lines(run.summary())
    if options["plot_shares"] and not len(run.recording):
        say("nothing was recorded, so there are no shares to draw")
    say_written(output, *([options["log"]] if options["log"] else []), *drawn)
    if run.stop is not None:
        raise run.stop


def _write(run: Run, output: str, options: dict[str, Any]) -> None:
    """The recording, or the table of points that were touched."""
    from stepgauge.files.text import write_text
    from stepgauge.recording import write_recording

    if options["teach"]:
        write_text(output, _points(run.recording.position_mm))
    else:
        write_recording(output, run.explained() if options["explain"] else run.recording)


def _points(position_mm: Any) -> str:
    """The table that ``stepgauge locate`` reads."""
    rows = [",".join([str(n), *(f"{value:.6f}" for value in xyz)]) for n, xyz in enumerate(position_mm, 1)]
    return "\n".join(["point,x_mm,y_mm,z_mm", *rows]) + "\n"

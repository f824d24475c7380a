"""``stepgauge simulate``: run a program on the virtual CMM -> a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, TEMPERATURE_C, FiniteRange, check_figure, machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine import Run
    from stepgauge.machine_file import Machine
    from stepgauge.placement import Placement


@click.command("simulate")
@click.argument("program", metavar="PROGRAM")
@machine_option(True, "Machine file (TOML), or the name of a shipped one.")
@GAUGE
@click.option("--placement", "-p", required=True, metavar="P", help="Placement file: how the gauge is believed to lie.")
@output("Recording to write (CSV).")
@click.option("--true-placement", metavar="P", help="How the gauge really lies, where that differs from --placement.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the repeatability.")
@click.option(
    "--gauge-temperature", type=TEMPERATURE_C, metavar="C", help="Gauge temperature, deg C; default: the certificate's."
)
@click.option(
    "--placement-number", type=click.IntRange(1), default=1, show_default=True, help="Number in the recording."
)
@click.option("--start-time", type=FiniteRange(0.0), default=0.0, show_default=True, metavar="S", help="First time, s.")
@click.option("--dialect", type=click.Choice(["jinyoung", "dmis", "linuxcnc", "ippdme"]), help="Default: recognised.")
@click.option(
    "--search",
    type=FiniteRange(0.0, min_open=True),
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the target, mm, where the program does not state it.",
)
@click.option(
    "--plot",
    callback=check_figure,
    metavar="FILE",
    help="Plan view and elevation of the path with the gauge (png, svg or pdf).",
)
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

    \b
    stepgauge simulate gauge.dmi --machine bridge-cmm --gauge step-gauge-420 --placement placement.toml -o recording.csv
    """
    from stepgauge.files import check_output
    from stepgauge.gauge import read_gauge
    from stepgauge.machine import Conditions, probing_settings, run_program
    from stepgauge.machine_file import read_machine
    from stepgauge.placement import read_placement
    from stepgauge.programs import read_program
    from stepgauge.recording import write_recording

    check_output(output, program, machine, gauge, placement, options["true_placement"])
    steps, cmm = read_gauge(gauge), read_machine(machine)
    believed = read_placement(placement, steps)
    lies = read_placement(options["true_placement"], steps) if options["true_placement"] else believed
    temperature = options["gauge_temperature"]
    conditions = Conditions(
        steps.table.reference_temperature_C if temperature is None else temperature,
        options["placement_number"],
        options["start_time"],
    )
    moves = read_program(program, probing_settings(cmm, options["search"]), options["dialect"])
    explain = options["explain"] or bool(options["plot_shares"])
    run = run_program(moves, cmm, steps, lies, options["seed"], conditions, explain)
    write_recording(output, run.explained() if options["explain"] else run.recording)
    if options["plot"] or options["plot_html"]:
        _draw(run, steps, lies, cmm, options)
    if options["plot_shares"]:
        _draw_shares(run, steps, cmm, options["plot_shares"])
    say(f"{len(run.recording)} of {moves.n_points} points recorded, {run.duration_s:.0f} s of machine time")
    say(f"wrote {output}")
    if run.stop is not None:
        raise run.stop


def _draw_shares(run: Run, gauge: Gauge, machine: Machine, file: str) -> None:
    from stepgauge.figures.shares import draw_shares

    if run.shares is None or not len(run.recording):
        say("nothing was recorded, so there are no shares to draw")
        return
    face = run.recording.frame["face"].to_numpy()
    draw_shares(file, run.shares, face, gauge.position_mm, f"{gauge.table.name} on {machine.table.name}")
    say(f"wrote {file}")


def _draw(run: Run, gauge: Gauge, placement: Placement, machine: Machine, options: dict[str, Any]) -> None:
    from stepgauge.figures.path import draw_path, write_path_html

    radius, title = machine.probe.tip_radius_mm, f"{gauge.table.name} on {machine.table.name}"
    if options["plot"]:
        draw_path(options["plot"], run.path, gauge, placement, radius, run.stop_piece, title)
        say(f"wrote {options['plot']}")
    if options["plot_html"]:
        write_path_html(
            options["plot_html"], run.path, gauge, placement, radius, machine.travel_mm, run.stop_piece, title
        )
        say(f"wrote {options['plot_html']}")

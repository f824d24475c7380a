"""``stepgauge plan``: placement + gauge -> a checked measuring program."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import (
    DIALECTS,
    GAUGE,
    POSITIVE,
    machine_option,
    output,
    say,
    say_lines,
    say_written,
)
from stepgauge.cli.plan_choices import path_options, plan_keywords, stated_controls


@click.command("plan")
@click.argument("source", required=False, metavar="[PLACEMENT|POINTS]")
@GAUGE
@output("Program file to write; with --iso10360 the folder for placements and programs.")
@click.option(
    "--dialect",
    "-d",
    type=click.Choice(DIALECTS),
    required=True,
    help="Language of the controller.",
)
@click.option("--template", metavar="FILE", help="Your own Jinja template instead of the shipped one of the dialect.")
@click.option(
    "--unchecked",
    is_flag=True,
    help="With --template: write a program that cannot be read back and compared with the plan; the file says so.",
)
@click.option(
    "--tool",
    default="",
    metavar="NAME",
    help="What the controller calls the probe (dmis, ippdme). Default: PROBE in DMIS, StepGaugeProbe in I++ DME.",
)
@click.option(
    "--set",
    "controls",
    multiple=True,
    metavar="NAME=VALUE",
    help="How the control is set up where it differs from the usual; repeatable. See 'stepgauge dialects NAME'.",
)
@click.option(
    "--iso10360",
    is_flag=True,
    help="No PLACEMENT: plan the seven positions of ISO 10360-2 in the machine's travel, each in 3 cycles unless"
    " --cycles says otherwise (needs --machine).",
)
@click.option(
    "--stylus",
    type=click.Choice(["auto", "machine", "square"]),
    default="auto",
    show_default=True,
    help="With --iso10360, direction of the stylus: as in the machine file, square to the gauge (an indexing head turns"
    " it), or as in the machine file where that is clear of the gauge and else square.",
)
@click.option(
    "--allow-short",
    is_flag=True,
    help="With --iso10360: write what can be measured even where the gauge does not fit or is too short.",
)
@click.option(
    "--teach",
    is_flag=True,
    help="POINTS are rough: plan a program that touches the 16 points there; 'stepgauge locate' reads its log.",
)
@click.option("--points-on", metavar="A:B", help="Blocks that POINTS were probed on. Default: the first and the last.")
@machine_option(False, "Machine file: travel limits, stylus and speeds. Without it the travel is not checked.")
@click.option(
    "--tip-radius", type=POSITIVE, metavar="MM", help="Nominal tip radius, mm. Default: machine or placement."
)
@path_options
@click.option(
    "--search",
    type=POSITIVE,
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the nominal contact, mm.",
)
def command(source: str | None, gauge: str, output: str, dialect: str, template: str | None, **options: Any) -> None:
    """Plan the measurement of the step gauge and write the program for the controller.

    Starts from a placement file, or from the 16 points (see 'stepgauge locate'). The whole path is checked before
    anything is written: tip ball, stylus shank and probe body against every block and the rail, every measuring move
    must meet its own face first, and every position must lie within the machine's travel. The text is then read back
    and compared with the plan: moves, directions, speeds, units, coordinate system, tool. The way to the first position
    is yours: bring the machine to a safe place above the gauge.

    \b
    stepgauge plan placement.toml --gauge step-gauge-420 --machine bridge-cmm --dialect dmis -o gauge.dmi
    stepgauge plan points.csv --gauge my-gauge.toml --dialect linuxcnc --route over --cycles 3 -o gauge.ngc
    stepgauge plan placement.toml -g my-gauge.toml -d dmis --template my-dialect.j2 -o gauge.prg
    stepgauge plan rough.csv --teach -g my-gauge.toml -m my-machine.toml -d fanuc -o teach.nc
    stepgauge plan --iso10360 -g step-gauge-1020 -m bridge-cmm -d dmis -o seven-positions
    """
    if options["iso10360"]:
        from stepgauge.cli.plan_iso10360 import plan_seven

        plan_seven(source, gauge, output, dialect, template, options)
        return
    if options["allow_short"] or options["stylus"] != "auto":
        raise click.UsageError("--allow-short and --stylus go with --iso10360.")
    if options["unchecked"] and template is None:
        raise click.UsageError("--unchecked goes with --template: the shipped ones are always read back.")
    if source is None:
        raise click.UsageError("Missing argument 'PLACEMENT|POINTS' (or --iso10360).")
    from stepgauge.files.text import check_output
    from stepgauge.public.plan import plan

    check_output(output, source, gauge, options["machine"], template)
    planned = plan(source, gauge, options["machine"], **plan_keywords(options))
    rendered = planned.write(
        output,
        dialect,
        template=template,
        tool=options["tool"],
        unchecked=options["unchecked"],
        options=stated_controls(options),
    )
    say_lines(planned.summary())
    say(rendered.note)
    say_written(output, *rendered.beside(output))

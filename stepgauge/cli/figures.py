"""``stepgauge figures``: the figures of a measurement, for the wall and the report."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import (
    BLOCKS,
    GAUGE,
    PLACEMENTS,
    R_EFF,
    SUFFIX,
    machine_option,
    mpe_from,
    mpe_options,
    output,
    say_written,
)

# Written out so that --help needs no matplotlib; a test compares it with what is drawn.
KINDS = ("error", "bidirectional", "repeatability", "arrows", "run")


@click.command("figures")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for the figures (made if missing).")
@click.option(
    "--only",
    "kinds",
    multiple=True,
    type=click.Choice(KINDS),
    help="Only this one; repeatable. Default: all.",
)
@machine_option(False, "Machine file, or the name of a shipped one: its travel is the box of the arrows.")
@PLACEMENTS
@BLOCKS
@R_EFF
@mpe_options(False, "Draw the lines of a maximum permissible error")
@SUFFIX
def command(recordings: tuple[str, ...], gauge: str, output: str, **options: Any) -> None:
    """Draw what a metrologist wants to see of a measurement. Sizes are the printed ones; svg and pdf are vectors.

    \b
    error          error against position with 2s band, and MPE lines
    bidirectional  single probings and means of both probing directions
    repeatability  single probings from the mean of their face; 2s and range
    arrows         mean errors of all placements in the machine's travel, magnified
    run            every probing by time, with the temperatures

    \b
    stepgauge figures recording.csv -g step-gauge-420 --mpe "1.8 + L/350" -o figures
    stepgauge figures x.csv y.csv diagonal.csv -g step-gauge-420 -m bridge-cmm --only arrows --figure pdf -o figures
    """
    from stepgauge.evaluation.evaluate import evaluate
    from stepgauge.figures.measurement import draw_measurement
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.machine.file import read_machine
    from stepgauge.planning.plan import parse_section
    from stepgauge.recording import read_recordings

    limit = mpe_from(options)
    steps = read_gauge(gauge)
    section = parse_section(options["blocks"], steps)
    placements = read_placements(options["placement_files"], steps)
    recording = read_recordings(recordings)
    result = evaluate(recording, steps, section, options["r_eff_origin"], placements)
    machine = read_machine(options["machine"]) if options["machine"] else None
    kinds = options["kinds"] or KINDS
    say_written(*draw_measurement(output, recording, result, kinds, limit, machine, options["suffix"]))

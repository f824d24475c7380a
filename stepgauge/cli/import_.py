"""``stepgauge import``: a controller's log -> a recording."""

from __future__ import annotations

import click

from stepgauge.cli.options import GAUGE, TEMPERATURE_C, output, say


@click.command("import")
@click.argument("log", metavar="LOG")
@click.option(
    "--from",
    "source",
    type=click.Choice(["linuxcnc"]),
    required=True,
    help="Controller that wrote the log. LinuxCNC: its (LOG,..) rows or its (PROBEOPEN ..) file, told apart by itself.",
)
@click.option(
    "--program", required=True, metavar="PROGRAM", help="The program that was run, as the controller read it."
)
@GAUGE
@click.option(
    "--placement",
    "-p",
    required=True,
    metavar="P",
    help="Placement file (TOML) that the program was planned with: it says which face each measuring move meets.",
)
@output("Recording (CSV) to write.")
@click.option(
    "--placement-number",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Which placing of the gauge this is, in a calibration with several.",
)
@click.option(
    "--gauge-temperature",
    type=TEMPERATURE_C,
    metavar="DEG_C",
    help="Temperature of the gauge during the run, deg C. Default: none recorded; the certificate's holds.",
)
def command(
    log: str,
    source: str,
    program: str,
    gauge: str,
    placement: str,
    output: str,
    placement_number: int,
    gauge_temperature: float | None,
) -> None:
    """Turn the probe log of a controller into a recording.

    The log is checked against the program that was run: every point there once, in order, on the line of its search
    and not farther than the search distance from its target. Faces come from where the program probes on the gauge as
    placed; the n-th visit of a face is its cycle n. Nothing is written unless the whole log fits.

    \b
    stepgauge import stepgauge-probe-log.txt --from linuxcnc --program probe.ngc \\
        --gauge step-gauge-420 --placement placement.toml --gauge-temperature 20.4 -o recording.csv
    """
    from stepgauge.gauge import read_gauge
    from stepgauge.importing import RunLabels, import_log
    from stepgauge.moves import ProbingSettings
    from stepgauge.placement import read_placement
    from stepgauge.programs import read_program
    from stepgauge.recording import write_recording

    steps = read_gauge(gauge)
    moves = read_program(program, ProbingSettings())
    labels = RunLabels(placement_number, gauge_temperature)
    imported = import_log(log, source, moves, steps, read_placement(placement, steps), labels)
    write_recording(output, imported.recording)
    for line in imported.report:
        say(line)
    say(f"wrote {output}: {len(imported.recording)} probings, placement {placement_number}")

"""``stepgauge export``: a recording -> files that other programs read."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import FiniteRange, output, say

DELIMITERS = {"semicolon": ";", "tab": "\t", "bar": "|", "comma": ","}


@click.command("export")
@click.argument("recording", metavar="RECORDING")
@click.option(
    "--to",
    "form",
    type=click.Choice(["dmis", "ippdme", "linuxcnc", "csv", "xlsx"]),
    required=True,
    help="DMIS output, an I++ DME session log, a LinuxCNC probe log, a table as text (CSV) or in Excel.",
)
@output("File to write.")
@click.option(
    "--placement-number",
    "placement",
    type=click.IntRange(1),
    metavar="N",
    help="Export this placement only. Default: all; the logs have room for one.",
)
@click.option(
    "--length-unit",
    type=click.Choice(["mm", "um", "m", "inch"]),
    default="mm",
    show_default=True,
    help="Of coordinates in a table, or in DMIS (mm, m, inch).",
)
@click.option(
    "--delimiter",
    type=click.Choice(list(DELIMITERS)),
    help="Of a CSV table. Default: comma, or semicolon with --decimal comma.",
)
@click.option(
    "--decimal",
    type=click.Choice(["point", "comma"]),
    default="point",
    show_default=True,
    help="Decimal mark of a CSV table.",
)
@click.option(
    "--points",
    type=click.Choice(["centres", "surface"]),
    default="centres",
    show_default=True,
    help="Tip centres, or points compensated by the tip radius (DMIS with PRCOMP/ON, and tables).",
)
@click.option(
    "--tip-radius",
    type=FiniteRange(0.0, 25.0, min_open=True),
    metavar="MM",
    help="Radius of the tip ball, mm. Default: what RECORDING states.",
)
@click.option(
    "--log-form",
    type=click.Choice(["log", "probeopen"]),
    default="log",
    show_default=True,
    help="Of LinuxCNC: the numbered (LOG,..) rows, or the nine columns of (PROBEOPEN ..).",
)
def command(recording: str, form: str, output: str, **options: Any) -> None:
    """Write a recording in the form of another program.

    'stepgauge import' reads every one of them back as the same recording, to the printed digits (1e-7 mm; 1e-6 mm in
    the PROBEOPEN form). What a form has no room for is said. Cycle and face are part of the tables and, as the names of
    the points, of DMIS; from the logs they are found again with --gauge and --placement.

    \b
    stepgauge export recording.csv --to xlsx -o recording.xlsx
    stepgauge export recording.csv --to csv --delimiter semicolon --decimal comma --length-unit um -o for-excel.csv
    stepgauge export recording.csv --to dmis --points surface --tip-radius 2 -o results.dmo
    """
    from stepgauge.exporting import ExportOptions, export_recording, write_export
    from stepgauge.files.text import check_output
    from stepgauge.recording import read_recording

    check_output(output, recording)
    _check_options(form, output, options)
    decimal = "," if options["decimal"] == "comma" else "."
    delimiter = options["delimiter"] or ("semicolon" if decimal == "," else "comma")
    choice = ExportOptions(
        options["length_unit"],
        DELIMITERS[delimiter],
        decimal,
        options["placement"],
        options["points"] == "surface",
        options["tip_radius"],
        options["log_form"],
    )
    export = export_recording(read_recording(recording), form, choice)
    write_export(output, export)
    for line in export.report:
        say(line)
    say(f"wrote {output}")


def _check_options(form: str, output: str, options: dict[str, Any]) -> None:
    """Options that the form has no use for are mistakes, and so is a workbook by another name."""
    if form != "csv" and (options["delimiter"] or options["decimal"] == "comma"):
        raise click.UsageError(f"--delimiter and --decimal are of a CSV table; found --to {form}.")
    if form != "linuxcnc" and options["log_form"] != "log":
        raise click.UsageError(f"--log-form is of LinuxCNC; found --to {form}.")
    if (form == "xlsx") != output.lower().endswith(".xlsx"):
        expected = "NAME.xlsx" if form == "xlsx" else "another suffix than .xlsx"
        raise click.UsageError(f"--output does not fit --to {form}: found {output}, expected {expected}.")

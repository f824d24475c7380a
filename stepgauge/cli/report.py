"""``stepgauge report``: evaluation -> a report to print and sign."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import is_from_project, machine_option, output, placement_option, say, say_written
from stepgauge.cli.stated import NAMES, stated_options


@click.command("report")
@click.argument("evaluation", metavar="EVALUATION")
@output("The report to write: NAME.pdf, or NAME.html (one file, to print from a browser).")
@click.option(
    "--gauge",
    "-g",
    envvar="STEPGAUGE_GAUGE",
    metavar="GAUGE",
    help="Gauge file or shipped name: adds the certificate's uncertainties. Must be the gauge of the evaluation.",
)
@placement_option(
    "Placement file of locate (needs --gauge): adds angles and uncertainties; once per placement, in order."
)
@machine_option(False, "Machine file or shipped name: adds travel, speeds, probe and temperature of the scales.")
@click.option(
    "--budget",
    "budget_file",
    metavar="BUDGET",
    help="budget.json of stepgauge budget, or its folder: adds uncertainties.",
)
@click.option(
    "--certificate",
    "-c",
    "laboratory_file",
    metavar="FILE",
    help="certificate.toml: makes the report a calibration certificate in the order of ISO/IEC 17025. Excludes "
    "--number, --operator, --customer, --location, --date and --remarks, which it states itself.",
)
@stated_options("Your own template, Typst for PDF, Jinja for HTML; start from a copy: 'stepgauge shipped report.typ'.")
def command(evaluation: str, output: str, **options: Any) -> None:
    """A report to print and sign, from what evaluate wrote: EVALUATION is its folder or its evaluation.json.

    Certificate, machine, placement, conditions, effective radius, the table of all faces, figures, notes, and a place
    for signatures. What is not known is listed as not stated; nothing is assumed. Reports on an example certificate
    say so on every page. With --budget every error has its expanded uncertainty, and the budget is printed. With
    --certificate it is a calibration certificate ('stepgauge shipped certificate --copy-to .' gives a file to fill in).

    \b
    stepgauge report result -o report.pdf
    stepgauge report result -g step-gauge-420 -p placement.toml -m bridge-cmm \\
        --number 2026-017 --operator "A. Meyer" -o report.pdf
    stepgauge report result -g step-gauge-420 --budget result -c certificate.toml -o certificate.pdf
    """
    from stepgauge.public.report import report

    if options["placement_files"] and not options["gauge"]:
        raise click.UsageError("--placement is checked against its gauge: give --gauge as well.")
    said = {name: options[name] for name in (*NAMES, "date")}
    if options["laboratory_file"]:
        said = {name: None if is_from_project(name) else value for name, value in said.items()}
        if any(said.values()):
            raise click.UsageError("--certificate states number, date, customer, place, persons and remarks itself.")
    notes = report(
        evaluation,
        output,
        gauge=options["gauge"],
        placements=list(options["placement_files"]),
        machine=options["machine"],
        budget=options["budget_file"],
        certificate=options["laboratory_file"],
        template=options["template"],
        **said,
    )
    for note in notes:
        say(f"note: {note}")
    say_written(output)

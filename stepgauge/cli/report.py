"""``stepgauge report``: evaluation -> a report to print and sign."""

from __future__ import annotations

import datetime
from typing import Any

import click

from stepgauge.cli.options import machine_option, output, say


@click.command("report")
@click.argument("evaluation", metavar="EVALUATION")
@output("The report to write: NAME.pdf, or NAME.html (one file, to print from a browser).")
@click.option(
    "--gauge",
    "-g",
    metavar="GAUGE",
    help="Gauge file or shipped name: adds the certificate's uncertainties. Must be the gauge of the evaluation.",
)
@click.option(
    "--placement",
    "-p",
    "placement_files",
    multiple=True,
    metavar="PLACEMENT",
    help="Placement file of locate (needs --gauge): adds angles and uncertainties; once per placement, in order.",
)
@machine_option(False, "Machine file or shipped name: adds travel, speeds, probe and temperature of the scales.")
@click.option("--number", metavar="TEXT", help="Number of the report.")
@click.option("--operator", metavar="TEXT", help="Who measured; printed at the place for the signature.")
@click.option("--customer", metavar="TEXT", help="For whom the report is made.")
@click.option("--location", metavar="TEXT", help="Where the machine stands.")
@click.option(
    "--date", type=click.DateTime(["%Y-%m-%d"]), metavar="YYYY-MM-DD", help="Date of the report. [default: today]"
)
@click.option("--remarks", metavar="TEXT", help="Anything else to print.")
@click.option(
    "--template",
    metavar="FILE",
    help="Your own template, Typst for PDF, Jinja for HTML; start from a copy of those in templates/reports.",
)
def command(evaluation: str, output: str, template: str | None, **options: Any) -> None:
    """A report to print and sign, from what evaluate wrote: EVALUATION is its folder or its evaluation.json.

    Certificate, machine, placement, conditions, effective radius, the table of all faces, figures, notes, and a place
    for signatures. What is not known is listed as not stated; nothing is made up. Reports on an example certificate
    say so on every page.

    \b
    stepgauge report result -o report.pdf
    stepgauge report result -g step-gauge-420 -p placement.toml -m bridge-cmm \\
        --number 2026-017 --operator "A. Meyer" -o report.pdf
    """
    from stepgauge.report.content import Stated, make_content
    from stepgauge.report.reading import read_checked_evaluation
    from stepgauge.report.render import renderer, write_report

    renderer(output)
    data = read_checked_evaluation(evaluation)
    day = options["date"].date() if options["date"] else datetime.date.today()
    said = {key: options[key] for key in ("number", "customer", "location", "operator", "remarks")}
    sources = _sources(data, options["gauge"], options["placement_files"], options["machine"])
    for note in write_report(output, make_content(data, Stated(day, **said), sources), template):
        say(f"note: {note}")
    say(f"wrote {output}")


def _sources(data: dict[str, Any], gauge: str | None, placement_files: tuple[str, ...], machine: str | None) -> Any:
    """The files given with the evaluation, each checked to belong to it."""
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.placement import read_placement
    from stepgauge.report.content import Sources
    from stepgauge.report.reading import check_gauge, check_machine, check_placements

    steps = read_gauge(gauge) if gauge else None
    if steps:
        check_gauge(data, steps)
    if placement_files and steps is None:
        raise click.UsageError("--placement is checked against its gauge: give --gauge as well.")
    placements = [read_placement(path, steps) for path in placement_files] if steps else []
    check_placements(data, placements, placement_files)
    cmm = read_machine(machine) if machine else None
    if cmm:
        check_machine(data, cmm)
    return Sources(steps, cmm, placements)

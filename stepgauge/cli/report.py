"""``stepgauge report``: evaluation -> a report to print and sign."""

from __future__ import annotations

import datetime
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.report.content import Sources


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
    say so on every page. With --budget every error has its expanded uncertainty, and the budget is printed. With
    --certificate it is a calibration certificate ('stepgauge shipped certificate --copy-to .' gives a file to fill in).

    \b
    stepgauge report result -o report.pdf
    stepgauge report result -g step-gauge-420 -p placement.toml -m bridge-cmm \\
        --number 2026-017 --operator "A. Meyer" -o report.pdf
    stepgauge report result -g step-gauge-420 --budget result -c certificate.toml -o certificate.pdf
    """
    from stepgauge.report.content import Stated, make_content
    from stepgauge.report.reading import read_checked_evaluation
    from stepgauge.report.render import renderer, write_report

    renderer(output)
    data = read_checked_evaluation(evaluation)
    sources = _sources(data, options["gauge"], options["placement_files"], options["machine"])
    sources = _further(data, sources, options["budget_file"], options["laboratory_file"])
    stated = {key: options[key] for key in ("number", "customer", "location", "operator", "remarks")}
    laboratory = sources.laboratory
    if laboratory is not None and (options["date"] or any(stated.values())):
        raise click.UsageError("--certificate states number, date, customer, place, persons and remarks itself.")
    day = options["date"].date() if options["date"] else datetime.date.today()
    if laboratory is not None:
        day = laboratory.certificate.issued or day
    for note in write_report(output, make_content(data, Stated(day, **stated), sources), template):
        say(f"note: {note}")
    say(f"wrote {output}")


def _sources(data: dict[str, Any], gauge: str | None, placement_files: tuple[str, ...], machine: str | None) -> Sources:
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


def _further(data: dict[str, Any], sources: Sources, budget_file: str | None, laboratory_file: str | None) -> Sources:
    """The budget, checked to belong to the evaluation, and what the laboratory states."""
    from stepgauge.certificate_file import read_laboratory
    from stepgauge.standards.budget_files import check_budget, read_budget

    budget = read_budget(budget_file) if budget_file else None
    if budget is not None and budget_file is not None:
        check_budget(budget, data, budget_file)
    return replace(sources, budget=budget, laboratory=read_laboratory(laboratory_file) if laboratory_file else None)

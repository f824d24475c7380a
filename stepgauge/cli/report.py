"""``stepgauge report``: results -> a report to sign, the story of a diagnosis, an overlay, a page to explore."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import is_from_project, leaves, machine_option, output, placement_option, say, say_written
from stepgauge.cli.stated import NAMES, stated_options

BESIDE = {"placements": "placement_files", "budget": "budget_file", "certificate": "laboratory_file", "mpe": "mpe"}
"""Options of what only a report to sign prints."""


def _is_signed(options: dict[str, Any]) -> bool:
    """Whether the report is one to sign: of one evaluation, and no page to explore."""
    return len(options["results"]) == 1 and not options["interactive"] and _kind(options) == "evaluation"


def _kind(options: dict[str, Any]) -> str:
    from stepgauge.reports.kinds import kind_of

    return kind_of(options["results"][0])


def _left(options: dict[str, Any]) -> tuple[str, ...]:
    """What others than a report to sign do not print, and what a certificate states itself."""
    if _is_signed(options):
        return NAMES if options["laboratory_file"] else ()
    judged = len(options["results"]) == 1 and _kind(options) != "evaluation"
    return (*NAMES, *BESIDE.values(), *(("gauge", "machine") if judged else ()))


@click.command("report")
@click.argument("results", metavar="RESULT...", nargs=-1, required=True)
@output(
    "The report to write: NAME.pdf, or NAME.html (one file, to print from a browser); of an overlay also .png, .svg."
)
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
    help="budget.json of stepgauge budget, or its folder: adds uncertainties. Default: the one in RESULT.",
)
@click.option(
    "--certificate",
    "-c",
    "laboratory_file",
    metavar="FILE",
    help="certificate.toml: makes the report a calibration certificate in the order of ISO/IEC 17025. Excludes "
    "--number, --operator, --customer, --location, --date and --remarks, which it states itself.",
)
@click.option(
    "--mpe",
    metavar="LIMIT",
    help='Maximum permissible error "A + L/K": um, with L in mm: pass, fail or undecidable by ISO 14253-1.',
)
@click.option(
    "--interactive",
    is_flag=True,
    help="A page (.html, one file, no network): click a face or a finding to see its probings.",
)
@click.option(
    "--recording",
    "-r",
    "recordings",
    multiple=True,
    metavar="RECORDING",
    help="With --interactive: recordings of the evaluation, in order. Default: those that it was made from.",
)
@stated_options("Your own template, Typst for PDF, Jinja for HTML; start from a copy: 'stepgauge shipped report.typ'.")
@leaves(_left)
def command(results: tuple[str, ...], output: str, **options: Any) -> None:
    """Pages from results: RESULT is the folder that a verb wrote, or its JSON file.

    Of an evaluation: a report to print and sign. Certificate, machine, placement, conditions, effective radius, the
    table of all faces, figures, notes, and a place for signatures. What is not known is listed as not stated; nothing
    is assumed. Reports on an example certificate state this on every page. With --budget every error has its expanded
    uncertainty, and the budget is printed. With --certificate it is a calibration certificate ('stepgauge shipped
    certificate --copy-to .' gives a file to fill in).

    Of a diagnosis: page 1 states what to do first and what was found, each cause and rival with its own value;
    evidence and appendix follow. Of an investigation: every run with its reason and its result. Of the JSON file of
    'fleet infer': the causes with their owners, and the recordings that prove them.

    Of several evaluations of one gauge: an overlay, every error before and after, and their differences with their
    own uncertainty.

    \b
    stepgauge report result -o report.pdf
    stepgauge report result -g step-gauge-420 -p placement.toml -m bridge-cmm \\
        --number 2026-017 --operator "A. Meyer" -o report.pdf
    stepgauge report result -g step-gauge-420 --budget result -c certificate.toml -o certificate.pdf
    stepgauge report diagnosis -o diagnosis.pdf
    stepgauge report before after -o overlay.pdf
    stepgauge report result --interactive -o explore.html
    """
    from stepgauge.public.report import report

    if options["placement_files"] and not options["gauge"]:
        raise click.UsageError("--placement is checked against its gauge: give --gauge as well.")
    said = {name: options[name] for name in (*NAMES, "date")}
    signed = _is_signed({"results": results, **options})
    if options["laboratory_file"] or not signed:
        said = {name: None if is_from_project(name) else value for name, value in said.items()}
    if options["laboratory_file"] and any(said.values()):
        raise click.UsageError("--certificate states number, date, customer, place, persons and remarks itself.")
    beside = {name: options[option] for name, option in BESIDE.items() if signed or not is_from_project(option)}
    if "placements" in beside:
        beside["placements"] = list(beside["placements"])
    notes = report(
        results[0] if len(results) == 1 else list(results),
        output,
        **{"gauge": options["gauge"], "machine": options["machine"], **beside, **said},
        template=options["template"],
        interactive=options["interactive"],
        recordings=list(options["recordings"]),
    )
    for note in notes:
        say(f"note: {note}")
    say_written(output)

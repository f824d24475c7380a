"""``stepgauge dcc write``: the Digital Calibration Certificate of a machine."""

from __future__ import annotations

from pathlib import Path

import click

from stepgauge.cli.dcc.options import LABORATORY, SCHEMA
from stepgauge.cli.options import GAUGE, machine_option, output, say


@click.command("write")
@click.argument("evaluation", metavar="EVALUATION")
@LABORATORY
@GAUGE
@machine_option(False, "Machine file or shipped name: adds the name of the machine and the temperature of the scales.")
@click.option("--budget", "budget_file", metavar="B", help="budget.json of stepgauge budget. Default: in EVALUATION.")
@click.option("--attach", metavar="PDF", help="Printed certificate (.pdf) to put into the file.")
@SCHEMA
@output("Certificate to write, NAME.xml.")
def command(
    evaluation: str,
    laboratory_file: str,
    gauge: str,
    machine: str | None,
    budget_file: str | None,
    attach: str | None,
    schema: str | None,
    output: str,
) -> None:
    """A Digital Calibration Certificate from what evaluate and budget wrote.

    EVALUATION is the folder or evaluation.json. XF, XB, XM and XR at every face and R_eff, each with its expanded
    uncertainty, coverage factor and probability; method, gauge, temperatures, and what the laboratory states. What a
    DCC demands and certificate.toml lacks is named, never filled in. What is written is read back before it counts.

    \b
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    stepgauge budget recording.csv -g step-gauge-420 -m machine.toml -o result
    stepgauge dcc write result -c certificate.toml -g step-gauge-420 -m machine.toml -o certificate.xml
    """
    from stepgauge.dcc.elements import attach as attach_file
    from stepgauge.dcc.files import certificate_of, check_certificate_name, read_pdf, write_certificate
    from stepgauge.errors import InputError
    from stepgauge.reports.reading import find_evaluation, read_checked_evaluation
    from stepgauge.reports.sources import read_sources

    check_certificate_name(output)
    data = read_checked_evaluation(evaluation)
    budget_path = Path(budget_file) if budget_file else find_evaluation(evaluation).parent / "budget.json"
    if not budget_path.exists():
        raise InputError(budget_path, "no such file: a certificate needs uncertainties", expected="stepgauge budget")
    root = certificate_of(data, read_sources(data, gauge, (), machine, budget_path, laboratory_file))
    if attach is not None:
        attach_file(root, Path(attach).name, "application/pdf", read_pdf(attach))
    write_certificate(output, root, schema)
    say(f"wrote {output}" + (f", valid by {schema}" if schema else ""))

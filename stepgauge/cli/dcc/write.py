"""``stepgauge dcc write``: the Digital Calibration Certificate of a machine."""

from __future__ import annotations

from pathlib import Path

import click

from stepgauge.cli.dcc.options import LABORATORY, SCHEMA, check_output, finish
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
    from stepgauge.certificate_file import read_laboratory
    from stepgauge.dcc.elements import attach as attach_file
    from stepgauge.dcc.write import machine_certificate
    from stepgauge.errors import InputError
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.report.reading import check_gauge, check_machine, find_evaluation, read_checked_evaluation
    from stepgauge.standards.budget_files import check_budget, read_budget

    check_output(output)
    data = read_checked_evaluation(evaluation)
    said, steps = read_laboratory(laboratory_file), read_gauge(gauge)
    check_gauge(data, steps)
    cmm = read_machine(machine) if machine else None
    if cmm is not None:
        check_machine(data, cmm)
    budget_path = Path(budget_file) if budget_file else find_evaluation(evaluation).parent / "budget.json"
    if not budget_path.exists():
        raise InputError(budget_path, "no such file: a certificate needs uncertainties", expected="stepgauge budget")
    budget = read_budget(budget_path)
    check_budget(budget, data, budget_path)
    root = machine_certificate(data, budget, said, steps, cmm)
    if attach is not None:
        attach_file(root, Path(attach).name, "application/pdf", _pdf(attach))
    finish(root, output, schema)
    say(f"wrote {output}" + (f", valid by {schema}" if schema else ""))


def _pdf(path: str) -> bytes:
    from stepgauge.errors import InputError

    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(path, error.strerror or str(error)) from None
    if not data.startswith(b"%PDF-"):
        raise InputError(path, "not a PDF file", expected="the printed certificate")
    return data

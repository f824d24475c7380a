"""``stepgauge dcc export-gauge``: gauge file -> the DCC that its laboratory would send."""

from __future__ import annotations

import click

from stepgauge.cli.dcc.options import LABORATORY, SCHEMA
from stepgauge.cli.options import output, say


@click.command("export-gauge")
@click.argument("gauge", metavar="GAUGE")
@LABORATORY
@SCHEMA
@output("Certificate to write, NAME.xml.")
def command(gauge: str, laboratory_file: str, schema: str | None, output: str) -> None:
    """The Digital Calibration Certificate of a step gauge from its gauge file: what a gauge laboratory sends.

    Faces with nominal and certified positions, U and k, expansion, sizes, material and reference temperature;
    'stepgauge dcc import-gauge' reads it back to the same gauge. Correlation, the part of U that is common to all faces
    and degrees of freedom have no place in the schema: they are quantities beside the positions, and another reader may
    not know them. Number, laboratory and date are those of the certificate file.

    \b
    stepgauge dcc export-gauge step-gauge-420 -c laboratory.toml -o gauge.xml
    """
    from stepgauge.dcc.files import check_certificate_name, write_certificate
    from stepgauge.dcc.gauge_write import gauge_certificate
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.reports.certificate_file import read_laboratory

    check_certificate_name(output)
    write_certificate(output, gauge_certificate(read_gauge(gauge), read_laboratory(laboratory_file)), schema)
    say(f"wrote {output}" + (f", valid by {schema}" if schema else ""))

"""``stepgauge dcc``: Digital Calibration Certificates."""

from __future__ import annotations

import click

from stepgauge.cli import LazyGroup

VERBS = {
    "write": ("stepgauge.cli.dcc.write", "evaluation + budget + what the laboratory states -> certificate (XML)"),
    "check": ("stepgauge.cli.dcc.check", "read a certificate, check units and uncertainties, say what it states"),
    "import-gauge": ("stepgauge.cli.dcc.import_gauge", "a gauge's certificate (XML) -> gauge file"),
    "export-gauge": ("stepgauge.cli.dcc.export_gauge", "gauge file -> the certificate (XML) its laboratory would send"),
}


@click.group(cls=LazyGroup, tasks={"Verbs": VERBS})
def command() -> None:
    """Digital Calibration Certificates: DCC XML 3.2.0 of PTB with D-SI quantities.

    Certificates are read safely: no DOCTYPE, no entities, no network.
    """

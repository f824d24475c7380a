"""Options of the verbs that write certificates."""

from __future__ import annotations

import click

LABORATORY = click.option(
    "--certificate",
    "-c",
    "laboratory_file",
    required=True,
    metavar="FILE",
    help="certificate.toml: what only the laboratory knows; 'stepgauge shipped certificate --copy-to .' gives one.",
)
SCHEMA = click.option(
    "--schema",
    metavar="XSD",
    help="Schema to validate against before writing: dcc.xsd with its imports beside it (of PTB; not shipped here).",
)

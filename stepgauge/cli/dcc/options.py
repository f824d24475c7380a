"""Options of the verbs that write certificates."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from stepgauge.dcc.xml import Element

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


def finish(root: Element, output: str, schema: str | None) -> None:
    """Check what was made as a reader would, then write it."""
    from stepgauge.dcc.elements import to_bytes
    from stepgauge.dcc.read import parse_document
    from stepgauge.dcc.xml import parse_xml, validate
    from stepgauge.files import replacing

    data = to_bytes(root)
    again = parse_xml(data, output)
    parse_document(again, output)
    if schema is not None:
        validate(again, schema, output)
    with replacing(Path(output)) as beside:
        beside.write_bytes(data)


def check_output(output: str) -> None:
    """Before any work: a certificate is an .xml file."""
    from stepgauge.errors import InputError

    if Path(output).suffix.lower() != ".xml":
        raise InputError(output, "not a certificate's name", expected="NAME.xml")

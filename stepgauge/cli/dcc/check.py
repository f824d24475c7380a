"""``stepgauge dcc check``: read a certificate and say what it states."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from stepgauge.dcc.read import Document


@click.command("check")
@click.argument("certificate", metavar="CERT.XML")
@click.option("--schema", metavar="XSD", help="Validate against this schema, too: dcc.xsd with its imports beside it.")
def command(certificate: str, schema: str | None) -> None:
    """Read a Digital Calibration Certificate, check it, and say what it states.

    The schema leaves units and uncertainties open; this checks them: every unit must be D-SI and fit its quantity,
    lists must have equal lengths, results must have an uncertainty with a coverage factor. Exit code 2 otherwise.

    \b
    stepgauge dcc check certificate.xml
    """
    from stepgauge.dcc.read import EXAMPLE, NOMINAL, parse_document
    from stepgauge.dcc.write import FACE
    from stepgauge.dcc.xml import read_xml, validate

    root = read_xml(certificate)
    if schema is not None:
        validate(root, schema, certificate)
    document = parse_document(root, certificate)
    click.echo(f"DCC {document.version}, number {document.number}, laboratory {document.laboratory}")
    click.echo(
        f"item: {document.item}, {document.manufacturer} {document.model or ''}, serial number {document.serial}"
    )
    if EXAMPLE in document.marks:
        click.echo("an example: the certificate says that it is no real calibration")
    own = bool(document.of_kind("stepgauge_effectiveRadius"))
    for line in _errors(document) if own else _quantities(document):
        click.echo(line)
    exact = (FACE, NOMINAL)
    results = [one for one in document.quantities if one.part == "results" and one.expanded is None]
    unsure = [one.name for one in results if not any(one.is_kind(kind) for kind in exact)]
    values = f"units are complete; values without an uncertainty: {', '.join(unsure)}"
    complete = "units and uncertainties are complete" if own or not unsure else values
    click.echo(complete + (f", valid by {schema}" if schema else ""))


def _errors(document: Document) -> Iterator[str]:
    """What a certificate of ours states: effective radii, and each list of errors by its last face."""
    from stepgauge.dcc.results import read_errors

    radii, lists = read_errors(document)
    for radius in radii:
        yield f"R_eff {radius.r_eff_mm:.5f} mm, U {radius.expanded_mm * 1e3:.2f} um (k = {radius.k:.2f})"
    for one in lists:
        if len(one.face):
            yield (
                f"{one.name.upper()}: {len(one.face)} faces; at face {one.face[-1]} ({one.position_mm[-1]:.3f} mm)"
                f" {one.value_um[-1]:.2f} um, U {one.expanded_um[-1]:.2f} um (k = {one.k[-1]:.2f})"
            )


def _quantities(document: Document) -> Iterator[str]:
    """The results of any other certificate."""
    from stepgauge.dcc.write import FACE

    for one in document.quantities:
        if one.part == "results" and FACE not in one.kinds:
            sure = "no uncertainty" if one.expanded is None else f"U up to {one.expanded.max():g}"
            yield f"{one.name}: {len(one.values)} values in {one.unit_text}, {sure}"

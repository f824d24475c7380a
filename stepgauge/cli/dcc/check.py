"""``stepgauge dcc check``: read a certificate and say what it states."""

from __future__ import annotations

import click


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
    from stepgauge.dcc.read import EXAMPLE, parse_document
    from stepgauge.dcc.results import read_errors
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
    if document.of_kind("stepgauge_effectiveRadius"):
        radii, lists = read_errors(document)
        for radius in radii:
            click.echo(f"R_eff {radius.r_eff_mm:.5f} mm, U {radius.expanded_mm * 1e3:.2f} um (k = {radius.k:.2f})")
        for one in lists:
            if len(one.face):
                click.echo(
                    f"{one.name.upper()}: {len(one.face)} faces; at face {one.face[-1]} ({one.position_mm[-1]:.3f} mm)"
                    f" {one.value_um[-1]:.2f} um, U {one.expanded_um[-1]:.2f} um (k = {one.k[-1]:.2f})"
                )
    else:
        for other in document.quantities:
            if other.part == "results" and FACE not in other.kinds:
                sure = "no uncertainty" if other.expanded is None else f"U up to {other.expanded.max():g}"
                click.echo(f"{other.name}: {len(other.values)} values in {other.unit_text}, {sure}")
    click.echo("units and uncertainties are complete" + (f", valid by {schema}" if schema else ""))

"""``stepgauge dcc import-gauge``: the DCC of a step gauge -> gauge file."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import FiniteRange, output, say

SIZE = FiniteRange(0.0, 200.0, min_open=True)


@click.command("import-gauge")
@click.argument("certificate", metavar="CERT.XML")
@output("Gauge file to write, NAME.toml; NAME.csv with the faces goes beside it.")
@click.option("--name", metavar="TEXT", help="What the gauge is called. Default: the item's name.")
@click.option("--serial", metavar="TEXT", help="Serial number. Default: the manufacturer's in the certificate.")
@click.option("--material", metavar="TEXT", help="Material, e.g. steel.")
@click.option(
    "--expansion", "expansion_per_K", type=FiniteRange(0.0, 40e-6), metavar="1/K", help="Expansion, e.g. 11.5e-6 per K."
)
@click.option(
    "--u-expansion",
    "expansion_uncertainty_per_K",
    type=FiniteRange(0.0, 10e-6),
    metavar="1/K",
    help="Standard uncertainty of the expansion, 1/K; 0 only if it is known exactly.",
)
@click.option(
    "--reference-temperature",
    "reference_temperature_C",
    type=FiniteRange(15.0, 30.0),
    metavar="C",
    help="Temperature at which the positions hold, deg C; 20 by ISO 1.",
)
@click.option("--block-width", "block_width_mm", type=SIZE, metavar="MM", help="Width of a block along s, mm.")
@click.option("--block-height", "block_height_mm", type=SIZE, metavar="MM", help="Height above the rail, mm.")
@click.option(
    "--positions", metavar="NAME", help="Name or refType of the list of positions, where there are several candidates."
)
@click.option("--nominal", metavar="NAME", help="Name or refType of the list of nominal positions.")
@click.option(
    "--deviations",
    type=click.Choice(["measured-nominal", "nominal-measured"]),
    help="The list has deviations, subtracted so. Default: by its name, e.g. 'Soll-Ist'; else measured-nominal.",
)
def command(certificate: str, output: str, **options: Any) -> None:
    """A gauge certificate that arrived as a DCC -> a gauge file that all verbs read.

    Positions with their uncertainties and coverage factor, expansion, serial number, laboratory and date are looked for
    in the certificate, in any unit of length that D-SI has. What is not there must be stated with the options, and is
    then taken; where each value comes from is said and kept as comments of the file. Options win over the certificate.

    \b
    stepgauge dcc import-gauge gauge.xml --block-width 20 --block-height 15 -o my-gauge.toml
    """
    from stepgauge.dcc.gauge_read import StatedGauge, import_gauge, write_gauge

    found = import_gauge(certificate, StatedGauge(**options))
    gauge = write_gauge(output, found)
    for line in found.report:
        say(line)
    say(f"wrote {output}: {gauge.n_blocks} blocks, {gauge.position_mm[-1]:.3f} mm, U up to {_largest(gauge):.2f} um")


def _largest(gauge: Any) -> float:
    return float(gauge.u_um.max() * gauge.certificate.coverage_factor)

"""``stepgauge iso10360-5``: points on a test sphere -> probing performance by ISO 10360-5."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.options import (
    NOT_NEGATIVE,
    POSITIVE,
    SUFFIX,
    coverage_option,
    output,
    say,
    say_written,
    tip_diameter_option,
)
from stepgauge.cli.stated import stated_from, stated_options

LIMITS = {"P_Form": "mpe_form", "P_Size": "mpe_size", "L_Dia": "mpe_location"}


@click.command("iso10360-5")
@click.argument("points", nargs=-1, required=True, metavar="POINTS.csv...")
@output("Folder for iso10360-5.json, iso10360-5.csv, the figure and iso10360-5.pdf (made if missing).")
@click.option(
    "--sphere-diameter", type=POSITIVE, required=True, metavar="MM", help="Calibrated diameter of the test sphere, mm."
)
@tip_diameter_option("; once for all styli or once for each.", multiple=True, required=True)
@click.option(
    "--mpe-form", type=POSITIVE, metavar="UM", help="Maximum permissible error of P_Form, um. Default: no decision."
)
@click.option(
    "--mpe-size", type=POSITIVE, metavar="UM", help="Maximum permissible error of P_Size, um. Default: no decision."
)
@click.option(
    "--mpe-location", type=POSITIVE, metavar="UM", help="Maximum permissible error of L_Dia, um. Default: no decision."
)
@click.option(
    "--u-sphere-diameter",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard uncertainty of the diameter, um. Default: not stated.",
)
@click.option(
    "--sphere-form", type=NOT_NEGATIVE, metavar="UM", help="Form error of the test sphere, um. Default: not stated."
)
@click.option(
    "--u-sphere-form",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard uncertainty of that form error, um. Default: not stated.",
)
@click.option(
    "--another-sphere",
    is_flag=True,
    default=None,
    help="The probe was qualified on another sphere, as the standard asks. Without it no conformity is stated.",
)
@coverage_option("in the decision")
@click.option("--machine-name", metavar="TEXT", help="The machine, for the report.")
@SUFFIX
@stated_options()
def command(points: tuple[str, ...], output: str, **options: Any) -> None:
    """Probing performance of a CMM by ISO 10360-5:2020: P_Form and P_Size from 25 points on a test sphere.

    POINTS.csv holds recorded tip centres, before any radius compensation, and the unit vectors of travel, as for 'probe
    qualify': x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. One file is the test of a single stylus; five files,
    one for each stylus or way of it, are the multi-stylus test, with the location value L_Dia. The sphere must not be
    the one that the probe was qualified on. The decision rule is that of ISO 14253-1.

    \b
    stepgauge probe sphere omp40-2-50mm --sphere-diameter 25 -o sphere.csv
    stepgauge iso10360-5 sphere.csv --sphere-diameter 25 --tip-diameter 5.991 --mpe-form 12 --mpe-size 10 \\
        --sphere-form 0.1 --u-sphere-form 0.03 --u-sphere-diameter 0.1 -o probing
    """
    from stepgauge.probes.files import read_points
    from stepgauge.reports.iso10360_5 import report_probing
    from stepgauge.standards.iso10360_5 import ProbingLimits, TestSphere, probing_test
    from stepgauge.standards.iso10360_5_files import overall
    from stepgauge.standards.iso10360_5_rules import rules_of
    from stepgauge.standards.rules import incomplete

    names = ("sphere_diameter", "u_sphere_diameter", "sphere_form", "u_sphere_form", "another_sphere")
    limits = ProbingLimits({name: options[key] for name, key in LIMITS.items()}, options["coverage_factor"])
    sphere = TestSphere(*(options[name] for name in names))
    test = probing_test([read_points(path) for path in points], sphere, options["tip_diameter"], limits)
    written, notes = report_probing(
        output, test, stated_from(options), options["machine_name"], options["template"], options["suffix"]
    )
    for note in (*test.conditions.notes, *notes):
        say(f"note: {note}")
    for one in test.values:
        say(f"{one.symbol}: {one.value_um:.2f} um")
    say(overall(test))
    for text in incomplete(rules_of(test)):
        say(f"- {text}")
    say_written(*written)

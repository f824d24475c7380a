"""``stepgauge iso230-3``: displacements over time -> drift tests by ISO 230-3."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import POSITIVE, SUFFIX, output, say, say_written
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.standards.drift import Drift


@click.command("iso230-3")
@click.argument("source", metavar="TABLE|RECORDING")
@click.option(
    "--test",
    "kind",
    type=click.Choice(["etve", "axis"]),
    required=True,
    help="etve: the machine stands still while the room changes. axis: an axis moves and warms up.",
)
@click.option(
    "--gauge",
    "-g",
    metavar="GAUGE",
    help="What is given is a recording of this step gauge along the axis, with time_s (only with --test axis).",
)
@output("Folder for iso230-3.json, iso230-3.csv, the figure and iso230-3.pdf (made if missing).")
@click.option(
    "--tolerance",
    multiple=True,
    metavar="NAME=UM",
    help="Tolerance of the range of a displacement, um, e.g. x1=8; may be given for several.",
)
@click.option(
    "--expanded-uncertainty",
    type=POSITIVE,
    metavar="UM",
    help="Expanded uncertainty U (k = 2) of the ranges, um. Default: not stated, and conformity is then not proven.",
)
@SUFFIX
@stated_options()
def command(source: str, kind: str, gauge: str | None, output: str, **options: Any) -> None:
    """Drift tests of a machine tool by ISO 230-3:2020: ETVE, and thermal distortion by moving a linear axis.

    TABLE is a CSV file with time_s, displacements NAME_um (of the sensors: x1_um, y1_um, ..) and temperatures NAME_C.
    The ETVE of a displacement is its range over the test. For a linear axis d_60 is the range in the first 60 min and
    d_t that of the whole test; instead of a table a RECORDING of a step gauge along the axis will do (--gauge): its
    blocks at the low and the high end of the axis are the targets P1 and P2, approached in both directions of the axis.
    A displacement is then the change of the indicated position along the axis.

    \b
    stepgauge iso230-3 sensors.csv --test etve --tolerance x1=8 --expanded-uncertainty 0.6 -o etve
    stepgauge iso230-3 warm-up.csv --test axis -g step-gauge-600 -o warm-up
    """
    from stepgauge.reports.drift import report_drift
    from stepgauge.standards.drift import drift_test
    from stepgauge.standards.drift_rules import rules_of
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.standards.rules import incomplete

    if gauge is not None and kind == "etve":
        raise click.UsageError("--gauge goes with --test axis: an ETVE test moves nothing.")
    drift = _read(source, gauge)
    requirement = Requirement.parse(options["tolerance"], options["expanded_uncertainty"], list(drift.displacement_um))
    test = drift_test(drift, "etve" if kind == "etve" else "axis", requirement)
    written, notes = report_drift(output, test, stated_from(options), options["template"], options["suffix"])
    for note in (*test.conditions.notes, *notes):
        say(f"note: {note}")
    for one in test.channels:
        say(
            f"{one.name}: range {one.range_um:.2f} um, first 60 min {one.first_hour_um:.2f} um, end {one.end_um:.2f} um"
        )
    say(test.requirement.text([("", test.values_um)]))
    for text in incomplete(rules_of(test)):
        say(f"- {text}")
    say_written(*written)


def _read(source: str, gauge: str | None) -> Drift:
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.recording import read_recording
    from stepgauge.standards.drift import drift_of_recording, read_drift

    if gauge is None:
        return read_drift(source)
    return drift_of_recording(read_recording(source), read_gauge(gauge))

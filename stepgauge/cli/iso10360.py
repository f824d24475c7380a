"""``stepgauge iso10360``: recordings in seven positions -> the length measurement test of ISO 10360-2."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    GAUGE,
    NOT_NEGATIVE,
    PLACEMENTS,
    POSITIVE,
    SUFFIX,
    FiniteRange,
    machine_option,
    mpe_from,
    mpe_options,
    output,
    say,
    say_written,
)
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine_file import Machine
    from stepgauge.recording import Recording
    from stepgauge.standards.iso10360 import LengthTest


@click.command("iso10360")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for iso10360.json, iso10360.csv, the figure and iso10360.pdf (made if missing).")
@mpe_options(True, "Maximum permissible error")
@click.option("--mpe-repeatability", type=POSITIVE, metavar="UM", help="Limit of the repeatability range R0, um.")
@machine_option(False, "Machine file or shipped name: its travel tells whether positions and lengths are those asked.")
@PLACEMENTS
@click.option(
    "--tip-diameter",
    type=POSITIVE,
    metavar="MM",
    help="Effective tip diameter as the machine's qualification on its sphere gave it, mm. Default: 2 R_eff from the"
    " gauge's own first block, which hides an error of size; the report says so.",
)
@click.option(
    "--u-tip-diameter",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard uncertainty of that diameter, um; leave out where it is the machine's own and so part of the test.",
)
@click.option(
    "--unidirectional",
    "side",
    type=click.Choice(["fronts", "backs"]),
    default="fronts",
    show_default=True,
    help="Faces that unidirectional lengths lie between.",
)
@click.option(
    "--lengths",
    metavar="MM,...",
    help="Nominal bidirectional lengths to test, mm, five of them. Default: shortest, longest and three between.",
)
@click.option(
    "--u-gauge-temperature",
    type=NOT_NEGATIVE,
    metavar="K",
    help="Standard uncertainty of the gauge's temperature, K. Default: not counted, and said.",
)
@click.option(
    "--u-alignment",
    type=NOT_NEGATIVE,
    metavar="MRAD",
    help="Standard uncertainty of the angle between gauge and evaluated axis, in each direction across it, mrad."
    " Default: not counted, and said.",
)
@click.option(
    "--u-fixture",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard uncertainty by the gauge's fixture, um. Default: not counted, and said.",
)
@click.option(
    "--coverage-factor",
    "-k",
    type=FiniteRange(1.0, 4.0),
    default=2.0,
    show_default=True,
    metavar="K",
    help="Factor from standard to expanded uncertainty in the decision.",
)
@SUFFIX
@stated_options()
def command(recordings: tuple[str, ...], gauge: str, output: str, machine: str | None, **options: Any) -> None:
    """Test of a CMM's errors of length measurement by ISO 10360-2, from recordings of a step gauge.

    Every placement is a measuring position (seven files, or one with a column placement), every cycle a repeat. In each
    position five lengths are tested, bidirectional (front of a block to the back of another, less the tip diameter) and
    unidirectional, three repeats each. Errors and repeatability ranges are compared with what is permitted by the rule
    of ISO 14253-1: the expanded uncertainty of the test is taken off the tolerance, so that an error conforms, does not
    conform, or is not decidable. Rules of the standard that the recordings do not meet make the test incomplete; each
    is named, and so is all that is left out.

    'stepgauge plan --iso10360' makes the seven placements and their programs.

    \b
    stepgauge iso10360 position-*.csv -g step-gauge-1020 -m bridge-cmm --mpe "1.8 + L/350" \\
        --mpe-repeatability 1.5 --tip-diameter 3.9940 --u-gauge-temperature 0.05 -o iso10360
    """
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.recording import read_recordings
    from stepgauge.report.iso10360 import report_length_test
    from stepgauge.standards.iso10360_files import statements

    if options["u_tip_diameter"] is not None and options["tip_diameter"] is None:
        raise click.UsageError("--u-tip-diameter needs --tip-diameter.")
    steps = read_gauge(gauge)
    cmm = read_machine(machine) if machine else None
    test = _test(read_recordings(recordings), steps, cmm, options)
    written, notes = report_length_test(output, test, stated_from(options), cmm, options["template"], options["suffix"])
    for note in notes:
        say(f"note: {note}")
    for text in statements(test):
        say(f"- {text}")
    say_written(*written)


def _test(recording: Recording, gauge: Gauge, machine: Machine | None, options: dict[str, Any]) -> LengthTest:
    from stepgauge.placement import read_placements
    from stepgauge.standards.iso10360 import Choices, Specification, length_test
    from stepgauge.standards.length_uncertainty import TestConditions

    limit = mpe_from(options)
    if limit is None:
        raise click.UsageError("--mpe is empty.")
    return length_test(
        recording,
        gauge,
        Specification(limit, options["mpe_repeatability"]),
        TestConditions(
            options["u_gauge_temperature"],
            options["u_alignment"],
            options["u_fixture"],
            options["u_tip_diameter"],
            options["coverage_factor"],
        ),
        Choices(options["tip_diameter"], options["side"], _lengths(options["lengths"])),
        machine,
        read_placements(options["placement_files"], gauge),
    )


def _lengths(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        lengths = tuple(float(part) for part in text.split(","))
    except ValueError:
        lengths = ()
    if not lengths or not all(math.isfinite(length) and length > 0.0 for length in lengths):
        raise click.BadParameter(f"{text!r} are no lengths (mm, separated by commas)", param_hint="--lengths")
    return lengths

"""``stepgauge iso10360``: recordings in seven positions -> the length measurement test of ISO 10360-2."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, FiniteRange, machine_option, output, say
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine_file import Machine
    from stepgauge.recording import Recording
    from stepgauge.standards.iso10360 import LengthTest

POSITIVE = FiniteRange(min=0.0, min_open=True)
NOT_NEGATIVE = FiniteRange(min=0.0)


@click.command("iso10360")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@click.option("--mpe", required=True, metavar="TEXT", help='Permissible error "A + L/K": um, with L in mm.')
@click.option("--mpe-cap", type=POSITIVE, metavar="UM", help="The permissible error is never above this, um.")
@click.option("--mpe-repeatability", type=POSITIVE, metavar="UM", help="Limit of the repeatability range R0, um.")
@output("Folder for iso10360.json, iso10360.csv, the figure and iso10360.pdf (made if missing).")
@machine_option(False, "Machine file or shipped name: its travel tells whether positions and lengths are those asked.")
@click.option(
    "--placement",
    "-p",
    "placement_files",
    multiple=True,
    metavar="P",
    help="Placement file; once per position, in order. Default: the axis is the mean approach.",
)
@click.option(
    "--tip-diameter",
    type=POSITIVE,
    metavar="MM",
    help="Effective tip diameter as the machine's qualification on its sphere gave it, mm. Default: 2 R_eff from the"
    " gauge's own first block, which hides an error of size; the report says so.",
)
@click.option(
    "--tip-diameter-u",
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
    help="Nominal bidirectional lengths to test, mm, five of them; default: shortest, longest and three between.",
)
@click.option("--temperature-u", type=NOT_NEGATIVE, metavar="K", help="Standard uncertainty of gauge temperature, K.")
@click.option(
    "--alignment-u",
    type=NOT_NEGATIVE,
    metavar="MRAD",
    help="Standard uncertainty of the angle between gauge and evaluated axis, in each direction across it, mrad.",
)
@click.option("--fixture-u", type=NOT_NEGATIVE, metavar="UM", help="Standard uncertainty by the gauge's fixture, um.")
@click.option(
    "--coverage-factor",
    type=FiniteRange(1.0, 4.0),
    default=2.0,
    show_default=True,
    metavar="K",
    help="Factor from standard to expanded uncertainty in the decision.",
)
@click.option("--figure", "suffix", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True)
@stated_options
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
        --mpe-repeatability 1.5 --tip-diameter 3.9940 --temperature-u 0.05 -o iso10360
    """
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.recording import join_recordings, read_recording

    if options["tip_diameter_u"] is not None and options["tip_diameter"] is None:
        raise click.UsageError("--tip-diameter-u needs --tip-diameter.")
    steps = read_gauge(gauge)
    cmm = read_machine(machine) if machine else None
    tables = [read_recording(path) for path in recordings]
    recording = tables[0] if len(tables) == 1 else join_recordings(tables)
    test = _test(recording, steps, cmm, options)
    written = _write(Path(output), test, cmm, options)
    _tell(test)
    say("wrote " + ", ".join(str(path) for path in written))


def _test(recording: Recording, gauge: Gauge, machine: Machine | None, options: dict[str, Any]) -> LengthTest:
    from stepgauge.placement import read_placement
    from stepgauge.standards.decision import parse_mpe
    from stepgauge.standards.iso10360 import Choices, Specification, length_test
    from stepgauge.standards.length_uncertainty import TestConditions

    return length_test(
        recording,
        gauge,
        Specification(parse_mpe(options["mpe"], options["mpe_cap"]), options["mpe_repeatability"]),
        TestConditions(
            options["temperature_u"],
            options["alignment_u"],
            options["fixture_u"],
            options["tip_diameter_u"],
            options["coverage_factor"],
        ),
        Choices(options["tip_diameter"], options["side"], _lengths(options["lengths"])),
        machine,
        [read_placement(path, gauge) for path in options["placement_files"]],
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


def _write(folder: Path, test: LengthTest, machine: Machine | None, options: dict[str, Any]) -> list[Path]:
    from stepgauge.figures.iso10360 import length_test_figure
    from stepgauge.figures.style import save_figure
    from stepgauge.report.iso10360 import length_test_content
    from stepgauge.report.render import write_report
    from stepgauge.report.standards import template
    from stepgauge.standards.iso10360_files import write_length_test

    figure, report = folder / f"iso10360-figure.{options['suffix']}", folder / "iso10360.pdf"
    content = length_test_content(test, stated_from(options), machine)
    for note in write_report(report, content, options["template"] or template()):  # first: a template may fail
        say(f"note: {note}")
    paths = write_length_test(folder, test)
    save_figure(length_test_figure(test), figure)
    return [*paths, figure, report]


def _tell(test: LengthTest) -> None:
    from stepgauge.standards.iso10360_files import statements

    for text in statements(test):
        say(f"- {text}")

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
    TEMPERATURE_CONVENTION,
    U_TEMPERATURE_K,
    coverage_option,
    machine_option,
    mpe_from,
    mpe_options,
    output,
    say,
    say_written,
    tip_diameter_option,
)
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.machine.file import Machine
    from stepgauge.recording import Recording
    from stepgauge.standards.iso10360 import LengthTest
    from stepgauge.standards.iso10360_series import Series
    from stepgauge.standards.mpe import Mpe


@click.command("iso10360")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for iso10360.json, iso10360.csv, the figure and iso10360.pdf (made if missing).")
@mpe_options(True, "E0,MPE: maximum permissible error of length measurement")
@click.option("--mpe-repeatability", type=POSITIVE, metavar="UM", help="R0,MPL: limit of the range R0, um.")
@machine_option(False, "Machine file or shipped name: its travel tells whether positions and lengths are those asked.")
@PLACEMENTS
@click.option(
    "--offset-recording",
    "offset_files",
    multiple=True,
    metavar="RECORDING",
    help="Recording with the stylus tip 150 mm off the axis of the ram: E150. Once per position, two of them.",
)
@click.option("--mpe-offset", metavar="LIMIT", help='E150,MPE, "A + L/K"; needed with --offset-recording.')
@click.option("--offset-machine", metavar="MACHINE", help="Machine file with the stylus of the --offset-recording.")
@click.option(
    "--normal",
    "normal_file",
    metavar="RECORDING",
    help="Beside a gauge of low expansion: recording of a gauge of normal expansion, a length or more, three repeats.",
)
@click.option("--normal-gauge", metavar="GAUGE", help="The gauge of --normal.")
@tip_diameter_option(
    ". Default: 2 R_eff from the gauge's own first block, which hides an error of size; the report says so."
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
    type=U_TEMPERATURE_K,
    metavar="K",
    help="Standard uncertainty of the gauge's temperature, K. Default: not evaluated, and listed.",
)
@click.option(
    "--u-alignment",
    type=NOT_NEGATIVE,
    metavar="MRAD",
    help="Standard uncertainty of the angle between gauge and evaluated axis, in each direction across it, mrad."
    " Default: not evaluated, and listed.",
)
@click.option(
    "--u-fixture",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard uncertainty by the gauge's fixture, um. Default: not evaluated, and listed.",
)
@click.option(
    "--also",
    multiple=True,
    type=click.Choice(["b89", "vdi2617"]),
    help="Judge the same errors by ASME B89.4.10360.2 or VDI/VDE 2617, too; repeatable; unconfirmed.",
)
@coverage_option("in the decision")
@TEMPERATURE_CONVENTION
@SUFFIX
@stated_options()
def command(recordings: tuple[str, ...], gauge: str, output: str, machine: str | None, **options: Any) -> None:
    """Test of a CMM's errors of length measurement by ISO 10360-2:2009, from recordings of a step gauge.

    Every placement is a measuring position (seven files, or one with a column placement), every cycle a repeat. The
    four body diagonals are mandatory, three positions are the user's choice. In each position five lengths are tested
    with three repeats: bidirectional ones (front of a block to back of another, minus the tip diameter), which are E0,
    and unidirectional ones for information. R0 is the range of the three repeats. The decision rule is that of ISO
    14253-1: the expanded uncertainty of the test is subtracted from the limit, so that a test value conforms, does not
    conform, or is not decidable. Rules of the standard that are not met make the test incomplete; each is named, and so
    is what is left out.

    'stepgauge test plan' makes the seven placements and their programs.

    \b
    stepgauge iso10360 position-*.csv -g step-gauge-1020 -m bridge-cmm --mpe "1.8 + L/350" \\
        --mpe-repeatability 1.5 --tip-diameter 3.9940 --u-gauge-temperature 0.05 -o iso10360
    """
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.machine.file import read_machine
    from stepgauge.recording import read_recordings
    from stepgauge.recording.conventions import state_convention
    from stepgauge.reports.iso10360 import report_length_test
    from stepgauge.standards.iso10360_statements import overall, statements

    _check_options(options)
    steps = read_gauge(gauge)
    cmm = read_machine(machine) if machine else None
    recording = state_convention(read_recordings(recordings), options["temperature_convention"])
    test = _test(recording, steps, cmm, options)
    further = _further(steps, cmm, options)
    written, notes = report_length_test(
        output, test, stated_from(options), cmm, options["template"], options["suffix"], further
    )
    for note in notes:
        say(f"note: {note}")
    say(overall([test, *further]).text)
    for text in (text for one in (test, *further) for text in statements(one)):
        say(f"- {text}")
    say_written(*written)


def _check_options(options: dict[str, Any]) -> None:
    for one, other in (
        ("u_tip_diameter", "tip_diameter"),
        ("offset_files", "mpe_offset"),
        ("mpe_offset", "offset_files"),
        ("normal_file", "normal_gauge"),
        ("normal_gauge", "normal_file"),
    ):
        if options[one] not in (None, ()) and options[other] in (None, ()):
            first, second = (f"--{name.replace('_files', '_recording').removesuffix('_file')}" for name in (one, other))
            raise click.UsageError(f"{first} needs {second}.".replace("_", "-"))


def _further(gauge: Gauge, machine: Machine | None, options: dict[str, Any]) -> list[LengthTest]:
    """The series beside E0 that were measured."""
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.machine.file import read_machine
    from stepgauge.recording import read_recordings
    from stepgauge.standards.iso10360_series import E150, NORMAL
    from stepgauge.standards.mpe import Mpe

    bare = {**options, "placement_files": (), "lengths": None, "normal_file": None}
    tests = []
    if options["normal_file"]:
        recording = read_recordings((options["normal_file"],))
        tests.append(_test(recording, read_gauge(options["normal_gauge"]), machine, bare, NORMAL))
    if options["offset_files"]:
        stylus = read_machine(options["offset_machine"]) if options["offset_machine"] else machine
        limit = Mpe.parse(options["mpe_offset"])
        tests.append(_test(read_recordings(options["offset_files"]), gauge, stylus, bare, E150, limit))
    return tests


def _test(
    recording: Recording,
    gauge: Gauge,
    machine: Machine | None,
    options: dict[str, Any],
    series: Series | None = None,
    limit: Mpe | None = None,
) -> LengthTest:
    from stepgauge.gauge.placement import read_placements
    from stepgauge.standards.iso10360 import Choices, Specification, length_test
    from stepgauge.standards.iso10360_series import E0
    from stepgauge.standards.length_uncertainty import TestConditions

    limit = limit or mpe_from(options)
    if limit is None:
        raise click.UsageError("--mpe is empty.")
    names = ("u_gauge_temperature", "u_alignment", "u_fixture", "u_tip_diameter", "coverage_factor")
    return length_test(
        recording,
        gauge,
        Specification(
            limit,
            options["mpe_repeatability"] if series is None else None,
            tuple(options["also"]) if series is None else (),
        ),
        TestConditions(*(options[name] for name in names)),
        Choices(
            options["tip_diameter"], options["side"], _lengths(options["lengths"]), options["normal_file"] is not None
        ),
        machine,
        read_placements(options["placement_files"], gauge),
        series or E0,
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

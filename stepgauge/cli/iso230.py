"""``stepgauge iso230``: a recording along an axis -> accuracy and repeatability of positioning."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    GAUGE_IF_NEEDED,
    PLACEMENTS,
    POSITIVE,
    SUFFIX,
    TEMPERATURE_CONVENTION,
    is_typed,
    machine_option,
    output,
    say,
    say_written,
)
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.machine.file import Machine
    from stepgauge.standards.positioning import PositioningTest


@click.command("iso230")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE_IF_NEEDED
@output("Folder for iso230.json, iso230.csv, iso230-deviations.csv, the figures and iso230.pdf (made if missing).")
@machine_option(False, "Machine file or shipped name: tells how much of the axis was measured.")
@PLACEMENTS
@click.option(
    "--tip-diameter",
    type=POSITIVE,
    metavar="MM",
    help="Effective tip diameter found independently of the reversal, mm. Default: 2 R_eff from the gauge's own first"
    " block, whose reversal is then zero by construction.",
)
@click.option(
    "--pair",
    "pairing",
    type=click.Choice(["middle", "faces"]),
    default="middle",
    show_default=True,
    help="Front and back of a block as one target: run means carried to the block's middle along neighbouring faces, or"
    " taken as they are, a block apart.",
)
@click.option(
    "--actual",
    type=click.Choice(["reading", "target"]),
    help="Of a recording of one axis: what the actual position is. Default: the reading of an instrument; of a probe"
    " that touches, the target.",
)
@click.option(
    "--tolerance",
    multiple=True,
    metavar="NAME=UM",
    help="Tolerance of a parameter, um (of a rotary axis arcsec), e.g. A=10 or R_up=4; may be given for several.",
)
@click.option(
    "--also",
    "further",
    multiple=True,
    type=click.Choice(["vdi3441", "b5.54"]),
    help="Evaluate the same deviations by VDI/DGQ 3441 or ASME B5.54, too; repeatable.",
)
@click.option(
    "--expanded-uncertainty",
    type=POSITIVE,
    metavar="UM",
    help="Expanded uncertainty U (k = 2) of the parameters, um (arcsec), as estimated by ISO/TR 230-9. Default: not"
    " stated, and conformity is then not proven.",
)
@TEMPERATURE_CONVENTION
@SUFFIX
@stated_options()
def command(recordings: tuple[str, ...], gauge: str | None, output: str, machine: str | None, **options: Any) -> None:
    """Accuracy and repeatability of positioning of an axis by ISO 230-2:2014, with a step gauge or an instrument.

    Every block is a target position, every cycle a run. Fronts are approached in one direction, backs in the other; the
    tip diameter is subtracted from the backs. Gives the accuracy A, the systematic deviation E, the repeatability R
    (of each direction and of both), the reversal error B and its mean, the mean bidirectional deviation M, and the
    standard's figure. A deviation is the actual position minus the target, so its sign is opposite to that of XF and
    XB in evaluate.

    A recording of one axis ('stepgauge import --sensor') needs no gauge: its targets are the target positions, its
    cycles the runs. The results of a rotary axis up to 360 deg are in deg and arcsec. Where targets were approached
    from one side only, the parameters of that direction are given (A_up, E_up, R_up, or down).

    Several recordings are several axes. Requirements of the standard that are not met are listed.

    \b
    stepgauge iso230 recording.csv -g step-gauge-420 -o positioning
    stepgauge iso230 x.csv y.csv -g my-gauge.toml -m my-machine.toml --tip-diameter 3.9940 -o positioning
    stepgauge iso230 axis.csv --tolerance A=12 -o positioning
    """
    from stepgauge.axis.recording import is_axis_recording
    from stepgauge.machine.file import read_machine
    from stepgauge.reports.iso230 import report_positioning

    cmm = read_machine(machine) if machine else None
    of_axis = is_axis_recording(recordings[0])
    if of_axis and is_typed("gauge"):
        raise click.UsageError("--gauge is for recordings of a step gauge; a recording of one axis has its own targets")
    test = _axis_test(recordings, options) if of_axis else _gauge_test(recordings, gauge, cmm, options)
    test = replace(test, further=options["further"])
    written, notes = report_positioning(output, test, stated_from(options), cmm, options["template"], options["suffix"])
    for note in (*test.conditions.notes, *notes):
        say(f"note: {note}")
    _tell(test)
    say_written(*written)


def _gauge_test(
    recordings: tuple[str, ...], gauge: str | None, cmm: Machine | None, options: dict[str, Any]
) -> PositioningTest:
    """The test from recordings of a step gauge."""
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.recording import read_recordings
    from stepgauge.recording.conventions import state_convention
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.standards.positioning import positioning_test

    if gauge is None:
        raise click.UsageError("a recording of a step gauge needs --gauge")
    if options["actual"]:
        raise click.UsageError("--actual is for a recording of one axis; a step gauge's positions are certified")
    requirement = Requirement.parse(options["tolerance"], options["expanded_uncertainty"])
    steps = read_gauge(gauge)
    placements = read_placements(options["placement_files"], steps)
    recording = state_convention(read_recordings(recordings), options["temperature_convention"])
    return positioning_test(recording, steps, options["tip_diameter"], options["pairing"], cmm, placements, requirement)


def _axis_test(recordings: tuple[str, ...], options: dict[str, Any]) -> PositioningTest:
    """The test from recordings of one axis, which have no tip."""
    from stepgauge.axis.recording import join_axis_recordings, read_axis_recording
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.standards.positioning_axis import axis_positioning_test

    if options["tip_diameter"] is not None:
        raise click.UsageError("--tip-diameter is for a step gauge; a recording of one axis has no tip")
    requirement = Requirement.parse(options["tolerance"], options["expanded_uncertainty"])
    recording = join_axis_recordings([read_axis_recording(path) for path in recordings])
    return axis_positioning_test(recording, options["actual"], requirement)


def _tell(test: PositioningTest) -> None:
    from stepgauge.standards.iso230_decision import parameters_um
    from stepgauge.standards.iso230_files import statements
    from stepgauge.standards.positioning_further import LABELS, further_um

    unit = test.units.deviation
    for one in test.axes:
        told = ", ".join(f"{name} {value:.2f} {unit}" for name, value in parameters_um(one.parameters).items())
        say(f"placement {one.placement}, {one.name}: {told}; {len(one.targets.block)} targets, {len(one.runs)} runs")
    say(test.requirement.text([(one.name, parameters_um(one.parameters)) for one in test.axes]))
    for one in test.axes:
        for name, found in further_um(one.parameters, test.further).items():
            told = ", ".join(f"{known} {value:.2f} {unit}" for known, value in found["parameters_um"].items())
            say(f"{one.name} by {LABELS[name]}: {told} (unconfirmed)")
    for text in statements(test):
        say(f"- {text}")

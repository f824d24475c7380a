"""``stepgauge iso230``: a recording along an axis -> accuracy and repeatability of positioning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    GAUGE,
    NOT_NEGATIVE,
    PLACEMENTS,
    POSITIVE,
    SUFFIX,
    machine_option,
    output,
    say,
    say_written,
)
from stepgauge.cli.stated import stated_from, stated_options

if TYPE_CHECKING:
    from stepgauge.standards.positioning import PositioningTest


@click.command("iso230")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
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
    "--tolerance",
    multiple=True,
    metavar="NAME=UM",
    help="Tolerance of a parameter, um, e.g. A=10 or R_up=4; may be given for several.",
)
@click.option(
    "--expanded-uncertainty",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Expanded uncertainty U (k = 2) of the parameters, um, as estimated by ISO/TR 230-9. Default: not stated, and"
    " conformity is then not proven.",
)
@SUFFIX
@stated_options()
def command(recordings: tuple[str, ...], gauge: str, output: str, machine: str | None, **options: Any) -> None:
    """Accuracy and repeatability of positioning of an axis by ISO 230-2:2014, with the step gauge along it.

    Every block is a target position, every cycle a run. Fronts are approached in one direction, backs in the other; the
    tip diameter is subtracted from the backs. Gives the accuracy A, the systematic deviation E, the repeatability R
    (of each direction and of both), the reversal B and its mean, the mean bidirectional deviation M, and the
    standard's figure. A deviation is the actual position minus the target, so its sign is opposite to that of XF and
    XB in evaluate.

    Several recordings are several axes. What the recording does not meet of the standard is named.

    \b
    stepgauge iso230 recording.csv -g step-gauge-420 -o positioning
    stepgauge iso230 x.csv y.csv -g my-gauge.toml -m my-machine.toml --tip-diameter 3.9940 -o positioning
    """
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.machine.file import read_machine
    from stepgauge.recording import read_recordings
    from stepgauge.reports.iso230 import report_positioning
    from stepgauge.standards.iso230_decision import Requirement
    from stepgauge.standards.positioning import positioning_test

    requirement = Requirement.parse(options["tolerance"], options["expanded_uncertainty"])
    steps = read_gauge(gauge)
    cmm = read_machine(machine) if machine else None
    placements = read_placements(options["placement_files"], steps)
    recording = read_recordings(recordings)
    test = positioning_test(recording, steps, options["tip_diameter"], options["pairing"], cmm, placements, requirement)
    written, notes = report_positioning(output, test, stated_from(options), cmm, options["template"], options["suffix"])
    for note in notes:
        say(f"note: {note}")
    _tell(test)
    say_written(*written)


def _tell(test: PositioningTest) -> None:
    from stepgauge.standards.iso230_decision import parameters_um
    from stepgauge.standards.iso230_files import statements

    for one in test.axes:
        p = one.parameters
        say(
            f"placement {one.placement}, {one.name}: A {p.A_um:.2f} um, E {p.E_um:.2f} um, R {p.R_um:.2f} um,"
            f" B {p.B_um:.2f} um (mean {p.mean_B_um:.2f} um), M {p.M_um:.2f} um; {len(one.targets.block)} targets,"
            f" {len(one.runs)} runs"
        )
    say(test.requirement.text([(one.name, parameters_um(one.parameters)) for one in test.axes]))
    for text in statements(test):
        say(f"- {text}")

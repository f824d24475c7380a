"""``stepgauge locate``: 16 probed points -> how the gauge lies."""

from __future__ import annotations

import click

from stepgauge.cli.options import GAUGE, NOT_NEGATIVE, POSITIVE, machine_option, output, say_lines, say_written


@click.command("locate")
@click.argument("points", metavar="POINTS")
@GAUGE
@output("Placement file to write (TOML).")
@click.option("--blocks", metavar="A:B", help="Blocks that were probed. Default: the first and the last of the gauge.")
@machine_option(False, "Machine file; gives tip radius and repeatability where they are not stated.")
@click.option(
    "--tip-radius",
    type=POSITIVE,
    metavar="MM",
    help="Nominal tip radius, mm, checked against the points. Default: the machine's, if given.",
)
@click.option(
    "--repeatability",
    type=NOT_NEGATIVE,
    metavar="UM",
    help="Standard deviation of a probed coordinate, um. Default: the machine's, or 1.",
)
@click.option(
    "--turned",
    is_flag=True,
    help="The gauge rises by more than 50 deg, or is turned about its axis by more than 30 deg. Without this option"
    " such points are refused, for exchanged columns look the same.",
)
def command(
    points: str,
    gauge: str,
    output: str,
    blocks: str | None,
    machine: str | None,
    tip_radius: float | None,
    repeatability: float | None,
    turned: bool,
) -> None:
    """Find how the step gauge lies from 16 points probed by hand.

    POINTS is a CSV file with the columns point,x_mm,y_mm,z_mm, or the log of the program of 'stepgauge plan --teach':
    tip centres, not corrected for the tip radius. Points 1-8 lie on the first block, 9-16 in the same order on the
    last block:

    \b
      1 2 3  front face, not in line        6  top
      4      side at +s (right, looking     7  rail beside the block
             along the gauge, top up)       8  back face
      5      side at -s

    The side direction is s = a x up, with a from the first to the last block. At point 7 the ball rests on the rail,
    clear of the block:

    \b
                  6             up
             .----o----.        |   a (away from you)
             |    3    |        | /
           5 o         o 4      |/____ s
             |  1   2  | 7
         ____|_________|_o_     8 is on the back,
        |_______rail_______|    behind 1 2 3

    Writes centres C1 and C2, axis, up direction, yaw and pitch, the angle of the block normals to the axis, and
    standard uncertainties. Points that contradict the certificate or each other are refused, with the slip that would
    explain them: which point is off and by how much, two exchanged, or another gauge. Smaller contradictions enlarge
    the uncertainties.

    \b
    stepgauge locate points.csv --gauge step-gauge-420 -o placement.toml
    """
    from stepgauge.files.budget import file_budget, within
    from stepgauge.files.text import check_output
    from stepgauge.public.locate import locate

    check_output(output, points, gauge, machine)
    click.get_current_context().with_resource(within(file_budget(points), points))
    placement = locate(
        points,
        gauge,
        machine=machine,
        blocks=blocks,
        tip_radius_mm=tip_radius,
        repeatability_um=repeatability,
        turned=turned,
    )
    placement.write(output)
    say_lines(placement.summary())
    say_written(output)

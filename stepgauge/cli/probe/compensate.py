"""``stepgauge probe compensate``: recorded points -> surface points, without the probe's pre-travel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from stepgauge.cli.options import output, plot_option, say, say_written, show

if TYPE_CHECKING:
    from stepgauge.probes.qualification import Method


@click.command("compensate")
@click.argument("points", metavar="POINTS.csv")
@click.option(
    "--qualification",
    "-q",
    required=True,
    metavar="FILE",
    help="What 'stepgauge probe qualify' found for this tip (a JSON file made with --tip-diameter).",
)
@output("Table to write (CSV): that of POINTS.csv with the new columns.")
@click.option(
    "--method",
    type=click.Choice(["lobed", "mean"]),
    default="lobed",
    show_default=True,
    help="Correct for the pre-travel of each direction, or for its mean in all directions as controllers do (R_eff).",
)
@click.option(
    "--on-sphere",
    is_flag=True,
    help="The points lie on one sphere: report its diameter and form error for both methods.",
)
@plot_option("The correction of each point; with --on-sphere the errors before and after, across and along the stylus")
def command(points: str, qualification: str, method: Method, on_sphere: bool, output: str, plot: str | None) -> None:
    """Correct recorded points for the probe's pre-travel and find the points of the surface.

    POINTS.csv holds recorded tip centres and unit vectors of travel towards the surface: columns
    x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Other columns are kept. New columns: pretravel_um (the correction),
    centre_x_mm... (tip centre at the first touch) and surface_x_mm... (the tip radius further along the approach).

    \b
    stepgauge probe compensate part.csv -q qualification.json -o part-compensated.csv
    """
    from stepgauge.probes.compensation import compensate_points, compensation_warnings, spheres, write_compensated
    from stepgauge.probes.files import read_points
    from stepgauge.probes.qualification import read_qualification

    found, probed = read_qualification(qualification), read_points(points)
    result = compensate_points(probed, found, method, qualification)
    fits = spheres(probed, found) if on_sphere else {}
    write_compensated(output, result)
    if plot is not None:
        from stepgauge.figures.qualification import draw_compensation, draw_sphere_errors

        simulated = probed.simulated or found.simulated
        if fits:
            draw_sphere_errors(probed.approach, fits, found.stylus_axis, plot, simulated)
        else:
            draw_compensation(probed.approach, result.pretravel_um, found.stylus_axis, plot, simulated)
    taken = result.pretravel_um
    show(f"{len(taken)} points; corrected by a pre-travel of {taken.min():.2f} to {taken.max():.2f} um")
    for name, fit in fits.items():
        show(f"{name:<12} diameter {2 * fit.radius_mm:.5f} mm, form error {fit.form_error_um:.2f} um")
    for warning in compensation_warnings(found, method, fits):
        say(f"warning: {warning}")
    say_written(output, plot)

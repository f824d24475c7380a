"""``stepgauge probe compensate``: recorded points -> surface points, without the probe's pre-travel."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import check_figure

if TYPE_CHECKING:
    from stepgauge.physics.sphere import SphereFit
    from stepgauge.probe_files import ProbedPoints
    from stepgauge.qualification import Method, Qualification

NEW_COLUMNS = (
    "pretravel_um",
    "centre_x_mm",
    "centre_y_mm",
    "centre_z_mm",
    "surface_x_mm",
    "surface_y_mm",
    "surface_z_mm",
)


@click.command()
@click.argument("points", type=click.Path(path_type=Path), metavar="POINTS.csv")
@click.option(
    "--qualification",
    "-q",
    type=click.Path(path_type=Path),
    required=True,
    help="What 'stepgauge probe qualify' found for this tip (a JSON file made with --tip-diameter).",
)
@click.option(
    "--method",
    type=click.Choice(["lobed", "mean"]),
    default="lobed",
    show_default=True,
    help="Take off the pre-travel of each direction, or the same mean everywhere as controllers do (R_eff).",
)
@click.option(
    "--on-sphere",
    is_flag=True,
    help="The points lie on one sphere: report its diameter and form error for both methods.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    default="compensated.csv",
    show_default=True,
    help="The table of POINTS.csv with the new columns.",
)
@click.option(
    "--figure",
    callback=check_figure,
    type=click.Path(path_type=Path),
    help="The pre-travel taken off; with --on-sphere the errors before and after, across and along the stylus. PNG, "
    "SVG or PDF.",
)
def command(
    points: Path, qualification: Path, method: Method, on_sphere: bool, output: Path, figure: Path | None
) -> None:
    """Take a probe's pre-travel off recorded points and find the points of the surface.

    POINTS.csv holds recorded tip centres and unit vectors of travel towards the surface: columns
    x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Other columns are kept. New columns: pretravel_um (taken off),
    centre_x_mm... (tip centre at the first touch) and surface_x_mm... (the tip radius further along the approach).

    \b
    stepgauge probe compensate part.csv -q qualification.json -o part-compensated.csv
    """
    from stepgauge.probe_files import read_points
    from stepgauge.qualification import compensated_centres_mm, read_qualification, tip_radius_mm

    found, probed = read_qualification(qualification), read_points(points)
    centre, pretravel = compensated_centres_mm(probed, found, method, qualification)
    surface = centre + tip_radius_mm(found, qualification) * probed.approach
    _write(output, probed, pretravel, centre, surface)
    spheres = _spheres(probed, found) if on_sphere else None
    if figure is not None:
        from stepgauge.figures.qualification import draw_compensation, draw_sphere_errors

        if spheres is None:
            draw_compensation(probed.approach, pretravel, found.stylus_axis, figure)
        else:
            draw_sphere_errors(probed.approach, spheres, found.stylus_axis, figure)
    click.echo(f"{len(pretravel)} points; pre-travel taken off {pretravel.min():.2f} to {pretravel.max():.2f} um")
    for name, fit in (spheres or {}).items():
        click.echo(f"{name:<12} diameter {2 * fit.radius_mm:.5f} mm, form error {fit.form_error_um:.2f} um")
    click.echo(f"written: {output}" + (f", {figure}" if figure else ""))


def _write(output: Path, probed: ProbedPoints, pretravel: Any, centre: Any, surface: Any) -> None:
    from stepgauge.errors import InputError
    from stepgauge.tables import write_table

    there = sorted(set(NEW_COLUMNS) & set(probed.rows.header))
    if there:
        raise InputError(probed.rows.path, f"column {there[0]} is there already", expected="points not yet compensated")
    rows = zip(probed.rows.cells, pretravel, centre, surface, strict=True)
    write_table(output, [*probed.rows.header, *NEW_COLUMNS], [[*old, w, *c, *s] for old, w, c, s in rows])


def _spheres(probed: ProbedPoints, found: Qualification) -> dict[str, SphereFit]:
    """The sphere through the surface points, by either method."""
    from stepgauge.errors import InputError
    from stepgauge.physics.sphere import fit_sphere
    from stepgauge.qualification import compensated_centres_mm, tip_radius_mm

    inwards = tip_radius_mm(found) * probed.approach
    methods: dict[str, Method] = {"mean R_eff": "mean", "lobes off": "lobed"}
    try:
        return {
            name: fit_sphere(compensated_centres_mm(probed, found, method)[0] + inwards)
            for name, method in methods.items()
        }
    except ValueError as error:
        raise InputError(probed.rows.path, str(error)) from None

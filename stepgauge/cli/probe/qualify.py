"""``stepgauge probe qualify``: probed points on a reference sphere -> effective radius, form error, lobes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from stepgauge.cli.options import FiniteRange, check_figure
from stepgauge.errors import InputError

if TYPE_CHECKING:
    from stepgauge.physics.wozniak import LobeModel, Slip, Transducer
    from stepgauge.qualification import Qualification


@click.command()
@click.argument("points", type=click.Path(path_type=Path), metavar="POINTS.csv")
@click.option(
    "--sphere-diameter",
    type=FiniteRange(),
    required=True,
    metavar="MM",
    help="Certified diameter of the reference sphere, mm.",
)
@click.option(
    "--tip-diameter",
    type=FiniteRange(),
    metavar="MM",
    help="True diameter of the tip ball, mm, from its certificate. Without it there is an effective radius but no "
    "pre-travel, and so no compensation of the lobes.",
)
@click.option(
    "--sphere-uncertainty",
    type=FiniteRange(),
    default=0.0,
    show_default=True,
    metavar="UM",
    help="Standard uncertainty (k = 1) of the sphere's diameter, um.",
)
@click.option(
    "--tip-uncertainty",
    type=FiniteRange(),
    default=0.0,
    show_default=True,
    metavar="UM",
    help="Standard uncertainty (k = 1) of the tip's diameter, um.",
)
@click.option(
    "--noise",
    type=FiniteRange(),
    metavar="UM",
    help="Known standard deviation of one probing, um. Default: from the residuals, which with few points (five leave "
    "one degree of freedom) say little.",
)
@click.option(
    "--transducer",
    type=click.Choice(["kinematic", "piezo"]),
    default="kinematic",
    show_default=True,
    help="Shape of the pre-travel: three-lobed (contacts that open) or round about the stylus (piezo sensors).",
)
@click.option(
    "--lobe-azimuth",
    default="0",
    show_default=True,
    metavar="DEG|fit",
    help="Where about the stylus axis the probe triggers soonest, degrees from machine x, in terms of the direction "
    "that pushes the tip. 'fit' finds it, from 12 points or more.",
)
@click.option(
    "--slip",
    type=click.Choice(["full", "mayer"]),
    default="full",
    show_default=True,
    help="Let the tip slide freely over the surface, or scale its sideways motion by Mayer's exp(-angle/4).",
)
@click.option(
    "--stylus-axis",
    type=(float, float, float),
    default=(0.0, 0.0, 1.0),
    show_default=True,
    metavar="I J K",
    help="From the tip to the probe body, in machine axes; any length.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    default="qualification.json",
    show_default=True,
    help="The result, which 'stepgauge probe compensate' reads.",
)
@click.option(
    "--figure",
    callback=check_figure,
    type=click.Path(path_type=Path),
    help="Residuals before and after, PNG, SVG or PDF.",
)
def command(
    points: Path,
    sphere_diameter: float,
    tip_diameter: float | None,
    sphere_uncertainty: float,
    tip_uncertainty: float,
    noise: float | None,
    transducer: Transducer,
    lobe_azimuth: str,
    slip: Slip,
    stylus_axis: tuple[float, float, float],
    output: Path,
    figure: Path | None,
) -> None:
    """Qualify a tip: the effective radius, and how much the probe lobes.

    POINTS.csv holds recorded tip centres on a reference sphere, before any radius compensation, and the unit vectors of
    travel: columns x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Five points do (four on the equator and the pole);
    25 as in ISO 10360-5 tell the form error as well.

    \b
    stepgauge probe qualify sphere.csv --sphere-diameter 24.9981 --tip-diameter 4
    stepgauge probe compensate part.csv --qualification qualification.json
    """
    _check_positive(sphere_diameter=sphere_diameter, tip_diameter=tip_diameter)
    _check_not_negative(sphere_uncertainty=sphere_uncertainty, tip_uncertainty=tip_uncertainty, noise=noise)
    from stepgauge.probe_files import read_points
    from stepgauge.qualification import Reference, qualify, write_qualification

    model, fit = _lobe_model(transducer, lobe_azimuth, slip)
    reference = Reference(sphere_diameter, tip_diameter, sphere_uncertainty, tip_uncertainty, noise, stylus_axis)
    probed = read_points(points)
    result = qualify(probed, reference, model, fit)
    write_qualification(output, result)
    if figure is not None:
        from stepgauge.figures.qualification import draw_qualification

        draw_qualification(probed.approach, result, figure)
    _print(result)
    click.echo(f"written: {output}" + (f", {figure}" if figure else ""))


def _lobe_model(transducer: Transducer, lobe_azimuth: str, slip: Slip) -> tuple[LobeModel, bool]:
    """The model asked for, and whether its azimuth is still to be found."""
    import math

    from stepgauge.physics.wozniak import LobeModel

    fit = lobe_azimuth == "fit"
    try:
        azimuth = 0.0 if fit else math.radians(float(lobe_azimuth))
    except ValueError:
        azimuth = math.nan
    if not math.isfinite(azimuth):
        raise InputError("--lobe-azimuth", "not an angle", found=lobe_azimuth, expected="degrees, or fit")
    return LobeModel(transducer, azimuth, slip), fit


def _check_positive(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not 0.0 < value < float("inf"):
            raise InputError(f"--{name.replace('_', '-')}", "impossible value", found=value, expected="mm, above zero")


def _check_not_negative(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not 0.0 <= value < float("inf"):
            raise InputError(
                f"--{name.replace('_', '-')}", "impossible value", found=value, expected="um, zero or more"
            )


def _print(result: Qualification) -> None:
    u = (
        "unknown (no point is left over to tell it)"
        if result.u_r_eff_mm is None
        else f"{1e3 * result.u_r_eff_mm:.2f} um"
    )
    click.echo(f"effective radius   {result.r_eff_mm:.5f} mm, standard uncertainty {u}")
    click.echo(f"form error         {result.form_error_um:.2f} um over {result.points} points")
    if result.lobes is None or result.form_error_compensated_um is None:
        click.echo("lobes              not known: give --tip-diameter")
        return
    lobes = result.lobes
    click.echo(
        f"mean pre-travel    {lobes.mean_pretravel_um:.2f} um ({lobes.transducer}, A = {lobes.constant_um:.2f} um, "
        f"lobe at {lobes.lobe_azimuth_deg:.1f} deg)"
    )
    click.echo(f"form, compensated  {result.form_error_compensated_um:.2f} um")

"""``stepgauge probe qualify``: probed points on a reference sphere -> effective radius, form error, lobes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import NOT_NEGATIVE, POSITIVE, output, plot_option, say, say_written, show
from stepgauge.errors import InputError

if TYPE_CHECKING:
    from stepgauge.physics.wozniak import LobeModel, Slip, Transducer
    from stepgauge.probes.qualification import Qualification


@click.command("qualify")
@click.argument("points", metavar="POINTS.csv")
@output("Result to write (JSON), which 'stepgauge probe compensate' reads.")
@click.option(
    "--sphere-diameter",
    type=POSITIVE,
    required=True,
    metavar="MM",
    help="Certified diameter of the reference sphere, mm.",
)
@click.option(
    "--u-sphere-diameter",
    type=NOT_NEGATIVE,
    default=0.0,
    show_default=True,
    metavar="UM",
    help="Standard uncertainty (k = 1) of the sphere's diameter, um.",
)
@click.option(
    "--tip-diameter",
    type=POSITIVE,
    metavar="MM",
    help="True diameter of the tip ball, mm, from its certificate. Without it there is an effective radius but no "
    "pre-travel, and so no compensation of the lobes.",
)
@click.option(
    "--u-tip-diameter",
    type=NOT_NEGATIVE,
    default=0.0,
    show_default=True,
    metavar="UM",
    help="Standard uncertainty (k = 1) of the tip's diameter, um.",
)
@click.option(
    "--noise",
    type=NOT_NEGATIVE,
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
@plot_option("Residuals before and after")
def command(points: str, output: str, plot: str | None, **options: Any) -> None:
    """Qualify a tip: effective radius, form error, and lobing of the probe.

    POINTS.csv holds recorded tip centres on a reference sphere, before any radius compensation, and the unit vectors of
    travel: columns x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Five points do (four on the equator and the pole);
    25 as in ISO 10360-5 give the form error as well.

    \b
    stepgauge probe qualify sphere.csv --sphere-diameter 24.9981 --tip-diameter 4 -o qualification.json
    stepgauge probe compensate part.csv -q qualification.json -o part-compensated.csv
    """
    from stepgauge.probes.files import read_points
    from stepgauge.probes.qualification import Reference, qualify, write_qualification

    model, fit = _lobe_model(options["transducer"], options["lobe_azimuth"], options["slip"])
    reference = Reference(
        options["sphere_diameter"],
        options["tip_diameter"],
        options["u_sphere_diameter"],
        options["u_tip_diameter"],
        options["noise"],
        options["stylus_axis"],
    )
    probed = read_points(points)
    result = qualify(probed, reference, model, fit)
    write_qualification(output, result)
    if plot is not None:
        from stepgauge.figures.qualification import draw_qualification

        draw_qualification(probed.approach, result, plot)
    _print(result)
    if result.worse_by_um > 0.0:
        say(f"warning: {result.worse_words()}; try --lobe-azimuth fit, or compensate with --method mean")
    say_written(output, plot)


def _lobe_model(transducer: Transducer, lobe_azimuth: str, slip: Slip) -> tuple[LobeModel, bool]:
    """The model asked for, and whether its azimuth is still to be found."""
    from stepgauge.physics.wozniak import LobeModel

    fit = lobe_azimuth == "fit"
    try:
        azimuth = 0.0 if fit else math.radians(float(lobe_azimuth))
    except ValueError:
        azimuth = math.nan
    if not math.isfinite(azimuth):
        raise InputError("--lobe-azimuth", "not an angle", found=lobe_azimuth, expected="degrees, or fit")
    return LobeModel(transducer, azimuth, slip), fit


def _print(result: Qualification) -> None:
    u = (
        "unknown (no point is left over to tell it)"
        if result.u_r_eff_mm is None
        else f"{1e3 * result.u_r_eff_mm:.2f} um"
    )
    show(f"effective radius   {result.r_eff_mm:.5f} mm, standard uncertainty {u}")
    show(f"form error         {result.form_error_um:.2f} um over {result.points} points")
    if result.lobes is None or result.form_error_compensated_um is None:
        show("lobes              not known: give --tip-diameter")
        return
    lobes = result.lobes
    show(
        f"mean pre-travel    {lobes.mean_pretravel_um:.2f} um ({lobes.transducer}, A = {lobes.constant_um:.2f} um, "
        f"lobe at {lobes.lobe_azimuth_deg:.1f} deg)"
    )
    show(f"form, compensated  {result.form_error_compensated_um:.2f} um")

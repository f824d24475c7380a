"""``stepgauge probe map``: trigger force, deflection and pre-travel of a probe over all directions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from stepgauge.cli.options import check_figure, output, say_written, show
from stepgauge.errors import InputError

if TYPE_CHECKING:
    from stepgauge.probes import Probe
    from stepgauge.probes.directions_map import DirectionMap


def _direction(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, ...] | None:
    if value is None:
        return None
    try:
        vector = [float(part) for part in value.split(",")]
    except ValueError:
        vector = []
    length = math.sqrt(sum(part * part for part in vector))
    if len(vector) != 3 or not 0.0 < length < math.inf:
        raise InputError("--stylus-direction", "not a direction", found=repr(value), expected="three numbers, 1,0,0")
    return tuple(part / length for part in vector)


@click.command("map")
@click.argument("probe", metavar="PROBE.toml")
@output("Table to write (CSV).")
@click.option(
    "--polar",
    metavar="ANGLES",
    default="10:90:10",
    show_default=True,
    help="Angles of the surface normal from the stylus axis, deg: 90 = wall along the stylus, 0 = floor under it. "
    "A list 90,80 or start:stop:step.",
)
@click.option(
    "--azimuth",
    metavar="ANGLES",
    default="0:360:10",
    show_default=True,
    help="Azimuths of the surface normal about the stylus, deg, from the probe's x towards y; 360 is not repeated.",
)
@click.option(
    "--stylus-direction",
    callback=_direction,
    metavar="X,Y,Z",
    help="Hold the probe in another direction than the file says, from body to tip in machine axes: 1,0,0 is level, so "
    "that the weight of stylus and carrier acts across. Default: the file's, else 0,0,-1.",
)
@click.option(
    "--polar-plot",
    callback=check_figure,
    metavar="FILE",
    help="Polar plots of force and pre-travel over the azimuth, one curve per polar angle (png, svg or pdf).",
)
@click.option(
    "--body-plot",
    callback=check_figure,
    metavar="FILE",
    help="The pre-travel body: pre-travel in um as the distance from the centre, in every direction (png, svg or pdf).",
)
@click.option(
    "--force-plot",
    callback=check_figure,
    metavar="FILE",
    help="Trigger force and pre-travel over the azimuth, one curve per polar angle (png, svg or pdf).",
)
def command(
    probe: str, polar: str, azimuth: str, stylus_direction: tuple[float, ...] | None, output: str, **plots: str | None
) -> None:
    """Map what a probe does over the directions in which surfaces push its tip.

    PROBE.toml is a probe file, or the name of a shipped one: omp40-2-50mm, omp40-2-100mm, tp6-30mm, tp6-50mm,
    tp200-50mm, ren-18mm. The table has the columns polar_deg, azimuth_deg (of the outward surface normal in the probe's
    frame), trigger_force_N, deflection_um (of the tip, square to the stylus) and pretravel_um (travel of the machine
    from touch to trigger, along the normal). Cells are empty where a model knows nothing of forces, or never triggers.

    \b
    stepgauge probe map omp40-2-50mm --polar 90,80 --azimuth 0:360:10 -o map.csv --polar-plot map.png
    """
    from stepgauge.probes import read_probe
    from stepgauge.probes.angles import direction_grid
    from stepgauge.probes.directions_map import map_directions

    held = read_probe(probe, stylus_direction)
    found_map = map_directions(held, *direction_grid(polar, azimuth))
    found_map.write(output)
    _draw(held, found_map, **plots)
    show(found_map.summary())
    say_written(output, *plots.values())


def _draw(
    probe: Probe, found: DirectionMap, polar_plot: str | None, body_plot: str | None, force_plot: str | None
) -> None:
    from stepgauge.figures import probe as figures

    if polar_plot is not None:
        figures.draw_polar(found, polar_plot)
    if body_plot is not None:
        figures.draw_body(probe, body_plot)
    if force_plot is not None:
        figures.draw_curves(found, force_plot)

"""``stepgauge probe sphere``: a probe's points on a sphere, as a machine without errors would record them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import NOT_NEGATIVE, POSITIVE, output, say_written
from stepgauge.cli.probe.map import _direction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stepgauge.probes import Probe


@click.command("sphere")
@click.argument("probe", metavar="PROBE.toml")
@output("Table of recorded tip centres to write (CSV), as qualify, iso10360-5 and compensate read it.")
@click.option("--sphere-diameter", type=POSITIVE, default=25.0, show_default=True, metavar="MM", help="Sphere, mm.")
@click.option(
    "--count",
    type=click.IntRange(5, 10_000),
    default=25,
    show_default=True,
    help="25 are the pattern that ISO 10360-5 recommends; other counts are spread evenly over the hemisphere.",
)
@click.option(
    "--scatter",
    type=NOT_NEGATIVE,
    default=0.2,
    show_default=True,
    metavar="UM",
    help="Standard deviation of a probing, um.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the scatter.")
@click.option(
    "--stylus-direction",
    callback=_direction,
    metavar="X,Y,Z",
    help="From body to tip in machine axes. Default: the probe file's, else 0,0,-1.",
)
def command(probe: str, output: str, **options: Any) -> None:
    """Probe a sphere virtually: every point lies off by the probe's own pre-travel in its direction.

    PROBE.toml is a probe file, or the name of a shipped one ('stepgauge shipped').

    \b
    stepgauge probe sphere omp40-2-50mm --sphere-diameter 25 -o sphere.csv
    stepgauge probe qualify sphere.csv --sphere-diameter 25 --tip-diameter 6 -o qualification.json
    """
    from stepgauge.files.dates import moment_now
    from stepgauge.files.tables import csv_text
    from stepgauge.files.text import write_text
    from stepgauge.probes import read_probe
    from stepgauge.probes.files import APPROACH, POSITION
    from stepgauge.recording.simulated import SIMULATED_COMMENT

    held = read_probe(probe, options["stylus_direction"])
    rows = probed_sphere(held, options["sphere_diameter"], options["count"], options["scatter"], options["seed"])
    about = {"probe": held.name or probe, "seed": options["seed"], "measured_at": moment_now(), **SIMULATED_COMMENT}
    head = "".join(f"# {key}: {value}\n" for key, value in about.items())
    write_text(output, head + csv_text([*POSITION, *APPROACH], (rows.round(7) + 0.0).tolist()))
    say_written(output)


def probed_sphere(probe: Probe, diameter_mm: float, count: int, scatter_um: float, seed: int) -> NDArray[Any]:
    """Rows of tip centre and approach, (count, 6), on a sphere at the origin.

    A recorded centre is contact - r p + w p with the approach p, so it lies R + r - w from the sphere's centre.
    """
    import numpy as np

    from stepgauge.errors import InputError
    from stepgauge.physics.directions import evenly_spread_points, iso_10360_5_points

    pattern = iso_10360_5_points() if count == 25 else evenly_spread_points(count)
    approach = probe.approaches(pattern)
    pretravel_um = probe.pretravel_um(approach)
    if not np.isfinite(pretravel_um).all():
        expected = "another --stylus-direction"
        raise InputError("PROBE", "never triggers in some direction of the sphere", expected=expected)
    pretravel_um = pretravel_um + np.random.default_rng(seed).normal(0.0, scatter_um, count)
    reach_mm = diameter_mm / 2.0 + probe.tip_radius_mm - pretravel_um * 1e-3
    return np.column_stack([-approach * reach_mm[:, None], approach])

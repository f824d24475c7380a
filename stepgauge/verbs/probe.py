"""The verbs of the touch-trigger probe: map, sphere, qualify, compensate, bench."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Flag, Number, OneOf, Reads, Text, Vector, Writes
from stepgauge.verbs.shared import FIGURES, CoverageFactor, File, OutputFile, Plot, TipDiameter

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.files.stored import StoredResult
    from stepgauge.probes.angles import Angles
    from stepgauge.probes.directions_map import DirectionMap
    from stepgauge.probes.results import BenchResult, Compensated, Qualified, SpherePoints

ProbeFile = Annotated[File, Reads("PROBE.toml", room="probes"), ARGUMENT, "probe file, or the name of a shipped one"]
Points = Annotated[
    "File | pd.DataFrame | SpherePoints",
    Reads("POINTS.csv"),
    ARGUMENT,
    "recorded tip centres and unit vectors of travel",
]
Direction = Annotated[
    "Sequence[float] | None",
    Vector(count=3),
    "hold the probe in another direction than its file says, from body to tip in machine axes: 1,0,0 is level, so that"
    " the weight of stylus and carrier acts across; default: the file's, else 0,0,-1",
]
SphereDiameter = Number("mm", above=0.0)
U = Number("um", 0.0)
Picture = Annotated[File | None, Writes("FILE", suffixes=FIGURES)]


def write_map(
    found: "DirectionMap",
    output: OutputFile,
    *,
    polar_plot: Picture = None,
    body_plot: Picture = None,
    force_plot: Picture = None,
) -> list[File]:
    """The map as a table, and its figures.

    Parameters
    ----------
    output : table to write (CSV)
    polar_plot : polar plots of force and pre-travel over the azimuth, one curve per polar angle
    body_plot : the pre-travel body: pre-travel in um as the distance from the centre, in every direction
    force_plot : trigger force and pre-travel over the azimuth, one curve per polar angle
    """
    found.write(output)
    if any((polar_plot, body_plot, force_plot)):
        from stepgauge.figures import probe as figures

        if polar_plot is not None:
            figures.draw_polar(found, polar_plot)
        if body_plot is not None:
            figures.draw_body(found.probe, body_plot)
        if force_plot is not None:
            figures.draw_curves(found, force_plot)
    return [output, *(path for path in (polar_plot, body_plot, force_plot) if path is not None)]


@verb(write_map, shows=True)
def probe_map(
    probe: ProbeFile,
    *,
    polar_deg: Annotated["Angles", Text("ANGLES", numbers=True)] = "10:90:10",
    azimuth_deg: Annotated["Angles", Text("ANGLES", numbers=True)] = "0:360:10",
    stylus_direction: Direction = None,
) -> "DirectionMap":
    """Map what a probe does over the directions in which surfaces push its tip.

    Shipped probes are omp40-2-50mm, omp40-2-100mm, tp6-30mm, tp6-50mm, tp200-50mm, ren-18mm. The table has the columns
    polar_deg, azimuth_deg (of the outward surface normal in the probe's frame), trigger_force_N, deflection_um (of the
    tip, square to the stylus) and pretravel_um (travel of the machine from touch to trigger, along the normal). Cells
    are empty where a model knows nothing of forces, or never triggers.

    Parameters
    ----------
    polar_deg : angles of the surface normal from the stylus axis, deg: 90 is a wall along the stylus, 0 a floor under
        it; a list 90,80 or start:stop:step
    azimuth_deg : azimuths of the surface normal about the stylus, deg, from the probe's x towards y; 360 is not
        repeated

    Returns
    -------
    Trigger force in N, deflection and pre-travel in um, shape ``(polars, azimuths)``; NaN where the model does not give
    it, infinite where the probe never triggers.

    Examples
    --------
    stepgauge probe map omp40-2-50mm --polar 90,80 --azimuth 0:360:10 -o map.csv --polar-plot map.png
    """
    from dataclasses import replace

    from stepgauge.probes import read_probe
    from stepgauge.probes.angles import direction_grid
    from stepgauge.probes.directions_map import map_directions

    held = read_probe(probe, _unit(stylus_direction))
    return replace(map_directions(held, *direction_grid(polar_deg, azimuth_deg)), probe=held)


def _unit(direction: "Sequence[float] | None") -> tuple[float, ...] | None:
    """The direction with length 1; :class:`InputError` for none."""
    import math

    from stepgauge.errors import InputError, naming

    if direction is None:
        return None
    length = math.sqrt(sum(float(part) ** 2 for part in direction))
    if not length > 0.0:
        where = naming("stylus_direction")
        raise InputError(where, "not a direction", found=direction, expected="three numbers, 1,0,0")
    return tuple(float(part) / length for part in direction)


def write_points(points: "SpherePoints", output: OutputFile) -> list[File]:
    """The table.

    Parameters
    ----------
    output : table of recorded tip centres to write (CSV), as qualify, iso10360-5 and compensate read it
    """
    points.write(output)
    return [output]


@verb(write_points, says=lambda _: "")
def probe_sphere(
    probe: ProbeFile,
    *,
    sphere_diameter_mm: Annotated[float, SphereDiameter] = 25.0,
    count: Annotated[int, Count(5, 10_000)] = 25,
    scatter_um: Annotated[float, U] = 0.2,
    seed: Annotated[int, Count(0)] = 1,
    stylus_direction: Direction = None,
) -> "SpherePoints":
    """Probe a sphere virtually, with the probe's own pre-travel in each direction.

    Every point lies off by the pre-travel, as a machine without errors would record it.

    Parameters
    ----------
    sphere_diameter_mm : diameter of the sphere
    count : 25 are the pattern that ISO 10360-5 recommends; other counts are spread evenly over the hemisphere
    scatter_um : standard deviation of a probing
    seed : seed of the scatter

    Returns
    -------
    Tip centres and approaches.

    Examples
    --------
    stepgauge probe sphere omp40-2-50mm --sphere-diameter 25 -o sphere.csv
    stepgauge probe qualify sphere.csv --sphere-diameter 25 --tip-diameter 6 -o qualification.json
    """
    from stepgauge.probes import read_probe
    from stepgauge.probes.results import SpherePoints, probed_sphere

    held = read_probe(probe, _unit(stylus_direction))
    rows = probed_sphere(held, sphere_diameter_mm, count, scatter_um, seed)
    return SpherePoints(rows, held.name or str(probe), seed)


def write_qualified(found: "Qualified", output: OutputFile, *, plot: Plot = None) -> Written:
    """The qualification.

    Parameters
    ----------
    output : result to write (JSON), which 'stepgauge probe compensate' reads
    plot : residuals before and after
    """
    found.write(output)
    if plot is not None:
        found.draw(plot)
    return Written([output, plot])


@verb(write_qualified, shows=True)
def qualify_probe(
    points: Points,
    *,
    sphere_diameter_mm: Annotated[float, SphereDiameter],
    u_sphere_diameter_um: Annotated[float, U] = 0.0,
    tip_diameter_mm: TipDiameter = None,
    u_tip_diameter_um: Annotated[float, U] = 0.0,
    noise_um: Annotated[float | None, U] = None,
    transducer: Annotated[str, OneOf("kinematic", "piezo")] = "kinematic",
    lobe_azimuth_deg: Annotated[float | None, Number("deg", -360.0, 360.0)] = None,
    slip: Annotated[str, OneOf("full", "mayer")] = "full",
    stylus_axis: Annotated["Sequence[float]", Vector("I,J,K", count=3)] = (0.0, 0.0, 1.0),
) -> "Qualified":
    """Qualify a tip: effective radius, form error, and lobing of the probe.

    POINTS.csv holds recorded tip centres on a reference sphere, before any radius compensation, and the unit vectors of
    travel: columns x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Five points do (four on the equator and the pole);
    25 as in ISO 10360-5 give the form error as well.

    Parameters
    ----------
    sphere_diameter_mm : certified diameter of the reference sphere
    u_sphere_diameter_um : standard uncertainty (k = 1) of the sphere's diameter
    tip_diameter_mm : true diameter of the tip ball, from its certificate; without it there is an effective radius but
        no pre-travel, and so no compensation of the lobes
    u_tip_diameter_um : standard uncertainty (k = 1) of the tip's diameter
    noise_um : known standard deviation of one probing; default: from the residuals, which with few points (five leave
        one degree of freedom) say little
    transducer : shape of the pre-travel: three-lobed (contacts that open) or round about the stylus (piezo sensors)
    lobe_azimuth_deg : where about the stylus axis the probe triggers soonest, from machine x, in terms of the
        direction that pushes the tip; default: found from 12 points or more, with its uncertainty; where these do not
        tell it no lobes are claimed
    slip : let the tip slide freely over the surface, or scale its sideways motion by Mayer's exp(-angle/4)
    stylus_axis : from the tip to the probe body, in machine axes; any length

    Returns
    -------
    Effective radius with its uncertainty, form error, lobes.

    Examples
    --------
    stepgauge probe qualify sphere.csv --sphere-diameter 24.9981 --tip-diameter 6 -o qualification.json
    stepgauge probe compensate part.csv -q qualification.json -o part-compensated.csv
    """
    import math

    from stepgauge.files.tables import given_table
    from stepgauge.physics.wozniak import LobeModel
    from stepgauge.probes.files import read_points
    from stepgauge.probes.qualification import Reference, qualify
    from stepgauge.probes.results import Qualified

    azimuth = math.radians(lobe_azimuth_deg or 0.0)
    model: Any = LobeModel(transducer, azimuth, slip)  # type: ignore[arg-type]
    axis: Any = tuple(float(part) for part in stylus_axis)
    uncertain = (u_sphere_diameter_um, u_tip_diameter_um)
    probed = read_points(given_table(points))
    reference = Reference(sphere_diameter_mm, tip_diameter_mm, *uncertain, noise_um, axis)
    return Qualified(qualify(probed, reference, model, lobe_azimuth_deg is None), probed.approach)


def write_compensated(points: "Compensated", output: OutputFile, *, plot: Plot = None) -> Written:
    """The table.

    Parameters
    ----------
    output : table to write (CSV): that of the points with the new columns
    plot : the correction of each point; of a sphere the errors before and after, across and along the stylus
    """
    points.write(output)
    if plot is not None:
        points.draw(plot)
    return Written([output, plot], points.warnings)


@verb(write_compensated, shows=True)
def compensate_points(
    points: Points,
    *,
    qualification: Annotated["File | Qualified | StoredResult", Reads("FILE", short="q")],
    method: Annotated[str, OneOf("lobed", "mean")] = "lobed",
    on_sphere: Annotated[bool, Flag()] = False,
) -> "Compensated":
    """Correct recorded points for the probe's pre-travel and find the points of the surface.

    POINTS.csv holds recorded tip centres and unit vectors of travel towards the surface: columns
    x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. Other columns are kept. New columns: pretravel_um (the correction),
    centre_x_mm... (tip centre at the first touch) and surface_x_mm... (the tip radius further along the approach).

    Parameters
    ----------
    qualification : of this tip, made with the diameter of its ball: what 'stepgauge probe qualify' wrote (JSON); in
        Python also what qualify_probe gives
    method : correct for the pre-travel of each direction, or for its mean in all directions as controllers do (R_eff)
    on_sphere : the points lie on one sphere: report its diameter and form error for both methods

    Returns
    -------
    The points with their corrections.

    Examples
    --------
    stepgauge probe compensate part.csv -q qualification.json -o part-compensated.csv
    """
    from stepgauge.files.tables import given_table
    from stepgauge.probes.files import read_points
    from stepgauge.probes.results import compensated, given_qualification

    probed, (known, where) = read_points(given_table(points)), given_qualification(qualification)
    return compensated(probed, known, method, where, on_sphere)  # type: ignore[arg-type]


def write_bench(bench: "BenchResult", output: OutputFile, *, plot: Plot = None) -> list[Path]:
    """The pushes.

    Parameters
    ----------
    output : table to write (CSV), one row per push; directions and budget go into a JSON file of the same name
    plot : a push and the directions
    """
    written = bench.write(output)
    if plot is not None:
        bench.draw(plot)
    return [*written, *([Path(plot)] if plot is not None else [])]


@verb(write_bench, shows=True)
def probe_bench(
    series: Annotated["File | pd.DataFrame", Reads("SERIES.csv"), ARGUMENT],
    *,
    contact_from: Annotated[str, OneOf("signal", "tip")] = "signal",
    coverage_factor: CoverageFactor = 2.0,
) -> "BenchResult":
    """Evaluate a probe test bench: a push rod on a grating, a laser on the tip.

    SERIES.csv holds time series, one row per sample: time_s,rod_mm,tip_mm,contact,trigger, where the two signals are 1
    at rest and 0 while touching or triggered. direction_deg and push tell the pushes apart; their rows stand together.

    r0 is the rod where it meets the tip, r1 at the trigger, r2 where it stops, r3 where the tip stays behind on the way
    back. Pre-travel is r1 - r0, hysteresis r3 - r0, repeatability the range of r1 over the pushes of a direction.

    The uncertainty is that of Ren's device (0.10 um and 0.13 um/m), with the repeatabilities measured here.

    Parameters
    ----------
    series : recording of the bench (CSV)
    contact_from : find the touch from the contact signal, or from where the line of the tip leaves rest (ruby conducts
        none)

    Returns
    -------
    Pre-travel, hysteresis and repeatability by direction.

    Examples
    --------
    stepgauge probe bench pushes.csv -o bench.csv --plot bench.png
    """
    from stepgauge.files.tables import given_table
    from stepgauge.probes.bench import evaluate_bench
    from stepgauge.probes.files import read_bench
    from stepgauge.probes.results import BenchResult

    return BenchResult(evaluate_bench(read_bench(given_table(series)), contact_from), coverage_factor)  # type: ignore[arg-type]

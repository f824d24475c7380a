"""Recorded points -> surface points: corrected for the pre-travel of a qualified probe, as a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.tables import write_table
from stepgauge.physics.sphere import SphereFit, fit_sphere
from stepgauge.probes.files import ProbedPoints
from stepgauge.probes.qualification import Method, Qualification, compensated_centres_mm, tip_radius_mm

NEW_COLUMNS = (
    "pretravel_um",
    "centre_x_mm",
    "centre_y_mm",
    "centre_z_mm",
    "surface_x_mm",
    "surface_y_mm",
    "surface_z_mm",
)
METHODS: dict[str, Method] = {"mean R_eff": "mean", "lobed model": "lobed"}


@dataclass(frozen=True)
class CompensatedPoints:
    """Tip centres at first contact and points of the surface, ``(n, 3)`` mm, and the corrections, ``(n,)`` um."""

    points: ProbedPoints
    pretravel_um: Array
    centre_mm: Array
    surface_mm: Array


def compensate_points(
    points: ProbedPoints, found: Qualification, method: Method = "lobed", where: str | Path = "qualification"
) -> CompensatedPoints:
    """Correct for pre-travel (:func:`~stepgauge.probes.qualification.compensated_centres_mm`) and for the tip radius.

    :class:`InputError` where the points were compensated before, and in the name of ``where`` if the qualification
    lacks what the method needs.
    """
    there = sorted(set(NEW_COLUMNS) & set(points.rows.header))
    if there:
        raise InputError(points.rows.path, f"column {there[0]} is there already", expected="points not yet compensated")
    centre, pretravel = compensated_centres_mm(points, found, method, where)
    return CompensatedPoints(points, pretravel, centre, centre + tip_radius_mm(found, where) * points.approach)


def write_compensated(path: str | Path, result: CompensatedPoints) -> None:
    """The table of the points with :data:`NEW_COLUMNS`, to a tenth of a nanometre, without a negative zero."""
    rows = result.points.rows
    numbers = (one.round(decimals) + 0.0 for one, decimals in ((result.pretravel_um, 4), (result.centre_mm, 7)))
    new = zip(rows.cells, *numbers, result.surface_mm.round(7) + 0.0, strict=True)
    write_table(path, [*rows.header, *NEW_COLUMNS], [[*old, w, *c, *s] for old, w, c, s in new])


def compensation_warnings(found: Qualification, method: Method, fits: dict[str, SphereFit]) -> list[str]:
    """Why the points may be worse after the compensation than with the mean R_eff; ``fits`` as of :func:`spheres`."""
    warnings = []
    if method == "lobed" and found.worse_by_um > 0.0:
        warnings.append(f"by the qualification, {found.worse_words()}; use --method mean")
    if fits:
        mean, lobed = (fits[name].form_error_um for name in METHODS)
        if lobed > mean:
            warnings.append(
                f"on these points the form error is {lobed:.2f} um with the lobed model, {mean:.2f} um with R_eff"
            )
    return warnings


def spheres(points: ProbedPoints, found: Qualification) -> dict[str, SphereFit]:
    """The sphere through the surface points, by either method of :data:`METHODS`."""
    inwards = tip_radius_mm(found) * points.approach
    try:
        return {
            name: fit_sphere(compensated_centres_mm(points, found, method)[0] + inwards)
            for name, method in METHODS.items()
        }
    except ValueError as error:
        raise InputError(points.rows.path, str(error)) from None

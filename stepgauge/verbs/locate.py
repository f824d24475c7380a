"""``locate``: 16 probed points to the placement of the gauge."""

from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, Number, Reads
from stepgauge.verbs.shared import File, GaugeLike, MachineIfNeeded, OutputFile, Section

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import ArrayLike

    from stepgauge.gauge.placement import Placement

UNKNOWN_REPEATABILITY_UM = 1.0
"""Of a probed coordinate, where neither the technician nor a machine file states it."""


def write(placement: "Placement", output: OutputFile) -> list[File]:
    """The placement file (TOML).

    Parameters
    ----------
    output : placement file to write (TOML)
    """
    placement.write(output)
    return [output]


@verb(write)
def locate(
    points: Annotated["File | ArrayLike | pd.DataFrame", Reads(foreign=True, numbers=True), ARGUMENT],
    gauge: GaugeLike,
    *,
    machine: MachineIfNeeded = None,
    blocks: Section = None,
    tip_radius_mm: Annotated[float | None, Number("mm", above=0.0)] = None,
    repeatability_um: Annotated[float | None, Number("um", 0.0)] = None,
    turned: Annotated[bool, Flag()] = False,
    surface: Annotated[bool, Flag()] = False,
) -> "Placement":
    """Find how the step gauge lies from 16 points probed by hand.

    ``points`` is a CSV file with the columns point,x_mm,y_mm,z_mm, or the log of the program of 'stepgauge plan
    --teach': tip centres, or, where ``surface`` says so, points on the surface as PC-DMIS and others report them.
    Points 1-8 lie on the first block, 9-16 in the same order on the last block:

          1 2 3  front face, not in line        6  top
          4      side at +s (right, looking     7  rail beside the block
                 along the gauge, top up)       8  back face
          5      side at -s

    The side direction is s = a x up, with a from the first to the last block. At point 7 the ball rests on the rail,
    clear of the block:

                      6             up
                 .----o----.        |   a (away from you)
                 |    3    |        | /
               5 o         o 4      |/____ s
                 |  1   2  | 7
             ____|_________|_o_     8 is on the back,
            |_______rail_______|    behind 1 2 3

    Found are centres C1 and C2, axis, up direction, yaw and pitch, the angle of the block normals to the axis, and
    standard uncertainties. Points that contradict the certificate or each other are refused, with the slip that would
    explain them: which point is off and by how much, two exchanged, or another gauge. Smaller contradictions enlarge
    the uncertainties.

    Parameters
    ----------
    points : CSV file, log, table with x_mm,y_mm,z_mm, or tip centres in mm, shape ``(16, 3)``
    machine : machine file; gives tip radius and repeatability where they are not stated; of the kinds "machine tool"
        and printer, whose scale may be off by 1 %, the distance of the blocks may be off as far
    blocks : the two blocks that were probed, 1:21; default: the first and the last
    tip_radius_mm : nominal tip radius, checked against the points; default: the machine's, if given
    repeatability_um : standard deviation of a probed coordinate; default: the machine's, or 1
    turned : the gauge rises by more than 50 deg, or is turned about its axis by more than 30 deg; without it such
        points are refused, for exchanged columns look the same
    surface : the points lie on the surface: they are compensated by the tip radius

    Returns
    -------
    The placement as its file holds it (coordinates to 1e-7 mm), with angles and standard uncertainties in ``details``.

    Raises
    ------
    InputError
        points that contradict the certificate or each other, with the slip that would explain them

    Examples
    --------
    stepgauge locate points.csv --gauge step-gauge-420 -o placement.toml
    """
    from stepgauge.alignment import locate as locate_points
    from stepgauge.alignment.surface import tip_centres
    from stepgauge.gauge.placement import format_placement, parse_placement, possible_scale_error
    from stepgauge.planning.plan import parse_blocks
    from stepgauge.verbs.inputs import resolve_blocks, resolve_gauge, resolve_machine

    steps = resolve_gauge(gauge)
    cmm = None if machine is None else resolve_machine(machine)
    if cmm is not None:
        tip_radius_mm = cmm.probe.tip_radius_mm if tip_radius_mm is None else tip_radius_mm
        repeatability_um = cmm.table.virtual_repeatability_um if repeatability_um is None else repeatability_um
    sigma_um = UNKNOWN_REPEATABILITY_UM if repeatability_um is None else repeatability_um
    probed = resolve_blocks(blocks, steps) or parse_blocks(":", steps)
    where = str(points) if isinstance(points, File) else "points"
    read = _read(points, surface)
    if surface:
        read = tip_centres(read, steps, probed, tip_radius_mm, where, turned)
    found = locate_points(read, steps, probed, sigma_um, tip_radius_mm, where, turned, possible_scale_error(cmm))
    return parse_placement(format_placement(found), where, steps)


def _read(points: "File | ArrayLike | pd.DataFrame", surface: bool) -> "np.ndarray":
    import numpy as np

    from stepgauge.alignment import is_point_table, read_points
    from stepgauge.errors import InputError
    from stepgauge.importing.sixteen import read_sixteen  # what others write

    if isinstance(points, File):
        if is_point_table(points):
            return read_points(points)
        return read_sixteen(points, surface)
    named = getattr(points, "columns", ())
    if hasattr(points, "iloc") and any(isinstance(one, str) for one in named):
        return read_sixteen(points, surface)  # type: ignore[arg-type]
    given, expected = np.asarray(points, float), "finite numbers in mm, shape (16, 3)"
    if given.shape != (16, 3):
        raise InputError("points", "not 16 points", found=f"shape {given.shape}", expected=expected)
    bad = ~np.isfinite(given).all(axis=1)
    if bad.any():
        point = int(bad.argmax())
        found = ", ".join(f"{value:g}" for value in given[point])
        raise InputError("points", f"point {point + 1} is not known", found=found, expected=expected)
    return given

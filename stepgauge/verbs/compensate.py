"""``compensate``: an evaluation to an error table for a controller, or to the skew of two axes."""

from typing import TYPE_CHECKING, Annotated

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Number, OneOf, Reads, Vector
from stepgauge.verbs.shared import File, OutputFile, Plot

if TYPE_CHECKING:
    from stepgauge.compensation.result import Compensation, SkewCompensation
    from stepgauge.evaluation.evaluate import Evaluation

FORMATS = (
    *("linuxcnc", "siemens", "siemens-cec", "heidenhain", "fanuc", "fanuc-g10"),
    *("grbl", "marlin", "rrf", "klipper", "csv"),
)
UNCONFIRMED = ("heidenhain", "fanuc", "fanuc-g10")
"""Formats whose sense no source confirms; a test compares them with the table of conventions."""
Coordinate = Number("mm", -1e6, 1e6)


def write(compensation: "Compensation | SkewCompensation", output: OutputFile, *, plot: Plot = None) -> Written:
    """The controller's file and what it was made from.

    Parameters
    ----------
    output : file to write; of a table the same name with .json added goes beside it: what it was made from, notes,
        uncertainties
    plot : the table as a figure
    """
    paths = compensation.write(output)
    if plot is not None:
        paths += compensation.draw(plot)
    return Written(paths, compensation.notes_on(output))


@verb(write)
def compensate(
    evaluation: Annotated["File | Evaluation", Reads("EVALUATION", folder=True), ARGUMENT],
    *,
    to: Annotated[str, OneOf(*FORMATS)],
    axis: Annotated[str | None, OneOf("x", "y", "z")] = None,
    plane: Annotated[str | None, OneOf("xy", "xz", "yz")] = None,
    template: Annotated[File | None, Reads("FILE")] = None,
    tip_radius_mm: Annotated[float | None, Number("mm", above=0.0, high=50.0)] = None,
    u_tip_radius_um: Annotated[float, Number("um", 0.0, 100.0)] = 0.0,
    travel: Annotated[str | None, OneOf("both", "mean", "positive", "negative")] = None,
    step_mm: Annotated[float | None, Number("mm", above=0.0, high=1e5)] = None,
    range_mm: Annotated["tuple[float, float] | None", Vector("LOW,HIGH", count=2, unit="mm")] = None,
    extend: Annotated[str, OneOf("none", "hold", "linear")] = "none",
    zero_at_mm: Annotated[float | None, Coordinate] = None,
    offset_mm: Annotated[float, Coordinate] = 0.0,
    angle_limit_deg: Annotated[float, Number("deg", 0.0, 10.0)] = 1.0,
    placement_number: Annotated[int | None, Count(1)] = None,
    file_type: Annotated[int, Count(0, 1)] = 0,
    joint: Annotated[int | None, Count(0, 30)] = None,
    unconfirmed_sense: Annotated[str | None, OneOf(*UNCONFIRMED)] = None,
) -> "Compensation | SkewCompensation":
    """Error table of an axis, ready for a controller, from an evaluation.

    The gauge must lie along the axis. Errors are those of the axis in machine coordinates, by direction of travel,
    averaged over the cycles; error = indicated minus true. Nothing is extrapolated unless you ask for it.

    Measure with the compensation that is in force switched off: the table is for the axis as it was measured.

    Parameters
    ----------
    evaluation : the folder of evaluate, its evaluation.json, or an evaluation
    to : linuxcnc: COMP_FILE; siemens: $AA_ENC_COMP, siemens-cec: $AN_CEC of SINUMERIK; heidenhain: .COM; fanuc: pitch
        error pulses, fanuc-g10: as a program; grbl, marlin, rrf: scale and backlash; klipper: skew; csv: for any other
        controller
    axis : machine axis that is corrected
    plane : instead of ``axis``: the skew of two axes, from a gauge along both diagonals (marlin, klipper, rrf)
    template : your own Jinja template; start from a copy: 'stepgauge list files compensation-siemens.j2 --copy-to mine'
    tip_radius_mm : effective tip radius known from elsewhere (ring or sphere); without it a constant reversal of the
        axis cannot be separated from the tip size and is not in the table
    u_tip_radius_um : standard uncertainty of ``tip_radius_mm``
    travel : directions of travel in the table; default: both; siemens: mean, for it has one table
    step_mm : even spacing at whole multiples of it; default: the places of the faces; siemens: 10 mm
    range_mm : ends of the table, LOW,HIGH; default: measured
    extend : beyond what was measured: refuse, hold the end value, or go on with the fitted slope
    zero_at_mm : machine coordinate where the correction is zero (the reference point); default: the table's low end
    offset_mm : machine coordinate minus recorded coordinate of the axis (a work offset)
    angle_limit_deg : largest angle between gauge and axis
    placement_number : which placement of the evaluation; default: the one that lies along the axis
    file_type : linuxcnc: COMP_FILE_TYPE, 0 positions, 1 trims; siemens: number of the measuring system, 0 or 1
    joint : number of the axis in the controller; default: x 0, y 1, z 2
    unconfirmed_sense : the format of ``to``, again: write it although no source confirms its sense; compare one
        position with and without the table

    Returns
    -------
    The table with its standard uncertainties and its text for the controller, or the skew with its commands.

    Examples
    --------
    stepgauge compensate result --axis x --to linuxcnc --tip-radius 1.9973 -o x.comp
    stepgauge compensate result --axis y --to siemens --step 20 --zero-at 0 --extend hold -o AX2_EEC.INI
    stepgauge compensate result --axis x --to csv -o x.csv --plot x.png
    stepgauge compensate diagonals --plane xy --to marlin -o skew.gcode
    """
    from stepgauge.compensation import FORMATS, TableOptions, TipRadius, axis_faces, make_table
    from stepgauge.compensation.formats import check_confirmed
    from stepgauge.compensation.result import Compensation, skew_compensation
    from stepgauge.errors import InputError, naming
    from stepgauge.verbs.inputs import stored_evaluation

    _check(axis, plane, to, unconfirmed_sense, file_type, joint)
    if tip_radius_mm is None and u_tip_radius_um:
        what = naming("tip_radius_mm", words="is the uncertainty of {}, which is missing")
        raise InputError(naming("u_tip_radius_um"), what)
    read, path = stored_evaluation(evaluation)
    if axis is None:
        return skew_compensation(read, path, str(plane), to)
    known = FORMATS[to]
    check_confirmed(known, unconfirmed_sense)
    tip = None if tip_radius_mm is None else TipRadius(tip_radius_mm, u_tip_radius_um)
    faces = axis_faces(read, path, axis, tip, placement_number, offset_mm, angle_limit_deg)
    if range_mm is not None and range_mm[0] >= range_mm[1]:
        raise InputError(naming("range_mm"), "must rise", found=range_mm, expected="LOW,HIGH")
    span = None if range_mm is None else (range_mm[0], range_mm[1])
    step = step_mm or (10.0 if known.even else None)
    table = make_table(faces, TableOptions(travel or known.travel, step, span, extend, zero_at_mm))  # type: ignore[arg-type]
    return Compensation(table, known, read, template, file_type, joint, unconfirmed_sense).rendered()


def _check(
    axis: str | None, plane: str | None, to: str, unconfirmed: str | None, file_type: int, joint: int | None
) -> None:
    """A skew has no table, so what tables need does not matter to it."""
    from stepgauge.errors import InputError, naming

    if (axis is None) == (plane is None) or (to == "klipper" and axis is not None):
        words = naming("axis", "plane", words="{} for a table, or {} for a skew (klipper: a skew only)")
        raise InputError("", words)
    if axis is None and unconfirmed:
        raise InputError(naming("unconfirmed_sense"), "is for a table; the skew of every firmware is confirmed")
    if axis is not None and to not in ("linuxcnc", "siemens") and (file_type or (to == "csv" and joint is not None)):
        raise InputError(naming("file_type", "joint", words="{}, {}"), "are for linuxcnc and siemens", found=to)

"""``compensate``: what was measured to an error table for a controller, or to the skew of two axes."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Number, OneOf, Reads, Vector
from stepgauge.verbs.shared import File, OutputFile, Plot

if TYPE_CHECKING:
    from stepgauge.axis.recording import AxisRecording
    from stepgauge.compensation import AxisReadings
    from stepgauge.compensation.result import Compensation, SkewCompensation
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.reports.outcome import StandardTest
    from stepgauge.standards.positioning import PositioningTest

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
    measured: Annotated["File | Evaluation | AxisRecording | StandardTest", Reads("MEASURED", folder=True), ARGUMENT],
    *,
    to: Annotated[str, OneOf(*FORMATS)],
    axis: Annotated[str | None, OneOf("x", "y", "z")] = None,
    plane: Annotated[str | None, OneOf("xy", "xz", "yz")] = None,
    template: Annotated[File | None, Reads("FILE")] = None,
    actual: Annotated[str | None, OneOf("reading", "target")] = None,
    u_length_um_per_m: Annotated[float, Number("um/m", 0.0, 1000.0)] = 0.0,
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
    """Error table of an axis, ready for a controller, from an evaluation or a recording of the axis.

    A gauge must lie along the axis; a laser or another instrument ('stepgauge import --sensor') reads the axis itself.
    Errors are those of the axis in machine coordinates, by direction of travel, averaged over the cycles; error =
    indicated minus true. Nothing is extrapolated unless you ask for it.

    Measure with the compensation that is in force switched off: the table is for the axis as it was measured.

    Parameters
    ----------
    measured : the folder of evaluate, its evaluation.json or an evaluation; or a recording of one axis, its file or
        the test by ISO 230-2 that Python made of it
    to : linuxcnc: COMP_FILE; siemens: $AA_ENC_COMP, siemens-cec: $AN_CEC of SINUMERIK; heidenhain: .COM; fanuc: pitch
        error pulses, fanuc-g10: as a program; grbl, marlin, rrf: scale and backlash; klipper: skew; csv: for any other
        controller
    axis : machine axis that is corrected; default: as a recording of one axis says
    plane : instead of ``axis``: the skew of two axes, from a gauge along both diagonals (marlin, klipper, rrf)
    template : your own Jinja template; start from a copy: 'stepgauge list files compensation-siemens.j2 --copy-to mine'
    actual : of a recording of one axis: what the actual position is; default: the reading of an instrument; of a probe
        that touches, the target
    u_length_um_per_m : of a recording of one axis: standard uncertainty in proportion to length, of the instrument and
        of the temperature and expansion of the material
    tip_radius_mm : effective tip radius known from elsewhere (ring or sphere); without it a constant reversal of the
        axis cannot be separated from the tip size and is not in the table
    u_tip_radius_um : standard uncertainty of ``tip_radius_mm``
    travel : directions of travel in the table; default: both; siemens: mean, for it has one table
    step_mm : even spacing at whole multiples of it; default: the places that were measured; siemens: 10 mm
    range_mm : ends of the table, LOW,HIGH; default: measured
    extend : beyond what was measured: refuse, hold the end value, or go on with the fitted slope
    zero_at_mm : machine coordinate where the correction is zero (the reference point); default: the table's low end
    offset_mm : machine coordinate minus recorded coordinate of the axis (a work offset)
    angle_limit_deg : largest angle between gauge and axis
    placement_number : which placement of the gauge, or setting up of the axis; default: the one along the axis
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
    stepgauge compensate laser.csv --axis x --to linuxcnc -o x.comp
    stepgauge compensate diagonals --plane xy --to marlin -o skew.gcode
    """
    from stepgauge.compensation import FORMATS, TableOptions, make_table
    from stepgauge.compensation.formats import check_confirmed
    from stepgauge.compensation.result import Compensation, skew_compensation
    from stepgauge.errors import InputError, naming
    from stepgauge.verbs.inputs import stored_evaluation

    one_axis = _measured_axis(measured)
    axis = axis or (None if one_axis is None or plane else _own_axis(one_axis))
    _check(axis, plane, to, unconfirmed_sense, file_type, joint)
    if tip_radius_mm is None and u_tip_radius_um:
        what = naming("tip_radius_mm", words="is the uncertainty of {}, which is missing")
        raise InputError(naming("u_tip_radius_um"), what)
    if axis is None:
        return skew_compensation(*stored_evaluation(measured), str(plane), to)  # type: ignore[arg-type]
    known = FORMATS[to]
    check_confirmed(known, unconfirmed_sense)
    if one_axis is not None:
        _check_unused(tip_radius_mm=tip_radius_mm)
        readings = _instrument_readings(one_axis, axis, actual, placement_number, offset_mm, u_length_um_per_m)
    else:
        _check_unused(actual=actual, u_length_um_per_m=u_length_um_per_m or None)
        tip = None if tip_radius_mm is None else (tip_radius_mm, u_tip_radius_um)
        readings = _gauge_readings(measured, axis, tip, placement_number, offset_mm, angle_limit_deg)
    if range_mm is not None and range_mm[0] >= range_mm[1]:
        raise InputError(naming("range_mm"), "must rise", found=range_mm, expected="LOW,HIGH")
    span = None if range_mm is None else (range_mm[0], range_mm[1])
    step = step_mm or (10.0 if known.even else None)
    table = make_table(readings, TableOptions(travel or known.travel, step, span, extend, zero_at_mm))  # type: ignore[arg-type]
    return Compensation(table, known, readings.told, template, file_type, joint, unconfirmed_sense).rendered()


def _measured_axis(measured: object) -> "AxisRecording | PositioningTest | None":
    """The recording or test of one axis, with whatever read it; None for what a gauge was evaluated to."""
    from stepgauge.reports.outcome import StandardTest
    from stepgauge.standards.positioning import PositioningTest
    from stepgauge.verbs.inputs import are_of_axis, resolve_axis

    if isinstance(measured, StandardTest) and isinstance(measured.test, PositioningTest):
        return measured.test
    return resolve_axis(measured) if are_of_axis([measured]) else None  # type: ignore[arg-type]


def _own_axis(measured: "AxisRecording | PositioningTest") -> str | None:
    """The axis that a recording says it is of."""
    name = measured.comments.get("axis", "").strip().lower()
    return name if name in ("x", "y", "z") else None


def _instrument_readings(
    measured: "AxisRecording | PositioningTest",
    axis: str,
    actual: str | None,
    number: int | None,
    offset_mm: float,
    u_length_um_per_m: float,
) -> "AxisReadings":
    """The errors of an axis beside which an instrument stood; what contradicts it is refused."""
    from stepgauge.axis.recording import AxisRecording
    from stepgauge.compensation import iso230_readings, recorded_readings
    from stepgauge.errors import InputError, naming

    own = _own_axis(measured)
    if own not in (None, axis):
        raise InputError(naming("axis"), "the recording is of another axis", found=axis, expected=own)
    if isinstance(measured, AxisRecording):
        return recorded_readings(measured, axis, actual, number, offset_mm, u_length_um_per_m)  # type: ignore[arg-type]
    if actual is not None:
        raise InputError(naming("actual"), "the test has it", expected=naming("actual", words="{} of the test"))
    return iso230_readings(measured, axis, number, offset_mm, u_length_um_per_m)


def _gauge_readings(
    measured: object,
    axis: str,
    tip: tuple[float, float] | None,
    number: int | None,
    offset_mm: float,
    angle_limit_deg: float,
) -> "AxisReadings":
    """The errors of an axis along which a gauge lay."""
    from stepgauge.compensation import TipRadius, axis_faces
    from stepgauge.errors import InputError, naming
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.verbs.inputs import stored_evaluation

    if not isinstance(measured, str | Path | Evaluation):
        expected = "what it was made from: the recording of the axis, or of a gauge what 'stepgauge evaluate' gives"
        raise InputError(naming("measured"), "this has no table", found=type(measured).__name__, expected=expected)
    read, path = stored_evaluation(measured)
    return axis_faces(read, path, axis, None if tip is None else TipRadius(*tip), number, offset_mm, angle_limit_deg)


def _check_unused(**stated: object) -> None:
    """A statement that would change nothing is a mistake: of a tip, or of an instrument that there was not."""
    from stepgauge.errors import InputError, naming

    for name, value in stated.items():
        if value is not None:
            tip = name.startswith("tip")
            what = "a recording of one axis has no tip" if tip else "is for a recording of one axis"
            raise InputError(naming(name), what, found=value)


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

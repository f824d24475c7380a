"""``import``: what a controller or a person wrote down to a recording."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT, Kind
from stepgauge.verbs.kinds import Count, Number, OneOf, Pair, Reads, Repeated, Text
from stepgauge.verbs.shared import (
    PLACEMENT,
    TEMPERATURE,
    Convention,
    File,
    GaugeIfNeeded,
    MachineIfNeeded,
    OutputFile,
    PlacementNumber,
)

if TYPE_CHECKING:
    from stepgauge.gauge.placement import Placement
    from stepgauge.importing.result import Imported
    from stepgauge.importing.tables.source import Given

    Pairs = Mapping[str, str] | Sequence[str]

FORMATS = ("linuxcnc", "dmis", "ippdme", "control", "grbl", "inspection", "csv", "xlsx")
ACCEPTED = ("missing", "doubled", "order", "foreign", "runs", "alarm", "shift", "repeats", "placements")
SENSORS = (
    *("touch", "dial", "laser", "encoder", "autocollimator"),
    *("capacitive", "inductive", "optical", "edm", "other"),
)
"""Written out so that --help needs no import of the effects; a test compares it with theirs."""
UNITS = "mm, um, nm, cm, m, inch, thou, deg, arcmin, arcsec, rad, mrad, urad, gon"
OF_POINTS = (
    *("gauge", "placement", "placement_number", "machine", "program", "points"),
    *("gauge_temperature_C", "tip_radius_mm", "temperature_unit"),
)
"""Parameters of points of three coordinates."""


class LengthOrAngle(Kind):
    """A unit of length or angle."""

    def __init__(self) -> None:
        super().__init__(metavar="UNIT", name="unit")

    def parse(self, text: str) -> str:
        from stepgauge.axis.units import plain_name
        from stepgauge.errors import InputError

        try:
            return plain_name(text)
        except InputError:
            raise ValueError(UNITS) from None

    def bounds(self) -> str:
        return UNITS


def leave(values: dict[str, Any], typed: set[str]) -> tuple[str, ...]:
    """What a table of one axis is read without."""
    if not values["sensor"] or "placement" in typed:
        return ()
    from stepgauge.importing.recorded import names_points_of

    return () if names_points_of(values) else OF_POINTS


def write(imported: "Imported", output: OutputFile) -> Written:
    """The recording.

    Parameters
    ----------
    output : recording to write (CSV, or .parquet)
    """
    imported.write(output)
    return Written([f"{output}: {imported.extent}"])


def said(imported: "Imported") -> str:
    """What was taken for what; the error that asks what is open where something is."""
    imported.settled()
    return "\n".join(imported.report)


@verb(write, leaves=leave, says=said)
def import_recording(
    log: Annotated["Given", Reads("LOG", foreign=True), ARGUMENT],
    *,
    format: Annotated[str | None, OneOf(*FORMATS)] = None,
    sensor: Annotated[str | None, OneOf(*SENSORS)] = None,
    gauge: GaugeIfNeeded = None,
    placement: Annotated["File | Placement | None", PLACEMENT] = None,
    program: Annotated[File | None, Reads("PROGRAM")] = None,
    machine: MachineIfNeeded = None,
    placement_number: PlacementNumber = 1,
    tip_radius_mm: Annotated[float | None, Number("mm", above=0.0, high=25.0)] = None,
    points: Annotated[str | None, OneOf("centres", "surface")] = None,
    gauge_temperature_C: Annotated[float | None, TEMPERATURE] = None,
    temperature_convention: Convention = None,
    unit: Annotated[str | None, LengthOrAngle()] = None,
    deviation_unit: Annotated[str | None, LengthOrAngle()] = None,
    temperature_unit: Annotated[str, OneOf("C", "K", "F")] = "C",
    time_unit: Annotated[str | None, OneOf("s", "ms", "min", "h")] = None,
    columns: Annotated["Pairs", Repeated(Pair(metavar="NAME=HEADER", whole=True), "column")] = (),
    rows: Annotated["str | Sequence[str]", Repeated(Text("[HEADER=]TEXT"), "rows")] = (),
    constants: Annotated["Pairs", Repeated(Pair(whole=True), "set")] = (),
    accept: Annotated["str | Sequence[str]", Repeated(OneOf(*ACCEPTED), "accept")] = (),
    header: Annotated[str | None, Text("NAMES")] = None,
    table: Annotated[int | None, Count(1)] = None,
    sheet: Annotated[str | None, Text("NAME")] = None,
    delimiter: Annotated[str | None, OneOf("semicolon", "tab", "bar", "comma")] = None,
    decimal: Annotated[str | None, OneOf("point", "comma")] = None,
    targets: Annotated[str | None, Text("TARGETS")] = None,
    heights: Annotated[File | None, Reads("FILE")] = None,
) -> "Imported":
    """Convert the log of a controller, or a table, to a recording.

    With ``program``, LOG is checked against the program that was run: every point there once, in order, on the line of
    its search and not farther than the search distance from its target; a point that is missing, doubled or out of
    order is named with its cycle, face and place. Without it, faces follow from the positions on the gauge as placed
    (``gauge`` and ``placement``), and cycles from the usual orders of 'stepgauge plan'. A table or a DMIS file that
    states cycle, face and direction of every row needs neither. Then serial, units, tip radius and faces are checked
    against the gauge. Nothing is written unless all of it fits.

    With ``sensor``, LOG may be a table of one axis: targets and readings (or deviations), one row per reading or one
    column per cycle, with or without directions of travel; readings at one position over time; or distances between
    stations. Text, Excel, JSON records and the files of laser software are read; 'stepgauge diagnose' reads the result
    without gauge and machine.

    The assignment of columns, and what was left out, is printed, and kept in the recording as '# import:' lines. What
    LOG leaves open is asked, with the choices that settle it; nothing is guessed that would give other numbers.

    Parameters
    ----------
    log : a path, an open file (text or bytes), or a DataFrame
    format : format of LOG. linuxcnc: (LOG,..) rows or (PROBEOPEN ..) file; dmis: DMIS output; ippdme: session log of
        I++; control: log of our programs on fanuc and similar, siemens, heidenhain, rrf; grbl: its console; inspection:
        G800 and G801; csv, xlsx: a table; default: recognised from its content
    sensor : sensor of LOG; with it, a table of one axis, of one position over time, or of distances is read, and a
        diagnosis considers only effects that such a sensor can have
    gauge : gauge file or shipped name; of one axis its faces are the targets
    placement : placement file of the gauge in that run: it says which face each point belongs to
    program : the program that was run, as the controller read it: every point is compared
    machine : machine file or shipped name: the name and the tip radius in LOG are compared with it
    tip_radius_mm : radius of the tip ball; default: what LOG, the program or the placement state
    points : whether LOG has tip centres or points compensated by the tip radius; default: what LOG says (PRCOMP in
        DMIS); else what the distance from the certified faces shows
    gauge_temperature_C : temperature of the gauge during the run; default: what LOG records, if it does
    unit : unit of coordinates, targets and readings whose header states none; default: of coordinates what LOG states,
        else mm
    deviation_unit : of one axis: the same of deviations
    temperature_unit : of a table: unit of temperatures whose header states none
    time_unit : of a table: unit of times that are numbers and whose header states none
    columns : of a table: which column holds a quantity, e.g. x_mm="Messwert X"; once per quantity; default: by the
        names
    rows : of a table whose rows are of several kinds (axes, features): read those with this text in a column, e.g. X
    constants : of a table: a column that it lacks the same in every row, e.g. y_mm=0 or direction=+
    accept : deviations of LOG to accept: points missing (also a log that ends early), doubled rows (the last touch is
        kept), rows out of order, foreign rows that are no points of the program, several runs of it, readings after an
        alarm, a shift of all coordinates, touches in a row as repeats, placements that only their axes tell apart
    header : of a table: names of all columns, e.g. "target_mm,reading_mm" or "x_mm,y_mm,z_mm"; default: those of LOG
    table : of a file with several tables: the one to read (without it, one that fits)
    sheet : of a workbook: the sheet to read; default: the only one
    delimiter : of a table as text: the character between columns; default: found from the rows
    decimal : of a table: the decimal mark; default: found from the numbers
    targets : of one axis: FIRST:LAST:STEP, a list such as 0,50,100, or a file of targets with their certified positions
        and standard uncertainties in um; default: the targets of LOG, or the faces of the gauge
    heights : of distances: a table of stations and their heights, in the unit of the distances; slope distances become
        horizontal ones, with the heights of instrument and target where LOG has columns of them

    Returns
    -------
    The recording, what each column was taken for, what was rejected, and what stays open.

    Raises
    ------
    InputError
        a file that no choice makes right: damaged, cut, contradicting itself or the gauge

    Examples
    --------
    stepgauge import stepgauge-probe-log.txt --format linuxcnc --program probe.ngc \\
        --gauge step-gauge-420 --placement placement.toml --gauge-temperature 20.4 -o recording.csv
    stepgauge import results.dmo --format dmis --program gauge.dmi -g step-gauge-420 -p placement.toml -o recording.csv
    stepgauge import points.csv -g step-gauge-420 -p placement.toml --column x_mm="Messwert X" -o recording.csv
    stepgauge import positioning.xlsx --sensor laser -o axis.csv
    """
    asked = SimpleNamespace(**locals())
    from stepgauge.errors import InputError, naming
    from stepgauge.importing.recorded import import_asked
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine, resolve_placement

    if placement is not None and gauge is None:
        raise InputError(naming("placement"), naming("gauge", words="needs {}"))
    if program is not None and placement is None:
        raise InputError(naming("program"), naming("gauge", "placement", words="needs {} and {}"))
    if gauge is not None:
        asked.gauge = resolve_gauge(gauge)
        asked.placement = None if placement is None else resolve_placement(placement, asked.gauge)
    asked.machine = None if machine is None else resolve_machine(machine)
    return import_asked(asked)

"""``stepgauge import``: what a controller or a person wrote down -> a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    PLACEMENT_NUMBER,
    TEMPERATURE_C,
    TEMPERATURE_CONVENTION,
    FiniteRange,
    is_typed,
    leaves,
    machine_option,
    output,
    say,
)

if TYPE_CHECKING:
    from stepgauge.gauge.placement import Placement
    from stepgauge.importing import TableLayout
    from stepgauge.machine.file import Machine
    from stepgauge.motion.moves import Program

FORMATS = ["linuxcnc", "dmis", "ippdme", "control", "grbl", "inspection", "csv", "xlsx"]
KINDS = ["missing", "doubled", "order", "foreign", "runs", "alarm", "shift", "repeats", "placements"]
DECIMALS = {"point": ".", "comma": ","}
SENSORS = [
    *("touch", "dial", "laser", "encoder", "autocollimator"),
    *("capacitive", "inductive", "optical", "edm", "other"),
]
"""Written out so that --help needs no import of the effects; a test compares it with theirs."""

OF_POINTS = (
    *("gauge", "placement", "placement_number", "machine", "program", "points"),
    *("gauge_temperature", "tip_radius", "length_unit", "temperature_unit"),
)
"""Options, by their Python names, of points of three coordinates."""


class _UnitName(click.ParamType):
    """A unit of length or angle."""

    name = "unit"
    words = "mm, um, nm, cm, m, inch, thou, deg, arcmin, arcsec, rad, mrad, urad, gon"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The plain name of the unit."""
        from stepgauge.axis.units import plain_name
        from stepgauge.errors import InputError

        try:
            return plain_name(value)
        except InputError:
            self.fail(f"{value!r} is no unit of length or angle ({self.words})", param, ctx)


UNIT = _UnitName()


def _left(options: dict[str, Any]) -> tuple[str, ...]:
    """What a table of one axis is read without."""
    return OF_POINTS if _is_of_axis(options["log"], options["source"], options) else ()


@click.command("import")
@click.argument("log", metavar="LOG")
@click.option(
    "--from",
    "source",
    type=click.Choice(FORMATS),
    help="Format of LOG. linuxcnc: (LOG,..) rows or (PROBEOPEN ..) file; dmis: DMIS output; ippdme: session log of I++;"
    " control: log of our programs on fanuc and similar, siemens, heidenhain, rrf; grbl: its console; inspection: G800"
    " and G801; csv, xlsx: a table. Default: recognised from its content.",
)
@click.option(
    "--program", metavar="PROGRAM", help="The program that was run, as the controller read it: every point is compared."
)
@click.option(
    "--gauge", "-g", envvar="STEPGAUGE_GAUGE", metavar="GAUGE", help="Gauge file (TOML), or the name of a shipped one."
)
@click.option(
    "--placement",
    "-p",
    metavar="P",
    help="Placement file (TOML) of the gauge in that run: it says which face each point belongs to.",
)
@machine_option(False, "Machine file or shipped name: the name and the tip radius in LOG are compared with it.")
@output("Recording (CSV, or .parquet) to write.")
@PLACEMENT_NUMBER
@click.option(
    "--gauge-temperature",
    type=TEMPERATURE_C,
    metavar="C",
    help="Temperature of the gauge during the run, deg C. Default: what LOG records, if it does.",
)
@click.option(
    "--tip-radius",
    type=FiniteRange(0.0, 25.0, min_open=True),
    metavar="MM",
    help="Radius of the tip ball, mm. Default: what LOG, PROGRAM or the placement state.",
)
@click.option(
    "--points",
    type=click.Choice(["centres", "surface"]),
    help="Whether LOG has tip centres or points compensated by the tip radius. Default: what LOG says (PRCOMP in DMIS);"
    " else what the distance from the certified faces shows.",
)
@click.option(
    "--accept",
    type=click.Choice(KINDS),
    multiple=True,
    help="Deviations of LOG to accept, repeatable: points missing (also a log that ends early), doubled rows (the last"
    " touch is kept), rows out of order, foreign rows that are no points of PROGRAM, several runs of it, readings after"
    " an alarm, a shift of all coordinates, touches in a row as repeats, placements that only"
    " their axes tell apart. Default: none.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME=HEADER",
    help='Of a table: which column holds a quantity, e.g. x_mm="Messwert X"; once per quantity. Default: by the names.',
)
@click.option("--sheet", metavar="NAME", help="Of a workbook: the sheet to read. Default: the only one.")
@click.option(
    "--delimiter",
    type=click.Choice(["semicolon", "tab", "bar", "comma"]),
    help="Of a table as text: the character between columns. Default: found from the rows.",
)
@click.option(
    "--decimal",
    type=click.Choice(list(DECIMALS)),
    help="Of a table: the decimal mark. Default: found from the numbers.",
)
@click.option(
    "--length-unit",
    type=click.Choice(["mm", "um", "m", "inch"]),
    help="Of a table: unit of coordinates whose header states none. Default: what LOG states, else mm.",
)
@click.option(
    "--temperature-unit",
    type=click.Choice(["C", "K", "F"]),
    default="C",
    show_default=True,
    help="Of a table: unit of temperatures whose header states none.",
)
@click.option(
    "--set",
    "constants",
    multiple=True,
    metavar="NAME=VALUE",
    help="Of a table: a column that it lacks the same in every row, e.g. y_mm=0 or direction=+; repeatable.",
)
@click.option(
    "--sensor",
    type=click.Choice(SENSORS),
    help="Sensor of LOG. With it, a table of targets and readings of one axis, of readings at one position over time,"
    " or of distances between stations is read; a diagnosis then considers only effects that such a sensor can have.",
)
@click.option(
    "--targets",
    metavar="TARGETS",
    help="Of one axis: FIRST:LAST:STEP, a list such as 0,50,100, or a file of targets with their certified positions"
    " and standard uncertainties in um. Default: the targets of LOG, or the faces of --gauge.",
)
@click.option(
    "--heights",
    metavar="FILE",
    help="Of distances: a table of stations and their heights, in the unit of the distances. Slope distances become"
    " horizontal ones, with the heights of instrument and target where LOG has columns of them.",
)
@click.option(
    "--unit",
    type=UNIT,
    metavar="UNIT",
    help=f"Of one axis: unit of targets and readings whose header states none: {UNIT.words}.",
)
@click.option("--deviation-unit", type=UNIT, metavar="UNIT", help="Of one axis: the same of deviations.")
@click.option(
    "--header",
    metavar="NAMES",
    help='Of a table: names of all columns, e.g. "target_mm,reading_mm" or "x_mm,y_mm,z_mm". Default: those of LOG.',
)
@click.option(
    "--table",
    type=click.IntRange(1),
    metavar="N",
    help="Of a file with several tables: the one to read (without it, one that fits).",
)
@click.option(
    "--rows",
    multiple=True,
    metavar="[HEADER=]TEXT",
    help="Of a table whose rows are of several kinds (axes, features): read those with this text in a column, e.g. X.",
)
@leaves(_left)
@TEMPERATURE_CONVENTION
def command(log: str, source: str | None, output: str, **options: Any) -> None:
    """Convert the log of a controller, or a table, to a recording.

    With --program, LOG is checked against the program that was run: every point there once, in order, on the line of
    its search and not farther than the search distance from its target; a point that is missing, doubled or out of
    order is named with its cycle, face and place. Without it, faces follow from the positions on the gauge as placed
    (--gauge and --placement), and cycles from the usual orders of 'stepgauge plan'. A table or a DMIS file that states
    cycle, face and direction of every row needs neither. Then serial, units, tip radius and faces are checked against
    the gauge. Nothing is written unless all of it fits.

    With --sensor, LOG may be a table of one axis: targets and readings (or deviations), one row per reading or one
    column per cycle, with or without directions of travel; readings at one position over time; or distances between
    stations. Text, Excel, JSON records and the files of laser software are read; 'stepgauge diagnose' reads the result
    without gauge and machine.

    The assignment of columns, and what was left out, is printed, and kept in the recording as '# import:' lines.

    \b
    stepgauge import stepgauge-probe-log.txt --from linuxcnc --program probe.ngc \\
        --gauge step-gauge-420 --placement placement.toml --gauge-temperature 20.4 -o recording.csv
    stepgauge import results.dmo --from dmis --program gauge.dmi -g step-gauge-420 -p placement.toml -o recording.csv
    stepgauge import points.csv -g step-gauge-420 -p placement.toml --column x_mm="Messwert X" -o recording.csv
    stepgauge import positioning.xlsx --sensor laser -o axis.csv
    """
    from stepgauge.files.budget import file_budget, within
    from stepgauge.files.text import check_output
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.importing import ImportOptions, import_log, recognise_log
    from stepgauge.machine.file import check_recorded, read_machine
    from stepgauge.recording import write_recording
    from stepgauge.recording.conventions import state_convention, with_convention

    check_output(output, log, options["program"], options["gauge"], options["placement"], options["machine"])
    _check_options(options)
    click.get_current_context().with_resource(within(file_budget(log), log))
    if _is_of_axis(log, source, options):
        _import_axis(log, output, options)
        return
    steps = read_gauge(options["gauge"]) if options["gauge"] else None
    lies = read_placement(options["placement"], steps) if steps is not None and options["placement"] else None
    layout = _layout(options, False)
    cmm = read_machine(options["machine"]) if options["machine"] else None
    program, radius = _read_program(options, lies, cmm)
    choice = ImportOptions(
        options["placement_number"],
        options["gauge_temperature"],
        radius,
        None if options["points"] is None else options["points"] == "surface",
        options["accept"],
    )
    imported = import_log(log, source or recognise_log(log), steps, lies, program, choice, layout)
    recording = imported.recording.with_comments(sensor=options["sensor"])
    recording = state_convention(recording, options["temperature_convention"])
    if cmm is not None:
        check_recorded(recording.comments, cmm)
        recording = with_convention(recording, cmm.table)
    write_recording(output, recording)
    for line in imported.report:
        say(line)
    placements = ", ".join(map(str, imported.recording.placements))
    say(f"wrote {output}: {len(imported.recording)} probings, placement {placements}")


def _is_of_axis(log: str, source: str | None, options: dict[str, Any]) -> bool:
    return bool(options["sensor"]) and not is_typed("placement") and not _names_points(log, source, options)


def _check_options(options: dict[str, Any]) -> None:
    if options["placement"] and not options["gauge"]:
        raise click.UsageError("--placement needs --gauge")
    if options["program"] and not options["placement"]:
        raise click.UsageError("--program needs --gauge and --placement")


def _layout(options: dict[str, Any], of_axis: bool) -> TableLayout:
    """How a table is to be read; its columns are named as those of an axis or of points."""
    from stepgauge.importing import TableLayout
    from stepgauge.importing.tables.cells import DELIMITERS
    from stepgauge.importing.tables.names import parse_mapping
    from stepgauge.importing.tables.roles import parse_roles

    return TableLayout(
        DELIMITERS.get(options["delimiter"] or ""),
        DECIMALS.get(options["decimal"] or ""),
        options["sheet"],
        (parse_roles if of_axis else parse_mapping)(options["columns"]),
        options["length_unit"],
        options["temperature_unit"],
        _constants(options),
        options["header"],
        options["table"],
        options["rows"],
    )


def _constants(options: dict[str, Any]) -> dict[str, str]:
    """``--set`` as names and texts."""
    pairs = [text.partition("=") for text in options["constants"]]
    for name, equals, value in pairs:
        if not (name.strip() and equals and value.strip()):
            raise click.UsageError(f"--set takes NAME=VALUE, not {name + equals + value!r}")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _names_points(log: str, source: str | None, options: dict[str, Any]) -> bool:
    """Whether a log has points of three coordinates: any but a table, and a table that names x, y and z."""
    from stepgauge.errors import InputError
    from stepgauge.importing import TABLES, recognise_log
    from stepgauge.importing.points import has_points

    kind = source or recognise_log(log)
    if kind not in TABLES:
        return True
    try:
        layout = _layout(options, False)
    except InputError:  # columns named as those of an axis
        return False
    return has_points(log, layout)


def _import_axis(log: str, output: str, options: dict[str, Any]) -> None:
    """A table of one axis, one spot or distances."""
    from stepgauge.axis.recording import write_axis_recording
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.importing.axis import AxisOptions, import_axis
    from stepgauge.importing.axis.targets import gauge_targets, parse_targets

    targets = parse_targets(options["targets"]) if options["targets"] else None
    if targets is None and is_typed("gauge"):
        targets = gauge_targets(read_gauge(options["gauge"]))
    choice = AxisOptions(
        options["sensor"],
        options["unit"],
        options["deviation_unit"],
        targets,
        "missing" in options["accept"],
        options["heights"],
    )
    imported = import_axis(log, choice, _layout(options, True))
    write_axis_recording(output, imported.recording)
    for line in imported.report:
        say(line)
    say(f"wrote {output}: {len(imported.recording)} readings")


def _read_program(
    options: dict[str, Any], placement: Placement | None, machine: Machine | None
) -> tuple[Program | None, float | None]:
    """The program, and the tip radius of the person or, where the program's text states it, of the program."""
    from stepgauge.importing import read_run_program

    radius = options["tip_radius"]
    if options["program"] is None:
        return None, radius
    located = placement.tip_radius_mm if placement else None
    known = radius or located or (machine.probe.tip_radius_mm if machine else None)
    program, stated = read_run_program(options["program"], known)
    return program, radius or stated

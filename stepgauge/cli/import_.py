"""``stepgauge import``: what a controller or a person wrote down -> a recording."""

from __future__ import annotations

from typing import Any

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

FORMATS = ["linuxcnc", "dmis", "ippdme", "control", "grbl", "inspection", "csv", "xlsx"]
KINDS = ["missing", "doubled", "order", "foreign", "runs", "alarm", "shift", "repeats", "placements"]
ARGUMENTS = {"tip_radius": "tip_radius_mm", "gauge_temperature": "gauge_temperature_C"}
"""Options whose arguments of the function end in a unit."""
SENSORS = [
    *("touch", "dial", "laser", "encoder", "autocollimator"),
    *("capacitive", "inductive", "optical", "edm", "other"),
]
"""Written out so that --help needs no import of the effects; a test compares it with theirs."""

OF_POINTS = (
    *("gauge", "placement", "placement_number", "machine", "program", "points"),
    *("gauge_temperature", "tip_radius", "temperature_unit"),
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
    type=click.Choice(["point", "comma"]),
    help="Of a table: the decimal mark. Default: found from the numbers.",
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
    help="Unit of coordinates, targets and readings whose header states none:"
    f" {UNIT.words}. Default: of coordinates what LOG states, else mm.",
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
    from stepgauge.importing.tables.source import read_source
    from stepgauge.public.import_recording import import_recording

    check_output(output, log, options["program"], options["gauge"], options["placement"], options["machine"])
    _check_options(options)
    click.get_current_context().with_resource(within(file_budget(log), log))
    given = {ARGUMENTS.get(name, name): value for name, value in options.items()}
    if _is_of_axis(log, source, options):
        given |= dict.fromkeys(("placement", "program", "machine"))
        given["gauge"] = given["gauge"] if is_typed("gauge") else None
    imported = import_recording(read_source(log), format=source, **given)
    imported.settled()
    imported.write(output)
    for line in imported.report:
        say(line)
    say(f"wrote {output}: {imported.extent}")


def _is_of_axis(log: str, source: str | None, options: dict[str, Any]) -> bool:
    from stepgauge.importing.tables.read import TableLayout
    from stepgauge.public.import_recording import DECIMALS, DELIMITERS, names_points, pairs_of

    if not options["sensor"] or is_typed("placement"):
        return False
    decimal, delimiter = DECIMALS.get(options["decimal"] or ""), DELIMITERS.get(options["delimiter"] or "")
    constants = pairs_of(options["constants"], "constants")
    layout = TableLayout(delimiter, decimal, options["sheet"], {}, header=options["header"], constants=constants)
    return not names_points(log, source, layout, options["columns"])


def _check_options(options: dict[str, Any]) -> None:
    if options["placement"] and not options["gauge"]:
        raise click.UsageError("--placement needs --gauge")
    if options["program"] and not options["placement"]:
        raise click.UsageError("--program needs --gauge and --placement")

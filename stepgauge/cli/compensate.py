"""``stepgauge compensate``: evaluation -> an error table for a controller."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import FiniteRange, output, plot_option, say, say_written

if TYPE_CHECKING:
    from stepgauge.compensation import CompensationTable, TableOptions, TipRadius

FORMATS = [
    *("linuxcnc", "siemens", "siemens-cec", "heidenhain", "fanuc", "fanuc-g10"),
    *("grbl", "marlin", "rrf", "klipper", "csv"),
]
UNCONFIRMED = ["heidenhain", "fanuc", "fanuc-g10"]
"""Formats whose sense no source confirms; a test compares them with the table of conventions."""
MILLIMETRES = FiniteRange(-1e6, 1e6)


@click.command("compensate")
@click.argument("evaluation", metavar="EVALUATION")
@click.option("--axis", type=click.Choice(["x", "y", "z"]), help="Machine axis that is corrected.")
@click.option(
    "--plane",
    type=click.Choice(["xy", "xz", "yz"]),
    help="Instead of --axis: the skew of two axes, from a gauge along both diagonals (marlin, klipper, rrf).",
)
@click.option(
    "--to",
    "to",
    type=click.Choice(FORMATS),
    required=True,
    help="linuxcnc: COMP_FILE; siemens: $AA_ENC_COMP, siemens-cec: $AN_CEC of SINUMERIK; heidenhain: .COM; fanuc: pitch"
    " error pulses, fanuc-g10: as a program; grbl, marlin, rrf: scale and backlash; klipper: skew; csv: for any other"
    " controller.",
)
@output("File to write; beside it goes the same name with .json added: what it was made from, notes, uncertainties.")
@click.option(
    "--template",
    metavar="FILE",
    help="Your own Jinja template; start from a copy: 'stepgauge shipped compensation-siemens.j2 --copy-to mine'.",
)
@click.option(
    "--tip-radius",
    type=FiniteRange(0.0, 50.0, min_open=True),
    metavar="MM",
    help="Effective tip radius known from elsewhere (ring or sphere), mm. Without it a constant reversal of the axis"
    " cannot be separated from the tip size and is not in the table.",
)
@click.option(
    "--u-tip-radius",
    type=FiniteRange(0.0, 100.0),
    default=0.0,
    show_default=True,
    metavar="UM",
    help="Standard uncertainty of --tip-radius, um.",
)
@click.option(
    "--travel",
    type=click.Choice(["both", "mean", "positive", "negative"]),
    help="Directions of travel in the table. Default: both; siemens: mean, for it has one table.",
)
@click.option(
    "--step",
    type=FiniteRange(0.0, 1e5, min_open=True),
    metavar="MM",
    help="Even spacing at whole multiples of it, mm. Default: the places of the faces; siemens: 10 mm.",
)
@click.option(
    "--range", "span", type=MILLIMETRES, nargs=2, metavar="LOW HIGH", help="Ends of the table, mm. Default: measured."
)
@click.option(
    "--extend",
    type=click.Choice(["none", "hold", "linear"]),
    default="none",
    show_default=True,
    help="Beyond what was measured: refuse, hold the end value, or go on with the fitted slope.",
)
@click.option(
    "--zero-at",
    type=MILLIMETRES,
    metavar="MM",
    help="Machine coordinate where the correction is zero (the reference point), mm. Default: the table's low end.",
)
@click.option(
    "--offset",
    type=MILLIMETRES,
    default=0.0,
    show_default=True,
    metavar="MM",
    help="Machine coordinate minus recorded coordinate of the axis, mm (a work offset).",
)
@click.option(
    "--angle-limit",
    type=FiniteRange(0.0, 10.0),
    default=1.0,
    show_default=True,
    metavar="DEG",
    help="Largest angle between gauge and axis, deg.",
)
@click.option(
    "--placement-number",
    type=click.IntRange(1),
    metavar="N",
    help="Which placement of the evaluation. Default: the one that lies along the axis.",
)
@click.option(
    "--file-type",
    type=click.IntRange(0, 1),
    default=0,
    show_default=True,
    help="linuxcnc: COMP_FILE_TYPE, 0 positions, 1 trims. siemens: number of the measuring system, 0 or 1.",
)
@click.option(
    "--joint", type=click.IntRange(0, 30), help="Number of the axis in the controller. Default: x 0, y 1, z 2."
)
@click.option(
    "--unconfirmed-sense",
    type=click.Choice(UNCONFIRMED),
    help="The format of --to, again: write it although no source confirms its sense. Compare one position with and"
    " without the table.",
)
@plot_option("The table as a figure")
def command(evaluation: str, axis: str | None, to: str, output: str, **options: Any) -> None:
    """An error table of one axis, ready for a controller: EVALUATION is the folder of evaluate or its evaluation.json.

    The gauge must lie along the axis. Errors are those of the axis in machine coordinates, by direction of travel,
    averaged over the cycles; error = indicated minus true. Nothing is extrapolated unless you ask for it.

    Measure with the compensation that is in force switched off: the table is for the axis as it was measured.

    \b
    stepgauge compensate result --axis x --to linuxcnc --tip-radius 1.9973 -o x.comp
    stepgauge compensate result --axis y --to siemens --step 20 --zero-at 0 --extend hold -o AX2_EEC.INI
    stepgauge compensate result --axis x --to csv -o x.csv --plot x.png
    stepgauge compensate diagonals --plane xy --to marlin -o skew.gcode
    """
    from stepgauge.compensation import FORMATS, axis_faces, make_table, render_table, write_table
    from stepgauge.compensation.formats import check_confirmed
    from stepgauge.files.text import check_output
    from stepgauge.recording.simulated import is_simulated
    from stepgauge.reports.reading import find_evaluation, read_checked_evaluation

    path = find_evaluation(evaluation)
    check_output(output, path, options["template"])
    _check_options(axis, to, options)
    if axis is None:
        _write_skew(path, options["plane"], to, output)
        return
    known = FORMATS[to]
    check_confirmed(known, options["unconfirmed_sense"])
    read = read_checked_evaluation(path)
    faces = axis_faces(
        read,
        path,
        axis,
        _tip(options),
        options["placement_number"],
        options["offset"],
        options["angle_limit"],
    )
    table = make_table(faces, _table_options(options, known.travel, 10.0 if known.even else None))
    numbers = options["file_type"], options["joint"]
    text = render_table(table, known, options["template"], *numbers, options["unconfirmed_sense"])
    written = write_table(output, text, table, known)
    if options["plot"]:
        from stepgauge.figures.compensation import draw_compensation

        draw_compensation(options["plot"], table, is_simulated(read["comments"]))
        written.append(Path(options["plot"]))
    _tell(table)
    say(f"note: {to} needs: {known.convention.needs}")
    if to == "linuxcnc":
        _say_ini(output, "xyz".index(axis) if options["joint"] is None else options["joint"], options["file_type"])
    say_written(*written)


def _check_options(axis: str | None, to: str, options: dict[str, Any]) -> None:
    """A usage error for what does not go together; a skew has no table, so what tables need does not matter to it."""
    if (axis is None) == (options["plane"] is None) or (to == "klipper" and axis is not None):
        raise click.UsageError("--axis for a table, or --plane for a skew (klipper: --plane only)")
    if axis is None and options["unconfirmed_sense"]:
        raise click.UsageError("--unconfirmed-sense is for a table (--axis); the skew of every firmware is confirmed")
    if axis is None:
        return
    if to == "csv" and (options["file_type"] or options["joint"] is not None):
        raise click.UsageError("--file-type and --joint are for linuxcnc and siemens; a csv table has neither.")
    if to not in ("linuxcnc", "siemens") and options["file_type"]:
        raise click.UsageError("--file-type is for linuxcnc and siemens.")


def _say_ini(output: str, joint: int, kind: int) -> None:
    """What LinuxCNC's configuration must say for the table to be in force."""
    say(f"for the INI file, [JOINT_{joint}]: COMP_FILE = {Path(output).name}, COMP_FILE_TYPE = {kind}")


def _write_skew(path: Path, plane: str, to: str, output: str) -> None:
    """The commands of a firmware against the skew of a plane."""
    from stepgauge.compensation.skew import find_skew, render_skew
    from stepgauge.conditions import stored_conditions
    from stepgauge.files.text import write_text
    from stepgauge.reports.reading import read_checked_evaluation

    evaluation = read_checked_evaluation(path)
    skew = find_skew(evaluation, path, plane)
    write_text(output, render_skew(skew, to, evaluation, path))
    for note in stored_conditions(evaluation).notes:
        say(f"note: {note}")
    say(f"{plane}: indicated {plane[0]} too large by {skew.alpha_rad * 1e6:+.1f} um per m of {plane[1]}")
    say_written(output)


def _tip(options: dict[str, Any]) -> TipRadius | None:
    from stepgauge.compensation import TipRadius

    radius = options["tip_radius"]
    if radius is None and options["u_tip_radius"]:
        raise click.UsageError("--u-tip-radius is the uncertainty of --tip-radius, which is missing")
    return None if radius is None else TipRadius(radius, options["u_tip_radius"])


def _table_options(options: dict[str, Any], travel: Any, step_mm: float | None) -> TableOptions:
    from stepgauge.compensation import TableOptions

    span = options["span"]
    if span is not None and span[0] >= span[1]:
        raise click.UsageError(f"--range must rise: found {span[0]:g} {span[1]:g}, expected LOW HIGH in mm")
    return TableOptions(
        options["travel"] or travel, options["step"] or step_mm, span, options["extend"], options["zero_at"]
    )


def _tell(table: CompensationTable) -> None:
    x, largest = table.position_mm, max(abs(table.positive_um).max(), abs(table.negative_um).max())
    u = max(table.u_positive_um.max(), table.u_negative_um.max())
    for note in table.notes:
        say(f"note: {note}")
    say(
        f"{table.axis}: {len(table)} rows from {x[0]:.3f} to {x[-1]:.3f} mm, zero at {table.zero_at_mm:.3f} mm;"
        f" largest correction {largest:.2f} um, largest standard uncertainty {u:.2f} um"
    )

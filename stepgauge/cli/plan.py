"""``stepgauge plan``: placement + gauge -> a checked measuring program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, FiniteRange, machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine_file import Machine
    from stepgauge.placement import Placement

POSITIVE = FiniteRange(min=0.0, min_open=True)


@click.command("plan")
@click.argument("source", required=False, metavar="[PLACEMENT|POINTS]")
@GAUGE
@output("Program file to write; with --iso10360 the folder for placements and programs.")
@click.option(
    "--dialect",
    "-d",
    type=click.Choice(["jinyoung", "dmis", "linuxcnc", "ippdme"]),
    required=True,
    help="Language of the controller.",
)
@click.option("--template", metavar="FILE", help="Your own Jinja template instead of the shipped one of the dialect.")
@click.option(
    "--route",
    type=click.Choice(["side", "over"]),
    default="side",
    show_default=True,
    help="From face to face around the side of the blocks (horizontal path) or over their top (vertical path).",
)
@click.option(
    "--around",
    type=click.Choice(["+s", "-s"]),
    default="+s",
    show_default=True,
    help="Side that the route 'side' takes: right (+s) or left (-s), looking along the gauge.",
)
@click.option(
    "--order",
    type=click.Choice(["blocks", "fronts-backs", "up-down"]),
    default="blocks",
    show_default=True,
    help="Front and back block by block; all fronts then all backs; or cycles up and down the gauge in turn.",
)
@click.option(
    "--cycles", type=click.IntRange(1, 1000), help="Repetitions of every face. [default: 5; with --iso10360: 3]"
)
@click.option("--blocks", metavar="A:B|A,B,...", help="First and last block to measure, or a list; default: all.")
@click.option(
    "--iso10360",
    is_flag=True,
    help="No PLACEMENT: plan the seven positions of ISO 10360-2 in the machine's travel (needs --machine).",
)
@click.option(
    "--stylus",
    type=click.Choice(["auto", "machine", "square"]),
    default="auto",
    show_default=True,
    help="With --iso10360, direction of the stylus: as in the machine file, square to the gauge (an indexing head turns"
    " it), or as in the machine file where that is clear of the gauge and else square.",
)
@click.option(
    "--allow-short",
    is_flag=True,
    help="With --iso10360: write what can be measured even where the gauge does not fit or is too short.",
)
@click.option("--points-on", metavar="A:B", help="Blocks that POINTS were probed on; default: the first and the last.")
@machine_option(False, "Machine file: travel limits, stylus and speeds. Without it the travel is not checked.")
@click.option(
    "--tip-radius", type=POSITIVE, metavar="MM", help="Nominal tip radius, mm; default: machine or placement."
)
@click.option(
    "--standoff",
    type=POSITIVE,
    metavar="MM",
    help="Gap between ball and face before measuring, mm; default: the middle of the gap between blocks.",
)
@click.option(
    "--search",
    type=POSITIVE,
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the nominal contact, mm.",
)
@click.option(
    "--clearance",
    type=POSITIVE,
    default=5.0,
    show_default=True,
    metavar="MM",
    help="Gap between ball and blocks on the way, mm.",
)
@click.option(
    "--margin",
    type=FiniteRange(0.0),
    default=0.5,
    show_default=True,
    metavar="MM",
    help="Smallest gap that the check accepts, mm.",
)
@click.option(
    "--height",
    type=FiniteRange(),
    default=0.0,
    show_default=True,
    metavar="MM",
    help="Probing point above the middle of the faces, mm.",
)
@click.option(
    "--home", metavar="X,Y,Z", help="Where the program starts and ends, machine mm; default: above the gauge."
)
@click.option("--measuring-speed", type=POSITIVE, metavar="MM/S", help="mm/s; default: the machine's, or 3.")
@click.option("--travel-speed", type=POSITIVE, metavar="MM/S", help="mm/s; default: the machine's, or 50.")
def command(source: str | None, gauge: str, output: str, dialect: str, template: str | None, **options: Any) -> None:
    """Plan the measurement of the step gauge and write the program for the controller.

    Starts from a placement file, or from the 16 points (see 'stepgauge locate'). The whole path is checked before
    anything is written: tip ball, stylus shank and probe body against every block and the rail, every measuring move
    must meet its own face first, and every position must lie within the machine's travel. The way to the first position
    is yours: bring the machine to a safe place above the gauge.

    \b
    stepgauge plan placement.toml --gauge step-gauge-420 --machine bridge-cmm --dialect dmis -o gauge.dmi
    stepgauge plan points.csv --gauge my-gauge.toml --dialect linuxcnc --route over --cycles 3 -o gauge.ngc
    stepgauge plan placement.toml -g my-gauge.toml -d dmis --template my-dialect.j2 -o gauge.prg
    stepgauge plan --iso10360 -g step-gauge-1020 -m bridge-cmm -d dmis -o seven-positions
    """
    if options["iso10360"]:
        from stepgauge.cli.plan_iso10360 import plan_seven

        plan_seven(source, gauge, output, dialect, template, options)
        return
    if options["allow_short"] or options["stylus"] != "auto":
        raise click.UsageError("--allow-short and --stylus go with --iso10360.")
    if source is None:
        raise click.UsageError("Missing argument 'PLACEMENT|POINTS' (or --iso10360).")
    from stepgauge.collision import make_tool
    from stepgauge.files import check_output, write_text
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.plan import faces_in_order, make_program
    from stepgauge.plan_check import check_program, check_travel
    from stepgauge.probes.schema import ConstantTable
    from stepgauge.programs import DIALECTS

    check_output(output, source, gauge, options["machine"], template)
    steps = read_gauge(gauge)
    machine = read_machine(options["machine"]) if options["machine"] else None
    placement = _placement(source, steps, options["points_on"], options["tip_radius"], machine)
    radius = _tip_radius(options["tip_radius"], machine, placement, source)
    probe = (
        machine.probe.model_copy(update={"tip_radius_mm": radius}) if machine else ConstantTable(tip_radius_mm=radius)
    )
    choice = plan_options(options, steps)
    program = make_program(placement, steps, choice, probing_settings(options, steps, machine, radius))
    faces = [face for _, face in faces_in_order(choice)]
    check_program(program, faces, placement, steps, make_tool(probe), choice.margin_mm)
    if machine is not None:
        check_travel(program, machine)
    text, note = program_text(program, dialect, template)
    write_text(output, text, newline=DIALECTS[dialect].newline)
    say(f"{program.n_points} points, {len(program)} moves; {_duration(program)}")
    say("path checked: gauge, rail" + (", travel" if machine else "; travel limits NOT checked (no --machine)"))
    say(note)
    say(f"wrote {output}")


def _placement(
    source: str, gauge: Gauge, points_on: str | None, tip_radius_mm: float | None, machine: Machine | None
) -> Placement:
    from stepgauge.locate import locate, read_points
    from stepgauge.placement import is_placement_file, read_placement
    from stepgauge.plan import parse_blocks

    if is_placement_file(source):
        return read_placement(source, gauge)
    if tip_radius_mm is None and machine is not None:
        tip_radius_mm = machine.probe.tip_radius_mm
    sigma_um = machine.table.repeatability_um if machine else 1.0
    return locate(read_points(source), gauge, parse_blocks(points_on or ":", gauge), sigma_um, tip_radius_mm, source)


def _tip_radius(stated: float | None, machine: Machine | None, placement: Placement, source: str) -> float:
    from stepgauge.errors import InputError
    from stepgauge.locate.checks import RADIUS_TOLERANCE_MM

    probed = placement.tip_radius_mm
    for radius in (stated, machine.probe.tip_radius_mm if machine else None, placement.tip_radius_mm):
        if radius is None:
            continue
        if probed is not None and abs(radius - probed) > RADIUS_TOLERANCE_MM:
            raise InputError(
                source,
                "the gauge was probed with another tip",
                found=f"tip radius {probed:g} mm",
                expected=f"{radius:g} mm",
            )
        return radius
    raise InputError(source, "the tip radius is not known", expected="--tip-radius, --machine or key tip_radius_mm")


def plan_options(options: dict[str, Any], gauge: Gauge) -> Any:
    from stepgauge.plan import PlanOptions, parse_block_list, parse_blocks, parse_position

    text = options["blocks"] or ":"
    only = parse_block_list(text, gauge) if "," in text else None
    first, last = (only[0], only[-1]) if only else parse_blocks(text, gauge)
    return PlanOptions(
        first,
        last,
        route=options["route"],
        order=options["order"],
        cycles=options["cycles"] or (3 if options["iso10360"] else 5),
        clearance_mm=options["clearance"],
        margin_mm=options["margin"],
        height_mm=options["height"],
        around=1 if options["around"] == "+s" else -1,
        home_mm=parse_position(options["home"]) if options["home"] else None,
        only_blocks=only,
    )


def probing_settings(options: dict[str, Any], gauge: Gauge, machine: Machine | None, radius: float) -> Any:
    from stepgauge.moves import ProbingSettings
    from stepgauge.plan import middle_standoff_mm

    standoff = options["standoff"] or middle_standoff_mm(gauge, radius)
    return ProbingSettings(
        standoff_mm=standoff,
        search_mm=options["search"],
        retract_mm=standoff,
        measuring_speed_mm_s=options["measuring_speed"] or (machine.table.measuring_speed_mm_s if machine else 3.0),
        travel_speed_mm_s=options["travel_speed"] or (machine.table.travel_speed_mm_s if machine else 50.0),
        tip_radius_mm=radius,
    )


def program_text(program: Any, dialect: str, template: str | None) -> tuple[str, str]:
    """The program for the controller, read back and compared, and what to say of that."""
    from stepgauge.programs import DIALECTS
    from stepgauge.programs.render import render

    text = render(program, DIALECTS[dialect], template)
    return text, _read_back(text, program, DIALECTS[dialect], template)


def _read_back(text: str, program: Any, dialect: Any, template: str | None) -> str:
    """Read the text as the controller would and compare; a user's template may speak a language that is not read."""
    from stepgauge.errors import InputError
    from stepgauge.programs.render import same_moves

    try:
        back = dialect.read(text, "program", program.settings)
    except InputError as error:
        if template is None:
            raise
        return f"the text of {template} is no {dialect.name}, so it was not read back ({error})"
    if not same_moves(program, back, dialect.decimals):
        where = template or dialect.template
        raise InputError(where, f"read as {dialect.name}, the rendered program makes other moves than planned")
    return f"read back as {dialect.name}: the same moves to {10.0**-dialect.decimals:g} mm"


def _duration(program: Any) -> str:
    import numpy as np

    from stepgauge.moves import trace

    path, settings = trace(program), program.settings
    speed = np.where(path.measuring, settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
    minutes, seconds = divmod(round(float((path.length_mm / speed).sum())), 60)
    return f"about {minutes} min {seconds} s at full speed"

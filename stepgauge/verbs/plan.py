"""``plan``: placement and gauge to a checked measuring path, and its program."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from stepgauge.files.display import Written
from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import BlockRange, Count, Flag, Number, OneOf, Pair, Reads, Repeated, Text, Vector
from stepgauge.verbs.shared import DIALECT, File, GaugeLike, MachineIfNeeded, OutputFile, TipRadius

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stepgauge.gauge.certified import Gauge
    from stepgauge.gauge.placement import Placement
    from stepgauge.machine.file import Machine
    from stepgauge.planning.planned import Plan
    from stepgauge.planning.program import ProbingChoice

SIDES = {"+s": 1, "-s": -1}
ALONG_AN_AXIS = 0.99
"""Cosine to a machine axis from which a gauge lies along it: whole turns of its screw stay whole."""
PATH = (
    *("cycles", "first_again", "route", "around", "order", "clearance_mm", "margin_mm", "height_mm", "standoff_mm"),
    *("measuring_speed_mm_s", "travel_speed_mm_s"),
)
"""Parameters of a path along the gauge, of all verbs that plan one."""
TextFile = Annotated[File | None, Reads("FILE")]
Controls = Annotated["Mapping[str, str] | None", Repeated(Pair(), "set")]


def write(
    plan: "Plan",
    output: OutputFile,
    *,
    dialect: Annotated[str, DIALECT],
    template: TextFile = None,
    unchecked: Annotated[bool, Flag()] = False,
    tool: Annotated[str, Text("NAME")] = "",
    settings: Controls = None,
) -> Written:
    """The program, and the files that the control needs besides.

    Parameters
    ----------
    output : program file to write
    dialect : language of the controller
    template : your own Jinja template instead of the shipped one of the dialect
    unchecked : with ``template``: write a program that cannot be read back and compared with the plan; the file says so
    tool : what the controller calls the probe (dmis, ippdme); default: PROBE in DMIS, StepGaugeProbe in I++ DME
    settings : how the control is set up where it differs from the usual ('stepgauge list dialects NAME')
    """
    from stepgauge.errors import InputError, naming

    if unchecked and template is None:
        raise InputError(
            naming("unchecked"), naming("template", words="goes with {}: shipped ones are always read back")
        )
    rendered = plan.write(
        output, dialect, template=template, tool=tool, unchecked=unchecked, settings=dict(settings or {})
    )
    return Written([output, *rendered.further_files(output)], [rendered.note])


@verb(write)
def plan(
    placement: Annotated["File | Placement", Reads("PLACEMENT"), ARGUMENT],
    gauge: GaugeLike,
    machine: MachineIfNeeded = None,
    *,
    cycles: Annotated[int, Count(1, 1000)] = 5,
    first_again: Annotated[bool, Flag()] = False,
    blocks: Annotated["str | Sequence[int] | None", BlockRange(listed=True)] = None,
    route: Annotated[str, OneOf("side", "over")] = "side",
    around: Annotated[str, OneOf("+s", "-s")] = "+s",
    order: Annotated[str, OneOf("blocks", "fronts-backs", "up-down")] = "blocks",
    clearance_mm: Annotated[float, Number("mm", above=0.0)] = 5.0,
    margin_mm: Annotated[float, Number("mm", 0.0)] = 0.5,
    height_mm: Annotated[float, Number("mm")] = 0.0,
    home_mm: Annotated["Sequence[float] | None", Vector(count=3, unit="mm")] = None,
    standoff_mm: Annotated[float | None, Number("mm", above=0.0)] = None,
    search_mm: Annotated[float, Number("mm", above=0.0)] = 2.0,
    measuring_speed_mm_s: Annotated[float | None, Number("mm/s", above=0.0)] = None,
    travel_speed_mm_s: Annotated[float | None, Number("mm/s", above=0.0)] = None,
    tip_radius_mm: TipRadius = None,
    points_on: Annotated[str | None, BlockRange()] = None,
    teach: Annotated[bool, Flag()] = False,
) -> "Plan":
    """Plan the measurement of the step gauge and write the program for the controller.

    Starts from a placement file, or from the 16 points (see 'stepgauge locate'). The whole path is checked before
    anything is written: tip ball, stylus shank and probe body against every block and the rail, every measuring move
    must meet its own face first, and every position must lie within the machine's travel. The text is then read back
    and compared with the plan: moves, directions, speeds, units, coordinate system, tool. The way to the first position
    is yours: bring the machine to a safe place above the gauge.

    Parameters
    ----------
    placement : how the gauge lies: a placement file, or the file of the 16 points
    machine : machine file: travel limits, stylus and speeds; without it the travel is not checked
    cycles : repetitions of every face
    first_again : touch the first face again at the end of every cycle, to show a drift; up-down comes back by itself
    blocks : first and last block to measure, 1:21, or a list; default: all
    route : from face to face around the side of the blocks (horizontal path) or over their top (vertical path)
    around : side that the route ``side`` takes: right (+s) or left (-s), looking along the gauge
    order : front and back block by block; all fronts then all backs; or cycles up and down the gauge in turn
    clearance_mm : gap between ball and blocks on the way
    margin_mm : smallest gap that the check accepts
    height_mm : probing point above the middle of the faces
    home_mm : where the program starts and ends, in machine coordinates; default: above the gauge
    standoff_mm : gap between ball and face before measuring; default: the middle of the gap, at most 10 mm
    search_mm : search beyond the nominal contact
    measuring_speed_mm_s : speed of the searches, within the machine's limits; default: the machine's, or 3
    travel_speed_mm_s : speed on the way, within the machine's limits; default: the machine's, or 50
    tip_radius_mm : nominal tip radius; default: that of the machine or the placement
    points_on : blocks that the 16 points were probed on; default: the first and the last
    teach : the 16 points are rough: plan a program that touches them there, whose log 'stepgauge locate' reads

    Returns
    -------
    The plan, which writes itself as a program for any controller.

    Raises
    ------
    InputError
        the move that would collide, miss its face, or leave the travel

    Examples
    --------
    stepgauge plan placement.toml --gauge step-gauge-420 --machine bridge-cmm --dialect dmis -o gauge.dmi
    stepgauge plan points.csv --gauge my-gauge.toml --dialect linuxcnc --route over --cycles 3 -o gauge.ngc
    stepgauge plan placement.toml -g my-gauge.toml -d dmis --template my-dialect.j2 -o gauge.prg
    stepgauge plan rough.csv --teach -g my-gauge.toml -m my-machine.toml -d fanuc -o teach.nc
    """
    from stepgauge.planning.plan import PlanOptions, parse_position
    from stepgauge.planning.planned import Plan
    from stepgauge.planning.program import (
        ProbingChoice,
        agreed_tip_radius_mm,
        checked_program,
        make_settings,
    )
    from stepgauge.verbs.inputs import resolve_block_list, resolve_gauge, resolve_machine, resolve_placement

    steps = resolve_gauge(gauge)
    cmm = None if machine is None else resolve_machine(machine)
    choice = ProbingChoice(standoff_mm, search_mm, measuring_speed_mm_s, travel_speed_mm_s)
    if teach:
        return _teach(placement, steps, cmm, choice, tip_radius_mm, points_on, margin_mm)
    if isinstance(placement, File):
        lies, where = _read_or_locate(placement, steps, cmm, tip_radius_mm, points_on), placement
    else:
        lies, where = resolve_placement(placement, steps), "placement"
    radius = agreed_tip_radius_mm(lies, cmm, tip_radius_mm, where)
    settings = make_settings(steps, cmm, radius, choice)
    (first, last), only = resolve_block_list(blocks, steps)
    options = PlanOptions(
        first,
        last,
        route=route,
        order=order,
        cycles=cycles,
        clearance_mm=clearance_mm,
        margin_mm=margin_mm,
        height_mm=height_mm,
        around=SIDES[around],
        home_mm=None if home_mm is None else parse_position(",".join(repr(float(value)) for value in home_mm)),
        only_blocks=only,
        first_again=first_again,
    )
    program = checked_program(lies, steps, cmm, options, settings)
    notes = (*lies.details.get("notes", ()), *_unseen_leads(lies, steps, cmm, options.blocks))
    return Plan(program, cmm is not None, notes)


def _unseen_leads(
    placement: "Placement", gauge: "Gauge", machine: "Machine | None", blocks: "NDArray[np.int64]"
) -> "Iterator[str]":
    """That blocks lie in whole turns of usual screws, along an axis of a machine that has screws."""
    from stepgauge.diagnosis.wording.aliases import leads_into_mm
    from stepgauge.diagnosis.wording.findings import STEPPERS

    along = max(map(abs, placement.axis)) > ALONG_AN_AXIS
    if machine is None or machine.table.kind not in STEPPERS or not along or len(blocks) < 2:
        return
    every = (gauge.position_mm[2 * blocks - 2 + side] for side in (0, 1))
    leads = leads_into_mm(*(float(step) for faces in every for step in faces[1:] - faces[:-1]))
    if leads:
        yield (
            f"these blocks are whole multiples of {', '.join(f'{lead:g}' for lead in leads)} mm apart: where a screw"
            " has such a lead, its periodic error is alike at all of them, and stands in the pre-travel with up to its"
            " amplitude, in the backlash with twice that; other distances show it, or the bar once more some mm further"
            " along"
        )


def _teach(
    points: "File | Placement",
    gauge: "Gauge",
    machine: "Machine | None",
    choice: "ProbingChoice",
    tip_radius_mm: float | None,
    points_on: str | None,
    margin_mm: float,
) -> "Plan":
    """The plan of the 16 points, from rough positions."""
    from stepgauge.errors import InputError, naming
    from stepgauge.importing.sixteen import read_sixteen
    from stepgauge.planning.plan import parse_blocks
    from stepgauge.planning.planned import Plan
    from stepgauge.planning.program import make_settings
    from stepgauge.planning.teach import teach_program

    if not isinstance(points, File):
        raise InputError(naming("teach"), "a placement is known already", expected="a file of 16 rough positions")
    radius = tip_radius_mm or (machine.probe.tip_radius_mm if machine else None)
    if radius is None:
        expected = naming("tip_radius_mm", "machine", words="{} or {}")
        raise InputError(points, "the tip radius is not known", expected=expected)
    settings = make_settings(gauge, machine, radius, choice)
    blocks = parse_blocks(points_on or ":", gauge)
    program, _ = teach_program(read_sixteen(points), gauge, blocks, machine, settings, margin_mm)
    return Plan(program, machine is not None)


def _read_or_locate(
    source: File,
    gauge: "Gauge",
    machine: "Machine | None",
    tip_radius_mm: float | None,
    points_on: str | None,
) -> "Placement":
    """The placement in a TOML file, or located from the 16 points in a file."""
    from stepgauge.alignment import locate
    from stepgauge.gauge.placement import is_placement_file, possible_scale_error, read_placement
    from stepgauge.planning.plan import parse_blocks

    if is_placement_file(source):
        return read_placement(source, gauge, possible_scale_error(machine))
    from stepgauge.importing.sixteen import read_sixteen  # long to load

    if tip_radius_mm is None and machine is not None:
        tip_radius_mm = machine.probe.tip_radius_mm
    sigma_um = machine.table.virtual_repeatability_um if machine else 1.0
    blocks, scale_error = parse_blocks(points_on or ":", gauge), possible_scale_error(machine)
    return locate(read_sixteen(source), gauge, blocks, sigma_um, tip_radius_mm, source, scale_error=scale_error)

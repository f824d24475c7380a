"""``test plan``: the seven positions of ISO 10360-2 as placements and programs."""

from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.files.display import Written
from stepgauge.verbs.define import Of, verb
from stepgauge.verbs.kinds import Count, Flag, OneOf, Text
from stepgauge.verbs.plan import PATH, Controls, TextFile, plan
from stepgauge.verbs.shared import DIALECT, GaugeLike, MachineLike, OutputFolder, Search

if TYPE_CHECKING:
    from stepgauge.standards.iso10360_planned import SevenPositions

OTHERS = tuple(name for name in PATH if name != "cycles")


def write(
    planned: "SevenPositions",
    output: OutputFolder,
    *,
    dialect: Annotated[str, DIALECT],
    template: TextFile = None,
    tool: Annotated[str, Text("NAME")] = "",
    settings: Controls = None,
) -> Written:
    """Placements, programs, and machine files with the stylus as planned.

    Parameters
    ----------
    output : folder for placements, programs, machine files with the stylus as planned, and plan.json (made if missing)
    dialect : language of the controller
    template : your own Jinja template instead of the shipped one of the dialect
    tool : what the controller calls the probe (dmis, ippdme); default: PROBE in DMIS, StepGaugeProbe in I++ DME
    settings : how the control is set up where it differs from the usual ('stepgauge list dialects NAME')
    """
    notes = planned.write(output, dialect, template=template, tool=tool, settings=dict(settings or {}))
    return Written([output], notes)


@verb(write)
def plan_iso10360(
    gauge: GaugeLike,
    machine: MachineLike,
    *,
    cycles: Annotated[int, Count(1, 1000)] = 3,
    stylus: Annotated[str, OneOf("auto", "machine", "square")] = "auto",
    allow_short: Annotated[bool, Flag()] = False,
    search_mm: Search = 2.0,
    **path: Annotated[Any, Of(plan, *OTHERS)],
) -> "SevenPositions":
    """Plan the seven positions of ISO 10360-2 in the machine's travel.

    The four body diagonals and three positions along the axes, each as a placement, a checked program, and a machine
    file with the stylus as planned. Locate the gauge as it really lies, and plan it again with the blocks that are
    said: a program moves to where its placement says.

    Parameters
    ----------
    cycles : repetitions of every face
    stylus : direction of the stylus: as in the machine file, square to the gauge (an indexing head turns it), or as in
        the machine file where that is clear of the gauge and else square
    allow_short : write what can be measured even where the gauge does not fit or is too short
    search_mm : search beyond the nominal contact
    path : further parameters of :func:`plan`

    Returns
    -------
    The positions with placement, blocks, program and stylus, and what does not fit.

    Raises
    ------
    InputError
        a gauge that does not fit, or is shorter than the standard asks, unless ``allow_short``

    Examples
    --------
    stepgauge test plan -g step-gauge-1020 -m bridge-cmm -d dmis -o seven-positions
    """
    from stepgauge.planning.plan import PlanOptions
    from stepgauge.planning.program import ProbingChoice, make_settings
    from stepgauge.standards.iso10360_planned import SevenPositions, plan_positions
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine
    from stepgauge.verbs.plan import SIDES

    steps, cmm = resolve_gauge(gauge), resolve_machine(machine)
    distances = [path.pop(name, None) for name in ("standoff_mm", "measuring_speed_mm_s", "travel_speed_mm_s")]
    choice = ProbingChoice(distances[0], search_mm, distances[1], distances[2])
    settings = make_settings(steps, cmm, cmm.probe.tip_radius_mm, choice)
    around = SIDES[path.pop("around", "+s")]
    options = PlanOptions(1, steps.n_blocks, cycles=cycles, around=around, **path)
    found = SevenPositions(tuple(plan_positions(steps, cmm, options, settings, stylus)), cmm)  # type: ignore[arg-type]
    found.check(allow_short)
    return found

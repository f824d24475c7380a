"""``plan``: placement and gauge to a checked measuring path."""

from __future__ import annotations

from collections.abc import Sequence

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.sixteen import read_sixteen
from stepgauge.machine.file import Machine
from stepgauge.planning.plan import ORDERS, ROUTES, PlanOptions, parse_blocks, parse_position
from stepgauge.planning.planned import Plan
from stepgauge.planning.program import (
    ProbingChoice,
    agreed_tip_radius_mm,
    checked_program,
    make_settings,
    read_or_locate,
)
from stepgauge.verbs.inputs import Blocks, File, as_block_list, as_gauge, as_machine, as_placement, at_least, one_of

SIDES = {"+s": 1, "-s": -1}
MOST_CYCLES = 1000


def plan(
    placement: File | Placement,
    gauge: File | Gauge,
    machine: File | Machine | None = None,
    *,
    cycles: int = 5,
    first_again: bool = False,
    blocks: Blocks = None,
    route: str = "side",
    around: str = "+s",
    order: str = "blocks",
    clearance_mm: float = 5.0,
    margin_mm: float = 0.5,
    height_mm: float = 0.0,
    home_mm: Sequence[float] | None = None,
    standoff_mm: float | None = None,
    search_mm: float = 2.0,
    measuring_speed_mm_s: float | None = None,
    travel_speed_mm_s: float | None = None,
    tip_radius_mm: float | None = None,
    points_on: str | None = None,
    teach: bool = False,
) -> Plan:
    """Plan the measurement of the step gauge, and check the whole path for collisions and travel.

    Parameters
    ----------
    placement : how the gauge lies, its file, or the file of the 16 points
    gauge : the certified gauge, its file or shipped name
    machine : travel limits, stylus and speeds; without it the travel is not checked
    cycles : repetitions of every face, 1 to 1000
    blocks : first and last block, ``"1:21"`` or ``(1, 21)``, or a list ``"1,2,13"``; default: all
    route, around : from face to face around the ``"side"`` (right ``"+s"``, left ``"-s"``) or ``"over"`` the top
    order : ``"blocks"``, ``"fronts-backs"`` or ``"up-down"``
    first_again : touch the first face of every cycle again at its end, so that a drift shows within it
    clearance_mm : gap between ball and blocks on the way
    margin_mm : smallest gap that the check accepts
    height_mm : probing point above the middle of the faces
    home_mm : where the program starts and ends, machine x, y, z; default: above the gauge
    standoff_mm : gap between ball and face before a search; default: the middle of the gap between blocks
    search_mm : search beyond the nominal contact
    measuring_speed_mm_s, travel_speed_mm_s : within the machine's limits; default: the machine's, or 3 and 50
    tip_radius_mm : nominal; default: of the machine or the placement
    points_on : blocks that the 16 points were probed on, ``"A:B"``; default: the first and the last
    teach : ``placement`` is a file of 16 rough positions; plan the touching of the 16 points there, whose log
        ``locate`` reads

    Returns
    -------
    The plan, which writes itself as a program for any controller.

    Raises
    ------
    InputError
        the move that would collide, miss its face, or leave the travel
    """
    _check(cycles, clearance_mm, margin_mm, standoff_mm, search_mm, tip_radius_mm)
    steps = as_gauge(gauge)
    cmm = None if machine is None else as_machine(machine)
    choice = ProbingChoice(standoff_mm, search_mm, measuring_speed_mm_s, travel_speed_mm_s)
    if teach:
        return _teach(placement, steps, cmm, choice, tip_radius_mm, points_on, margin_mm)
    if isinstance(placement, File):
        lies, where = read_or_locate(placement, steps, cmm, tip_radius_mm, points_on), placement
    else:
        lies, where = as_placement(placement, steps), "placement"
    radius = agreed_tip_radius_mm(lies, cmm, tip_radius_mm, where)
    settings = make_settings(steps, cmm, radius, choice)
    (first, last), only = as_block_list(blocks, steps)
    options = PlanOptions(
        first,
        last,
        route=one_of("route", route, ROUTES),
        order=one_of("order", order, ORDERS),
        cycles=cycles,
        clearance_mm=clearance_mm,
        margin_mm=margin_mm,
        height_mm=height_mm,
        around=SIDES[one_of("around", around, SIDES)],
        home_mm=_home(home_mm),
        only_blocks=only,
        first_again=first_again,
    )
    return Plan(checked_program(lies, steps, cmm, options, settings), cmm is not None)


def _teach(
    points: File | Placement,
    gauge: Gauge,
    machine: Machine | None,
    choice: ProbingChoice,
    tip_radius_mm: float | None,
    points_on: str | None,
    margin_mm: float,
) -> Plan:
    """The plan of the 16 points, from rough positions."""
    from stepgauge.planning.teach import teach_program

    if not isinstance(points, File):
        raise InputError(naming("teach"), "a placement is known already", expected="a file of 16 rough positions")
    radius = tip_radius_mm or (machine.probe.tip_radius_mm if machine else None)
    if radius is None:
        raise InputError(
            points, "the tip radius is not known", expected=naming("tip_radius_mm", "machine", words="{} or {}")
        )
    settings = make_settings(gauge, machine, radius, choice)
    blocks = parse_blocks(points_on or ":", gauge)
    program, _ = teach_program(read_sixteen(points), gauge, blocks, machine, settings, margin_mm)
    return Plan(program, machine is not None)


def _check(
    cycles: int,
    clearance_mm: float,
    margin_mm: float,
    standoff_mm: float | None,
    search_mm: float,
    tip_radius_mm: float | None,
) -> None:
    if not (isinstance(cycles, int) and 1 <= cycles <= MOST_CYCLES):
        raise InputError(
            naming("cycles"), "out of range", found=cycles, expected=f"a whole number from 1 to {MOST_CYCLES}"
        )
    at_least("clearance_mm", clearance_mm, 0.0, "mm", beyond=True)
    at_least("margin_mm", margin_mm, 0.0, "mm")
    at_least("standoff_mm", standoff_mm, 0.0, "mm", beyond=True)
    at_least("search_mm", search_mm, 0.0, "mm", beyond=True)
    at_least("tip_radius_mm", tip_radius_mm, 0.0, "mm", beyond=True)


def _home(home_mm: Sequence[float] | None) -> tuple[float, float, float] | None:
    """The position as the command line would take it."""
    if home_mm is None:
        return None
    try:
        x, y, z = (float(value) for value in home_mm)
    except (TypeError, ValueError):
        raise InputError(naming("home_mm"), "not a position", found=home_mm, expected="x, y, z in mm") from None
    return parse_position(f"{x!r},{y!r},{z!r}")

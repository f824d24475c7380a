"""The options of a path along the gauge, and what they ask for in the words of the functions that plan one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from stepgauge.cli.options import NOT_NEGATIVE, POSITIVE, FiniteRange

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.planning.plan import PlanOptions
    from stepgauge.planning.program import ProbingChoice

CYCLES, CYCLES_ISO10360 = 5, 3
PATH = (
    click.option(
        "--route",
        type=click.Choice(["side", "over"]),
        default="side",
        show_default=True,
        help="From face to face around the side of the blocks (horizontal path) or over their top (vertical path).",
    ),
    click.option(
        "--around",
        type=click.Choice(["+s", "-s"]),
        default="+s",
        show_default=True,
        help="Side that the route 'side' takes: right (+s) or left (-s), looking along the gauge.",
    ),
    click.option(
        "--order",
        type=click.Choice(["blocks", "fronts-backs", "up-down"]),
        default="blocks",
        show_default=True,
        help="Front and back block by block; all fronts then all backs; or cycles up and down the gauge in turn.",
    ),
    click.option("--cycles", type=click.IntRange(1, 1000), help="Repetitions of every face. [default: 5]"),
    click.option(
        "--first-again",
        is_flag=True,
        help="Touch the first face again at the end of every cycle, to show a drift; up-down comes back by itself.",
    ),
    click.option("--blocks", metavar="A:B|A,B,...", help="First and last block to measure, or a list. Default: all."),
    click.option(
        "--standoff",
        type=POSITIVE,
        metavar="MM",
        help="Gap between ball and face before measuring, mm. Default: the middle of the gap between blocks.",
    ),
    click.option(
        "--clearance",
        type=POSITIVE,
        default=5.0,
        show_default=True,
        metavar="MM",
        help="Gap between ball and blocks on the way, mm.",
    ),
    click.option(
        "--margin",
        type=NOT_NEGATIVE,
        default=0.5,
        show_default=True,
        metavar="MM",
        help="Smallest gap that the check accepts, mm.",
    ),
    click.option(
        "--height",
        type=FiniteRange(),
        default=0.0,
        show_default=True,
        metavar="MM",
        help="Probing point above the middle of the faces, mm.",
    ),
    click.option(
        "--home", metavar="X,Y,Z", help="Where the program starts and ends, machine mm. Default: above the gauge."
    ),
    click.option(
        "--measuring-speed",
        type=POSITIVE,
        metavar="MM/S",
        help="Speed of the searches, mm/s, within the machine's limits. Default: the machine's, or 3.",
    ),
    click.option(
        "--travel-speed",
        type=POSITIVE,
        metavar="MM/S",
        help="Speed on the way, mm/s, within the machine's limits. Default: the machine's, or 50.",
    ),
)
"""Options of the path along the gauge, of verbs that plan one."""
KEYWORDS = {
    "blocks": "blocks",
    "route": "route",
    "around": "around",
    "order": "order",
    "first_again": "first_again",
    "clearance": "clearance_mm",
    "margin": "margin_mm",
    "height": "height_mm",
    "standoff": "standoff_mm",
    "search": "search_mm",
    "measuring_speed": "measuring_speed_mm_s",
    "travel_speed": "travel_speed_mm_s",
    "tip_radius": "tip_radius_mm",
    "points_on": "points_on",
    "teach": "teach",
}
"""Options, and what :func:`stepgauge.plan` calls them."""


def path_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """The verb with the options of :data:`PATH`."""
    for option in reversed(PATH):
        function = option(function)
    return function


def typed_path_options() -> list[str]:
    """Those options of :data:`PATH` that stand on the command line of the verb that runs."""
    ctx = click.get_current_context()
    own = {one.name for one in path_options(lambda: None).__click_params__}  # type: ignore[attr-defined]
    typed = [
        one for one in ctx.command.params if ctx.get_parameter_source(one.name or "") == ParameterSource.COMMANDLINE
    ]
    return [one.opts[0] for one in typed if one.name in own]


def plan_keywords(options: dict[str, Any]) -> dict[str, Any]:
    """The keywords of :func:`stepgauge.plan` that the options ask for."""
    from stepgauge.planning.plan import parse_position

    home = parse_position(options["home"]) if options["home"] else None
    said = {keyword: options[name] for name, keyword in KEYWORDS.items() if name in options}
    return {**said, "cycles": options["cycles"] or CYCLES, "home_mm": home}


def stated_controls(options: dict[str, Any]) -> dict[str, str]:
    """``--set`` as names and values; :class:`click.UsageError` for what is no NAME=VALUE."""
    pairs = [text.partition("=") for text in options["controls"]]
    for name, equals, value in pairs:
        if not (name.strip() and equals):
            raise click.UsageError(f"--set takes NAME=VALUE, not {name + equals + value!r}")
    return {name.strip(): value for name, _, value in pairs}


def plan_options(options: dict[str, Any], gauge: Gauge) -> PlanOptions:
    """The path of each of the seven positions, whose blocks follow from the gauge."""
    from stepgauge.planning.plan import PlanOptions

    return PlanOptions(
        1,
        gauge.n_blocks,
        route=options["route"],
        order=options["order"],
        cycles=options["cycles"] or CYCLES_ISO10360,
        clearance_mm=options["clearance"],
        margin_mm=options["margin"],
        height_mm=options["height"],
        around=1 if options["around"] == "+s" else -1,
        first_again=options["first_again"],
    )


def probing_choice(options: dict[str, Any]) -> ProbingChoice:
    """The distances and speeds that the options state."""
    from stepgauge.planning.program import ProbingChoice

    return ProbingChoice(options["standoff"], options["search"], options["measuring_speed"], options["travel_speed"])

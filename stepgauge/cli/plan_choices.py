"""What the options of ``stepgauge plan`` ask for, as the path's and the probings' own terms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.planning.plan import PlanOptions
    from stepgauge.planning.program import ProbingChoice


def plan_options(options: dict[str, Any], gauge: Gauge) -> PlanOptions:
    """The path that the options ask for."""
    from stepgauge.planning.plan import PlanOptions, parse_block_list, parse_blocks, parse_position

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


def probing_choice(options: dict[str, Any]) -> ProbingChoice:
    """The distances and speeds that the options state."""
    from stepgauge.planning.program import ProbingChoice

    return ProbingChoice(options["standoff"], options["search"], options["measuring_speed"], options["travel_speed"])

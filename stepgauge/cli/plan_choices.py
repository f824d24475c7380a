"""What the options of ``stepgauge plan`` ask for, in the words of the function, and of the seven positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.planning.plan import PlanOptions
    from stepgauge.planning.program import ProbingChoice

CYCLES, CYCLES_ISO10360 = 5, 3
KEYWORDS = {
    "blocks": "blocks",
    "route": "route",
    "around": "around",
    "order": "order",
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


def plan_keywords(options: dict[str, Any]) -> dict[str, Any]:
    """The keywords of :func:`stepgauge.plan` that the options ask for."""
    from stepgauge.planning.plan import parse_position

    home = parse_position(options["home"]) if options["home"] else None
    said = {keyword: options[name] for name, keyword in KEYWORDS.items()}
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
    )


def probing_choice(options: dict[str, Any]) -> ProbingChoice:
    """The distances and speeds that the options state."""
    from stepgauge.planning.program import ProbingChoice

    return ProbingChoice(options["standoff"], options["search"], options["measuring_speed"], options["travel_speed"])

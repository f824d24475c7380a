"""``stepgauge fleet watch``: what changes, what drifts, what leaves its peers or its limits, and what is due."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, engine_options, say_errors, working
from stepgauge.cli.options import SUFFIX, FiniteRange, limits_option, output, say_written, show

# Written out so that --help needs no numpy; a test compares it with what is watched.
LIMITS = ("scale", "squareness", "reversal", "certificate_scale", "wear")


@click.command("watch")
@STORE
@output("Folder for watch.json, watch.csv and the figure (made if missing).")
@limits_option(LIMITS, f"Maximum permissible size; repeatable. Names: {', '.join(LIMITS)} (um/m, urad, um).")
@click.option(
    "--risk",
    type=FiniteRange(0.0, 0.5, min_open=True),
    default=0.05,
    show_default=True,
    help="Probability of being out of limits that is accepted until the next calibration.",
)
@SUFFIX
@engine_options
def command(store: str, output: str, limits: dict[str, float], risk: float, suffix: str, **options: Any) -> None:
    """Machines and gauges against their own history, their peers and their limits.

    Every visit counts for a machine without the shares of gauge, hall and probe, as 'fleet infer' finds them, so that a
    worn gauge moves no machine. Stated are level, rate and dated changes with U; who leaves the machines of its line
    (at most 5 % of those named are expected to be wrong); with a limit the decision by ISO 14253-1, and the day on
    which the risk of being out of limits is no longer accepted. watch.json is for other programs; its schema is written
    beside it.

    \b
    stepgauge fleet watch fleet --limit scale=5 --limit reversal=2 -o watch
    """
    from stepgauge.public.fleet import watch_fleet

    with working("reading", options) as by:
        found = watch_fleet(store, limits=limits, risk=risk, **by)
    show(found.summary())
    say_written(*found.write(output, suffix))
    say_errors(store, found.left_out, "used")

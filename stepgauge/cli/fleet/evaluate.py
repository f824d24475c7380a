"""``stepgauge fleet evaluate``: the evaluations that a store does not have yet."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, engine_options, say_errors, working
from stepgauge.cli.options import BLOCKS, R_EFF, say


@click.command("evaluate")
@STORE
@BLOCKS
@R_EFF
@engine_options
def command(store: str, blocks: str | None, r_eff_origin: str, **options: Any) -> None:
    """Evaluate the recordings of a store that have no evaluation with these options.

    The numbers are those of 'stepgauge evaluate' of each recording, whatever does the work. They are in the view
    evaluations of 'fleet query', and 'stepgauge history STORE' reads them. With other options than before all are
    evaluated anew. What is done stays done where this is stopped.

    \b
    stepgauge fleet evaluate fleet --jobs 2
    stepgauge fleet evaluate fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.public.fleet import evaluate_fleet

    with working("evaluating", options) as by:
        errors = evaluate_fleet(store, blocks=blocks, r_eff_origin=r_eff_origin, **by)
    say(f"evaluated: {store}")
    say_errors(store, errors, "evaluated")

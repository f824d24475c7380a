"""``stepgauge fleet budget``: the uncertainty budgets that a store does not have yet."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.budget import choice_options, chosen
from stepgauge.cli.fleet.options import STORE, engine_options, say_errors, working
from stepgauge.cli.options import say


@click.command("budget")
@STORE
@choice_options
@engine_options
def command(store: str, **options: Any) -> None:
    """Uncertainty budgets of the recordings of a store that have none with these options, with the Monte Carlo beside.

    Needs a machine file with each recording ('fleet add --machine'); placements that were added give the alignment. The
    numbers are those of 'stepgauge budget' of each recording, whatever does the work. They are in the view budgets of
    'fleet query', a row for each quantity. Each budget is on the disk as it is made: the same command goes on where
    this was stopped or killed.

    \b
    stepgauge fleet budget fleet --jobs 2
    stepgauge fleet query fleet "SELECT machine, max(expanded_um) FROM budgets WHERE quantity = 'xm' GROUP BY machine"
    """
    from stepgauge.public.fleet import budget_fleet

    with working("budgets", options) as by:
        errors = budget_fleet(store, **chosen(options), **by)
    say(f"budgets made: {store}")
    say_errors(store, errors, "budgeted")

"""``stepgauge fleet diagnose``: the diagnoses that a store does not have yet."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, engine_options, say_errors, working
from stepgauge.cli.options import say


@click.command("diagnose")
@STORE
@click.option(
    "--without",
    multiple=True,
    metavar="KIND",
    help="Kind of effect (see 'stepgauge effects') that is known not to be there, e.g. vibration; once per kind.",
)
@click.option("--priors", metavar="FILE", help="Priors in place of the shipped ones (TOML); what it leaves out stays.")
@engine_options
def command(store: str, without: tuple[str, ...], priors: str | None, **options: Any) -> None:
    """Diagnose the recordings of a store that have no diagnosis with these options, each by itself.

    Needs a machine file with each recording ('fleet add --machine'). The diagnoses are those of 'stepgauge diagnose'
    of each recording, in the view diagnoses of 'fleet query'. Each is on the disk as it is made: the same command goes
    on where this was stopped or killed.

    \b
    stepgauge fleet diagnose fleet --jobs 2
    stepgauge fleet diagnose fleet --scheduler /tmp/stepgauge-k3x9/cluster.json
    """
    from stepgauge.public.fleet import diagnose_fleet

    with working("diagnosing", options) as by:
        errors = diagnose_fleet(store, without=without, priors=priors, **by)
    say(f"diagnosed: {store}")
    say_errors(store, errors, "diagnosed")

"""``stepgauge fleet infer``: whose fault it is, from all recordings together."""

from __future__ import annotations

from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, engine_options, say_errors, working
from stepgauge.cli.options import say_written, show


@click.command("infer")
@STORE
@click.option(
    "-o",
    "--output",
    default="fleet.json",
    show_default=True,
    metavar="PATH",
    help="JSON file of the causes, the report beside it as Markdown; or NAME.html or NAME.pdf: the report in that "
    "form, the JSON file beside it.",
)
@engine_options
def command(store: str, output: str, **options: Any) -> None:
    """Causes of errors in a fleet, with their owners: a machine, a gauge, a model line, a hall, a probe.

    What follows a gauge from machine to machine is the gauge; what stays with a machine whatever the gauge is the
    machine; what all visits to a hall share on a day is the hall. Every cause is stated with size, U, date, probability
    and the recordings that settle it; what the fleet cannot tell apart is stated as a set, with the measurement that
    would. Needs a machine file for every recording.

    \b
    stepgauge fleet infer fleet -o fleet.json
    stepgauge fleet infer fleet --jobs 2 -o fleet.html
    """
    from stepgauge.fleet.hierarchical.answer import report_places
    from stepgauge.public.fleet import infer_fleet

    report_places(output)
    with working("reading", options) as by:
        found = infer_fleet(store, **by)
    show(found.summary())
    say_written(*found.write(output))
    say_errors(store, found.left_out, "used")

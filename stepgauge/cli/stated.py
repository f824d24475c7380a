"""Options of a report that only a person can fill in, for verbs that write one with their result."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from stepgauge.report.content import Stated

NAMES = ("number", "customer", "location", "operator", "remarks")


def stated_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of :data:`NAMES`, ``--date`` and ``--template``."""
    for option in reversed(
        (
            click.option("--number", metavar="TEXT", help="Number of the report."),
            click.option("--operator", metavar="TEXT", help="Who measured; printed at the place for the signature."),
            click.option("--customer", metavar="TEXT", help="For whom the report is made."),
            click.option("--location", metavar="TEXT", help="Where the machine stands."),
            click.option(
                "--date",
                type=click.DateTime(["%Y-%m-%d"]),
                metavar="YYYY-MM-DD",
                help="Date of the report. [default: today]",
            ),
            click.option("--remarks", metavar="TEXT", help="Anything else to print."),
            click.option(
                "--template", metavar="FILE", help="Your own Typst template; start from a copy of standard.typ."
            ),
        )
    ):
        function = option(function)
    return function


def stated_from(options: dict[str, Any]) -> Stated:
    """What the person said."""
    from stepgauge.report.content import Stated

    day = options["date"].date() if options["date"] else datetime.date.today()
    return Stated(day, **{name: options[name] for name in NAMES})

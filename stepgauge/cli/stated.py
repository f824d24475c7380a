"""Options of a report that only a person can fill in, for verbs that write one with their result."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import Decorator

if TYPE_CHECKING:
    from stepgauge.reports.page import Stated

NAMES = ("number", "customer", "location", "operator", "remarks")


class Day(click.ParamType):
    """A date as ISO 8601 writes it."""

    name = "date"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> datetime.date:
        try:
            day = value if isinstance(value, datetime.date) else datetime.date.fromisoformat(value)
        except ValueError:
            self.fail(f"{value} is no date; expected year-month-day, e.g. 2026-03-02", param, ctx)
        if day > datetime.date.today():
            self.fail(f"{day} lies in the future; expected today or a day before", param, ctx)
        return day


def stated_options(template: str = "Your own Typst template; start from a copy of report.typ.") -> Decorator:
    """Add the options of :data:`NAMES`, ``--date`` and ``--template`` (explained by ``template``)."""
    options = (
        click.option("--number", metavar="TEXT", help="Number of the report."),
        click.option("--operator", metavar="TEXT", help="Who measured; printed at the place for the signature."),
        click.option("--customer", metavar="TEXT", help="For whom the report is made."),
        click.option("--location", metavar="TEXT", help="Where the machine stands."),
        click.option("--date", type=Day(), metavar="YYYY-MM-DD", help="Date of the report. Default: today."),
        click.option("--remarks", metavar="TEXT", help="Anything else to print."),
        click.option("--template", metavar="FILE", help=template),
    )

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            function = option(function)
        return function

    return add


def stated_from(options: dict[str, Any]) -> Stated:
    """What the person said."""
    from stepgauge.reports.page import Stated

    day = options["date"] or datetime.date.today()
    return Stated(day, **{name: options[name] for name in NAMES})

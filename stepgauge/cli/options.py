"""Options and arguments that several verbs share."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class FiniteRange(click.FloatRange):
    """A number within bounds; NaN and infinities, which slip through every comparison, are refused."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if number is not None and not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


def check_figure(_: click.Context, param: click.Parameter, value: Any) -> Any:
    """Callback of options that name a figure: its format must be known before any work is done."""
    if value is not None and not str(value).lower().endswith((".png", ".svg", ".pdf")):
        raise click.BadParameter(
            f"{value} is no figure", param=param, param_hint=f"{param.opts[0]} (.png, .svg or .pdf)"
        )
    return value


TEMPERATURE_C = FiniteRange(-10.0, 60.0)
"""What a recording may say of a gauge, deg C."""
GAUGE = click.option(
    "--gauge", "-g", required=True, metavar="GAUGE", help="Gauge file (TOML), or the name of a shipped one."
)


def machine_option(required: bool, text: str) -> Decorator:
    """``--machine``, with what the verb needs it for."""
    return click.option("--machine", "-m", required=required, metavar="MACHINE", help=text)


def output(text: str) -> Decorator:
    """``-o``."""
    return click.option("-o", "--output", required=True, metavar="PATH", help=text)


def say(message: str) -> None:
    """A line for the person at the screen; results go to files, words to stderr."""
    click.echo(message, err=True)

"""Options and arguments that several verbs share, so that they are spelled and explained the same everywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.say import percent as percent
from stepgauge.cli.say import say as say
from stepgauge.cli.say import say_lines as say_lines
from stepgauge.cli.say import say_written as say_written
from stepgauge.cli.say import show as show

if TYPE_CHECKING:
    from stepgauge.standards.mpe import Mpe

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class FiniteRange(click.FloatRange):
    """A number within bounds; NaN and infinities, which slip through every comparison, are refused."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if number is not None and not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()


def check_figure(_: click.Context, param: click.Parameter, value: Any) -> Any:
    """Callback of options that name a figure: its format must be known before any work is done."""
    if value is not None and not str(value).lower().endswith((".png", ".svg", ".pdf")):
        raise click.BadParameter(
            f"{value} is no figure", param=param, param_hint=f"{param.opts[0]} (.png, .svg or .pdf)"
        )
    return value


POSITIVE = FiniteRange(min=0.0, min_open=True)
NOT_NEGATIVE = FiniteRange(min=0.0)
TEMPERATURE_C = FiniteRange(-10.0, 60.0)
"""What a recording may say of a gauge, deg C."""
LARGEST_U_K = 5.0
"""Nobody knows the temperature of a gauge so badly, K; as in :mod:`stepgauge.machine.file`, which a test compares."""
U_TEMPERATURE_K = FiniteRange(0.0, LARGEST_U_K)
DIALECTS = [
    "jinyoung",
    "dmis",
    "linuxcnc",
    "ippdme",
    "fanuc",
    "haas",
    "mazak",
    "mitsubishi",
    "siemens",
    "heidenhain",
    "grbl",
    "rrf",
]
"""Written out so that --help needs no import of the readers; a test compares it with theirs."""

GAUGE_VARIABLE, MACHINE_VARIABLE = "STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"
"""Environment variables that stand for --gauge and --machine where these are left out."""
GAUGE = click.option(
    "--gauge",
    "-g",
    required=True,
    envvar=GAUGE_VARIABLE,
    metavar="GAUGE",
    help="Gauge file (TOML), or the name of a shipped one. Default: STEPGAUGE_GAUGE, else the project's.",
)
GAUGE_IF_NEEDED = click.option(
    "--gauge",
    "-g",
    envvar=GAUGE_VARIABLE,
    metavar="GAUGE",
    help="Gauge file (TOML), or the name of a shipped one; not for a recording of one axis.",
)
BLOCKS = click.option(
    "--blocks", metavar="A:B", help="First and last block of the used section. Default: what was measured."
)
R_EFF = click.option(
    "--r-eff-origin",
    "r_eff_origin",
    type=click.Choice(["first", "all"]),
    default="first",
    show_default=True,
    help="Effective radius from the first used block (its XB is then zero by construction) or from all used blocks.",
)
SUFFIX = click.option(
    "--figure",
    "suffix",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of the figures in the folder.",
)
GAUGE_TEMPERATURE = click.option(
    "--gauge-temperature",
    type=TEMPERATURE_C,
    metavar="C",
    help="Temperature of the gauge as a program is run, deg C. Default: that of the certificate.",
)
U_GAUGE_TEMPERATURE = click.option(
    "--u-gauge-temperature",
    type=U_TEMPERATURE_K,
    metavar="K",
    help="Standard uncertainty of the gauge's temperature, K. Default: gauge_temperature_K in [uncertainty] of the "
    "machine file if the temperature was recorded; else not counted.",
)
TEMPERATURE_CONVENTION = click.option(
    "--temperature-convention",
    type=click.Choice(["as_read", "corrected_to_20", "nominal_expansion"]),
    help="What the readings have been corrected for. as_read: nothing. corrected_to_20: the machine has corrected them"
    " to 20 deg C. nominal_expansion: to be corrected here, with the expansion of scales and gauge. Default: as the"
    " recording says.",
)
SEARCH = click.option(
    "--search",
    type=POSITIVE,
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the target of a program, mm, where its text does not state it.",
)


def machine_option(required: bool, text: str) -> Decorator:
    """``--machine``, with what the verb needs it for."""
    told = f"{text} Default: STEPGAUGE_MACHINE, else the project's."
    return click.option("--machine", "-m", required=required, envvar=MACHINE_VARIABLE, metavar="MACHINE", help=told)


def placement_option(text: str) -> Decorator:
    """``--placement`` of verbs that take one file per placement."""
    return click.option("--placement", "-p", "placement_files", multiple=True, metavar="P", help=text)


FURTHER_STYLUS = click.option(
    "--further-stylus",
    "styli",
    multiple=True,
    metavar="FILE",
    help="Machine file with a further stylus, otherwise the same as --machine; once per stylus.",
)

PLACEMENT_NUMBER = click.option(
    "--placement-number",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="Number of this placement, in a calibration with several.",
)
PLACEMENTS = placement_option(
    "Placement file; once per placement in the recordings, in order. Default: the axis is the mean approach."
)


def coverage_option(text: str) -> Decorator:
    """``--coverage-factor``, from standard to expanded uncertainty of what ``text`` says."""
    return click.option(
        "--coverage-factor",
        "-k",
        type=FiniteRange(1.0, 4.0),
        default=2.0,
        show_default=True,
        metavar="K",
        help=f"Factor from standard to expanded uncertainty {text}.",
    )


def tip_diameter_option(text: str, **more: Any) -> Decorator:
    """``--tip-diameter`` of a test: the effective one of the machine's qualification."""
    told = f"Effective tip diameter as the machine's qualification gave it, mm{text}"
    return click.option("--tip-diameter", type=POSITIVE, metavar="MM", help=told, **more)


def plot_option(text: str) -> Decorator:
    """``--plot`` of verbs that draw one figure if asked."""
    return click.option("--plot", callback=check_figure, metavar="FILE", help=f"{text} (png, svg or pdf).")


def limits_option(names: Sequence[str], text: str) -> Decorator:
    """``--limit NAME=NUMBER``, repeatable: positive numbers by name."""

    def parsed(_: click.Context, param: click.Parameter, given: Sequence[str]) -> dict[str, float]:
        """Positive numbers by name; a usage error for any other name or number."""
        limits = {}
        for one in given:
            name, _sign, number = one.partition("=")
            try:
                value = float(number)
            except ValueError:
                value = math.nan
            if name.strip() not in names or not (math.isfinite(value) and value > 0):
                expected = f"NAME=NUMBER with NAME one of {', '.join(names)} and a positive number"
                raise click.BadParameter(f"found {one!r}, expected {expected}", param=param, param_hint="--limit")
            limits[name.strip()] = value
        return limits

    return click.option("--limit", "limits", multiple=True, callback=parsed, metavar="NAME=NUMBER", help=text)


def mpe_options(required: bool, text: str) -> Decorator:
    """``--mpe`` and ``--mpe-cap``; the command calls :func:`mpe_from` with them."""

    def both(function: Callable[..., Any]) -> Callable[..., Any]:
        cap = click.option("--mpe-cap", type=POSITIVE, metavar="UM", help="The limit is never above this, um.")
        mpe = click.option("--mpe", required=required, metavar="LIMIT", help=f'{text}, "A + L/K": um, with L in mm.')
        return mpe(cap(function))

    return both


def mpe_from(options: dict[str, Any]) -> Mpe | None:
    """The limit that the options of :func:`mpe_options` state; None without."""
    from stepgauge.standards.mpe import Mpe

    if options["mpe"] is None and options["mpe_cap"] is not None:
        raise click.UsageError("--mpe-cap is the cap of --mpe, which is missing.")
    return None if options["mpe"] is None else Mpe.parse(options["mpe"], options["mpe_cap"])


def output(text: str) -> Decorator:
    """``-o``."""
    return click.option("-o", "--output", required=True, metavar="PATH", callback=_check_named, help=text)


def _check_named(_: click.Context, param: click.Parameter, value: str) -> str:
    """A variable of a script that was never set leaves an empty name, which would mean the working folder."""
    if not value.strip():
        raise click.BadParameter("the name is empty", param=param)
    return value


def is_from_project(name: str) -> bool:
    """Whether the value of an option (by its Python name) is that of the project file: nobody gave it to this verb."""
    from click.core import ParameterSource

    return click.get_current_context().get_parameter_source(name) == ParameterSource.DEFAULT_MAP


def is_typed(name: str) -> bool:
    """Whether an option stands on the command line: a project file is for all verbs, and says nothing of an axis."""
    from click.core import ParameterSource

    return click.get_current_context().get_parameter_source(name) == ParameterSource.COMMANDLINE


def leaves(names_of: Callable[[dict[str, Any]], Sequence[str]]) -> Decorator:
    """Options that a verb leaves alone, by their Python names, given the values of all: they are told of no project.

    ``names_of`` is looked up by :mod:`stepgauge.cli.defaults`; stand nearest to the function of the verb.
    """

    def mark(callback: Callable[..., Any]) -> Callable[..., Any]:
        callback.__dict__["leaves"] = names_of
        return callback

    return mark

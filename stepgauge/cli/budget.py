"""``stepgauge budget``: the uncertainty budget of what an evaluation reports, beside the Monte Carlo."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import Any

import click

from stepgauge.cli.options import (
    BLOCKS,
    GAUGE,
    GAUGE_TEMPERATURE,
    R_EFF,
    SEARCH,
    SUFFIX,
    TEMPERATURE_CONVENTION,
    U_GAUGE_TEMPERATURE,
    Decorator,
    FiniteRange,
    machine_option,
    output,
    percent,
    placement_option,
    say_lines,
    say_written,
)


def choice_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """What is chosen for a budget beside the files; :func:`chosen` makes keywords of a public function of it."""
    options: tuple[Decorator, ...] = (
        BLOCKS,
        R_EFF,
        U_GAUGE_TEMPERATURE,
        click.option(
            "--certificate-correlation",
            type=FiniteRange(0.0, 1.0),
            metavar="R",
            help="Correlation coefficient of any two certified positions, 0 to 1. Default: the gauge file's, or 0.",
        ),
        click.option(
            "--repeats",
            type=click.Choice(["pooled", "face"]),
            default="pooled",
            show_default=True,
            help="Repeatability: one standard deviation for all faces, or one by face with n - 1 degrees of freedom.",
        ),
        click.option(
            "--coverage",
            type=FiniteRange(50.0, 99.99),
            default=95.45,
            show_default=True,
            metavar="PERCENT",
            help="Coverage probability, %; 95.45 is k = 2 for many degrees of freedom.",
        ),
        click.option(
            "--runs",
            type=click.IntRange(0),
            default=10_000,
            show_default=True,
            help="Monte Carlo runs beside it; 0: none.",
        ),
        click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the Monte Carlo."),
        click.option(
            "--measurand",
            type=click.Choice(["as-is", "at-20"]),
            default="as-is",
            show_default=True,
            help="What is measured: the machine as it is, or at 20 deg C, with the temperature of its scales in U.",
        ),
        click.option(
            "--contribution",
            "contributions",
            multiple=True,
            metavar="NAME=VALUE",
            help="A contribution of your own, repeatable, in um or with a sensitivity: 'form=0.2, distribution=uniform,"
            " dof=8'. Further keys: sensitivity, sensitivity_per_m. Or [[contribution]] in the machine file.",
        ),
        TEMPERATURE_CONVENTION,
        click.option("--correct-drift", is_flag=True, help="Take off a drift with time that the repeats show."),
        click.option(
            "--measured-at", metavar="DATE", help="ISO date, where no recording says it: the age of the calibration."
        ),
    )
    for option in reversed(options):
        function = option(function)
    return function


def chosen(options: dict[str, Any]) -> dict[str, Any]:
    """The keywords, by the options of :func:`choice_options`."""
    same: tuple[str, ...] = ("blocks", "certificate_correlation", "repeats", "runs", "seed", "measurand", "measured_at")
    same += ("temperature_convention", "correct_drift")
    return {
        **{name: options[name] for name in same},
        "r_eff_origin": options["r_eff_origin"],
        "u_gauge_temperature_K": options["u_gauge_temperature"],
        "coverage_percent": options["coverage"],
        "contributions": list(options["contributions"]),
    }


@click.command("budget")
@click.argument("sources", nargs=-1, required=True, metavar="PROGRAM|RECORDING...")
@machine_option(True, "Machine file (TOML) with its [uncertainty] table and uncertain values, or a shipped name.")
@GAUGE
@placement_option(
    "Placement file: its [uncertainty] gives the alignment; once per placement, in order. Needed with a program."
)
@output("Folder for budget.json, budget.csv and the figures (made if missing), e.g. that of the evaluation.")
@choice_options
@GAUGE_TEMPERATURE
@SEARCH
@SUFFIX
def command(sources: tuple[str, ...], machine: str, gauge: str, output: str, **options: Any) -> None:
    """Uncertainty budget (GUM) of R_eff, XF, XB, XM and XR at every face, with the Monte Carlo beside it.

    Counted are the gauge's certificate with its correlation and its drift since, temperature and expansion of the gauge
    (of the scales with --measurand at-20), probing, resolution, alignment, repeatability, contributions of your own and
    every uncertain value of the machine file; R_eff enters XB through
    its own readings. What no file states is not assumed: it is listed as not evaluated, with the key that would state
    it. In the machine file:

    \b
    [uncertainty]
    gauge_temperature_K = 0.05                # standard uncertainty, K; or { u = 0.05, dof = 8 }
    probing_um = 0.2                          # of a face, the same in every cycle, um
    resolution_um = 0.1                       # smallest step of the reading, um
    [machine]
    temperature_C = { value = 20.2, u = 0.1 } # of the scales

    In the gauge file: correlation and degrees_of_freedom of [certificate]. In the placement: [uncertainty] of locate.

    \b
    stepgauge evaluate recording.csv -g step-gauge-420 -o result
    stepgauge budget recording.csv -g step-gauge-420 -m machine.toml -p placement.toml -o result
    """
    from stepgauge.files.text import check_folder
    from stepgauge.public.budget import budget

    check_folder(output)
    with ExitStack() as bars:
        found = budget(
            list(sources),
            gauge,
            machine,
            placements=list(options["placement_files"]),
            **chosen(options),
            gauge_temperature_C=options["gauge_temperature"],
            search_mm=options["search"],
            progress=partial(_next_bar, bars),
        )
    written = found.write(output, options["suffix"])
    say_lines(found.summary())
    say_written(*written)


def _next_bar(bars: ExitStack, label: str) -> Callable[[int, int], None]:
    """The bar of what begins now; that of what went before is finished."""
    bars.close()
    return percent(bars.enter_context(click.progressbar(length=100, label=label, file=sys.stderr)))

"""``stepgauge budget``: the uncertainty budget of what an evaluation reports, beside the Monte Carlo."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    BLOCKS,
    GAUGE,
    GAUGE_TEMPERATURE,
    R_EFF,
    SEARCH,
    SUFFIX,
    U_GAUGE_TEMPERATURE,
    FiniteRange,
    machine_option,
    output,
    percent,
    placement_option,
    say,
    say_written,
)

if TYPE_CHECKING:
    from stepgauge.montecarlo import Model
    from stepgauge.standards.budget_files import StoredLine


@click.command("budget")
@click.argument("sources", nargs=-1, required=True, metavar="PROGRAM|RECORDING...")
@machine_option(True, "Machine file (TOML) with its [uncertainty] table and uncertain values, or a shipped name.")
@GAUGE
@placement_option(
    "Placement file: its [uncertainty] gives the alignment; once per placement, in order. Needed with a program."
)
@output("Folder for budget.json, budget.csv and the figures (made if missing), e.g. that of the evaluation.")
@BLOCKS
@R_EFF
@U_GAUGE_TEMPERATURE
@click.option(
    "--certificate-correlation",
    type=FiniteRange(0.0, 1.0),
    metavar="R",
    help="Correlation coefficient of any two certified positions, 0 to 1. Default: the gauge file's, or 0.",
)
@click.option(
    "--repeats",
    type=click.Choice(["pooled", "face"]),
    default="pooled",
    show_default=True,
    help="Repeatability: one standard deviation for all faces, or one by face with n - 1 degrees of freedom.",
)
@click.option(
    "--coverage",
    type=FiniteRange(50.0, 99.99),
    default=95.45,
    show_default=True,
    metavar="PERCENT",
    help="Coverage probability, %; 95.45 is k = 2 for many degrees of freedom.",
)
@click.option(
    "--runs",
    type=click.IntRange(0),
    default=10_000,
    show_default=True,
    help="Monte Carlo runs beside it; 0: none.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the Monte Carlo.")
@GAUGE_TEMPERATURE
@SEARCH
@SUFFIX
def command(sources: tuple[str, ...], machine: str, gauge: str, output: str, **options: Any) -> None:
    """Uncertainty budget (GUM) of R_eff, XF, XB, XM and XR at every face, with the Monte Carlo beside it.

    Counted are the gauge's certificate with its correlation, the temperatures and expansions of gauge and scales,
    probing, resolution, alignment, repeatability and every uncertain value of the machine file; R_eff enters XB through
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
    from stepgauge.figures.budget import draw_budget, farthest, label
    from stepgauge.files.text import check_folder
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.machine.file import read_machine
    from stepgauge.montecarlo import ModelOptions, read_model
    from stepgauge.standards.budget import Asked, make_budget
    from stepgauge.standards.budget_files import read_budget, write_budget

    check_folder(output)
    steps, cmm = read_gauge(gauge), read_machine(machine)
    if options["certificate_correlation"] is not None:
        stated = {"correlation": options["certificate_correlation"]}
        steps = replace(steps, certificate=steps.certificate.model_copy(update=stated))
    placements = read_placements(options["placement_files"], steps)
    choice = ModelOptions(
        options["u_gauge_temperature"],
        options["origin"],
        options["blocks"],
        options["gauge_temperature"],
        options["search"],
    )
    model = read_model(sources, cmm, steps, placements, choice)
    asked = Asked(placements, options["repeats"], options["coverage"])
    runs = options["runs"]
    simulated = _monte_carlo(model, runs, options["seed"]) if runs else None
    with click.progressbar(length=100, label="budget", file=sys.stderr) as bar:
        budget = make_budget(model, asked, simulated, percent(bar))
    written = write_budget(output, model, budget, runs)
    stored = read_budget(written[0])
    written += draw_budget(output, stored, options["suffix"])
    for what, how in budget.not_included:
        say(f"not evaluated: {what}; state it by {how}")
    for part in model.parts:
        for line in (stored.find("r_eff", part.placement, None), farthest(stored, part.placement)):
            if line is not None:
                say(f"placement {part.placement}: {label(line)}: {_said(line, stored.coverage_percent)}")
    say_written(*written)


def _said(line: StoredLine, coverage: float) -> str:
    from stepgauge.report.statements import dof_text

    runs = f"; Monte Carlo u {line.monte_carlo.u_um:.3f} um" if line.monte_carlo else ""
    return (
        f"{line.value_um:.3f} um, u {line.u_um:.3f} um, effective dof {dof_text(line.dof, 'infinite')},"
        f" U {line.expanded_um:.3f} um (k = {line.k:.2f}, {coverage:g} %){runs}"
    )


def _monte_carlo(model: Model, runs: int, seed: int) -> Any:
    from stepgauge.errors import InputError
    from stepgauge.montecarlo import run_monte_carlo

    if runs < 2:
        raise InputError("--runs", "too few runs", found=runs, expected="0 or at least 2")
    if not model.inputs.names:
        return None
    with click.progressbar(length=100, label="Monte Carlo", file=sys.stderr) as bar:
        return run_monte_carlo(model, runs, seed, progress=percent(bar))

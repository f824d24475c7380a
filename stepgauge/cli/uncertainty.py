"""``stepgauge uncertainty``: how sure are the errors that an evaluation reports."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from stepgauge.cli.options import (
    BLOCKS,
    GAUGE,
    GAUGE_TEMPERATURE,
    R_EFF,
    SEARCH,
    SUFFIX,
    U_GAUGE_TEMPERATURE,
    machine_option,
    output,
    percent,
    placement_option,
    say,
    say_written,
)


@click.command("uncertainty")
@click.argument("sources", nargs=-1, required=True, metavar="PROGRAM|RECORDING...")
@machine_option(True, "Machine file (TOML) whose values may carry uncertainties, or the name of a shipped one.")
@GAUGE
@placement_option("Placement file; needed with a program.")
@output("Folder for uncertainty.json, uncertainty.csv and the figure (made if missing).")
@BLOCKS
@R_EFF
@click.option("--runs", type=click.IntRange(2), default=10_000, show_default=True, help="Monte Carlo runs.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed; the same gives the same.")
@click.option(
    "--jobs",
    type=click.IntRange(1),
    metavar="N",
    help="Processes at most, as far as the work is worth it; changes no number. Default: all processor cores.",
)
@click.option(
    "--chunk",
    type=click.IntRange(1),
    metavar="RUNS",
    help="Runs given to a process at a time; changes no number. Default: one block, sized by the model.",
)
@U_GAUGE_TEMPERATURE
@GAUGE_TEMPERATURE
@SEARCH
@SUFFIX
def command(sources: tuple[str, ...], machine: str, gauge: str, output: str, **options: Any) -> None:
    """Distribution of every number that evaluate reports, by Monte Carlo (JCGM 101).

    Of a PROGRAM: what the virtual CMM would measure, over all that is uncertain. Of RECORDINGs (CSV or Parquet): how
    sure the errors evaluated from them are; effects of the machine file then count as disturbances of the measurement,
    by their uncertain parameters only.

    A value of the machine file carries an uncertainty as ppm = { value = 2.5, u = 0.8, distribution = "uniform" }: any
    parameter of an effect, repeatability_um, temperature_C, scale_expansion_per_K and pretravel_um. Distributions:
    normal (default), uniform, triangular, arcsine, student (with dof). The certificate, the gauge's expansion and the
    repeatability always count.

    Writes mean, standard uncertainty u, 95 % interval and the contribution of each input. The same seed gives the same
    numbers for any --jobs and --chunk. An interrupted command goes on where it stopped when it is repeated.

    \b
    stepgauge uncertainty gauge.dmi -m bridge-cmm -g step-gauge-420 -p placement.toml -o uncertainty
    stepgauge uncertainty recording.csv -m machine.toml -g step-gauge-420 --u-gauge-temperature 0.1 -o uncertainty
    """
    import os
    import sys

    from stepgauge.figures.uncertainty import draw_uncertainty
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.machine.file import read_machine
    from stepgauge.montecarlo import ModelOptions, read_model, run_monte_carlo
    from stepgauge.montecarlo.files import write_summary

    steps, cmm = read_gauge(gauge), read_machine(machine)
    stated = ModelOptions(
        options["u_gauge_temperature"],
        options["r_eff_origin"],
        options["blocks"],
        options["gauge_temperature"],
        options["search"],
    )
    model = read_model(sources, cmm, steps, read_placements(options["placement_files"], steps), stated)
    jobs = options["jobs"] or os.cpu_count() or 1
    with click.progressbar(length=100, label="runs", file=sys.stderr) as bar:
        summary = run_monte_carlo(
            model,
            options["runs"],
            options["seed"],
            jobs,
            options["chunk"],
            Path(output) / ".uncertainty-runs",
            percent(bar),
        )
    written = [*write_summary(output, model, summary), *draw_uncertainty(output, model, summary, options["suffix"])]
    for note in model.conditions.notes:
        say(f"note: {note}")
    for part in model.parts:
        _say_main(summary, part.placement)
    say_written(*written)


MAIN = (
    ("r_eff_mm", "R_eff", "mm", 5),
    ("band_um", "range of the mean error XM", "um", 3),
    ("worst_two_sigma_um", "largest 2s", "um", 3),
)


LEAST_RUNS = 40
"""Of fewer runs none lies beyond either end of an interval of 95 %: it would be the smallest and the largest value."""


def _say_main(summary: Any, placement: int) -> None:
    for name, words, unit, digits in MAIN:
        i = summary.index(name, None, placement)
        within = f"95 % from {summary.low[i]:.{digits}f} to {summary.high[i]:.{digits}f} {unit}"
        if summary.runs < LEAST_RUNS:
            within = f"too few runs for an interval of 95 % ({LEAST_RUNS} at least)"
        say(
            f"placement {placement}: {words} {summary.mean[i]:.{digits}f} {unit}, u {summary.u[i]:.2g} {unit}, {within}"
        )

"""``stepgauge uncertainty``: how sure are the errors that an evaluation reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, TEMPERATURE_C, FiniteRange, machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine_file import Machine
    from stepgauge.montecarlo import Model


@click.command("uncertainty")
@click.argument("sources", nargs=-1, required=True, metavar="PROGRAM|RECORDING...")
@machine_option(True, "Machine file (TOML) whose values may carry uncertainties, or the name of a shipped one.")
@GAUGE
@click.option("--placement", "-p", metavar="P", help="Placement file; needed with a program.")
@output("Folder for uncertainty.json, uncertainty.csv and the figure (made if missing).")
@click.option("--runs", type=click.IntRange(2), default=10_000, show_default=True, help="Monte Carlo runs.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed; the same gives the same.")
@click.option(
    "--jobs",
    type=click.IntRange(1),
    metavar="N",
    help="Processes at most, as far as the work is worth it; changes no number. Default: all processor cores.",
)
@click.option(
    "--chunk", type=click.IntRange(1), metavar="RUNS", help="Runs given to a process at a time; changes no number."
)
@click.option(
    "--gauge-temperature", type=TEMPERATURE_C, metavar="C", help="Of a program, deg C; default: certificate's."
)
@click.option(
    "--u-gauge-temperature",
    type=FiniteRange(0.0),
    metavar="K",
    help="Standard uncertainty of the recorded gauge temperature, K. Default: gauge_temperature_K in [uncertainty] of "
    "the machine file, or 0.",
)
@click.option(
    "--r-eff", "origin", type=click.Choice(["first", "all"]), default="first", show_default=True, help="As evaluate."
)
@click.option(
    "--search",
    type=FiniteRange(0.0, min_open=True),
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the target, mm, where the program does not state it.",
)
@click.option("--figure", "suffix", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True)
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
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.montecarlo import run_monte_carlo
    from stepgauge.montecarlo.files import write_summary

    steps, cmm = read_gauge(gauge), read_machine(machine)
    model = _model(sources, cmm, steps, options)
    jobs = options["jobs"] or os.cpu_count() or 1
    with click.progressbar(length=100, label="runs", file=sys.stderr) as bar:
        summary = run_monte_carlo(
            model,
            options["runs"],
            options["seed"],
            jobs,
            options["chunk"],
            Path(output) / ".uncertainty-runs",
            _percent(bar),
        )
    written = [*write_summary(output, model, summary), *draw_uncertainty(output, model, summary, options["suffix"])]
    for part in model.parts:
        _say_main(summary, part.placement)
    say("wrote " + ", ".join(str(path) for path in written))


def _model(sources: tuple[str, ...], machine: Machine, gauge: Gauge, options: dict[str, Any]) -> Model:
    from stepgauge.errors import InputError
    from stepgauge.machine import Conditions, probing_settings
    from stepgauge.montecarlo import program_model, recording_model
    from stepgauge.placement import read_placement
    from stepgauge.programs import read_program
    from stepgauge.recording import is_recording_file, join_recordings, read_recording

    u_temperature, origin = machine.u_gauge_temperature_K(options["u_gauge_temperature"]), options["origin"]
    if is_recording_file(sources[0]):
        recording = join_recordings([read_recording(path) for path in sources])
        return recording_model(recording, machine, gauge, u_temperature, origin)
    if len(sources) > 1:
        raise InputError(sources[1], "one program at a time", found=f"{len(sources)} files")
    if options["placement"] is None:
        raise InputError("--placement", "a program needs to know how the gauge lies", expected="a placement file")
    placement = read_placement(options["placement"], gauge)
    program = read_program(sources[0], probing_settings(machine, options["search"]))
    temperature = options["gauge_temperature"]
    conditions = Conditions(gauge.table.reference_temperature_C if temperature is None else temperature)
    return program_model(program, machine, gauge, placement, conditions, u_temperature, origin)


def _percent(bar: Any) -> Callable[[int, int], None]:
    return lambda done, total: bar.update(100 * done // total - bar.pos)


def _say_main(summary: Any, placement: int) -> None:
    for name, unit, digits in (("r_eff_mm", "mm", 5), ("band_um", "um", 3), ("worst_two_sigma_um", "um", 3)):
        i = summary.index(name, None, placement)
        low, high = summary.low[i], summary.high[i]
        say(
            f"placement {placement}: {name.removesuffix('_' + unit)} {summary.mean[i]:.{digits}f} {unit},"
            f" u {summary.u[i]:.2g} {unit}, 95 % from {low:.{digits}f} to {high:.{digits}f} {unit}"
        )

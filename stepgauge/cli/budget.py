"""``stepgauge budget``: the uncertainty budget of what an evaluation reports, beside the Monte Carlo."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, TEMPERATURE_C, FiniteRange, machine_option, output, say

if TYPE_CHECKING:
    from stepgauge.gauge import Gauge
    from stepgauge.machine_file import Machine
    from stepgauge.montecarlo import Model
    from stepgauge.placement import Placement
    from stepgauge.standards.budget_files import StoredLine


@click.command("budget")
@click.argument("sources", nargs=-1, required=True, metavar="RECORDING...|PROGRAM")
@machine_option(True, "Machine file (TOML) with its [uncertainty] table and uncertain values, or a shipped name.")
@GAUGE
@click.option(
    "--placement",
    "-p",
    "placement_files",
    multiple=True,
    metavar="P",
    help="Placement file: its [uncertainty] gives the alignment; once per placement. Needed with a program.",
)
@output("Folder for budget.json, budget.csv and the figures (made if missing), e.g. that of the evaluation.")
@click.option("--blocks", metavar="A:B", help="First and last block of the used section, as given to evaluate.")
@click.option(
    "--r-eff", "origin", type=click.Choice(["first", "all"]), default="first", show_default=True, help="As evaluate."
)
@click.option(
    "--u-gauge-temperature",
    type=FiniteRange(0.0),
    metavar="K",
    help="Standard uncertainty of the gauge's temperature, K. Default: gauge_temperature_K of the machine file.",
)
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
    "percent",
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
@click.option(
    "--gauge-temperature", type=TEMPERATURE_C, metavar="C", help="Of a program, deg C; default: certificate's."
)
@click.option(
    "--search",
    type=FiniteRange(0.0, min_open=True),
    default=2.0,
    show_default=True,
    metavar="MM",
    help="Search beyond the target of a program, mm, where its text does not state it.",
)
@click.option("--figure", "suffix", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True)
def command(sources: tuple[str, ...], machine: str, gauge: str, output: str, **options: Any) -> None:
    """Uncertainty budget (GUM) of R_eff, XF, XB, XM and XR at every face, with the Monte Carlo beside it.

    Counted are the gauge's certificate with its correlation, the temperatures and expansions of gauge and scales,
    probing, resolution, alignment, repeatability and every uncertain value of the machine file; R_eff enters XB through
    its own readings. What no file states is not made up: it is listed as not included, with the key that would state
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
    from stepgauge.files import check_folder
    from stepgauge.gauge import read_gauge
    from stepgauge.machine_file import read_machine
    from stepgauge.placement import read_placement
    from stepgauge.standards.budget import Asked, make_budget
    from stepgauge.standards.budget_files import read_budget, write_budget

    check_folder(output)
    steps, cmm = read_gauge(gauge), read_machine(machine)
    if options["certificate_correlation"] is not None:
        stated = {"correlation": options["certificate_correlation"]}
        steps = replace(steps, certificate=steps.certificate.model_copy(update=stated))
    placements = [read_placement(path, steps) for path in options["placement_files"]]
    model = _model(sources, cmm, steps, placements, options)
    asked = Asked(placements, options["repeats"], options["percent"])
    runs = options["runs"]
    simulated = _monte_carlo(model, runs, options["seed"]) if runs else None
    with click.progressbar(length=100, label="budget", file=sys.stderr) as bar:
        budget = make_budget(model, asked, simulated, _percent(bar))
    written = write_budget(output, model, budget, runs)
    stored = read_budget(written[0])
    written += draw_budget(output, stored, options["suffix"])
    for what, how in budget.not_included:
        say(f"not included: {what}; state it by {how}")
    for part in model.parts:
        for line in (stored.find("r_eff", part.placement, None), farthest(stored, part.placement)):
            if line is not None:
                say(f"placement {part.placement}: {label(line)}: {_said(line, stored.coverage_percent)}")
    say("wrote " + ", ".join(str(path) for path in written))


def _said(line: StoredLine, percent: float) -> str:
    from stepgauge.statements import dof_text

    runs = f"; Monte Carlo u {line.monte_carlo.u_um:.3f} um" if line.monte_carlo else ""
    return (
        f"{line.value_um:.3f} um, u {line.u_um:.3f} um, effective dof {dof_text(line.dof, 'infinite')},"
        f" U {line.expanded_um:.3f} um (k = {line.k:.2f}, {percent:g} %){runs}"
    )


def _model(
    sources: tuple[str, ...], machine: Machine, gauge: Gauge, placements: list[Placement], options: dict[str, Any]
) -> Model:
    from stepgauge.errors import InputError
    from stepgauge.machine import Conditions, probing_settings
    from stepgauge.montecarlo import program_model, recording_model
    from stepgauge.plan import parse_blocks
    from stepgauge.programs import read_program
    from stepgauge.recording import is_recording_file, join_recordings, read_recording
    from stepgauge.report.reading import check_machine

    u_temperature, origin = machine.u_gauge_temperature_K(options["u_gauge_temperature"]), options["origin"]
    if is_recording_file(sources[0]):
        tables = [read_recording(path) for path in sources]
        for table in tables:
            check_machine({"comments": table.comments}, machine)
        if options["gauge_temperature"] is not None:
            raise click.UsageError("--gauge-temperature belongs to a program; a recording has its own.")
        recording = tables[0] if len(tables) == 1 else join_recordings(tables)
        blocks = parse_blocks(options["blocks"], gauge) if options["blocks"] else None
        return recording_model(recording, machine, gauge, u_temperature, origin, blocks)
    if len(sources) > 1 or len(placements) != 1:
        found = f"{len(sources)} files, {len(placements)} placements"
        raise InputError(sources[0], "a program needs one file and one --placement", found=found)
    if options["blocks"]:
        raise click.UsageError("--blocks belongs to a recording; a program measures what it was planned for.")
    program = read_program(sources[0], probing_settings(machine, options["search"]))
    temperature = options["gauge_temperature"]
    conditions = Conditions(gauge.table.reference_temperature_C if temperature is None else temperature)
    return program_model(program, machine, gauge, placements[0], conditions, u_temperature, origin)


def _monte_carlo(model: Model, runs: int, seed: int) -> Any:
    from stepgauge.errors import InputError
    from stepgauge.montecarlo import run_monte_carlo

    if runs < 2:
        raise InputError("--runs", "too few runs", found=runs, expected="0 or at least 2")
    if not model.inputs.names:
        return None
    with click.progressbar(length=100, label="Monte Carlo", file=sys.stderr) as bar:
        return run_monte_carlo(model, runs, seed, progress=_percent(bar))


def _percent(bar: Any) -> Callable[[int, int], None]:
    return lambda done, total: bar.update(100 * done // total - bar.pos)

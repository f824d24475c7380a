"""The whole loop on a real controller: plan, run on LinuxCNC with a step gauge in HAL, import, evaluate, compare.

Exit code 0: the gauge's deviations were recovered within the controller's latch error; 1: they were not, or the
controller stopped; 2: wrong input, or LinuxCNC is not installed.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import click
import numpy as np
from comparison import Comparison, compare
from controller import latch_bound_um, require_linuxcnc, run_program
from hal_gauge import HERE, read_truth, render_hal

from stepgauge.cli import run_command, show_and_run
from stepgauge.evaluation.files import read_evaluation
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, read_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs import read_program
from stepgauge.recording import read_recording

LOG = "stepgauge-probe-log.txt"
STANDOFF_MM = "0.6"
"""Gap between ball and face before a search: short, so that the slow searches do not take long."""


@click.command(context_settings={"show_default": True})
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
@click.option("--gauge", "gauge_name", default="step-gauge-420", help="Gauge file or name.")
@click.option("--placement", default=str(HERE / "placement.toml"), help="Where the gauge lies.")
@click.option("--true-placement", metavar="P", help="Where it lies in HAL, if the plan is to be wrong about it.")
@click.option("--truth", default=str(HERE / "truth.csv"), help="Deviations of the faces in HAL, um.")
@click.option("--machine", "machine_name", default=str(HERE / "machine.toml"), help="Travel and speeds.")
@click.option("--blocks", default="1:15", help="First and last block A:B.")
@click.option("--cycles", default=2, help="Probings of every face.")
@click.option("--route", default="side", help="Way around the blocks: side or over.")
@click.option("--template", metavar="FILE", help="Your own program template instead of the shipped one.")
def main(output: Path, gauge_name: str, placement: str, true_placement: str | None, **options: str) -> None:
    """Plan a program, run it on LinuxCNC with simulated axes, and find the deviations of the gauge in HAL again."""
    require_linuxcnc()
    gauge, machine = read_gauge(gauge_name), read_machine(options["machine_name"])
    true_place = read_placement(true_placement or placement, gauge)
    deviation_um = read_truth(options["truth"], gauge)
    tip_radius_mm = machine.probe.tip_radius_mm
    program, recording = str(output / "program.ngc"), str(output / "recording.csv")

    plan = ["plan", placement, "--gauge", gauge_name, "--dialect", "linuxcnc", "--machine", options["machine_name"]]
    plan += ["--route", options["route"], "--blocks", options["blocks"], "--cycles", str(options["cycles"])]
    plan += ["--template", options["template"]] if options["template"] else []
    show_and_run(*plan, "--standoff", STANDOFF_MM, "-o", program)

    click.echo(f"$ linuxcnc -r {output / 'simulation.ini'}")
    moves = read_program(program, ProbingSettings(standoff_mm=float(STANDOFF_MM)))
    hal = render_hal(gauge, true_place, deviation_um, tip_radius_mm)
    outcome = run_program(Path(program).read_text(encoding="utf-8"), moves, machine, hal, output)
    if outcome.error:
        click.echo(f"LinuxCNC stopped at line {outcome.line}: {outcome.error}", err=True)
        sys.exit(1)
    click.echo(f"{outcome.seconds:.1f} s")

    log = str(output / LOG)
    run = ["--program", program, "--gauge", gauge_name, "--placement", placement]
    show_and_run("import", log, "--format", "linuxcnc", *run, "-o", recording)
    judge(Evaluated(output, recording, gauge_name), gauge, true_place, deviation_um, machine)


@dataclass(frozen=True)
class Evaluated:
    """A recording that LinuxCNC made, the folder of its results, and the name of its gauge."""

    output: Path
    recording: str
    gauge_name: str


def judge(made: Evaluated, gauge: Gauge, place: Placement, deviation_um: np.ndarray, machine: Machine) -> NoReturn:
    """Evaluate the recording, compare it with the deviations in HAL, and end with the exit code."""
    show_and_run("evaluate", made.recording, "--gauge", made.gauge_name, "-o", str(made.output))
    comparison = compare(
        read_recording(made.recording),
        read_evaluation(made.output / "evaluation.json"),
        gauge,
        place,
        deviation_um,
        machine.probe.tip_radius_mm,
        latch_bound_um(machine.table.measuring_speed_mm_s),
    )
    report(comparison)
    sys.exit(0 if comparison.agrees else 1)


def report(comparison: Comparison) -> None:
    """The table, the numbers and the verdict."""
    late = comparison.late_um
    click.echo("\n".join(["", *comparison.table(), ""]))
    click.echo(
        f"points were read {late.min():.3f} to {late.max():.3f} um beyond the contact, mean {late.mean():.3f} um"
    )
    click.echo(
        f"recovered minus true: XF and XB within {np.abs(comparison.off_um).max():.3f} um,"
        f" XM within {np.nanmax(np.abs(comparison.mean_off_um)):.3f} um, R_eff {comparison.r_eff_off_um:+.3f} um"
    )
    click.echo(f"latch error of the controller, measuring speed x servo period: {comparison.bound_um:.3f} um")
    verdict = "recovered within the latch error" if comparison.agrees else "NOT recovered within the latch error"
    click.echo(f"verdict: the deviations of the gauge in HAL are {verdict}")


if __name__ == "__main__":
    run_command(main, "run.py")

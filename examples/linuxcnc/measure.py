"""The measurement of run.py point by point: ``stepgauge measure`` moves LinuxCNC by its Python interface.

Stop it with Ctrl-C, and it goes on with --resume. Exit codes are those of run.py, and 130 where it was stopped.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click
from controller import running
from hal_gauge import HERE, read_truth, render_hal
from run import STANDOFF_MM, Evaluated, judge

from stepgauge.cli import run_command, show_and_run
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import probing_settings
from stepgauge.programs import read_program


@click.command(context_settings={"show_default": True})
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
@click.option("--gauge", "gauge_name", default="step-gauge-420", help="Gauge file or name.")
@click.option("--placement", default=str(HERE / "placement.toml"), help="Where the gauge lies.")
@click.option("--true-placement", metavar="P", help="Where it lies in HAL, if the plan is to be wrong about it.")
@click.option("--truth", default=str(HERE / "truth.csv"), help="Deviations of the faces in HAL, um.")
@click.option("--machine", "machine_name", default=str(HERE / "machine.toml"), help="Travel and speeds.")
@click.option("--blocks", default="1:15", help="First and last block A:B.")
@click.option("--cycles", default=2, help="Probings of every face.")
@click.option("--resume", is_flag=True, help="Go on with a measurement that was stopped.")
def main(output: Path, gauge_name: str, placement: str, true_placement: str | None, **options: str) -> None:
    """Measure point by point on LinuxCNC with simulated axes, and find the deviations of the gauge in HAL again."""
    gauge, machine = read_gauge(gauge_name), read_machine(options["machine_name"])
    lies = read_placement(true_placement or placement, gauge)
    deviation_um, tip_radius_mm = read_truth(options["truth"], gauge), machine.probe.tip_radius_mm
    program, recording = str(output / "program.ipp"), str(output / "recording.csv")
    common = ["--gauge", gauge_name, "--machine", options["machine_name"]]
    plan = ["--blocks", options["blocks"], "--cycles", str(options["cycles"]), "--standoff", STANDOFF_MM]
    show_and_run("plan", placement, *common, "--dialect", "ippdme", *plan, "-o", program)
    moves = read_program(program, probing_settings(machine, 2.0))
    with running(moves, machine, render_hal(gauge, lies, deviation_um, tip_radius_mm), output):
        go_on = ["--resume"] if options["resume"] else []
        line = ["measure", program, *common, "--placement", placement, "--server", "linuxcnc", *go_on]
        if show_and_run(*line, "-o", recording):
            sys.exit(130)
    judge(Evaluated(output, recording, gauge_name), gauge, lies, deviation_um, machine)


if __name__ == "__main__":
    run_command(main, "measure.py")

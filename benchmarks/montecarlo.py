"""Cost of ``stepgauge budget --method monte-carlo``: ``python benchmarks/montecarlo.py``.

10 000 runs of the 420 mm gauge in 5 cycles (2.1 million probings) and the contributions of all inputs, on two
processes, as a user calls it: from reading the files to the written report, less the start of the Python interpreter.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from table import Table, best_s

from stepgauge.files.resources import find_data
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement, read_placement, write_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import probing_settings
from stepgauge.montecarlo import program_model, run_monte_carlo
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.programs import DIALECTS, read_program
from stepgauge.programs.render import render

EFFECTS = """
[[effect]]
kind = "scale_error"
axis = "x"
ppm = { value = 2.5, u = 0.8 }
[[effect]]
kind = "squareness"
plane = "xy"
urad = { value = 4.0, u = 2.0, distribution = "uniform" }
[[effect]]
kind = "periodic_scale_error"
axis = "x"
period_mm = 20.0
amplitude_um = { value = 0.4, u = 0.05 }
[[effect]]
kind = "thermal_drift"
direction = "y"
rate_um_per_h = { value = 0.0, u = 2.0 }
[[effect]]
kind = "probe_lobing"
amplitude_um = { value = 0.5, u = 0.1, distribution = "triangular" }
"""
RUNS = 10_000


def write_files(folder: Path) -> None:
    """A machine with uncertain effects, a placement in the xy plane, and the program."""
    gauge = read_gauge("step-gauge-420")
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    (folder / "machine.toml").write_text(source + EFFECTS, encoding="utf-8")
    machine = read_machine(folder / "machine.toml")
    placement = make_placement([100, 150, 100], [340, 470, 100], 1, gauge.n_blocks)
    write_placement(folder / "placement.toml", placement)
    program = make_program(placement, gauge, PlanOptions(1, gauge.n_blocks, cycles=5), probing_settings(machine, 2.0))
    (folder / "gauge.ngc").write_text(render(program, DIALECTS["linuxcnc"]), encoding="utf-8")


def command_s(folder: Path) -> float:
    """The whole command on two processes."""
    command = [
        sys.executable,
        "-m",
        "stepgauge",
        "budget",
        "gauge.ngc",
        "--method",
        "monte-carlo",
        "-m",
        "machine.toml",
    ]
    command += ["-g", "step-gauge-420", "-p", "placement.toml", "--runs", str(RUNS), "--jobs", "2", "-o", "out"]
    return best_s(lambda: subprocess.run(command, cwd=folder, check=True, capture_output=True), 3)


def main() -> int:
    """Measure and print; the exit code is the number of bars missed."""
    table = Table()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_files(folder)
        gauge, machine = read_gauge("step-gauge-420"), read_machine(folder / "machine.toml")
        placement = read_placement(folder / "placement.toml", gauge)
        program = read_program(folder / "gauge.ngc", probing_settings(machine, 2.0))
        model = program_model(program, machine, gauge, placement)
        start_s = best_s(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True), 5)
        table.add("start of the interpreter", start_s, "s")
        table.add(f"probings in {RUNS} runs", RUNS * model.n_rows / 1e6, "million")
        table.add("runs and contributions, in this process", best_s(lambda: run_monte_carlo(model, RUNS), 3), "s")
        many = 10 * RUNS
        table.add(f"{many} runs, 1 process", best_s(lambda: run_monte_carlo(model, many), 1), "s")
        table.add(f"{many} runs, 2 processes", best_s(lambda: run_monte_carlo(model, many, jobs=2), 1), "s")
        table.add("the command, less the interpreter's start", command_s(folder) - start_s, "s", high=5)
    return table.print()


if __name__ == "__main__":
    sys.exit(main())

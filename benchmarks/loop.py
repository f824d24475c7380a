"""What a user waits for: import, start-up, plan, rendering and simulation of the largest shipped job.

    python benchmarks/loop.py

The job: the 1020 mm gauge with all 51 blocks, 5 cycles, 510 points. Times are medians of whole processes; "beyond the
interpreter" is less the time of ``python -c pass``, measured in turn in the same run. The last column is the bar.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement, write_placement

RUNS = 7


def seconds(*commands: list[str]) -> list[float]:
    """Median wall time of each command, taken in turn so that a slow moment hits all of them."""
    times: list[list[float]] = [[] for _ in commands]
    for turn in range(RUNS + 1):
        for command, taken in zip(commands, times, strict=True):
            began = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            if turn:  # the first round warms the file cache
                taken.append(time.perf_counter() - began)
    return [statistics.median(taken) for taken in times]


def import_us(name: str) -> float:
    """Median time that an import takes beyond those of the interpreter, us, by ``python -X importtime``."""
    times = []
    for _ in range(RUNS):
        line = [sys.executable, "-X", "importtime", "-c", f"import {name}"]
        told = subprocess.run(line, check=True, capture_output=True, text=True).stderr.splitlines()
        times.append(float(next(row.split("|")[1] for row in told if row.split("|")[-1].strip() == name)))
    return statistics.median(times)


def main() -> None:
    python = sys.executable
    stepgauge = [python, "-m", "stepgauge"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        gauge = read_gauge("step-gauge-1020")
        length = gauge.block_centre_mm[-1] - gauge.block_centre_mm[0]
        axis = np.array([0.01, 1.0, 0.0]) / np.hypot(0.01, 1.0)
        centre = np.array([350.0, 90.0, 200.0])
        write_placement(folder / "p.toml", make_placement(centre, centre + length * axis, 1, 51))
        common = ["-g", "step-gauge-1020", "-m", "bridge-cmm"]
        plan = [*stepgauge, "plan", str(folder / "p.toml"), *common, "-d", "dmis", "-o", str(folder / "p.dmi")]
        simulate = [*stepgauge, "simulate", str(folder / "p.dmi"), *common, "-p", str(folder / "p.toml")]
        simulate += ["-o", str(folder / "r.csv")]
        subprocess.run(plan, check=True, capture_output=True)
        bare, click, help_text, planned, simulated = seconds(
            [python, "-c", "pass"], [python, "-c", "import click"], [*stepgauge, "--help"], plan, simulate
        )
    rows = [
        ("import stepgauge / import click, -X importtime", import_us("stepgauge") / import_us("click"), "ratio", 2.5),
        ("stepgauge --help / import click", help_text / click, "ratio", 2.5),
        ("plan + check + render + read back, 510 points", planned - bare, "s beyond the interpreter", 1.0),
        ("simulate 510 points", simulated - bare, "s beyond the interpreter", 1.0),
        ("plan / start of the interpreter", planned / bare, "ratio", float("nan")),
        ("simulate / start of the interpreter", simulated / bare, "ratio", float("nan")),
    ]
    print(f"{'':48} {'measured':>9}  {'bar':>5}")
    for what, value, unit, bar in rows:
        print(f"{what:48} {value:9.2f}  {'' if bar != bar else f'{bar:5.1f}':>5}  {unit}")


if __name__ == "__main__":
    main()

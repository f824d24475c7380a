"""What people wait for before anything happens: ``python benchmarks/startup.py``, as ratios within one run.

Help against ``import click``; locate, plan and simulate of 210 points, and evaluate against ``import numpy``, each as a
command of its own. Best of three, all one after the other, with compiled modules, as after an installation.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
ROOT = Path(__file__).resolve().parent.parent
MACHINE, POINTS = ROOT / "examples/demo/machine.toml", ROOT / "examples/demo/points.csv"
G, M = ("-g", "step-gauge-420"), ("-m", str(MACHINE))
COMMANDS = (
    ("--help", ("--help",), "click", 2.0),
    ("evaluate --help", ("evaluate", "--help"), "click", 2.0),
    ("locate", ("locate", str(POINTS), *G, *M, "-o", "p.toml"), "numpy", 4.0),
    ("plan", ("plan", "p.toml", *G, *M, "-d", "dmis", "-o", "g.dmi"), "numpy", 6.0),
    ("simulate", ("simulate", "g.dmi", *G, *M, "-p", "p.toml", "-o", "r.csv"), "numpy", 6.0),
    ("evaluate", ("evaluate", "r.csv", *G, "-o", "e"), "numpy", 4.0),
)
"""Name, words, module that it is compared with, and the ratio that it may have."""


def best_s(words: list[str], folder: Path) -> float:
    """The shortest of three runs, s."""
    taken = []
    for _ in range(3):
        began = time.perf_counter()
        subprocess.run(words, cwd=folder, check=True, capture_output=True, env=ENVIRONMENT)
        taken.append(time.perf_counter() - began)
    return min(taken)


def main() -> None:
    """A line for each command: time, ratio, and what is asked."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        base = {name: best_s([sys.executable, "-c", f"import {name}"], folder) for name in ("click", "numpy")}
        for name, words, module, most in COMMANDS:
            seconds = best_s([sys.executable, "-m", "stepgauge", *words], folder)
            ratio = seconds / base[module]
            verdict = "ok" if ratio <= most else "MISSED"
            print(f"{name:16} {seconds:6.3f} s = {ratio:4.1f} x import {module} (at most {most:g}): {verdict}")


if __name__ == "__main__":
    main()

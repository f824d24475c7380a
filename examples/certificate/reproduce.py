"""From a gauge certificate that arrives as XML to the certificates of the machine, printed and digital.

    python examples/certificate/reproduce.py results

runs the commands of README.md one after the other, shows each, and leaves everything in the folder results.
"""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

from stepgauge.cli import show_and_run

HERE = Path(__file__).resolve().parent
STEPS = (
    "dcc export-gauge step-gauge-420 -c {here}/gauge-laboratory.toml -o gauge-certificate.xml",
    "dcc import-gauge gauge-certificate.xml -o gauge.toml",
    "locate {here}/../demo/points.csv -g gauge.toml -m {here}/machine.toml -o placement.toml",
    "plan placement.toml -g gauge.toml -m {here}/machine.toml -d dmis --cycles 5 -o program.dmi",
    "simulate program.dmi -m {here}/machine.toml -g gauge.toml -p placement.toml --seed 17"
    " --gauge-temperature 20.4 -o recording.csv",
    "evaluate recording.csv -g gauge.toml --measured-at 2026-05-04 -o result",
    "budget recording.csv -g gauge.toml -m {here}/machine.toml -p placement.toml -o result",
    "report result -g gauge.toml -m {here}/machine.toml -p placement.toml --budget result"
    " -c {here}/certificate.toml -o certificate.pdf",
    "dcc write result -c {here}/certificate.toml -g gauge.toml -m {here}/machine.toml -o certificate.xml",
    "dcc check certificate.xml",
)


def main(folder: Path) -> None:
    """Run all steps in ``folder``, which is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.chdir(folder):
        for step in STEPS:
            show_and_run(*(part.format(here=HERE) for part in step.split()))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "certificate-results"))

"""From a gauge certificate that arrives as XML to the certificates of the machine, printed and digital.

    python examples/certificate/reproduce.py results

runs the commands of README.md one after the other, shows each, and leaves everything in the folder results.
"""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from stepgauge.cli import cli

HERE = Path(__file__).parent
STEPS = (
    "dcc export-gauge step-gauge-420 -c {here}/gauge-laboratory.toml -o {d}/gauge-certificate.xml",
    "dcc import-gauge {d}/gauge-certificate.xml -o {d}/gauge.toml",
    "locate {here}/../demo/points.csv -g {d}/gauge.toml -m {here}/machine.toml -o {d}/placement.toml",
    "plan {d}/placement.toml -g {d}/gauge.toml -m {here}/machine.toml -d dmis --cycles 5 -o {d}/program.dmi",
    "simulate {d}/program.dmi -m {here}/machine.toml -g {d}/gauge.toml -p {d}/placement.toml --seed 17"
    " --gauge-temperature 20.4 -o {d}/recording.csv",
    "evaluate {d}/recording.csv -g {d}/gauge.toml -o {d}/result",
    "budget {d}/recording.csv -g {d}/gauge.toml -m {here}/machine.toml -p {d}/placement.toml -o {d}/result",
    "report {d}/result -g {d}/gauge.toml -m {here}/machine.toml -p {d}/placement.toml --budget {d}/result"
    " -c {here}/certificate.toml -o {d}/certificate.pdf",
    "dcc write {d}/result -c {here}/certificate.toml -g {d}/gauge.toml -m {here}/machine.toml -o {d}/certificate.xml",
    "dcc check {d}/certificate.xml",
)


def main(folder: Path) -> None:
    """Run all steps; ``folder`` is made if it is missing."""
    for step in STEPS:
        arguments = [part.format(here=HERE, d=folder) for part in step.split()]
        print("$ stepgauge", shlex.join(arguments), file=sys.stderr)
        cli.main(args=arguments, prog_name="stepgauge", standalone_mode=False)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "certificate-results"))

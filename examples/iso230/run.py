"""Positioning of an axis by ISO 230-2 with a step gauge, on a virtual machining centre.

    python examples/iso230/run.py result

Every step is a command of its own that is shown as it runs.
"""

from __future__ import annotations

import sys
from pathlib import Path

from stepgauge.cli import show_and_run

HERE = Path(__file__).parent
STEPS = (
    "plan {here}/placement.toml -g step-gauge-600 -m {here}/machine.toml -d linuxcnc --cycles 5 -o {out}/program.ngc",
    "simulate {out}/program.ngc -g step-gauge-600 -m {here}/machine.toml -p {here}/placement.toml --seed 230"
    " --gauge-temperature 20.6 -o {out}/recording.csv",
    "test iso230 {out}/recording.csv -g step-gauge-600 -m {here}/machine.toml --tip-diameter 5.982 -o {out}",
)


def main(folder: Path) -> None:
    """Plan, run, evaluate."""
    for step in STEPS:
        show_and_run(*(part.format(here=HERE, out=folder) for part in step.split()))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "iso230"))

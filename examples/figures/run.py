"""Three placements of a gauge in a machine with three faults, and the figures of that measurement.

    python examples/figures/run.py result

Every step is a command of its own that is shown as it runs.
"""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from stepgauge.cli import main as command_line

HERE = Path(__file__).parent
GAUGE, MACHINE = "step-gauge-420", HERE / "machine.toml"
PLACEMENTS = {"along-x": 20.1, "along-y": 20.3, "diagonal": 20.5}
"""Where the gauge lies, and its temperature then, deg C."""


def stepgauge(*arguments: object) -> None:
    """Run a command as it is shown."""
    words = [str(argument) for argument in arguments]
    print(f"$ stepgauge {shlex.join(words)}", flush=True)
    command_line(words)


def main(folder: Path) -> None:
    """Plan and run each placement, one after the other, then draw."""
    recordings = []
    for number, (name, temperature) in enumerate(PLACEMENTS.items(), 1):
        placement, program, recording = HERE / f"{name}.toml", folder / f"{name}.dmi", folder / f"{name}.csv"
        stepgauge("plan", placement, "-g", GAUGE, "-m", MACHINE, "-d", "dmis", "--cycles", 5, "-o", program)
        stepgauge(
            "simulate", program, "-g", GAUGE, "-m", MACHINE, "-p", placement, "--placement-number", number,
            "--seed", number, "--gauge-temperature", temperature, "--start-time", 900 * (number - 1), "-o", recording,
        )  # fmt: skip
        recordings.append(recording)
    stepgauge(
        "evaluate", *recordings, "-g", GAUGE, "-m", MACHINE, "--mpe", "1.8 + L/350", "--draw", "all", "-o", folder
    )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "figures"))

"""The length measurement test of ISO 10360-2 from the plan to the report, on a virtual CMM.

    python examples/iso10360/run.py result

Every step is a command of its own that is shown as it runs. On a real machine the programs run there, after the gauge
was located in each position and planned again (see README.md).
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from stepgauge.cli import show_and_run

HERE = Path(__file__).parent
GAUGE = "step-gauge-1020"
TEST = (
    "--mpe", "1.8 + L/350", "--mpe-repeatability", "1.5", "--tip-diameter", "3.9940", "--u-gauge-temperature", "0.05",
    "--u-alignment", "0.1", "--u-fixture", "0.1",
)  # fmt: skip


def main(folder: Path) -> None:
    """Plan, seven runs, test."""
    plan = folder / "plan"
    show_and_run("test", "plan", "-g", GAUGE, "-m", HERE / "machine.toml", "-d", "dmis", "-o", plan)
    recordings = []
    for number in (one["position"] for one in json.loads((plan / "plan.json").read_text())["positions"]):
        name, recording = plan / f"position-{number}", folder / f"position-{number}.csv"
        show_and_run(
            "simulate", f"{name}.dmi", "-m", f"{name}-machine.toml", "-g", GAUGE, "-p", f"{name}.toml",
            "--placement-number", number, "--seed", number, "--gauge-temperature", 20.3, "-o", recording,
        )  # fmt: skip
        recordings.append(recording)
    show_and_run("test", "iso10360", *recordings, "-g", GAUGE, "-m", HERE / "machine.toml", *TEST, "-o", folder)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "iso10360"))

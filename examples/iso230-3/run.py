"""Drift tests by ISO 230-3: a day of a standing machine (ETVE), and an x axis that warms up, on a virtual machine.

    python examples/iso230-3/run.py result

Every step is a command of its own that is shown as it runs. The table of the sensors is made here: the room swings by
2 K over the day and the machine follows it late.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from stepgauge.cli import show_and_run
from stepgauge.files.tables import csv_text
from stepgauge.files.text import write_text

HERE = Path(__file__).parent
DAY_S, STEP_S = 86400.0, 300.0
SWING_K, LAG_H = 2.0, 3.0
UM_PER_K = {"x1": 3.0, "y1": 4.5, "z": -6.0, "x2": 2.2, "y2": 3.9}
"""Displacement of each sensor per kelvin of the machine's structure."""


def sensors(path: Path) -> None:
    """The table of an ETVE test: a structure with one time constant follows the sine of the room (closed form)."""
    time_s = np.arange(0.0, DAY_S + STEP_S, STEP_S)
    omega = 2.0 * np.pi / DAY_S
    lag = omega * LAG_H * 3600.0
    room = 20.0 + SWING_K / 2.0 * np.sin(omega * time_s)
    structure = SWING_K / 2.0 * np.sin(omega * time_s - np.arctan(lag)) / np.hypot(1.0, lag)
    noise = np.random.default_rng(2303).normal(0.0, 0.05, (len(UM_PER_K), len(time_s)))
    um = [factor * structure + one for factor, one in zip(UM_PER_K.values(), noise, strict=True)]
    columns = [time_s, *um, room, 20.0 + structure]
    header = ["time_s", *(f"{name}_um" for name in UM_PER_K), "room_C", "column_C"]
    head = "# machine: Vertical machining centre, example\n# seed: 2303\n"
    write_text(path, head + csv_text(header, np.round(np.column_stack(columns), 4).tolist()))


def main(folder: Path) -> None:
    """Both tests."""
    folder.mkdir(parents=True, exist_ok=True)
    sensors(folder / "sensors.csv")
    sure = ("--expanded-uncertainty", 0.3)
    show_and_run(
        "test",
        "iso230-3",
        folder / "sensors.csv",
        "--test",
        "etve",
        "--tolerance",
        "z=10",
        *sure,
        "-o",
        folder / "etve",
    )
    use = ("-g", "step-gauge-600", "-m", HERE / "machine.toml")
    program, recording = folder / "program.ngc", folder / "warm-up.csv"
    show_and_run(
        "plan", HERE / "placement.toml", *use, "-d", "linuxcnc", "--cycles", 60, "--blocks", "1,30", "-o", program
    )
    show_and_run(
        "simulate", program, *use, "-p", HERE / "placement.toml", "--seed", 230, "--gauge-temperature", 20, "-o",
        recording,
    )  # fmt: skip
    show_and_run("test", "iso230-3", recording, "--test", "axis", "-g", "step-gauge-600", "-o", folder / "warm-up")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "iso230-3"))

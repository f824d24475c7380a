"""Probing tests by ISO 10360-5 with a virtual probe: one stylus, and one stylus held in five ways.

    python examples/iso10360-5/run.py result

Every step is a command of its own that is shown as it runs.
"""

from __future__ import annotations

import sys
from pathlib import Path

from stepgauge.cli import show_and_run

PROBE, SPHERE = "omp40-2-50mm", ("--sphere-diameter", 25)
WAYS = ("0,0,-1", "1,0,0", "-1,0,0", "0,1,0", "0,-1,0")
TEST = (
    "--tip-diameter", 5.991, "--mpe-form", 6, "--mpe-size", 6, "--sphere-form", 0.1, "--u-sphere-form", 0.03,
    "--u-sphere-diameter", 0.1,
)  # fmt: skip


def main(folder: Path) -> None:
    """The points of five ways, the test of the first, the test of all."""
    points = []
    for number, way in enumerate(WAYS, 1):
        points.append(folder / f"way-{number}.csv")
        held = (f"--stylus-direction={way}", "--seed", number)
        show_and_run("probe", "sphere", PROBE, *SPHERE, *held, "-o", points[-1])
    show_and_run("test", "iso10360-5", points[0], *SPHERE, *TEST, "-o", folder / "one-stylus")
    show_and_run("test", "iso10360-5", *points, *SPHERE, *TEST, "--mpe-location", 8, "-o", folder / "five-styli")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "iso10360-5"))

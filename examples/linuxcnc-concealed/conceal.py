"""A planned program on LinuxCNC with something hidden. Beside the scorer the only part that opens the truth.

Called as ``conceal.py CASE PROGRAM PLACEMENT FOLDER``; the controller's log and configuration go to FOLDER.
"""

from __future__ import annotations

import sys
import zlib
from pathlib import Path

import numpy as np
from cases import GAUGE
from truth import HERE, read_truth

sys.path.append(str(HERE.parent / "linuxcnc"))
from controller import Drives, run_program
from hal_gauge import render_hal

from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.machine.file import read_machine
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs import read_program

ACCELERATION_MM_S2 = 20_000.0
LAG_MM = 0.05
"""Largest lag of the drives: several times what they travel between two looks at the probe."""


def run_concealed(case: str, program: str, placement: str, folder: Path) -> float:
    """Run a program with what the truth says of a case; seconds that the controller took.

    The gauge in HAL is off its certificate as far as the certificate allows, the same way in all runs of a case.

    Raises
    ------
    InputError
        no such case, LinuxCNC missing, in use, or stopped
    """
    hidden = read_truth(case).hidden
    gauge, machine = read_gauge(GAUGE), read_machine(HERE / "machine.toml")
    deviation_um = seeded(case).normal(0.0, gauge.u_um)
    hal = render_hal(
        gauge,
        read_placement(placement, gauge),
        deviation_um,
        machine.probe.tip_radius_mm,
        HERE / "concealed.hal.j2",
        hidden=hidden,
        lag_mm=LAG_MM,
        chaos=2.0 - 0.1 * seeded(f"{case}/{folder.parent.name}").random(),
    )
    drives = Drives(hidden.servo_period_ns, ACCELERATION_MM_S2)
    text = Path(program).read_text(encoding="utf-8")
    outcome = run_program(text, read_program(program, ProbingSettings()), machine, hal, folder, drives)
    if outcome.error:
        raise InputError(f"{program}:{outcome.line}", f"LinuxCNC stopped: {outcome.error}")
    return outcome.seconds


def seeded(seed: str) -> np.random.Generator:
    """The same numbers for the same words."""
    return np.random.default_rng(zlib.crc32(seed.encode()))


if __name__ == "__main__":
    try:
        print(f"{run_concealed(sys.argv[1], sys.argv[2], sys.argv[3], Path(sys.argv[4])):.1f} s")
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)

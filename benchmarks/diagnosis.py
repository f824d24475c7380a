"""What a diagnosis costs: ``python benchmarks/diagnosis.py``.

First the processor time beyond start-up and imports, for recordings of the virtual CMM: with nothing hidden, with
effects, and with hysteresis that no law of the vocabulary describes. The unit of the ratios is one pass of np.sin over
1e6 float64 on the same core in the same run; set ``OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1`` for one core. Then the
time that a user waits for the whole command with its figures and its report, also as a ratio to an interpreter that
imports what any such program must.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from table import Table, best_s

from stepgauge.diagnosis.engine import diagnose
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings, write_recording

Array = NDArray[np.float64]
GAUGE = read_gauge("step-gauge-420")
MACHINE = read_machine("bridge-cmm")
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.7, 0.7, 0.0), (0.5, 0.9, 0.0))
PAUSE_S = 30.0
SCALE: dict[str, Any] = {"kind": "scale_error", "axis": "x", "ppm": 5.0}
JUMP: dict[str, Any] = {"kind": "step_change", "direction": "x", "time_s": 400.0, "um": 0.8}
CYCLE: dict[str, Any] = {"kind": "temperature_cycle", "direction": "y", "amplitude_um": 0.5, "period_s": 300.0}


def recorded(effects: tuple[dict[str, Any], ...] = (), placements: int = 4, cycles: int = 5) -> Recording:
    """All faces of the 420 mm gauge, 42 probings a cycle, in some placements."""
    machine = replace(MACHINE, effects=effects)
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(GAUGE, 2.0))
    length = GAUGE.block_centre_mm[-1] - GAUGE.block_centre_mm[0]
    runs, start_s = [], 0.0
    for number, axis in enumerate(AXES[:placements], 1):
        a = np.array(axis) / np.linalg.norm(axis)
        c1 = np.array([350.0, 600.0, 250.0]) - a * length / 2.0
        placement = make_placement(c1, c1 + a * length, 1, GAUGE.n_blocks)
        program = make_program(placement, GAUGE, PlanOptions(1, GAUGE.n_blocks, cycles=cycles), settings)
        run = run_program(program, machine, GAUGE, placement, number, RunConditions(20.0, number, start_s))
        runs.append(run.recording)
        start_s += run.duration_s + PAUSE_S
    return join_recordings(runs)


def bent(recording: Recording, um: Array) -> Recording:
    """A recording moved along every approach."""
    frame = recording.frame.copy()
    frame[POSITION] += frame[APPROACH].to_numpy() * (um * 1e-3)[:, None]
    return replace(recording, frame=frame)


def hysteresis_um(recording: Recording) -> Array:
    """Play that a soft drive takes up with the way from touch to touch."""
    return np.asarray(0.8 * np.tanh(np.gradient(recording.frame["x_mm"].to_numpy()) / 5.0))


def cpu_s(work: Callable[[], object], repeats: int) -> float:
    """Least processor time of a few calls, s."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def cases() -> dict[str, Recording]:
    """Recordings by name."""
    null = recorded()
    return {
        "nothing hidden": null,
        "without times": replace(null, frame=null.frame.drop(columns="time_s")),
        "a scale error": recorded((SCALE,)),
        "three effects": recorded((SCALE, JUMP, CYCLE)),
        "hysteresis, without a law": bent(null, hysteresis_um(null)),
    }


def waited_s(command: list[str], repeats: int = 3) -> float:
    """Least wall-clock time of a process, s."""
    return best_s(lambda: subprocess.run(command, check=True, capture_output=True), repeats)


def whole_commands(table: Table, some: dict[str, Recording]) -> None:
    """``stepgauge diagnose`` as it is typed, into a folder that is not there yet."""
    imports_s = waited_s([sys.executable, "-c", "import numpy, scipy.linalg, matplotlib.figure"])
    table.add("python with numpy, scipy.linalg, matplotlib", imports_s, "s")
    with tempfile.TemporaryDirectory() as name:
        for number, (what, recording) in enumerate(some.items()):
            path = Path(name) / f"{number}.csv"
            write_recording(path, recording)
            command = [sys.executable, "-m", "stepgauge", "diagnose", str(path), "-g", "step-gauge-420"]
            taken_s = waited_s([*command, "-m", "bridge-cmm", "-o", str(path.with_suffix(""))])
            high = 3.0 if len(recording.frame) <= 840 else 30.0
            table.add(f"whole command, {len(recording.frame)} rows, {what}", taken_s, "s", high=high)
            table.add("", taken_s / imports_s, "times python with imports")


def main() -> int:
    """Measure and print; the exit code is the number of bars missed."""
    table, x = Table(), np.linspace(0.0, 100.0, 1_000_000)
    unit_s = best_s(lambda: np.sin(x))
    table.add("np.sin over 1e6 numbers", unit_s * 1e3, "ms")
    some = cases()
    for name, recording in some.items():
        taken_s = cpu_s(lambda recording=recording: diagnose(recording, GAUGE, MACHINE), 3)
        table.add(f"{len(recording.frame)} rows, {name}", taken_s, "s", high=2.0)
        table.add("", taken_s / unit_s, "passes")
    for cycles in (119, 1190):
        recording = recorded((SCALE,), 2, cycles)
        taken_s = cpu_s(lambda recording=recording: diagnose(recording, GAUGE, MACHINE), 1)
        table.add(f"{len(recording.frame)} rows, a scale error", taken_s, "s", high=60.0)
        table.add("", taken_s / unit_s, "passes")
    whole_commands(table, {**some, "a scale error, 1190 cycles": recorded((SCALE,), 2, 1190)})
    return table.print()


if __name__ == "__main__":
    sys.exit(main())

"""What is worse without the model of what thermometers did in pauses: ``python -m benchmarks.unobserved_inputs``.

The same recordings are diagnosed with and without it. The machine moves along a direction as a body that warms in the
air of its room; the air wanders, doors open, also before the first touch and while the gauge is laid anew, when nobody
reads the thermometer. The body is computed on a dense clock. Counted are recordings in which the law is named, in which
anything else is told beside it (a law or a form, which would be false), and in which the value is within 2 u.

30 recordings of 288 rows (``--recordings 10 --first-seed 101``):

| cause / repeatability | | named | something else told | value within 2 u |
|---|---|---|---|---|
| 3 | with | 5 of 10 | 4 of 10 | 5 of 5 |
| 3 | without | 4 of 10 | 5 of 10 | 3 of 4 |
| 10 | with | 7 of 10 | 5 of 10 | 6 of 7 |
| 10 | without | 4 of 10 | 9 of 10 | 3 of 4 |
| 30 | with | 8 of 10 | 4 of 10 | 7 of 8 |
| 30 | without | 4 of 10 | 9 of 10 | 1 of 4 |

So it stays. That 13 of 30 tell something else even with it is its limit: these are hard rooms.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from stepgauge.diagnosis import engine
from stepgauge.diagnosis.gaussian_processes import memory
from stepgauge.diagnosis.laws import discrepancy
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings

Array = NDArray[np.float64]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.7, 0.7, 0.0))
GAUGE, MACHINE, BLOCKS, CYCLES = read_gauge("step-gauge-420"), read_machine("bridge-cmm"), 12, 4
COLUMN, STEP_S, BEFORE_S = "room_temperature_C", 1.0, 3600.0
RATIOS = (3.0, 10.0, 30.0)
"""Root mean square of the cause over the repeatability."""


@dataclass(frozen=True)
class Case:
    """A recording, and by how much the origin moves with the body, um/K."""

    recording: Recording
    um_per_K: float


def case(seed: int, ratio: float) -> Case:
    """Three placings with pauses of 5 to 20 min between them, and one of 2 to 10 min in the middle of each."""
    random = np.random.default_rng(seed)
    frame = _measured(seed, random).frame
    time_s = frame["time_s"].to_numpy()
    clock_s = np.arange(-BEFORE_S, time_s.max() + STEP_S, STEP_S)
    air = _air(clock_s, random)
    lag_s = float(np.exp(random.uniform(np.log(0.02), np.log(0.2)))) * float(np.ptp(time_s))
    kept = np.exp(-STEP_S / lag_s)
    body = 20.0 + lfilter([1.0 - kept], [1.0, -kept], air - 20.0)
    direction = random.normal(size=3) * (1.0, 1.0, 0.0)
    share = frame[APPROACH].to_numpy() @ (direction / np.linalg.norm(direction))
    moved = np.interp(time_s, clock_s, body - 20.0) * share
    um_per_K = ratio * float(MACHINE.table.repeatability_um) / float(moved.std())
    frame = frame.assign(**{COLUMN: np.interp(time_s, clock_s, air).round(3)})
    frame[POSITION] += frame[APPROACH].to_numpy() * (um_per_K * moved * 1e-3)[:, None]
    return Case(replace(_measured(seed, np.random.default_rng(seed)), frame=frame), um_per_K)


def _measured(seed: int, random: np.random.Generator) -> Recording:
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(GAUGE, 2.0))
    length = GAUGE.block_centre_mm[BLOCKS - 1] - GAUGE.block_centre_mm[0]
    runs, start_s = [], 0.0
    for number, axis in enumerate(AXES, 1):
        a = np.array(axis) / np.linalg.norm(axis)
        c1 = np.array([350.0, 600.0, 250.0]) - a * length / 2.0
        placement = make_placement(c1, c1 + a * length, 1, BLOCKS)
        program = make_program(placement, GAUGE, PlanOptions(1, BLOCKS, cycles=CYCLES), settings)
        conditions = RunConditions(20.0, number, start_s)
        run = run_program(program, MACHINE, GAUGE, placement, 10 * seed + number, conditions)
        pause_s = random.uniform(120.0, 600.0)
        late = run.recording.frame["cycle"] > 2  # somebody was called away
        frame = run.recording.frame.assign(time_s=run.recording.frame["time_s"] + pause_s * late)
        runs.append(replace(run.recording, frame=frame))
        start_s += run.duration_s + pause_s + random.uniform(300.0, 1200.0)
    return join_recordings(runs)


def _air(clock_s: Array, random: np.random.Generator) -> Array:
    """Air that wanders over an hour, and doors about every five minutes, whose air mixes in two."""
    slow = np.exp(-STEP_S / 3600.0)
    wander = lfilter([np.sqrt(1.0 - slow**2)], [1.0, -slow], random.normal(0.0, 1.0, len(clock_s)))
    jumps = random.normal(0.0, 0.8, len(clock_s)) * (random.random(len(clock_s)) < STEP_S / 300.0)
    return np.asarray(20.0 + wander + lfilter([1.0], [1.0, -np.exp(-STEP_S / 120.0)], jumps))


@contextmanager
def without() -> Iterator[None]:
    """What follows a temperature is known exactly, as if there were no pauses."""

    def nothing(*given: object) -> Array:
        data = next(one for one in given if hasattr(one, "frame"))
        return np.zeros((0, len(data.frame)))

    with (
        mock.patch.object(discrepancy, "unread_columns", nothing),
        mock.patch.object(memory, "_unread", nothing),
    ):
        yield


def scored(one: Case, found: GaugeDiagnosis) -> tuple[bool, bool, bool]:
    """Whether the law is named, whether anything else is told, and whether the value is within 2 u."""
    named = [each for each in found.findings if each.kind == "thermal_shift"]
    others = len(found.findings) - len(named[:1]) + len(found.unexplained)
    values = [each.parameters["um_per_K"] for each in named]
    inside = [abs(abs(each.value) - one.um_per_K) < 2.0 * each.u for each in values if each.u is not None]
    return bool(named), bool(others), any(inside)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=8, help="of each size")
    parser.add_argument("--first-seed", type=int, default=1)
    chosen = parser.parse_args()
    print("| cause / repeatability | | named | something else told | value within 2 u |\n|---|---|---|---|---|")
    for ratio in RATIOS:
        every = [case(chosen.first_seed + i, ratio) for i in range(chosen.recordings)]
        for what in ("with", "without"):
            rows = []
            for one in every:
                with without() if what == "without" else nullcontext():
                    rows.append(scored(one, engine.diagnose(one.recording, GAUGE, MACHINE)))
            named, others, inside = np.array(rows).sum(axis=0)
            of = len(rows)
            print(f"| {ratio:g} | {what} | {named} of {of} | {others} of {of} | {inside} of {named} |", flush=True)


if __name__ == "__main__":
    main()

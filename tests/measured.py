"""Evaluations for the tests of figures and reports: a short gauge measured by the virtual machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd

from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import Run, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import Recording, join_recordings

BLOCKS = 6
ALONG_Y, ALONG_X = (-0.001, 1.0, 0.0), (1.0, 0.2, 0.0)


@cache
def shipped() -> tuple[Gauge, Machine]:
    """The 420 mm gauge and the bridge CMM."""
    return read_gauge("step-gauge-420"), read_machine("bridge-cmm")


def lay(gauge: Gauge, axis: Sequence[float] = ALONG_Y, blocks: int = BLOCKS) -> Placement:
    """The gauge in the middle of the machine."""
    direction = np.asarray(axis) / np.linalg.norm(axis)
    start = np.array([150.0, 150.0, 200.0])
    length = gauge.block_centre_mm[blocks - 1] - gauge.block_centre_mm[0]
    return make_placement(start, start + direction * length, 1, blocks)


def run(cycles: int = 3, axis: tuple[float, ...] = ALONG_Y, blocks: int = BLOCKS, noise_um: float = 0.5) -> Run:
    """The virtual machine's run over the first blocks of the gauge; its table is the caller's own."""
    done = _run(cycles, axis, blocks, noise_um)
    return replace(done, recording=replace(done.recording, frame=done.recording.frame.copy()))


@cache
def _run(cycles: int, axis: tuple[float, ...], blocks: int, noise_um: float) -> Run:
    gauge, machine = shipped()
    machine = replace(machine, table=machine.table.model_copy(update={"repeatability_um": noise_um}))
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(gauge, 2.0))
    placement = lay(gauge, axis, blocks)
    program = make_program(placement, gauge, PlanOptions(1, blocks, cycles=cycles), settings)
    return run_program(program, machine, gauge, placement, seed=7)


@cache
def one_placement(cycles: int = 3) -> Evaluation:
    """All faces measured."""
    return evaluate(named(run(cycles).recording), shipped()[0])


@cache
def two_placements() -> Evaluation:
    """Along y and nearly along x, with another count of cycles."""
    joined = join_recordings([run(3).recording, run(2, ALONG_X).recording])
    return evaluate(named(joined), shipped()[0])


@cache
def with_gaps() -> Evaluation:
    """Faces 4 and 7 were not measured, face 9 only once."""
    frame: pd.DataFrame = run(3).recording.frame
    kept = ~frame["face"].isin([4, 7]) & ~((frame["face"] == 9) & (frame["cycle"] > 1))
    return evaluate(named(Recording(frame[kept], run(3).recording.comments)), shipped()[0])


def named(recording: Recording) -> Recording:
    """The recording as if it had been read from a file."""
    return Recording(recording.frame, recording.comments, "somewhere/deep/recording.csv")

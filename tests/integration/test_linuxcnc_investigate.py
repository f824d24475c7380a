"""A gauge that is laid anew while LinuxCNC is up, located and measured there: what an investigation needs of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.investigate_linuxcnc import (
    SERVO_PERIOD_NS,
    SPEED_MM_S,
    Hall,
    OnController,
    first_placement,
    knowing,
    machine_file,
)
from stepgauge.diagnosis.further_runs import FurtherRun
from stepgauge.executors.journal import open_steps
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.locating import LAID_MM
from stepgauge.investigation.running import CompletedRun, Runner
from stepgauge.live.controller import ControllerOptions
from stepgauge.recording import read_recording
from tests.integration.test_linuxcnc import pytestmark  # noqa: F401

SEED = 6
LATE_UM = SPEED_MM_S * SERVO_PERIOD_NS * 1e-6


def span_mm(made: CompletedRun) -> float:
    """From block 1 to the last one along the located gauge, mean of fronts and backs, as indicated."""
    recording = read_recording(made.path)
    along = recording.position_mm @ made.lies.axis
    face = recording.frame["face"].to_numpy()
    return float(along[face > 2].mean() - along[face <= 2].mean())


def test_a_squareness_in_hal_shows_along_the_diagonal_and_not_along_y(tmp_path: Path) -> None:
    """The difference of both spans: the gauge's own deviations are in both; each is off by one latch at most."""
    gauge, machine = read_gauge("step-gauge-420"), machine_file()
    first, ends = first_placement(gauge), (1, gauge.n_blocks)
    middle, half = (first.c1_mm + first.c2_mm) / 2.0, np.linalg.norm(first.c2_mm - first.c1_mm) / 2.0
    away = half * np.sqrt(0.5) * np.array([1.0, 1.0, 0.0])
    diagonal = make_placement(middle - away, middle + away, *ends)
    (hidden,) = Hall("squareness", SEED, tmp_path).truth
    with knowing("squareness", SEED, tmp_path / "controller") as pipe:
        pipe.recv()
        case = Case(gauge, machine)
        steps = open_steps(tmp_path / "cause", {}, False)
        runner = Runner(case, OnController("linuxcnc", machine, ControllerOptions(), None, pipe), steps, lambda _: True)
        along_y = runner.make(1, FurtherRun("along y", first, cycles=1, blocks=ends, wait_s=0.0, stays=True), first, 1)
        turned = runner.make(2, FurtherRun("diagonal", diagonal, cycles=1, blocks=ends), diagonal, 2)
        steps.close()
    assert along_y is not None
    assert turned is not None
    off_mm = turned.lies.c1_mm - diagonal.c1_mm
    assert 0.05 < np.abs(off_mm).max() < LAID_MM, "it was laid nearly as asked, and found where it lies"
    expected_um = hidden["urad"] * half * 1e-3
    assert abs(expected_um) > 2.0
    assert abs((span_mm(turned) - span_mm(along_y)) * 1e3 - expected_um) < 2.0 * LATE_UM

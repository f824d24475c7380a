"""Recordings with known effects in them, made by the virtual CMM, and their diagnoses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import stepgauge as sg
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.plan import PlanOptions, make_program, middle_standoff_mm
from stepgauge.recording import APPROACH, POSITION, Recording, join_recordings, write_recording

BLOCKS = 12
ALONG_X, ALONG_Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
PAUSE_S = 30.0
Effects = tuple[dict[str, Any], ...]

SCALE: Effects = ({"kind": "scale_error", "axis": "x", "ppm": 8.0},)
CYCLE: Effects = ({"kind": "temperature_cycle", "direction": "y", "amplitude_um": 1.0, "period_s": 300.0},)
GROWTH: Effects = ({"kind": "noise_growth", "per": "position", "rate": 5.0},)
OUTLIERS: Effects = ({"kind": "outliers", "rows": [5, 60], "um": 6.0},)


def gauge() -> Gauge:
    return read_gauge("step-gauge-420")


def machine(effects: Sequence[dict[str, Any]] = (), noise_um: float = 0.3) -> Machine:
    """The shipped bridge CMM with effects."""
    shipped = read_machine("bridge-cmm")
    table = shipped.table.model_copy(update={"repeatability_um": noise_um})
    return replace(shipped, table=table, effects=tuple(effects))


def record(
    on: Machine,
    axes: Sequence[Sequence[float]] = (ALONG_X, ALONG_Y),
    seed: int = 1,
    cycles: int = 5,
    order: str = "blocks",
    centres: Sequence[Sequence[float]] | None = None,
) -> Recording:
    """The first blocks of the gauge measured along each axis, one placement after the other, about their centres."""
    steps, runs, start = gauge(), [], 0.0
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(steps, 2.0))
    length = steps.block_centre_mm[BLOCKS - 1] - steps.block_centre_mm[0]
    for number, axis in enumerate(axes, 1):
        a = np.asarray(axis, float) / np.linalg.norm(axis)
        c1 = np.array((350.0, 600.0, 250.0) if centres is None else centres[number - 1]) - a * length / 2.0
        placement = make_placement(c1, c1 + a * length, 1, BLOCKS)
        program = make_program(placement, steps, PlanOptions(1, BLOCKS, cycles=cycles, order=order), settings)
        run = run_program(program, on, steps, placement, seed + 1000 * number, RunConditions(20.0, number, start))
        assert run.stop is None
        runs.append(run.recording)
        start += run.duration_s + PAUSE_S
    return join_recordings(runs) if len(runs) > 1 else runs[0]


def diagnose_probe_map(measured: Path, probe: Path, folder: Path, suffix: str = "png") -> Any:
    """The map of a probe against its file, written into a folder."""
    found = sg.diagnose(measured, probe=probe)
    found.write(folder, suffix)
    return found


@lru_cache
def made(name: str) -> tuple[Recording, GaugeDiagnosis]:
    """A recording by name with its diagnosis: made once, for a diagnosis takes a second."""
    effects, axes = {
        "null": ((), (ALONG_X, ALONG_Y)),
        "scale": (SCALE, (ALONG_X, ALONG_Y)),
        "scale, one placement": (SCALE, (ALONG_X,)),
        "pair": (SCALE + CYCLE, (ALONG_X, ALONG_Y)),
        "growth": (GROWTH, (ALONG_X, ALONG_Y)),
        "outliers": (OUTLIERS, (ALONG_X,)),
    }[name]
    recording = record(machine(effects), axes)
    return recording, diagnose(recording, gauge(), machine())


def made_unknown(name: str = "pair") -> tuple[Recording, GaugeDiagnosis]:
    """A diagnosis as if no effect had a name: the same structure, described by its form only."""
    recording, found = made(name)
    share_um = found.before_um - found.after_um
    forms = tuple(replace(one, share_um=share_um / len(found.located)) for one in found.located)
    return recording, replace(
        found, verdict="unknown", findings=(), unexplained=forms, after_um=found.before_um, placements={}
    )


def too_few() -> Recording:
    """Three blocks touched twice: six repeats do not say how large the noise is."""
    recording = record(machine(), [ALONG_X], cycles=2)
    return replace(recording, frame=recording.frame[recording.frame["face"] <= 6].reset_index(drop=True))


@lru_cache
def made_insufficient() -> tuple[Recording, GaugeDiagnosis]:
    """Too few repeats."""
    return too_few(), diagnose(too_few(), gauge(), machine())


def rms(values: Any) -> float:
    return float(np.sqrt((np.asarray(values) ** 2).mean()))


def as_file(folder: Path, recording: Recording, name: str = "recording") -> Path:
    """The recording written to a file."""
    path = folder / f"{name}.csv"
    write_recording(path, recording)
    return path


def by_hand(
    steps: Gauge,
    um: Callable[[pd.DataFrame], Any],
    axes: Sequence[Sequence[float]] = (ALONG_X,),
    cycles: int = 5,
    noise_um: float = 0.3,
    every_s: float = 5.0,
    seed: int = 1,
    **columns: Callable[[pd.DataFrame], Any],
) -> Recording:
    """A recording of a gauge written row by row: all faces in turn, a touch every so many seconds, nothing simulated.

    ``um``: displacement along the approach from the rows as they would be without it; ``columns``: further columns.
    The middle of every placement is at (350, 600, 250) mm.
    """
    rows, start = [], 0.0
    for number, direction in enumerate(axes, 1):
        axis = np.asarray(direction, float) / np.linalg.norm(direction)
        face = np.tile(np.arange(1, steps.n_faces + 1), cycles)
        sign = np.where(face % 2 == 1, 1.0, -1.0)
        along = steps.position_mm[face - 1] - steps.position_mm[-1] / 2.0 - sign * (2.0 - 0.003)
        frame = pd.DataFrame({"placement": number, "cycle": np.repeat(np.arange(1, cycles + 1), steps.n_faces)})
        frame["face"] = face
        frame[POSITION] = np.array([350.0, 600.0, 250.0]) + along[:, None] * axis
        frame[APPROACH] = sign[:, None] * axis
        frame["time_s"] = start + every_s * np.arange(len(frame))
        start = float(frame["time_s"].iloc[-1]) + PAUSE_S
        rows.append(frame)
    whole = pd.concat(rows, ignore_index=True)
    whole = whole.assign(**{name: values(whole) for name, values in columns.items()})
    scatter = np.random.default_rng(seed).normal(0.0, noise_um, len(whole))
    whole[POSITION] += whole[APPROACH].to_numpy() * ((um(whole) + scatter) * 1e-3)[:, None]
    return Recording(whole)


def side_of(frame: pd.DataFrame) -> Any:
    """+1 on fronts, -1 on backs."""
    return np.where(frame["face"] % 2 == 1, 1.0, -1.0)

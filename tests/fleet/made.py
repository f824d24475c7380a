"""A small fleet for tests: machines x gauges, a recording each, with a scale error by machine and a grown block."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.fleet.content import read_with_files
from stepgauge.fleet.store import Entry, Fleet
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.recording import Recording

MACHINES, GAUGES = ("M1", "M2", "M/3"), ("SG-A", "SG-B")
GAUGE = "step-gauge-420"


def make_recording(gauge: Gauge, seed: int = 0, cycles: int = 3, ppm: float = 0.0, **comments: str) -> Recording:
    """A recording along x with noise of 0.3 um and a scale error, tip radius 2 mm, pre-travel 3 um."""
    random = np.random.default_rng(seed)
    face = np.tile(np.arange(1, gauge.n_faces + 1), cycles)
    front, n = face % 2 == 1, len(face)
    along = gauge.position_mm[face - 1] * (1.0 + ppm * 1e-6) + np.where(front, -1.997, 1.997)
    frame = pd.DataFrame(
        {
            "placement": 1,
            "cycle": np.repeat(np.arange(1, cycles + 1), gauge.n_faces),
            "face": face,
            "x_mm": np.round(100.0 + along + random.normal(0.0, 3e-4, n), 7),
            "y_mm": np.round(300.0 + random.normal(0.0, 1e-4, n), 7),
            "z_mm": np.round(100.0 + random.normal(0.0, 1e-4, n), 7),
            "approach_i": np.where(front, 1.0, -1.0),
            "approach_j": 0.0,
            "approach_k": 0.0,
            "time_s": np.arange(n) * 3.0,
        }
    )
    return Recording(frame, {"tip_radius_mm": "2", **comments}, f"recording-{seed}.csv")


def make_entry(fleet: Fleet, number: int, cycles: int = 3) -> Entry:
    """The recording of that number: machine and gauge in turn, a month later each."""
    gauge, files = read_with_files(read_gauge, GAUGE)
    machine_files = read_with_files(read_machine, "bridge-cmm")[1]
    machine, serial = MACHINES[number % 3], GAUGES[number // 3 % 2]
    owners = {"machine": machine, "type": "T", "hall": f"H{number % 2}", "probe": None, "gauge": serial}
    return Entry(
        make_recording(gauge, number, cycles, ppm=number % 3),
        owners,
        datetime.datetime(2025, 1 + number % 12, 3, 10),
        fleet.keep("gauge", files),
        fleet.keep("machine", machine_files),
    )


def make_fleet(folder: Path, count: int = 6, cycles: int = 3) -> Fleet:
    """A store with that many recordings."""
    fleet = Fleet(folder, create=True)
    fleet.add([make_entry(fleet, number, cycles) for number in range(count)])
    return fleet

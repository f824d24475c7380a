"""Recordings of axes with known errors in them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from stepgauge.axis.recording import AxisRecording
from stepgauge.axis.units import AxisUnits

CYCLES = 5


def axis(
    targets: np.ndarray,
    law: object,
    noise: float = 0.3,
    units: tuple[str, str | None] = ("mm", None),
    sensor: str = "laser",
    both: bool = True,
    seed: int = 1,
) -> AxisRecording:
    """Targets there and back; ``law``: deviation by target and way, in units of deviation, as ``noise`` is."""
    told = AxisUnits.of(*units)
    there, ways = (np.r_[targets, targets[::-1]], (1, -1)) if both else (targets, (1,))
    target, way = np.tile(there, CYCLES), np.tile(np.repeat(ways, len(targets)), CYCLES)
    away = law(target, way) + np.random.default_rng(seed).normal(0.0, noise, len(target))  # type: ignore[operator]
    frame = pd.DataFrame(
        {
            "placement": 1,
            "cycle": np.repeat(np.arange(1, CYCLES + 1), len(there)),
            "way": way,
            "target": target,
            "reading": target + away / told.deviations_per_position,
        }
    )
    return AxisRecording(frame, "axis", told, sensor, {"artefact": "targets"}, "axis.csv")


def spot(law: object, noise: float, rows: int = 200, sensor: str = "dial", every_s: float = 10.0) -> AxisRecording:
    """One spot over time; ``law``: reading in mm by time in s, ``noise`` in mm."""
    time_s = every_s * np.arange(rows)
    reading = law(time_s) + np.random.default_rng(2).normal(0.0, noise, rows)  # type: ignore[operator]
    frame = pd.DataFrame({"placement": 1, "cycle": 1, "way": 1, "reading": reading, "time_s": time_s})
    return AxisRecording(frame, "spot", AxisUnits.of("mm"), sensor, {}, "spot.csv")


def distances(constant_mm: float, noise_mm: float, heights_m: float = 0.0, rows: int = 6) -> AxisRecording:
    """All pairs of seven stations in a line, both ways; ``heights_m``: rms of heights that nobody took off."""
    places = np.array([0.0, 20.0, 90.0, 250.0, 430.0, 640.0, 850.0])
    random = np.random.default_rng(3)
    height = random.normal(0.0, heights_m, len(places))
    pairs = [(a, b) for a in range(7) for b in range(7) if a != b for _ in range(rows)]
    flat = np.array([abs(places[b] - places[a]) for a, b in pairs])
    slope = np.hypot(flat, [height[b] - height[a] for a, b in pairs])
    reading = slope + (constant_mm + random.normal(0.0, noise_mm, len(pairs))) * 1e-3
    ends = {"from_station": [f"P{a}" for a, _ in pairs], "to_station": [f"P{b}" for _, b in pairs]}
    frame = pd.DataFrame({"placement": 1, "cycle": 1, "way": 1, **ends, "reading": reading})
    return AxisRecording(frame, "distances", AxisUnits.of("m"), "edm", {}, "distances.csv")

"""A virtual run of Ren's probe bench: the shipped 18 mm probe, pushed five times from each of twelve sides.

    python simulate.py series.csv
    stepgauge probe bench series.csv -o bench.csv --plot bench.png

The pre-travel of each side is that of the probe's mechanical model; hysteresis and scatter are those that the paper
reports (repeatability about 0.03 to 0.06 um), the noise of grating and laser is assumed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from stepgauge.files.tables import write_table
from stepgauge.physics import bench_simulator, directions
from stepgauge.physics.bench_simulator import DirectedProbe, PushBench
from stepgauge.probes import read_probe
from stepgauge.probes.files import SERIES

SIDES_DEG = np.arange(0.0, 360.0, 30.0)
PUSHES = 5
BENCH = PushBench(speed_mm_s=0.02, gap_mm=0.002, sample_interval_s=5e-4, grating_noise_um=0.002, laser_noise_um=0.002)


def main(path: Path, name: str = "ren-18mm") -> None:
    """Write the series of a shipped probe, or of a probe file."""
    probe = read_probe(name)
    normals = directions.unit_vectors(np.radians(SIDES_DEG), 0.0)
    on_bench = [
        DirectedProbe(pretravel_um=float(w), hysteresis_um=0.05, trigger_noise_um=0.015, zero_noise_um=0.01)
        for w in probe.pretravel_um(probe.approaches(normals))
    ]
    pushes = bench_simulator.simulate_directions(SIDES_DEG, on_bench, PUSHES, BENCH, np.random.default_rng(18))
    rows = [
        [side, number % PUSHES + 1, round(t, 5), round(rod, 7), round(tip, 7), int(contact), int(trigger)]
        for number, (side, push) in enumerate(pushes)
        for t, rod, tip, contact, trigger in zip(*(channel.tolist() for channel in push), strict=True)
    ]
    write_table(path, ["direction_deg", "push", *SERIES], rows)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "series.csv"))

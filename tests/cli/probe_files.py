"""Files for the probe verbs, made from known truths."""

import numpy as np

from stepgauge.physics import bench_simulator, directions
from stepgauge.physics.wozniak import LobeModel

SPHERE_MM, TIP_MM = 24.9981, 4.0
MODEL = LobeModel("kinematic", np.radians(20.0))
HEADER = "x_mm,y_mm,z_mm,approach_i,approach_j,approach_k"


def sphere_points(path, pattern, noise_um=0.0, axis=(0.0, 0.0, 1.0), diameter_mm=SPHERE_MM):
    """Recorded tip centres of a probe that lobes by Eq 4 with A = 5 um, on a sphere at (410, -220, 650)."""
    normals = pattern @ directions.probe_frame(axis)
    pretravel = MODEL.pretravel_um(pattern, 5.0) + np.random.default_rng(1).normal(0.0, noise_um, len(pattern))
    points = np.array([410.0, -220.0, 650.0]) + normals * ((diameter_mm + TIP_MM) / 2 - 1e-3 * pretravel)[:, None]
    np.savetxt(path, np.c_[points, -normals], delimiter=",", header=HEADER, comments="", fmt="%.9f")
    return path


def bench_series(path, pretravel_um, repeats=3):
    """Pushes of a probe with the given pre-travel at each direction, hysteresis 0.15 um."""
    device = bench_simulator.PushBench(sample_interval_s=5e-4, laser_noise_um=0.003)
    probes = [
        bench_simulator.DirectedProbe(w, hysteresis_um=0.15, trigger_noise_um=0.02) for w in pretravel_um.values()
    ]
    pushes = bench_simulator.simulate_directions(list(pretravel_um), probes, repeats, device, np.random.default_rng(2))
    lines = ["# push rod and laser", "direction_deg,push,time_s,rod_mm,tip_mm,contact,trigger"]
    for number, (direction, push) in enumerate(pushes):
        lines += [
            f"{direction},{number % repeats + 1},{t:.5f},{rod:.7f},{tip:.7f},{int(contact)},{int(trigger)}"
            for t, rod, tip, contact, trigger in zip(*push, strict=True)
        ]
    path.write_text("\n".join(lines) + "\n")
    return path

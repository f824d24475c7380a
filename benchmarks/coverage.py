"""Coverage of U: how often the truth lies within the expanded uncertainty that a budget states.

Every run draws what the budget assumes, by plain formulas and not by the virtual CMM or the Monte Carlo: errors of the
certificate by face, expansion and temperature of the gauge, what probing adds by face, repeatability, the rounding of a
display, a tilt of the gauge; and the temperature of scales that nobody corrects, which is an error of the machine as it
is. The truth is the evaluation of the same machine without any of these but its scales. U is stated for 95.45 %.

    python -m benchmarks.coverage --runs 300 --seed 1
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import stepgauge as sg
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.machine.file import Machine, StandardUncertainty, UncertaintyTable
from stepgauge.recording import APPROACH, POSITION, Recording

Array = NDArray[np.float64]
CYCLES, TIP_MM, BLOCKS = 3, 1.997, 6
OF_GAUGE = (1, 2, 10, 11, 20, 21)
"""Blocks of the shipped gauge that are measured: a gauge of so many, for the cost grows with their number."""
START_MM = np.array([100.0, 300.0, 200.0])
U_T_K, U_PROBING_UM, STEP_UM, U_TILT_RAD, NOISE_UM = 0.1, 0.2, 0.1, 300e-6, 0.4
WANTED = {"r_eff": (None,), "xf": (3, 11), "xb": (4, 12), "xm": (2, 11), "xr": (4, 10)}
"""Quantities and faces, near to the reference and far from it."""


def some_blocks(gauge: Gauge) -> Gauge:
    """A gauge of some of the blocks alone."""
    faces = np.array([face for block in OF_GAUGE for face in (2 * block - 2, 2 * block - 1)])
    columns = {name: getattr(gauge, name)[faces] for name in ("nominal_mm", "position_mm", "u_um")}
    return replace(gauge, **columns)


def stated(gauge: Gauge, machine: Machine) -> tuple[Machine, Placement]:
    """A machine file and a placement that state what the runs are drawn with."""
    table = UncertaintyTable(
        gauge_temperature_K=StandardUncertainty(u=U_T_K),
        probing_um=StandardUncertainty(u=U_PROBING_UM),
        resolution_um=STEP_UM,
    )
    length = gauge.block_centre_mm[BLOCKS - 1] - gauge.block_centre_mm[0]
    lies = make_placement(START_MM, START_MM + np.array([length, 0.0, 0.0]), 1, BLOCKS)
    urad = {"yaw_urad": U_TILT_RAD * 1e6, "pitch_urad": U_TILT_RAD * 1e6}
    return replace(machine, stated=table), replace(lies, details={"uncertainty": urad})


def recorded(gauge: Gauge, random: np.random.Generator | None, scales_ppm: float) -> Recording:
    """A recording along x; without ``random`` that of a perfect gauge at 20 deg C, read without scatter."""
    draw = random if random is not None else np.random.default_rng(0)
    sure = 0.0 if random is None else 1.0
    faces = np.tile(np.arange(1, 2 * BLOCKS + 1), CYCLES)
    warmer_K = sure * 1.5
    alpha = gauge.table.expansion_per_K + sure * gauge.table.expansion_uncertainty_per_K * draw.standard_normal()
    tilt = sure * U_TILT_RAD * draw.standard_normal(2)
    by_face = sure * gauge.u_um * 1e-3 * draw.standard_normal(gauge.n_faces)
    true = (gauge.position_mm + by_face) * (1.0 + alpha * (warmer_K + sure * U_T_K * draw.standard_normal()))
    true = true * (1.0 + (tilt**2).sum() / 2.0)
    probing = sure * U_PROBING_UM * 1e-3 * draw.standard_normal(gauge.n_faces)
    back = faces % 2 == 0
    along = true[faces - 1] + np.where(back, TIP_MM, -TIP_MM) + np.where(back, -1.0, 1.0) * probing[faces - 1]
    along = along * (1.0 + scales_ppm * 1e-6) + sure * NOISE_UM * 1e-3 * draw.standard_normal(len(faces))
    if random is not None:
        along = np.round(along / (STEP_UM * 1e-3)) * STEP_UM * 1e-3
    frame = pd.DataFrame({"placement": 1, "cycle": np.repeat(np.arange(1, CYCLES + 1), 2 * BLOCKS), "face": faces})
    frame[POSITION] = START_MM + np.outer(along, [1.0, 0.0, 0.0])
    frame[APPROACH] = np.outer(np.where(back, -1.0, 1.0), [1.0, 0.0, 0.0])
    frame["gauge_temperature_C"] = gauge.table.reference_temperature_C + warmer_K
    comments = {"machine": "Bridge CMM", "seed": "1", "temperature_convention": "as_read"}
    return Recording(frame, comments, "coverage.csv")


def coverage(runs: int, seed: int, u_scales_K: float = 0.0) -> dict[str, float]:
    """Share of runs in which the truth is within U, by quantity and face; scales off 20 deg C by ``u_scales_K``."""
    gauge = some_blocks(sg.read_gauge("step-gauge-420"))
    machine, placement = stated(gauge, sg.read_machine("bridge-cmm"))
    hits: Counter[str] = Counter()
    for run in range(runs):
        random = np.random.default_rng([seed, run])
        ppm = -machine.table.scale_expansion_per_K * 1e6 * u_scales_K * random.standard_normal()
        truth = sg.evaluate(recorded(gauge, None, ppm), gauge).results[0]
        found = sg.budget(recorded(gauge, random, ppm), gauge, machine, placements=placement, runs=0)
        for quantity, faces in WANTED.items():
            for face in faces:
                one = found.find(quantity, 1, face)
                assert one is not None
                true_um = getattr(truth, f"{quantity}_um")[face - 1] if face else truth.radius.r_eff_mm * 1e3
                hits[f"{quantity} {face or ''}".strip()] += abs(one.value_um - true_um) <= one.expanded_um
    return {name: count / runs for name, count in hits.items()}


def main() -> None:
    """Both kinds of scales, a row for each quantity."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    both = [coverage(asked.runs, asked.seed, u_K) for u_K in (0.0, 0.5)]
    print("quantity, face   as assumed   scales as they are (u = 0.5 K)")
    for name in both[0]:
        print(f"{name:16s} {both[0][name]:9.1%} {both[1][name]:12.1%}")


if __name__ == "__main__":
    main()

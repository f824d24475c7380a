"""True readings of the layouts: no two alike, so that none can stand for another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from stepgauge.gauge.certified import read_gauge

Row = Callable[[pd.Series], str]
NINE = tuple(float(t) for t in range(0, 401, 50))
PLACEMENT = """c1_mm = [120.0, 300.0, 200.0]
c2_mm = [520.0, 300.0, 200.0]
up = [0.0, 0.0, 1.0]
first_block = 1
last_block = 21
"""
ON_GAUGE = ("-g", "step-gauge-420", "-p", "@placement.toml")
BESIDE = {"placement.toml": PLACEMENT}


def positioning(targets: Sequence[float] = NINE, cycles: int = 2, ways: Sequence[int] = (1, -1)) -> pd.DataFrame:
    """Target mm, way, cycle and deviation um of an axis, in the order of travel."""
    rows = []
    for cycle in range(1, cycles + 1):
        for way in ways:
            for target in list(targets)[::way]:
                deviation = 0.0113 * target + 1.3 * way + 0.2 * cycle + 0.017 * (target / 50.0 % 3.0) + 0.5
                rows.append((target, way, cycle, round(deviation, 3)))
    return pd.DataFrame(rows, columns=["target", "way", "cycle", "deviation"]).assign(
        reading=lambda t: (t["target"] + t["deviation"] * 1e-3).round(7)
    )


def told(frame: pd.DataFrame) -> pd.DataFrame:
    """What is compared of a positioning test."""
    return frame[["target", "way", "cycle", "deviation"]]


def series(count: int = 40, step_s: float = 60.0, seed: int = 3) -> pd.DataFrame:
    """Readings mm at one spot and when they were taken."""
    random = np.random.default_rng(seed)
    time_s = np.arange(count) * step_s
    reading = 12.5 + 4e-3 * (1.0 - np.exp(-np.arange(count) / 15.0)) + 2e-4 * random.normal(size=count)
    return pd.DataFrame({"time_s": time_s, "reading": reading.round(6)})


def touches(count: int = 10, seed: int = 5, step: float = 0.0025) -> pd.DataFrame:
    """Readings mm of one place touched again and again, as a motor with whole steps gives them."""
    random = np.random.default_rng(seed)
    steps = random.integers(-2, 3, count)
    return pd.DataFrame({"reading": (2.5125 + step * steps).round(6)})


def probed(blocks: int = 4, cycles: int = 2, digits: int = 4, seed: int = 7) -> pd.DataFrame:
    """Tip centres on the faces of the shipped gauge, in block order: tip radius 2 mm less 3 um of pre-travel."""
    gauge = read_gauge("step-gauge-420")
    face = np.tile(np.arange(1, 2 * blocks + 1), cycles)
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    noise = 1e-3 * np.random.default_rng(seed).normal(size=len(face))
    origin = 120.0 - 0.5 * (gauge.position_mm[0] + gauge.position_mm[1])
    frame = pd.DataFrame({"placement": 1, "cycle": np.repeat(np.arange(1, cycles + 1), 2 * blocks), "face": face})
    frame["x_mm"] = (origin + gauge.position_mm[face - 1] - sign * 1.997 + noise).round(digits)
    return frame.assign(y_mm=300.0, z_mm=200.0)


def lines(frame: pd.DataFrame, row: Row) -> str:
    """A line per reading."""
    return "".join(row(one) + "\n" for _, one in frame.iterrows())


def comma(value: float, digits: int = 4) -> str:
    """A number with a decimal comma."""
    return f"{value:.{digits}f}".replace(".", ",")

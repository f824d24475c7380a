"""Visits of a small fleet for tests of the crossed inference: no readings, only what a recording is reduced to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from stepgauge.fleet.hierarchical.statistics import PlacementStatistics
from stepgauge.fleet.hierarchical.visits import Visit
from stepgauge.gauge.certified import Gauge, read_gauge

AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0])}
SIGMA_UM, COUNT = 0.3, 4.0
Wrong = Callable[[Gauge, str, str, str, float], np.ndarray]
"""Departures in um by face, from the gauge, its name, the machine, the axis and the day."""


@cache
def gauge() -> Gauge:
    return read_gauge("step-gauge-420")


def visit(rng: np.random.Generator, machine: str, name: str, axis: str, day: float, wrong: Wrong | None) -> Visit:
    """A visit with the scatter of four readings of a face, the certificate's errors of the gauge, and what is wrong."""
    own = gauge()
    certified = np.random.default_rng(sum(map(ord, name))).normal(0.0, own.u_um)
    um = rng.normal(0.0, SIGMA_UM / np.sqrt(COUNT), own.n_faces) + certified
    um = um + (0.0 if wrong is None else wrong(own, name, machine, axis, day))
    at_mm = np.array([100.0 + 7.0 * (day % 30), 150.0, 100.0]) + own.position_mm[:, None] * AXES[axis]
    faces = np.arange(1, own.n_faces + 1)
    placed = PlacementStatistics(
        1, faces, um, np.full(own.n_faces, COUNT), at_mm, AXES[axis], SIGMA_UM, 126.0, 0.0, 1.0, 20.0 + rng.normal()
    )
    number = int(machine[1:])
    return Visit(
        f"{machine}-{name}-{axis}-{day:g}", machine, f"T{number % 2}", "H1", name, f"P{number % 3}", day, placed
    )


def fleet(
    seed: int, pairs: Sequence[tuple[str, str]], wrong: Wrong | None = None
) -> tuple[list[Visit], dict[str, Gauge]]:
    """Every pair of a machine and a gauge along x and y, ten days after the pair before it."""
    rng = np.random.default_rng(seed)
    visits = [
        visit(rng, machine, name, axis, 20_000.0 + 10.0 * row, wrong)
        for row, (machine, name) in enumerate(pairs)
        for axis in AXES
    ]
    return visits, {one.gauge: gauge() for one in visits}


def crossed(machines: int, gauges: int, each: int) -> list[tuple[str, str]]:
    """Every machine with some gauges in turn."""
    return [(f"M{m}", f"G{(m + k) % gauges}") for k in range(each) for m in range(machines)]

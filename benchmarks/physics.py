"""How fast the probe's physics is, on one core: ``python benchmarks/physics.py``.

Rates depend on the machine; the ratio to one product with a 3 x 6 matrix over the same directions, the least that six
reactions can cost, does not depend on it much.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from stepgauge.physics import friction, trigger
from stepgauge.physics.directions import evenly_spread_points
from stepgauge.probes import read_probe

COUNT = 1_000_000


def seconds(work: Callable[[], object], repeats: int = 5) -> float:
    """The best of some runs."""
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return float(best)


def main() -> None:
    directions = evenly_spread_points(COUNT)
    probe = read_probe("omp40-2-50mm")
    approaches = probe.approaches(directions)
    matrix = np.random.default_rng(1).normal(size=(3, 6))
    few = directions[:: COUNT // 50_000]
    least = seconds(lambda: directions @ matrix) / COUNT
    for name, count, work in (
        ("trigger force, frictionless", COUNT, lambda: trigger.trigger_force_N(probe.tripod, directions)),
        ("trigger force and pre-travel of a probe", COUNT, lambda: probe.pretravel_um(approaches)),
        (
            "trigger force, friction in the seats",
            len(few),
            lambda: friction.trigger_force_N(probe.tripod, few, 0.1, 2.0),
        ),
    ):
        each = seconds(work) / count
        print(f"{name:<42}{1e-6 / each:8.2f} million directions/s, {each / least:8.1f} bare products")


if __name__ == "__main__":
    main()

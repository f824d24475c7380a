"""A virtual probe test bench: the signals of Ren's bench for a probe with known parameters.

The rod advances at constant speed, meets the tip, pushes it until the probe triggers, stops, dwells and
returns at the same speed. The tip follows the rod, reduced by the indentation of the contact, and comes to rest at the
distance ``hysteresis`` from its first position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.files.arrays import Array
from stepgauge.physics.bench import BenchStroke


@dataclass(frozen=True)
class PushBench:
    """The device: motion, sampling and noise.

    Parameters
    ----------
    speed_mm_s : of the rod, both ways
    deceleration_mm_s2 : of the rod after the trigger
    latency_s : from the trigger to the start of braking
    sample_interval_s : of all four channels
    gap_mm : rod travel from its zero to the tip at rest
    dwell_s : standstill before the return
    grating_noise_um, laser_noise_um : one sigma of a sample
    """

    speed_mm_s: float = 0.05
    deceleration_mm_s2: float = 5.0
    latency_s: float = 0.002
    sample_interval_s: float = 1e-4
    gap_mm: float = 0.005
    dwell_s: float = 0.02
    grating_noise_um: float = 0.0
    laser_noise_um: float = 0.0


@dataclass(frozen=True)
class DirectedProbe:
    """The probe in one direction.

    Parameters
    ----------
    pretravel_um : rod travel from first contact to trigger
    hysteresis_um : shift of the rest position of the tip after a push; positive away from the rod
    indentation_share : share of the rod travel that is indentation of the contact instead of motion of the tip
    trigger_noise_um, zero_noise_um : one sigma, from push to push, of the trigger and of the rest position of the tip
    """

    pretravel_um: float
    hysteresis_um: float = 0.0
    indentation_share: float = 0.0
    trigger_noise_um: float = 0.0
    zero_noise_um: float = 0.0


def simulate_push(probe: DirectedProbe, bench: PushBench, rng: np.random.Generator) -> BenchStroke:
    """One push and return of the rod.

    Raises ``ValueError`` where the probe could not trigger or the tip could not return: pre-travel, speed,
    deceleration and interval must be positive, and the hysteresis smaller than the travel at the stop.
    """
    _check(probe, bench)
    touch_mm = bench.gap_mm + 1e-3 * probe.zero_noise_um * rng.standard_normal()
    trigger_mm = touch_mm + 1e-3 * (probe.pretravel_um + probe.trigger_noise_um * rng.standard_normal())
    release_mm = touch_mm + 1e-3 * probe.hysteresis_um
    time, rod, stop = _motion(trigger_mm, bench)
    if release_mm >= rod[stop]:
        raise ValueError("the hysteresis is larger than the whole travel: the tip would not come back at all")
    share = 1.0 - probe.indentation_share
    going = np.arange(len(time)) <= stop
    touching = np.where(going, rod >= touch_mm, rod > release_mm)
    triggered = np.where(going, rod >= trigger_mm, rod > release_mm + share * (trigger_mm - touch_mm))
    tip = _tip(rod, going, touching, (touch_mm, release_mm), share)
    grating = 1e-3 * bench.grating_noise_um * rng.standard_normal(len(time))
    laser = 1e-3 * bench.laser_noise_um * rng.standard_normal(len(time))
    return BenchStroke(time, rod + grating, tip + laser, ~touching, ~triggered)


def simulate_directions(
    directions_deg: ArrayLike, probes: Sequence[DirectedProbe], repeats: int, bench: PushBench, rng: np.random.Generator
) -> list[tuple[float, BenchStroke]]:
    """``repeats`` pushes in each direction, (direction, push), one :class:`DirectedProbe` per direction."""
    pairs = zip(np.atleast_1d(np.asarray(directions_deg, dtype=float)), probes, strict=True)
    return [(float(angle), simulate_push(probe, bench, rng)) for angle, probe in pairs for _ in range(repeats)]


def _check(probe: DirectedProbe, bench: PushBench) -> None:
    positive = {
        "pretravel_um": probe.pretravel_um,
        "speed_mm_s": bench.speed_mm_s,
        "deceleration_mm_s2": bench.deceleration_mm_s2,
        "sample_interval_s": bench.sample_interval_s,
    }
    for name, value in positive.items():
        if not value > 0.0:
            raise ValueError(f"{name} must be positive, not {value}")
    if not 0.0 <= probe.indentation_share < 1.0:
        raise ValueError(f"indentation_share must lie in 0..1, not {probe.indentation_share}")


def _motion(trigger_mm: float, bench: PushBench) -> tuple[Array, Array, int]:
    """Sample times, rod positions and the index of the first sample at standstill."""
    speed, brake = bench.speed_mm_s, bench.deceleration_mm_s2
    brake_start = trigger_mm / speed + bench.latency_s
    stop = brake_start + speed / brake
    stop_mm = speed * brake_start + speed**2 / (2.0 * brake)
    leave = stop + bench.dwell_s
    time = np.arange(0.0, leave + stop_mm / speed, bench.sample_interval_s)
    braking = np.clip(time - brake_start, 0.0, speed / brake)
    forward = speed * np.minimum(time, brake_start) + speed * braking - brake * braking**2 / 2.0
    return time, forward - speed * np.maximum(time - leave, 0.0), int(np.searchsorted(time, stop))


def _tip(
    rod: Array, going: NDArray[np.bool_], touching: NDArray[np.bool_], ends_mm: tuple[float, float], share: float
) -> Array:
    """The tip: pushed by the rod, reduced by the indentation; at rest before the contact and after the release.

    The indentation grows with the force during the advance; on the return it is zero at the release, so that the tip
    moves on a straight line from its largest displacement to its rest position.
    """
    touch_mm, release_mm = ends_mm
    rest, far = release_mm - touch_mm, share * (rod[going][-1] - touch_mm)
    back = rest + (far - rest) * (rod - release_mm) / (rod[going][-1] - release_mm)
    pushed = np.where(going, share * (rod - touch_mm), back)
    return np.where(touching, pushed, np.where(going, 0.0, rest))

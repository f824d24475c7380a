"""Waves that are no sines: what an oscillation's overtones would read like.

A thermostat heats and cools in a sawtooth, a table of corrections without interpolation leaves one along the scale, a
relay switches a square wave. Their fundamentals pass for the oscillations of the vocabulary.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.residuals import Residuals
from stepgauge.effects import Effect, along_approach_um

Array = NDArray[np.float64]
PHASE, AXIS = "phase_deg", "axis"
"""Parameters that an oscillation has, by name: whether it has an axis depends on its kind."""
ORDERS = np.arange(2.0, 10.0)
OVERTONES = (2, 3, 5)
"""Orders that are looked for by themselves, whatever the wave."""
WAVES: dict[str, Callable[[Array], Array]] = {
    "a rising sawtooth": lambda order: (-1.0) ** (order + 1) / order,
    "a falling sawtooth": lambda order: 1.0 / order,
    "a square wave": lambda order: (order % 2) / order,
}
"""Amplitudes of the overtones, over the fundamental's and in step with it (the Fourier series of the waves)."""
SHIFTS = np.radians(np.linspace(-30.0, 30.0, 7))
"""By how much a wave may be ahead of its fitted fundamental in the middle of the recording, rad."""
DRIFTS = np.radians(np.linspace(-60.0, 60.0, 7))
"""And at its end, beyond that: the fundamental's period is not quite known either."""


def overtones(effect: Effect, period: str, data: Residuals) -> Iterator[tuple[str, Array]]:
    """Words and signatures ``(atoms, d, n)`` of what an oscillation may have beside its fundamental.

    ``period``: the name of the parameter that is its period or its frequency.
    """
    for order in OVERTONES:
        phases = [_overtone(effect, period, data, order, phase) for phase in (0.0, np.pi / 2.0)]
        yield f"an overtone of order {order}", np.concatenate(phases)[None]
    phase, turns_per_unit = _moved(effect, period, data)
    parts = np.array([_overtone(effect, period, data, order, order * phase, turns_per_unit) for order in ORDERS])
    for wave, amplitudes in WAVES.items():
        yield f"the shape of {wave}", np.tensordot(amplitudes(ORDERS), parts, 1)[:, None]


def _moved(effect: Effect, period: str, data: Residuals) -> tuple[Array, Array]:
    """Phases, rad, and changes of the frequency, ``(m, 1)``, of a fundamental moved by every shift with every drift."""
    along = _along(effect, period, data)
    shift, drift = np.array(list(product(SHIFTS, DRIFTS))).T[:, :, None]
    turns_per_unit = drift / (np.pi * np.ptp(along))
    middle = (along.max() + along.min()) / 2.0
    return np.radians(getattr(effect, PHASE)) + shift - 2.0 * np.pi * turns_per_unit * middle, turns_per_unit


def _along(effect: Effect, period: str, data: Residuals) -> Array:
    """The coordinate or the time with which the effect oscillates."""
    return data.probings.coordinate_mm(getattr(effect, AXIS)) if period == "period_mm" else data.probings.time_s


def _overtone(
    effect: Effect,
    period: str,
    data: Residuals,
    order: float,
    phase: Array | float,
    turns_per_unit: Array | float = 0.0,
) -> Array:
    """What an overtone with its fundamental's amplitude moves the readings by, um, ``(m, n)``; its phase in rad."""
    value = getattr(effect, period)
    frequency = order * ((value if period == "frequency_hz" else 1.0 / value) + turns_per_unit)
    changed = frequency if period == "frequency_hz" else 1.0 / frequency
    moved = along_approach_um(effect.model_copy(update={period: changed, PHASE: np.degrees(phase)}), data.probings)
    return np.atleast_2d(np.broadcast_to(moved, np.broadcast_shapes(np.shape(moved), (len(data),)))).astype(float)

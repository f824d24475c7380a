"""Resolution: the step of the readings as the data show it, whatever a file states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from stepgauge.conditions.condition import Condition
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.recording import POSITION, Recording

NOTABLE_UM = 0.5
"""Steps from which it is remarked: half of one is the largest error of a reading."""
STEPS_MM = tuple(sorted((m * 10.0**-n for n in range(7) for m in (1.0, 2.0, 5.0, 2.54, 1.27, 5.08)), reverse=True))
"""Steps of displays in mm, of those in inch too."""
SAMPLE = 20_000
LEAST_DIFFERENT, OF_ONE = 5, 8
"""Values that differ, from which their common step is no chance; fewer, where so many readings share each of them."""


def step_of(values: Array) -> float:
    """The coarsest step of :data:`STEPS_MM` that all values are whole multiples of, in their unit (mm); 0 where there
    is none or too few differ. ``values (n,)``."""
    some = np.unique(values[:: max(1, len(values) // SAMPLE)])
    if len(some) < 2 or (len(some) < LEAST_DIFFERENT and len(values) < OF_ONE * len(some)):
        return 0.0
    apart = np.diff(some)
    nearest = float(apart[apart > 1e-9].min(initial=np.inf))
    for step in STEPS_MM:
        if step > 1.01 * nearest:
            continue
        count = (some - some[0]) / step
        if (np.abs(count - np.round(count)) * step < 6e-8 + 1e-6 * step).all():
            return float(step)
    return 0.0


def resolution_um(position: Sequence[Array], axis: Array) -> float:
    """Step of a reading along the gauge, um: of every coordinate by its share; ``position``: x, y and z, ``(n,)``."""
    shares = [float(share) * step_of(values) for share, values in zip(axis, position, strict=True) if abs(share) > 0.1]
    return 1e3 * float(np.linalg.norm(shares))


def resolution_conditions(recording: Recording, axis: Array) -> Iterator[Condition]:
    """The step of the readings, where it may matter."""
    step = resolution_um(recording.numbers(POSITION), axis)
    found = f"{rounded(step, 3)} um"
    if step < NOTABLE_UM:
        yield Condition("resolution", "met", "the readings have no coarse step", found if step else "", "", step / 2.0)
        return
    words = f"the readings have steps of {found}: each is rounded by up to {rounded(step / 2.0, 3)} um"
    yield Condition("resolution", "contribution", words, found, f"below {NOTABLE_UM:g} um", step / 2.0)

"""The conditions of a drift test: displacements and temperatures over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from stepgauge.conditions.condition import Condition, Conditions
from stepgauge.conditions.resolution import step_of
from stepgauge.conditions.series import copied_block, named_rows, plateau, spikes, thermometer_conditions, twins
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded

SMALLEST_UM, LARGEST_UM = 0.1, 2000.0
"""Range of a displacement in a drift test: no machine is stiller in hours, and no such sensor reaches farther."""
FINEST_UM, OF_FINEST_UM = 1e-3, 1.0
"""A step below a nanometre and a range below a micrometre are those of millimetres."""
MOST_SPIKES = 0.02
OF_RANGE = 0.05
"""A step beyond this share of a range is remarked: the range is wrong by as much as a step."""
JUMP_SHARE, JUMP_TIMES = 0.3, 30.0
"""A change from one reading to the next that is so much of the whole range, and so many times the usual one."""


def channel_conditions(displacement_um: Mapping[str, Array], temperature_C: Mapping[str, Array]) -> Conditions:
    """What was found of the channels of a drift test: names to arrays of the same shape ``(n,)``."""
    found = [one for name, um in displacement_um.items() for one in _channel(name, um)]
    pair = twins(displacement_um)
    if pair is not None:
        words = f"displacements {pair[0]} and {pair[1]} have the same readings: one is a copy of the other"
        found.append(Condition("duplicates", "prevents", words, " and ".join(pair), "a sensor for each"))
    every = np.column_stack([*displacement_um.values(), *temperature_C.values()])
    copy = copied_block(every)
    if copy is not None:
        words = f"rows {copy[0] + 1} to {copy[1] + 1} and on repeat those from row {copy[2] + 1}: they were copied"
        found.append(Condition("duplicates", "prevents", words, f"row {copy[0] + 1}", "every reading once"))
    return Conditions((*found, *thermometer_conditions(temperature_C)))


def _channel(name: str, um: Array) -> Iterator[Condition]:
    span, step = float(np.ptp(um)), 1e3 * step_of(um * 1e-3)
    if span < SMALLEST_UM or (0.0 < step < FINEST_UM and span < OF_FINEST_UM):
        found = f"a range of {rounded(span, 3)} um"
        words = f"displacement {name} has {found}: no machine stands so still; millimetres, or no sensor?"
        yield Condition("units", "prevents", words, found, f"{SMALLEST_UM:g} um or more")
        return
    if span > LARGEST_UM:
        found = f"a range of {rounded(span, 4)} um"
        words = f"displacement {name} has {found}: another unit, or a reading of a sensor that failed"
        yield Condition("units", "prevents", words, found, f"{LARGEST_UM:g} um at most", span)
        return
    stuck = plateau(um)
    if stuck is not None:
        rows = f"rows {stuck[0] + 1} to {stuck[1] + 1}"
        words = f"displacement {name} is stuck at {um[stuck[0]]:g} um in {rows}: frozen or saturated"
        yield Condition("channel", "prevents", words, rows, "a reading that changes")
    yield from _jumps(name, um, span)
    if step > OF_RANGE * span:
        words = f"displacement {name} has steps of {rounded(step, 3)} um in a range of {rounded(span, 3)} um"
        yield Condition("resolution", "contribution", words, f"{rounded(step, 3)} um", "finer steps", step)


def _jumps(name: str, um: Array, span: float) -> Iterator[Condition]:
    """Single readings that stand out, and a step between two stretches of the test."""
    rows, off = spikes(um)
    if 0 < rows.size <= max(2.0, MOST_SPIKES * len(um)):
        words = f"displacement {name}: readings that stand out: {named_rows(rows, off)}; they are in its range"
        yield Condition("outliers", "contribution", words, size_um=float(np.abs(off).max()))
        return
    change = np.abs(np.diff(um))
    at = int(change.argmax())
    if change[at] > JUMP_SHARE * span and change[at] > JUMP_TIMES * float(np.median(change)):
        size = float(change[at])
        words = f"displacement {name} jumps by {rounded(size, 3)} um from row {at + 1} to the next: it is in its range"
        yield Condition("channel", "contribution", words, size_um=size)

"""What a column of numbers gives away of itself: stuck or saturated, copied from another, no temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.condition import Condition, Conditions
from stepgauge.conditions.resolution import step_of
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.physics.robust import mad_sigma
from stepgauge.recording.temperatures import no_temperature

BY_CHANCE = 1e-6
"""Probability of a plateau or a copy by chance, from which it is one."""
LEAST_COPIED = 8
"""Values in a row that are those of another place before they are a copy."""
AWAY_K = 3.0
"""From one reading to the next and back again no thermometer in a room changes by this."""


def plateau(values: Array) -> tuple[int, int] | None:
    """First and last index of the longest row of equal values that is too long for chance; None where there is none.

    How often a value repeats the one before by chance is taken from the values outside that row; a display of coarse
    steps repeats often.
    """
    same = np.diff(values) == 0.0
    if len(values) < LEAST_COPIED or not same.any():
        return None
    edge = np.flatnonzero(np.diff(np.r_[False, same, False]))
    starts, ends = edge[::2], edge[1::2]
    longest = int((ends - starts).argmax())
    first, last = int(starts[longest]), int(ends[longest])
    rest = len(same) - (last - first)
    if rest < 3:
        return (first, last) if last - first >= LEAST_COPIED else None
    share = (same.sum() - (last - first) + 1.0) / (rest + 2.0)
    by_chance = float(share ** (last - first)) * len(values)
    return (first, last) if by_chance < BY_CHANCE and last - first >= 4 else None


def copied_block(rows: Array) -> tuple[int, int, int] | None:
    """First and last row ``(n, k)`` that repeat earlier ones in order, and the first of those; None without a copy."""
    _, name, uses = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    before: dict[int, int] = {}
    length, at = 0, -2
    for row, one in enumerate(np.ravel(name).tolist()):
        earlier = before.get(one, -2)
        follows = earlier == at + 1 and earlier >= 0 and uses[one] < len(rows) / 4
        length, at = (length + 1, earlier) if follows else (int(earlier >= 0), earlier)
        if length >= LEAST_COPIED and (np.ptp(rows[row - length + 1 : row + 1], axis=0) > 0.0).any():
            return row - length + 1, row, earlier - length + 1
        before[one] = row
    return None


def twins(columns: Mapping[str, Array]) -> tuple[str, str] | None:
    """Two columns with the same values throughout, or the same with the sign turned; None where all differ."""
    names = [name for name, values in columns.items() if len(np.unique(values)) >= LEAST_COPIED]
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            if np.array_equal(columns[one], columns[other]) or np.array_equal(columns[one], -columns[other]):
                return one, other
    return None


def thermometer_conditions(temperatures_C: Mapping[str, Array]) -> Iterator[Condition]:
    """Temperatures that are none, that jump, or that are stuck."""
    for name, values in temperatures_C.items():
        wrong = no_temperature(values, np.ones(len(values), np.int64))
        if wrong is not None:
            words = f"temperature {name}, row {wrong.row + 1}: {wrong.why}: {wrong.found}"
            yield Condition("temperature", "prevents", words, wrong.found, wrong.expected)
            continue
        step = np.abs(np.diff(values))
        away = np.flatnonzero(step > AWAY_K)
        if away.size:
            at = int(away[0])
            found = f"{values[at]:g} and {values[at + 1]:g} deg C"
            words = f"temperature {name} jumps from row {at + 1} to the next: {found}"
            yield Condition("temperature", "prevents", words, found, f"a change below {AWAY_K:g} K")
        stuck = plateau(values)
        if stuck is not None:
            words = (
                f"temperature {name} is stuck at {values[stuck[0]]:g} deg C in rows {stuck[0] + 1} to {stuck[1] + 1}"
            )
            yield Condition(
                "temperature", "contribution", words, f"{values[stuck[0]]:g} deg C", "a reading that changes"
            )


def spikes(values: Array, times: float = 8.0) -> tuple[NDArray[np.intp], Array]:
    """Rows of a smooth series that leave those before and after and come back, and by how much, ``(m,)``.

    Every value is set against the line between those beside it; the scatter is the median of all.
    """
    if len(values) < 5:
        return np.zeros(0, np.intp), np.zeros(0)
    off = np.r_[values[0] - 2.0 * values[1] + values[2], values[1:-1] - (values[:-2] + values[2:]) / 2.0]
    off = np.r_[off, values[-1] - 2.0 * values[-2] + values[-3]]
    weight = np.r_[np.sqrt(6.0), np.full(len(values) - 2, np.sqrt(1.5)), np.sqrt(6.0)]
    scatter = mad_sigma(off / weight)
    size = np.abs(off) / weight
    peak = (size >= np.r_[0.0, size[:-1]]) & (size >= np.r_[size[1:], 0.0])
    limit = max(times * scatter, 1.6e3 * step_of(values * 1e-3))
    found = peak & (size > limit)
    for end, inner, *others in ((0, 1, 2, 3), (-1, -2, -3, -4)):
        if found[end] or found[inner]:  # one of both makes the other stand out
            fits = abs(values[inner] - 2.0 * values[others[0]] + values[others[1]]) <= np.sqrt(6.0) * limit
            found[end], found[inner] = fits, not fits
    rows = np.flatnonzero(found)
    return rows, off[rows]


def named_rows(rows: NDArray[np.intp], um: Array) -> str:
    """``row 12 (+50 um), row 40 (-3 um)`` and how many more."""
    shown = ", ".join(
        f"row {row + 1} ({rounded(float(off), 3, plus=True)} um)" for row, off in zip(rows[:5], um[:5], strict=True)
    )
    return shown + (f" and {len(rows) - 5} more" if len(rows) > 5 else "")


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

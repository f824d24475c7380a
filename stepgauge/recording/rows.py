"""Single rows that cannot be readings: beside the gauge, no temperature or time of that moment, or there twice.

The limits follow from the gauge and from the other rows of the same placement; ``docs/readings.md`` says how.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array, Rows
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.columns import OPTIONAL
from stepgauge.recording.face_readings import PIECE
from stepgauge.recording.table import Recording

JUMP_K = 1.0
"""A gauge or a scale does not change by this from one probing to the next and back again."""
SAMPLE = 10_000
"""Rows that the direction of the readings is taken from."""
FEW = 0.02
"""Share of rows up to which they are slips: what happens more often is how it was measured."""


def dot(columns: Sequence[Array], vector: Array) -> Array:
    """Sum of three columns times their shares, in pieces that stay in the cache: on large tables memory is the cost."""
    total = np.empty(len(columns[0]))
    for first in range(0, len(total), PIECE):
        part = slice(first, first + PIECE)
        total[part] = columns[0][part] * vector[0]
        for column, share in zip(columns[1:], vector[1:], strict=True):
            total[part] += column[part] * share
    return total


def check_beside(columns: Sequence[Array], axis: Array, face: Rows, gauge: Gauge, path: str) -> None:
    """Across the gauge, every reading must lie on the face that it names.

    The readings of a placement lie about one line; a face is as wide and as high as the block, so none may be farther
    from that line than the diagonal of the face. ``columns``: x, y and z, each ``(n,)``.
    """
    limit = float(np.hypot(gauge.table.block_width_mm, gauge.table.block_height_mm))
    across = np.linalg.svd(axis[None, :])[2][1:]
    for direction in across:
        value = dot(columns, direction)
        if np.ptp(value) <= limit:
            continue
        off = value - _line(value, face, gauge, limit)
        if max(off.max(), -off.min()) > limit:
            row = int(np.abs(off).argmax())
            raise InputError(
                path,
                f"probing {row + 1} of face {face[row]} lies beside the gauge",
                found=f"{abs(off[row]):.3f} mm from the line of the other readings, across the gauge",
                expected=f"within {limit:.1f} mm, the diagonal of a block of {gauge.table.name}",
            )


def _line(value: Array, face: Rows, gauge: Gauge, limit: float) -> Array:
    """The straight line along the gauge that a coordinate across it follows, at every row; one wild row does not bend
    it (medians of faces, and of the slopes between them, Theil and Sen)."""
    count = np.bincount(face)
    seen = np.flatnonzero(count)
    level = np.bincount(face, value)[seen] / count[seen]
    at = gauge.position_mm[seen - 1]
    slope, start = _theil_sen(at, level)
    line = start + slope * gauge.position_mm
    off = value - line[face - 1]
    if max(off.max(), -off.min()) > limit:
        level = np.array([np.median(value[face == one]) for one in seen])
        slope, start = _theil_sen(at, level)
        line = start + slope * gauge.position_mm
    return np.asarray(line[face - 1])


def _theil_sen(x: Array, y: Array) -> tuple[float, float]:
    if len(x) < 2:
        return 0.0, float(np.median(y))
    i, j = np.triu_indices(len(x), 1)
    slope = float(np.median((y[j] - y[i]) / (x[j] - x[i])))
    return slope, float(np.median(y - slope * x))


def tilt_rad(columns: Sequence[Array], axis: Array, face: Rows, gauge: Gauge) -> float:
    """Angle between the gauge axis that is used and the line that the readings follow, rad.

    A program probes where the gauge was found to lie, so both are one; where they are not, lengths are short by the
    cosine. 0 for a single face. A sample of the rows of a long recording is enough.
    """
    part = slice(None, None, max(1, len(face) // SAMPLE))
    face, columns = face[part], [column[part] for column in columns]
    count = np.bincount(face)
    seen = np.flatnonzero(count)
    if len(seen) < 2:
        return 0.0
    slopes = []
    for direction in np.linalg.svd(axis[None, :])[2][1:]:
        level = np.bincount(face, dot(columns, direction))[seen] / count[seen]
        slopes.append(np.polyfit(gauge.position_mm[seen - 1], level, 1)[0])
    return float(np.hypot(*slopes))


def check_rows(recording: Recording) -> None:
    """Temperatures and times of one placement: none may leave those before and after it and come back."""
    columns = recording.columns
    for name in OPTIONAL:
        if name.endswith("_C") and name in columns:
            _check_temperature(columns[name].astype(float, copy=False), name, recording.path)
    if "time_s" in columns:
        _check_time(columns["time_s"].astype(float, copy=False), recording.path)


def _check_temperature(value: Array, name: str, path: str) -> None:
    if len(value) < 4 or np.ptp(value) <= JUMP_K or not (np.abs(np.diff(value)) > JUMP_K).any():
        return
    before, after = np.r_[value[1], value[:-1]], np.r_[value[1:], value[-2]]
    before[0], after[-1] = value[2], value[-3]
    away = (np.abs(value - before) > JUMP_K) & (np.abs(value - after) > JUMP_K)
    alone = away & (np.abs(after - before) < 0.5 * np.minimum(np.abs(value - before), np.abs(value - after)))
    rows = np.flatnonzero(alone)
    if rows.size and rows.size <= max(1.0, FEW * len(value)):
        row = int(rows[0])
        raise InputError(
            path,
            f"column {name} of probing {row + 1} leaves the temperatures before and after it and comes back",
            found=f"{value[row]:g} deg C between {before[row]:g} and {after[row]:g}",
            expected=f"a change of less than {JUMP_K:g} K from one probing to the next",
        )


def _check_time(value: Array, path: str) -> None:
    """In a file whose times rise, one that lies before the row before it, or after the row after it, is a slip."""
    if len(value) < 4 or (value[1:] >= value[:-1]).all():
        return
    before, here, after = value[:-2], value[1:-1], value[2:]
    alone = (before <= after) & ((here < before) | (here > after))
    rows = np.flatnonzero(alone) + 1
    if rows.size and rows.size <= max(1.0, FEW * len(value)):
        row = int(rows[0])
        raise InputError(
            path,
            f"column time_s of probing {row + 1} is out of order",
            found=f"{value[row]:g} between {value[row - 1]:g} and {value[row + 1]:g} s",
            expected="times that rise, or a clock that starts anew and goes on from there",
        )


def check_copies(recording: Recording) -> None:
    """No row and no placement may be there twice: that is no second measurement."""
    _check_placements(recording)
    twice = _taken_twice(recording)
    if not twice.any():
        return
    same = recording.frame[twice].duplicated()
    if same.any():
        first = recording.frame[twice][same].iloc[0]
        raise InputError(
            recording.path,
            f"face {first['face']:.0f} was probed twice in cycle {first['cycle']:.0f} of placement"
            f" {first['placement']:.0f}, with the same result to the last digit",
            found=f"{int(same.sum())} rows that repeat another one",
            expected="every reading once",
        )


def check_seeds(recordings: Sequence[Recording]) -> None:
    """No two recordings that were simulated may have the same seed.

    Their scatter is then the same, number by number, and no scatter to anything that looks at both.
    """
    made: dict[str, str] = {}
    for one in recordings:
        for seed in filter(None, one.comments.get("seed", "").split("; ")):
            if seed in made:
                raise InputError(
                    one.path,
                    f"simulated with the same seed as {made[seed]}: both have the same scatter, number by number",
                    found=f"# seed: {seed}",
                    expected=naming("seed", words="recordings that were simulated each with a {} of its own"),
                )
        made |= dict.fromkeys(one.comments.get("seed", "").split("; "), one.path)


def _taken_twice(recording: Recording) -> NDArray[np.bool_]:
    """Rows that share placement, cycle and face with another one, (n,); counted, for that is faster than sorting."""
    keys = [recording.columns[name] for name in ("placement", "cycle", "face")]
    slots = [int(key.max()) + 1 for key in keys]
    if math.prod(slots) > 20 * len(recording) + 1e6:  # counts far apart: too many slots to count in
        return recording.frame.duplicated(["placement", "cycle", "face"], keep=False).to_numpy()
    slot = keys[0] * slots[1]
    slot += keys[1]
    slot *= slots[2]
    slot += keys[2]
    if (slot[1:] > slot[:-1]).all() or (count := np.bincount(slot)).max() < 2:
        return np.zeros(len(slot), np.bool_)
    return count[slot] > 1


def _check_placements(recording: Recording) -> None:
    """No two placements may have the very same readings: one file given twice is no second measurement."""
    numbers = recording.placements
    if len(numbers) < 2:
        return
    seen: dict[bytes, int] = {}
    for number in numbers:
        part = recording.select_placement(number)
        if len(part) < 2:
            continue
        first = seen.setdefault(part.position_mm.tobytes(), number)
        if first != number:
            raise InputError(
                recording.path,
                f"placement {number} repeats the readings of placement {first}",
                found="the same coordinates to the last digit",
                expected="a recording of its own for every placement",
            )

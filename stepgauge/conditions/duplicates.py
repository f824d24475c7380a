"""Cycles that repeat an earlier one in every reading: copied, or simulated without scatter. They tell nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepgauge.files.arrays import Array, Rows
from stepgauge.files.notation import plural

FEWEST = 8
"""Readings of a cycle from which it is no copy by chance, even on the steps of a display."""
SHOWN = 8
"""Cycles that are told by their numbers."""


def copied_cycles(placement: Rows, cycle: Rows, position: Sequence[Array]) -> list[tuple[int, int]]:
    """Placements and cycles whose readings are all those of an earlier cycle, in the same order.

    ``placement``, ``cycle`` and each coordinate of ``position``: ``(n,)``, in the order of the recording.
    """
    first = np.flatnonzero(np.r_[True, (np.diff(cycle) != 0) | (np.diff(placement) != 0)])
    end = np.r_[first[1:], len(cycle)]
    long = end - first >= FEWEST
    seen: set[tuple[bytes, ...]] = set()
    found = []
    for start, stop in zip(first[long].tolist(), end[long].tolist(), strict=True):
        readings = tuple(one[start:stop].tobytes() for one in position)
        if readings in seen:
            found.append((int(placement[start]), int(cycle[start])))
        seen.add(readings)
    return found


def copies_words(cycles: Sequence[int]) -> str:
    """The cycles that are copies, in words."""
    numbers = [*map(str, cycles[:SHOWN]), *([f"{len(cycles) - SHOWN} more"] if len(cycles) > SHOWN else [])]
    last = f" and {numbers[-1]}" if len(numbers) > 1 else ""
    return f"{plural('cycle', len(cycles))} {', '.join(numbers[:-1] or numbers)}{last}"

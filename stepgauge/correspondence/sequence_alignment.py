"""Two sequences brought side by side: what of the one is missing in the other, and what is there too much.

E. W. Myers, "An O(ND) difference algorithm and its variations", Algorithmica 1 (1986) 251-266, the greedy algorithm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

MOST_EDITS = 400
"""More differences than this, beside that in length, are another sequence; the cost grows with their square."""
MOST_LENGTH = 3000
"""Largest difference in length that is aligned, apart from what is alike at both ends."""


def align(expected: Sequence[int], found: Sequence[int], most: int = MOST_EDITS) -> NDArray[np.int64] | None:
    """Pairs (index in ``expected``, index in ``found``) of equal entries, rising in both, as many as there can be.

    Shape ``(pairs, 2)``; None where more than ``most`` entries, beside the difference in length, would have to be left
    out or put in.
    """
    head = _alike(expected, found)
    tail = _alike(expected[head:][::-1], found[head:][::-1])
    middle = _align(expected[head : len(expected) - tail], found[head : len(found) - tail], most)
    if middle is None:
        return None
    ends = (np.arange(tail) - tail)[:, None] + [len(expected), len(found)]
    return np.concatenate([np.repeat(np.arange(head), 2).reshape(-1, 2), middle + head, ends]).astype(np.int64)


def _alike(one: Sequence[int], other: Sequence[int]) -> int:
    """How many entries two sequences have in common from their first on."""
    return next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


def _align(expected: Sequence[int], found: Sequence[int], most: int) -> NDArray[np.int64] | None:
    if not expected or not found:
        return np.empty((0, 2), dtype=np.int64)
    most += min(abs(len(expected) - len(found)), MOST_LENGTH)
    reach: dict[int, int] = {1: 0}
    history: list[dict[int, int]] = []
    for edits in range(min(len(expected) + len(found), most) + 1):
        for diagonal in range(-edits, edits + 1, 2):
            i = _step(reach, diagonal, edits)
            j = i - diagonal
            while i < len(expected) and j < len(found) and expected[i] == found[j]:
                i, j = i + 1, j + 1
            reach[diagonal] = i
            if i >= len(expected) and j >= len(found):
                return _pairs(len(expected), len(found), [*history, dict(reach)])
        history.append(dict(reach))
    return None


def _step(reach: dict[int, int], diagonal: int, edits: int) -> int:
    """How far in ``expected`` a diagonal begins: by an entry too much in ``found``, or by one that is missing there."""
    extra, missing = reach.get(diagonal + 1, -1), reach.get(diagonal - 1, -1)
    if diagonal == -edits or (diagonal != edits and missing < extra):
        return extra
    return missing + 1


def _pairs(i: int, j: int, history: list[dict[int, int]]) -> NDArray[np.int64]:
    pairs: list[tuple[int, int]] = []
    for edits in range(len(history) - 1, -1, -1):
        before = history[edits - 1] if edits else {1: 0}
        diagonal = i - j
        start = _step(before, diagonal, edits)
        while i > start and j > start - diagonal:
            i, j = i - 1, j - 1
            pairs.append((i, j))
        if edits:
            came_from_extra = diagonal == -edits or (
                diagonal != edits and before.get(diagonal - 1, -1) < before.get(diagonal + 1, -1)
            )
            i, j = (i, j - 1) if came_from_extra else (i - 1, j)
    return np.array(pairs[::-1], dtype=np.int64).reshape(-1, 2)

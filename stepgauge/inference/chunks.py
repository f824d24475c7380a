"""Work on large arrays in parts."""

from __future__ import annotations

from collections.abc import Iterator

CHUNK = 50_000
"""Numbers processed at a time: they stay in the cache of a processor, and in the memory that the process has."""


def chunks(count: int, of_one: int) -> Iterator[slice]:
    """Parts of ``count`` items of so many numbers each, to be worked on one after the other."""
    size = max(1, CHUNK // of_one)
    return (slice(first, first + size) for first in range(0, count, size))

"""Work on large arrays, shared out among the cores: products and functions of arrays do not wait for one another."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
MOST_THREADS = 4
"""What is between the products keeps one core busy however many there are."""
CHUNK = 200_000
"""Numbers processed at a time: they stay in the cache of a processor."""


def each(work: Callable[[Item], Result], items: Collection[Item]) -> list[Result]:
    """The results of ``work`` for some items, in their order."""
    threads = min(MOST_THREADS, os.cpu_count() or 1, len(items))
    if threads < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))


def chunks(count: int, of_one: int) -> Iterator[slice]:
    """Parts of ``count`` items of so many numbers each, to be worked on one after the other."""
    size = max(1, CHUNK // of_one)
    return (slice(first, first + size) for first in range(0, count, size))

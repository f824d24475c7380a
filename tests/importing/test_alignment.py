"""The alignment against a longest common subsequence by dynamic programming, and single edits found again."""

from __future__ import annotations

import time

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.correspondence.sequence_alignment import align

words = st.lists(st.integers(1, 5), max_size=14)


def longest_common(one: list[int], other: list[int]) -> int:
    """Length of the longest common subsequence, by the table of Wagner and Fischer."""
    table = np.zeros((len(one) + 1, len(other) + 1), int)
    for i, a in enumerate(one):
        for j, b in enumerate(other):
            table[i + 1, j + 1] = table[i, j] + 1 if a == b else max(table[i, j + 1], table[i + 1, j])
    return int(table[-1, -1])


@settings(max_examples=30)
@given(words, words)
def test_as_many_pairs_as_there_can_be_all_equal_and_in_order(one: list[int], other: list[int]) -> None:
    pairs = align(one, other)
    assert pairs is not None
    assert len(pairs) == longest_common(one, other)
    assert all(one[i] == other[j] for i, j in pairs)
    assert (np.diff(pairs, axis=0) > 0).all()


@settings(max_examples=30)
@given(st.integers(2, 30), st.data())
def test_a_row_that_is_taken_out_is_the_one_left_over(n: int, data: st.DataObject) -> None:
    gone = data.draw(st.integers(0, n - 1))
    whole = list(range(n))
    pairs = align(whole, whole[:gone] + whole[gone + 1 :])
    assert pairs is not None
    assert set(whole) - set(pairs[:, 0].tolist()) == {gone}


def test_strangers_are_given_up_soon_and_long_logs_are_quick() -> None:
    assert align([1] * 5000, [2] * 5000) is None
    long = list(range(42)) * 2500
    began = time.process_time()
    pairs = align(long, long[:50] + long[51:70_000] + long[70_003:])
    assert time.process_time() - began < 5.0
    assert pairs is not None
    assert len(pairs) == len(long) - 4
    for part in (long[:30_000], long[40_000:]):  # a log that was cut, at either end
        pairs = align(long, part)
        assert pairs is not None
        assert len(pairs) == len(part)
    pairs = align(long[:2000], [99, *long[:1000]])
    assert pairs is not None
    assert len(pairs) == 1000

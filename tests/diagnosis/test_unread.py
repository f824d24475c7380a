"""What a temperature did while nobody read it: shifts of what follows it, and the uncertainties that they leave."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from stepgauge.diagnosis.unread import unread_shifts
from stepgauge.effects.order import followed

Array = NDArray[np.float64]
LEFT_S, BACK_S, END_S = 600.0, 1100.0, 2000.0


def curve(time_s: Array, before: float, after: float, ends: tuple[float, float]) -> Array:
    """Straight with one rate, a cubic from ``LEFT_S`` to ``BACK_S``, straight with another rate."""
    first, last = ends
    u, length = (time_s - LEFT_S) / (BACK_S - LEFT_S), BACK_S - LEFT_S
    cubic = first * (2 * u**3 - 3 * u**2 + 1) + last * (3 * u**2 - 2 * u**3)
    cubic += length * (before * (u**3 - 2 * u**2 + u) + after * (u**3 - u**2))
    early, late = first + before * (time_s - LEFT_S), last + after * (time_s - BACK_S)
    return np.where(time_s < LEFT_S, early, np.where(time_s > BACK_S, late, cubic))


@given(
    before=st.floats(-2e-3, 2e-3),
    after=st.floats(-2e-3, 2e-3),
    rise=st.floats(-1.0, 1.0),
    lag_s=st.floats(30.0, 590.0),
)
@settings(max_examples=25, deadline=None)
def test_a_pause_acts_as_a_cubic_with_the_rates_at_its_ends(
    before: float, after: float, rise: float, lag_s: float
) -> None:
    """The readings with the pause, shifted, are those of a record without a pause that was in motion before it."""
    dense = np.linspace(0.0, END_S, 4001)
    read = (dense <= LEFT_S) | (dense >= BACK_S)
    warmth = curve(dense, before, after, (20.0, 20.0 + rise))
    moving = followed(dense, warmth, [lag_s])[0] - before * lag_s * np.exp(-dense / lag_s)
    told = followed(dense[read], warmth[read], [lag_s])[0]
    shifts = np.sum(list(unread_shifts(dense[read], warmth[read], lag_s, dense[read])), axis=0)
    assert_allclose(told + shifts, moving[read], atol=2e-5)


def test_where_the_readings_go_on_evenly_nothing_is_added() -> None:
    time_s = np.r_[np.arange(0.0, 300.0, 10.0), np.arange(900.0, 1200.0, 10.0)]
    start, *pauses = unread_shifts(time_s, np.full(len(time_s), 21.5), 200.0, time_s)
    assert_allclose([start, *pauses], 0.0, atol=1e-12)
    _, *pauses = unread_shifts(time_s, 20.0 + 1e-3 * time_s, 200.0, time_s)
    assert_allclose(pauses, 0.0, atol=1e-9)

"""What a temperature did while nobody read it: shifts of what follows it, and the uncertainties that they leave."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.signal import lfilter

from stepgauge.diagnosis.unobserved_inputs import departures, unread_shifts
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


def doors(dense_s: Array, random: np.random.Generator) -> Array:
    """Air into which doors let in colder or warmer air, about one in 400 s, that mixes in 150 s."""
    jumps = random.normal(0.0, 0.8, len(dense_s)) * (random.random(len(dense_s)) < np.diff(dense_s)[0] / 400.0)
    return 20.0 + np.asarray(lfilter([1.0], [1.0, -np.exp(-np.diff(dense_s)[0] / 150.0)], jumps))


@pytest.mark.parametrize("lag_s", [60.0, 240.0, 900.0])
@pytest.mark.parametrize("pause_s", [200.0, 800.0])
def test_after_a_pause_the_error_is_as_large_as_its_standard_uncertainty(lag_s: float, pause_s: float) -> None:
    """Of 300 rooms with doors: root mean squares of what a body has beyond the chord, true and stated."""
    random = np.random.default_rng(5)
    dense = np.arange(0.0, 4000.0, 5.0)
    read = (dense < 2000.0) | (dense >= 2000.0 + pause_s)
    time_s, first = dense[read], int(np.argmax(dense[read] > 2000.0))
    errors, stated = [], []
    for _ in range(300):
        air = doors(dense, random)
        error = followed(time_s, air[read], [lag_s])[0] - followed(dense, air, [lag_s])[0][read]
        (shift,) = departures(time_s, air[read], lag_s, time_s)
        errors.append(error[first])
        stated.append(shift[first])
        assert_allclose(shift[first:], shift[first] * np.exp(-(time_s[first:] - time_s[first]) / lag_s))
    assert np.std(errors) == pytest.approx(np.sqrt(np.mean(np.square(stated))), rel=0.25)


def test_departures_are_those_of_a_record_that_is_read_elsewhere() -> None:
    """Of a sine at once: the root mean square of the departure from chords, in closed form, over whole periods."""
    time_s = np.r_[np.arange(0.0, 6000.0, 5.0), np.arange(6250.0, 12000.0, 5.0)]
    turn = 2.0 * np.pi / 1000.0
    (shift,) = departures(time_s, np.sin(turn * time_s), 1e-3, time_s)
    assert_allclose(shift, 0.0, atol=1e-5)  # what follows at once has forgotten the pause
    lag_s, long_s = 100.0, 255.0
    (shift,) = departures(time_s, np.sin(turn * time_s), lag_s, time_s)
    phase = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)[:, None]
    u = np.linspace(0.0, long_s, 4001)
    wave, chord = np.sin(turn * u + phase), np.sin(phase) + (np.sin(turn * long_s + phase) - np.sin(phase)) * u / long_s
    acted = np.trapezoid((wave - chord) * np.exp((u - long_s) / lag_s) / lag_s, u, axis=1)
    assert shift[time_s > 6000.0][0] == pytest.approx(np.sqrt(np.mean(acted**2)), rel=0.05)


def test_a_record_read_too_seldom_tells_nothing_of_its_departures() -> None:
    time_s = np.arange(0.0, 2000.0, 100.0)
    assert not list(departures(time_s, np.sin(time_s), 200.0, time_s))

"""Hysteresis: what friction holds back, from the spring with a slider to loops within loops."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from stepgauge.effects import Probings, Setting, along_approach_um
from stepgauge.effects.empirical import Empirical
from stepgauge.errors import InputError
from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X, gauge, machine, record
from tests.diagnosis.test_selection import NOISE_UM, bent, names, side, told

Array = NDArray[np.float64]


def drawn(x_mm: list[float], way_mm: float, placement: int | list[int] = 1) -> Array:
    frame = pd.DataFrame({"face": 1, "placement": placement, "x_mm": x_mm, "y_mm": 0.0, "z_mm": 0.0})
    return Probings(frame, Setting.of(machine(), gauge())).held_mm("x_mm", way_mm)


def test_a_slider_holds_back_by_the_way_since_the_turn_until_it_slips() -> None:
    """Up by 100 mm, back by 30, on by 130: what is held grows with the way after each turn and ends at 50 mm."""
    held = drawn([0.0, 20.0, 60.0, 100.0, 70.0, 200.0, 20.0], 50.0)
    np.testing.assert_allclose(held, [0.0, 20.0, 50.0, 50.0, 20.0, 50.0, -50.0])


def test_a_short_way_is_the_sign_of_the_travel_and_a_long_one_is_the_travel() -> None:
    x = [0.0, 40.0, 90.0, 60.0, 10.0, 30.0]
    np.testing.assert_allclose(drawn(x, 1e-6) / 1e-6, [0.0, *np.sign(np.diff(x))])
    np.testing.assert_allclose(drawn(x, 1e6), np.subtract(x, x[0]))


def test_a_new_placement_begins_slack() -> None:
    np.testing.assert_allclose(drawn([0.0, 30.0, 500.0, 480.0], 10.0, [1, 1, 2, 2]), [0.0, 10.0, 0.0, -10.0])


@given(st.lists(st.floats(-500.0, 500.0), min_size=2, max_size=30), st.floats(0.1, 300.0), st.floats(-50.0, 50.0))
def test_what_is_held_does_not_know_where_zero_is_and_turns_with_the_axis(
    x: list[float], way_mm: float, shift: float
) -> None:
    held = drawn(x, way_mm)
    assert np.abs(held).max() <= way_mm
    np.testing.assert_allclose(drawn([one + shift for one in x], way_mm), held, atol=1e-9)
    np.testing.assert_allclose(drawn([-one for one in x], way_mm), -held, atol=1e-9)
    np.testing.assert_allclose(drawn([3.0 * one for one in x], 3.0 * way_mm), 3.0 * held, atol=1e-9)


def test_a_formula_knows_the_whole_travel_in_every_block_of_rows() -> None:
    effect = Empirical(formula="c1 * x_mm_held_40000 + position_mm_held_12000", coefficients={"c1": 0.2})
    recording = to_and_fro()
    whole = Probings(recording.frame, Setting.of(machine(), gauge()))
    blocks = np.concatenate([along_approach_um(effect, block) for _, block in whole.blocks(37)])
    np.testing.assert_allclose(blocks, along_approach_um(effect, whole))


@pytest.mark.parametrize("name", ["time_s_held_40000", "x_mm_held_", "x_mm_held_1.5"])
def test_only_coordinates_are_held_and_only_on_whole_micrometres(name: str) -> None:
    whole = Probings(to_and_fro().frame, Setting.of(machine(), gauge()))
    with pytest.raises((InputError, ValueError)):
        along_approach_um(Empirical(formula=name), whole)


def to_and_fro() -> Recording:
    """Ten cycles with turns at other faces in each: the faces of a cycle in a random order of short runs."""
    recording = record(machine(noise_um=NOISE_UM), (ALONG_X,), seed=23, cycles=10)
    frame, random = recording.frame.copy(), np.random.default_rng(4)
    time, face = frame["time_s"].to_numpy().copy(), frame["face"].to_numpy()
    for cycle in np.unique(frame["cycle"]):
        rows = np.flatnonzero(frame["cycle"] == cycle)
        swing = random.uniform(0.2, 1.0) * np.sin(np.linspace(0.0, random.uniform(2.0, 9.0), len(rows)))
        order = rows[np.argsort(np.argsort(face[rows]))[np.argsort(np.argsort(swing))]]
        time[order] = np.sort(time[rows])
    return Recording(frame.assign(time_s=time), recording.comments)


def relays(recording: Recording, count: int = 30) -> Array:
    """Preisach's model: relays that switch at two places each, along x in the order of time, from -1 to 1."""
    random = np.random.default_rng(7)
    x, time = recording.frame["x_mm"].to_numpy(), recording.frame["time_s"].to_numpy()
    centre, half = random.uniform(x.min(), x.max(), count), random.uniform(0.05, 0.3, count) * np.ptp(x)
    state, total = -np.ones(count), np.zeros(len(x))
    for row in np.argsort(time):
        state = np.where(x[row] > centre + half, 1.0, np.where(x[row] < centre - half, -1.0, state))
        total[row] = state.mean()
    return total


def test_loops_within_loops_are_hysteresis_and_no_laws_that_are_alike() -> None:
    """Relays are not what the form is made of; the length errors that are alike go into it, as rule 3 asks."""
    recording = to_and_fro()
    found = told(bent(lambda r: 1.5 * relays(r) * side(r), recording))
    assert found.verdict == "unknown"
    assert not names(found)
    (form,) = [one for one in found.unexplained if one.probability > 0.5]
    assert (form.covariate, form.form) == ("position", "hysteresis")
    assert found.rest_rms_um < 1.35 * found.noise.sigma_um


def test_friction_of_one_half_of_the_travel_is_a_hysteresis_that_differs_from_place_to_place() -> None:
    recording = to_and_fro()
    held = Probings(recording.frame, Setting.of(machine(), gauge())).held_mm("x_mm", 60.0) / 60.0
    x = recording.frame["x_mm"].to_numpy()
    worn = 2.0 * held * np.clip((x - np.median(x)) / (0.25 * np.ptp(x)), 0.0, 1.0)
    found = told(bent(lambda r: worn * side(r), recording))
    assert found.verdict == "unknown"
    assert not names(found)
    (form,) = [one for one in found.unexplained if one.probability > 0.5]
    assert (form.form, form.beside) == ("hysteresis", form.covariate)
    assert "more in some places than in others" in form.where
    (law,) = found.forms
    assert found.rest_rms_um < 1.2 * found.noise.sigma_um
    share, hidden = (found.data.without_origins(um) for um in (law.share_um, worn * side(recording)))
    assert np.corrcoef(share, hidden)[0, 1] > 0.95


def test_a_reversal_error_is_no_hysteresis() -> None:
    """A constant between the directions of travel is a loop without a way."""
    recording = to_and_fro()
    way = Probings(recording.frame, Setting.of(machine(), gauge())).way()
    found = told(bent(lambda r: 0.8 * way * side(r), recording))
    assert [one.form for one in found.unexplained if one.probability > 0.5] == ["loop"]

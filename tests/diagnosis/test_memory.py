"""What rests leave and touches wear off: a memory that runs on through every pause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from stepgauge.effects import Probings, Setting, along_approach_um
from stepgauge.effects.empirical import Empirical
from stepgauge.recording import Recording
from tests.diagnosis.made import gauge, machine
from tests.diagnosis.test_selection import bent, clean, names, told, touches

Array = NDArray[np.float64]
WORN = 0.78
"""Share of what rests have left that one touch leaves of it."""


def paused() -> Recording:
    """A recording with a pause of 20 s to 6 min after every dozen touches or so."""
    random = np.random.default_rng(8)
    frame = clean().frame.sort_values("time_s")
    pause_s = np.where(random.random(len(frame)) < 0.08, random.uniform(20.0, 360.0, len(frame)), 0.0)
    return replace(clean(), frame=frame.assign(time_s=frame["time_s"] + np.cumsum(pause_s)).sort_index())


def rested(recording: Recording) -> Array:
    """Root of every rest, added up touch by touch while each touch wears off its share, s^0.5."""
    time = recording.frame["time_s"].to_numpy()
    order, state, by_row = np.argsort(time), 0.0, np.zeros(len(time))
    for before, row in zip([order[0], *order[:-1]], order, strict=True):
        state = WORN * state + np.sqrt(time[row] - time[before])
        by_row[row] = state
    return by_row


def probings(frame: pd.DataFrame) -> Probings:
    return Probings(frame, Setting.of(machine(), gauge()))


def test_rests_add_up_and_fade_touch_by_touch() -> None:
    recording = paused()
    got = probings(recording.frame).rested(-1.0 / np.log(WORN))
    np.testing.assert_allclose(got, rested(recording), rtol=1e-10)


def test_a_formula_knows_the_whole_history_in_every_block_of_rows() -> None:
    effect = Empirical(formula="rested_3 + touches_20 + rest_s + way")
    whole = probings(paused().frame)
    blocks = np.concatenate([along_approach_um(effect, block) for _, block in whole.blocks(37)])
    np.testing.assert_allclose(blocks, along_approach_um(effect, whole))


def test_where_a_clock_starts_anew_the_probe_rested_for_the_longest() -> None:
    frame = pd.DataFrame({"face": 1, "placement": [1, 1, 2], "time_s": [5.0, 9.0, 0.0]})
    np.testing.assert_allclose(probings(frame).rested(1.0), [0.0, 2.0, 2.0 + 2.0 / np.e])


def test_what_rests_add_and_touches_wear_off_is_no_exponential_since_the_last_pause() -> None:
    """As small as the scatter; the formula leaves nothing of it, and is what was put there."""
    recording = bent(lambda r: 0.06 * rested(r), paused())
    found = told(recording)
    assert found.verdict == "unknown"
    assert "approach_memory" not in names(found)
    (form,) = [one for one in found.unexplained if one.probability > 0.5]
    assert (form.covariate, form.form) == ("rest before the touch", "memory of rests")
    assert found.rest_rms_um == pytest.approx(found.noise.sigma_um, rel=0.1)
    assert np.corrcoef(found.forms[0].share_um, rested(recording))[0, 1] > 0.98


def test_equal_rests_leave_no_memory_to_be_seen() -> None:
    """A touch every two seconds: what the rests have left is the same at every touch but the first few."""
    frame = clean().frame
    even = replace(clean(), frame=frame.assign(time_s=2.0 * np.argsort(np.argsort(frame["time_s"].to_numpy()))))
    found = told(bent(lambda r: 0.06 * rested(r), even))
    assert not [one for one in found.unexplained if one.form == "memory of rests" and one.probability > 0.5]


def test_an_exponential_since_the_last_pause_is_no_memory_of_its_length() -> None:
    found = told(bent(lambda r: 1.2 * np.exp(-touches(r, 18.0) / 4.0), paused()))
    assert names(found) == ["approach_memory"]
    assert found.verdict == "effects"

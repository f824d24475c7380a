"""Waves with corners: what is told of them, and what imitates them, beside sines that are a law's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X
from tests.diagnosis.test_selection import along, bent, names, told

Array = NDArray[np.float64]
PERIOD_S = 83.0
SAWTOOTH, SQUARE, SHAPES = "sawtooth", "square wave", ("sawtooth", "square wave")
FORM = {SAWTOOTH: "sawtooth", SQUARE: "wave"}
HEIGHT_UM = {SAWTOOTH: 0.4, SQUARE: 0.5}
"""Of waves whose overtones stand out of the scatter."""


def wave(form: str, turns: Array) -> Array:
    """From -1 to 1; the sawtooth jumps at whole turns."""
    return 2.0 * (turns % 1.0) - 1.0 if form == SAWTOOTH else np.where(turns % 1.0 < 0.5, 1.0, -1.0)


@pytest.mark.parametrize("form", SHAPES)
def test_a_wave_with_corners_is_no_oscillation_of_the_vocabulary(form: str) -> None:
    """Found with its form and period, what speaks against the sine, and a law that leaves little of it."""
    recording = bent(along(ALONG_X, lambda t: HEIGHT_UM[form] * wave(form, t / PERIOD_S)))
    found = told(recording)
    assert found.verdict == "unknown"
    assert not names(found)
    first = found.unexplained[0]
    assert (first.covariate, first.form) == ("time", FORM[form])
    law = found.forms[0]
    assert np.atleast_1d(law.numbers)[0] == pytest.approx(PERIOD_S, rel=0.02)
    truth = HEIGHT_UM[form] * wave(form, found.data.probings.time_s / PERIOD_S) * found.data.probings.approach("x")
    assert np.corrcoef(law.share_um, truth)[0, 1] > 0.9
    assert law.share_um.std() == pytest.approx(truth.std(), rel=0.3)


def test_a_sine_stays_an_oscillation() -> None:
    found = told(bent(along(ALONG_X, lambda t: 0.8 * np.sin(2.0 * np.pi * t / 97.0 + 0.4))))
    assert found.verdict == "effects"
    assert "temperature_cycle" in {kind for one in found.findings for kind in (one.kind, *one.confounded_with)}


@pytest.mark.parametrize(
    "form",
    ["sine", SAWTOOTH],
)
def test_a_wave_along_the_travel_is_told_without_times(form: str) -> None:
    """Sines along a scale are a law's, sawtooths nobody's; nothing asks for a time that was not recorded."""

    def along_x(recording: Recording) -> Array:
        turns = recording.frame["x_mm"].to_numpy() / 97.0
        um = 0.5 * (np.sin(2.0 * np.pi * turns) if form == "sine" else wave(form, turns))
        return um * recording.frame["approach_i"].to_numpy()

    recording = bent(along_x)
    found = told(replace(recording, frame=recording.frame.drop(columns=["time_s"])))
    if form == "sine":
        assert names(found) == ["periodic_scale_error"]
        return
    assert found.verdict == "unknown"
    assert all(
        "includes_set" in one for one in found.probabilities["statements"]
    )  # the report asks each statement for it
    (first, *_) = found.unexplained
    assert (first.covariate, first.form) == ("machine x", FORM[form])
    assert np.atleast_1d(found.forms[0].numbers)[0] == pytest.approx(97.0, rel=0.05)


@pytest.mark.parametrize("period_s", [31.7, 44.3])
def test_a_sawtooth_between_the_periods_and_phases_of_the_grid_is_found_with_its_own(period_s: float) -> None:
    """With up to two dozen teeth: a jump that is a touch off would be an error of its own."""
    recording = bent(along(ALONG_X, lambda t: 0.4 * wave(SAWTOOTH, t / period_s + 0.217)))
    found = told(recording)
    assert found.verdict == "unknown"
    first = found.unexplained[0]
    assert (first.covariate, first.form) == ("time", SAWTOOTH)
    assert first.numbers[0] == pytest.approx(period_s, rel=0.003)
    assert f"{first.numbers[0]:.4g}" in first.where

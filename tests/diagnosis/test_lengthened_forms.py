"""Forms of a recording that goes on: every shape keeps its number, its scale and its fitted numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.diagnosis.gaussian_processes.candidates import random_function_candidates
from stepgauge.diagnosis.gaussian_processes.random_function import (
    BEAT,
    HYSTERESIS,
    LAGGED,
    RESTS,
    SAWTOOTH,
    TREND,
    WAVE,
)
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.inference.problem import Candidate, Law
from tests.diagnosis.made import ALONG_X, gauge, machine
from tests.diagnosis.test_selection import NOISE_UM, clean, there_and_back

NUMBERED = (BEAT, HYSTERESIS, LAGGED, RESTS, SAWTOOTH, WAVE)


def whole() -> Residuals:
    """There and back with a temperature that swings; the rows in the order of time."""
    recording = there_and_back(clean((ALONG_X,)))
    frame = recording.frame.sort_values("time_s", ignore_index=True)
    frame["air_C"] = 20.0 + np.sin(frame["time_s"] / 40.0)
    return make_residuals(replace(recording, frame=frame), gauge(), machine(noise_um=NOISE_UM))


def forms(data: Residuals, known: int | None = None) -> dict[str, Candidate]:
    return {one.label: one for one in random_function_candidates(data, shipped_priors(), 0.3, known=known)}


@pytest.mark.parametrize("shape", NUMBERED)
def test_a_shape_has_its_number_in_a_recording_that_goes_on(shape: str) -> None:
    """Half of the time was measured; the periods, lags and ways of the form are those of this half."""
    data = whole()
    half = len(data) // 2
    measured, longer = forms(data.at(np.arange(len(data)) < half)), forms(data, half)
    own = [one for one in measured.values() if one.source.shape == shape]
    assert own
    for one in own:
        other = longer[one.label]
        assert other.source.kernels == one.source.kernels
        numbered = [atom for atom, kernel in enumerate(one.source.kernels) if kernel != TREND]
        for atom in numbered[:: max(len(numbered) // 40, 1)]:
            np.testing.assert_allclose(other.columns(atom)[:, :half], one.columns(atom), atol=1e-9)


@pytest.mark.parametrize(("shape", "numbers"), [(WAVE, 61.3), (SAWTOOTH, (61.3, 0.21))])
def test_a_shape_that_was_fitted_between_those_with_numbers_goes_on_as_it_is(shape: str, numbers: object) -> None:
    data = whole()
    half = len(data) // 2
    label = f"{shape} time  gauge"
    measured, longer = forms(data.at(np.arange(len(data)) < half))[label], forms(data, half)[label]
    assert isinstance(longer, Law)
    np.testing.assert_allclose(longer.source.of([numbers])[..., :half], measured.source.of([numbers]), atol=1e-9)

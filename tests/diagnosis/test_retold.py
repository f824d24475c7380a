"""A law whose shape was fitted gives way to a plainer form that tells its story in fewer words, and only to such."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.recording import Recording
from tests.diagnosis.made import gauge, machine
from tests.diagnosis.test_selection import NOISE_UM, bent, clean, lies_on, names, side, told

Array = NDArray[np.float64]
PITCH_MM = 20.0
"""Of faces on the same side of the blocks of this gauge."""


def without(recording: Recording, *kinds: str) -> GaugeDiagnosis:
    return diagnose(recording, gauge(), machine(noise_um=NOISE_UM), without=kinds)


def along_x(recording: Recording, um: Array) -> Array:
    """A motion of the carriage where the gauge lies along x."""
    return um * side(recording) * lies_on(recording)


def x_mm(recording: Recording) -> Array:
    return recording.frame["x_mm"].to_numpy() - 350.0


def bowed(recording: Recording) -> Array:
    return along_x(recording, 1.5 * (x_mm(recording) / 105.0) ** 2)


def test_the_gauge_has_the_pitch_that_periods_are_to_beat_with() -> None:
    position = gauge().position_mm
    np.testing.assert_allclose(np.diff(position[::2]), PITCH_MM, atol=0.2)


def test_a_bow_without_a_law_is_no_period_that_beats_with_the_pitch() -> None:
    found = without(
        bent(bowed), "scale_curvature", "error_motion"
    )  # a carriage that pitches more and more bows it, too
    assert found.verdict == "unknown"
    assert not found.findings
    assert found.unexplained[0].form == "smooth"
    assert found.unexplained[0].covariate in ("machine x", "position")


def test_a_bow_with_a_law_is_that_law() -> None:
    assert names(told(bent(bowed))) == ["scale_curvature"]


def test_a_period_that_beats_with_the_pitch_more_than_once_stays_a_period() -> None:
    """Over the faces of one side it looks as long as the travel over ``beats``."""
    beats = 1.3
    travel_mm = float(np.ptp(x_mm(clean())))
    period_mm = 1.0 / (2.0 / PITCH_MM + beats / travel_mm)

    def wave(recording: Recording) -> Array:
        return along_x(recording, 1.5 * np.sin(2.0 * np.pi * x_mm(recording) / period_mm + 0.5))

    assert names(told(bent(wave))) == ["periodic_scale_error"]
    assert names(without(bent(wave), "scale_curvature")) == ["periodic_scale_error"]


def test_a_constant_along_the_approach_is_no_memory_that_hardly_fades() -> None:
    constant = bent(lambda r: np.full(len(r.frame), -0.6), clean(pause_s=35.0))
    found = without(constant, "effective_radius", "lever_arm", "trigger_delay", "probe_lobing", "reversal_error")
    assert found.verdict == "unknown"
    assert not found.findings

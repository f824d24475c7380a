"""What is said of the scatter: outliers and growth, from repeats alone and beside a model."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.wording.headline import headline
from stepgauge.recording import Recording
from tests.diagnosis.made import gauge, machine
from tests.diagnosis.test_selection import NOISE_UM, bent, clean, names, side, told

Array = NDArray[np.float64]


def two_cycles() -> Recording:
    frame = clean().frame
    return replace(clean(), frame=frame[frame["cycle"] <= 2].reset_index(drop=True))


def with_one_bad(row: int, um: float) -> Recording:
    return bent(lambda r: np.where(np.arange(len(r)) == row, um, 0.0), two_cycles())


def test_of_two_repeats_that_differ_the_one_far_from_the_rest_is_bad() -> None:
    """The repeats alone cannot say which, and a step before the bad one and another after it would explain it too.

    In row 48 a step is as probable as that (0.50 each), so that neither is said.
    """
    for row in (7, 93):
        found = told(with_one_bad(row, -14.0 * NOISE_UM))
        assert names(found) == ["outliers"]
        assert found.noise.outliers.tolist() == [row]


def long_scale(recording: Recording) -> Array:
    return 8e-3 * (recording.frame["x_mm"].to_numpy() - 350.0) * side(recording)


def test_rows_that_stand_alone_in_structure_beside_a_law_are_no_outliers() -> None:
    """Pulses every 173 s, seven standard deviations high: few rows see one at its height."""

    def pulses(recording: Recording) -> Array:
        swing = np.sin(2.0 * np.pi * recording.frame["time_s"].to_numpy() / 173.0)
        return 2.0 * np.exp(10.0 * (swing - 1.0)) + long_scale(recording)

    found = told(bent(pulses))
    assert found.verdict == "unknown"
    assert "outliers" not in names(found)
    assert found.noise.outliers.size == 0


def test_a_row_that_stands_alone_beside_a_law_is_an_outlier() -> None:
    found = told(bent(lambda r: long_scale(r) + np.where(np.arange(len(r)) == 33, 14.0 * NOISE_UM, 0.0)))
    assert names(found) == ["scale_error", "outliers"]
    assert found.noise.outliers.tolist() == [33]


def test_a_law_keeps_its_name_beside_correlated_scatter_which_is_told_as_unexplained() -> None:
    """What makes neighbours alike is in no law, so that the named one is not all that there is."""
    draws = np.random.default_rng(4).normal(0.0, NOISE_UM, len(clean().frame))
    alike = lfilter([np.sqrt(1.0 - 0.81)], [1.0, -0.9], draws)
    found = told(bent(lambda r: 2.0 * long_scale(r) + 3.0 * alike))
    assert found.verdict == "unknown"
    assert names(found) == ["scale_error"]
    assert [one.form for one in found.unexplained] == ["correlated scatter"]


@pytest.mark.parametrize("seed", range(3))
def test_noise_with_as_much_power_in_every_octave_is_no_radius_and_no_drift(seed: int) -> None:
    """1/f noise from one swing in two recordings to half the rhythm of the touches, by its spectrum."""
    rows = len(clean().frame)
    bins = np.random.default_rng(seed).normal(size=(2, rows)) / np.sqrt(np.arange(1, rows + 1))
    swings = np.fft.irfft(np.r_[0.0, bins[0] + 1j * bins[1]])[:rows]
    found = told(bent(lambda r: 0.5 * swings / swings.std()))
    assert (found.verdict, names(found)) == ("unknown", [])
    assert [one.form for one in found.unexplained] == ["correlated scatter"]
    assert "1/f" in found.unexplained[0].where


@pytest.mark.parametrize("seed", [1, 2])
def test_a_stretch_of_larger_scatter_is_told_with_its_times(seed: int) -> None:
    """A press next door: it was called adequate, with a remark on heavy tails."""
    random = np.random.default_rng(seed)

    def shaken(recording: Recording) -> Array:
        time_s = recording.frame["time_s"].to_numpy()
        low, high = np.quantile(time_s, [0.3, 0.5])
        return random.normal(0.0, 6.0 * NOISE_UM, len(time_s)) * ((time_s > low) & (time_s < high))

    shaky = bent(shaken)
    found = told(shaky)
    low, high = np.quantile(shaky.frame["time_s"], [0.3, 0.5])
    (one,) = found.unexplained
    assert (found.verdict, one.form, one.covariate, names(found)) == ("unknown", "disturbed scatter", "time", [])
    said = [float(word) for word in re.findall(r"([\d.]+) s\b", one.where)]
    np.testing.assert_allclose(said, [low, high], atol=0.06 * np.ptp(shaky.frame["time_s"]))
    shakier = found.noise.by_row_um > 2.0 * found.noise.sigma_um
    assert 0.14 < shakier.mean() < 0.26
    assert found.noise.outliers.size == 0


def test_even_scatter_is_not_disturbed_anywhere() -> None:
    for seed in range(4):
        recording = bent(lambda r, s=seed: np.random.default_rng(s).normal(0.0, NOISE_UM, len(r)))
        assert told(recording).verdict == "adequate"


@pytest.mark.parametrize("times", [8.0, 0.1])
def test_scatter_that_is_not_what_the_machine_file_states_is_the_first_finding_and_the_headline(times: float) -> None:
    """It was adequate, with nothing to be added, at 25 times what the machine file states."""
    found = diagnose(clean(), gauge(), machine(noise_um=NOISE_UM / times))
    assert (found.verdict, names(found)) == ("effects", ["repeatability"])
    one = found.findings[0].parameters["repeatability_um"]
    assert abs(one.value - NOISE_UM) < 3.0 * (one.u or 0.0)
    factor = {8.0: "The scatter is 7.", 0.1: "The scatter is a 1"}[times]
    assert headline(found.contents).startswith(factor)
    assert "the scatter is" in found.summary()


def test_scatter_near_what_the_machine_file_states_is_none() -> None:
    for times in (1.5, 0.6):
        recording = bent(lambda r, t=times: np.random.default_rng(1).normal(0.0, t * NOISE_UM, len(r)))
        assert told(recording).verdict == "adequate"

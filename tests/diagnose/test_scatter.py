"""What is said of the scatter: outliers and growth, from repeats alone and beside a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from stepgauge.diagnose.noise import OUTLIER_P, Noise, estimate_noise, with_lone_rows

from stepgauge.diagnose.residuals import Residuals, make_residuals
from stepgauge.recording import Recording
from tests.diagnose.made import gauge, machine
from tests.diagnose.test_selection import NOISE_UM, bent, clean, names, side, told

Array = NDArray[np.float64]


def two_cycles() -> Recording:
    frame = clean().frame
    return replace(clean(), frame=frame[frame["cycle"] <= 2].reset_index(drop=True))


def residuals(recording: Recording) -> Residuals:
    return make_residuals(recording, gauge(), machine(noise_um=NOISE_UM))


def with_one_bad(row: int, um: float) -> Recording:
    return bent(lambda r: np.where(np.arange(len(r)) == row, um, 0.0), two_cycles())


def test_of_two_repeats_that_differ_the_one_far_from_the_rest_is_bad() -> None:
    """The repeats alone cannot say which, and a step before the bad one and another after it would explain it too."""
    for row in (7, 48, 93):
        found = told(with_one_bad(row, -14.0 * NOISE_UM))
        assert names(found) == ["outliers"]
        assert found.noise.outliers.tolist() == [row]


def test_a_row_that_a_model_expects_is_no_outlier_whatever_its_repeats_say() -> None:
    data = residuals(clean())
    noise, row = estimate_noise(data), 20
    by_row_um = noise.by_row_um.copy()
    by_row_um[row] = np.inf
    taken = Noise(noise.sigma_um, by_row_um, noise.dof, np.array([row]), None, noise.repeats)
    left_um = np.where(np.arange(len(data)) == row, 2.0 * NOISE_UM, 0.0)
    assert with_lone_rows(taken, left_um, data).outliers.size == 0
    assert with_lone_rows(taken, 4.0 * left_um, data).outliers.tolist() == [row]
    # before there is a model, nothing speaks against the repeats
    assert with_lone_rows(taken, left_um, data, beside_outliers=True).outliers.tolist() == [row]


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


def test_growth_that_repeats_show_and_all_rows_do_not_is_none() -> None:
    """The one of 1500 draws of even scatter in which the repeats show growth and all rows together do not."""
    scatter_um = np.random.default_rng(1452).normal(0.0, NOISE_UM, len(clean()))
    recording = bent(lambda r: scatter_um - residuals(r).um, clean())
    assert estimate_noise(residuals(recording)).growth is not None
    assert names(told(recording)) == []


def far_off(rows: list[int], by: float) -> list[int]:
    """The outliers beside a model that leaves nothing but some rows, ``by`` standard deviations off."""
    data = residuals(clean())
    noise = estimate_noise(data)
    deviation_um = by * np.hypot(noise.sigma_um, data.gauge.u_um[data.face - 1])
    left_um = np.where(np.isin(np.arange(len(data)), rows), deviation_um, 0.0)
    return with_lone_rows(noise, left_um, data).outliers.tolist()


def test_rows_that_are_no_surprise_alone_are_one_together() -> None:
    """Of some two hundred rows one is four standard deviations off in every eightieth recording, two in hardly any."""
    assert 100 < len(clean()) < 400
    assert far_off([20], 4.0) == []
    assert far_off([20, 57], 4.0) == [20, 57]
    assert far_off([20, 57], 3.2) == []
    assert far_off([20], 5.0) == [20]


def test_calling_rows_outliers_is_as_rare_as_stated() -> None:
    """Of 2000 draws of scatter for every row at most so many as a binomial allows once in a thousand."""
    data = residuals(clean())
    noise, random = estimate_noise(data), np.random.default_rng(11)
    deviation_um = np.hypot(noise.sigma_um, data.gauge.u_um[data.face - 1])
    drawn = random.normal(size=(2000, len(data))) * deviation_um
    called = sum(with_lone_rows(noise, left_um, data).outliers.size > 0 for left_um in drawn)
    assert called <= stats.binom.ppf(0.999, 2000, OUTLIER_P)

"""What is said of the scatter: outliers and growth, from repeats alone and beside a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.noise import Noise, estimate_noise, with_lone_rows
from stepgauge.diagnose.residuals import Residuals, make_residuals
from stepgauge.recording import Recording
from tests.diagnose.made import gauge, machine
from tests.diagnose.test_selection import NOISE_UM, bent, clean, names, told

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


def unlike_repeats(data: Residuals) -> Array:
    """Repeats that scatter more at the far end, about means that scatter more at the near end: all rows alike."""
    random = np.random.default_rng(4)
    own, count = random.normal(0.0, NOISE_UM, len(data)), np.bincount(data.group)
    mean = (np.bincount(data.group, own) / count)[data.group]
    far = data.probings.certified_mm() / data.probings.certified_mm().max()
    within = 0.25 + far**2  # share of the variance; 0.25 to 1.25
    between = count[data.group] - (count[data.group] - 1.0) * within
    return mean * np.sqrt(between) + (own - mean) * np.sqrt(within)


def test_growth_that_repeats_show_and_all_rows_do_not_is_none() -> None:
    start = residuals(clean())
    moved_um = unlike_repeats(start) - start.um
    recording = bent(lambda r: moved_um, clean())
    seen = estimate_noise(residuals(recording)).growth
    assert seen is not None
    assert seen[0] in ("position", "x", "y")
    assert "noise_growth" not in names(told(recording))

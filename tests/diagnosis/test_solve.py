"""The values that are stated: what cannot be negative, and the scatter by which a fit is judged."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from stepgauge.diagnosis.engine import misfit
from stepgauge.diagnosis.solve import _above_zero
from tests.diagnosis.test_selection import BETWEEN, along, bent, clean, names, told


@pytest.mark.parametrize("value", [-60.0, -9.0, -1.5, 0.0, 0.4, 3.0, 24.0])
def test_what_cannot_be_negative_has_the_moments_of_a_distribution_cut_off_at_zero(value: float) -> None:
    u = 3.0
    cut = stats.truncnorm(-value / u, np.inf, loc=value, scale=u)
    mean, spread = _above_zero(value, u)
    assert mean == pytest.approx(cut.mean(), rel=1e-6)
    assert spread == pytest.approx(cut.std(), rel=0.01)


def test_where_no_uncertainty_is_known_a_negative_size_is_zero() -> None:
    assert _above_zero(-2.0, math.nan)[0] == 0.0
    assert _above_zero(2.0, math.nan)[0] == 2.0
    assert _above_zero(-2.0, 0.0) == (0.0, 0.0)


def test_effects_that_leave_more_than_there_was_are_remarked() -> None:
    fit = told(clean()).fit
    assert not [*misfit(fit)]
    (said,) = misfit(replace(fit, rms_before_um=2.36, rms_after_um=2.46))
    assert "2.46 um rms of 2.36 um" in said


def test_repeats_that_drift_are_no_repeatability() -> None:
    """The scatter of repeats holds the whole drift before it is named: chi-square is by what is left of them."""
    recording = clean(pause_s=600.0)
    found = told(bent(along(BETWEEN, lambda t: -4.0 * np.expm1(-t / 900.0)), recording))
    assert names(found) == ["thermal_drift"]
    assert 0.8 < found.fit.chi2_dof_after < 1.25
    assert found.fit.chi2_dof_before > 2.0

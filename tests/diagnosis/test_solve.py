"""The values that are stated: what cannot be negative, and the scatter by which a fit is judged."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnosis.fits.law import FittedLaw
from stepgauge.diagnosis.fits.solve import _above_zero, _covariance, _unexplained
from stepgauge.diagnosis.holdout import holdout_rms, make_folds
from stepgauge.diagnosis.laws.library import effect_families
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import make_problem
from stepgauge.diagnosis.residuals import Residuals, make_residuals
from stepgauge.diagnosis.wording.phrases import misfit, worded
from stepgauge.errors import InputError
from stepgauge.inference.evidence import Evidence
from stepgauge.inference.metric import Metric
from tests.diagnosis.made import machine
from tests.diagnosis.test_further_laws import STEPS, measured, turned
from tests.diagnosis.test_selection import BETWEEN, along, bent, clean, names, told

Array = NDArray[np.float64]


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
    assert not [*misfit(fit.rms_before_um, fit.rms_after_um)]
    (said,) = misfit(2.36, 2.46)
    assert "2.46 um rms of 2.36 um" in worded(said)


def test_what_other_faces_do_not_show_is_not_predicted_as_anything() -> None:
    """Two laws that differ on one block alone: without this block their difference is noise over next to nothing."""
    found = told(clean())
    data, sigma_um = found.data, found.noise.by_row_um
    first = np.asarray(data.probings.certified_mm() * 1e-3)
    second = first + np.where(data.face < 3, 1.0, 1e-4 * np.random.default_rng(5).standard_normal(len(data)))
    faces = make_folds(data)["faces"]
    none = holdout_rms(data, sigma_um, np.zeros((len(data), 0)), faces)
    assert holdout_rms(data, sigma_um, np.column_stack([first, second]), faces) < 10.0 + none
    assert holdout_rms(data, sigma_um, first[:, None], faces) == pytest.approx(none, rel=0.05)


def test_repeats_that_drift_are_no_repeatability() -> None:
    """The scatter of repeats holds the whole drift before it is named: chi-square is by what is left of them."""
    recording = clean(pause_s=600.0)
    found = told(bent(along(BETWEEN, lambda t: -4.0 * np.expm1(-t / 900.0)), recording))
    assert names(found) == ["thermal_drift"]
    assert 0.8 < found.fit.chi2_dof_after < 1.25
    assert found.fit.chi2_dof_before > 2.0


def tripod_of_short_lever() -> tuple[FittedLaw, Residuals, Array]:
    """A tripod as a law of a recording with inclined gauges, and its parameters where some faces never trigger it."""
    axes = [turned(50.0, -38.0), turned(0.0), turned(110.0), turned(-40.0)]
    data = make_residuals(measured(axes, 3), STEPS, machine())
    families = effect_families(data, shipped_priors())
    (family,) = (f for f in families if f.law.kind == "kinematic_pretravel" and f.choices["part"] == "varying")
    law = FittedLaw(family, 0)
    at = {"um_per_N": 0.5, "lever_mm": 2.964, "arm_azimuth_deg": 111.0, "along": 0.512}
    return law, data, np.array([at[name] for name in law.names])


def test_a_fit_does_not_step_to_a_tripod_that_never_triggers() -> None:
    """A face that is approached upward pulls the stylus of a short lever out of its seat; a fit passed it."""
    law, data, never = tripod_of_short_lever()
    problem = make_problem(data, shipped_priors())
    scatters = Evidence(problem, shipped_priors().scatter).noise_models
    metric = Metric(problem, scatters.plain(), scatters, 1.0)
    white = metric(data.um)
    with pytest.raises(InputError, match="never triggers"):
        law.displacement_um(never, data)
    there = _unexplained([law], [never], data, metric, white)
    assert (there > 1e3 * np.abs(white).max()).all()
    elsewhere = np.where([name == "lever_mm" for name in law.names], 65.0, never)
    assert np.abs(_unexplained([law], [elsewhere], data, metric, white)).max() < 1e2


def test_beside_a_tripod_that_never_triggers_slopes_lead_away_from_it() -> None:
    law, data, at = tripod_of_short_lever()
    lever, steps = law.names.index("lever_mm"), np.full(len(law.names), 1e-6)
    never, triggers = at.copy(), at.copy()
    triggers[lever] = 65.0
    while triggers[lever] - never[lever] > 1e-8:
        middle = (never + triggers) / 2.0
        try:
            law.displacement_um(middle, data)
            triggers = middle
        except InputError:
            never = middle
    ahead, back = law.slopes(triggers, steps, data), law.slopes(triggers, -steps, data)
    assert np.isfinite(back).all()
    np.testing.assert_allclose(back[lever], ahead[lever], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("direction", [(0.8, 0.6, 0.0), (0.6, 0.8, 0.0)])
def test_a_component_that_no_reading_tells_is_as_large_as_such_laws_are_and_not_as_they_can_be(
    direction: tuple[float, float, float],
) -> None:
    """A step while a placement along x is measured: what it was across, the origins of all placements hide.

    It was told with a standard uncertainty of 190 um.
    """
    recording = clean(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.7, 0.7, 0.0)))
    first = recording.frame["time_s"][recording.frame["placement"] == 1].to_numpy()
    found = told(bent(along(direction, lambda t: 1.5 * (t > np.median(first))), recording))
    (step,) = found.findings
    um = step.parameters["um"]
    assert um.value == pytest.approx(1.5 * direction[0], abs=0.3)
    assert um.u is not None
    if step.effect.direction == "x":  # type: ignore[union-attr]
        return  # the law along one axis says nothing of the others
    assert step.effect.direction == pytest.approx((1.0, 0.0, 0.0), abs=1e-3)  # type: ignore[union-attr]
    assert abs(um.value - 1.5) < 2.0 * um.u
    assert um.u < 1.5


@pytest.mark.parametrize("curvature", [0.0, 1e-3, 1e3])
def test_the_range_of_a_shape_bounds_its_uncertainty(curvature: float) -> None:
    """One parameter: variances add as their inverses; without any curvature nothing is told, and nothing is said."""
    range_sd = 40.0
    jacobian = np.array([[1.0, 0.0], [0.0, np.sqrt(curvature)]])
    size, shape = np.diag(_covariance(jacobian, np.ones(2), np.array([np.inf, range_sd])))
    assert size == pytest.approx(1.0)
    if curvature:
        assert shape == pytest.approx(1.0 / (curvature + range_sd**-2.0))
    else:
        assert math.isnan(shape)

"""Several plain laws instead of one that bends to all of them, and one law instead of two that stand for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import covariates
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.recording import APPROACH, Recording
from tests.diagnosis.made import ALONG_X, gauge, machine
from tests.diagnosis.test_retold import along_x, x_mm
from tests.diagnosis.test_selection import NOISE_UM, bent, clean, lies_on, names, side, told

Array = NDArray[np.float64]
DIAGONAL, ACROSS = (0.6, 0.8, 0.0), (0.8, -0.6, 0.0)


@pytest.mark.parametrize(("um", "axis"), [(0.5, ALONG_X), (-2.0, DIAGONAL)])
def test_a_radius_and_a_length_are_no_period_that_beats_with_the_pitch(
    um: float, axis: tuple[float, float, float]
) -> None:
    """In one placement a period of about two pitches moves fronts and backs apart and lets both drift."""
    recording = clean((axis,))

    def radius_and_length(r: Recording) -> Array:
        position_mm = gauge().position_mm[r.frame["face"].to_numpy() - 1]
        return um + 6e-3 * position_mm * side_of(r, axis)

    found = told(bent(radius_and_length, recording))
    assert found.verdict == "effects"
    assert len(found.findings) == 2
    told_of = [{one.kind, *one.confounded_with} for one in found.findings]
    assert any("effective_radius" in kinds for kinds in told_of)
    assert any("gauge_temperature" in kinds for kinds in told_of)


def side_of(recording: Recording, axis: tuple[float, float, float]) -> Array:
    """+1 on fronts, -1 on backs."""
    return np.sign(recording.frame[["approach_i", "approach_j", "approach_k"]].to_numpy() @ np.array(axis))


def test_a_period_alone_stays_one_law() -> None:
    found = told(bent(lambda r: along_x(r, 1.2 * np.sin(2.0 * np.pi * x_mm(r) / 13.7 + 0.3))))
    assert names(found) == ["periodic_scale_error"]


def test_a_scale_and_a_squareness_are_two_laws_and_no_form() -> None:
    """A long scale of x is a warm gauge and short scales of the other axes as well: three laws where one is enough."""
    recording = clean((ALONG_X, DIAGONAL, ACROSS))

    def skewed(r: Recording) -> Array:
        frame = r.frame
        x, y = frame["x_mm"].to_numpy() - 350.0, frame["y_mm"].to_numpy() - 600.0
        return (-6e-3 * x + 9e-3 * y) * frame["approach_i"].to_numpy()

    found = told(bent(skewed, recording))
    assert found.verdict == "effects"
    kinds = [{one.kind, *one.confounded_with} for one in found.findings]
    assert len(kinds) == 2
    assert any("squareness" in one for one in kinds)
    assert any("scale_error" in one for one in kinds)


def test_a_coordinate_that_only_jitters_is_no_covariate() -> None:
    """The trace of the residual in it would explain anything."""
    recording = clean((ALONG_X,))
    frame = recording.frame
    skewed = frame.assign(approach_k=1e-7 * frame["approach_i"], z_mm=250.0)
    data = make_residuals(replace(recording, frame=skewed), gauge(), machine())
    assert np.ptp(data.probings.coordinate_mm("z")) > 0.0
    assert "machine z" not in {one.name for one in covariates(data)}
    assert "machine x" in {one.name for one in covariates(data)}


def test_a_length_that_grows_with_a_column_is_told_and_imitated() -> None:
    """A scale that follows the load of a spindle; without the form two swings in time were named."""
    recording, random = clean(), np.random.default_rng(4)
    load = random.uniform(0.0, 10.0, len(recording.frame))
    loaded = replace(recording, frame=recording.frame.assign(load=load))
    middle = float(load[lies_on(recording) > 0.0].mean())
    found = told(bent(lambda r: 0.4 * (load - middle) * (x_mm(r) / 105.0) * side(r) * lies_on(r), loaded))
    assert found.verdict == "unknown"
    assert not found.findings
    assert (found.unexplained[0].covariate, found.unexplained[0].form) == ("load", "changing length")
    assert found.rest_rms_um < 1.05 * NOISE_UM


def test_a_drift_that_has_not_begun_to_settle_is_no_trend_without_a_law() -> None:
    """Along two gauges alike: a drift between x and y, with one number more than a line in time along the gauge."""
    found = told(bent(lambda r: 6.0 * r.frame["time_s"].to_numpy() / 3600.0 * side(r)))
    assert names(found) == ["thermal_drift"]


# Laws that stand together.


def long_scale_um(recording: Recording, ppm: float) -> Array:
    return ppm * 1e-3 * x_mm(recording) * side(recording) * lies_on(recording)


def swing_um(recording: Recording, period_s: float, um: float) -> Array:
    angle = 2.0 * np.pi * recording.frame["time_s"].to_numpy() / period_s
    return um * np.sin(angle) * (recording.frame[APPROACH].to_numpy() @ np.array([0.8, 0.6, 0.0]))


def warming_um(recording: Recording, hours: tuple[float, ...], um: float) -> Array:
    t = recording.frame["time_s"].to_numpy() / 3600.0
    rise = sum(1.0 - np.exp(-t / constant) for constant in hours) / len(hours)
    return um * rise * (recording.frame[APPROACH].to_numpy() @ np.array([0.95, 0.3, 0.0]))


def test_a_large_scale_error_and_a_large_swing_are_both_named() -> None:
    period_s = 170.0
    found = told(bent(lambda r: long_scale_um(r, 35.0) + swing_um(r, period_s, 2.5)))
    assert found.verdict == "effects"
    assert len(found.findings) == 2
    assert "temperature_cycle" in names(found)
    assert any("scale_error" in (one.kind, *one.confounded_with) for one in found.findings)
    (swing,) = (one for one in found.findings if one.kind == "temperature_cycle")
    told_s = swing.parameters["period_s"]
    assert told_s.u is not None
    assert abs(told_s.value - period_s) < 4.0 * told_s.u


def test_the_warming_of_two_bodies_is_one_drift() -> None:
    """Two time constants near each other are one within a few per cent: no second drift, and nothing unknown."""
    found = told(bent(lambda r: warming_um(r, (0.04, 0.06), 6.0)))
    assert found.verdict == "effects"
    assert names(found) == ["thermal_drift"]

"""Random functions by their evidence, and laws that depart from themselves: against closed forms and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.gaussian_processes.candidates import random_function_candidates
from stepgauge.diagnosis.gaussian_processes.random_function import BEAT, SAWTOOTH, SMOOTH, TREND, WAVE
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.effects import Probings, Setting
from stepgauge.recording import Recording
from tests.diagnosis.made import ALONG_X, gauge, machine, record
from tests.diagnosis.test_selection import (
    NOISE_UM,
    Array,
    bent,
    clean,
    lies_on,
    names,
    side,
    there_and_back,
    told,
)

# Structure that no formula follows, in recordings.


def rising(recording: Recording) -> Array:
    t = recording.frame["time_s"].to_numpy()
    return (t - t.min()) / np.ptp(t)


def warming_scale(recording: Recording) -> Array:
    """A scale that grows while it is measured with, by 20 ppm, and back by 10."""
    grown = 1.0 - np.exp(-rising(recording) / 0.12) * (1.0 + 9.0 * rising(recording))
    return 0.03 * grown * (recording.frame["x_mm"].to_numpy() - 350.0) * side(recording) * lies_on(recording)


def longer_in_one_cycle(recording: Recording) -> Array:
    frame = recording.frame
    odd = (frame["cycle"] == 3) & (frame["placement"] == 1)
    return 0.02 * odd.to_numpy() * (frame["x_mm"].to_numpy() - 350.0) * side(recording)


def worn_out(recording: Recording) -> Array:
    """A pre-travel that wanders while the probe is used."""
    t = rising(recording)
    return 1.2 * np.sin(9.0 * t**2) + 0.8 * t


STRUCTURE = {
    "a scale that grows and shrinks": (warming_scale, {"time", "machine x", "position"}, "length"),
    "one cycle with a length of its own": (longer_in_one_cycle, {"cycle", "time"}, "length"),
    "a pre-travel that wanders": (worn_out, {"time"}, "time"),
}


@pytest.mark.parametrize("name", STRUCTURE)
def test_structure_of_no_formula_is_told_where_it_lives_and_imitated(name: str) -> None:
    um, lives_in, word = STRUCTURE[name]
    found = told(bent(um))
    assert found.verdict == "unknown"
    assert lives_in & {one.covariate for one in found.located}
    assert any(word in one.where for one in (*found.located, *found.unexplained))
    left = found.after_um - sum(law.share_um for law in found.forms)
    assert left.std() < 0.75 * found.before_um.std()


def spoilt_corner(recording: Recording) -> Array:
    """What the x axis does where x and y are large, and nowhere else."""
    x, y = (recording.frame[name].to_numpy() for name in ("x_mm", "y_mm"))
    far = np.clip((x - 345.0) / 90.0, 0.0, None) * np.clip((y - 595.0) / 90.0, 0.0, None)
    return 5.0 * far**1.5 * recording.frame["approach_i"].to_numpy()


def test_a_spoilt_corner_of_the_volume_is_a_form_of_two_coordinates_and_no_law_of_one() -> None:
    found = told(bent(spoilt_corner, clean((ALONG_X, (0.0, 1.0, 0.0), (0.7, 0.7, 0.0), (0.7, -0.7, 0.0)))))
    assert (found.verdict, names(found)) == ("unknown", [])
    (one,) = found.unexplained
    assert {one.covariate, one.beside} == {"machine x", "machine y"}
    assert one.where == "a smooth function of machine x and machine y, along machine x"
    assert found.rest_rms_um < 1.1 * NOISE_UM


def test_what_follows_a_column_along_one_axis_only_is_told_so() -> None:
    """Two placements, one column that wanders: it moves the x axis and no other."""
    recording = clean()
    random = np.random.default_rng(8)
    damp = 50.0 + np.cumsum(random.normal(0.0, 0.4, len(recording.frame)))
    frame = recording.frame.assign(damp=damp)
    with_column = replace(recording, frame=frame)
    found = told(bent(lambda r: 2.0 * (damp > np.median(damp)) * r.frame["approach_i"].to_numpy(), with_column))
    assert found.verdict == "unknown"
    first = found.located[0]
    assert first.covariate == "damp"
    assert "along machine x" in first.where


def test_growing_structure_is_no_growing_scatter() -> None:
    """Jumps between two levels that grow with time, too quick to be drift: a matter of the column that they follow."""
    recording = clean()
    random = np.random.default_rng(9)
    switch = np.where(random.random(len(recording.frame)) > 0.5, 1.0, 0.0)
    with_column = replace(recording, frame=recording.frame.assign(switch=switch))
    found = told(bent(lambda r: 3.0 * rising(r) * (switch - 0.5), with_column))
    assert found.verdict == "unknown"
    assert "noise_growth" not in names(found)
    assert "switch" in {one.covariate for one in found.located}


def test_scatter_whose_kind_is_no_candidate_is_told_by_its_form() -> None:
    random = np.random.default_rng(3)
    recording = bent(lambda r: random.normal(0.0, 1.0, len(r)) * rising(r) * 1.5)
    assert names(told(recording)) == ["noise_growth"]
    found = diagnose(recording, gauge(), machine(noise_um=NOISE_UM), without=["noise_growth"])
    assert found.verdict == "unknown"
    assert not found.findings
    assert [(one.covariate, one.form) for one in found.unexplained] == [("time", "growing scatter")]
    assert found.forms == []


def test_a_bow_is_no_period_of_many_times_the_travel() -> None:
    bow = bent(lambda r: 3.0 * ((r.frame["x_mm"].to_numpy() - 350.0) / 105.0) ** 2 * side(r) * lies_on(r))
    found = diagnose(bow, gauge(), machine(noise_um=NOISE_UM), without=["scale_curvature"])
    for one in found.findings:
        if one.kind == "periodic_scale_error":
            assert one.parameters["period_mm"].value < 210.0


def test_the_way_since_turning_is_counted_from_where_it_turned() -> None:
    recording = there_and_back(clean((ALONG_X,)))
    since = Probings(recording.frame, Setting.of(machine(), gauge())).since_turning_mm()
    position = gauge().position_mm[recording.frame["face"].to_numpy() - 1]
    gone, way = 0.0, 0.0
    for row in range(1, len(position)):
        step = position[row] - position[row - 1]
        gone = gone + abs(step) if np.sign(step) == way and step != 0.0 else abs(step)
        way = np.sign(step)
        assert since[row] == pytest.approx(gone, abs=1e-9)


def test_a_search_ends_the_same_way_whatever_the_order_of_its_rows() -> None:
    recording = bent(worn_out)
    order = np.random.default_rng(2).permutation(len(recording.frame))
    shuffled = replace(recording, frame=recording.frame.iloc[order].reset_index(drop=True))
    found = [told(one) for one in (recording, shuffled)]
    assert found[0].verdict == found[1].verdict
    assert [one.where for one in found[0].located] == [one.where for one in found[1].located]


@pytest.mark.parametrize(
    ("axes", "laws", "trend"),
    [
        ((ALONG_X,), {"thermal_drift"}, False),
        ((ALONG_X, ALONG_X), {"thermal_drift"}, False),
        ((ALONG_X, (-1.0, 0.0, 0.0)), {"thermal_drift"}, True),
        ((ALONG_X, (0.0, 1.0, 0.0)), {"thermal_drift"}, False),
        ((ALONG_X, (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)), {"thermal_drift"}, True),
        ((ALONG_X,), set(), True),
    ],
)
def test_a_line_in_time_that_a_drift_gives_is_no_form(
    axes: tuple[tuple[float, float, float], ...], laws: set[str], trend: bool
) -> None:
    """A drift along the diagonal moves gauges along both axes alike, but not one turned round or on the diagonal."""
    data = make_residuals(record(machine(), axes), gauge(), machine())
    forms = [one.source for one in random_function_candidates(data, shipped_priors(), NOISE_UM, laws)]
    lines = {(form.side, form.covariate) for form in forms if form.shape == SMOOTH and TREND in form.kernels}
    assert (("gauge", "time") in lines) is trend
    assert ("x", "time") not in lines
    assert ("approach", "time") in lines


def test_what_a_law_takes_of_a_form_leaves_the_numbers_of_its_shapes() -> None:
    """The next measurement is predicted with the forms of a longer recording, by these numbers."""
    data = make_residuals(record(machine()), gauge(), machine())
    every = {one.label: one for one in random_function_candidates(data, shipped_priors(), NOISE_UM)}
    for one in random_function_candidates(data, shipped_priors(), NOISE_UM, {"thermal_drift", "thermal_shift"}):
        for atom, kernel in enumerate(one.source.kernels):
            assert kernel == every[one.label].source.kernels[atom]
            assert np.array_equal(one.columns(atom), every[one.label].columns(atom))


def test_a_shape_that_is_fitted_has_the_signature_of_its_numbers() -> None:
    """What a run that is to come would show follows from the numbers; a sawtooth of the grid falls less steeply."""
    data = make_residuals(record(machine(), axes=[ALONG_X], cycles=4), gauge(), machine())
    every = random_function_candidates(data, shipped_priors(), NOISE_UM)
    fitted = [one for one in every if getattr(one, "refine", None) and one.source.shape != SAWTOOTH]
    assert {one.source.shape for one in fitted} == {WAVE, BEAT}
    for one in fitted:
        for atom in (0, one.atoms - 1):
            of_numbers = np.concatenate([one.source.of([one.source.kernels[atom]])[0] * share for share in one.shares])
            np.testing.assert_allclose(of_numbers, one.columns(atom), atol=1e-3, err_msg=one.label)

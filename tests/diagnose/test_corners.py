"""Waves with corners: their looks against templates written out, their chance in scatter, what is told of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from stepgauge.diagnose.corners import (
    BINS,
    SAWTOOTH,
    SHAPES,
    SQUARE,
    TURNS,
    WaveLook,
    band_limited,
    formula,
    steeper,
    wave,
)
from stepgauge.diagnose.explain import all_forms
from stepgauge.diagnose.whitening import orthonormal

from stepgauge.diagnose.unknown_law import model_unknown
from stepgauge.effects import along_approach_um
from stepgauge.effects.empirical import Empirical
from stepgauge.recording import Recording
from tests.diagnose.made import ALONG_X
from tests.diagnose.test_selection import BETWEEN, NOISE_UM, along, bent, names, told
from tests.diagnose.test_smooth import data, whitening

Array = NDArray[np.float64]
PERIOD_S = 83.0
HEIGHT_UM = {SAWTOOTH: 0.45, SQUARE: 0.3}
"""Of waves that are told from sines and from a wandering: more, and any function of time would do."""


def waves_of(um: Array, model: Array | None = None) -> list[WaveLook]:
    """The waves that stand near strong sines in a displacement along the approach."""
    one, white = data(), whitening()
    beside = np.zeros((len(one), 0)) if model is None else model
    looks = all_forms(one, white).looks(white(um), beside, white.dof - beside.shape[1])
    return [look for look in looks if isinstance(look, WaveLook)]


def in_time(look: WaveLook, form: str) -> bool:
    return look.family.label == f"{form} in time, approach"


def test_waves_have_the_corners_and_the_fourier_series_that_they_are_named_for() -> None:
    turns = (np.arange(BINS * 40) + 0.5) / (BINS * 40)
    for form in SHAPES:
        exact = wave(form, turns)
        assert np.ptp(exact) == pytest.approx(2.0, abs=1e-2)
        limited = np.interp(turns, (np.arange(BINS) + 0.5) / BINS, band_limited()[SHAPES.index(form)][0])
        assert np.corrcoef(exact, limited)[0, 1] > 0.96
        assert np.corrcoef(exact, np.sin(2.0 * np.pi * turns))[0, 1] < 0.91
    assert np.abs(np.diff(wave(SAWTOOTH, turns))).max() < 0.01, "the jump of a sawtooth is at whole turns"
    assert np.flatnonzero(np.diff(wave(SQUARE, turns))) == [BINS * 20 - 1]


def test_a_band_limited_wave_is_steeper_than_a_sine_by_its_slope() -> None:
    """Numerically, from the slope of the waves of all phases at one place."""
    for form in SHAPES:
        fine = np.interp(np.linspace(0.0, BINS - 1, 4001), np.arange(BINS), band_limited()[SHAPES.index(form)][:, 0])
        slope = np.gradient(band_limited()[SHAPES.index(form)][:, 0], 2.0 * np.pi / BINS)
        assert (slope**2).mean() / (fine**2).mean() == pytest.approx(steeper(form), rel=0.3)


@pytest.mark.parametrize("form", SHAPES)
@pytest.mark.parametrize("beside", [0, 2])
def test_a_look_gains_what_its_wave_written_out_takes_off_the_sum_of_squares(form: str, beside: int) -> None:
    """Least squares of whitened columns, by a projection written out; the search works with sums over bins."""
    random = np.random.default_rng(7)
    um = 1.5 * wave(form, data().probings.time_s / PERIOD_S + 0.31) + random.normal(0.0, NOISE_UM, len(data()))
    model = orthonormal(whitening()(random.normal(size=(beside, len(data())))).T)
    (look,) = [one for one in waves_of(um, model) if in_time(one, form)]
    column = whitening()(wave(form, data().probings.time_s / look.period + look.ahead))
    column -= model @ (model.T @ column)
    left = whitening()(um) - model @ (model.T @ whitening()(um))
    assert look.gain == pytest.approx((column @ left) ** 2 / (column @ column), rel=0.08)
    assert look.period == pytest.approx(PERIOD_S, rel=0.02)
    half = TURNS[form] / 2.0  # a square wave half a period on is the same, turned over
    assert (look.ahead - 0.31 + half) % TURNS[form] - half == pytest.approx(0.0, abs=0.1)


def test_the_shape_that_is_there_gains_most() -> None:
    for form, other in ((SAWTOOTH, SQUARE), (SQUARE, SAWTOOTH)):
        looks = waves_of(wave(form, data().probings.time_s / PERIOD_S + 0.2))
        own, false = (next(look for look in looks if in_time(look, one)) for one in (form, other))
        assert own.gain > 1.1 * false.gain


def test_scatter_looks_like_a_wave_no_oftener_than_is_said() -> None:
    """Two hundred draws of mere scatter: the chance of the best wave in time is not below what it says."""
    forms = all_forms(data(), whitening())
    families = [family for one in forms.waves for family in one.families]
    (own,) = [family for family in families if family.label == "sawtooth in time, approach"]
    random = np.random.default_rng(11)
    none = np.zeros((len(data()), 0))
    found = []
    for _ in range(200):
        left = whitening()(random.normal(0.0, NOISE_UM, len(data())))
        looks = [look for look in forms.looks(left, none, whitening().dof) if look.family is own]
        found.append(float(np.exp(looks[0].log_p)) if looks else 1.0)
    chances = np.array(found)
    for said in (0.02, 0.1):
        assert (chances <= said).mean() <= said + 3.0 * np.sqrt(said * (1.0 - said) / len(chances))


@pytest.mark.parametrize("form", SHAPES)
def test_a_formula_is_the_wave(form: str) -> None:
    effect = Empirical(formula=formula(form, "time_s", PERIOD_S, 0.37))
    expected = wave(form, data().probings.time_s / PERIOD_S + 0.37)
    assert along_approach_um(effect, data().probings) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("form", SHAPES)
def test_a_wave_with_corners_is_no_oscillation_of_the_vocabulary(form: str) -> None:
    """Found with its form and period, what speaks against the sine, and a law that leaves little of it."""
    recording = bent(along(ALONG_X, lambda t: HEIGHT_UM[form] * wave(form, t / PERIOD_S)))
    found = told(recording)
    assert found.verdict == "unknown"
    assert not names(found)
    first = found.unexplained[0]
    assert (first.covariate, first.form) == ("time", form)
    law = model_unknown(found)[0]
    assert law.period == pytest.approx(PERIOD_S, rel=0.02)
    truth = HEIGHT_UM[form] * wave(form, found.data.probings.time_s / PERIOD_S) * found.data.probings.approach("x")
    assert np.corrcoef(law.share_um, truth)[0, 1] > 0.9
    assert law.share_um.std() == pytest.approx(truth.std(), rel=0.3)


def test_what_speaks_against_the_sine_is_told() -> None:
    found = told(bent(along(BETWEEN, lambda t: 0.6 * wave(SAWTOOTH, t / PERIOD_S))))
    assert found.verdict == "unknown"
    assert any("a sawtooth in time" in words and "a sine" in words for words in found.refuted)


@pytest.mark.parametrize("period_s", [97.0, 171.0, 303.0])
def test_a_sine_stays_an_oscillation(period_s: float) -> None:
    found = told(bent(along(ALONG_X, lambda t: 0.8 * np.sin(2.0 * np.pi * t / period_s + 0.4))))
    assert found.verdict == "effects"
    assert "temperature_cycle" in {kind for one in found.findings for kind in (one.kind, *one.confounded_with)}


@pytest.mark.parametrize("form", ["sine", SAWTOOTH])
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
    (first, *_) = found.unexplained
    assert (first.covariate, first.form) == ("machine x", form)
    assert model_unknown(found)[0].period == pytest.approx(97.0, rel=0.05)

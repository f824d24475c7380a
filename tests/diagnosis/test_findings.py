"""Recordings about which an earlier decision, made stage after stage, was wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine, MachineTable
from stepgauge.recording import Recording
from tests.build import make_gauge, make_machine
from tests.diagnosis.made import ALONG_X, ALONG_Y, by_hand, side_of

Array = NDArray[np.float64]
NOISE_UM = 0.3
STEPS = make_gauge(blocks=10)
Um = Callable[[pd.DataFrame], Array]


def cmm(noise_um: float = NOISE_UM) -> Machine:
    """A machine without errors, 1 m each way, that says how well it repeats."""
    plain = make_machine()
    stated = plain.table.model_dump() | {"repeatability_um": noise_um, "travel_mm": dict.fromkeys("xyz", (0.0, 1000.0))}
    return replace(plain, table=MachineTable.model_validate(stated))


def told(recording: Recording, steps: Gauge = STEPS, noise_um: float = NOISE_UM) -> GaugeDiagnosis:
    return diagnose(recording, steps, cmm(noise_um))


def kinds(found: GaugeDiagnosis) -> set[str]:
    return {one.kind for one in found.findings}


def every_law(one: Finding) -> set[str]:
    """All laws of a set by their labels."""
    return {one.label, *(member.label for member in one.members)}


def wandering(frame: pd.DataFrame, by: float = 1.0, seed: int = 3) -> Array:
    return np.cumsum(np.random.default_rng(seed).normal(0.0, by, len(frame)))


def turned(deg: float) -> tuple[float, float, float]:
    return (float(np.cos(np.radians(deg))), float(np.sin(np.radians(deg))), 0.0)


def wave_of_x(frame: pd.DataFrame) -> Array:
    return 1.2 * np.sin(2.0 * np.pi * frame["x_mm"].to_numpy() / 100.0) * frame["approach_i"].to_numpy()


# 1. Size counts.


def test_a_scale_is_periodic_by_a_micrometre_and_not_the_other_by_twenty() -> None:
    """100 mm of x are 5.25 mm of y on a gauge 3 degrees off x: the same signature, twenty times as large."""
    found = told(by_hand(make_gauge(blocks=20), wave_of_x, [turned(3.0)]), make_gauge(blocks=20))
    (one,) = found.findings
    assert one.label == "periodic_scale_error_x"
    assert one.parameters["period_mm"].value == pytest.approx(100.0, rel=0.03)
    assert one.parameters["amplitude_um"].value == pytest.approx(1.2, abs=0.25)


def test_farther_off_an_axis_either_scale_may_be_periodic_and_both_are_listed_with_their_values() -> None:
    deg = 10.0
    found = told(by_hand(make_gauge(blocks=20), wave_of_x, [turned(deg)]), make_gauge(blocks=20))
    (one,) = found.findings
    members = {
        member.label: member.parameters["period_mm"].value for member in one.members if "periodic" in member.label
    }
    assert members["periodic_scale_error_x"] == pytest.approx(100.0, rel=0.03)
    assert members["periodic_scale_error_y"] == pytest.approx(100.0 * np.tan(np.radians(deg)), rel=0.03)
    assert one.own < 0.97  # by the size alone, which is 5.7 times as large at 10 degrees


# 2. Aliases pay for the range that was looked at.


def late_humidity(frame: pd.DataFrame) -> Array:
    """What follows humidity with a lag of ten touches, 1.5 um high."""
    late = lfilter([0.1], [1.0, -0.9], wandering(frame) - wandering(frame)[0])
    return 1.5 * (late - late.mean()) / late.std()


def test_what_follows_a_column_with_a_lag_is_no_vibration() -> None:
    recording = by_hand(STEPS, lambda f: late_humidity(f) * side_of(f), cycles=10, humidity=wandering)
    found = told(recording)
    assert not kinds(found)
    assert found.unexplained[0].covariate == "humidity"
    assert "time constant" in found.unexplained[0].where


def test_a_product_of_a_wave_in_space_and_one_in_time_is_no_vibration() -> None:
    def product(f: pd.DataFrame) -> Array:
        place = (f["x_mm"].to_numpy() - 350.0) / 190.0
        return (
            2.0 * np.sin(2.0 * np.pi * 1.5 * place) * np.sin(2.0 * np.pi * f["time_s"].to_numpy() / 400.0) * side_of(f)
        )

    found = told(by_hand(STEPS, product, cycles=10))
    assert found.verdict == "unknown"
    assert "vibration" not in kinds(found)


@pytest.mark.parametrize("seed", [1])
def test_few_places_over_metres_have_no_period_of_millimetres(seed: int) -> None:
    """What twelve faces are off, in no pattern, is a sine of some period near the spacing over a whole number."""
    steps = make_gauge(blocks=6, size=100.0, gap=900.0)
    off = np.random.default_rng(seed).normal(0.0, 2.0, steps.n_faces)
    found = told(by_hand(steps, lambda f: off[f["face"].to_numpy() - 1] * side_of(f)), steps)
    assert "periodic_scale_error" not in kinds(found)


# 3. A form that is clearly better.


def warming_air(frame: pd.DataFrame) -> Array:
    """Nearly an exponential, with a door that was opened and the sun that came out."""
    t = frame["time_s"].to_numpy() / frame["time_s"].to_numpy().max()
    return (
        20.0 + 2.0 * (1.0 - np.exp(-t / 0.4)) - 0.5 * np.exp(-(((t - 0.35) / 0.05) ** 2)) + 0.4 * (t > 0.7) * (t - 0.7)
    )


def test_what_follows_a_recorded_temperature_is_no_drift() -> None:
    recording = by_hand(STEPS, lambda f: 3.0 * (warming_air(f) - 20.0) * side_of(f), cycles=10, air_C=warming_air)
    (one,) = told(recording).findings
    assert one.kind == "thermal_shift"
    assert one.choices["column"] == "air_C"
    assert "thermal_drift" not in one.confounded_with
    value = one.parameters["um_per_K"]
    assert value.u is not None
    assert abs(value.value - 3.0) < 3.0 * value.u


# 4. Known laws that explain all.


def two_bows(frame: pd.DataFrame) -> Array:
    """Both guideways bowed."""
    x, y = (2.0 * frame[name].to_numpy() / 1000.0 - 1.0 for name in ("x_mm", "y_mm"))
    return 60.0 * (1.0 - x**2) * frame["approach_j"].to_numpy() + 45.0 * (1.0 - y**2) * frame["approach_i"].to_numpy()


def test_two_laws_that_explain_all_are_better_than_one_and_a_form() -> None:
    axes = [turned(deg) for deg in (45.0, -45.0, 20.0, 70.0)]
    found = told(by_hand(make_gauge(blocks=15), two_bows, axes, cycles=3), make_gauge(blocks=15))
    assert found.verdict == "effects"
    assert [one.kind for one in found.findings] == ["straightness"] * 2
    assert found.fit.chi2_dof_after < 1.3


# 5. A few coefficients that explain all.


def there_and_back(recording: Recording) -> Recording:
    """The second cycle in the order from the last face to the first, as rows only: nothing says when."""
    frame = recording.frame.copy()
    second = (frame["cycle"] == 2).to_numpy()
    frame.loc[second, "time_s"] = frame.loc[second, "time_s"].to_numpy()[::-1]
    return replace(recording, frame=frame.sort_values("time_s").drop(columns="time_s").reset_index(drop=True))


def test_a_bow_of_two_coefficients_is_no_form_of_seven() -> None:
    """Thirty-six rows of a probe that triggers later towards both ends: no two curves, one for each side."""
    steps = make_gauge(blocks=9)

    def bow(f: pd.DataFrame) -> Array:
        return 4.0 * ((f["x_mm"].to_numpy() - 350.0) / 90.0) ** 2

    found = told(there_and_back(by_hand(steps, bow, cycles=2)), steps)
    assert found.verdict == "unknown"
    assert not kinds(found)
    clearest = found.unexplained[0]
    assert clearest.form in ("bow", "smooth")
    assert clearest.covariate in ("machine x", "position")
    assert "approach" in clearest.where


# 6. Sets of several laws.


def test_a_gauge_longer_by_the_same_along_both_axes_is_warm_or_all_scales_are_cold() -> None:
    """One cause of a usual size is likelier than two scales of one size by chance; the two of them read the same."""

    def longer(f: pd.DataFrame) -> Array:
        return 10e-3 * ((f["x_mm"].to_numpy() - 350.0) + (f["y_mm"].to_numpy() - 600.0)) * side_of(f)

    found = told(by_hand(STEPS, longer, [ALONG_X, ALONG_Y]))
    (one,) = found.findings
    members = {member.label: member.parameters["delta_K"] for member in one.members if "temperature" in member.label}
    assert set(members) == {"gauge_temperature", "scale_temperature_all"}
    for label, kelvin in (("gauge_temperature", 10.0 / 11.5), ("scale_temperature_all", -10.0 / 11.5)):
        u = members[label].u
        assert u is not None
        assert abs(members[label].value - kelvin) < 4.0 * u


def test_a_warm_gauge_and_a_long_scale_are_no_other_scale_and_squareness_for_certain() -> None:
    """Along x and at 45 degrees both pairs are the same, and neither 8 um/m nor 12 urad is known to a twentieth."""

    def longer(f: pd.DataFrame) -> Array:
        x, y = f["x_mm"].to_numpy() - 350.0, f["y_mm"].to_numpy() - 600.0
        along = x * np.abs(f["approach_i"].to_numpy()) + y * np.abs(f["approach_j"].to_numpy())
        return 11.5e-3 * 0.7 * along * side_of(f) + 4e-3 * y * f["approach_j"].to_numpy()

    recording = by_hand(STEPS, longer, [ALONG_X, turned(45.0)], cycles=4, noise_um=0.15)
    found = told(recording, noise_um=0.15)
    for one in found.findings:
        if one.label in ("scale_error_x", "squareness_xy"):  # neither is there
            (size,) = one.parameters.values()
            assert size.u is not None
            assert abs(size.value) < 4.0 * size.u, one.label
    # beside another partner each has another size; with its true one it is as large as it is
    members = [member for one in found.findings for member in one.members]
    warmer = [member.parameters["delta_K"] for member in members if member.label == "gauge_temperature"]
    assert any(abs(size.value - 0.7) < 4.0 * (size.u or 0.0) for size in warmer)
    pairs = {frozenset(other.laws) for one in found.findings for other in one.several}
    # or one of the two is named, and the other one is in the set of what is beside it
    pairs |= {
        frozenset({a.label, m.label}) for a in found.findings for b in found.findings if a is not b for m in b.members
    }
    assert frozenset({"scale_error_x", "squareness_xy"}) in pairs
    assert frozenset({"gauge_temperature", "scale_error_y"}) in pairs


@lru_cache
def skewed() -> GaugeDiagnosis:
    """A scale and a squareness on a short gauge, far from the machine's nought."""

    def um(f: pd.DataFrame) -> Array:
        x, y = f["x_mm"].to_numpy(), f["y_mm"].to_numpy()
        return (8e-3 * x + 12e-3 * y) * f["approach_i"].to_numpy()

    return told(by_hand(make_gauge(blocks=6), um, [ALONG_X, turned(45.0)]), make_gauge(blocks=6))


def test_an_uncertainty_holds_what_the_partner_may_be() -> None:
    """Whatever is named of a scale and a squareness, its value is the truth within four standard uncertainties."""
    truth = {"scale_error_x": ("ppm", 8.0), "squareness_xy": ("urad", 12.0)}
    for one in skewed().findings:
        if one.label in truth:
            name, value = truth[one.label]
            estimate = one.parameters[name]
            assert estimate.u is not None
            assert abs(estimate.value - value) < 4.0 * estimate.u


# 7. What is told is of a piece.


def hidden_wave(frame: pd.DataFrame) -> Array:
    return 1.0 * np.sin(frame["time_s"].to_numpy() ** 1.3 / 90.0) * side_of(frame)


CASES: dict[str, Callable[[], GaugeDiagnosis]] = {
    "nothing": lambda: told(by_hand(STEPS, lambda f: np.zeros(len(f)))),
    "a chirp": lambda: told(by_hand(STEPS, hidden_wave, cycles=8)),
    "two laws": skewed,
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_told_does_not_contradict_itself(name: str) -> None:
    found = CASES[name]()
    for one in found.findings:
        assert one.probability > 0.5
        assert 0.0 < one.own <= one.probability + 0.05
        size = next((e for e in one.parameters.values() if e.unit.startswith(("um", "urad", "K", "mm"))), None)
        assert size is None or size.u is None or abs(size.value) > 2.0 * size.u
    added = [step.label for step in found.trail if step.action == "added"]
    assert len(added) == len(set(added))
    if found.verdict in ("adequate", "effects"):
        assert not found.unexplained
        assert found.fit.chi2_dof_after < 1.4
    assert {step.label for step in found.trail} or found.verdict == "adequate"


# 8. Stretches of good readings.


def late_heater(frame: pd.DataFrame) -> Array:
    t = frame["time_s"].to_numpy() - 300.0
    return 100.0 * np.where(t > 0.0, 1.0 - np.exp(-np.maximum(t, 0.0) / 60.0), 0.0) * side_of(frame)


def test_a_change_that_begins_fast_has_no_outliers_and_is_no_step() -> None:
    found = told(by_hand(STEPS, late_heater, cycles=25, noise_um=1.3, every_s=2.0), noise_um=1.3)
    assert found.noise.outliers.size == 0
    assert "outliers" not in kinds(found)
    assert "step_change" not in kinds(found)
    assert found.verdict in ("unknown", "effects")


# 9. Structure is no scatter.


def late_unrest(frame: pd.DataFrame, seed: int) -> Array:
    """Still for three fifths of the record, then smooth ups and downs of 2 um about twenty-five seconds wide."""
    t = frame["time_s"].to_numpy() / frame["time_s"].to_numpy().max()
    knots = np.linspace(-0.1, 1.1, int(1.2 / 0.07) + 2)
    bumps = np.exp(-0.5 * ((t[:, None] - knots) / 0.07) ** 2)
    smooth = bumps @ np.random.default_rng(seed).normal(size=len(knots))
    return np.where(t > 0.6, 2.0 * (smooth - smooth.mean()) / smooth.std(), 0.0)


@pytest.mark.parametrize("seed", [1])
def test_structure_that_begins_late_is_no_growing_scatter(seed: int) -> None:
    """Repeats agree early and differ late, but neighbours in time always agree."""
    steps = make_gauge(blocks=6)
    recording = by_hand(steps, lambda f: late_unrest(f, seed + 50) * side_of(f), cycles=6, seed=seed)
    found = told(recording, steps)
    assert not kinds(found)
    assert found.unexplained[0].covariate == "time"


# 10. Correlated scatter.


def autoregressive(frame: pd.DataFrame, seed: int) -> Array:
    """AR(1) by 0.9 from touch to touch, with twice the standard deviation that the machine file says."""
    random = np.random.default_rng(seed)
    white = random.normal(0.0, 2.0 * NOISE_UM, len(frame))
    return np.asarray(lfilter([np.sqrt(1.0 - 0.81)], [1.0, -0.9], white)) * side_of(frame)


def flicker(frame: pd.DataFrame, seed: int) -> Array:
    """Power in proportion to 1/f."""
    random, n = np.random.default_rng(seed), len(frame)
    spectrum = np.fft.rfft(random.normal(size=n)) / np.sqrt(np.maximum(np.arange(n // 2 + 1), 1.0))
    values = np.fft.irfft(spectrum, n)
    return np.asarray(2.0 * NOISE_UM * values / values.std())


@pytest.mark.parametrize("seed", [2])
def test_scatter_that_is_correlated_along_the_gauge_is_no_step(seed: int) -> None:
    """Sixty touches in five minutes: what wanders with a memory of ten touches often stays high, and then low."""
    steps = make_gauge(blocks=6)
    found = told(by_hand(steps, lambda f: autoregressive(f, seed), noise_um=0.05, seed=seed + 10), steps)
    assert not kinds(found)
    assert found.unexplained[0].covariate == "time"


@pytest.mark.parametrize("seed", [1])
def test_flicker_has_no_name(seed: int) -> None:
    found = told(by_hand(STEPS, lambda f: flicker(f, seed), noise_um=0.05, cycles=10))
    assert not [one.kind for one in found.findings if one.probability > 0.9]


# 11. What is physically possible.


def test_a_short_gauge_does_not_bend_by_its_hair() -> None:
    """Seventy micrometres on forty millimetres: no gauge sags so."""
    steps = make_gauge(blocks=3, size=8.0, gap=8.0)

    def bow(f: pd.DataFrame) -> Array:
        return 70.0 * ((f["x_mm"].to_numpy() - 350.0) / 20.0) ** 2 * side_of(f)

    found = told(by_hand(steps, bow, cycles=15), steps)
    assert "gauge_bending" not in {kind for one in found.findings for kind in (one.kind, *one.confounded_with)}


def test_the_year_is_no_period_beyond_a_bound() -> None:
    """Monthly series over two years and a half: a swing with the seasons, told as one or as a function of time."""
    month_s, year_s = 30.4 * 86400.0, 365.25 * 86400.0
    steps = make_gauge(blocks=4)

    def seasons(f: pd.DataFrame) -> Array:
        return 2.0 * np.sin(2.0 * np.pi * f["time_s"].to_numpy() / year_s) * side_of(f)

    def monthly(f: pd.DataFrame) -> Array:
        return (f["cycle"].to_numpy() - 1.0) * month_s + 20.0 * f["face"].to_numpy()

    found = told(by_hand(steps, seasons, cycles=30, time_s=monthly), steps)
    assert found.verdict in ("effects", "unknown")
    for one in found.findings:
        assert one.kind == "temperature_cycle"
        assert one.parameters["period_s"].value == pytest.approx(year_s, rel=0.1)
    assert {one.covariate for one in found.unexplained} <= {"time", "cycle", "rest before the touch"}


# 12. Every member of a set says what it means.


def test_every_member_of_a_set_has_its_value_and_its_instruction() -> None:
    recording = by_hand(STEPS, lambda f: 12e-3 * (f["x_mm"].to_numpy() - 350.0) * side_of(f))
    (effect,) = diagnosis_to_dict(told(recording))["effects"]
    members = {one["label"]: one for one in effect["set"]}
    assert {"scale_error_x", "gauge_temperature"} <= set(members)
    assert sum(one["conditional_probability"] for one in members.values()) == pytest.approx(1.0)
    scale, warm = members["scale_error_x"], members["gauge_temperature"]
    assert scale["parameters"]["ppm"]["value"] == pytest.approx(12.0, abs=4.0 * scale["parameters"]["ppm"]["u"])
    assert abs(warm["parameters"]["delta_K"]["value"]) == pytest.approx(12.0 / 11.5, rel=0.3)
    assert "x scale" in scale["meaning"]
    assert "K" in warm["meaning"]
    assert len({one["meaning"] for one in members.values()}) == len(members)

"""Periods at evenly spaced targets: what agrees there is named, what cannot be seen is said, uneven targets decide."""

from __future__ import annotations

import re

import numpy as np
import pytest

from stepgauge.diagnosis.axis.diagnosis import AxisDiagnosis, diagnose_axis
from stepgauge.diagnosis.wording.aliases import even, uneven_targets
from stepgauge.reports.diagnosis import diagnosis_story, first_of
from stepgauge.reports.render import markdown
from tests.axis.made import axis

SCREW_MM = 5.0


def screw(targets: np.ndarray) -> AxisDiagnosis:
    """An axis whose screw errs by 3 um with its lead, measured at some targets."""
    return diagnose_axis(axis(targets, lambda t, w: 3.0 * np.sin(2.0 * np.pi * t / SCREW_MM + 1.0)))


def amplitude_at(places: np.ndarray, made: float, fitted: float) -> float:
    """Share of a wave of one period that one of another period explains at some places."""
    angle = 2.0 * np.pi * places / fitted
    columns = np.column_stack([np.sin(angle), np.cos(angle)])
    wave = np.sin(2.0 * np.pi * places / made + 0.4)
    rest = wave - columns @ np.linalg.lstsq(columns, wave, rcond=None)[0]
    return 1.0 - float(rest @ rest) / float(wave @ wave)


@pytest.mark.parametrize("spacing", [7.3, 26.0, 60.0])
def test_aliases_agree_at_even_places_and_at_uneven_ones_no_more(spacing: float) -> None:
    """The closed form 1/(1/P +- k/d), at places that are half gaps, too."""
    places = np.delete(np.arange(0.0, 31.0) * spacing, [3, 4, 11])
    steps, period = (
        even(np.tile(places, 3) + np.random.default_rng(1).normal(0.0, 1e-5, 3 * len(places))),
        5.3 * spacing,
    )
    assert steps is not None
    assert steps.spacing == pytest.approx(spacing)
    assert spacing / (1.0 - 1.0 / 5.3) == pytest.approx(max(steps.alike(period)))
    for alias in steps.alike(period, 0.01, 1.0):
        assert amplitude_at(places, period, alias) == pytest.approx(1.0, abs=1e-6)
        assert amplitude_at(np.array(steps.uneven()), period, alias) < 0.9


def test_places_without_a_common_step_have_no_aliases() -> None:
    """A step gauge's faces in pairs have one; targets with irregular parts have none but that of their last digit."""
    pairs = even([0.0, 6.0, 20.0, 26.0, 40.0, 46.0])
    assert pairs is not None
    assert pairs.spacing == pytest.approx(2.0)
    parts = np.array([0.0, 23.04, 29.11, 21.37, 27.52, 30.23, 18.06, 26.45])
    assert even(np.cumsum(parts)) is None
    whole = even(np.cumsum(np.round(parts)))
    assert whole is not None
    assert whole.spacing == pytest.approx(1.0)
    assert even([0.0, 10.0, 20.0]) is None


def test_an_alias_is_told_with_the_lead_of_the_screw_first_and_the_proposed_targets_show_the_lead() -> None:
    found = screw(np.arange(0.0, 801.0, 26.0))
    (effect,) = found.contents["effects"]
    assert effect["parameters"]["period_mm"]["value"] == pytest.approx(130.0, rel=0.01)
    assert effect["aliases"]["usual_mm"] == pytest.approx([SCREW_MM], abs=1e-3)
    assert effect["aliases"]["periods_mm"][0] == pytest.approx(SCREW_MM, abs=1e-3)
    assert "period 130 mm or an alias of it: 5.00, 32.5" in found.summary()
    page = markdown(diagnosis_story({**found.contents, "inputs": {"recordings": []}}))
    assert "5.00 mm (a usual lead of screws), 32.5, 21.7" in page
    assert "the probability is that of all of them together" in page
    told = " ".join(first_of(found.contents))
    assert "Nothing yet: the checks tell first" in told
    proposed = [float(one) for one in told.split("for example at ")[1].split(" mm")[0].split(", ")]
    (again,) = screw(np.array(proposed)).contents["effects"]
    assert again["parameters"]["period_mm"]["value"] == pytest.approx(SCREW_MM, rel=1e-3)
    assert again["aliases"] == {}


def test_a_period_of_two_spacings_is_no_alias_of_itself_and_no_alias_stands_twice() -> None:
    steps = even(np.arange(0.0, 401.0, 20.0))
    assert steps is not None
    found = steps.alike(40.0)
    assert found[:3] == pytest.approx([40.0 / 3.0, 8.0, 40.0 / 7.0])
    assert min(np.abs(np.diff(found))) > 0.1


@pytest.mark.parametrize("phase", [0.3, 0.7, 1.2])
def test_an_amplitude_of_which_less_than_a_beat_shows_is_a_lower_bound(phase: float) -> None:
    """2 um at 40.2 mm, read every 20 mm over 400 mm: a tenth of a beat, near the zeros of the wave at small phases."""
    law = lambda t, w: 2.0 * np.sin(2.0 * np.pi * t / 40.2 + phase) + 4e-3 * t  # noqa: E731
    found = diagnose_axis(axis(np.arange(0.0, 401.0, 20.0), law, 0.1))
    table = found.to_frame()
    amplitude = table[(table["parameter"] == "amplitude_um") & (table["rival_of"] == "")]
    assert set(amplitude["bound"]) <= {"least"}
    assert (amplitude["value"] - 2.0 * amplitude["u"] < 2.0).all()
    assert found.summary().count("amplitude ≥") == len(amplitude)
    if phase == 0.3:
        assert len(amplitude) == 1
        assert "its amplitude is a lower bound" in found.contents["effects"][1]["meaning"]


def test_an_amplitude_of_which_many_beats_show_is_told_with_its_u() -> None:
    found = screw(np.arange(0.0, 801.0, 26.0)).to_frame()
    amplitude = found[found["parameter"] == "amplitude_um"].iloc[0]
    assert amplitude["bound"] == ""
    assert abs(amplitude["value"] - 3.0) < 3.0 * amplitude["u"]


@pytest.mark.parametrize("last", [345.0, 360.0])
def test_a_wave_of_one_turn_shows_its_whole_amplitude_on_a_circle(last: float) -> None:
    steps = even(np.arange(0.0, last + 1.0, 15.0))
    assert steps is not None
    assert not steps.aliases(360.0, 0.0, "deg", None)["amplitude_is_least"]
    assert steps.aliases(500.0, 0.0, "deg", None)["amplitude_is_least"]


def test_a_lead_that_divides_the_spacing_is_not_seen_and_this_is_said() -> None:
    found = screw(np.arange(0.0, 801.0, 25.0))
    assert found.verdict == "adequate"
    assert "a period that divides the steps of 25.0 mm cannot be seen" in found.summary()
    assert any("whose period is 25.00 mm or a whole fraction of it" in one for one in found.contents["limits"])


def test_a_lead_is_found_at_uneven_targets_whatever_the_length_of_the_axis() -> None:
    """Of 1.2 m and of 80 mm, which are computed on other scales: the shortest period that is looked for is 2 mm."""
    for length_mm, lead_mm in ((1200.0, 7.0), (80.0, 2.5)):
        steps = even(np.arange(41.0) * length_mm / 40.0)
        assert steps is not None
        targets = np.array(steps.uneven())
        found = diagnose_axis(axis(targets, lambda t, w: 1.5 * np.sin(2.0 * np.pi * t / lead_mm) + 0.01 * t))  # noqa: B023
        by_kind = {one["kind"]: one["parameters"] for one in found.contents["effects"]}
        assert set(by_kind) == {"scale_error", "periodic_scale_error"}
        assert by_kind["periodic_scale_error"]["period_mm"]["value"] == pytest.approx(lead_mm, rel=1e-3)


def near_even(count: int = 25, digits: int = 3, seed: int = 1) -> np.ndarray:
    """Targets about 20 mm apart with irregular parts of 5 mm."""
    random = np.random.default_rng(seed)
    return np.round(20.0 * np.arange(count) + np.r_[0.0, random.uniform(-5.0, 5.0, count - 2), 0.0], digits)


@pytest.mark.parametrize("pitch_mm", [10.0, 7.0, 4.0, 2.0, 1.0])
def test_a_pitch_far_below_the_spacing_is_named_at_uneven_targets(pitch_mm: float) -> None:
    """4 mm was no candidate at 25 targets, and was told as 5 and as 10 mm."""
    law = lambda t, w: 9e-3 * t - 2.25 * w + 1.1 * np.sin(2.0 * np.pi * t / pitch_mm + 0.7)  # noqa: E731
    effects = {one["kind"]: one for one in diagnose_axis(axis(near_even(), law, 0.25)).contents["effects"]}
    assert set(effects) == {"scale_error", "reversal_error", "periodic_scale_error"}
    period = effects["periodic_scale_error"]["parameters"]["period_mm"]
    assert abs(period["value"] - pitch_mm) < 3.0 * period["u"]
    assert effects["periodic_scale_error"]["probability"] > 0.99


def test_a_pitch_that_is_finer_than_all_that_are_tried_is_an_amount_of_each_target_and_this_is_said() -> None:
    law = lambda t, w: 2.0 * np.sin(2.0 * np.pi * t / 0.137 + 0.7)  # noqa: E731
    found = diagnose_axis(axis(near_even(), law, 0.25)).contents
    assert (found["verdict"], found["effects"]) == ("unknown", [])
    assert "or a period below 0.96 mm" in found["located"][0]["where"]


def test_a_period_at_targets_in_whole_millimetres_has_aliases_beyond_two_of_them_only() -> None:
    law = lambda t, w: 1.1 * np.sin(2.0 * np.pi * t / 7.0)  # noqa: E731
    (effect,) = diagnose_axis(axis(near_even(digits=0, seed=3), law, 0.25)).contents["effects"]
    assert effect["parameters"]["period_mm"]["value"] == pytest.approx(7.0, rel=1e-3)
    assert effect["aliases"]["spacing_mm"] == pytest.approx(1.0)
    assert effect["aliases"]["periods_mm"][0] == pytest.approx(7.0 / 6.0, rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_few_targets_that_are_off_at_random_are_no_period_above_99_percent(seed: int) -> None:
    """Each by its own amount, 1.5 um: through seven places some wave of one or two can nearly be laid."""
    places = near_even(7, seed=100 + seed)
    off = np.random.default_rng(seed).normal(0.0, 1.5, len(places))
    found = diagnose_axis(axis(places, lambda t, w: np.interp(t, places, off), 0.25, seed=seed)).contents
    assert all(one["probability"] < 0.99 for one in found["effects"] if one["kind"] == "periodic_scale_error")


def test_of_many_targets_the_first_and_the_last_are_told() -> None:
    """150 readings of a mount were a paragraph of numbers."""
    steps = even(np.arange(150.0))
    assert steps is not None
    told = uneven_targets(steps, "deg").split("for example at ")[1]
    assert re.fullmatch(r"0, ([\d.]+, ){11}\.\., 149 deg\.", told)

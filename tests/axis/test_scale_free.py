"""An axis of any size, read in any units: what is said follows from its readings; what is one column is one set."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from stepgauge.axis.recording import AxisRecording
from stepgauge.axis.units import AxisUnits
from stepgauge.diagnosis.axis.conversion import UnitConversion
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.axis.residuals import axis_data
from stepgauge.diagnosis.priors import kind_probabilities, read_priors, shipped_priors
from stepgauge.effects.grids import most_periods
from stepgauge.errors import InputError
from tests.axis.made import axis, spot


def scanned(law: Any, speed: float = 0.25, rows: int = 150, noise_um: float = 0.3, unit: str = "mm") -> AxisRecording:
    """One pass at constant speed, read at random times; ``law``: deviation in um by position."""
    random = np.random.default_rng(4)
    time_s = np.sort(np.round(random.uniform(0.0, 80.0, rows), 3))
    target = 1.0 + speed * time_s
    away = law(target) + random.normal(0.0, noise_um, rows)
    reading = target + away / 1e3
    frame = pd.DataFrame({"placement": 1, "cycle": 1, "way": 1, "target": target, "reading": reading, "time_s": time_s})
    return AxisRecording(frame, "axis", AxisUnits.of(unit), "other", {"artefact": "targets"}, "axis.csv")


def stretched(one: AxisRecording, position: float, deviation: float, time: float) -> AxisRecording:
    """Positions, deviations and times multiplied."""
    frame = one.frame.copy()
    away = frame["reading"] - frame.get("target", 0.0)
    if "target" in frame:
        frame["target"] *= position
    frame["reading"] = frame.get("target", 0.0) + away * deviation
    if "time_s" in frame:
        frame["time_s"] *= time
    return replace(one, frame=frame)


def said(one: AxisRecording) -> dict[tuple[str, ...], float]:
    """What is said, without its numbers, with the probabilities."""
    told = diagnose_axis(one).contents
    found = {(told["verdict"],): 1.0}
    found |= {(e["kind"], *sorted(e["confounded_with"])): e["probability"] for e in told["effects"]}
    return found | {(f["covariate"], f["form"]): f["probability"] for f in told["unexplained"]}


LINE = np.arange(0.0, 300.0, 7.0)
MADE = {
    "wave": axis(LINE, lambda t, w: 3 * np.sin(np.pi * t / 20)),
    "reversal": axis(LINE, lambda t, w: 1.0 * w + 0.004 * t),
    "drift": spot(lambda t: 0.01 * (1 - np.exp(-t / 600)), 5e-4),
    "scan": scanned(lambda x: 5.0 * np.sin(2 * np.pi * x / 0.9)),
    "steps": spot(lambda t: 2e-3 * (t > 700.0) + 3e-3 * (t > 1400.0), 3e-4),
}
ALONE = [tuple(factor if i == place else 1.0 for i in range(3)) for place in range(3) for factor in (1e-3, 1e3)]
TOGETHER = [(1e-3, 1e-3, 1e-3), (1e3, 1e3, 1e3), (37.0, 0.3, 7.0)]


@pytest.mark.parametrize("name", MADE)
def test_what_is_said_does_not_depend_on_the_size_of_an_axis(name: str) -> None:
    """Positions, deviations and times, together, and of two kinds that are diagnosed quickly each alone."""
    found = said(MADE[name])
    for factors in (*TOGETHER, *(ALONE if name in ("drift", "scan") else ())):
        other = said(stretched(MADE[name], *factors))
        assert set(found) == set(other)
        assert all(abs(found[key] - other[key]) < 0.01 for key in found)


def test_a_ratio_of_deviation_and_position_that_is_unlikely_is_noted_and_prevents_nothing() -> None:
    """Its unit may be wrong; what is said does not depend on it. It was insufficient."""
    found = said(MADE["reversal"])
    for factors in ((1e3, 1e-3, 1e-3), (1e-3, 1e3, 1e3)):
        other = stretched(MADE["reversal"], *factors)
        assert all(abs(found.get(key, 0.0) - p) < 0.01 for key, p in said(other).items())
    assert any("unit" in note for note in diagnose_axis(other).summary().splitlines()[1:])


@pytest.mark.parametrize("span", [1000.0, 20.0, 1.0, 0.05])
def test_ten_periods_are_named_over_any_travel(span: float) -> None:
    """Below 2 mm there was no period: a wave of 0.1 mm was unknown."""
    targets = np.sort(np.random.default_rng(7).uniform(0.0, span, 60))
    found = diagnose_axis(axis(targets, lambda t, w: 2.0 * np.sin(20.0 * np.pi * t / span), 0.2)).contents
    (effect,) = found["effects"]
    assert (found["verdict"], effect["kind"]) == ("effects", "periodic_scale_error")
    assert effect["parameters"]["period_mm"]["value"] == pytest.approx(span / 10.0, rel=1e-2)


def test_at_constant_speed_a_wave_along_the_axis_and_one_in_time_are_one_set() -> None:
    """It was a vibration with the probability 1, and fans were to be switched off."""
    law = lambda x: 20.0 * np.sin(2 * np.pi * x / 0.25) + 0.7 * np.sin(2 * np.pi * x)  # noqa: E731
    effects = diagnose_axis(scanned(law)).contents["effects"]
    assert [effect["kind"] for effect in effects] == ["periodic_scale_error"] * 2
    assert any({"vibration", "temperature_cycle"} & {*effect["confounded_with"]} for effect in effects)
    for effect in effects:  # of two waves each hypothesis has one of the kind: that of the second counted for the first
        own = effect["set"][0]["conditional_probability"] if effect["set"] else 1.0
        assert effect["own_probability"] <= own + 1e-9


def test_the_worm_of_a_mount_is_not_an_air_conditioning_alone() -> None:
    found = diagnose_axis(spot(lambda t: 0.008 * np.sin(2 * np.pi * t / 605.0), 5e-4, rows=300)).contents
    assert {found["effects"][0]["kind"], *found["effects"][0]["confounded_with"]} >= {
        "drive_cycle",
        "temperature_cycle",
    }


def test_a_reversal_that_differs_along_the_axis_is_told_with_its_numbers() -> None:
    by_target = dict(zip((0, 10, 20, 30, 40), (94.0, 129.0, 131.0, 129.0, 112.0), strict=True))
    ways = lambda t, w: -w * np.array([by_target[round(one)] / 2.0 for one in t])  # noqa: E731
    made = axis(np.arange(0.0, 41.0, 10.0), ways, 1.5, ("deg", None))
    sorted_by_way = replace(made, frame=made.frame.sort_values(["cycle", "way", "target"], ignore_index=True))
    for one in (made, sorted_by_way):
        found = diagnose_axis(one).contents
        told = [form["where"] for form in found["unexplained"]]
        assert any("reversal error that differs along the axis: -9" in words for words in told), told
        assert not any(form["covariate"] == "order" for form in found["unexplained"])


def test_a_reversal_that_differs_between_three_targets_is_no_period_in_the_order_of_rows() -> None:
    """With a drift from cycle to cycle beside it: a table of three targets there and back, as a user brought it."""
    by_target = dict(zip((0, 20, 40), (62.0, 51.0, 20.0), strict=True))
    ways = lambda t, w: w * np.array([by_target[round(one)] / 2.0 for one in t]) - 1.3 * t  # noqa: E731
    made = axis(np.array([0.0, 20.0, 40.0]), ways, 0.4, sensor="dial")
    drifting = made.frame.assign(reading=made.frame["reading"] - 6e-4 * made.frame["cycle"])
    found = diagnose_axis(replace(made, frame=drifting)).contents
    assert not any("repeats in the order" in form["where"] for form in found["unexplained"])


def test_a_recorded_temperature_is_a_cause_whatever_its_column_is_called() -> None:
    made = spot(lambda t: np.zeros_like(t), 2e-3)
    warm = 24.0 + 4.0 * (1.0 - np.exp(-made.frame["time_s"] / 500.0))
    warm += np.random.default_rng(1).normal(0.0, 0.05, len(warm))
    frame = made.frame.assign(frame_C=warm, reading=made.frame["reading"] - 0.035 * (warm - 24.0))
    for name in ("frame_C", "Frame_degC", "bed_K"):
        found = diagnose_axis(replace(made, frame=frame.rename(columns={"frame_C": name}))).contents
        assert found["verdict"] == "effects"
        (effect,) = (one for one in found["effects"] if one["kind"] == "thermal_shift")
        assert effect["parameters"]["um_per_K"]["value"] == pytest.approx(-35.0, rel=0.05)


def test_two_waves_of_which_one_is_the_whole_travel_are_no_defect_at_a_place() -> None:
    """A defect 120 mm wide in a line of 300 mm had the probability 0.98: no period was as long as the line."""
    line = np.round(np.sort(np.random.default_rng(7).uniform(0.0, 300.0, 31)), 4)
    law = lambda t, w: 4.0 * np.sin(2 * np.pi * t / 300.0) + 2.0 * np.sin(4 * np.pi * t / 300.0 + 1.0)  # noqa: E731
    found = diagnose_axis(axis(line, law)).contents
    waves = ("periodic_scale_error", "interpolation_error")  # which is a wave with its second harmonic, as here
    assert all(one["kind"] in waves for one in found["effects"] if one["probability"] > 0.9)


def test_two_steps_are_two_steps() -> None:
    """The second was a drift that ends within half a minute, with the probability 1."""
    found = diagnose_axis(MADE["steps"]).contents
    assert sorted(round(one["parameters"]["um"]["value"]) for one in found["effects"]) == [2, 3]
    assert {one["kind"] for one in found["effects"]} == {"step_change"}


def test_what_rings_down_is_not_four_waves() -> None:
    """Four drives and slow cycles beat, each with the probability 1."""
    ringing = lambda t: 5e-3 * np.exp(-t / 1.5) * np.sin(2 * np.pi * 1.3 * t)  # noqa: E731
    found = diagnose_axis(spot(ringing, 1e-4, rows=300, every_s=0.02)).contents
    assert found["verdict"] == "unknown"
    assert not found["effects"]


def test_the_scatter_of_an_axis_is_not_compared_with_a_machine_file_that_it_has_not() -> None:
    """A wave that is faster than readings follow one another was a scatter a third of that which is stated."""
    found = diagnose_axis(spot(lambda t: 4e-4 * np.sin(2 * np.pi * 3.7 * t), 1e-4, rows=600, every_s=1 / 20.3)).contents
    assert "repeatability" not in [one["kind"] for one in found["effects"]]


def worm(**comments: str) -> AxisRecording:
    made = spot(lambda t: 0.008 * np.sin(2 * np.pi * t / 605.0), 5e-4, rows=200)
    return replace(made, units=AxisUnits.of("deg"), comments=comments)


def test_a_stated_kind_of_axis_brings_its_odds_and_an_unknown_one_is_refused() -> None:
    mount = diagnose_axis(worm(kind="telescope mount")).contents
    assert mount["effects"][0]["kind"] == "drive_cycle"
    assert mount["axis"]["kinds"] == {"telescope mount": 1.0}
    assert diagnose_axis(worm(), kind="telescope mount").contents["axis"] == mount["axis"]
    for stated in ({"kind": "telescope mout"}, {}):
        with pytest.raises(InputError, match="no kind of machine or axis; found telescope mout; expected telescope mo"):
            diagnose_axis(worm(**stated), kind=None if stated else "telescope mout")


def test_readings_tell_the_probability_of_each_kind_of_axis() -> None:
    """By Bayes' theorem over all sets of three causes, with any likelihood, under the prior that each kind gives."""
    priors, kinds, laws = shipped_priors(), ["rotary table", "telescope mount"], ["drive_cycle", "vibration", "roll"]
    odds = np.array([[priors.adapt([k]).laws.of(law).odds * priors.laws.odds for law in laws] for k in kinds])
    sets = np.array(list(product((0, 1), repeat=3)))
    likelihood = np.exp(np.random.default_rng(2).normal(0.0, 3.0, len(sets)))

    def joint(o: Any) -> Any:
        return likelihood * np.prod(np.where(sets, o, 1.0) / (1.0 + o), axis=1)

    by_kind = np.array([joint(o).sum() for o in odds])
    mean = joint(np.array([priors.adapt(kinds).laws.of(law).odds * priors.laws.odds for law in laws]))
    every = [SimpleNamespace(kind=law, named=True) for law in laws]
    held = [SimpleNamespace(candidates=[c for c, is_in in zip(every, one, strict=True) if is_in]) for one in sets]
    search = SimpleNamespace(problem=SimpleNamespace(candidates=every))
    answer = SimpleNamespace(search=search, weights=mean / mean.sum(), hypotheses=held)
    found = kind_probabilities(answer, kinds, priors)  # type: ignore[arg-type]
    assert [found[k] for k in kinds] == pytest.approx(by_kind / by_kind.sum())


def test_of_an_axis_whose_kind_nobody_stated_its_readings_tell_it() -> None:
    kinds = diagnose_axis(worm()).contents["axis"]["kinds"]
    assert next(iter(kinds)) == "telescope mount"
    assert set(kinds) == {"rotary table", "telescope mount", "encoder"}
    assert sum(kinds.values()) == pytest.approx(1.0)


def test_an_average_of_odds_over_kinds_is_that_of_each_cause() -> None:
    priors = shipped_priors()
    names = ["rotary table", "telescope mount", "encoder"]
    averaged = priors.adapt(names)
    for law in ("drive_cycle", "periodic_scale_error", "temperature_cycle", "scale_error"):
        each = [priors.adapt([name]).laws.of(law).odds for name in names]
        assert averaged.laws.of(law).odds == pytest.approx(np.mean(each))
    assert priors.adapt([]) is priors
    assert priors.adapt(["machine tool"]).laws.of("scale_error").usual > priors.laws.of("scale_error").usual


def test_a_kind_of_ones_own_is_as_good_as_a_shipped_one(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text('[kinds."star tracker"]\nmotion = "rotary"\nodds = { drive_cycle = 50.0 }\nwhy = "it is mine"\n')
    found = diagnose_axis(worm(), priors=read_priors(path), kind="star tracker").contents
    assert found["effects"][0]["kind"] == "drive_cycle"
    path.write_text('[kinds."star tracker"]\nodds = { drive_cykle = 50.0 }\n')
    with pytest.raises(InputError, match="drive_cykle is no kind of law; expected drive_cycle"):
        read_priors(path)


def test_a_condition_is_told_in_the_units_of_its_recording() -> None:
    """It was in the scaled mm of the computation: x_mm > 228 for 38 um of a piezo."""
    targets = np.linspace(0.0, 0.1, 41)
    made = axis(targets, lambda t, w: np.where(t > 0.038, 12.0 * w, 0.0), 0.3)
    conversion = UnitConversion(made.units, axis_data(made).scaling)
    factor = axis_data(made).scaling.position
    assert conversion.condition(f"x_mm > {0.038 * factor:.6g}") == "position > 0.03800 mm"
    assert conversion.condition("frame_C < 21.5") == "frame_C < 21.50"
    found = diagnose_axis(made).contents
    assert not any("x_mm" in one["where"] or "x_mm" in one["meaning"] for one in found["effects"])


@pytest.mark.parametrize("count", [600, 1000, 1012, 1500])
def test_a_scan_resolves_half_a_period_for_each_step_however_many_there_are(count: int) -> None:
    """Of more than a thousand readings all were one place: an encoder's error was scatter."""
    assert most_periods(0.0074 * np.arange(count)) == pytest.approx((count - 1) / 2.0)


def test_readings_near_one_another_are_of_one_place_however_many_there_are() -> None:
    places = np.repeat(np.arange(42) * 10.0, 30)
    scattered = places + np.random.default_rng(1).normal(0.0, 1e-3, places.size)
    assert most_periods(scattered) == pytest.approx(20.5, rel=1e-3)

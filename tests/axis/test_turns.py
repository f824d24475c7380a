"""Rotary axes: whole numbers of periods in a turn are causes with exact periods, which stand together."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.diagnosis.axis.diagnosis import AxisDiagnosis, diagnose_axis
from stepgauge.diagnosis.wording.aliases import even
from stepgauge.diagnosis.wording.findings import Subject, meaning, remedy, subject
from stepgauge.effects import grids
from stepgauge.effects.scales import PeriodicScaleError
from tests.axis.made import axis

NOISE, RUNS, TARGETS, REVERSAL = 0.3, 3, 36, 5.0
ROTARY = Subject("axis", "deg", "arcsec")


def diagnosed(seed: int, waves: dict[float, float]) -> AxisDiagnosis:
    """Uneven targets over a turn, both ways; ``waves``: amplitudes in arcsec by the number in a turn."""
    random = np.random.default_rng(seed)
    target = np.round(np.sort(random.uniform(0.0, 360.0, TARGETS)), 1)
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    parts = []
    for run in range(1, RUNS + 1):
        for way, name in ((1, "+"), (-1, "-")):
            at = target[::way]
            away = random.normal(-way * REVERSAL / 2.0, NOISE, TARGETS)
            for (count, size), phase in zip(waves.items(), phases, strict=False):
                away += size * np.sin(np.radians(count * at) + phase)
            columns = {"run": run, "direction": name, "target_deg": at, "deviation_arcsec": away}
            parts.append(pd.DataFrame(columns))
    recording = sg.import_recording(pd.concat(parts, ignore_index=True), sensor="autocollimator")
    return sg.diagnose(recording, kind="rotary table")


def closed_form_u(found: AxisDiagnosis, counts: list[float], count: float, phase_deg: float) -> tuple[float, float]:
    """Standard uncertainties of amplitude, and of amplitude times phase, by linear least squares of all waves."""
    frame = found.data.recording.frame
    turned = [np.radians(one * frame["target"].to_numpy()) for one in counts]
    columns = [np.ones(len(frame)), frame["way"].to_numpy(float), *map(np.sin, turned), *map(np.cos, turned)]
    covariance = NOISE**2 * np.linalg.inv(np.array(columns) @ np.array(columns).T)
    own = [2 + counts.index(count), 2 + len(counts) + counts.index(count)]
    phase = np.radians(phase_deg)
    along = np.array([[np.cos(phase), np.sin(phase)], [-np.sin(phase), np.cos(phase)]])
    by_sine, by_cosine = np.sqrt(np.diag(along @ covariance[np.ix_(own, own)] @ along.T))
    return float(by_sine), float(by_cosine)


@pytest.mark.parametrize("seed", [51, 52, 61, 63, 65])
def test_once_and_twice_a_turn_are_found_with_their_sizes_and_exact_periods(seed: int) -> None:
    """Two recordings have a worm of 3 deg, too; its own period is found."""
    made = {1.0: 6.0, 2.0: 2.0, **({120.0: 1.5} if seed in (51, 61) else {})}
    found = diagnosed(seed, made)
    said = found.contents
    assert said["verdict"] == "effects"
    assert sorted(one["kind"] for one in said["effects"]) == [*["periodic_scale_error"] * len(made), "reversal_error"]
    assert not any("label" in one for one in said["probabilities"]["possible"])
    waves = [one for one in said["effects"] if one["kind"] == "periodic_scale_error"]
    assert sorted(round(360.0 / one["parameters"]["period_deg"]["value"]) for one in waves) == list(made)
    for one in waves:
        known = one["parameters"]
        count = float(round(360.0 / known["period_deg"]["value"]))
        # that it is the second harmonic of something faint is hardly possible
        assert sum(rival["conditional_probability"] for rival in one["set"][1:]) < 0.1
        assert known["amplitude_arcsec"]["value"] == pytest.approx(made[count], abs=0.15)
        if count < 100.0:
            assert known["period_deg"]["value"] == pytest.approx(360.0 / count, rel=1e-9)
            assert known["period_deg"]["u"] is None
            u, across = closed_form_u(found, list(made), count, known["phase_deg"]["value"])
            assert known["amplitude_arcsec"]["u"] == pytest.approx(u, rel=0.3)
            assert known["phase_deg"]["u"] == pytest.approx(np.degrees(across / made[count]), rel=0.3)
            assert abs(known["amplitude_arcsec"]["value"] - made[count]) < 4.0 * u


def test_three_waves_of_a_turn_are_found_where_one_smooth_function_fits_as_well() -> None:
    """No step of the search leads from the function to all three; the averages meet them, and it goes on from there."""
    target = np.round(np.sort(np.random.default_rng(3).uniform(0.0, 360.0, TARGETS)), 1)
    sizes = {360.0: 4.0, 180.0: 2.0, 120.0: 1.0}
    law = lambda t, w: sum(a * np.sin(2.0 * np.pi * t / p + 360.0 / p - 1.0) for p, a in sizes.items())  # noqa: E731
    said = sg.diagnose(axis(target, law, units=("deg", None))).contents
    assert said["verdict"] == "effects"
    known = [one["parameters"] for one in said["effects"]]
    found = {round(one["period_deg"]["value"]): one["amplitude_arcsec"]["value"] for one in known}
    assert found == pytest.approx(sizes, abs=0.15)


def test_a_period_that_is_known_beforehand_is_told_with_what_is_usual_for_it() -> None:
    def told(period: float, u: float | None, language: str) -> str:
        period_deg = {"value": period, "u": u, "unit": "deg"}
        size = {"value": 6.0, "u": 0.1, "unit": "arcsec"}
        one = {"kind": "periodic_scale_error", "parameters": {"period_deg": period_deg, "amplitude_arcsec": size}}
        return meaning(one, ROTARY, language)

    assert "once a turn, as eccentricity does" in told(360.0, None, "en")
    assert "einmal je Umdrehung wie bei Exzentrizität" in told(360.0, None, "de")
    assert "twice a turn, as tilt or an elliptic seat does" in told(180.0, None, "en")
    assert "zweimal je Umdrehung" in told(180.0, None, "de")
    assert "3 times a turn, as a seat on 3 points does" in told(120.0, None, "en")
    assert "about 3 times a turn, by" in told(119.8, 0.4, "en")


def test_the_step_of_rounding_is_none_of_targets() -> None:
    """Targets 5 deg apart with irregular parts, to 0.1 deg; even ones with some left out have theirs."""
    random = np.random.default_rng(7)
    places = np.round(5.0 * np.arange(72.0) + random.uniform(-1.5, 1.5, 72), 1)
    assert even(places) is None
    assert even(np.r_[places, places[10] + 0.1]) is None
    left_out = even(np.delete(5.0 * np.arange(72.0), [4, 5, 30, 51]))
    assert left_out is not None
    assert left_out.spacing == pytest.approx(5.0)


def test_a_wave_of_a_turn_is_no_alias_of_rounding() -> None:
    places = np.round(15.0 * np.arange(24.0) + np.random.default_rng(8).uniform(-4.0, 4.0, 24), 1)
    found = sg.diagnose(axis(places, lambda t, w: 3.0 * np.sin(np.radians(t)), units=("deg", None)))
    assert "alias" not in found.summary()
    assert not any("whole steps" in one for one in found.contents["limits"])


def test_a_law_that_moves_little_beside_its_own_discrepancy_is_no_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the waves of a turn a local defect would take what is left by other shapes, as -0.6 +- 0.3."""
    monkeypatch.setattr(PeriodicScaleError, "per_turn", classmethod(lambda cls: {}))
    monkeypatch.setattr(grids, "LOCAL", 2.5)
    said = diagnosed(9, {1.0: 6.0, 2.0: 2.0, 120.0: 1.5}).contents
    assert "local_scale_defect" not in [one["kind"] for one in said["effects"]]


def test_a_summary_tells_eccentricity_tilt_and_a_worm_apart_and_their_repairs() -> None:
    """Three waves had one name and one repair, to clean the scale, also of a worm of 90 teeth."""
    targets = np.round(np.linspace(0.0, 355.0, 40) + np.random.default_rng(3).uniform(-2.0, 2.0, 40), 2)

    def law(x: np.ndarray, way: np.ndarray) -> np.ndarray:
        turn = np.radians(x)
        return 5.0 * np.sin(turn + 0.4) + 2.0 * np.sin(2.0 * turn) + 1.5 * np.sin(90.0 * turn + 1.0) + 0.0 * way

    found = diagnose_axis(axis(targets, law, 0.2, ("deg", None)))
    summary = found.summary().splitlines()[0]
    for words in ("(once a turn, as eccentricity does)", "(twice a turn, as tilt", "(about 90 times a turn)"):
        assert words in summary
    repairs = [remedy(one, subject(found.contents)).repair for one in found.contents["effects"]]
    assert sorted(one.split()[0] for one in repairs) == ["Adjust", "Centre", "Centre"]

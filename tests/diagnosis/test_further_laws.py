"""Concealed examples of tripods, recorded temperatures and local laws: random poses, faces off by their u, noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.laws.library import effect_families
from stepgauge.diagnosis.output.files import write_diagnosis
from stepgauge.diagnosis.output.probe_file import PROBE_FILE, probe_file
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import make_problem
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import Finding, GaugeDiagnosis
from stepgauge.diagnosis.wording.findings import meaning
from stepgauge.effects import Probings, Setting, along_approach_um, make_effects
from stepgauge.machine.file import read_machine
from stepgauge.physics.directions import iso_10360_5_points
from stepgauge.probes import read_probe
from stepgauge.recording import APPROACH, POSITION, Recording, read_recording
from tests.diagnosis.made import gauge, machine, record

BESIDE = "shared/findings/inputs/diagnosis"
STEPS = gauge()
INPUTS = next((up / BESIDE for up in Path(__file__).parents if (up / BESIDE).is_dir()), None)
Axis = tuple[float, float, float]


def turned(deg: float, tilt_deg: float = 0.0) -> Axis:
    """A gauge axis by its azimuth and its tilt."""
    azimuth, tilt = np.radians(deg), np.radians(tilt_deg)
    return float(np.cos(azimuth) * np.cos(tilt)), float(np.sin(azimuth) * np.cos(tilt)), float(np.sin(tilt))


def measured(axes: Sequence[Axis], seed: int, cycles: int = 4, order: str = "blocks") -> Recording:
    """Placements anywhere near the middle, simulated with noise; the faces are off as their uncertainties allow."""
    random = np.random.default_rng(seed)
    level = record(machine(), [(x, y, 0.0) for x, y, _ in axes], seed, cycles, order)
    frame = level.frame.copy()
    for number, axis in enumerate(axes, 1):
        rows = (frame["placement"] == number).to_numpy()
        turn = _turning(frame.loc[rows, APPROACH].to_numpy()[0], np.array(axis))
        middle = frame.loc[rows, POSITION].to_numpy().mean(axis=0)
        frame.loc[rows, POSITION] = (frame.loc[rows, POSITION].to_numpy() - middle) @ turn.T + middle
        frame.loc[rows, POSITION] += random.uniform(-30.0, 30.0, 3)
        frame.loc[rows, APPROACH] = frame.loc[rows, APPROACH].to_numpy() @ turn.T
    off_um = random.normal(0.0, STEPS.u_um)[frame["face"] - 1] * np.where(frame["face"] % 2 == 1, 1.0, -1.0)
    return moved(replace(level, frame=frame), off_um)


def _turning(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """The rotation that takes one unit vector to another."""
    across = np.cross(old, new)
    cross = np.cross(np.eye(3), across)
    return np.asarray(np.eye(3) + cross.T + cross.T @ cross.T / (1.0 + old @ new))


def moved(recording: Recording, um: np.ndarray) -> Recording:
    """Displaced along every approach."""
    frame = recording.frame.copy()
    frame[POSITION] += frame[APPROACH].to_numpy() * (um * 1e-3)[:, None]
    return replace(recording, frame=frame)


def bent(recording: Recording, *tables: dict[str, Any]) -> Recording:
    """With effects of the vocabulary."""
    seen = make_residuals(recording, STEPS, machine()).probings
    effects = make_effects([dict(table) for table in tables], "test")
    return moved(recording, np.sum([along_approach_um(effect, seen) for effect in effects], axis=0))


def told(recording: Recording) -> GaugeDiagnosis:
    return diagnose(recording, STEPS, machine())


def named(found: GaugeDiagnosis, kind: str) -> Finding:
    """The finding of a kind, which must lead its set."""
    kinds = [one.kind for one in found.findings]
    assert kind in kinds, (kinds, [one.where for one in found.unexplained])
    return found.findings[kinds.index(kind)]


def off(finding: Finding, name: str, truth: float, turn: float = np.inf) -> float:
    """How many standard uncertainties a value is off; an angle modulo a turn."""
    one = finding.parameters[name]
    assert one.u is not None
    apart = one.value - truth
    return abs(apart if turn == np.inf else (apart + turn / 2.0) % turn - turn / 2.0) / one.u


# The probe's tripod.

TRIPOD = {"kind": "kinematic_pretravel", "lever_mm": 65.0}
THREE = (turned(3.0), turned(40.0), turned(84.0))
NINE = tuple(turned(20.0 * i + 4.0) for i in range(9))


@pytest.mark.parametrize(("seed", "azimuth_deg"), [(2, -47.0)])
def test_a_tripod_is_named_with_its_phase_and_size_from_three_level_directions(seed: int, azimuth_deg: float) -> None:
    truth = TRIPOD | {"um_per_N": 5.0, "arm_azimuth_deg": azimuth_deg}
    one = named(told(bent(measured(THREE, seed), truth)), "kinematic_pretravel")
    assert one.choices["part"] in ("whole", "varying")  # its mean is as well a radius of the tip
    assert off(one, "um_per_N", 5.0) < 3.0
    assert off(one, "arm_azimuth_deg", azimuth_deg, 60.0) < 3.0
    # of level gauges it scales the size: little more is known than what is usual for this stylus
    assert off(one, "lever_mm", 65.0) < 2.0
    assert one.parameters["lever_mm"].u > 0.2 * 65.0


def test_tilted_in_three_directions_the_known_length_of_the_stylus_is_enough_to_tell_a_tripod() -> None:
    """Three numbers against a size, a phase, a lever and a stiffness along the stylus, of which two are usual."""
    axes = (turned(3.0, 30.0), turned(40.0, -35.0), turned(75.0))
    truth = TRIPOD | {"um_per_N": 20.0, "arm_azimuth_deg": 25.0, "lever_mm": 80.0, "along": 0.08, "part": "varying"}
    one = named(told(bent(measured(axes, 7), truth)), "kinematic_pretravel")
    assert one.choices["part"] == "varying"
    assert off(one, "arm_azimuth_deg", 25.0, 120.0) < 3.0
    assert off(one, "lever_mm", 80.0) < 3.0


def test_tilted_gauges_tell_the_lever_and_which_of_two_phases_it_is() -> None:
    axes = (*THREE, turned(15.0, 35.0), turned(60.0, 30.0), turned(115.0, 35.0))
    truth = TRIPOD | {"um_per_N": 8.0, "arm_azimuth_deg": 25.0, "lever_mm": 50.0}
    one = named(told(bent(measured(axes, 4), truth)), "kinematic_pretravel")
    assert off(one, "arm_azimuth_deg", 25.0, 120.0) < 3.0
    assert off(one, "lever_mm", 50.0) < 3.0
    assert off(one, "um_per_N", 8.0) < 3.0


def test_from_one_direction_a_tripod_is_one_of_a_set_with_a_radius() -> None:
    truth = TRIPOD | {"um_per_N": 5.0, "arm_azimuth_deg": 20.0}
    found = told(bent(measured((turned(3.0),), 5), truth))
    kinds = {name for one in found.findings for name in (one.kind, *one.confounded_with)}
    assert {"effective_radius", "reversal_error"} <= kinds
    assert not any(one.kind == "kinematic_pretravel" and one.own > 0.5 for one in found.findings)


def test_a_worn_seat_is_named_beside_the_tripod_from_many_directions() -> None:
    truth = TRIPOD | {"um_per_N": 6.0, "arm_azimuth_deg": 20.0}
    worn = truth | {"kind": "seat_defect", "share": 0.2}
    found = told(bent(measured(NINE, 6, cycles=3), truth, worn))
    kinds = {one.kind for one in found.findings} - {"effective_radius"}  # what a tripod's pre-travel is on average
    assert kinds == {"kinematic_pretravel", "seat_defect"}
    one = named(found, "seat_defect")
    assert off(one, "arm_azimuth_deg", 20.0, 180.0) < 3.0
    assert off(one, "um_per_N", 6.0) < 3.0


# Recorded temperatures, and what begins with an event.


def warmed(recording: Recording, seed: int) -> Recording:
    """With two temperatures that wander by half a kelvin, read to a hundredth."""
    random, time = np.random.default_rng(seed), recording.frame["time_s"].to_numpy()
    columns = {}
    for name, slow in (("air_C", 300.0), ("base_C", 900.0)):
        waves = [
            random.normal() * np.sin(2.0 * np.pi * (time / slow * f + random.random())) for f in (0.4, 0.7, 1.0, 2.3)
        ]
        swing = np.sum(waves, axis=0)
        columns[name] = 20.0 + 0.5 * swing / swing.std() + random.normal(0.0, 0.01, len(time))
    return replace(recording, frame=recording.frame.assign(**columns))


SHIFT = {"kind": "thermal_shift", "column": "base_C", "direction": "x", "um_per_K": 3.0}
GROWTH = {"kind": "thermal_expansion_of", "column": "air_C", "um_per_m_K": 9.0}
LAWS_OF_COLUMNS: dict[str, tuple[dict[str, Any], str]] = {
    "the origin at once": (SHIFT, "um_per_K"),
    "the origin nearly at once": (SHIFT | {"lag_s": 4.0}, "um_per_K"),
    "the origin late": (SHIFT | {"lag_s": 50.0, "um_per_K": 4.0}, "um_per_K"),
    "a scale late": (GROWTH | {"of": "x", "lag_s": 30.0}, "um_per_m_K"),
    "the gauge": (GROWTH | {"of": "gauge", "column": "base_C"}, "um_per_m_K"),
}


@pytest.mark.parametrize("name", LAWS_OF_COLUMNS)
@pytest.mark.parametrize("seed", [11])
def test_what_follows_a_temperature_is_named_with_its_column_and_lag(name: str, seed: int) -> None:
    truth, size = LAWS_OF_COLUMNS[name]
    one = named(told(bent(warmed(measured((turned(4.0), turned(80.0)), seed, 6), seed), truth)), truth["kind"])
    assert one.choices["column"] == truth["column"]
    assert off(one, size, truth[size]) < 3.0
    assert off(one, "lag_s", truth.get("lag_s", 0.0)) < 3.0  # a body that follows at once has an uncertainty, too
    if "of" in truth:
        assert one.choices["of"] == truth["of"]


def test_only_recorded_temperatures_that_change_are_candidates() -> None:
    recording = measured((turned(4.0),), 13)
    frame = recording.frame.assign(humidity=np.arange(len(recording)) % 7, hall_C=21.5)
    data = make_residuals(replace(recording, frame=frame), STEPS, machine())
    assert not [one for one in effect_families(data, shipped_priors()) if "column" in one.choices]


def test_lengths_and_angles_follow_no_temperature_that_is_nearly_constant() -> None:
    """A scale error would be the expansion by an air of 21.5 degrees; about 20 degrees the same air does vary."""
    recording = measured((turned(4.0),), 13)
    wave = 0.1 * np.sin(np.arange(len(recording)) / 9.0)
    for level, kinds in (
        (21.5, {"thermal_shift"}),
        (20.0, {"thermal_shift", "thermal_expansion_of", "thermal_bending"}),
    ):
        data = make_residuals(replace(recording, frame=recording.frame.assign(air_C=level + wave)), STEPS, machine())
        assert {one.kind for one in effect_families(data, shipped_priors()) if "column" in one.choices} == kinds


def test_an_origin_that_follows_a_temperature_is_a_law_and_no_form_unless_the_law_is_known_to_be_absent() -> None:
    data = make_residuals(warmed(measured((turned(0.0), turned(90.0)), 2), 2), STEPS, machine())
    along = {"lagged air_C  x", "lagged air_C  y"}
    assert not along & {one.label for one in make_problem(data, shipped_priors()).candidates}
    assert along <= {one.label for one in make_problem(data, shipped_priors(), ["thermal_shift"]).candidates}


def test_a_heater_that_goes_on_later_is_a_drift_from_that_event_on() -> None:
    recording = measured((turned(4.0),), 14, cycles=10)
    time = recording.frame["time_s"].to_numpy()
    begun, hours = float(time.min() + 0.45 * np.ptp(time)), float(np.ptp(time)) / 3600.0
    heater = {"kind": "thermal_drift", "direction": "x", "start_s": begun}
    truth = heater | {"rate_um_per_h": 12.0 / hours, "time_constant_h": 0.2 * hours}
    one = named(told(bent(recording, truth)), "thermal_drift")
    assert off(one, "start_s", begun) < 3.0
    assert off(one, "time_constant_h", 0.2 * hours) < 3.0
    assert off(one, "rate_um_per_h", 12.0 / hours) < 3.0
    assert " from " in meaning({"kind": one.kind, "parameters": {"start_s": {"value": begun, "unit": "s"}}})


SOAKING = {"kind": "gauge_soaking", "time_constant_h": 0.1}


@pytest.mark.parametrize(
    ("truth", "seed"), [(SOAKING | {"warmed": "once"}, 11), (SOAKING | {"warmed": "anew"}, 12)], ids=["once", "anew"]
)
def test_a_gauge_that_has_not_soaked_is_named_and_no_squareness_or_scale(truth: dict[str, Any], seed: int) -> None:
    """It was told as a squareness of 86(23) urad, or as a scale error and a drift: it was not in the vocabulary."""
    recording = measured((turned(4.0), turned(85.0)), seed, 6)
    (one,) = told(bent(recording, truth | {"delta_K": 0.8})).findings
    assert one.kind == "gauge_soaking"
    assert one.choices["warmed"] == truth["warmed"]
    assert off(one, "delta_K", 0.8) < 3.0
    assert off(one, "time_constant_h", 0.1) < 3.0


def test_a_gauge_laid_the_wrong_way_round_is_named_also_beside_a_scale_error() -> None:
    """It was told as a curve over its positions, without a cause."""
    recording, faces = measured((turned(4.0), turned(85.0)), 11), STEPS.position_mm
    mirrored = faces[-1] - faces[::-1]
    side = np.where(recording.frame["face"] % 2 == 1, 1.0, -1.0)
    laid = moved(recording, ((mirrored - faces) * 1e3)[recording.frame["face"] - 1] * side)
    (one,) = told(laid).findings
    assert one.kind == "gauge_reversed"
    assert off(one, "share", 1.0) < 3.0
    both = told(bent(laid, {"kind": "scale_error", "axis": "x", "ppm": 8.0}))
    assert {one.kind for one in both.findings} == {"gauge_reversed", "scale_error"}


def test_of_one_placement_a_gauge_was_warmed_once() -> None:
    data = make_residuals(measured((turned(4.0),), 13), STEPS, machine())
    soaking = [one for one in effect_families(data, shipped_priors()) if one.kind == "gauge_soaking"]
    assert [one.choices["warmed"] for one in soaking] == ["once"]


def test_an_event_is_told_by_the_clock_that_ran_before_the_measurement() -> None:
    recording = measured((turned(4.0),), 15, cycles=10)
    late = replace(recording, frame=recording.frame.assign(time_s=recording.frame["time_s"] + 1e6))
    time = late.frame["time_s"].to_numpy()
    begun, hours = float(time.min() + 0.5 * np.ptp(time)), float(np.ptp(time)) / 3600.0
    truth = {"kind": "thermal_drift", "direction": "x", "start_s": begun, "rate_um_per_h": 6.0 / hours}
    one = named(told(bent(late, truth)), "thermal_drift")
    assert off(one, "start_s", begun) < 3.0
    assert one.effect is not None
    assert one.effect.start_s == one.parameters["start_s"].value


# What acts in one place, after one way, at one speed.

TWO = (turned(4.0), turned(85.0))
FOUR = (turned(4.0), turned(-6.0), turned(88.0), turned(45.0))
JOINT = {"kind": "scale_joint", "axis": "x", "at_mm": 340.0}
SCREW = {"kind": "reversal_wear", "axis": "x", "at_mm": 330.0, "width_mm": 90.0, "um": 2.5}
CUBE = {"kind": "error_motion", "axis": "x", "component": "x", "order": 3, "about_mm": 350.0}
FLEXED = {"kind": "thermal_bending", "column": "air_C", "minus": "base_C", "axis": "x", "component": "y", "order": 2}
LOCAL: dict[str, tuple[Sequence[Axis], int, dict[str, Any], tuple[str, ...]]] = {
    "a gap between scales": (TWO, 4, JOINT | {"order": 0, "size": 1.6}, ("size",)),
    "another slope": (TWO, 4, JOINT | {"order": 1, "size": 28.0}, ("size", "at_mm")),
    "a worn screw": (TWO, 4, SCREW, ("um", "at_mm", "width_mm")),
    "another tip": (FOUR, 3, {"kind": "tip_change", "placement": 2, "um": 1.4}, ("um",)),
    "a scale that warms": (
        TWO, 8, {"kind": "scale_warm_up", "axis": "x", "um_per_m": 25.0, "time_constant_h": 0.04},
        ("um_per_m", "time_constant_h"),
    ),
    "a cubic error": (TWO, 6, CUBE | {"coefficient": 600.0}, ("coefficient",)),
    "a beam that bends": ((turned(25.0), turned(60.0)), 6, FLEXED | {"per_K": 200.0, "about_mm": 350.0}, ("per_K",)),
}  # fmt: skip


@pytest.mark.parametrize("name", LOCAL)
@pytest.mark.parametrize("seed", [21])
def test_what_acts_in_one_place_or_while_warming_is_named_with_its_values(name: str, seed: int) -> None:
    axes, cycles, truth, values = LOCAL[name]
    recording = warmed(measured(axes, seed, cycles), seed)
    one = named(told(bent(recording, truth)), truth["kind"])
    for value in values:
        assert off(one, value, truth[value]) < 3.0
    for choice in {"axis", "component", "order", "placement", "column", "minus"} & set(truth):
        assert one.choices[choice] == truth[choice]


@pytest.mark.parametrize("seed", [31])
def test_friction_after_turning_round_is_named_where_the_way_to_the_touch_differs(seed: int) -> None:
    truth = {"kind": "stick_slip", "axis": "x", "um": 2.4, "decay_mm": 6.0}
    one = named(told(bent(measured(TWO, seed, cycles=6, order="up-down"), truth)), "stick_slip")
    assert off(one, "um", 2.4) < 3.0
    assert off(one, "decay_mm", 6.0) < 3.0


def at_speeds(recording: Recording, *speeds: float) -> Recording:
    """Cycle after cycle at another measuring speed."""
    speed = np.array(speeds)[(recording.frame["cycle"].to_numpy() - 1) % len(speeds)]
    return replace(recording, frame=recording.frame.assign(speed_mm_s=speed))


def test_the_square_of_the_speed_is_named_from_several_speeds_and_of_two_one_of_a_set() -> None:
    truth = {"kind": "servo_lag", "um_per_mm2_s2": 0.04}
    one = named(told(bent(at_speeds(measured(TWO, 41), 1.0, 3.0, 6.0, 10.0), truth)), "servo_lag")
    assert off(one, "um_per_mm2_s2", 0.04) < 3.0
    two = told(bent(at_speeds(measured(TWO, 41), 1.0, 6.0), truth))
    said = {name for one in two.findings for name in (one.kind, *one.confounded_with)}
    assert {"servo_lag", "effective_radius + trigger_delay"} <= said


def test_of_placements_that_share_no_direction_another_tip_is_no_more_probable_than_a_reversal() -> None:
    """A radius that differs between x and y is a reversal of one axis: nothing tells the two apart."""
    found = told(bent(measured((turned(0.0), turned(90.0)), 42), {"kind": "reversal_error", "axis": "x", "um": 3.0}))
    assert "reversal_error" in {name for one in found.findings for name in (one.kind, *one.confounded_with)}
    assert "tip_change" not in {one.kind for one in found.findings}


def nothing_wrong(number: int) -> Recording:
    """Recordings of many kinds: few and many directions, temperatures that change, several speeds, both ways."""
    axes = [TWO, FOUR, THREE, (turned(20.0),), (*THREE, turned(30.0, 25.0))][number % 5]
    recording = measured(axes, 700 + number, cycles=4, order="up-down" if number % 2 else "blocks")
    recording = warmed(recording, number) if number % 3 else recording
    return at_speeds(recording, 1.0, 3.0, 8.0) if number % 4 == 0 else recording


@pytest.mark.parametrize("number", [0, 1, 4])
def test_where_nothing_is_wrong_no_law_is_named(number: int) -> None:
    assert not told(nothing_wrong(number)).findings


def test_a_tripod_is_written_as_a_probe_file_that_does_what_the_effect_does(tmp_path: Path) -> None:
    truth = TRIPOD | {"um_per_N": 5.0, "arm_azimuth_deg": 20.0}
    recording = bent(measured(THREE, 1), truth)
    found = told(recording)
    paths = write_diagnosis(tmp_path, replace(found, recordings=(recording,)))
    assert tmp_path / PROBE_FILE in paths
    assert PROBE_FILE in (tmp_path / "diagnosis.md").read_text("utf-8")
    approach = -iso_10360_5_points()
    columns = {f"approach_{letter}": approach[:, i] for i, letter in enumerate("ijk")}
    seen = Probings(columns, Setting.of(machine()))
    effect = named(found, "kinematic_pretravel").effect
    assert effect is not None
    um = effect.displacement_um(seen)["approach"]
    np.testing.assert_allclose(read_probe(tmp_path / PROBE_FILE).pretravel_um(approach), um, rtol=1e-6)


def test_without_a_tripod_no_probe_file_is_written() -> None:
    assert probe_file(told(measured((turned(4.0),), 43))) == ({}, [])


@pytest.mark.parametrize(("period_mm", "period_s"), [(110.0, 700.0), (60.0, 1500.0)])
def test_a_wave_along_the_gauge_times_one_in_time_is_no_temperature_cycle(period_mm: float, period_s: float) -> None:
    """It was told as oscillations in time, five of them where its period is longer than the record."""
    recording = measured((turned(3.0), turned(88.0)), 5, cycles=6)
    seen = make_residuals(recording, STEPS, machine())
    wave = np.sin(2 * np.pi * seen.probings.certified_mm() / period_mm)
    slow = np.sin(2 * np.pi * seen.probings.time_s / period_s)
    found = told(moved(recording, seen.side * 2.3 * wave * slow))
    assert found.verdict == "unknown"
    assert [one.form for one in found.unexplained] == ["beat"]
    assert not found.findings
    along, in_time = found.unexplained[0].numbers
    assert along == pytest.approx(period_mm, rel=0.05)
    assert in_time == pytest.approx(period_s, rel=0.1)


@pytest.mark.skipif(INPUTS is None, reason="the small inputs of the findings are not in the repository")
def test_two_straightnesses_are_no_roll_without_a_rival() -> None:
    """Guideways of one machine are of one grinding and age (``again``): as one roll they had a probability of 0.97."""
    assert INPUTS is not None
    recording = read_recording(INPUTS / "two-straightnesses.csv")
    found = diagnose(recording, STEPS, read_machine(INPUTS / "two-straightnesses-machine.toml"), separations=False)
    for one in found.findings:
        assert one.kind == "straightness" or (one.own < 0.9 and "straightness + straightness" in one.confounded_with)

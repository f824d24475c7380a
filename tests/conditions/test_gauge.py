"""The conditions of a recording of a gauge: each fault has its state, and a good recording has none."""

from __future__ import annotations

import datetime
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.conditions import Conditions, State
from stepgauge.conditions.certificate import table_conditions
from stepgauge.conditions.drift import drift_rate
from stepgauge.conditions.resolution import step_of
from stepgauge.correspondence.faces import cycles_of
from stepgauge.diagnosis.residuals import unchecked_residuals
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import PlacementResult, evaluate
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.planning.plan import PlanOptions, faces_in_order
from stepgauge.recording import Recording
from stepgauge.recording.conventions import complete_by_machine
from stepgauge.standards.iso230_decision import Requirement
from stepgauge.standards.lengths import face_table
from stepgauge.standards.positioning import positioning_test
from tests.build import make_machine
from tests.conditions.test_outliers import GAUGE, measured
from tests.standards.made import TIP_MM, made

SPAN_MM = float(GAUGE.position_mm[-1])
ASKED = Requirement({"A": 6.0}, 0.8)


def result(recording: Recording, gauge: Gauge = GAUGE) -> PlacementResult:
    return evaluate(recording, gauge).results[0]


def state(conditions: Conditions, name: str) -> list[State]:
    return [one.state for one in conditions if one.name == name]


def decision(recording: Recording, gauge: Gauge = GAUGE) -> str:
    test = positioning_test(recording, gauge, TIP_MM, requirement=ASKED)
    return test.requirement.outcomes({"A": test.axes[0].parameters.A_um})["A"]


def moved(recording: Recording, **um: object) -> Recording:
    """Coordinates moved by arrays of um."""
    frame = recording.frame.copy()
    for name, values in um.items():
        frame[f"{name}_mm"] += np.asarray(values) * 1e-3
    return replace(recording, frame=frame)


def at(recording: Recording, gauge_C: float, **scales: float) -> Recording:
    return replace(recording, frame=recording.frame.assign(gauge_temperature_C=gauge_C, **scales))


def test_a_good_recording_meets_everything_and_conforms() -> None:
    conditions = result(measured(1, 5)).conditions
    assert {one.name for one in conditions if one.state != "met"} == {"reversal"}
    assert decision(measured(1, 5)) == "conforms"


@pytest.mark.parametrize(("mrad", "expected"), [(5.0, "prevents"), (1.2, "contribution"), (0.1, "met")])
def test_a_tilt_of_the_readings_has_the_state_of_its_cosine_error(mrad: float, expected: State) -> None:
    good = measured(2, 5)
    tilted = moved(good, y=mrad * (good.frame["x_mm"] - good.frame["x_mm"].iloc[0]))
    (one,) = result(tilted).conditions.of("alignment")
    assert one.state == expected
    assert one.size_um == pytest.approx((mrad * 1e-3) ** 2 / 2.0 * SPAN_MM * 1e3, rel=0.01)
    assert (decision(tilted) == "no statement") == (expected == "prevents")


def test_a_cmm_that_corrects_to_20_is_a_question_until_somebody_says_so() -> None:
    """A perfect machine, the gauge at 22 deg C: XM is 0 where it is said, else 23e-6 of the length."""
    good = at(measured(3, 5), 22.0)
    asked = result(good)
    assert state(asked.conditions, "temperature convention") == ["prevents"]
    assert decision(good) == "no statement"
    said = good.assign_comments(temperature_convention="corrected_to_20")
    own = result(measured(3, 5))
    np.testing.assert_allclose(result(said).xm_um, own.xm_um, atol=1e-6)
    assert not result(said).conditions.preventing
    as_read = result(good.assign_comments(temperature_convention="as_read"))
    np.testing.assert_allclose(as_read.xm_um, asked.xm_um)
    last = np.flatnonzero(np.isfinite(own.xm_um))[-1]
    assert as_read.xm_um[last] - own.xm_um[last] == pytest.approx(-23e-6 * as_read.position_mm[last] * 1e3, abs=0.2)


def test_the_convention_of_the_machine_file_answers_the_question_in_every_verb() -> None:
    """What the message expects: the convention in the machine file; a recording that states another one keeps it."""
    good, plain = at(measured(3, 5), 22.0), make_machine()
    stated = replace(plain, table=plain.table.model_copy(update={"temperature_convention": "corrected_to_20"}))
    (asked,) = sg.evaluate(good, GAUGE, machine=plain).conditions.of("temperature convention")
    assert (asked.state, "temperature_convention in the machine file" in asked.expected) == ("prevents", True)
    found = sg.evaluate(good, GAUGE, machine=stated)
    np.testing.assert_allclose(found.results[0].xm_um, result(measured(3, 5)).xm_um, atol=1e-6)
    assert not found.conditions.preventing
    other = sg.evaluate(good, GAUGE, machine=stated, temperature_convention="as_read")
    np.testing.assert_allclose(other.results[0].xm_um, result(good).xm_um)
    warm, cold = (unchecked_residuals(one, GAUGE, stated).um for one in (good, measured(3, 5)))
    np.testing.assert_allclose(warm, cold, atol=1e-6)


def test_nominal_differential_expansion_corrects_scales_and_gauge() -> None:
    """Scales of 8e-6 / K at 25 deg C, exact at 20: they indicate the grown gauge too short by 8e-6 x 5."""
    true = measured(4, 5)
    grown = 1.0 + 5.0 * (GAUGE.table.expansion_per_K - 8e-6)
    x = true.frame["x_mm"].iloc[0] + (true.frame["x_mm"] - true.frame["x_mm"].iloc[0]) * grown
    read = at(replace(true, frame=true.frame.assign(x_mm=x)), 25.0, scale_temperature_x_C=25.0)
    machine = make_machine().table.model_copy(
        update={"temperature_convention": "nominal_expansion", "scale_expansion_per_K": 8e-6}
    )
    found = result(complete_by_machine(read, machine))
    np.testing.assert_allclose(found.xm_um, result(true).xm_um, atol=0.2)  # the tip is not corrected: 4 mm
    assert state(found.conditions, "temperature convention") == ["corrected"]
    with pytest.raises(InputError, match="needs scale_expansion_per_K"):
        result(read.assign_comments(temperature_convention="nominal_expansion"))
    with pytest.raises(InputError, match="temperature_convention is not known"):
        result(read.assign_comments(temperature_convention="nde"))


@pytest.mark.parametrize("timed", [True, False])
def test_a_drift_with_time_is_remarked_and_taken_off_if_asked(timed: bool) -> None:
    """20 nm a second, a reading every 2 s: over a cycle of 42 faces 1.64 um."""
    good = measured(5, 5)
    order = np.arange(len(good))
    drifting = moved(good, x=0.04 * order)
    if timed:
        drifting = replace(drifting, frame=drifting.frame.assign(time_s=2.0 * order))
    (one,) = result(drifting).conditions.of("drift")
    assert one.state == "contribution"
    assert one.size_um == pytest.approx(0.04 * 41, rel=0.05)
    assert ("+20" if timed else "+40") in one.found
    corrected = evaluate(drifting, GAUGE, correct_drift=True).results[0]
    assert state(corrected.conditions, "drift") == ["corrected"]
    np.testing.assert_allclose(corrected.xm_um, result(good).xm_um, atol=0.1)
    assert state(result(good).conditions, "drift") == ["met"]


def test_the_rate_of_a_drift_has_its_uncertainty() -> None:
    face, time = np.tile(np.arange(1, 21), 4), np.arange(80.0)
    off = [np.random.default_rng(seed).normal(0.0, 1.0, 80) + 0.1 * time + 7.0 * face for seed in range(200)]
    rates = np.array([drift_rate(one, face, time) for one in off])
    assert rates[:, 0].mean() == pytest.approx(0.1, abs=3.0 * rates[:, 0].std() / np.sqrt(200.0))
    assert rates[:, 1].mean() == pytest.approx(rates[:, 0].std(), rel=0.15)


@pytest.mark.parametrize("step_mm", [0.01, 0.001, 0.005, 0.00254, 0.002])
def test_the_step_of_a_display_is_seen_in_the_readings(step_mm: float) -> None:
    good = measured(6)
    rounded = replace(good, frame=good.frame.assign(x_mm=np.round(good.frame["x_mm"] / step_mm) * step_mm))
    (one,) = result(rounded).conditions.of("resolution")
    assert one.size_um == pytest.approx(step_mm * 500.0)
    assert one.state == "contribution"
    assert state(result(good).conditions, "resolution") == ["met"]


def test_values_near_each_other_have_no_step_beyond_their_distance() -> None:
    assert step_of(np.array([0.0, 0.001, 0.003, 0.002, 0.0047])) == pytest.approx(1e-4)
    assert step_of(np.random.default_rng(1).normal(0.0, 1e-3, 100)) == 0.0


def test_a_face_that_repeats_worse_than_the_others_is_remarked() -> None:
    good = measured(7)
    frame = good.frame.copy()
    frame.loc[frame["face"] == 7, "x_mm"] += np.array([-2.5, 0.0, 2.5]) * 1e-3
    (one,) = result(replace(good, frame=frame)).conditions.of("scatter")
    assert "face 7" in one.sentence
    assert not result(good).conditions.of("scatter")


@pytest.mark.parametrize(
    ("material", "expansion", "prevented"),
    [
        ("steel", 0.0, True),
        ("steel", 23e-6, True),
        ("ceramic", 9e-6, False),
        ("Invar 36", 11.5e-6, True),
        ("x", 0.0, False),
    ],
)
def test_an_expansion_that_is_not_of_the_material(material: str, expansion: float, prevented: bool) -> None:
    table = GAUGE.table.model_copy(update={"material": material, "expansion_per_K": expansion})
    found = result(measured(8), replace(GAUGE, table=table)).conditions
    assert (state(found, "certificate") == ["prevents"]) == prevented


@pytest.mark.parametrize(("gauge_C", "scale_C", "expected"), [(2.04, 20.0, "prevents"), (20.0, 23.0, "contribution")])
def test_temperatures_that_contradict_each_other(gauge_C: float, scale_C: float, expected: State) -> None:
    read = at(measured(9), gauge_C, scale_temperature_x_C=scale_C).assign_comments(temperature_convention="as_read")
    assert state(result(read).conditions, "temperature") == [expected]


@pytest.mark.parametrize(
    ("calibrated", "measured_at", "expected"),
    [
        (datetime.date(2026, 3, 2), "2026-01-05", ["prevents"]),
        (datetime.date(2001, 3, 2), None, ["prevents"]),
        (datetime.date(2021, 3, 2), "2026-01-05", ["contribution"]),
        (datetime.date(2025, 3, 2), "2026-01-05", []),
    ],
)
def test_the_date_of_the_measurement_beside_that_of_the_certificate(
    calibrated: datetime.date, measured_at: str | None, expected: list[State]
) -> None:
    certificate = GAUGE.certificate.model_copy(update={"date": calibrated})
    read = measured(10).assign_comments(measured_at=measured_at)
    assert state(result(read, replace(GAUGE, certificate=certificate)).conditions, "dates") == expected


def test_copied_cycles_decide_nothing() -> None:
    good = measured(11, 1).frame
    copies = Recording(good, {}, "r.csv")
    frames = [good.assign(cycle=cycle) for cycle in range(1, 6)]
    copies = replace(copies, frame=type(good)(np.vstack(frames), columns=good.columns).astype(good.dtypes))
    assert decision(copies) == "no statement"
    assert state(result(copies).conditions, "duplicates") == ["prevents"]


def test_the_decision_that_a_slip_would_have_turned() -> None:
    """A machine that is 10 um wrong over 410 mm, and a tilt that hides half of it."""
    wrong = made(GAUGE, lambda c, f: 25e-3 * GAUGE.position_mm[f - 1] + 0.1 * np.sin(7.0 * c * f), cycles=5)
    assert decision(wrong) == "does not conform"
    hidden = moved(wrong, y=5.0 * (wrong.frame["x_mm"] - wrong.frame["x_mm"].iloc[0]))
    assert decision(hidden) == "no statement"


def test_the_first_face_touched_again_belongs_to_its_cycle_and_shows_the_drift() -> None:
    """A plan of it, its faces counted as a log is read, and a standard that reads every length once."""
    options = PlanOptions(1, 6, cycles=3, first_again=True)
    planned = np.array(list(faces_in_order(options)))
    assert [tuple(row) for row in planned[11:14]] == [(1, 12), (1, 1), (2, 1)]
    np.testing.assert_array_equal(cycles_of(planned[:, 1]), planned[:, 0])
    noise = np.random.default_rng(12).normal(0.0, 0.2, len(planned))
    rows = [
        made(GAUGE, lambda c, f, i=i: 0.2 * i + noise[i], cycles=1, faces=[int(f)]).frame
        for i, (_, f) in enumerate(planned)
    ]
    frame = pd.concat(rows, ignore_index=True).assign(cycle=planned[:, 0])
    found = result(Recording(frame, {}, "again.csv"))
    (drift,) = found.conditions.of("drift")
    assert drift.state == "contribution"
    assert drift.size_um == pytest.approx(0.2 * 10, rel=0.1)  # the first face is read, in the mean, amid its cycles
    table = face_table(Recording(frame, {}, "again.csv"), GAUGE, 1)
    assert table.off_mm.shape == (3, 12)
    twice = frame.drop(index=frame.index[-1]).iloc[[*range(5), *range(4, len(frame) - 1)]].reset_index(drop=True)
    with pytest.raises(InputError, match="probed twice"):
        face_table(Recording(twice.assign(x_mm=twice["x_mm"] + 1e-6 * np.arange(len(twice))), {}, "t.csv"), GAUGE, 1)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"position_mm": (6, 0.049)}, "unlike those of the neighbours: face 7"),
        ({"position_mm": (6, -0.021)}, "unlike those of the neighbours: face 7"),
        ({"u_um": (4, 1.0)}, "uncertainties unlike the others"),
        ({"u_um": (-1, 10.0)}, "uncertainties unlike the others"),
    ],
)
def test_a_slip_in_the_certificates_table_is_named_without_any_reading(
    changed: dict[str, tuple[int, float]], words: str
) -> None:
    gauge = read_gauge("step-gauge-420")
    assert not list(table_conditions(gauge))
    for name, (face, by) in changed.items():
        column = getattr(gauge, name).copy()
        column[face] += by
        gauge = replace(gauge, **{name: column})
    (found,) = table_conditions(gauge)
    assert words in found.sentence
    assert found.state == "contribution"


def test_shipped_gauges_and_uncertainties_that_grow_are_as_they_have_to_be() -> None:
    for name in ("step-gauge-420", "step-gauge-1020"):
        gauge = read_gauge(name)
        assert not list(table_conditions(replace(gauge, u_um=0.05 + gauge.position_mm * 1e-3)))

"""What is ten and a thousand times the scatter: there a small fault of a model is told as one more cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.diagnosis.output.files import diagnosis_to_dict
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.wording.phrases import worded_all
from stepgauge.effects import along_approach_um, make_effects
from stepgauge.effects.probings import followed
from stepgauge.recording import APPROACH, POSITION, Recording
from tests.diagnosis.made import machine
from tests.diagnosis.test_further_laws import STEPS, measured, moved, named, turned
from tests.diagnosis.test_further_laws import bent as bent_of_steps
from tests.diagnosis.test_further_laws import told as told_of_steps
from tests.diagnosis.test_selection import bent, told

Array = NDArray[np.float64]


@pytest.mark.parametrize(("off_um", "rows"), [(2.0, (40,)), (20.0, (10, 40, 41)), (60.0, (40,)), (400.0, (10, 40, 41))])
def test_readings_however_far_off_are_named(off_um: float, rows: tuple[int, ...]) -> None:
    """From 7 to 1300 times the scatter. From 60 um on they passed for tails of a distribution, and as adequate."""

    def moved(recording: Recording) -> Array:
        um = np.zeros(len(recording.frame))
        um[list(rows)] = off_um
        return um

    found = told(bent(moved))
    assert found.verdict == "effects"
    (outliers,) = found.findings
    assert outliers.kind == "outliers"
    assert outliers.choices["rows"] == tuple(row + 1 for row in rows)
    assert outliers.probability > 0.9
    assert found.fit.chi2_dof_after < 1.2


def following(
    um_per_K: float,
    lag_s: float,
    pause_s: float,
    column: str = "air_temperature_C",
    doors_s: tuple[float, ...] = (),
) -> Recording:
    """An origin that follows the air, or as much of another column.

    It moves on while the gauge is laid anew and nobody reads the thermometer. ``doors_s``: when a door lets in air that
    is 1 K colder and mixes in three minutes.
    """
    recording = measured((turned(4.0), turned(80.0), turned(40.0)), 7, 10)
    frame = recording.frame.copy()
    frame["time_s"] += pause_s * (frame["placement"] - 1)
    dense_s = np.linspace(0.0, float(frame["time_s"].max()), 40_001)
    air = 20.0 + 0.8 * np.sin(2.0 * np.pi * dense_s / 3000.0) * np.minimum(dense_s / 300.0, 1.0)
    for opened_s in doors_s:
        air -= np.where(dense_s > opened_s, np.exp(-np.maximum(dense_s - opened_s, 0.0) / 180.0), 0.0)
    step, body = dense_s[1], np.full(len(dense_s), air[0])
    for i in range(1, len(body)):
        body[i] = body[i - 1] + (air[i] - body[i - 1]) * -np.expm1(-step / lag_s)
    um = um_per_K * (np.interp(frame["time_s"], dense_s, body) - 20.0)
    frame[column] = np.interp(frame["time_s"], dense_s, air).round(3)
    frame[POSITION[0]] += 1e-3 * um  # all of the machine but the gauge, along x
    return replace(recording, frame=frame)


@pytest.mark.parametrize("um_per_K", [3.0, 25.0])
def test_what_a_temperature_did_in_pauses_is_no_further_cause(um_per_K: float) -> None:
    """At 80 times the scatter it was told as a form over time beside the law, or as a step after each pause."""
    found = told_of_steps(following(um_per_K, 240.0, 500.0))
    assert [one.kind for one in found.findings] == ["thermal_shift"]
    assert not found.unexplained
    assert found.fit.chi2_dof_after < 1.1
    assert any("in pauses" in one for one in worded_all(found.remarks)) == (um_per_K > 10.0)
    one = named(found, "thermal_shift")
    assert one.choices["column"] == "air_temperature_C"
    lag = one.parameters["lag_s"]
    assert lag.u is not None
    assert abs(lag.value - 240.0) < 3.0 * lag.u


@pytest.mark.parametrize("opened_s", [700.0, 1000.0])
def test_nor_is_a_door_that_was_opened_in_a_pause(opened_s: float) -> None:
    """As it was opened while the gauge was probed: a step after the pause was told, with 1.0."""
    found = told_of_steps(following(25.0, 240.0, 500.0, doors_s=(250.0, opened_s, 1900.0)))
    assert [one.kind for one in found.findings] == ["thermal_shift"]
    lag = named(found, "thermal_shift").parameters["lag_s"]
    assert lag.u is not None
    assert abs(lag.value - 240.0) < 3.0 * lag.u


@pytest.mark.parametrize(("um", "share"), [(3.0, 0.28), (10.0, 0.07), (10.0, 0.14)])
def test_a_lag_of_which_no_law_is_known_is_found_between_those_of_the_grid(um: float, share: float) -> None:
    """From ten times the scatter on, the difference to the nearest lag of the grid was told as a drift or a wave."""
    recording = measured((turned(4.0), turned(80.0)), 7, 10)
    time_s = recording.frame["time_s"].to_numpy()
    lag_s = share * np.ptp(time_s)
    humid = np.cumsum(np.random.default_rng(7).normal(0.0, 1.0, len(time_s))).round(2)
    late = followed(time_s, humid, (lag_s,))[0]
    side = np.where(recording.frame["face"] % 2 == 1, 1.0, -1.0)
    humid_recording = replace(recording, frame=recording.frame.assign(humidity_pct=humid))
    found = told_of_steps(moved(humid_recording, um * side * late / late.std()))
    assert not found.findings
    (one,) = found.unexplained
    assert (one.covariate, one.form) == ("humidity_pct", "lagged")
    assert one.numbers == pytest.approx(lag_s, rel=0.06)


@pytest.mark.parametrize("um", [3.0, 25.0])
def test_nor_is_what_a_humidity_did_in_pauses_of_which_no_law_is_known(um: float) -> None:
    """At 80 times the scatter a form over the time was told in its place, or a drift after a pause beside it."""
    found = told_of_steps(following(um, 240.0, 500.0, "humidity_pct"))
    assert not found.findings
    assert [one.covariate for one in found.unexplained] == ["humidity_pct"]
    assert found.verdict == "unknown"


@pytest.mark.parametrize("step_um", [0.6, 2.0])
def test_readings_on_the_steps_of_a_display_scatter_by_no_less_than_the_steps(step_um: float) -> None:
    """Most repeat exactly: with outliers for the others the scatter vanished, and the search ended in an error."""
    recording = measured((turned(4.0), turned(80.0)), 9, 12)
    along_um = 1e3 * np.einsum("ij,ij->i", recording.frame[list(POSITION)], recording.frame[list(APPROACH)])
    found = told_of_steps(moved(recording, step_um * np.round(along_um / step_um) - along_um))
    assert found.verdict in ("adequate", "unknown")
    assert not found.findings
    assert found.noise.sigma_um > 0.99 * step_um / np.sqrt(12.0)


@pytest.mark.parametrize(("ppm", "possible"), [(300.0, True), (3000.0, False)])
def test_what_would_have_to_be_larger_than_can_be_is_no_cause(ppm: float, possible: bool) -> None:
    """A scale that is too long by 3 mm/m stood in a set with a scale at -241 deg C."""
    recording = measured((turned(4.0),), 3)
    found = told_of_steps(bent_of_steps(recording, {"kind": "scale_error", "axis": "x", "ppm": ppm}))
    one = named(found, "scale_error")
    assert one.parameters["ppm"].value == pytest.approx(ppm, abs=3.0)
    assert ("scale_temperature" in one.confounded_with) == possible
    assert sum(member.probability for member in one.members) == pytest.approx(1.0) if possible else not one.members
    assert one.probability > 0.9
    assert one.own > (0.5 if possible else 0.9)


def test_a_law_that_would_have_to_be_larger_than_it_can_be_is_not_named_and_nothing_fails() -> None:
    """Twenty times the compliance of a soft stylus: the command ended with an error about its own finding."""
    recording = measured(tuple(turned(angle) for angle in (4.0, 32.0, 58.0, 86.0)), 6)
    seen = make_residuals(recording, STEPS, machine()).probings
    (soft,) = make_effects([{"kind": "seat_defect", "um_per_N": 500.0, "lever_mm": 65.0, "share": 0.2}], "test")
    um = 10.0 * np.asarray(along_approach_um(soft, seen))
    found = told_of_steps(moved(recording, um))
    assert "seat_defect" not in [one.kind for one in found.findings]
    assert any("larger than that can be" in one.where for one in found.unexplained)
    assert found.verdict == "unknown"
    assert diagnosis_to_dict(replace(found, recordings=(recording,)))["verdict"] == "unknown"

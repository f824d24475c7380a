"""Drift tests: ranges of closed forms, and an axis that drifts under a step gauge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.recording import Recording
from stepgauge.standards.drift import Drift, beginning, drift_of_recording, drift_test, rules_of
from tests.build import make_gauge
from tests.standards.made import made

GAUGE = make_gauge(blocks=6)
HOUR = 3600.0


def warm_up(amplitude_um: float, tau_h: float, hours: float) -> Drift:
    time = np.linspace(0.0, hours * HOUR, 361)
    return Drift("t", time, {"x": amplitude_um * (1.0 - np.exp(-time / HOUR / tau_h))}, {"room": np.full(361, 20.0)})


def test_first_order_warm_up() -> None:
    """10 um, time constant 1 h, 6 h: d_60 = 10 (1 - 1/e), d_t = 10 (1 - e^-6), last hour 10 e^-5 (1 - 1/e)."""
    test = drift_test(warm_up(10.0, 1.0, 6.0), "axis")
    (one,) = test.channels
    assert one.first_hour_um == pytest.approx(10.0 * (1.0 - np.exp(-1.0)))
    assert one.range_um == one.end_um == pytest.approx(10.0 * (1.0 - np.exp(-6.0)))
    assert test.settled == pytest.approx(np.exp(-5.0))
    assert [rule.met for rule in rules_of(test)] == [True, True]
    assert [rule.met for rule in rules_of(drift_test(warm_up(10.0, 1.0, 2.0), "axis"))] == [True, False]


def test_etve_of_a_day() -> None:
    """A structure with one time constant follows a sine of the room: amplitude a k / sqrt(1 + (omega tau)^2)."""
    time = np.arange(0.0, 24.0 * HOUR + 1.0, 300.0)
    omega_tau = 2.0 * np.pi / 24.0 * 3.0
    um = 4.0 / np.hypot(1.0, omega_tau) * np.sin(2.0 * np.pi * time / (24.0 * HOUR) - np.arctan(omega_tau))
    test = drift_test(Drift("t", time, {"z": um}, {"room": np.sin(2.0 * np.pi * time / (24.0 * HOUR))}), "etve")
    assert test.values_um["z"] == pytest.approx(8.0 / np.hypot(1.0, omega_tau), rel=1e-3)
    assert test.temperature_ranges_K["room"] == pytest.approx(2.0, rel=1e-3)
    assert all(rule.met for rule in rules_of(test))
    short = drift_test(Drift("t", time[:100], {"z": um[:100]}, {}), "etve")
    assert [rule.met for rule in rules_of(short)] == [False, False, True]


@given(shift=st.floats(-1e3, 1e3), scale=st.floats(0.1, 10.0))
def test_ranges_do_not_depend_on_zero_and_grow_with_the_scale(shift: float, scale: float) -> None:
    drift = warm_up(5.0, 0.7, 3.0)
    moved = Drift("t", drift.time_s, {"x": shift + scale * drift.displacement_um["x"]}, {})
    assert drift_test(moved, "axis").values_um["x"] == pytest.approx(scale * drift_test(drift, "axis").values_um["x"])


def drifting(um_per_cycle: float, ppm_per_cycle: float, way_um: float = 0.0) -> Recording:
    """Cycles of 600 s in which all faces move and the scale grows; backs have an own error, which stays."""

    def error(cycle: int, face: int) -> float:
        grown = um_per_cycle + ppm_per_cycle * 1e-3 * GAUGE.position_mm[face - 1]
        return (cycle - 1) * grown + (0.0 if face % 2 else way_um)

    recording = made(GAUGE, error, cycles=13)
    recording.frame["time_s"] = 600.0 * (recording.frame["cycle"] - 1.0)
    return recording


def test_an_axis_under_a_step_gauge() -> None:
    """0.5 um and 2 ppm in each of 12 steps: P1 and P2 drift, and their distance of 100 mm by 2.4 um."""
    drift = drift_of_recording(drifting(0.5, 2.0, 3.0), GAUGE)
    found = drift_test(drift, "axis").values_um
    middle = GAUGE.block_centre_mm[[0, -1]]
    assert drift.span_mm == pytest.approx(middle[1] - middle[0])
    assert found["P2 − P1"] == pytest.approx(12 * 2e-3 * drift.span_mm, abs=1e-5)
    assert found["P1 +"] == pytest.approx(6.0, abs=1e-5)
    assert found["P2 −"] == pytest.approx(6.0 + 12 * 2e-3 * GAUGE.position_mm[-1], abs=1e-5)
    assert drift_test(drift, "axis").duration_s == 7200.0


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_all_is_told_along_the_axis_whichever_way_the_gauge_lies(way: float) -> None:
    """An axis y that indicates 2 ppm of its coordinate less in each step; faces touched on the way down 0.1 um less."""
    start = np.array([120.0, 340.0, 250.0])

    def error(cycle: int, face: int) -> float:
        down = (face % 2 == 1) == (way < 0.0)
        y_mm = start[1] + way * GAUGE.position_mm[face - 1]
        return way * (cycle - 1) * (-2e-3 * y_mm - (0.1 if down else 0.0))

    recording = made(GAUGE, error, axis=(0.0, way, 0.0), cycles=13, start_mm=start)
    recording.frame["time_s"] = 600.0 * (recording.frame["cycle"] - 1.0)
    found = {one.name: one.end_um for one in drift_test(drift_of_recording(recording, GAUGE), "axis").channels}
    low, high = sorted(start[1] + way * GAUGE.block_centre_mm[[0, -1]])
    half = np.diff(GAUGE.position_mm[:2])[0] / 2.0  # up: the lower face of a block; down: the upper one
    for name, y_mm in (("P1", low), ("P2", high)):
        assert found[f"{name} +"] == pytest.approx(-24e-3 * (y_mm - half), abs=2e-3)
        assert found[f"{name} −"] == pytest.approx(-24e-3 * (y_mm + half) - 1.2, abs=2e-3)
    assert found["P2 − P1"] == pytest.approx(-24e-3 * (high - low), abs=1e-5)


def test_a_bad_first_reading_moves_no_other() -> None:
    """50 um off at the first cycle: the others stay as they are, and a warm-up that begins fast is not taken for it."""
    calm = 0.1 * np.sin(np.arange(12.0))
    bad = calm.copy()
    bad[0] += 50.0
    assert beginning(bad) == calm[1]
    assert beginning(calm) == calm[0]
    warm = 40.0 * (1.0 - np.exp(-np.arange(12.0) / 3.0))
    assert beginning(warm) == 0.0


def test_what_is_no_drift() -> None:
    with pytest.raises(InputError, match="too few readings"):
        drift_test(Drift("t", np.array([0.0, 1.0]), {"x": np.zeros(2)}, {}), "etve")
    with pytest.raises(InputError, match=r"time_s does not rise; found 1 s after 2 s"):
        drift_test(Drift("t", np.array([0.0, 2.0, 1.0]), {"x": np.zeros(3)}, {}), "etve")
    with pytest.raises(InputError, match="needs times"):
        drift_of_recording(made(GAUGE), GAUGE)
    timed = drifting(0.1, 0.0)
    alone = Recording(timed.frame[timed.frame["face"] < 3], {}, "r.csv")
    with pytest.raises(InputError, match="too few complete blocks"):
        drift_of_recording(alone, GAUGE)

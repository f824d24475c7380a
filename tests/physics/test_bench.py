"""Bench: the four events found again in simulated recordings, Eqs 2-4, and Ren's Table 1."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge.physics import bench, bench_simulator
from stepgauge.physics.bench_simulator import DirectedProbe, PushBench

DATA = Path(__file__).parent.parent / "data"
FINE = PushBench(speed_mm_s=0.02)
STEP_UM = 1e3 * FINE.speed_mm_s * FINE.sample_interval_s
ROUNDING_UM = 1e-9


def push(probe, device=FINE, seed=0):
    return bench_simulator.simulate_push(probe, device, np.random.default_rng(seed))


@settings(deadline=None, max_examples=30)
@given(pretravel=st.floats(0.5, 30.0), share=st.floats(0.0, 0.3))
def test_pretravel_and_hysteresis_come_back_within_a_sample(pretravel, share):
    """Each edge is known to half a sample of rod travel, so that differences are within one."""
    probe = DirectedProbe(pretravel, hysteresis_um=0.2 * pretravel, indentation_share=share)
    events = bench.find_events(push(probe))
    assert events.pretravel_um == pytest.approx(pretravel, abs=STEP_UM + ROUNDING_UM)
    assert events.hysteresis_um == pytest.approx(0.2 * pretravel, abs=STEP_UM + ROUNDING_UM)
    assert events.resolution_um == pytest.approx(STEP_UM)
    assert events.t0_s < events.t1_s < events.t2_s < events.t3_s


@settings(deadline=None, max_examples=30)
@given(pretravel=st.floats(2.0, 30.0), share=st.floats(0.0, 0.3))
def test_touch_found_from_the_tip_alone(pretravel, share):
    """A ruby ball conducts no current: the laser must do. On straight lines it is not even bound to the samples."""
    probe = DirectedProbe(pretravel, hysteresis_um=0.1 * pretravel, indentation_share=share)
    events = bench.find_events(push(probe), contact_from="tip")
    assert events.pretravel_um == pytest.approx(pretravel, abs=STEP_UM)
    assert events.hysteresis_um == pytest.approx(0.1 * pretravel, abs=0.02)


def test_overtravel_is_latency_and_braking():
    device = dataclasses.replace(FINE, latency_s=0.01, deceleration_mm_s2=0.5)
    events = bench.find_events(push(DirectedProbe(3.0), device))
    expected = 1e3 * (0.02 * 0.01 + 0.02**2 / (2 * 0.5))
    assert events.overtravel_um == pytest.approx(expected, abs=STEP_UM)


def test_noise_of_laser_and_grating_averages_out_of_the_tip_line():
    device = dataclasses.replace(FINE, laser_noise_um=0.02, grating_noise_um=0.005)
    found = [bench.find_events(push(DirectedProbe(3.17), device, seed), "tip").pretravel_um for seed in range(20)]
    assert np.mean(found) == pytest.approx(3.17, abs=0.01)
    assert np.std(found) < 0.01


def test_repeatability_is_the_range_of_the_trigger_readings():
    """Ren Eq 4: max - min of r1; for n normal readings its expectation is d2(n) sigma (d2(10) = 3.078)."""
    probe = DirectedProbe(3.17, trigger_noise_um=0.02)
    ranges = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        events = [bench.find_events(bench_simulator.simulate_push(probe, FINE, rng)) for _ in range(10)]
        result = bench.summarise(0.0, events)
        assert result.trigger_range_um == pytest.approx(1e3 * np.ptp([e.r1_mm for e in events]))
        ranges.append(result.trigger_range_um)
    assert np.mean(ranges) == pytest.approx(3.078 * 0.02, rel=0.15)


def test_drift_of_the_zero_is_in_the_trigger_range_but_not_in_the_pretravel():
    probe = DirectedProbe(3.17, zero_noise_um=0.5)
    events = [bench.find_events(push(probe, seed=seed)) for seed in range(10)]
    result = bench.summarise(0.0, events)
    assert result.pretravel_range_um <= 2 * STEP_UM
    assert result.trigger_range_um > 0.5


def test_anisotropy_is_the_range_over_directions():
    angles = np.arange(0.0, 360.0, 30.0)
    truth = 3.17 + 0.4 * np.cos(np.radians(3 * angles))
    pushes = bench_simulator.simulate_directions(
        angles, [DirectedProbe(w, hysteresis_um=0.1) for w in truth], 2, FINE, np.random.default_rng(3)
    )
    assert len(pushes) == 24
    results = [bench.summarise(a, [bench.find_events(p) for d, p in pushes if d == a]) for a in angles]
    found = bench.anisotropy(results)
    assert found.pretravel_um == pytest.approx(0.8, abs=STEP_UM)
    assert found.mean_pretravel_um == pytest.approx(3.17, abs=STEP_UM)
    assert found.hysteresis_um <= STEP_UM


def test_a_single_push_has_no_standard_deviation():
    result = bench.summarise(0.0, [bench.find_events(push(DirectedProbe(3.0)))])
    assert result.pretravel_std_um is None
    assert result.trigger_range_um == 0.0
    with pytest.raises(ValueError, match="without a push"):
        bench.summarise(0.0, [])


@pytest.mark.parametrize(
    ("channel", "value", "message"),
    [("trigger", True, "trigger signal"), ("contact", True, "contact signal does not fall")],
)
def test_missing_edges_are_named(channel, value, message):
    recording = push(DirectedProbe(3.0))
    broken = recording._replace(**{channel: np.full(len(recording.time_s), value)})
    with pytest.raises(ValueError, match=message):
        bench.find_events(broken)


def test_a_recording_cut_before_the_return_is_named():
    recording = push(DirectedProbe(3.0))
    cut = bench.BenchStroke(*(part[: len(part) // 2] for part in recording))
    with pytest.raises(ValueError, match="does not rise after"):
        bench.find_events(cut)


def test_a_dead_laser_is_named():
    recording = push(DirectedProbe(3.0))
    with pytest.raises(ValueError, match="tip reading"):
        bench.find_events(recording._replace(tip_mm=np.zeros(len(recording.time_s))), "tip")


@pytest.mark.parametrize("change", [{"pretravel_um": 0.0}, {"indentation_share": 1.0}, {"hysteresis_um": 100.0}])
def test_impossible_probes_are_refused(change):
    with pytest.raises(ValueError, match=r"must|larger"):
        push(dataclasses.replace(DirectedProbe(3.0), **change))


class TestTable1:
    """Ren Table 1: the printed means are rounded, and three of the ten rows carry another compensation than 0.7 um."""

    TRUTH_MM = 29.98604
    _, MEASURED, COMPENSATED = np.genfromtxt(DATA / "ren_table_1.csv", delimiter=",", skip_header=2).T

    def test_means(self):
        assert self.MEASURED.mean() == pytest.approx(29.98515, abs=5e-6)
        assert self.COMPENSATED.mean() == pytest.approx(29.98596, abs=5e-6)

    def test_errors_and_their_uncertainty(self):
        before, u_before = bench.diameter_errors_um(self.MEASURED, self.TRUTH_MM)
        after, u_after = bench.diameter_errors_um(self.COMPENSATED, self.TRUTH_MM)
        assert before == pytest.approx(-0.89, abs=0.005)  # printed -0.84, from the mean rounded to 0.1 um
        assert after == pytest.approx(-0.08, abs=0.005)  # printed -0.04, likewise
        assert abs(before) > 5 * u_before
        assert abs(after) < 2 * u_after

    def test_the_compensation_applied_is_not_one_number(self):
        applied_um = 1e3 * (self.COMPENSATED - self.MEASURED)
        assert sorted(np.flatnonzero(np.abs(applied_um - 0.7) > 0.05) + 1) == [2, 9, 10]
        uniform, _ = bench.diameter_errors_um(self.MEASURED + 0.0007, self.TRUTH_MM)
        assert uniform == pytest.approx(-0.19, abs=0.005)

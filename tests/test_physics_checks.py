"""The virtual CMM against textbook numbers, end to end, with none of the formulas under test reused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from stepgauge.evaluation.evaluate import Evaluation, PlacementResult, evaluate
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import make_placement
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import TOTAL_SHARE
from stepgauge.machine.virtual import Run, RunConditions, probing_settings, run_program
from stepgauge.planning.plan import PlanOptions, make_program


def measured(
    gauge: Gauge,
    machine: Machine,
    *effects: dict[str, Any],
    start: tuple[float, float, float] = (120.0, 150.0, 200.0),
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0),
    believed: tuple[float, float, float] | None = None,
    conditions: RunConditions | None = None,
    explain: bool = False,
    repeatability_um: float = 0.0,
    **table: Any,
) -> tuple[Run, PlacementResult]:
    """Measure the gauge from ``start`` along ``direction``; the program goes along ``believed``."""
    length = gauge.block_centre_mm[-1] - gauge.block_centre_mm[0]

    def lying(along: tuple[float, float, float]):  # type: ignore[no-untyped-def]
        a = np.asarray(along) / np.linalg.norm(along)
        return make_placement(start, np.asarray(start) + a * length, 1, gauge.n_blocks)

    options = PlanOptions(1, gauge.n_blocks, cycles=2)
    program = make_program(lying(believed or direction), gauge, options, probing_settings(machine, 2.0))
    changed = machine.table.model_copy(update={"repeatability_um": repeatability_um, **table})
    bent = replace(machine, table=changed, effects=effects)
    run = run_program(program, bent, gauge, lying(direction), 1, conditions, explain)
    assert run.stop is None
    result: Evaluation = evaluate(run.recording, gauge)
    return run, result.results[0]


def test_a_perfect_machine_has_no_error(gauge: Gauge, machine: Machine) -> None:
    _, result = measured(gauge, machine)
    assert_allclose(np.nan_to_num(result.xm_um), 0.0, atol=1e-6)
    assert_allclose(result.radius.r_eff_mm, machine.probe.tip_radius_mm - machine.probe.pretravel_um * 1e-3)


def test_a_steel_gauge_one_kelvin_warmer_than_recorded_reads_11_5_um_per_m(gauge: Gauge, machine: Machine) -> None:
    _, result = measured(gauge, machine, {"kind": "gauge_temperature", "delta_K": 1.0})
    assert_allclose(result.xf_um[40] / (result.position_mm[40] * 1e-3), 11.5, rtol=1e-6)


def test_a_warm_gauge_whose_temperature_is_recorded_has_no_error(gauge: Gauge, machine: Machine) -> None:
    run, result = measured(gauge, machine, conditions=RunConditions(gauge_temperature_C=25.0))
    assert_allclose(np.nan_to_num(result.xm_um), 0.0, atol=1e-6)
    along = run.recording.position_mm[:, 0]
    assert_allclose(along[40] - along[0], gauge.position_mm[40] * (1 + 11.5e-6 * 5.0), rtol=1e-12)


def test_warm_scales_read_short_unless_they_are_compensated(gauge: Gauge, machine: Machine) -> None:
    """22 deg C, steel: 23 um/m short; with a steel gauge at 22 deg C, too, the length at 20 deg C is read."""
    warm = {"temperature_C": 22.0, "scales_compensated": False}
    _, result = measured(gauge, machine, **warm)
    assert_allclose(result.xf_um[40] / (result.position_mm[40] * 1e-3), -23.0, rtol=1e-4)
    _, compensated = measured(gauge, machine, temperature_C=22.0)
    assert_allclose(compensated.xf_um[40], 0.0, atol=1e-6)
    run, _ = measured(gauge, machine, conditions=RunConditions(gauge_temperature_C=22.0), **warm)
    along = run.recording.position_mm[:, 0]
    assert_allclose(along[40] - along[0], gauge.position_mm[40], atol=1e-7)


def test_abbe_error_of_a_pitch(gauge: Gauge, machine: Machine) -> None:
    """By hand: 1 um of Abbe error for every 10 urad at an arm of 100 mm.

    40 urad/m of pitch over 400 mm of travel is 16 urad; 200 mm above the scale that makes 3.2 um.
    """
    pitch = {"kind": "angular_error", "travel_axis": "x", "rotation_axis": "y", "urad_per_m": 40.0}
    _, high = measured(gauge, machine, pitch)
    _, level = measured(gauge, machine, pitch | {"scale_at_mm": [0.0, 0.0, 200.0]})
    assert_allclose(high.xf_um[40], 16.0 * 0.2 * high.position_mm[40] / 400.0, rtol=1e-4)
    assert_allclose(level.xf_um[40], 0.0, atol=1e-6)


@pytest.mark.parametrize("angle", [0.002, 0.01])
def test_cosine_error_is_half_the_square_of_the_angle(gauge: Gauge, machine: Machine, angle: float) -> None:
    """Once as an effect, once as a program that is really turned against the gauge (in plane)."""
    _, named = measured(gauge, machine, {"kind": "misalignment", "mrad": angle * 1e3})
    assert_allclose(named.xf_um[40], named.position_mm[40] * 1e3 * angle**2 / 2, rtol=angle**2)
    _, turned = measured(gauge, machine, believed=(1.0, angle, 0.0))
    assert_allclose(turned.xf_um[40], turned.position_mm[40] * 1e3 * angle**2 / 2, rtol=angle**2)


def test_squareness_lengthens_one_diagonal_and_shortens_the_other(gauge: Gauge, machine: Machine) -> None:
    """On diagonals at 45 deg the difference is the whole angle: L (1 + q/2) and L (1 - q/2)."""
    lean = {"kind": "squareness", "plane": "xy", "urad": 50.0}
    _, up = measured(gauge, machine, lean, start=(150.0, 150.0, 200.0), direction=(1.0, 1.0, 0.0))
    _, down = measured(gauge, machine, lean, start=(150.0, 600.0, 200.0), direction=(1.0, -1.0, 0.0))
    length_m = up.position_mm[40] * 1e-3
    assert_allclose([up.xf_um[40] / length_m, down.xf_um[40] / length_m], [25.0, -25.0], rtol=1e-6)


def test_a_later_trigger_makes_the_effective_radius_smaller(gauge: Gauge, machine: Machine) -> None:
    _, result = measured(gauge, machine, {"kind": "effective_radius", "um": 2.0})
    assert_allclose(result.radius.r_eff_mm, machine.probe.tip_radius_mm - 5e-3, atol=1e-9)
    assert_allclose(np.nan_to_num(result.xm_um), 0.0, atol=1e-6)


def test_a_reversal_shows_in_the_effective_radius_or_in_xr_and_never_in_both(gauge: Gauge, machine: Machine) -> None:
    _, result = measured(gauge, machine, {"kind": "reversal_error", "axis": "x", "um": 3.0})
    assert_allclose(result.radius.r_eff_mm, machine.probe.tip_radius_mm - 3e-3 - 1.5e-3, atol=1e-9)


def test_shares_add_up_to_the_total(gauge: Gauge, machine: Machine) -> None:
    effects = (
        {"kind": "scale_error", "axis": "x", "ppm": 8.0},
        {"kind": "scale_error", "axis": "x", "ppm": -2.0},
        {"kind": "gauge_temperature", "delta_K": 0.4},
        {"kind": "thermal_drift", "direction": [1.0, 2.0, 0.0], "rate_um_per_h": 5.0},
        {"kind": "noise_growth", "per": "x", "rate": 1.0},
        {"kind": "probe_lobing", "amplitude_um": 0.5},
    )
    run, _ = measured(gauge, machine, *effects, explain=True, repeatability_um=0.5)
    assert run.shares is not None
    parts = run.shares.drop(columns=TOTAL_SHARE)
    assert list(parts.columns) == [
        "share_scale_error_x_um",
        "share_scale_error_x_2_um",
        "share_gauge_temperature_um",
        "share_thermal_drift_um",
        "share_noise_growth_x_um",
        "share_probe_lobing_um",
        "share_repeatability_um",
    ]
    assert_allclose(parts.sum(axis=1), run.shares[TOTAL_SHARE], atol=1e-9)
    bare, _ = measured(gauge, machine)
    added = ((run.recording.position_mm - bare.recording.position_mm) * run.recording.approach).sum(axis=1) * 1e3
    assert_allclose(run.shares[TOTAL_SHARE], added, atol=1e-7)  # coordinates of 500 mm carry 1e-10 mm
    assert list(run.explained().frame.columns[-8:]) == [*parts.columns, TOTAL_SHARE]


def test_noise_growth_scatters_more_at_the_far_end(gauge: Gauge, machine: Machine) -> None:
    growth = {"kind": "noise_growth", "per": "position", "rate": 10.0}
    run, _ = measured(gauge, machine, growth, explain=True)
    share = run.shares["share_noise_growth_position_um"].to_numpy()  # type: ignore[index]
    expected_um = 10.0 * gauge.position_mm[run.recording.frame["face"].to_numpy() - 1] * 1e-3
    score = share[expected_um > 0] / expected_um[expected_um > 0]
    assert share[0] == 0.0
    assert 0.8 < score.std() < 1.2

"""Every effect against its closed form, written down by hand at a few rows."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from stepgauge.effects import Probings, Setting, effect_kinds, make_effects, total_displacement_um
from stepgauge.effects.maps import AXIS_COLUMNS
from stepgauge.effects.totals import along_approach_um, scatter_um
from stepgauge.effects.waves import sine
from stepgauge.effects.words import filled
from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine

GAUGE = read_gauge("step-gauge-420")
MACHINE = read_machine("bridge-cmm")
X, Y, Z = np.eye(3)
EXAMPLES = tomllib.loads((Path(__file__).parent.parent / "benchmarks" / "every-effect.toml").read_text())["effect"]


def columns(n: int = 1, **given: object) -> pd.DataFrame:
    """Probings of face 1 along +x at the machine's zero, with what a test changes."""
    start = {"placement": 1, "cycle": 1, "face": 1, "x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0}
    start |= {"approach_i": 1.0, "approach_j": 0.0, "approach_k": 0.0, "time_s": 0.0, "speed_mm_s": 3.0}
    return pd.DataFrame({name: np.broadcast_to(given.get(name, value), n) for name, value in (start | given).items()})


def probings(n: int = 1, axis: np.ndarray = X, **given: object) -> Probings:
    return Probings(columns(n, **given), Setting.of(MACHINE, GAUGE, {1: np.asarray(axis, float)}))


def bend(seen: Probings, **table: object) -> np.ndarray:
    """Total displacement in machine axes by one effect, um, shape (n, 3)."""
    return total_displacement_um(make_effects([table], "machine.toml"), seen)


@pytest.fixture(scope="module")
def many() -> pd.DataFrame:
    """Rows all over the machine, forward and backward along a slanted gauge, with two pauses."""
    random, n = np.random.default_rng(4), 84
    face = np.tile(np.arange(1, GAUGE.n_faces + 1), 2)[:n]
    way = np.where(face % 2 == 1, 1.0, -1.0)
    time = np.cumsum(random.uniform(2.0, 6.0, n)) + np.where(np.arange(n) > 40, 500.0, 0.0)
    places = {f"{a}_mm": random.uniform(0, 700, n) for a in "xyz"}
    speed = random.choice([1.0, 3.0], n)
    return columns(n, face=face, approach_i=0.6 * way, approach_j=0.8 * way, time_s=time, speed_mm_s=speed, **places)


@pytest.fixture(scope="module")
def machine_file(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("machine")
    (folder / "map.csv").write_text("coordinate_mm,error\n0,0\n300,3\n700,-1\n")
    (folder / "table.csv").write_text(",".join(AXIS_COLUMNS) + "\n0,0,-2,0.1,0.1\n300,3,1,0.1,0.1\n")
    return str(folder / "machine.toml")


def slanted(frame: pd.DataFrame) -> Probings:
    return Probings(frame, Setting.of(MACHINE, GAUGE, {1: np.array([0.6, 0.8, 0.0])}))


def test_the_examples_cover_the_vocabulary() -> None:
    assert sorted(example["kind"] for example in EXAMPLES) == sorted(effect_kinds(every=True))


def test_scale_error_is_parts_per_million_of_the_coordinate() -> None:
    assert_allclose(bend(probings(x_mm=400.0), kind="scale_error", axis="x", ppm=2.5), [[1.0, 0, 0]])
    assert_allclose(bend(probings(x_mm=400.0), kind="scale_error", axis="y", ppm=2.5), [[0, 0, 0]])


def test_scale_curvature_counts_from_the_middle_of_the_travel() -> None:
    got = bend(probings(3, x_mm=[350.0, 850.0, -150.0]), kind="scale_curvature", axis="x", um_per_m2=8.0)
    assert_allclose(got[:, 0], [0.0, 2.0, 2.0])


def test_periodic_error_repeats_with_its_period_and_starts_with_its_phase() -> None:
    law = {"kind": "periodic_scale_error", "axis": "x", "period_mm": 3.2, "amplitude_um": 2.0, "phase_deg": 30.0}
    got = bend(probings(4, x_mm=[0.0, 0.8, 1.6, 323.2]), **law)[:, 0]
    assert_allclose(got, [1.0, np.sqrt(3.0), -1.0, 1.0])


def test_local_defect_is_half_as_high_half_a_width_away() -> None:
    got = bend(
        probings(3, x_mm=[100.0, 115.0, 400.0]),
        kind="local_scale_defect",
        axis="x",
        at_mm=100.0,
        width_mm=30.0,
        height_um=4.0,
    )[:, 0]
    assert_allclose(got, [4.0, 2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(("plane", "first", "second"), [("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)])
def test_squareness_moves_the_first_axis_with_the_second(plane: str, first: int, second: int) -> None:
    place = {f"{'xyz'[second]}_mm": 500.0}
    expected = np.zeros((1, 3))
    expected[0, first] = 20.0  # 40 urad over 0.5 m
    assert_allclose(bend(probings(**place), kind="squareness", plane=plane, urad=40.0), expected)


@pytest.mark.parametrize(("plane", "first", "second"), [("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)])
@pytest.mark.parametrize("urad", [400.0, -400.0])
def test_squareness_says_whether_the_angle_is_over_90_deg_and_which_end_to_move(
    plane: str, first: int, second: int, urad: float
) -> None:
    """From where the tip truly goes when the machine is told to go along its second axis: indicated minus displaced."""
    (square,) = make_effects([{"kind": "squareness", "plane": plane, "urad": urad}], "machine.toml")
    there = np.zeros(3)
    for _ in range(3):
        told = np.eye(3)[second] * 100.0
        seen = probings(**{f"{axis}_mm": there[n] for n, axis in enumerate("xyz")})
        there = told - total_displacement_um([square], seen)[0] * 1e-3
    over = there[first] < 0.0  # it leans away from + of the first axis
    words, values = square.words, {"plane": {"value": plane}, "urad": {"value": urad, "unit": "urad"}}
    assert words is not None
    assert f"400 urad {'over' if over else 'under'} 90 deg" in filled(words.means, values)
    assert f"its + end towards {'+' if over else '-'}{plane[0]};" in filled(words.repair, values)
    assert abs(there[first]) == pytest.approx(0.040, rel=1e-3)  # 10 urad are 1 um in 100 mm


def test_straightness_is_a_bow_across_the_travel() -> None:
    got = bend(
        probings(3, x_mm=[350.0, 0.0, 175.0]), kind="straightness", axis="x", direction="z", um=4.0, length_mm=700.0
    )
    assert_allclose(got, [[0, 0, 4.0], [0, 0, 0], [0, 0, 3.0]], atol=1e-12)


@pytest.mark.parametrize("travel", "xyz")
@pytest.mark.parametrize("rotation", "xyz")
def test_rotations_act_with_the_arm_as_a_cross_product(travel: str, rotation: str) -> None:
    place, scale_at = np.array([300.0, 500.0, 200.0]), np.array([10.0, -20.0, 30.0])
    seen = probings(x_mm=place[0], y_mm=place[1], z_mm=place[2])
    got = bend(
        seen,
        kind="angular_error",
        travel_axis=travel,
        rotation_axis=rotation,
        urad_per_m=20.0,
        scale_at_mm=scale_at.tolist(),
    )
    t = "xyz".index(travel)
    arm = place - scale_at
    arm[t] = 0.0
    angle_rad = 20e-6 * place[t] / 1000.0
    expected = np.cross(angle_rad * np.eye(3)["xyz".index(rotation)], arm) * 1e3
    assert_allclose(got, [expected], atol=1e-12)


def test_roll_is_the_rotation_about_the_travel(many: pd.DataFrame) -> None:
    for axis in "xyz":
        roll = bend(slanted(many), kind="roll", axis=axis, urad_per_m=7.0)
        same = bend(slanted(many), kind="angular_error", travel_axis=axis, rotation_axis=axis, urad_per_m=7.0)
        assert_allclose(roll, same)
        assert not roll[:, "xyz".index(axis)].any()


def test_error_map_interpolates_and_holds_beyond_its_ends(machine_file: str) -> None:
    seen = probings(4, x_mm=[0.0, 100.0, 500.0, 900.0], z_mm=50.0)
    table = {"kind": "error_map", "axis": "x", "component": "x", "file": "map.csv"}
    assert_allclose(total_displacement_um(make_effects([table], machine_file), seen)[:, 0], [0.0, 1.0, 1.0, -1.0])
    pitch = make_effects([table | {"component": "ry"}], machine_file)
    assert_allclose(total_displacement_um(pitch, seen)[:, 0], np.array([0.0, 1.0, 1.0, -1.0]) * 0.05)


def test_a_compensation_takes_off_the_error_of_its_sense_of_travel(machine_file: str) -> None:
    """By hand: at 100 mm +1 or -1, their mean at standstill; held beyond the ends."""
    seen = probings(5, x_mm=[100.0, 100.0, 100.0, 900.0, -50.0], approach_i=[1.0, -1.0, 0.0, 1.0, -1.0])
    table = {"kind": "axis_compensation", "axis": "x", "file": "table.csv"}
    got = total_displacement_um(make_effects([table], machine_file), seen)
    assert_allclose(got[:, 0], [-1.0, 1.0, 0.0, -3.0, 2.0])
    assert not got[:, 1:].any()


def test_reversal_is_half_with_the_sign_of_travel() -> None:
    got = bend(probings(3, approach_i=[1.0, -1.0, 0.0]), kind="reversal_error", axis="x", um=3.0)[:, 0]
    assert_allclose(got, [1.5, -1.5, 0.0])


def test_effective_radius_shrinks_by_what_triggers_later() -> None:
    seen = probings(2, approach_i=[0.6, -0.6], approach_j=[0.8, -0.8])
    assert_allclose(bend(seen, kind="effective_radius", um=2.0), [[1.2, 1.6, 0], [-1.2, -1.6, 0]])


@given(azimuth=st.floats(-180, 180), phase=st.floats(-180, 180), polar=st.floats(1, 90))
def test_lobing_is_three_lobes_about_the_stylus(azimuth: float, phase: float, polar: float) -> None:
    b, t = np.radians(azimuth), np.radians(polar)
    seen = probings(approach_i=np.sin(t) * np.cos(b), approach_j=np.sin(t) * np.sin(b), approach_k=-np.cos(t))
    (effect,) = make_effects([{"kind": "probe_lobing", "amplitude_um": 2.0, "phase_deg": phase}], "m.toml")
    assert_allclose(along_approach_um(effect, seen), 2.0 * np.cos(3 * (b - np.radians(phase))), atol=1e-9)


def test_lobing_has_no_azimuth_along_the_stylus() -> None:
    assert not bend(probings(approach_i=0.0, approach_k=-1.0), kind="probe_lobing", amplitude_um=2.0).any()


def test_trigger_delay_is_the_way_during_the_delay() -> None:
    """Jankowski in Rodrigues 2021: 14.5 ms at 50 mm/min are 12.1 um."""
    got = bend(probings(speed_mm_s=50.0 / 60.0), kind="trigger_delay", ms=14.5)
    assert_allclose(got, [[12.1, 0, 0]], atol=0.02)


def test_a_longer_lever_needs_less_force_and_bends_less() -> None:
    """Rodrigues 2021: 14.5 mm more than the 50 mm modelled; 50 / 64.5 of the bending is left, none along the stylus."""
    lateral = bend(probings(), kind="lever_arm", mm=14.5)[0, 0]
    assert_allclose(MACHINE.probe.pretravel_um + lateral, MACHINE.probe.pretravel_um * 50.0 / 64.5)
    assert_allclose(bend(probings(approach_i=0.0, approach_k=-1.0), kind="lever_arm", mm=14.5), 0.0, atol=1e-15)


def test_a_pretravel_larger_by_a_share_keeps_its_shape() -> None:
    got = bend(probings(), kind="pretravel_scale", percent=9.0)
    assert_allclose(got, [[0.09 * MACHINE.probe.pretravel_um, 0.0, 0.0]])
    gone = bend(probings(approach_i=0.6, approach_j=0.8), kind="pretravel_scale", percent=-50.0)
    assert_allclose(gone, [[-0.3 * MACHINE.probe.pretravel_um, -0.4 * MACHINE.probe.pretravel_um, 0.0]])


def test_a_warm_gauge_grows_from_face_1_along_its_axis() -> None:
    seen = probings(2, axis=Y, face=[1, 42], approach_i=0.0, approach_j=[1.0, -1.0])
    length = GAUGE.position_mm[41]
    expected = [[0, 0, 0], [0, 11.5e-6 * 2.0 * length * 1e3, 0]]
    assert_allclose(bend(seen, kind="gauge_temperature", delta_K=2.0), expected, atol=1e-12)


def test_a_warm_scale_reads_short() -> None:
    got = bend(probings(x_mm=500.0), kind="scale_temperature", axis="x", delta_K=2.0)
    assert_allclose(got, [[-11.5, 0, 0]])


def test_drift_is_a_ramp_and_saturates_with_a_time_constant() -> None:
    seen = probings(3, time_s=[0.0, 1800.0, 1e7])
    ramp = bend(seen, kind="thermal_drift", direction="z", rate_um_per_h=4.0)
    assert_allclose(ramp[:2], [[0, 0, 0], [0, 0, 2.0]])
    got = bend(seen, kind="thermal_drift", direction="z", rate_um_per_h=4.0, time_constant_h=0.5)[:, 2]
    assert_allclose(got, [0.0, 2.0 * (1 - np.exp(-1.0)), 2.0])


def test_cycle_and_vibration_are_sines_of_time() -> None:
    seen = probings(2, time_s=[0.0, 150.0])
    cycle = bend(seen, kind="temperature_cycle", direction=[0.0, 3.0, 4.0], amplitude_um=5.0, period_s=600.0)
    assert_allclose(cycle, [[0, 0, 0], [0, 3.0, 4.0]], atol=1e-12)
    shake = bend(seen, kind="vibration", direction="x", frequency_hz=1 / 600, amplitude_um=5.0, phase_deg=90.0)
    assert_allclose(shake[:, 0], [5.0, 0.0], atol=1e-12)


@given(
    first=st.floats(0.001, 5.0),
    step=st.floats(1e-5, 0.1),
    kept=st.lists(st.booleans(), min_size=40, max_size=200),
    phase=st.floats(-360.0, 360.0),
)
@settings(max_examples=50, deadline=None)
def test_sines_of_even_rates_are_those_of_any_rates(first: float, step: float, kept: list[bool], phase: float) -> None:
    """Evenly spaced rates, some left out, go by the addition theorem; in disorder each by itself."""
    rates = first + step * np.flatnonzero([True, *kept, True])
    times = np.random.default_rng(0).uniform(-100.0, 2000.0, 30)
    expected = [np.sin(2.0 * np.pi * rate * times + np.radians(phase)) for rate in rates]
    assert_allclose(sine(rates[:, None], times, phase), expected, atol=1e-8)
    assert_allclose(sine(rates[::-1, None], times, phase), expected[::-1], atol=1e-8)
    assert_allclose(sine(float(rates[0]), times, phase), expected[0], atol=1e-12)


def test_vibration_aliases_to_a_slow_wave() -> None:
    """Touches every 2 s see 10.01 Hz as 0.01 Hz."""
    seen = probings(200, time_s=np.arange(200) * 2.0)
    fast = bend(seen, kind="vibration", direction="x", frequency_hz=10.01, amplitude_um=1.0)
    slow = bend(seen, kind="vibration", direction="x", frequency_hz=0.01, amplitude_um=1.0)
    assert_allclose(fast, slow, atol=1e-8)


def test_step_is_there_from_its_time_on() -> None:
    got = bend(probings(3, time_s=[9.9, 10.0, 50.0]), kind="step_change", direction="x", time_s=10.0, um=3.0)
    assert_allclose(got[:, 0], [0.0, 3.0, 3.0])


def test_memory_decays_with_the_touches_since_a_pause_in_order_of_time() -> None:
    seen = probings(5, time_s=[200.0, 0.0, 10.0, 210.0, 20.0])  # in time: rows 2, 3, 5, pause, 1, 4
    got = bend(seen, kind="approach_memory", um=2.0, touches=1.0, pause_s=60.0)[:, 0]
    assert_allclose(got, 2.0 * np.exp([0.0, 0.0, -1.0, -1.0, -2.0]))


def test_a_line_at_an_angle_reads_long() -> None:
    seen = probings(2, face=[1, 41], approach_i=1.0)
    got = bend(seen, kind="misalignment", mrad=10.0)[:, 0]
    assert_allclose(got, [0.0, GAUGE.position_mm[40] * 1e3 * (1 / np.cos(0.01) - 1)], rtol=1e-9)


def test_block_defect_moves_its_face_along_the_gauge_from_either_side() -> None:
    seen = probings(3, face=[7, 8, 8], approach_i=[1.0, -1.0, -1.0])
    assert_allclose(bend(seen, kind="block_defect", face=8, um=3.0)[:, 0], [0.0, 3.0, 3.0])


def test_block_shift_moves_both_faces_of_its_block_and_no_other() -> None:
    seen = probings(4, face=[6, 7, 8, 9], approach_i=[-1.0, 1.0, -1.0, 1.0])
    assert_allclose(bend(seen, kind="block_shift", block=4, um=3.0)[:, 0], [0.0, 3.0, 3.0, 0.0])
    with pytest.raises(InputError, match="no such block; found 22; expected 1 to 21"):
        bend(seen, kind="block_shift", block=22, um=3.0)


def test_bending_tilts_the_ends_as_a_beam_on_its_ends_does() -> None:
    """Simply supported: slope at the ends 16/5 of sag / length; none in the middle."""
    length = float(GAUGE.position_mm[-1])
    seen = probings(2, face=[1, 42], approach_i=[1.0, -1.0])
    got = bend(seen, kind="gauge_bending", supports_mm=[0.0, length], sag_um=30.0, height_mm=20.0)[:, 0]
    slope = 16.0 / 5.0 * 30.0 / length
    assert_allclose(got, [20.0 * slope, -20.0 * slope], rtol=1e-9)


def test_airy_points_keep_the_end_faces_parallel() -> None:
    length = float(GAUGE.position_mm[-1])
    airy = [length * (1 - 1 / np.sqrt(3)) / 2, length * (1 + 1 / np.sqrt(3)) / 2]
    seen = probings(3, face=[1, 12, 42], approach_i=[1.0, -1.0, -1.0])
    got = bend(seen, kind="gauge_bending", supports_mm=airy, sag_um=30.0)[:, 0]
    assert_allclose(got[[0, 2]], 0.0, atol=1e-10)
    assert abs(got[1]) > 0.1


def test_outliers_displace_the_listed_rows_and_no_others() -> None:
    got = bend(probings(6), kind="outliers", rows=[2, 5, 99], um=[4.0, -3.0, 1.0])[:, 0]
    assert_allclose(got, [0, 4.0, 0, 0, -3.0, 0])


def test_noise_growth_leaves_the_mean_and_adds_scatter_in_quadrature() -> None:
    seen = probings(2, x_mm=[0.0, 500.0])
    effects = make_effects([{"kind": "noise_growth", "per": "x", "rate": 2.0}], "m.toml")
    assert not total_displacement_um(effects, seen).any()
    assert_allclose(scatter_um(effects, seen, 0.5)[-1], [0.5, np.sqrt(0.25 + 1.0)])


def test_empirical_is_its_formula() -> None:
    seen = Probings(columns(2, face=[1, 2], humidity=[40.0, 50.0]), Setting.of(MACHINE, GAUGE, {1: X}))
    got = bend(seen, kind="empirical", formula="a * (humidity - 40) + side", coefficients={"a": 0.2}, direction="y")
    assert_allclose(got, [[0, 1.0, 0], [0, 1.0, 0]], atol=1e-12)


def test_the_21_errors_of_a_three_axis_machine_make_a_rigid_body(many: pd.DataFrame) -> None:
    """Zhang et al. 1985: scale, two straightness, three rotations for every axis, and three squareness errors.

    Written down independently: each carriage moves by its translations and turns about the line of its own scale.
    """
    random = np.random.default_rng(8)
    shift, turn = random.uniform(-5, 5, (3, 3)), random.uniform(-50, 50, (3, 3))
    lean = random.uniform(-30, 30, 3)
    tables: list[dict] = [
        {"kind": "squareness", "plane": plane, "urad": float(urad)}
        for plane, urad in zip(("xy", "xz", "yz"), lean, strict=True)
    ]
    middle, half = MACHINE.travel_mm.mean(axis=1), 500.0
    place = many[["x_mm", "y_mm", "z_mm"]].to_numpy()
    expected = 1e-3 * np.column_stack([place[:, 1:] @ lean[:2], place[:, 2] * lean[2], np.zeros(len(many))])
    for i, axis in enumerate("xyz"):
        tables.append({"kind": "scale_error", "axis": axis, "ppm": float(shift[i, i])})
        bow = 1.0 - ((place[:, i] - middle[i]) / half) ** 2
        for j, other in enumerate("xyz"):
            rotation = {"travel_axis": axis, "rotation_axis": other, "urad_per_m": float(turn[i, j])}
            tables.append({"kind": "angular_error", **rotation})
            if j != i:
                table = {"axis": axis, "direction": other, "um": float(shift[i, j]), "length_mm": 2.0 * half}
                tables.append({"kind": "straightness", **table})
                expected[:, j] += shift[i, j] * bow
        expected[:, i] += shift[i, i] * place[:, i] * 1e-3
        arm = np.where(np.arange(3) == i, 0.0, place)
        expected += np.cross(turn[i] * 1e-6 * place[:, i : i + 1], arm)
    assert len(tables) == 21
    assert_allclose(total_displacement_um(make_effects(tables, "machine.toml"), slanted(many)), expected, atol=1e-9)


@pytest.mark.parametrize("example", EXAMPLES, ids=[str(e["kind"]) for e in EXAMPLES])
class TestEveryEffect:
    def test_is_proportional_to_its_linear_parameters(
        self, example: dict, many: pd.DataFrame, machine_file: str
    ) -> None:
        (effect,) = make_effects([example], machine_file)
        linear = {p.name: getattr(effect, p.name) for p in effect.parameters() if p.role == "linear"}
        twice = effect.replace_values(**{name: 2.0 * np.asarray(value) for name, value in linear.items()})
        once = total_displacement_um([effect], slanted(many))
        assert linear or effect.kind in ("misalignment", "lever_arm", "interpolation_step", "empirical")
        if linear:
            assert_allclose(total_displacement_um([twice], slanted(many)), 2.0 * once, atol=1e-12)
        assert np.isfinite(once).all()
        assert once.any() or effect.kind == "noise_growth"

    def test_gives_the_same_by_blocks_and_in_any_order_of_rows(
        self, example: dict, many: pd.DataFrame, machine_file: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        effects = make_effects([example], machine_file)
        whole = total_displacement_um(effects, slanted(many))
        monkeypatch.setattr("stepgauge.effects.totals.BLOCK_ROWS", 5)
        assert_allclose(total_displacement_um(effects, slanted(many)), whole, atol=1e-12)
        if example["kind"] != "outliers":  # which speaks of rows
            order = np.random.default_rng(1).permutation(len(many))
            shuffled = many.iloc[order].reset_index(drop=True)
            assert_allclose(total_displacement_um(effects, slanted(shuffled)), whole[order], atol=1e-9)

    def test_takes_a_parameter_by_run(self, example: dict, many: pd.DataFrame, machine_file: str) -> None:
        from stepgauge.effects.totals import added_up

        (effect,) = make_effects([example], machine_file)
        for p in effect.parameters():
            value = getattr(effect, p.name)
            if p.role not in ("linear", "nonlinear") or not isinstance(value, float):
                continue
            by_run = effect.replace_values(**{p.name: value * np.array([[1.0], [1.1]])})
            both = np.stack([np.broadcast_to(d, (2, len(many))) for d in added_up([by_run], slanted(many))], axis=-1)
            one = total_displacement_um([effect.replace_values(**{p.name: value * 1.1})], slanted(many))
            assert_allclose(both[0], total_displacement_um([effect], slanted(many)), atol=1e-12)
            assert_allclose(both[1], one, atol=1e-12)

    def test_says_what_it_is(self, example: dict) -> None:
        effect = effect_kinds(every=True)[str(example["kind"])]
        assert effect.equation
        assert effect.source
        assert effect.covariates
        for p in effect.parameters():
            assert p.meaning, p.name
            assert p.unit or p.role == "choice" or p.name in ("coefficients", "file"), p.name
            if p.role in ("linear", "nonlinear") and p.name not in ("coefficients", "supports_mm"):
                assert p.sensible is not None, p.name
                assert p.low <= p.sensible[0] < p.sensible[1] <= p.high


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "scale_eror"}, r"effect\[1\]\.kind is not a known effect; found 'scale_eror'"),
        ({"kind": "scale_error", "axis": "x"}, r"key effect\[1\]\.ppm is missing"),
        ({"kind": "scale_error", "axis": "u", "ppm": 1.0}, r"effect\[1\]\.axis is wrong; found 'u'"),
        ({"kind": "scale_error", "axis": "x", "ppm": 1e9}, r"effect\[1\]\.ppm is wrong"),
        ({"kind": "scale_error", "axis": "x", "ppm": 1.0, "pmm": 2.0}, r"key effect\[1\]\.pmm is not known"),
        ({"kind": "straightness", "axis": "x", "direction": "x", "um": 1.0, "length_mm": 5.0}, "scale_curvature"),
        ({"kind": "gauge_bending", "supports_mm": [9.0, 3.0], "sag_um": 1.0}, "a < b"),
        ({"kind": "outliers", "rows": [1, 2], "um": [1.0]}, "one per row"),
        ({"kind": "thermal_drift", "direction": [0.0, 0.0, 0.0], "rate_um_per_h": 1.0}, "three numbers with a length"),
        ({"kind": "error_map", "axis": "x", "component": "x", "file": "none.csv"}, "no such file"),
    ],
)
def test_what_is_wrong_is_named(table: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_effects([table], "machine.toml")


def test_a_map_whose_coordinates_fall_is_refused(tmp_path) -> None:
    (tmp_path / "map.csv").write_text("coordinate_mm,error\n0,0\n5,1\n5,2\n")
    table = {"kind": "error_map", "axis": "x", "component": "x", "file": "map.csv"}
    with pytest.raises(InputError, match=r"map\.csv:4: coordinate_mm must rise"):
        make_effects([table], tmp_path / "machine.toml")
    (tmp_path / "table.csv").write_text(",".join(AXIS_COLUMNS) + "\n9,0,0,0,0\n5,0,0,0,0\n")
    with pytest.raises(InputError, match=r"table\.csv:3: position_mm must rise"):
        make_effects([{"kind": "axis_compensation", "axis": "x", "file": "table.csv"}], tmp_path / "machine.toml")


def test_an_effect_that_needs_a_missing_column_names_it() -> None:
    seen = Probings(columns().drop(columns="speed_mm_s"), Setting.of(MACHINE, GAUGE, {1: X}))
    with pytest.raises(InputError, match="no column 'speed_mm_s'"):
        bend(seen, kind="trigger_delay", ms=1.0)
    assert_allclose(bend(seen, kind="effective_radius", um=1.0), [[1.0, 0, 0]])


@settings(max_examples=10)
@given(data=st.data())
@pytest.mark.parametrize("example", EXAMPLES, ids=[str(e["kind"]) for e in EXAMPLES])
def test_sensible_parameters_give_finite_displacements_that_add_up(
    example: dict, data: st.DataObject, machine_file: str
) -> None:
    """Any parameters in their sensible ranges, anywhere in the machine: finite, and two effects are their sum."""
    kind = effect_kinds(every=True)[example["kind"]]
    drawn = {
        p.name: data.draw(st.floats(*p.sensible, exclude_min=p.open_low), label=p.name)
        for p in kind.parameters()
        if p.sensible is not None and isinstance(example.get(p.name), float)
    }
    places = st.lists(st.floats(-500, 1500), min_size=4, max_size=4)
    columns_mm = {f"{axis}_mm": data.draw(places) for axis in "xyz"}
    seen = probings(4, face=[1, 2, 41, 42], time_s=data.draw(st.lists(st.floats(0, 1e5), min_size=4, max_size=4)))
    seen = Probings(seen.columns.assign(**columns_mm), seen.setting)  # type: ignore[attr-defined]
    effects = make_effects([example | drawn, EXAMPLES[0]], machine_file)
    one, other = (total_displacement_um([effect], seen) for effect in effects)
    assert np.isfinite(one).all()
    assert_allclose(total_displacement_um(effects, seen), one + other, atol=1e-9)

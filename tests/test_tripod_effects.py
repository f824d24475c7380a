"""The tripod as an effect: against the six reactions solved by hand, its symmetries and its limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from stepgauge.effects import Probings, Setting, along_approach_um, make_effects
from stepgauge.errors import InputError
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.probes import probe_from_table
from stepgauge.probes.base import head_frame

SEAT = {"preload_N": 6.0, "contact_radius_mm": 12.0, "contact_angle_deg": 35.0}
TRIPOD = {"kind": "kinematic_pretravel", "um_per_N": 3.0, "lever_mm": 60.0, "arm_azimuth_deg": 17.0, **SEAT}
WORN = {"kind": "seat_defect", **{k: v for k, v in TRIPOD.items() if k != "kind"}, "share": 0.2}
AROUND = np.radians(np.arange(0.0, 360.0, 2.5))


def later_um(table: dict, approach: np.ndarray, machine: str | Path = "bridge-cmm") -> np.ndarray:
    """Displacement along approaches (n, 3) in machine axes."""
    columns = {f"approach_{letter}": approach[:, i] for i, letter in enumerate("ijk")}
    frame = pd.DataFrame(columns | {"face": 1, "x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0})
    setting = Setting.of(read_machine(machine), read_gauge("step-gauge-420"))
    (effect,) = make_effects([table], "machine.toml")
    return along_approach_um(effect, Probings(frame, setting))


def towards(azimuth: np.ndarray, polar_deg: float = 90.0) -> np.ndarray:
    """Approaches whose contact normal has this azimuth and polar angle about a stylus that hangs."""
    polar = np.radians(polar_deg)
    level = -np.sin(polar)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), np.full(len(azimuth), -np.cos(polar))])


def orders(around: np.ndarray) -> np.ndarray:
    """Amplitudes of the orders 0, 1, 2, ... in azimuth."""
    return 2.0 * np.abs(np.fft.rfft(around)) / len(around)


def test_across_the_stylus_it_is_the_force_of_the_six_equations_by_hand() -> None:
    """Arm k holds S and D, sum and difference of its two reactions, from three moments and two forces."""
    arms = np.radians(17.0 + 120.0 * np.arange(3))
    from_arm = AROUND[:, None] - arms
    used = 60.0 / 12.0 * np.cos(from_arm) + np.tan(np.radians(35.0)) * np.abs(np.sin(from_arm))
    assert_allclose(later_um(TRIPOD, towards(AROUND)), 3.0 * 6.0 / (2.0 * used.max(axis=1)))


def test_along_a_gauge_only_even_orders_are_a_radius() -> None:
    """Fronts and backs together hide the phase but for a sixth of a turn, until the gauge is tilted."""

    def radius(polar_deg: float) -> np.ndarray:
        there = towards(AROUND, polar_deg)
        return (later_um(TRIPOD, there) + later_um(TRIPOD, -there)) / 2.0

    level, tilted = orders(radius(90.0)), orders(radius(70.0))
    assert level[6] > 100.0 * level[3]
    assert tilted[3] > 0.1 * tilted[6]


def test_beside_an_arm_it_takes_least() -> None:
    fine = np.radians(np.arange(0.0, 120.0, 0.01))
    least = np.degrees(fine[later_um(TRIPOD, towards(fine + np.radians(17.0))).argmin()])
    beside = np.degrees(np.arctan(12.0 * np.tan(np.radians(35.0)) / 60.0))
    assert min(abs(least - beside), abs(least - (120.0 - beside))) < 0.02


def test_pushed_into_the_body_the_probe_opens_at_its_preload() -> None:
    down = np.array([[0.0, 0.0, -1.0]])
    assert_allclose(later_um(TRIPOD | {"along": 0.3}, down), 3.0 * 0.3 * 6.0)


def test_a_third_of_a_turn_changes_nothing_and_the_orders_are_multiples_of_three() -> None:
    around = later_um(TRIPOD, towards(AROUND))
    assert_allclose(later_um(TRIPOD, towards(AROUND + 2 * np.pi / 3)), around)
    assert np.abs(later_um(TRIPOD, towards(AROUND + np.pi / 3)) / around - 1.0).max() > 0.3
    strength = orders(around)
    assert strength[3] > 0.05 * strength[0]
    assert strength[6] > 0.01 * strength[0]
    assert np.delete(strength[:30], np.arange(0, 30, 3)).max() < 1e-12


def test_the_phase_turns_the_law_about_the_stylus() -> None:
    turned = later_um(TRIPOD | {"arm_azimuth_deg": 17.0 + 25.0}, towards(AROUND + np.radians(25.0)))
    assert_allclose(turned, later_um(TRIPOD, towards(AROUND)))


def test_along_one_direction_it_is_a_radius() -> None:
    one = np.tile([[0.6, -0.8, 0.0]], (7, 1))
    w = later_um(TRIPOD, one)
    assert_allclose(w, later_um({"kind": "effective_radius", "um": float(w[0])}, one))


def test_what_varies_has_no_mean_over_the_sphere_of_a_qualification() -> None:
    from stepgauge.physics.directions import iso_10360_5_points

    sphere = -iso_10360_5_points()
    whole, varying = later_um(TRIPOD, sphere), later_um(TRIPOD | {"part": "varying"}, sphere)
    assert varying.mean() == pytest.approx(0.0, abs=1e-12)
    assert_allclose(whole - varying, whole.mean())


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.6, 0.0, -0.8), (-1.0, 0.0, 0.0)])
def test_a_turned_stylus_takes_its_tripod_along(direction: tuple[float, ...], tmp_path: Path) -> None:
    text = (Path(__file__).parent.parent / "calibration_data" / "machines" / "bridge-cmm.toml").read_text()
    turned = text.replace("[probe]\n", f"[probe]\nstylus_direction = {list(direction)}\nroll_deg = 40.0\n")
    (tmp_path / "machine.toml").write_text(turned)
    frame = head_frame(direction, np.radians(40.0))
    seen = later_um(TRIPOD, towards(AROUND, 70.0) @ frame, tmp_path / "machine.toml")
    assert_allclose(seen, later_um(TRIPOD, towards(AROUND, 70.0)))


@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_on_a_probe_that_is_told_nothing_it_is_the_kinematic_probe(friction: float) -> None:
    """The same seat in a probe file, whose stylus gives way by the beam equation."""
    table = {
        "model": "kinematic",
        "tip_radius_mm": 2.0,
        "seat": SEAT | {"arm_azimuth_deg": 17.0, "carrier_mm": 20.0, "friction": friction, "arm_radius_mm": 0.0},
        "stylus": [{"length_mm": 40.0, "diameter_mm": 2.0, "modulus_GPa": 600.0}],
    }
    probe = probe_from_table(table, "probe.toml")
    elasticity = probe.elasticity  # type: ignore[attr-defined]
    law = TRIPOD | {"um_per_N": 1e3 * elasticity.lateral_mm_per_N, "friction": friction}
    law["along"] = elasticity.axial_mm_per_N / elasticity.lateral_mm_per_N
    for polar in (90.0, 100.0, 60.0, 20.0):
        assert_allclose(later_um(law, towards(AROUND, polar)), probe.pretravel_um(towards(AROUND, polar)))


def test_friction_of_the_tip_leans_the_force_and_of_the_seat_holds_longer() -> None:
    slanted = towards(AROUND, 50.0)
    plain = later_um(TRIPOD, slanted)
    assert (later_um(TRIPOD | {"friction": 0.2}, slanted) > plain).all()
    assert np.abs(later_um(TRIPOD | {"tip_friction": 0.2}, slanted) / plain - 1.0).max() > 0.01
    assert_allclose(later_um(TRIPOD | {"tip_friction": 1e-9}, slanted), plain, rtol=1e-6)


def test_a_longer_lever_needs_less_force() -> None:
    longer = later_um(TRIPOD | {"lever_mm": 120.0}, towards(AROUND))
    assert (longer < later_um(TRIPOD, towards(AROUND))).all()


@pytest.mark.parametrize("table", [TRIPOD, WORN, TRIPOD | {"along": 0.0}, TRIPOD | {"part": "varying"}])
def test_a_face_that_pulls_the_stylus_out_is_an_error(table: dict) -> None:
    """And no arithmetic with infinite forces: a warning is an error in these tests."""
    with pytest.raises(InputError, match=r"never triggers.*pulls the stylus out.*approach 0\.000, 0\.000, 1\.000"):
        later_um(table, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))


def test_a_worn_seat_opens_early_by_its_share_where_it_opens_first_and_nowhere_else() -> None:
    arms = np.radians(17.0 + 120.0 * np.arange(3))
    for i, arm in enumerate(("first", "second", "third")):
        change = later_um(WORN | {"arm": arm}, towards(arms))
        assert_allclose(change, -0.2 * later_um(TRIPOD, towards(arms)) * (np.arange(3) == i), atol=1e-12)
        assert later_um(WORN | {"arm": arm}, towards(arms[[i]] + np.pi)) == pytest.approx(0.0, abs=1e-12)


def test_a_worn_seat_breaks_the_three_fold_symmetry_and_nothing_worn_is_nothing() -> None:
    strength = orders(later_um(WORN, towards(AROUND)))
    assert (strength[1:3] > 0.1 * strength[0]).all()
    assert not later_um(WORN | {"share": 0.0}, towards(AROUND)).any()


def test_a_worn_seat_acts_without_a_jump_from_direction_to_direction() -> None:
    """Half the step, half the largest change: a jump would stay."""
    coarse, fine = (np.abs(np.diff(later_um(WORN, towards(np.linspace(0.0, 6.3, n))))).max() for n in (2001, 4001))
    assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_values_by_run_are_worked_out_run_by_run() -> None:
    frame = pd.DataFrame(dict(zip(("approach_i", "approach_j", "approach_k"), towards(AROUND).T, strict=True)))
    seen = Probings(frame.assign(face=1), Setting.of(read_machine("bridge-cmm")))
    (effect,) = make_effects([WORN], "machine.toml")
    values = {
        "um_per_N": np.array([[2.0], [5.0]]),
        "lever_mm": np.array([[50.0], [70.0]]),
        "share": np.array([[0.1], [0.4]]),
    }
    got = effect.replace_values(**values).displacement_um(seen)["approach"]
    for run in range(2):
        alone = effect.replace_values(**{name: float(value[run, 0]) for name, value in values.items()})
        assert_allclose(got[run], alone.displacement_um(seen)["approach"])


def test_directions_are_told_apart_even_where_their_marks_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = later_um(TRIPOD, towards(AROUND))
    monkeypatch.setattr("stepgauge.effects.probings._MARK", np.array([1.0, 0.0, 0.0]))  # the same for b and -b
    assert_allclose(later_um(TRIPOD, towards(AROUND)), expected, rtol=1e-12)


def test_a_seat_that_jams_is_named() -> None:
    with pytest.raises(InputError, match=r"effect\[1\] is wrong.*the seat jams with a coefficient of friction of 0\.3"):
        make_effects([TRIPOD | {"contact_angle_deg": 12.0, "friction": 0.3}], "machine.toml")

"""16 points: the pose comes back within its uncertainty, and slips are named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stepgauge as sg
from stepgauge.alignment import locate, read_points
from stepgauge.alignment.adjustment import adjust
from stepgauge.alignment.blocks import solve_blocks
from stepgauge.alignment.slips import agreement
from stepgauge.alignment.surface import tip_centres
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, format_placement, parse_placement
from tests.build import Pose, angles, gauges, inclinations, make_gauge, make_points, make_pose, positions

RADIUS = 1.997


def level(gauge: Gauge, blocks: tuple[int, int] | None = None) -> tuple[np.ndarray, tuple[int, int]]:
    """Points on a level gauge that lies askew."""
    blocks = blocks or (1, gauge.n_blocks)
    return make_points(gauge, make_pose(0.7, 0.05, origin=(100, 200, 50)), RADIUS, blocks), blocks


@given(gauges(), angles, inclinations, positions, st.integers(0, 2**32 - 1))
def test_the_pose_comes_back_within_its_stated_uncertainty(gauge, yaw, pitch, origin, seed) -> None:
    random = np.random.default_rng(seed)
    pose = make_pose(yaw, pitch, origin=origin)
    sigma_um = random.uniform(0.1, 3.0)
    shift = random.uniform(-0.5, 0.5, (16, 3))
    points = make_points(gauge, pose, RADIUS, (1, gauge.n_blocks), shift) + random.normal(0, sigma_um * 1e-3, (16, 3))
    found = locate(points, gauge, (1, gauge.n_blocks), sigma_um, turned=True)
    truth = pose.placement(gauge)
    u = found.details["uncertainty"]
    for name in ("c1", "c2"):
        off_um = (getattr(found, f"{name}_mm") - getattr(truth, f"{name}_mm")) * 1e3
        assert (np.abs(off_um) < 6.0 * np.array(u[f"{name}_um"]) + 0.02).all()
    off_rad = np.degrees(np.arcsin(truth.axis[2])) - found.details["angles"]["pitch_deg"]
    assert abs(np.radians(off_rad)) * 1e6 < 6.0 * u["pitch_urad"] + 0.1
    assert abs(found.tip_radius_mm - RADIUS) * 1e3 < 6.0 * u["tip_radius_um"] + 0.01


@given(angles, st.floats(1.2, 1.45), positions, st.integers(0, 2**32 - 1))
def test_points_without_errors_on_a_short_steep_gauge_give_its_pose(yaw, pitch, origin, seed) -> None:
    """Its sides turn by more than its axis does: putting in the axis that came out was 35 um off after five times."""
    gauge = make_gauge(2)
    pose = make_pose(yaw, pitch, origin=origin)
    shift = np.random.default_rng(seed).uniform(-0.5, 0.5, (16, 3))
    found = locate(make_points(gauge, pose, RADIUS, (1, 2), shift), gauge, (1, 2), 1.0, turned=True)
    np.testing.assert_allclose(found.c1_mm, pose.placement(gauge).c1_mm, atol=1e-8)
    np.testing.assert_allclose(found.axis, pose.rotation[0], atol=1e-9)


def test_the_stated_uncertainty_is_the_scatter_of_many_probings() -> None:
    """Monte Carlo against the linear propagation, in all reported quantities: four standard deviations of 150 runs."""
    random = np.random.default_rng(1)
    gauge = make_gauge(8)
    points = make_points(gauge, make_pose(0.4, -0.8, origin=(10, 20, 30)), RADIUS, (1, 8))
    runs = [locate(points + random.normal(0, 1e-3, (16, 3)), gauge, (1, 8), 1.0) for _ in range(150)]
    stated = runs[0].details["uncertainty"]
    for name in ("c1_mm", "c2_mm"):
        scatter_um = np.std([getattr(run, name) for run in runs], axis=0, ddof=1) * 1e3
        np.testing.assert_allclose(scatter_um, stated[name.replace("mm", "um")], rtol=0.25)
    for angle in ("yaw", "pitch"):
        scatter_urad = np.std([np.radians(run.details["angles"][f"{angle}_deg"]) for run in runs], ddof=1) * 1e6
        assert scatter_urad == pytest.approx(stated[f"{angle}_urad"], rel=0.25)
    assert np.std([run.tip_radius_mm for run in runs]) * 1e3 == pytest.approx(stated["tip_radius_um"], rel=0.25)
    tilt_urad = [run.details["angles"]["n1_to_axis_mrad"] * 1e3 for run in runs]
    assert np.sqrt(np.mean(np.square(tilt_urad))) == pytest.approx(stated["n1_urad"], rel=0.25)


@given(gauges(), angles, st.floats(-1.2, 1.2), st.floats(0.3, 2.8), st.booleans(), positions)
def test_a_gauge_turned_about_its_axis_or_standing_is_found_with_its_up_direction(
    gauge, yaw, pitch, roll, standing, origin
) -> None:
    pose = make_pose(yaw, np.pi / 2 if standing else pitch, roll, origin)
    found = locate(make_points(gauge, pose, RADIUS, (1, gauge.n_blocks)), gauge, (1, gauge.n_blocks), 0.5, turned=True)
    np.testing.assert_allclose(found.rotation, pose.rotation, atol=2e-3)
    np.testing.assert_allclose(found.c1_mm, pose.placement(gauge).c1_mm, atol=0.02)
    assert any("up direction" in note for note in found.details["notes"])


def test_a_gauge_that_stands_upright_has_no_yaw() -> None:
    gauge = make_gauge(8)
    for pitch, known in ((np.pi / 2, False), (np.pi / 2 - 0.02, True)):
        points = make_points(gauge, make_pose(0.3, pitch), RADIUS, (1, 8))
        yaw_deg = locate(points, gauge, (1, 8), 1.0, turned=True).details["angles"]["yaw_deg"]
        assert yaw_deg == pytest.approx(np.degrees(0.3), abs=1e-3) if known else yaw_deg == "undefined"


def test_angles_are_stated_against_the_machine_axes() -> None:
    gauge = make_gauge(8)
    yaw, pitch = 0.000610 + np.pi / 2, 0.002
    angles = locate(make_points(gauge, make_pose(yaw, pitch), RADIUS, (1, 8)), gauge, (1, 8), 1.0).details["angles"]
    assert angles["yaw_deg"] == pytest.approx(np.degrees(yaw), abs=1e-6)
    assert angles["pitch_deg"] == pytest.approx(np.degrees(pitch), abs=1e-6)
    assert angles["nearest_machine_axis"] == "+y"
    assert angles["from_nearest_axis_deg"] == pytest.approx(np.degrees(np.hypot(0.000610, 0.002)), rel=1e-3)


def test_the_normal_of_a_tilted_block_is_reported_and_not_taken_for_the_axis() -> None:
    """Front and back of the first block lean by 2 mrad; its centre and the axis stay where they are."""
    gauge, tilt = make_gauge(8), 2e-3
    pose = make_pose(0.0, 0.0)
    points = make_points(gauge, pose, RADIUS, (1, 8))
    leaning = [0, 1, 2, 7]
    points[leaning, 0] += tilt * points[leaning, 1]
    found = locate(points, gauge, (1, 8), 1.0)
    assert found.details["angles"]["n1_to_axis_mrad"] == pytest.approx(2.0, rel=0.01)
    assert found.details["angles"]["n2_to_axis_mrad"] == pytest.approx(0.0, abs=0.01)
    np.testing.assert_allclose(found.axis, [1, 0, 0], atol=1e-6)


SWAPS = [(4, 5), (6, 7), (1, 8), (4, 12), (8, 16), (1, 9), (3, 4), (7, 15)]


@pytest.mark.parametrize(("one", "other"), SWAPS)
def test_two_swapped_points_are_named(one: int, other: int) -> None:
    """Every second of them on a gauge that is turned about its axis."""
    roll = -0.9 if SWAPS.index((one, other)) % 2 else 0.0
    gauge = make_gauge(21)
    random = np.random.default_rng(one)
    pose = make_pose(1.0, -0.6, roll, (40, 300, 180))
    points = make_points(gauge, pose, RADIUS, (1, 21), random.uniform(-0.5, 0.5, (16, 3)))
    points[[one - 1, other - 1]] = points[[other - 1, one - 1]]
    with pytest.raises(InputError, match=f"points {one} and {other} look swapped"):
        locate(points, gauge, (1, 21), 1.0)


@pytest.mark.parametrize("point", [1, 5, 6, 16])
def test_a_point_on_the_next_block_is_named(point: int) -> None:
    gauge = make_gauge(21)
    pose = make_pose(1.0, 0.3)
    points = make_points(gauge, pose, RADIUS, (3, 15))
    points[point - 1] += 20.0 * pose.rotation[0]
    own = 3 if point <= 8 else 15
    with pytest.raises(InputError, match=f"point {point} looks like one on block {own + 1}, not on block {own}"):
        locate(points, gauge, (3, 15), 1.0)


def refused(points: np.ndarray, blocks: tuple[int, int], gauge: Gauge, **more: float) -> str:
    """What the error says."""
    with pytest.raises(InputError) as caught:
        locate(points, gauge, blocks, 1.0, **more)
    return str(caught.value)


def test_other_slips_are_named() -> None:
    gauge = make_gauge(21)
    points, blocks = level(gauge)
    assert "look like inches" in refused(points / 25.4, blocks, gauge)
    assert "multiplied by 25.4" in refused(points * 25.4, blocks, gauge)
    assert "look like metres" in refused(points / 1000, blocks, gauge)
    assert "1-8 and 9-16 look swapped" in refused(np.roll(points, 8, axis=0), blocks, gauge)
    assert "not blocks 1 and 20: the distance fits blocks 1 and 21" in refused(points, (1, 20), gauge)
    assert "tip radius stated" in refused(points, blocks, gauge, tip_radius_mm=1.5)
    assert "tip diameter is stated as its radius" in refused(points, blocks, gauge, tip_radius_mm=2.0 * RADIUS)
    in_line = points.copy()
    in_line[1] = (points[0] + points[2]) / 2
    assert "points 1, 2 and 3 are in line" in refused(in_line, blocks, gauge)
    leaning = points.copy()
    leaning[8] += 0.3
    assert re.search("points 9 to 11 is .* deg off square", refused(leaning, blocks, gauge))


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ([*range(8), *range(8)], "points 9 to 16 are the same as points 1 to 8; found blocks 0.000 mm apart"),
        ([*range(8), *range(7, -1, -1)], "points 9 to 16 lie on the block of points 1 to 8"),
        ([0] * 16, "all 16 points are the same"),
    ],
)
def test_one_block_pasted_twice_is_named(order: list[int], words: str) -> None:
    gauge = make_gauge(21)
    points, blocks = level(gauge)
    assert words in refused(points[order], blocks, gauge)
    assert agreement(points[order], gauge, blocks) is None, "the page shows no table of such points"
    assert agreement(points[order], gauge, blocks, turned=True) is None


def test_sides_that_are_not_square_are_refused() -> None:
    gauge = make_gauge(21)
    points, blocks = level(gauge)
    axis = make_pose(0.7, 0.05).rotation[0]
    points[3] += 4 * axis
    points[4] -= 4 * axis
    assert "side points 4 and 5 are not square to the axis" in refused(points, blocks, gauge)


@given(gauges(), angles, inclinations, positions)
def test_a_placement_file_says_the_same(gauge, yaw, pitch, origin) -> None:
    pose: Pose = make_pose(yaw, pitch, origin=origin)
    one = locate(make_points(gauge, pose, RADIUS, (1, gauge.n_blocks)), gauge, (1, gauge.n_blocks), 1.0, turned=True)
    other: Placement = parse_placement(format_placement(one), "placement.toml", gauge)
    np.testing.assert_allclose(other.c1_mm, one.c1_mm, atol=1e-7)
    np.testing.assert_allclose(other.rotation, one.rotation, atol=1e-8)
    assert other.details == one.details or not one.details["notes"]


@pytest.mark.parametrize("percent", [0.3, -0.3, 0.9])
def test_a_scale_that_is_off_is_no_contradiction_on_a_machine_that_may_have_it(percent: float) -> None:
    """The placement keeps middle and direction and the certified distance, and its file says how far that was off."""
    gauge = make_gauge(14)
    pose = make_pose(0.7, 0.05, origin=(100, 200, 50))
    true, points = pose.placement(gauge), make_points(gauge, pose, RADIUS, (1, 14))
    middle = (true.c1_mm + true.c2_mm) / 2.0
    read = points + np.outer((points - middle) @ true.axis, true.axis) * percent / 100.0
    with pytest.raises(InputError, match=r'C1 and C2 are .* apart.*kind = "machine tool"'):
        locate(read, gauge, (1, 14), 1.0, RADIUS)
    found = locate(read, gauge, (1, 14), 1.0, RADIUS, scale_error=0.01)
    np.testing.assert_allclose([found.c1_mm, found.c2_mm], [true.c1_mm, true.c2_mm], atol=0.02)
    again = parse_placement(format_placement(found), "again", gauge, 0.0)
    distance = gauge.block_centre_mm[13] - gauge.block_centre_mm[0]
    assert again.details["too_long_mm"] == pytest.approx(percent / 100.0 * distance, abs=0.03)
    assert [f"{abs(percent):.2f} % (" in note for note in again.details["notes"]] == [True]
    with pytest.raises(InputError, match="not blocks 1 and 13: the distance fits blocks 1 and 14"):
        locate(points, gauge, (1, 13), 1.0, RADIUS, scale_error=0.01)


POINTS = "point,x_mm,y_mm,z_mm\n" + "\n".join(f"{i},{i},0,{i % 3}" for i in range(1, 17)) + "\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("\n5,5,0,2", "", ["1 of the 16 points missing", "not there: 5"]),
        ("\n5,5,0,2", "\n4,5,0,2", [":6", "twice", "4"]),
        ("\n5,5,0,2", "\n17,5,0,2", [":6", "unknown point", "17"]),
        ("\n5,5,0,2", "\n5,5,0", [":6", "cut short"]),
        ("\n5,5,0,2", "\n5,5,0,abc", [":6", "z_mm", "'abc'"]),
        ("point,", "points,", [":1", "column point is missing ('points' is there)"]),
        ("y_mm", "width", [":1", "column y_mm is missing;", "found point,x_mm,width,z_mm"]),
        (POINTS, "", ["empty"]),
    ],
)
def test_points_files_that_cannot_be_are_refused(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = tmp_path / "points.csv"
    path.write_text(POINTS.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_points(path)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_points_may_come_in_any_order(tmp_path: Path) -> None:
    lines = POINTS.splitlines()
    path = tmp_path / "points.csv"
    path.write_text("\n".join([lines[0], *lines[:0:-1]]))
    np.testing.assert_array_equal(read_points(path)[:, 0], np.arange(1, 17))


def placed(gauge: Gauge, seed: int = 3, sigma_mm: float = 0.3e-3) -> np.ndarray:
    """Points on a gauge along y, as the demo has them, with noise."""
    random = np.random.default_rng(seed)
    pose = make_pose(1.56, 0.006, origin=(352.0, 318.0, 214.0))
    return make_points(gauge, pose, RADIUS, (1, 21), random.uniform(-0.5, 0.5, (16, 3))) + random.normal(
        0, sigma_mm, (16, 3)
    )


@given(gauges(), angles, st.floats(-1.3, 1.3), positions, st.integers(0, 2**32 - 1))
def test_the_adjustment_finds_the_pose_that_the_construction_finds(gauge, yaw, pitch, origin, seed) -> None:
    """Least squares and the construction of the paper agree; the redundancy is at most that of 23 - 13 observations.

    Up to 75 deg: a short gauge that is steeper may have two axes that fit +z nearly as well.
    """
    random = np.random.default_rng(seed)
    blocks, sigma = (1, gauge.n_blocks), np.full(16, 1e-3)
    points = make_points(
        gauge, make_pose(yaw, pitch, origin=origin), RADIUS, blocks, random.uniform(-0.5, 0.5, (16, 3))
    )
    points += random.normal(0, 1e-3, (16, 3))
    adjusted, built = adjust(points, gauge, blocks, None, sigma), solve_blocks(points, gauge, blocks)
    short = max(100.0 / float(np.ptp(gauge.block_centre_mm)), 1.0)  # the construction extrapolates from block to block
    np.testing.assert_allclose(adjusted.c1_mm, built.centre_mm[0], atol=2e-3 * short)
    np.testing.assert_allclose(adjusted.rotation[0], built.axis, atol=2e-4 * short)
    assert adjusted.unknowns[5] == pytest.approx(built.tip_radius_mm, abs=1e-3)
    assert 2.0 < adjusted.redundancy.sum() <= 10.0
    assert adjusted.worst < 6.0


def test_the_residuals_of_points_without_a_slip_are_standard_normal() -> None:
    """Normalised residuals over many probings have variance 1 (Baarda), whatever their redundancy."""
    gauge = make_gauge(21)
    runs = [adjust(placed(gauge, seed, 1e-3), gauge, (1, 21), None, np.full(16, 1e-3)) for seed in range(100)]
    scatter = np.std([run.normalised[:16] for run in runs], axis=0)
    np.testing.assert_allclose(scatter, 1.0, atol=0.28)


@pytest.mark.parametrize("point", range(1, 17))
def test_a_digit_slip_names_its_point_and_where_the_others_put_it(point: int) -> None:
    """On the first block square to its face by 0.5 mm, on the last one out of its face by 60 mm."""
    gauge = make_gauge(21)
    truth = placed(gauge)
    square = {4: 0, 5: 0, 6: 2, 7: 2}.get((point - 1) % 8 + 1, 1)
    axis, by = (square, 0.5) if point <= 8 else (point % 3, -60.0 if point % 3 == 2 else 60.0)
    points = truth.copy()
    points[point - 1, axis] += by
    with pytest.raises(InputError, match=rf"point {point}\b") as caught:
        locate(points, gauge, (1, 21), 0.3)
    near = [float(value) for value in re.search(r"near \(([^)]*)\)", str(caught.value))[1].split(",")]  # type: ignore[index]
    named = int(re.search(r"point (\d+) ", str(caught.value))[1])  # type: ignore[index]
    assert np.abs(near - truth[named - 1]).max() < (0.02 if by == 0.5 and named == point else 12.0)


def test_the_rail_is_touched_beside_the_block() -> None:
    """The slip of a decimal point in point 7 passed, and turned the gauge by 19 urad at a stated 1 urad."""
    gauge = make_gauge(21)
    points = placed(gauge)
    points[6, 0] /= 100.0
    assert re.search(r"point 7 is off by 3\d\d\.\d* mm", refused(points, (1, 21), gauge))


def test_what_a_hand_scatters_counts_for_all_of_its_points() -> None:
    """4 um where 0.4 um is stated. Three redundancies show it, so that 2 u holds 86 % (Student); it held half."""
    gauge = make_gauge(21)
    true = make_pose(1.56, 0.006, origin=(352.0, 318.0, 214.0)).rotation[0]
    held = []
    for seed in range(100):
        found = locate(placed(gauge, seed, 4e-3), gauge, (1, 21), 0.4)
        off_urad = 1e6 * (np.arctan2(found.axis[1], found.axis[0]) - np.arctan2(true[1], true[0]))
        held.append(abs(off_urad) < 2.0 * found.details["uncertainty"]["yaw_urad"])
    assert np.mean(held) > 0.75


def test_a_side_point_that_is_off_shows_in_the_stated_uncertainty() -> None:
    """50 um turn the axis by 62 urad; only the unequal widths show it, and not which of four points it is."""
    gauge = make_gauge(21)
    points = placed(gauge)
    before = locate(points, gauge, (1, 21), 0.3)
    points[4, 0] += 0.05
    after = locate(points, gauge, (1, 21), 0.3)
    turned_urad = np.linalg.norm(after.axis - before.axis) * 1e6
    assert turned_urad > 50.0
    assert before.details["uncertainty"]["yaw_urad"] < 1.0
    assert after.details["uncertainty"]["yaw_urad"] > 0.8 * turned_urad
    assert after.details["uncertainty"]["pitch_urad"] == pytest.approx(
        before.details["uncertainty"]["pitch_urad"], rel=0.01
    )
    note = next(note for note in after.details["notes"] if "contradict" in note)
    assert "points 4, 5, 12 and 13" in note
    assert re.search(r"not equally wide, by (4[89]|5[012])\.\d um", note)
    assert not before.details["notes"]
    points[4, 0] += 0.15
    one_of_four = r".*point (5|4|12|13) by"
    assert re.search(rf"cannot tell which: {one_of_four} 0\.[12]\d+ mm, {one_of_four}", refused(points, (1, 21), gauge))


@pytest.mark.parametrize(("one", "other"), [(0, 1), (0, 2), (1, 2)])
def test_exchanged_columns_are_named(one: int, other: int) -> None:
    gauge = make_gauge(21)
    points = placed(gauge)
    points[:, [one, other]] = points[:, [other, one]]
    assert f"columns {'xyz'[one]}_mm and {'xyz'[other]}_mm look exchanged" in refused(points, (1, 21), gauge)


@settings(max_examples=10)
@given(angles, st.floats(-0.6, 0.6), st.sampled_from([(1, 2, 0), (2, 0, 1)]))
def test_three_columns_exchanged_in_turn_are_refused(yaw: float, pitch: float, order: tuple[int, int, int]) -> None:
    """They are a gauge on its side or on end: only somebody who says that it lies so gets a placement."""
    gauge = make_gauge(8)
    points = make_points(gauge, make_pose(yaw, pitch), RADIUS, (1, 8))[:, order]
    assert re.search("columns look exchanged in turn .* state turned", refused(points, (1, 8), gauge))
    assert locate(points, gauge, (1, 8), 1.0, turned=True).tip_radius_mm == pytest.approx(RADIUS, abs=1e-3)


def test_a_gauge_turned_a_little_needs_no_word() -> None:
    gauge = make_gauge(8)
    for roll_deg, much in ((25.0, False), (-25.0, False), (35.0, True), (180.0, True)):
        points = make_points(gauge, make_pose(0.4, 0.1, np.radians(roll_deg)), RADIUS, (1, 8))
        if much:
            assert re.search(f"turned about its axis by -?{roll_deg:.1f} deg", refused(points, (1, 8), gauge))
        else:
            assert "turned about its axis" in locate(points, gauge, (1, 8), 1.0).details["notes"][0]


def test_another_gauge_that_fits_is_named() -> None:
    gauge, long = read_gauge("step-gauge-420"), read_gauge("step-gauge-600")
    points = make_points(long, make_pose(0.7, 0.05), RADIUS, (1, 30))
    named = "blocks 1 and 21: the distance fits blocks 1 and 30 of Step gauge 600 (SG-600-001)"
    assert named in refused(points, (1, 21), gauge)


def test_coordinates_of_no_machine_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(POINTS.replace("\n5,5,", "\n5,1e308,"))
    with pytest.raises(InputError, match=r"points.csv:6: point 5 is in no machine; found x_mm 1e\+308"):
        read_points(path)


@given(st.floats(-np.pi, np.pi), st.floats(-0.1, 0.1), st.floats(0.5, 5.0))
@settings(max_examples=15)
def test_points_on_the_surface_give_the_placement_that_their_tip_centres_give(yaw, pitch, radius) -> None:
    """PC-DMIS reports points on the surface; each is a ball of radius zero, so the builder makes them without ours."""
    gauge = make_gauge(6)
    pose = make_pose(yaw, pitch, origin=(100, 200, 50))
    moved = make_points(gauge, pose, 0.0, (1, 6))
    moved[[6, 14]] += radius * pose.rotation[1]  # the ball stays clear of the block
    found = locate(tip_centres(moved, gauge, (1, 6), radius), gauge, (1, 6), 1.0, radius)
    np.testing.assert_allclose(found.c1_mm, pose.placement(gauge).c1_mm, atol=1e-6)
    np.testing.assert_allclose(found.axis, pose.rotation[0], atol=1e-7)
    assert found.tip_radius_mm == pytest.approx(radius, abs=1e-6)


def test_the_advice_for_points_on_the_surface_is_followed_both_ways() -> None:
    gauge = make_gauge(6)
    centres, blocks = level(gauge)
    surface = make_points(gauge, make_pose(0.7, 0.05, origin=(100, 200, 50)), 0.0, blocks)
    surface[[6, 14]] += RADIUS * make_pose(0.7, 0.05).rotation[1]
    with pytest.raises(InputError, match=r"look compensated .* tip centres, or surface stated to locate"):
        locate(surface, gauge, blocks, 1.0, RADIUS)
    with pytest.raises(
        InputError, match=r"do not look compensated by the tip radius; found blocks 3\.994 and 3\.994 mm"
    ):
        tip_centres(centres, gauge, blocks, RADIUS)
    with pytest.raises(InputError, match="the tip radius is not known; expected tip_radius_mm or machine"):
        tip_centres(surface, gauge, blocks, None)
    placed = sg.locate(surface, gauge, tip_radius_mm=RADIUS, surface=True)
    np.testing.assert_allclose(placed.c1_mm, locate(centres, gauge, blocks, 1.0, RADIUS).c1_mm, atol=1e-6)

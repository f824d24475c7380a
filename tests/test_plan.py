"""Planned paths: their order, the paper's example, and that nothing collides, judged by other code."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepgauge import plan
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import block_distance_mm, parse_placement, read_placement
from stepgauge.machine.file import Machine, MachineTable
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import ProbingSettings, Program, trace
from stepgauge.planning.check import check_program, check_travel
from stepgauge.planning.plan import (
    ORDERS,
    ROUTES,
    PlanOptions,
    faces_in_order,
    make_program,
    middle_standoff_mm,
    parse_blocks,
)
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from tests.build import Pose, angles, gauges, make_gauge, make_machine, make_points, make_pose, positions
from tests.conftest import ROOT

options = st.builds(
    PlanOptions,
    first_block=st.just(1),
    last_block=st.just(2),
    route=st.sampled_from(ROUTES),
    order=st.sampled_from(ORDERS),
    cycles=st.integers(1, 2),
    clearance_mm=st.floats(1.0, 10.0),
    around=st.sampled_from([1, -1]),
    height_mm=st.floats(-1.0, 3.0),
)


def checked_program(gauge: Gauge, pose: Pose, option: PlanOptions, machine: Machine) -> Program:
    radius = machine.probe.tip_radius_mm
    settings = ProbingSettings(standoff_mm=middle_standoff_mm(gauge, radius), tip_radius_mm=radius)
    placement = pose.placement(gauge)
    program = make_program(placement, gauge, option, settings)
    faces = [face for _, face in faces_in_order(option)]
    check_program(program, faces, placement, gauge, make_tool(machine.probe), option.margin_mm)
    return program


def smallest_gaps(program: Program, gauge: Gauge, pose: Pose, machine: Machine) -> tuple[float, float]:
    """Gap of the tip ball (searches and retracts left out) and of the shank, by sampling in gauge coordinates."""
    width, height = gauge.table.block_width_mm / 2, gauge.table.block_height_mm / 2
    boxes = [
        (np.array([front, -width, -height]), np.array([back, width, height]))
        for front, back in gauge.position_mm.reshape(-1, 2)
    ]
    rail = width + 10.0
    end = gauge.position_mm[-1]
    boxes.append((np.array([-15.0, -rail, -height - 30.0]), np.array([end + 15.0, rail, -height])))
    stops = (program.position_mm - pose.origin) @ pose.rotation.T
    upward = pose.rotation @ np.array([0.0, 0.0, 1.0])
    ball = shank = np.inf
    for i in range(1, len(stops)):
        length = np.linalg.norm(stops[i] - stops[i - 1])
        place = stops[i - 1] + np.linspace(0, 1, max(2, int(length / 0.5)))[:, None] * (stops[i] - stops[i - 1])
        at_face = program.is_measure[i] or program.is_measure[i - 1]
        for low, high in boxes:
            if not at_face:
                ball = min(ball, np.linalg.norm(place - np.clip(place, low, high), axis=1).min())
            for h in np.linspace(0, machine.probe.shank_length_mm, 41):
                at = place + h * upward
                shank = min(shank, np.linalg.norm(at - np.clip(at, low, high), axis=1).min())
    return ball - machine.probe.tip_radius_mm, shank - machine.probe.shank_radius_mm


@given(gauges(4), angles, st.floats(-0.03, 0.03), positions, options)
@settings(max_examples=30)
def test_no_planned_path_collides(gauge, yaw, pitch, origin, option) -> None:
    machine, pose = make_machine(), make_pose(yaw, pitch, origin=origin)
    program = checked_program(gauge, pose, option, machine)
    ball, shank = smallest_gaps(program, gauge, pose, machine)
    assert ball > option.margin_mm - 0.01
    assert shank > 0.05


@given(gauges(5), angles, st.floats(-1.4, 1.4), options)
def test_an_inclined_gauge_is_planned_clear_or_refused(gauge, yaw, pitch, option) -> None:
    machine, pose = make_machine(), make_pose(yaw, pitch)
    try:
        program = checked_program(gauge, pose, option, machine)
    except InputError as error:
        message = str(error)
    else:
        message = ""
    if message:
        assert "comes too close" in message
        return
    ball, shank = smallest_gaps(program, gauge, pose, machine)
    assert ball > option.margin_mm - 0.01
    assert shank > 0.05


@given(gauges(6), angles, st.floats(-0.03, 0.03), positions, options)
def test_every_measuring_move_aims_at_its_face(gauge, yaw, pitch, origin, option) -> None:
    pose = make_pose(yaw, pitch, origin=origin)
    program = checked_program(gauge, pose, option, make_machine())
    radius = program.settings.tip_radius_mm
    measure = program.is_measure
    tip = (program.position_mm[measure] - pose.origin) @ pose.rotation.T
    for (_, face), (a, s, up), approach in zip(faces_in_order(option), tip, program.approach[measure], strict=True):
        sign = 1 if face % 2 else -1
        assert a == pytest.approx(gauge.position_mm[face - 1] - sign * radius, abs=1e-9)
        assert (s, up) == pytest.approx((0.0, option.height_mm), abs=1e-9)
        np.testing.assert_allclose(approach, sign * pose.rotation[0], atol=1e-12)


def faces(order: str, cycles: int = 2) -> list[int]:
    return [face for _, face in faces_in_order(PlanOptions(2, 3, order=order, cycles=cycles))]


def test_the_orders_of_faces() -> None:
    assert faces("blocks") == [3, 4, 5, 6, 3, 4, 5, 6]
    assert faces("fronts-backs") == [3, 5, 4, 6, 3, 5, 4, 6]
    assert faces("up-down", 3) == [3, 4, 5, 6, 6, 5, 4, 3, 3, 4, 5, 6]


def test_the_program_printed_in_the_paper_comes_out_to_the_last_digit() -> None:
    """Pahk & Kim, Fig 4: gauge along y turned by 0.610 mrad, pitch 20 mm, side clearance 10 mm, approach 4.5 mm."""
    gauge = read_gauge(ROOT / "examples/fig4/gauge.toml")
    placement = read_placement(ROOT / "examples/fig4/placement.toml", gauge)
    option = PlanOptions(1, 30, order="fronts-backs", cycles=1, clearance_mm=2.0, home_mm=(0, 0, 400))
    settings = ProbingSettings(standoff_mm=4.5, tip_radius_mm=0.5)
    program = make_program(placement, gauge, option, settings)
    text = render(program, DIALECTS["jinyoung"])
    printed = (Path(__file__).parent / "data/pahk_kim_fig4.txt").read_text()
    assert text.startswith(printed)
    assert text.endswith("END;\n")


def too_small(gauge: Gauge, machine: Machine, origin: tuple[float, float, float]) -> str:
    pose = make_pose(0.0, 0.0, origin=origin)
    program = make_program(pose.placement(gauge), gauge, PlanOptions(1, 21, cycles=1), ProbingSettings())
    with pytest.raises(InputError) as caught:
        check_travel(program, machine)
    return str(caught.value)


def test_travel_that_is_too_small_names_the_point_and_by_how_much(gauge, machine) -> None:
    # the gauge runs from x = 300 to 710, its last stand-off lies 5 mm behind: 15 mm beyond a travel of 700
    message = too_small(gauge, machine, (300.0, 300.0, 200.0))
    assert "too small by 15.000 mm in x" in message
    assert "C1F42" in message
    assert "0 to 700 mm" in message
    assert "in z for point" in too_small(gauge, machine, (200.0, 300.0, 590.0))


def test_a_gauge_that_lies_wholly_outside_of_the_travel_is_asked_for_its_coordinates(gauge, machine) -> None:
    """It was told to be laid 260 to 313 mm farther on: its centres were in work coordinates."""
    message = too_small(gauge, machine, (900.0, 300.0, 200.0))
    assert "work coordinates instead of machine coordinates?" in message
    assert "lay the gauge" not in message


@pytest.mark.parametrize("side", [300.0, -5.0])
def test_the_gauge_moved_as_the_message_says_lies_within_the_travel(gauge, machine, side: float) -> None:
    message = too_small(gauge, machine, (side, 300.0, 200.0))
    told = re.search(r"lay the gauge (\S+) to (\S+) mm farther towards ([+-])x", message)
    assert told is not None
    for moved in (float(told[1]), float(told[2])):
        pose = make_pose(0.0, 0.0, origin=(side + (moved if told[3] == "+" else -moved), 300.0, 200.0))
        check_travel(
            make_program(pose.placement(gauge), gauge, PlanOptions(1, 21, cycles=1), ProbingSettings()), machine
        )


def test_a_path_that_is_longer_than_the_travel_says_what_makes_it_shorter(tmp_path: Path) -> None:
    """The 16 points of a bar of two blocks on a small mill; the stand-off that nobody states fits."""
    gauge = make_gauge(2, size=20.0, gap=100.0, height=20.0)
    travel = {"x": [-300, 0], "y": [-200, 0], "z": [-70, 0]}
    machine = make_machine(stylus_length_mm=60.0, stylus_diameter_mm=1.0, tip_radius_mm=1.0)
    table = MachineTable.model_validate(machine.table.model_dump(exclude_unset=True) | {"travel_mm": travel})
    machine = replace(machine, table=table)
    points = make_points(gauge, make_pose(0.0, 0.0, origin=(-220.0, -100.0, -58.0)), 1.0, (1, 2))
    rows = [f"{n},{x:.3f},{y:.3f},{z:.3f}" for n, (x, y, z) in enumerate(points, 1)]
    (tmp_path / "rough.csv").write_text("\n".join(["point,x_mm,y_mm,z_mm", *rows]) + "\n")
    with pytest.raises(InputError, match=r"too small .* in z .*the path takes \d.* mm; shorten it .* standoff_mm"):
        plan(tmp_path / "rough.csv", gauge, machine, teach=True, standoff_mm=45.0)
    assert plan(tmp_path / "rough.csv", gauge, machine, teach=True)


def refused(gauge: Gauge, machine: Machine, pitch: float = 0.0, **changes: object) -> str:
    option = PlanOptions(1, gauge.n_blocks, **{"cycles": 1, **changes})  # type: ignore[arg-type]
    with pytest.raises(InputError) as caught:
        checked_program(gauge, make_pose(0.3, pitch), option, machine)
    return str(caught.value)


def test_what_is_in_the_way_is_named() -> None:
    gauge = make_gauge(5)
    assert "tip ball comes too close to block" in refused(gauge, make_machine(), clearance_mm=0.2)
    assert "tip ball comes too close to the rail" in refused(gauge, make_machine(), height_mm=-5.4)
    short = make_machine(stylus_length_mm=8.0)
    assert "probe body comes too close to" in refused(gauge, short)
    assert "true size: body_diameter_mm = 25 (not stated, the usual one) in [probe]" in refused(gauge, short, 0.001)
    assert "body_diameter_mm = 30 in [probe]" in refused(gauge, make_machine(stylus_length_mm=8.0, body_diameter_mm=30))
    assert "stylus shank comes too close to" in refused(gauge, make_machine(), pitch=0.3)
    assert "not on the faces" in refused(gauge, make_machine(), height_mm=8.0)


@pytest.mark.parametrize("digits", [0, 1, 3])
@given(angle=st.floats(0.0, 6.28), x=st.floats(-9.0, 9.0), y=st.floats(-9.0, 9.0))
def test_what_rounding_makes_of_a_distance_is_no_scale_error(digits: int, angle: float, x: float, y: float) -> None:
    """Centres as a person states them, to 1 mm or 0.1 mm; the same 1.5 mm off is noted of finer ones."""
    gauge, axis = make_gauge(14), np.array([np.cos(angle), np.sin(angle), 0.0])
    ends = np.outer([0.0, block_distance_mm(gauge, 1, 14)], axis) + np.array([x, y, 0.123])
    for scale, noted in ((1.0, False), (1.003, True)) if digits == 3 else ((1.0, False),):
        c1, c2 = np.round(ends * scale, digits).tolist()
        text = f"c1_mm = {c1}\nc2_mm = {c2}\nfirst_block = 1\nlast_block = 14\n"
        found = parse_placement(text, "lies.toml", gauge)
        assert bool(found.details.get("notes")) is noted
        distance = np.linalg.norm(found.c2_mm - found.c1_mm)
        assert distance == pytest.approx(block_distance_mm(gauge, 1, 14), abs=0.3)


@pytest.mark.parametrize("percent", [0.3, -0.3, 0.9])
def test_a_placement_read_off_a_scale_that_is_off_is_planned_about_its_middle(tmp_path: Path, percent: float) -> None:
    """Block centres 500 mm apart as a mill shows them, by hand: direction, middle and the certified distance stay."""
    gauge = make_gauge(14)
    true = make_pose(0.3, 0.0).placement(gauge)
    lies, middle = tmp_path / "lies.toml", (true.c1_mm + true.c2_mm) / 2.0
    ends = [(middle + (end - middle) * (1.0 + percent / 100.0)).tolist() for end in (true.c1_mm, true.c2_mm)]
    lies.write_text(f"c1_mm = {ends[0]}\nc2_mm = {ends[1]}\nfirst_block = 1\nlast_block = 14\n")
    table = make_machine().table
    mill = replace(make_machine(), table=table.model_copy(update={"kind": "machine tool"}))
    for machine in (None, make_machine()):
        with pytest.raises(InputError, match=r'kind = "machine tool"'):
            plan(lies, gauge, machine, cycles=1, tip_radius_mm=2.0)
    known = plan(true, gauge, mill, cycles=1, tip_radius_mm=2.0).program
    if abs(percent) > 0.5:
        with pytest.raises(InputError, match=r"the search is too short.*expected search_mm 1\.6"):
            plan(lies, gauge, mill, cycles=1, tip_radius_mm=2.0, search_mm=1.0)
    planned = plan(lies, gauge, mill, cycles=1, tip_radius_mm=2.0, search_mm=4.0)
    assert re.search(rf"{abs(percent):.2f} % .*too {'long' if percent > 0 else 'short'}", planned.summary())
    np.testing.assert_allclose(planned.program.position_mm, known.position_mm, atol=1e-6)
    lies.write_text(lies.read_text().replace("last_block = 14", "last_block = 13"))
    with pytest.raises(InputError, match="are not blocks 1 and 13"):
        plan(lies, gauge, mill, cycles=1, tip_radius_mm=2.0)


def test_a_head_turned_square_to_a_steep_gauge_has_room() -> None:
    """The remedy that the message of a steep gauge gives must work."""
    gauge, pose = make_gauge(5), make_pose(0.3, 1.0)
    square = tuple(-pose.rotation[2])
    program = checked_program(gauge, pose, PlanOptions(1, 5, cycles=1), make_machine(stylus_direction=square))
    assert program.n_points == 10


def test_a_ball_that_does_not_fit_between_the_blocks_is_refused() -> None:
    with pytest.raises(InputError, match=r"does not fit between the blocks.*12 mm.*10\.000 mm"):
        middle_standoff_mm(make_gauge(3), 6.0)


def test_a_search_that_meets_another_block_first_is_refused() -> None:
    """A program whose points are shifted by half a pitch aims at nothing or at the wrong face."""
    gauge, pose = make_gauge(4), make_pose(0.0, 0.0)
    option = PlanOptions(1, 4, cycles=1)
    program = make_program(pose.placement(gauge), gauge, option, ProbingSettings(standoff_mm=2.999))
    shifted = make_pose(0.0, 0.0, origin=(0.0, 30.0, 0.0)).placement(gauge)
    listed = [face for _, face in faces_in_order(option)]
    with pytest.raises(InputError, match=r"C1F1.*does not meet its own face first; found nothing"):
        check_program(program, listed, shifted, gauge, make_tool(make_machine().probe), 0.5)
    along = make_pose(0.0, 0.0, origin=(0.5, 0.0, 0.0)).placement(gauge)  # clear of everything, but 0.5 mm off
    with pytest.raises(InputError, match=r"found block 1, 0\.500 mm from there; expected face 1 of block 1"):
        check_program(program, listed, along, gauge, make_tool(make_machine().probe), 0.5)


@pytest.mark.parametrize("text", ["1", "a:b", "0:3", "3:2", "2:2", "1:99", "1:2:3"])
def test_ranges_of_blocks_that_cannot_be_are_refused(gauge: Gauge, text: str) -> None:
    with pytest.raises(InputError, match="block"):
        parse_blocks(text, gauge)


def test_ranges_of_blocks(gauge: Gauge) -> None:
    assert parse_blocks("2:20", gauge) == (2, 20)
    assert parse_blocks(":", gauge) == (1, 21)


def test_the_path_of_a_controller_that_positions_itself_passes_the_standoff() -> None:
    gauge, pose = make_gauge(2), make_pose(0.0, 0.0)
    program = make_program(
        pose.placement(gauge), gauge, PlanOptions(1, 2, cycles=1), ProbingSettings(standoff_mm=2.999)
    )
    one = trace(program)
    other = trace(Program(**{**program.__dict__, "self_positioning": True}))
    assert one.measuring.sum() == other.measuring.sum() == 4
    np.testing.assert_allclose(other.start_mm[other.measuring], one.start_mm[one.measuring], atol=1e-9)
    np.testing.assert_allclose(other.end_mm[other.measuring], one.end_mm[one.measuring], atol=1e-12)
    np.testing.assert_allclose(other.start_mm[1:], other.end_mm[:-1])

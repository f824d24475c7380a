"""A small part of ``benchmarks.attack.collisions``, and that its own check finds what is planted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from benchmarks.attack.collisions import Scene, attack, ball_too_near, draw, look
from benchmarks.attack.controllers import CONTROLLERS, Piece
from benchmarks.attack.swept import least_distance
from stepgauge.errors import InputError
from stepgauge.motion.moves import Program
from stepgauge.planning.program import checked_program, make_settings, program_text

numbers = st.integers(0, 2**31 - 1)


@given(numbers)
@settings(max_examples=25)
def test_no_text_of_a_random_placement_collides_or_differs_from_its_plan(number: int) -> None:
    count, wrong = attack(1, number)
    assert not wrong
    assert count["texts"] == len(CONTROLLERS) * count["planned"]


def planned(number: int, dialect: str) -> tuple[Scene, Program, list[Piece]]:
    scene = draw(2, number)
    try:
        chosen = make_settings(scene.gauge, scene.machine, scene.machine.probe.tip_radius_mm, scene.choice)
        program = checked_program(scene.placement, scene.gauge, scene.machine, scene.options, chosen)
    except InputError:
        assume(False)
    text = program_text(program, dialect).text
    return scene, program, CONTROLLERS[dialect](text, chosen.tip_radius_mm, chosen.search_mm)


@given(numbers, st.data())
@settings(max_examples=15, suppress_health_check=[HealthCheck.filter_too_much])
def test_a_way_straight_through_the_blocks_is_found(number: int, data: st.DataObject) -> None:
    """The ways around a block left out: from one stand-off straight to the next, through what lies between."""
    scene, _, pieces = planned(number, "jinyoung")
    fronts = [row for row, piece in enumerate(pieces) if piece.what == "measure"]
    first = data.draw(st.sampled_from(range(len(fronts) - 1)))
    assume(scene.faces()[first] % 2 == 1 and scene.faces()[first + 1] == scene.faces()[first] + 1)
    one, other = fronts[first], fronts[first + 1]
    short = [*pieces[: one + 2], Piece(pieces[one + 1].end, pieces[other].start, "travel"), *pieces[other:]]
    assert "the ball comes within -" in ball_too_near(scene, short, 2e-3)[0]


@pytest.mark.parametrize("dialect", CONTROLLERS)
@given(number=numbers, data=st.data())
@settings(max_examples=5)
def test_a_place_that_is_not_the_planned_one_is_found(dialect: str, number: int, data: st.DataObject) -> None:
    scene, program, pieces = planned(number, dialect)
    row = data.draw(st.sampled_from([row for row, piece in enumerate(pieces) if piece.what == "measure"]))
    by = data.draw(st.sampled_from([0.01, -1.0, 30.0])) * np.eye(3)[data.draw(st.integers(0, 2))]
    end = pieces[row].end + by
    bent = [*pieces]
    bent[row : row + 2] = [pieces[row]._replace(end=end), pieces[row + 1]._replace(start=end)]
    assert "mm off face" in look(scene, dialect, bent, program)[0]


@given(st.lists(st.floats(-20.0, 20.0), min_size=9, max_size=9))
def test_the_sweep_finds_the_least_distance(values: list[float]) -> None:
    """Against a fine grid; never less than the distance, and no more than the grid finds."""
    start, step, shank = np.array(values).reshape(3, 3)
    low, high = np.array([-5.0, -3.0, -2.0]), np.array([5.0, 3.0, 2.0])
    found = least_distance(*(np.array([one]) for one in (start, step, np.zeros(3), shank, low, high)))[0]
    t, h = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    place = start + t[..., None] * step + h[..., None] * shank
    grid = np.linalg.norm(place - np.clip(place, low, high), axis=-1).min()
    assert found <= grid + 2e-3
    assert found >= grid - (np.linalg.norm(step) + np.linalg.norm(shank)) / 200.0
